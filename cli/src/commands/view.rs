//! `tetmill view`, and the views of a run.

use super::outputs::Outputs;
use super::{
    coarse_settings, on_ranks, read_sized_geometry, reading, set_threads, wanted_coarse, write_whole,
};
use crate::cancel;
use crate::failure::{Failure, Status, agree};
use crate::options::{InputOptions, View};
use crate::report::{Report, counted};
use crate::terminal::Terminal;
use std::path::{Path, PathBuf};
use tetmill::Generated;
use tetmill::comm::Communicator;
use tetmill::files::view::{About, Fill, ViewPart, gather, message, of_mesh, part};
use tetmill::files::{elmer, elmer::Layout, refuse_missing, volume};
use tetmill::mesh::{BareMesh, BareStream, Counts, MeshStream, Names};
use tetmill::progress::{Progress, Stage};
use tetmill::run::{GenerateSettings, generate};

/// Maximum number of tets in a page: with 90 bytes each, below 20 MB.
pub const IN_FILE: u64 = 200_000;

/// Maximum number of tets of a level that is served: the browser takes some 300 bytes for each.
pub const SERVED: u64 = 1_000_000;

/// Maximum number of tets at the surface of a mesh that is too large to be shown whole.
const MOST_HOLLOW: u64 = 3 * SERVED;

/// Maximum number of boundary triangles of a level of which only the surface is shown.
const MOST_FACES: u64 = 600_000;

/// A level of a mesh on rank 0: its parts, and what is said about them. The finest comes first.
pub struct Viewed {
    parts: Vec<ViewPart>,
    about: About,
}

/// `tetmill view`
pub fn run_view(options: &View) -> Result<(), Failure> {
    for file in &options.input.files {
        refuse_missing(file)?;
    }
    set_threads(options.threads)?;
    match &options.input.files[..] {
        [file] if volume::is_mesh(file) => {
            let parts = if file.is_dir() { parts_of(file)? } else { 1 };
            on_ranks(None, Some(parts), |comm| view_mesh(comm, options, file))
        }
        _ => on_ranks(options.ranks, None, |comm| view_geometry(comm, options)),
    }
}

/// The names of the inputs without their folders.
pub fn title_of(input: &InputOptions) -> String {
    let name =
        |file: &PathBuf| file.file_name().map_or("mesh".into(), |name| name.to_string_lossy().into_owned());
    input.files.iter().map(name).collect::<Vec<_>>().join(", ")
}

fn parts_of(folder: &Path) -> Result<u32, Failure> {
    Ok(match elmer::only_layout(folder)? {
        Layout::Serial(_) => 1,
        Layout::Partitioned { parts, .. } => parts,
    })
}

fn outputs_of(options: &View) -> Outputs {
    reading(&options.input, &options.size).file("-o", options.output.as_ref())
}

/// The number of tets up to which a level is shown whole.
fn most_tets(options: &View) -> u64 {
    if options.output.is_some() { IN_FILE } else { SERVED }
}

/// **Collective.** Shows a mesh from a file on one rank, or an Elmer partition on a rank for each
/// part.
fn view_mesh(comm: &dyn Communicator, options: &View, file: &Path) -> Result<(), Failure> {
    let first = comm.rank() == 0;
    let outputs = if first { outputs_of(options).prepare() } else { Ok(()) };
    agree(comm, outputs)?;
    let most = most_tets(options);
    let title = title_of(&options.input);
    let view = if file.is_dir() {
        let loaded = elmer::load(comm, file)?;
        if first {
            loaded.notes.iter().for_each(|note| eprintln!("note: {note}"));
        }
        let stream = BareStream::new(BareMesh::from(loaded.mesh));
        of_stream(comm, &stream, about(&title, &loaded.names, &stream), most)?
    } else {
        let read = volume::read(file)?;
        read.notes.iter().for_each(|note| eprintln!("note: {note}"));
        let tets = read.mesh.tets.len() as u64;
        let totals = Counts {
            vertices: read.mesh.points.len() as u64,
            tets,
            boundary: read.mesh.triangles.len() as u64,
        };
        let fill = fill_of(tets, most);
        let parts = vec![of_mesh(&read.mesh, fill)];
        refuse_large(&parts)?;
        let periodic = read.links.iter().map(|link| [link.image.0, link.of.0]).collect();
        let hollow = fill == Fill::Hollow;
        let about = About { title, names: read.names, totals, hollow, periodic, ..About::default() };
        vec![Viewed { parts, about }]
    };
    finish(comm, view, options)
}

/// **Collective.** Meshes a geometry and shows the mesh.
fn view_geometry(comm: &dyn Communicator, options: &View) -> Result<(), Failure> {
    let first = comm.rank() == 0;
    let outputs = if first { outputs_of(options).prepare() } else { Ok(()) };
    agree(comm, outputs)?;
    let terminal = Terminal::new(options.quiet || !first);
    let progress = Progress::new(&terminal);
    let geometry = first.then(|| {
        progress.stage(Stage::Read, |_| read_sized_geometry(&options.input, &options.size, &progress))
    });
    let geometry = agree(comm, geometry.transpose())?;
    let settings = GenerateSettings {
        coarse: agree(comm, coarse_settings(&options.size, geometry.as_ref()))?,
        wanted: wanted_coarse(&options.size, 1 << options.levels),
        ..GenerateSettings::default()
    };
    let made = generate(comm, geometry.as_ref(), &settings, &progress)?;
    let most = most_tets(options);
    let views = of_generated(comm, &made, &title_of(&options.input), most)?;
    terminal.finish();
    finish(comm, views, options)
}

/// **Collective.** Writes or serves the views on rank 0.
fn finish(comm: &dyn Communicator, views: Vec<Viewed>, options: &View) -> Result<(), Failure> {
    let done = match &options.output {
        _ if comm.rank() != 0 => Ok(()),
        Some(file) => write_page(views, None, file),
        None => serve(views, options.port),
    };
    agree(comm, done)
}

fn about(title: &str, names: &Names, stream: &dyn MeshStream) -> About {
    About {
        title: title.into(),
        names: names.clone(),
        totals: stream.totals(),
        periodic: stream.links().iter().map(|link| [link.image.0, link.of.0]).collect(),
        ..About::default()
    }
}

fn fill_of(tets: u64, most: u64) -> Fill {
    if tets <= most { Fill::Full } else { Fill::Hollow }
}

fn refuse_large(parts: &[ViewPart]) -> Result<(), Failure> {
    let tets: u64 = parts.iter().map(|part| part.tets.len() as u64).sum();
    if tets <= MOST_HOLLOW {
        return Ok(());
    }
    Err(Failure::input(format!(
        "the surface of the mesh has {}, and at most {MOST_HOLLOW} can be shown: show a coarser mesh",
        counted(tets, "tet", "tets")
    )))
}

/// **Collective.** The only level of a mesh that is stored.
fn of_stream(
    comm: &dyn Communicator,
    stream: &dyn MeshStream,
    about: About,
    most: u64,
) -> Result<Vec<Viewed>, Failure> {
    let fill = fill_of(stream.totals().tets, most);
    let parts = gather(comm, &part(stream, fill))?;
    agree(comm, refuse_large(&parts))?;
    Ok(vec![Viewed { parts, about: About { hollow: fill == Fill::Hollow, ..about } }])
}

/// **Collective.** The levels of a mesh with at most this many tets; the finest first. A mesh
/// without levels, or with too large a coarse mesh, is hollow.
pub fn of_generated(
    comm: &dyn Communicator,
    made: &Generated,
    title: &str,
    most: u64,
) -> Result<Vec<Viewed>, Failure> {
    let stream = made.stream();
    let about = about(title, &made.names, stream);
    let n = made.pieces;
    let coarse = stream.totals().tets / u64::from(n).pow(3);
    // Any number of subdivisions is a level; the check of the mesh is about n and its halves only.
    let largest = |fits: &dyn Fn(u64) -> bool| (1..=n).rev().find(|&m| fits(m.into()));
    let finest = largest(&|m| coarse * m.pow(3) <= most);
    let mut levels: Vec<u32> = std::iter::successors(finest, |&m| (m > 1).then_some(m / 2)).collect();
    if most == SERVED {
        // The surface of a finer level.
        let boundary = stream.totals().boundary / u64::from(n).pow(2);
        levels.extend(largest(&|m| boundary * m.pow(2) <= MOST_FACES).filter(|&m| Some(m) > finest));
    }
    let mut views = Vec::new();
    for m in levels {
        let about = About { pieces: Some([n, m]), ..about.clone() };
        if m == n {
            views.append(&mut of_stream(comm, stream, about, most)?);
        } else if let Some(level) = agree(comm, made.with_pieces(m).map_err(Failure::from))? {
            views.append(&mut of_stream(comm, &level, about, most)?);
        }
    }
    if views.is_empty() {
        return of_stream(comm, stream, about, most);
    }
    Ok(views)
}

/// Writes the finest level as a page, with the report if there is one.
pub fn write_page(views: Vec<Viewed>, report: Option<&Report>, file: &Path) -> Result<(), Failure> {
    let mut finest = views.into_iter().next().expect("a mesh has a level");
    finest.about.report = report.map(|report| serde_json::to_value(report).expect("plain data"));
    write_whole(file, &tetmill_view::page(&message(&finest.parts, &finest.about)))
}

/// Serves the levels until Ctrl-C.
pub fn serve(views: Vec<Viewed>, port: Option<u16>) -> Result<(), Failure> {
    let level = |view: Viewed| tetmill_view::Level {
        pieces: view.about.pieces.map_or(1, |[_, shown]| shown),
        hollow: view.about.hollow,
        message: message(&view.parts, &view.about),
    };
    let levels = views.into_iter().map(level).collect();
    let failed = |error: std::io::Error| match port {
        Some(port) => Failure::input(format!("cannot serve on port {port}: {error}; choose another --port")),
        None => Failure::new(Status::Resources, format!("cannot serve the page: {error}")),
    };
    let server = tetmill_view::Server::new(port, levels).map_err(failed)?;
    let address = server.address().map_err(failed)?;
    let opened = port.is_none() && tetmill_view::open(&address);
    let advice = if opened { "" } else { "; open this address in a browser" };
    eprintln!("viewing at {address} until Ctrl-C{advice}");
    server.run(cancel::is_cancelled).map_err(failed)
}
