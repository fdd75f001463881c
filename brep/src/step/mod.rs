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

use crate::BrepError;
use crate::model::Model;
use crate::shapes::Shapes;
use std::collections::BTreeSet;

/// Reads the solids of a file.
///
/// # Errors
/// [`BrepError::Syntax`] with the line and record, [`BrepError::NoSolid`],
/// [`BrepError::Face`] for faces whose edges do not bound them.
pub(crate) fn read(text: &[u8], unit: Unit) -> Result<Model, BrepError> {
    let records = text::read(text)?;
    let (solids, metres) = assembly::solids(&records, unit)?;
    if solids.is_empty() {
        let files: BTreeSet<String> = record::nodes(&records).filter_map(other_file).collect();
        if !files.is_empty() {
            return Err(BrepError::OtherFiles(files.into_iter().collect::<Vec<_>>().join(", ")));
        }
        let count = |kind: &str| record::nodes(&records).filter(|node| node.is(kind)).count();
        let faces = count("ADVANCED_FACE") + count("FACE_SURFACE");
        return Err(BrepError::NoSolid(format!("{faces} faces and {} edges", count("EDGE_CURVE"))));
    }
    let mut shapes = Shapes::default();
    for solid in &solids {
        shapes.add(solid)?;
    }
    let mut model = Model { bodies: solids.len(), metres: Some(metres), ..Model::default() };
    model.body_names = solids.into_iter().map(|solid| solid.name).collect();
    shapes.build(&mut model)?;
    let left_out = record::nodes(&records).filter(|node| node.is("SHELL_BASED_SURFACE_MODEL")).count();
    if left_out > 0 {
        model.notes.push(format!("{left_out} shells that bound no solid are left out"));
    }
    Ok(model)
}

/// The name of a file that holds a part (ISO 10303-41, external references).
fn other_file(node: record::Node) -> Option<String> {
    let name = node.get("DOCUMENT_FILE")?.text(0)?;
    name.contains('.').then_some(name)
}
