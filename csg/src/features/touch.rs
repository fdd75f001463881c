//! Corners and edges that touch the interior of a patch.
//!
//! The solid is not a manifold there: the patch contains a vertex that is on none of its curves. An
//! isolated apex of a cone is allowed, because it is a corner of its own.

use super::arcs::{Arc, Nodes};
use super::neighborhood::{Tolerances, sheet_at};
use super::octree::Octree;
use super::{FeatureError, Named, Place, assemble};
use crate::primitive::quadric::tangents;
use crate::{Geometry, Point, SurfaceId};
use std::collections::{BTreeMap, BTreeSet};

/// Rejects the first corner or edge that touches the interior of a patch.
///
/// If no arc on a surface leaves a point of that surface, the surface is a boundary either all
/// around the point or nowhere near it.
///
/// # Errors
/// [`FeatureError::Touch`] with the touching and the touched surface.
pub(super) fn check(
    geometry: &Geometry,
    tree: &Octree,
    arcs: &[Arc],
    nodes: &Nodes,
    tolerances: &Tolerances,
) -> Result<(), FeatureError> {
    let mut leaving: BTreeMap<usize, BTreeSet<SurfaceId>> = BTreeMap::new();
    for arc in arcs {
        for node in arc.ends.into_iter().flatten().flatten() {
            leaving
                .entry(node)
                .or_default()
                .extend(arc.neighborhood.sheets.iter().map(|(sheet, _)| sheet.surface));
        }
    }
    for (node, surfaces) in leaving {
        let point = nodes.point(node);
        for touched in assemble::corner(geometry, tree, point, tolerances).surfaces {
            if !surfaces.contains(&touched)
                && is_boundary_all_around(geometry, tree, touched, &point, tolerances)?
            {
                let touching = *surfaces.first().expect("something ends at the place");
                let [first, second] = [touching, touched].map(|s| Named::surface(geometry, s));
                return Err(FeatureError::Touch { first, second, place: Place(point) });
            }
        }
    }
    Ok(())
}

/// Whether a surface is a boundary on all sides of one of its points.
fn is_boundary_all_around(
    geometry: &Geometry,
    tree: &Octree,
    id: SurfaceId,
    point: &Point,
    tolerances: &Tolerances,
) -> Result<bool, FeatureError> {
    /// Distance of the sample points in units of the merge tolerance, small enough that no other
    /// surface intervenes.
    const BESIDE: f64 = 100.0;
    /// Number of sample directions.
    const DIRECTIONS: u32 = 16;
    let surface = &geometry.surfaces[id.index()];
    if surface.has_apex_at(point, tolerances.merge) {
        return Ok(false);
    }
    let (u, v) = tangents(&surface.normal(point));
    for k in 0..DIRECTIONS {
        let angle = std::f64::consts::TAU * (f64::from(k) + 0.137) / f64::from(DIRECTIONS);
        let beside = point + (u * angle.cos() + v * angle.sin()) * (BESIDE * tolerances.merge);
        let Ok(beside) = surface.project(&beside) else { return Ok(false) };
        let other_side = |s: SurfaceId| geometry.surfaces[s.index()].value(&beside) > 0.0;
        if sheet_at(geometry, tree, id, &beside, &other_side)?.is_none() {
            return Ok(false);
        }
    }
    Ok(true)
}
