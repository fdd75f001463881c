//! Writes a partitioned mesh, and reads it back.

use crate::failure::{Failure, Status, agree};
use crate::options::{Boundary, Format, Halo, RunOptions};
use crate::report::HaloReport;
use std::path::Path;
use tetmill::comm::Communicator;
use tetmill::files::{Written, elmer, gmsh4, hdf5, serial, vtu};
use tetmill::mesh::{By, MeshStream, Names, Watched, WithHalo};
use tetmill::progress::{Progress, Stage, Work};
use tetmill::{files, mesh as halo};

/// Refuses options that no requested format supports, before any work.
pub(super) fn refuse_unknown(options: &RunOptions) -> Result<(), Failure> {
    if options.boundary.is_some() && !options.format.contains(&Format::Vtu) {
        return Err(Failure::input("--boundary: only VTU supports it; add vtu to --format"));
    }
    if options.adjacency && !options.format.contains(&Format::Hdf5) {
        return Err(Failure::input("--adjacency: only HDF5 holds it; add hdf5 to --format"));
    }
    let is_gmsh4 = |format: &Format| matches!(format, Format::Msh4 | Format::Msh4Parts);
    if options.ascii && !options.format.iter().any(is_gmsh4) {
        return Err(Failure::input(
            "--ascii: only Gmsh 4.1 is text or binary; add msh4 or msh4-parts to --format",
        ));
    }
    if options.format.contains(&Format::Msh) && options.format.contains(&Format::Msh4) {
        return Err(Failure::input("-f msh and msh4 write the same file, NAME.msh; leave one of them out"));
    }
    let has_halo =
        |format: &&Format| matches!(format, Format::Elmer | Format::Vtu | Format::None) || is_gmsh4(format);
    let without = options.format.iter().find(|format| !has_halo(format));
    match without.filter(|_| options.halo.is_some()) {
        Some(format) => Err(Failure::input(format!(
            "--halo: the format {} has no halo elements; write elmer, vtu, msh4 or msh4-parts",
            format!("{format:?}").to_lowercase()
        ))),
        None => Ok(()),
    }
}

/// Where VTU output stores boundary triangles.
pub(super) fn place_of(boundary: Option<Boundary>) -> vtu::Boundary {
    match boundary {
        Some(Boundary::In) => vtu::Boundary::In,
        Some(Boundary::Beside) | None => vtu::Boundary::Beside,
    }
}

/// **Collective.** Writes each format into a folder, with a halo if requested.
///
/// `stem` names the files of formats with one file. Names and numbers that a format cannot store
/// are noted.
pub(super) fn write_formats(
    comm: &dyn Communicator,
    part: &dyn MeshStream,
    names: &Names,
    options: &RunOptions,
    [dir, stem]: [&Path; 2],
    progress: &Progress,
    work: &Work,
) -> Result<(Written, Option<HaloReport>), Failure> {
    let by = options.halo.map(|by| match by {
        Halo::Faces => By::Faces,
        Halo::Vertices => By::Vertices,
    });
    let ghosts = by.map(|by| halo::halo(comm, part, by).map(|ghosts| (by, ghosts))).transpose()?;
    let report = ghosts.as_ref().map(|(by, ghosts)| HaloReport::new(comm, *by, ghosts)).transpose()?;
    let with_halo = ghosts.as_ref().map(|(_, ghosts)| WithHalo::new(part, ghosts));
    let part: &dyn MeshStream = with_halo.as_ref().map_or(part, |with_halo| with_halo);
    let part = &Watched::new(part, work, options.format.iter().map(|format| passes(*format, options)).sum());
    let with_ending = |ending: &str| files::with_ending(stem, ending);
    let storage = if options.ascii { gmsh4::Storage::Text } else { gmsh4::Storage::Binary };
    let joined = |ending: &str, format: serial::Format| {
        let file = with_ending(ending);
        note_losses(names, format, &file, progress);
        serial::write_joined(comm, part, names, format, &file)
    };
    let mut written = Written::default();
    for format in &options.format {
        written += match format {
            Format::Elmer => elmer::write(comm, part, names, dir)?,
            Format::Vtu => {
                vtu::write_with(comm, part, names, &with_ending(".vtu"), place_of(options.boundary))?
            }
            Format::Msh => joined(".msh", serial::Format::Gmsh)?,
            Format::Msh4 => {
                let file = with_ending(".msh");
                note_losses(names, serial::Format::Gmsh, &file, progress);
                gmsh4::write(comm, part, names, &file, storage)?
            }
            Format::Msh4Parts => {
                note_losses(names, serial::Format::Gmsh, &with_ending("_1.msh"), progress);
                gmsh4::write_parts(comm, part, names, stem, storage)?
            }
            Format::Medit => joined(".mesh", serial::Format::Medit)?,
            Format::Vol => joined(".vol", serial::Format::Netgen)?,
            Format::Inp => joined(".inp", serial::Format::Abaqus)?,
            Format::Mfem => files::mfem::write(comm, part, names, stem)?,
            Format::Hdf5 => {
                let settings = hdf5::Settings { adjacency: options.adjacency };
                hdf5::write_with(comm, part, names, stem, settings)?
            }
            Format::Geomview => {
                files::geomview::write(comm, part, &files::geomview::Settings::default(), stem)?
            }
            Format::None => Written::default(),
        };
    }
    Ok((written, report))
}

/// Number of passes over the tets: a text file of all parts is formatted twice, first for its
/// length.
fn passes(format: Format, options: &RunOptions) -> u64 {
    match format {
        Format::None => 0,
        Format::Msh | Format::Medit | Format::Vol => 2,
        // For the runs of bodies, and for the file; a text of all parts is formatted twice.
        Format::Msh4 if options.ascii => 3,
        Format::Msh4 | Format::Msh4Parts => 2,
        // For the tets beside the boundary, or for shared edges and faces, and for the file.
        Format::Inp | Format::Mfem => 3,
        // For faces, edges, the edges of faces and the tets of vertices, and for the file.
        Format::Hdf5 if options.adjacency => 5,
        Format::Elmer | Format::Vtu | Format::Hdf5 | Format::Geomview => 1,
    }
}

/// Notes the names and numbers that a file cannot store.
pub(super) fn note_losses(names: &Names, format: serial::Format, file: &Path, progress: &Progress) {
    for loss in serial::losses(names, format) {
        progress.note(&format!("{}: {loss}", file.display()));
    }
}

/// **Collective.** Reads the written Elmer mesh back and checks it, if requested.
pub(super) fn read_back(
    comm: &dyn Communicator,
    options: &RunOptions,
    dir: &Path,
    progress: &Progress,
) -> Result<(), Failure> {
    if !options.check || !options.format.contains(&Format::Elmer) {
        return Ok(());
    }
    let checked =
        if comm.rank() == 0 { progress.stage(Stage::ReadBack, |_| check_written(dir)) } else { Ok(()) };
    agree(comm, checked)
}

/// Reads and checks a written Elmer mesh.
fn check_written(dir: &Path) -> Result<(), Failure> {
    let checked = elmer::check_elmer(dir).map_err(|error| Failure::new(Status::Faults, error))?;
    match checked.iter().find(|(_, faults)| !faults.is_empty()) {
        None => Ok(()),
        Some((layout, faults)) => {
            Err(Failure::new(Status::Faults, format!("{}: {faults}", layout.folder().display())))
        }
    }
}
