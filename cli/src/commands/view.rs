//! `tetmill view`, and the views of a run.

mod query;
mod report;
mod serve;
mod shown;

use super::outputs::Outputs;
use super::{
    coarse_settings, on_ranks, read_sized_geometry, reading, set_threads, wanted_coarse, write_whole,
};
use crate::failure::{Failure, agree};
use crate::options::{InputOptions, View};
use crate::terminal::Terminal;
pub use report::beside_report;
pub use serve::serve;
pub use shown::{Shown, Tets};
use std::path::{Path, PathBuf};
use tetmill::Generated;
use tetmill::comm::Communicator;
use tetmill::files::view::About;
use tetmill::files::{elmer, elmer::Layout, refuse_missing, volume};
use tetmill::mesh::{BareMesh, BareStream, Counts, MeshStream, Names};
use tetmill::progress::{Progress, Stage};
use tetmill::run::{GenerateSettings, generate};

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

/// **Collective.** Shows a mesh from a file on one rank, or an Elmer partition on a rank for each
/// part.
fn view_mesh(comm: &dyn Communicator, options: &View, file: &Path) -> Result<(), Failure> {
    let first = comm.rank() == 0;
    let outputs = if first { outputs_of(options).prepare() } else { Ok(()) };
    agree(comm, outputs)?;
    let title = title_of(&options.input);
    if file.is_dir() {
        let loaded = elmer::load(comm, file)?;
        if first {
            loaded.notes.iter().for_each(|note| eprintln!("note: {note}"));
        }
        let stream = BareStream::new(BareMesh::from(loaded.mesh));
        let about = about(&title, &loaded.names, &stream);
        return finish(comm, &Shown { tets: Tets::Stored(vec![&stream]), about }, options);
    }
    let read = volume::read(file)?;
    read.notes.iter().for_each(|note| eprintln!("note: {note}"));
    let totals = Counts {
        vertices: read.mesh.points.len() as u64,
        tets: read.mesh.tets.len() as u64,
        boundary: read.mesh.triangles.len() as u64,
    };
    let periodic = read.links.iter().map(|link| [link.image.0, link.of.0]).collect();
    let about = About { title, names: read.names.clone(), totals, periodic, ..About::default() };
    let streams = tetmill::files::view::streams(&read);
    let streams = streams.iter().map(|stream| &**stream).collect();
    finish(comm, &Shown { tets: Tets::Stored(streams), about }, options)
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
    terminal.finish();
    let title = title_of(&options.input);
    match &options.output {
        Some(_) => finish(comm, &shown(&made, &title), options),
        None => serve_generated(comm, made, &title, options.port),
    }
}

/// **Collective.** Writes or serves a mesh.
fn finish(comm: &dyn Communicator, shown: &Shown, options: &View) -> Result<(), Failure> {
    let Some(file) = &options.output else { return serve(comm, shown, options.port) };
    let message = shown.for_page(comm)?;
    let written = if comm.rank() == 0 { write_page(&message, file) } else { Ok(()) };
    agree(comm, written)
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

/// The mesh of a run as it is shown.
pub fn shown<'a>(made: &'a Generated, title: &str) -> Shown<'a> {
    let about = about(title, &made.names, made.stream());
    let tets = match made.levels_on_demand() {
        Some(levels) => Tets::Levels(Box::new(levels)),
        None => Tets::Stored(vec![made.stream()]),
    };
    Shown { tets, about }
}

/// **Collective.** Serves the mesh of a run until Ctrl-C.
pub fn serve_generated(
    comm: &dyn Communicator,
    made: Generated,
    title: &str,
    port: Option<u16>,
) -> Result<(), Failure> {
    match shown(&made, title) {
        Shown { tets: Tets::Levels(levels), about } => {
            // Levels do not need the fine mesh, which can be most of the memory.
            drop(made);
            serve(comm, &Shown { tets: Tets::Levels(levels), about }, port)
        }
        stored => serve(comm, &stored, port),
    }
}

/// Writes a message as a page.
pub fn write_page(message: &[u8], file: &Path) -> Result<(), Failure> {
    write_whole(file, &tetmill_view::page(message))
}
