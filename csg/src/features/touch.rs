//! Corners inside patches: a ball that stands on a plate, the corner of a block on a face, a rim
//! that touches a face, the tip of a cone on an edge.
//!
//! The boundary is not a manifold there: the patch contains a vertex that is on none of its curves.

use super::arcs::{Arc, Nodes};
use super::neighborhood::{Sheet, Tolerances, sheet_at};
use super::octree::Octree;
use super::{FeatureError, apex, assemble};
use crate::primitive::quadric::tangents;
use crate::{Geometry, Point, SurfaceId};
use std::collections::{BTreeMap, BTreeSet};

/// The sheets that contain a corner in their interior, with its coordinates.
///
/// Candidates are the ends of arcs and the points `touching` where surfaces are tangent. If no arc
/// on a surface leaves a point of that surface, the surface is a boundary either all around the
/// point or nowhere near it.
///
/// # Errors
/// Those of [`sheet_at`].
pub(super) fn find(
    geometry: &Geometry,
    tree: &Octree,
    arcs: &[Arc],
    nodes: &Nodes,
    touching: &[Point],
    tolerances: &Tolerances,
) -> Result<Vec<(Sheet, Point)>, FeatureError> {
    let mut leaving: BTreeMap<usize, BTreeSet<SurfaceId>> = BTreeMap::new();
    for arc in arcs {
        for node in arc.ends.into_iter().flatten().flatten() {
            leaving
                .entry(node)
                .or_default()
                .extend(arc.neighborhood.sheets.iter().map(|(sheet, _)| sheet.surface));
        }
    }
    let is_node =
        |point: &Point| leaving.keys().any(|&node| (nodes.point(node) - point).norm() <= tolerances.merge);
    let is_leaving = |id: SurfaceId, point: &Point| {
        let here = |node: &usize| (nodes.point(*node) - point).norm() <= tolerances.merge;
        leaving.iter().filter(|(node, _)| here(node)).any(|(_, surfaces)| surfaces.contains(&id))
    };
    let mut found = Vec::new();
    for (id, point, sheets) in apex::boundaries(geometry, tree, tolerances)? {
        if is_node(&point) && !is_leaving(id, &point) {
            found.extend(sheets.into_iter().map(|sheet| (sheet, point)));
        }
    }
    let alone = touching.iter().filter(|point| !is_node(point)).map(|&point| (point, BTreeSet::new()));
    let ends = leaving.iter().map(|(&node, surfaces)| (nodes.point(node), surfaces.clone()));
    for (point, surfaces) in ends.chain(alone) {
        for touched in assemble::corner(geometry, tree, point, tolerances).surfaces {
            if !surfaces.contains(&touched) {
                let sheet = sheet_around(geometry, tree, touched, &point, tolerances)?;
                found.extend(sheet.map(|sheet| (sheet, point)));
            }
        }
    }
    Ok(found)
}

/// The sheet of a surface around one of its points, if it is the same on all sides.
fn sheet_around(
    geometry: &Geometry,
    tree: &Octree,
    id: SurfaceId,
    point: &Point,
    tolerances: &Tolerances,
) -> Result<Option<Sheet>, FeatureError> {
    /// Distance of the sample points in units of the merge tolerance, small enough that no other
    /// surface intervenes.
    const BESIDE: f64 = 100.0;
    /// Number of sample directions.
    const DIRECTIONS: u32 = 16;
    let surface = &geometry.surfaces[id.index()];
    if surface.has_apex_at(point, tolerances.merge) {
        return Ok(None);
    }
    let mut around = None;
    let (u, v) = tangents(&surface.normal(point));
    for k in 0..DIRECTIONS {
        let angle = std::f64::consts::TAU * (f64::from(k) + 0.137) / f64::from(DIRECTIONS);
        let beside = point + (u * angle.cos() + v * angle.sin()) * (BESIDE * tolerances.merge);
        let Ok(beside) = surface.project(&beside) else { return Ok(None) };
        let other_side = |s: SurfaceId| geometry.surfaces[s.index()].value(&beside) > 0.0;
        let sheet = sheet_at(geometry, tree, id, &beside, &other_side)?;
        if sheet.is_none() || around.is_some_and(|known| sheet != Some(known)) {
            return Ok(None);
        }
        around = sheet;
    }
    Ok(around)
}
