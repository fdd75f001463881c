//! Mesh files.

use pyo3::prelude::*;
use std::path::PathBuf;
use tetmill::comm::Communicator;
use tetmill::error::Error;
use tetmill::files::{Written, elmer, geomview, gmsh4, hdf5, mfem, serial, vtu};
use tetmill::mesh::{By, MeshStream, Names, Watched, WithHalo, halo};
use tetmill::progress::{Progress, Stage};

/// The arguments of `Mesh.write`; all keys are present.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Target {
    /// A file; for `elmer` a folder.
    path: PathBuf,
    /// A format of the command line.
    format: String,
    /// Whether triangles are in the file of the tets (VTU).
    inside: bool,
    /// Whether files of Gmsh 4.1 are text.
    ascii: bool,
    /// `faces` or `vertices`.
    halo: Option<String>,
    /// Whether the adjacency is written (HDF5).
    adjacency: bool,
}

impl Target {
    /// The neighbouring tets that are written with each part.
    fn halo(&self) -> Option<By> {
        self.halo.as_deref().map(by)
    }
}

/// Which tets are ghosts, by the name of the command line.
pub fn by(name: &str) -> By {
    if name == "vertices" { By::Vertices } else { By::Faces }
}

/// **Collective.** Writes the mesh of all ranks in one format.
pub fn write(
    comm: &dyn Communicator,
    part: &dyn MeshStream,
    names: &Names,
    target: &Target,
    progress: &Progress,
) -> Result<Written, Error> {
    let ghosts = target.halo().map(|by| halo(comm, part, by)).transpose()?;
    let with_halo = ghosts.as_ref().map(|ghosts| WithHalo::new(part, ghosts));
    let part: &dyn MeshStream = with_halo.as_ref().map_or(part, |with_halo| with_halo);
    let note_losses = |format: serial::Format| {
        for loss in serial::losses(names, format) {
            progress.note(&format!("{}: {loss}", target.path.display()));
        }
    };
    let joined = |part: &dyn MeshStream, format: serial::Format| {
        note_losses(format);
        serial::write_joined(comm, part, names, format, &target.path)
    };
    let place = if target.inside { vtu::Boundary::In } else { vtu::Boundary::Beside };
    let storage = if target.ascii { gmsh4::Storage::Text } else { gmsh4::Storage::Binary };
    let written = progress.stage(Stage::Write, |work| {
        let part = &Watched::new(part, work, 1);
        match target.format.as_str() {
            "elmer" => elmer::write(comm, part, names, &target.path),
            "vtu" => vtu::write_with(comm, part, names, &target.path, place),
            "msh" => joined(part, serial::Format::Gmsh),
            "msh4" => {
                note_losses(serial::Format::Gmsh);
                gmsh4::write(comm, part, names, &target.path, storage)
            }
            "msh4-parts" => {
                note_losses(serial::Format::Gmsh);
                gmsh4::write_parts(comm, part, names, &target.path, storage)
            }
            "medit" => joined(part, serial::Format::Medit),
            "vol" => joined(part, serial::Format::Netgen),
            "inp" => joined(part, serial::Format::Abaqus),
            "mfem" => mfem::write(comm, part, names, &target.path),
            "hdf5" => {
                let settings = hdf5::Settings { adjacency: target.adjacency };
                hdf5::write_with(comm, part, names, &target.path, settings)
            }
            _ => geomview::write(comm, part, &geomview::Settings::default(), &target.path),
        }
    });
    Ok(written?)
}
