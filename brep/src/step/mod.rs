//! Reads STEP files: AP203, AP214, AP242 and others that use the same resources for solids.
//!
//! Parameters and curves on surfaces are computed, not read: many programs write none.

mod assembly;
mod geometry;
mod record;
mod splines;
#[cfg(test)]
mod tests;
mod text;
mod topology;
mod units;

pub use units::Unit;

use crate::model::Model;
use crate::shapes::Shapes;
use crate::{BrepError, Placement};
use assembly::{DEEPEST, MOST_USES, PlacedFile, PlacedSolid};
use std::collections::{BTreeMap, BTreeSet};
use std::io;

/// Reads the solids of a file; `other` reads a file with parts of it, by its name in this file.
///
/// # Errors
/// [`BrepError::Syntax`] with the line and record, [`BrepError::NoSolid`],
/// [`BrepError::Face`] for faces whose edges do not bound them, [`BrepError::OtherFiles`].
pub(crate) fn read(
    text: &[u8],
    unit: Unit,
    other: &dyn Fn(&str) -> io::Result<Vec<u8>>,
) -> Result<Model, BrepError> {
    let unit = match unit {
        Unit::OfFile => None,
        Unit::Metres(metres) => Some(metres),
    };
    let mut reader = Reader::new(other, unit);
    reader.read(text, &[Placement::IDENTITY], DEEPEST)?;
    reader.model()
}

/// What was read of a file and of those with its parts.
struct Reader<'a> {
    other: &'a dyn Fn(&str) -> io::Result<Vec<u8>>,
    /// Metres of the unit of the result, if it is known.
    unit: Option<f64>,
    shapes: Shapes,
    /// The names of the bodies.
    names: Vec<Option<String>>,
    /// The faces of surface models, if there is no solid, and the name for each.
    surfaces: Shapes,
    surface_names: Vec<Option<String>>,
    /// Why a surface model cannot be read.
    surface_fault: Option<BrepError>,
    /// Files that could not be read.
    missing: BTreeSet<String>,
    /// Numbers of faces, edges and shells that are in no solid.
    loose: [usize; 3],
}

impl<'a> Reader<'a> {
    fn new(other: &'a dyn Fn(&str) -> io::Result<Vec<u8>>, unit: Option<f64>) -> Self {
        Self {
            other,
            unit,
            shapes: Shapes::default(),
            names: Vec::new(),
            surfaces: Shapes::default(),
            surface_names: Vec::new(),
            surface_fault: None,
            missing: BTreeSet::new(),
            loose: [0; 3],
        }
    }

    /// Adds the solids of a file at each of some places, and those of the files that it names.
    fn read(&mut self, text: &[u8], places: &[Placement], depth: usize) -> Result<(), BrepError> {
        let records = text::read(text)?;
        let contents = assembly::contents(&records, self.unit)?;
        self.unit = contents.unit;
        let bodies = contents.solids.len() + contents.shells.len();
        let uses = places.len().saturating_mul(bodies + contents.files.len());
        if uses > MOST_USES || depth == 0 {
            return Err(assembly::too_many());
        }
        for place in places {
            for solid in &contents.solids {
                self.shapes.add(&solid.placed(place))?;
                self.names.push(solid.name.clone());
            }
        }
        self.read_surfaces(&contents.shells, places);
        let count = |kind: &str| record::nodes(&records).filter(|node| node.is(kind)).count();
        let faces = count("ADVANCED_FACE") + count("FACE_SURFACE");
        let loose = [faces, count("EDGE_CURVE"), count("SHELL_BASED_SURFACE_MODEL")];
        self.loose.iter_mut().zip(loose).for_each(|(sum, own)| *sum += own);
        let mut files: BTreeMap<&str, Vec<Placement>> = BTreeMap::new();
        // Drawings are no loss.
        let is_part = |file: &&PlacedFile| contents.solids.is_empty() || assembly::is_step(&file.name);
        for PlacedFile { name, placement } in contents.files.iter().filter(is_part) {
            files.entry(name).or_default().extend(places.iter().map(|place| place.after(placement)));
        }
        for (name, places) in files {
            match (self.other)(name) {
                Ok(text) => self.read(&text, &places, depth - 1).map_err(|error| error.in_part(name))?,
                Err(error) if error.kind() == io::ErrorKind::NotFound => {
                    self.missing.insert(name.to_owned());
                }
                Err(error) => {
                    self.missing.insert(format!("{name} ({error})"));
                }
            }
        }
        Ok(())
    }

    /// Reads the shells of surface models, unless there are solids.
    fn read_surfaces(&mut self, shells: &[PlacedSolid], places: &[Placement]) {
        for (place, shell) in places.iter().flat_map(|place| shells.iter().map(move |shell| (place, shell))) {
            if !self.names.is_empty() || self.surface_fault.is_some() {
                return;
            }
            match self.surfaces.add_faces(&shell.placed(place)) {
                Ok(faces) => self.surface_names.extend(vec![shell.name.clone(); faces]),
                Err(error) => self.surface_fault = Some(error),
            }
        }
    }

    /// The model of all that was read.
    fn model(mut self) -> Result<Model, BrepError> {
        if !self.missing.is_empty() {
            let files: Vec<String> = self.missing.into_iter().collect();
            return Err(BrepError::OtherFiles(files.join(", ")));
        }
        let [faces, edges, shells] = self.loose;
        let mut notes = Vec::new();
        let has_solids = !self.names.is_empty();
        notes.extend(if has_solids { &mut self.shapes } else { &mut self.surfaces }.exchange_vertices());
        if !has_solids {
            if let Some(fault) = self.surface_fault {
                return Err(fault);
            }
            if self.surface_names.is_empty() {
                return Err(BrepError::NoSolid { faces, edges, open: None });
            }
            let first = self.surfaces.enclose(edges, &mut notes)?;
            self.names = first.into_iter().map(|face| self.surface_names[face].take()).collect();
            self.shapes = self.surfaces;
        }
        let metres = Some(self.unit.unwrap_or(1e-3));
        let bodies = self.names.len();
        let mut model = Model { bodies, from_faces: !has_solids, metres, notes, ..Model::default() };
        model.body_names = self.names;
        self.shapes.build(&mut model)?;
        if shells > 0 && has_solids {
            model.notes.push(format!("{shells} shells that bound no solid are left out"));
        }
        Ok(model)
    }
}
