//! From the files that a user names to what is to be meshed.

use super::facet_model::FacetSolid;
use super::model::{GivenMesh, Model};
use crate::error::Failure;
use crate::facets;
use crate::io;
use std::path::Path;

/// How surfaces are taken.
#[derive(Clone, Debug, Default)]
pub struct InputSettings {
    /// How patches, curves and corners of facets are told apart.
    pub facets: facets::Settings,
    /// Whether the triangles of surfaces stay as they are; else they are made anew by the size field.
    pub keep_surface: bool,
}

/// What kind of thing a file holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Csg,
    Surface,
    Mesh,
}

/// The kind by the end of the name; a folder is an Elmer mesh.
fn kind(path: &Path) -> Result<Kind, Failure> {
    let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    match ending.as_str() {
        _ if path.is_dir() => Ok(Kind::Mesh),
        "geo" => Ok(Kind::Csg),
        "stl" | "off" | "obj" | "ply" | "poly" | "smesh" => Ok(Kind::Surface),
        "vtu" | "pvtu" | "msh" | "vol" | "gz" | "mesh" | "meshb" | "ele" | "node" | "face" => Ok(Kind::Mesh),
        _ => Err(Failure::input(format!(
            "cannot tell by its name what {} holds; known are geometries (.geo), surfaces ({}) and meshes ({})",
            path.display(),
            io::surface::KNOWN,
            io::volume::KNOWN
        ))),
    }
}

/// Reads a geometry, a mesh, or one or several surfaces; `note` gets what the user should know, a sentence each.
///
/// # Errors
/// Files that cannot be read or meshed, with the place; several files of which one is no surface.
pub fn read(
    paths: &[impl AsRef<Path>],
    settings: &InputSettings,
    note: &mut dyn FnMut(&str),
) -> Result<Model, Failure> {
    refuse_missing(paths)?;
    let kinds = paths.iter().map(|path| kind(path.as_ref())).collect::<Result<Vec<_>, _>>()?;
    match (kinds.as_slice(), paths) {
        ([Kind::Csg], [path]) => read_csg(path.as_ref(), note),
        ([Kind::Mesh], [path]) => read_mesh(path.as_ref(), note),
        (kinds, _) if !kinds.is_empty() && kinds.iter().all(|kind| *kind == Kind::Surface) => {
            FacetSolid::read(paths, settings, note).map(|solid| Model::Facets(Box::new(solid)))
        }
        _ => Err(Failure::input("several files are taken together only if all of them are surfaces")),
    }
}

/// Refuses the first file or folder that is not there.
///
/// # Errors
/// With its path.
pub fn refuse_missing(paths: &[impl AsRef<Path>]) -> Result<(), Failure> {
    paths.iter().try_for_each(|path| io::input::refuse_missing(path.as_ref())).map_err(Failure::input)
}

/// A file, whole.
///
/// # Errors
/// With the path: what cannot be read.
pub fn read_bytes(path: &Path) -> Result<Vec<u8>, Failure> {
    std::fs::read(path).map_err(|error| {
        Failure::input(format!("cannot read {}: {}", path.display(), io::input::reason(&error)))
    })
}

fn read_csg(path: &Path, note: &mut dyn FnMut(&str)) -> Result<Model, Failure> {
    let bytes = read_bytes(path)?;
    let parsed = csg::language::parse_geometry_bytes(&bytes, &path.display().to_string())?;
    parsed.warnings.iter().for_each(|warning| note(&warning.to_string()));
    Model::from_csg(parsed.geometry).map_err(|error| Failure::input(format!("{}: {error}", path.display())))
}

fn read_mesh(path: &Path, note: &mut dyn FnMut(&str)) -> Result<Model, Failure> {
    let read = io::volume::read(path).map_err(Failure::input)?;
    read.notes.iter().for_each(|text| note(&format!("{}: {text}", path.display())));
    if let Some(tet) = read.inverted.first() {
        let corner = read.mesh.points[read.mesh.tets[tet.index()][0].index()];
        return Err(Failure::input(format!(
            "{}: {} tets are inverted or flat, the first of them number {} (counted from 1) at ({}, {}, {}); \
             see them with `tetmill quality`",
            path.display(),
            read.inverted.len(),
            tet.index() + 1,
            corner.x,
            corner.y,
            corner.z
        )));
    }
    Ok(Model::Given(Box::new(GivenMesh { mesh: read.mesh, names: read.names, links: read.links })))
}
