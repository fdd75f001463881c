//! The commands: from the options to a written mesh and a summary.

mod decompose;
mod disk;
mod extras;
mod outputs;
mod ranks;
mod repartition;
mod view;
mod write;

use decompose::cut_settings;
pub use decompose::run_decompose;
use disk::disk_for;
pub use extras::{long_version, run_completions, run_man};
use outputs::Outputs;
pub use ranks::on_one_rank;
use ranks::{on_ranks, set_threads};
pub use repartition::run_repartition;
pub use view::run_view;
use write::{note_losses, place_of, read_back, refuse_unknown, write_formats};

use crate::failure::{Failure, Status, agree};
use crate::options::{
    Check, FileFormat, Format, Generate, InputOptions, Inspect, MeshFile, Method, Quality, SizeOptions,
};
use crate::report::{Report, counted, processes};
use crate::terminal::Terminal;
use std::path::{Path, PathBuf};
use std::time::Instant;
use tetmill::comm::{Communicator, thread};
use tetmill::files::{Destination, elmer, mesh_size, picture, refuse_missing, serial};
use tetmill::mesh::{MeshStream, Watched};
use tetmill::progress::{Progress, Silent, Stage};
use tetmill::run::{CoarseSettings, GenerateSettings, Outcome, Wanted, balance, generate};
use tetmill::size::{Closeness, SizeSettings};
use tetmill::{Geometry, InputSettings, files, quality};

/// `tetmill generate`
pub fn run_generate(options: &Generate) -> Result<(), Failure> {
    set_threads(options.run.threads)?;
    refuse_unknown(&options.run)?;
    let start = Instant::now();
    on_ranks(options.ranks, options.parts, |comm| generate_on(comm, options, start))
}

fn method_of(options: &Generate) -> Result<tetmill::Method, Failure> {
    match options.method {
        Method::Refine => Ok(tetmill::Method::Refine),
        Method::Surface => Ok(tetmill::Method::Surface),
        Method::Decompose => cut_settings(&options.planes).map(tetmill::Method::Decompose),
    }
}

/// **Collective.** `tetmill generate` on one rank.
fn generate_on(comm: &dyn Communicator, options: &Generate, start: Instant) -> Result<(), Failure> {
    let first = comm.rank() == 0;
    let target = options.output.clone().unwrap_or_else(|| {
        options.input.files[0].with_extension("").file_name().map_or_else(|| "mesh".into(), PathBuf::from)
    });
    let stem = target.join(options.input.files[0].file_stem().unwrap_or("mesh".as_ref()));
    let outputs = agree(comm, prepared(comm, || outputs_of(options, &target, &stem, comm.size())))?;
    let terminal = Terminal::new(options.run.quiet || !first);
    let progress = watched(&terminal, first);
    let geometry = first
        .then(|| {
            progress.stage(Stage::Read, |_| read_sized_geometry(&options.input, &options.size, &progress))
        })
        .transpose();
    let geometry = agree(comm, geometry)?;
    let coarse = agree(comm, coarse_settings(&options.size, geometry.as_ref()))?;
    let coarse = CoarseSettings { order: options.order.order(), ..coarse };
    let disk = Some(disk_for(&options.run, coarse.order, &target));
    let method = agree(comm, method_of(options))?;
    let settings = GenerateSettings {
        method,
        coarse,
        wanted: wanted(options),
        memory: options.memory,
        disk,
        nested: options.nested,
        refine: options.refine,
        allow_off_surface: options.order.allow_off_surface,
        periodic_together: options.run.format.contains(&Format::Elmer) && !options.run.allow_split_periodic,
    };
    let made = generate(comm, geometry.as_ref(), &settings, &progress)?;
    let (written, halo) = progress.stage(Stage::Write, |work| {
        write_formats(comm, made.part.stream(), &made.names, &options.run, [&target, &stem], &progress, work)
    })?;
    read_back(comm, &options.run, &target, &progress)?;
    match &options.picture {
        Some(_) if !made.part.keeps_all() => {
            progress.note("no picture was drawn, because the coordinates of the mesh do not fit in memory")
        }
        Some(file) => draw(comm, made.part.stream(), options.cut, file)?,
        None => {}
    }
    let title = view::title_of(&options.input);
    let page = options.report_html.as_ref().map(|file| (file, view::shown(&made, &title)));
    let balanced = balance(comm, &made.part)?;
    let took = processes(comm)?;
    let done = geometry.map_or(Ok(None), |geometry| {
        let mut report = Report::new(&geometry, &name_of(&options.input), &made, took, comm.size(), balanced);
        report.halo = halo;
        terminal.finish();
        report.stages = progress.times();
        report.seconds = start.elapsed().as_secs_f64();
        report.add_written(written);
        let (file, quiet) = (options.run.report.as_deref(), options.run.quiet);
        show_report(&report, file, &outputs, quiet, wanted_count(options))?;
        Ok(Some(report))
    });
    let report = agree(comm, done)?;
    if let Some((file, mut shown)) = page {
        let beside = view::beside_report(comm, &made, &shown)?;
        shown.about.report = report.map(|report| {
            let mut report = serde_json::to_value(report).expect("plain data");
            report["page"] = beside;
            report
        });
        let message = shown.for_page(comm)?;
        agree(comm, if first { view::write_page(&message, file) } else { Ok(()) })?;
    }
    if options.view { view::serve_generated(comm, made, &title, options.port) } else { Ok(()) }
}

/// The progress of a run on one rank, on the first with the peak memory of its process.
fn watched(terminal: &Terminal, first: bool) -> Progress<'_> {
    let progress = Progress::new(terminal);
    if first { progress.measuring_memory() } else { progress }
}

/// The files that `generate` reads and writes.
fn outputs_of(options: &Generate, target: &Path, stem: &Path, parts: u32) -> Outputs {
    reading(&options.input, &options.size)
        .and_reading(options.planes.planes_from.as_ref())
        .folder(target, stem, &options.run, parts)
        .file("--report", options.run.report.as_ref())
        .file("--picture", options.picture.as_ref())
        .file("--report-html", options.report_html.as_ref())
}

/// Prepares the outputs on rank 0, which creates the files; returns empty outputs on other ranks.
fn prepared(comm: &dyn Communicator, outputs: impl FnOnce() -> Outputs) -> Result<Outputs, Failure> {
    if comm.rank() != 0 {
        return Ok(Outputs::default());
    }
    let outputs = outputs();
    outputs.prepare()?;
    Ok(outputs)
}

/// The files that the mesher reads.
fn reading(input: &InputOptions, size: &SizeOptions) -> Outputs {
    Outputs::reading(&input.files).and_reading(size.mesh_size_file.as_ref())
}

/// Reads the input and prints its notes.
fn read_geometry(options: &InputOptions, progress: &Progress) -> Result<Geometry, Failure> {
    let InputOptions { keep_surface, keep_small, merge, unit, overlap_to, .. } = *options;
    let solids = options.solids.clone();
    let mut settings = InputSettings {
        keep_surface,
        keep_small,
        merge,
        unit,
        solids,
        overlap_to,
        ..InputSettings::default()
    };
    if let Some(degrees) = options.feature_angle {
        settings.facets.feature_angle = degrees.to_radians();
    }
    Ok(Geometry::read(&options.files, &settings, &mut |note| progress.note(note))?)
}

/// Reads the input; sizes are an error if it is a mesh already.
fn read_sized_geometry(
    options: &InputOptions,
    size: &SizeOptions,
    progress: &Progress,
) -> Result<Geometry, Failure> {
    let geometry = read_geometry(options, progress)?;
    let SizeOptions { preset, maxh, minh, grading, closeness, effort, coarse, mesh_size_file } = size;
    let sized =
        [maxh, minh, grading, closeness].iter().any(|length| length.is_some()) || mesh_size_file.is_some();
    if geometry.is_mesh() && (sized || preset.is_some() || effort.is_some() || coarse.is_some()) {
        return Err(Failure::input(format!(
            "{} is a mesh already and is taken as it is: leave out --preset, --maxh, --minh, --grading, \
             --closeness, --mesh-size-file, --effort and --coarse",
            name_of(options)
        )));
    }
    Ok(geometry)
}

/// The names of the inputs, separated by commas.
fn name_of(options: &InputOptions) -> String {
    let names: Vec<String> = options.files.iter().map(|file| file.display().to_string()).collect();
    names.join(", ")
}

/// Settings of the coarse mesh. Only the rank with the geometry, which makes the mesh, reads the
/// mesh-size file.
fn coarse_settings(options: &SizeOptions, geometry: Option<&Geometry>) -> Result<CoarseSettings, Failure> {
    let mut settings = SizeSettings::from(options.preset.unwrap_or_default());
    settings.maxh = options.maxh;
    settings.minh = options.minh.unwrap_or(settings.minh);
    settings.grading = options.grading.unwrap_or(settings.grading);
    if let Some(ratio) = options.closeness {
        settings.closeness = Closeness::of_ratio(ratio);
    }
    if let (Some(file), Some(geometry)) = (&options.mesh_size_file, geometry) {
        let least = geometry.least_size().unwrap_or(0.0);
        settings.sources = mesh_size::read_from(file, least).map_err(Failure::input)?;
    }
    Ok(CoarseSettings { effort: options.effort, ..settings.into() })
}

fn wanted(options: &Generate) -> Wanted {
    match options.elements {
        Some(count) => Wanted::Elements(count),
        None => wanted_coarse(&options.size, options.pieces.unwrap_or(1 << options.levels)),
    }
}

fn wanted_coarse(size: &SizeOptions, pieces: u32) -> Wanted {
    match size.coarse {
        Some(tets) => Wanted::Coarse { tets, pieces },
        None => Wanted::Sizes { pieces },
    }
}

fn wanted_count(options: &Generate) -> Option<u64> {
    options.elements.or(options.size.coarse)
}

/// **Collective.** Draws the surface of the mesh, or of the part behind a plane.
///
/// The colours are those of the parts, or of the patches if there is one part.
fn draw(
    comm: &dyn Communicator,
    part: &dyn MeshStream,
    cut: Option<picture::Cut>,
    file: &Path,
) -> Result<(), Failure> {
    let color_by = if comm.size() > 1 { picture::ColorBy::Part } else { picture::ColorBy::Patch };
    let scene = picture::scene_of_part(part, &picture::Look { color_by, cut });
    let view = cut.as_ref().map_or_else(picture::Settings::default, picture::Settings::facing);
    let drawn = match picture::gather(comm, &scene)? {
        Some(scene) => picture::write_png(&picture::render(&scene, &view), file),
        None => Ok(()),
    };
    agree(comm, drawn.map_err(Failure::from))
}

/// Prints the summary and writes the report file.
fn show_report(
    report: &Report,
    file: Option<&Path>,
    outputs: &Outputs,
    quiet: bool,
    wanted: Option<u64>,
) -> Result<(), Failure> {
    if !quiet {
        outputs.show(format_args!("{report}\n"))?;
    }
    if let (Some(wanted), Some(outcome)) = (wanted, report.wanted) {
        let wanted = counted(wanted, "tet", "tets");
        let got = counted(report.coarse.tets, "coarse tet", "coarse tets");
        match outcome {
            Outcome::Reached => {}
            Outcome::Least => {
                eprintln!("note: {wanted} requested; the least that this geometry allows is {got}")
            }
            Outcome::Jumped => {
                eprintln!("note: {wanted} requested; no size gives this number, the next larger is {got}")
            }
            Outcome::Fewer => {
                eprintln!("note: {wanted} requested; the search ended after several coarse meshes with {got}")
            }
        }
    }
    write_report(file, report)
}

/// Writes the report file if one was requested.
fn write_report(file: Option<&Path>, report: &impl serde::Serialize) -> Result<(), Failure> {
    match file {
        Some(file) => write_whole(file, &(serde_json::to_string_pretty(report).expect("plain data") + "\n")),
        None => Ok(()),
    }
}

/// Writes to the standard output.
fn show(text: std::fmt::Arguments) -> Result<(), Failure> {
    Outputs::default().show(text)
}

/// Writes a text file. An existing file is unchanged if this fails.
fn write_whole(file: &Path, text: &str) -> Result<(), Failure> {
    files::write_file(file, text.len() as u64, |output| output.write(text.as_bytes()))?;
    Ok(())
}

/// The output format, by option or extension; an error if the destination does not support it.
fn format_of(options: &MeshFile) -> Result<serial::Format, Failure> {
    let format = match options.format {
        Some(FileFormat::Vtu) => serial::Format::Vtu,
        Some(FileFormat::Msh) => serial::Format::Gmsh,
        Some(FileFormat::Mesh) => serial::Format::Medit,
        Some(FileFormat::Vol) => serial::Format::Netgen,
        Some(FileFormat::Inp) => serial::Format::Abaqus,
        Some(FileFormat::Off) => serial::Format::Off,
        None => serial::Format::of(&options.output)?,
    };
    format.fits(&options.output)?;
    Ok(format)
}

/// `tetmill mesh`
pub fn run_mesh(options: &MeshFile) -> Result<(), Failure> {
    let start = Instant::now();
    for file in &options.input.files {
        refuse_missing(file)?;
    }
    let format = format_of(options)?;
    if options.boundary.is_some() && format != serial::Format::Vtu {
        return Err(Failure::input("--boundary: only VTU supports it; write a .vtu"));
    }
    let place = place_of(options.boundary);
    let second = format.second(&options.output).filter(|_| place == files::vtu::Boundary::Beside);
    let outputs = reading(&options.input, &options.size)
        .file("-o", Some(&options.output))
        .file("-o", second.as_ref())
        .file("--report", options.report.as_ref())
        .file("--picture", options.picture.as_ref());
    outputs.prepare()?;
    set_threads(options.threads)?;
    let comm = thread::alone();
    let terminal = Terminal::new(options.quiet);
    let progress = watched(&terminal, true);
    let geometry =
        progress.stage(Stage::Read, |_| read_sized_geometry(&options.input, &options.size, &progress))?;
    let settings = GenerateSettings {
        method: tetmill::Method::default(),
        coarse: CoarseSettings {
            order: options.order.order(),
            ..coarse_settings(&options.size, Some(&geometry))?
        },
        wanted: wanted_coarse(&options.size, 1),
        memory: None,
        disk: None,
        nested: false,
        refine: 0,
        allow_off_surface: options.order.allow_off_surface,
        periodic_together: false,
    };
    let made = generate(&comm, Some(&geometry), &settings, &progress)?;
    let (part, file) = (made.part.stream(), &options.output);
    let written = progress.stage(Stage::Write, |work| {
        let part = &Watched::new(part, work, 1);
        match format {
            serial::Format::Vtu => files::vtu::write_with(&comm, part, &made.names, file, place),
            _ => serial::write_as(part, &made.names, format, file),
        }
    })?;
    note_losses(&made.names, format, file, &progress);
    if let Some(file) = &options.picture {
        draw(&comm, made.part.stream(), options.cut, file)?;
    }
    let balanced = balance(&comm, &made.part)?;
    let mut report = Report::new(&geometry, &name_of(&options.input), &made, processes(&comm)?, 1, balanced);
    terminal.finish();
    report.stages = progress.times();
    report.seconds = start.elapsed().as_secs_f64();
    report.add_written(written);
    show_report(&report, options.report.as_deref(), &outputs, options.quiet, options.size.coarse)
}

/// `tetmill check`
pub fn run_check(options: &Check) -> Result<(), Failure> {
    let checked = elmer::check_elmer(&options.directory).map_err(Failure::input)?;
    let mut faulty = Vec::new();
    for (layout, faults) in &checked {
        let folder = layout.folder().display();
        if options.json {
            let result = serde_json::json!({
                "mesh": folder.to_string(), "ok": faults.is_empty(), "text": faults.to_string()
            });
            show(format_args!("{result}\n"))?;
        } else if faults.is_empty() {
            show(format_args!("{folder}: no faults\n"))?;
        } else {
            show(format_args!("{folder}: {faults}\n"))?;
        }
        if !faults.is_empty() {
            faulty.push(folder.to_string());
        }
    }
    if faulty.is_empty() {
        Ok(())
    } else {
        Err(Failure::new(Status::Faults, format!("faults in {}", faulty.join(", "))))
    }
}

/// `tetmill quality`
pub fn run_quality(options: &Quality) -> Result<(), Failure> {
    let outputs = Outputs::reading(&options.meshes).file("--picture", options.picture.as_ref());
    outputs.prepare()?;
    if let Some(file) = &options.picture {
        refuse_other_pictures(file)?;
    }
    if options.json && outputs.take_stdout() {
        return Err(Failure::input(
            "--json and --picture both write to the standard output; give a file name",
        ));
    }
    let (mut meshes, mut unreadable) = (Vec::new(), Vec::new());
    // One at a time: each is measured by all threads, and only one must fit in memory.
    for path in &options.meshes {
        match files::volume::read(path) {
            Ok(read) => meshes.push(quality::Quality::of_file(path.display().to_string(), &read)),
            Err(error) => unreadable.push(error.to_string()),
        }
    }
    if options.json {
        let json = serde_json::json!({ "version": env!("CARGO_PKG_VERSION"), "meshes": meshes });
        show(format_args!("{}\n", serde_json::to_string_pretty(&json).expect("plain data")))?;
    } else if !meshes.is_empty() {
        outputs.show(format_args!("{}", quality::table(&meshes)))?;
    }
    if let Some(file) = &options.picture {
        write_whole(file, &quality::histograms(&meshes))?;
    }
    if !unreadable.is_empty() {
        return Err(Failure::input(unreadable.join("\n")));
    }
    let faulty: Vec<String> = meshes
        .iter()
        .filter(|mesh| mesh.inverted + mesh.not_valid.unwrap_or(0) > 0)
        .map(|mesh| {
            let tets = match mesh.not_valid {
                Some(count) if count > 0 => {
                    counted(count as u64, "invalid curved tet", "invalid curved tets")
                }
                _ => counted(mesh.inverted as u64, "inverted tet", "inverted tets"),
            };
            format!("{tets} in {}", mesh.mesh)
        })
        .collect();
    if faulty.is_empty() { Ok(()) } else { Err(Failure::new(Status::Faults, faulty.join(", "))) }
}

/// Refuses extensions other than `.svg` for histograms; pipes and devices have none.
fn refuse_other_pictures(file: &Path) -> Result<(), Failure> {
    let is_file = matches!(Destination::of(file), Ok(Destination::File(_)));
    if is_file && file.extension().is_none_or(|ending| !ending.eq_ignore_ascii_case("svg")) {
        return Err(Failure::input(format!("histograms are drawn as .svg, not {}", file.display())));
    }
    Ok(())
}

/// `tetmill inspect`
pub fn run_inspect(options: &Inspect) -> Result<(), Failure> {
    let progress = Progress::new(&Silent);
    let geometry = read_geometry(&options.input, &progress)?;
    let Some(seen) = geometry.inspect() else {
        let name = name_of(&options.input);
        return Err(Failure::input(format!("{name} is a mesh, not a geometry: use `tetmill quality`")));
    };
    if options.json {
        show(format_args!("{}\n", serde_json::to_string_pretty(&seen).expect("plain data")))?;
    } else {
        show(format_args!("{seen}"))?;
    }
    Ok(())
}
