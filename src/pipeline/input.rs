//! Reads the user's files into a model.

use super::error::{Error, InputError};
use super::facet_model::{FacetSolid, body_names};
use super::model::{GivenMesh, Model};
use super::settings::InputSettings;
use crate::files;
use crate::files::input::ReadError;
use crate::files::volume::VolumeMesh;
use crate::ground::kernel::tree;
use std::io;
use std::path::{Path, PathBuf};

/// The kind of content of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Csg,
    Brep,
    Step,
    Surface,
    Mesh,
}

/// The kind by the file's extension; a folder is an Elmer mesh.
fn kind(path: &Path) -> Result<Kind, Error> {
    match files::input::ending(path).as_str() {
        _ if files::volume::is_mesh(path) => Ok(Kind::Mesh),
        "geo" => Ok(Kind::Csg),
        "stl" | "off" | "obj" | "ply" | "poly" | "smesh" => Ok(Kind::Surface),
        "brep" => Ok(Kind::Brep),
        "step" | "stp" => Ok(Kind::Step),
        "iges" | "igs" => Err(InputError::Cad(path.to_path_buf()).into()),
        _ => Err(InputError::UnknownFormat(path.to_path_buf()).into()),
    }
}

/// Reads a geometry, a mesh, or one or several surfaces or CAD files; `note` receives messages for
/// the user, one sentence each.
///
/// # Errors
/// Files that cannot be read or meshed, with the location; several files that are not all surfaces
/// or all CAD files.
pub fn read(
    paths: &[impl AsRef<Path>],
    settings: &InputSettings,
    note: &mut dyn FnMut(&str),
) -> Result<Model, Error> {
    refuse_missing(paths)?;
    let kinds = paths.iter().map(|path| kind(path.as_ref())).collect::<Result<Vec<_>, _>>()?;
    if let (Some(_), Some(other)) = (settings.merge, kinds.iter().position(|kind| *kind != Kind::Csg)) {
        return Err(InputError::MergesOnlyCsg(paths[other].as_ref().to_path_buf()).into());
    }
    let is_cad = |kind: &Kind| matches!(kind, Kind::Brep | Kind::Step);
    if let Some(other) = kinds.iter().position(|kind| !is_cad(kind)) {
        let path = || paths[other].as_ref().to_path_buf();
        if !settings.solids.is_empty() {
            return Err(InputError::SolidsOnlyOfCad(path()).into());
        }
        if settings.overlap_to.is_some() {
            return Err(InputError::OverlapsOnlyOfCad(path()).into());
        }
    }
    match (kinds.as_slice(), paths) {
        ([Kind::Csg], [path]) => read_csg(path.as_ref(), settings, note),
        ([Kind::Mesh], [path]) => read_mesh(path.as_ref(), note),
        (kinds, _) if !kinds.is_empty() && kinds.iter().all(|kind| *kind == Kind::Surface) => {
            FacetSolid::read(paths, settings, note).map(|solid| Model::Facets(Box::new(solid)))
        }
        (kinds, _) if !kinds.is_empty() && kinds.iter().all(is_cad) => {
            let files: Vec<CadFile> = paths.iter().map(AsRef::as_ref).zip(kinds.iter().copied()).collect();
            read_cad(&files, settings, note)
        }
        _ => Err(InputError::SeveralFiles.into()),
    }
}

/// Refuses the first file or folder that does not exist.
///
/// # Errors
/// If one does not exist; the error has its path.
pub fn refuse_missing(paths: &[impl AsRef<Path>]) -> Result<(), ReadError> {
    paths.iter().try_for_each(|path| files::input::refuse_missing(path.as_ref()))
}

/// Reads a whole file.
///
/// # Errors
/// If it cannot be read; the error has its path.
pub fn read_bytes(path: &Path) -> Result<Vec<u8>, ReadError> {
    std::fs::read(path).map_err(ReadError::io(path))
}

fn read_csg(path: &Path, settings: &InputSettings, note: &mut dyn FnMut(&str)) -> Result<Model, Error> {
    let bytes = read_bytes(path)?;
    let settings = csg::language::Settings { merge: settings.merge.unwrap_or_default() };
    let parsed = csg::language::parse_geometry_bytes(&bytes, &path.display().to_string(), &settings)?;
    parsed.warnings.iter().for_each(|warning| note(&warning.to_string()));
    let model = Model::from_csg(parsed.geometry)
        .map_err(|error| Error::Features { path: Some(path.to_path_buf()), error: Box::new(error) })?;
    model.cut_cusps().iter().for_each(|cusp| note(&format!("{}: {cusp}", path.display())));
    Ok(model)
}

/// A CAD file and its kind.
type CadFile<'a> = (&'a Path, Kind);

/// Reads the solids of CAD files. Those of several share what they have in common, as if they were
/// in one file.
fn read_cad(files: &[CadFile], settings: &InputSettings, note: &mut dyn FnMut(&str)) -> Result<Model, Error> {
    let mut model = joined(files, settings, note)?;
    let paths: Vec<String> = files.iter().map(|(path, _)| path.display().to_string()).collect();
    let path = &PathBuf::from(paths.join(", "));
    if !settings.solids.is_empty() {
        model.keep_bodies(&chosen(path, &model, &settings.solids)?);
    }
    if let Some(to) = settings.overlap_to {
        model.cut_overlaps(to).map_err(|error| refused(path, error))?;
    }
    model.imprint();
    let solid = FacetSolid::of_brep(path, model, settings, note)?;
    Ok(Model::Facets(Box::new(solid)))
}

fn refused(path: &Path, error: brep::BrepError) -> Error {
    Error::Brep { path: path.to_path_buf(), error: Box::new(error) }
}

/// The solids of all files in one model, in the unit of the first file that has one. Of several
/// files, those without a name have that of their file.
fn joined(
    files: &[CadFile],
    settings: &InputSettings,
    note: &mut dyn FnMut(&str),
) -> Result<brep::Model, Error> {
    let mut unit = settings.unit;
    let mut joined = brep::Model::default();
    for &(path, kind) in files {
        let text = read_bytes(path)?;
        let model = match kind {
            Kind::Step => brep::Model::read_step_with(&text, unit, &|name| read_beside(path, name)),
            _ => brep::Model::read(&text),
        };
        let mut model = model.map_err(|error| refused(path, error))?;
        if let [_] = files {
            return Ok(model);
        }
        model.notes.drain(..).for_each(|text| note(&format!("{}: {text}", path.display())));
        match model.metres {
            Some(metres) => unit = brep::Unit::Metres(metres),
            None if files.iter().any(|(_, kind)| *kind == Kind::Step) => note(&format!(
                "{}: a BREP file has no unit: its lengths are taken as those of the STEP files",
                path.display()
            )),
            None => {}
        }
        model.body_names = body_names(&model, path).into_iter().map(Some).collect();
        joined.join(model);
    }
    Ok(joined)
}

/// Reads a file with parts of an assembly from the folder of the assembly. Folders in its name are
/// those of the program that wrote it, and on some systems upper and lower case are the same.
fn read_beside(assembly: &Path, name: &str) -> io::Result<Vec<u8>> {
    let name = name.rsplit(['/', '\\']).next().unwrap_or(name);
    let exact = assembly.with_file_name(name);
    if exact.is_file() {
        return std::fs::read(exact);
    }
    let folder = assembly.parent().filter(|folder| !folder.as_os_str().is_empty());
    for entry in std::fs::read_dir(folder.unwrap_or(Path::new(".")))? {
        let entry = entry?;
        if entry.file_name().eq_ignore_ascii_case(name) {
            return std::fs::read(entry.path());
        }
    }
    Err(io::ErrorKind::NotFound.into())
}

/// The indices of the bodies that have one of some names or numbers.
fn chosen(path: &Path, model: &brep::Model, wanted: &[String]) -> Result<Vec<usize>, InputError> {
    let mut chosen = Vec::new();
    for name in wanted {
        let has_name =
            |body: &usize| model.body_names.get(*body).is_some_and(|own| own.as_ref() == Some(name));
        let before = chosen.len();
        chosen.extend((0..model.bodies).filter(has_name));
        if chosen.len() == before {
            let number = name.parse().ok().filter(|number| (1..=model.bodies).contains(number));
            chosen.push(number.ok_or_else(|| no_solid(path, model, name))? - 1);
        }
    }
    Ok(chosen)
}

fn no_solid(path: &Path, model: &brep::Model, name: &str) -> InputError {
    let mut names: Vec<&str> = model.body_names.iter().flatten().map(String::as_str).collect();
    names.sort_unstable();
    names.dedup();
    let path = path.to_path_buf();
    InputError::NoSuchSolid { path, name: name.to_owned(), count: model.bodies, names: names.join(", ") }
}

fn read_mesh(path: &Path, note: &mut dyn FnMut(&str)) -> Result<Model, Error> {
    let read = files::volume::read(path)?;
    read.notes.iter().for_each(|text| note(&format!("{}: {text}", path.display())));
    Ok(given(read, Some(path))?)
}

/// Takes a mesh, from a file or not, as a model: its tets must be positive.
pub(super) fn given(read: VolumeMesh, path: Option<&Path>) -> Result<Model, InputError> {
    if let Err(range) = tree::bounds(&read.mesh.points).refuse_out_of_range() {
        return Err(InputError::OutOfRange { path: path.map(Path::to_path_buf), range });
    }
    if let Some(tet) = read.inverted.first() {
        let corner = read.mesh.points[read.mesh.tets[tet.index()][0].index()];
        let path = path.map(Path::to_path_buf);
        return Err(InputError::Inverted { path, count: read.inverted.len(), first: tet.index(), corner });
    }
    Ok(Model::Given(Box::new(GivenMesh { mesh: read.mesh, names: read.names, links: read.links })))
}
