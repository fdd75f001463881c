//! Reads STEP files: AP203, AP214, AP242 and others that use the same resources for solids.
//!
//! Parameters and curves on surfaces are computed, not read: many programs write none.

mod assembly;
mod geometry;
mod glue;
mod record;
mod splines;
mod split;
#[cfg(test)]
mod tests;
mod text;
mod topology;
mod units;

pub use units::Unit;

use crate::chart::{Chart, Loop, Side, close};
use crate::model::{Fin, Model, On, Patch};
use crate::tessellate::diagonal;
use crate::{BrepError, EdgeCurve, Surface};
use rayon::prelude::*;
use std::collections::BTreeSet;
use topology::{Face, Shapes, reversed};

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
    build(&mut model, shapes)?;
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

/// Makes patches of faces.
fn build(model: &mut Model, mut shapes: Shapes) -> Result<(), BrepError> {
    let size = diagonal(&shapes.corners, &shapes.curves);
    glue::glue_edges(&mut shapes, size);
    split::divide_at_poles(&mut shapes, size);
    model.notes.extend(split::drop_spurs(&mut shapes));
    (model.corners, model.curves) = (std::mem::take(&mut shapes.corners), std::mem::take(&mut shapes.curves));
    let mut names = Vec::new();
    // On all threads: the steps along edges take most of the time.
    let follow = |(number, face): (usize, &Face)| {
        (!face.surface.is_plane()).then(|| followed(&model.curves, number, &face.surface, &face.loops, size))
    };
    let followed: Vec<_> = shapes.faces.par_iter().enumerate().map(follow).collect();
    for ((number, face), followed) in shapes.faces.into_iter().enumerate().zip(followed) {
        names.push(face.name.clone());
        let id = face.id;
        let patch = patch(model, number, face, followed, size).map_err(|error| match error {
            BrepError::Face { face, what, place } => {
                BrepError::Face { face, what: format!("{what} (#{id})"), place }
            }
            other => other,
        })?;
        model.patches.push(patch);
    }
    let to = glue::glue_patches(model, SAME * size);
    model.patch_names = vec![None; model.patches.len()];
    for (name, patch) in names.into_iter().zip(to) {
        model.patch_names[patch] = model.patch_names[patch].take().or(name);
    }
    Ok(())
}

/// Surfaces that differ by at most this (fraction of the diagonal) are one.
const SAME: f64 = 1e-6;

/// Makes the patch of a face whose loops were followed on its surface; those of planes need not be.
fn patch(
    model: &mut Model,
    number: usize,
    face: Face,
    along: Option<Result<Vec<Loop>, BrepError>>,
    size: f64,
) -> Result<Patch, BrepError> {
    let bodies = if face.is_behind { [Some(face.body), None] } else { [None, Some(face.body)] };
    let Some(along) = along else {
        let fin = |&(curve, is_forward): &(usize, bool)| Fin {
            on: On::Curve(curve),
            curve: None,
            range: model.curves[curve].range,
            is_forward,
        };
        let loops: Vec<Vec<Fin>> = face.loops.iter().map(|edges| edges.iter().map(fin).collect()).collect();
        if loops.is_empty() {
            return Err(BrepError::face(number, "it has no edges", None));
        }
        return Ok(Patch { surface: face.surface, loops, bodies });
    };
    let surface: Surface = face.surface;
    let given = along.and_then(|along| bounded(model, number, &surface, along, &face.loops, size));
    let sides = given.or_else(|error| {
        // Some programs write loops of left-handed surfaces the wrong way around.
        let other: Vec<_> = face.loops.iter().map(|edges| reversed(edges.clone())).collect();
        followed(&model.curves, number, &surface, &other, size)
            .and_then(|along| bounded(model, number, &surface, along, &other, size))
            .map_err(|_| error)
    })?;
    let fins = |sides: Vec<Side>| -> Result<Vec<Fin>, BrepError> {
        let all: Result<Vec<Fin>, String> = sides.into_iter().map(Side::fin).collect();
        all.map_err(|what| BrepError::face(number, what, None))
    };
    let loops = sides.into_iter().map(fins).collect::<Result<Vec<_>, _>>()?;
    Ok(Patch { surface, loops, bodies })
}

/// Loops of edges in the parameters of a surface.
fn followed(
    curves: &[EdgeCurve],
    number: usize,
    surface: &Surface,
    loops: &[Vec<(usize, bool)>],
    size: f64,
) -> Result<Vec<Loop>, BrepError> {
    let chart = Chart::new(surface, size);
    loops.iter().map(|edges| chart.follow(number, curves, edges)).collect()
}

/// Joins loops in the parameters of a surface so that they bound an area.
fn bounded(
    model: &mut Model,
    number: usize,
    surface: &Surface,
    along: Vec<Loop>,
    loops: &[Vec<(usize, bool)>],
    size: f64,
) -> Result<Vec<Vec<Side>>, BrepError> {
    for (one, edges) in along.iter().zip(loops) {
        for &(curve, _) in edges {
            let edge = &mut model.curves[curve];
            edge.tolerance = edge.tolerance.max(one.gap);
        }
    }
    close(&Chart::new(surface, size), number, model, along)
}
