//! The apex of a cone, where the surface has no normal.
//!
//! The apex is a corner if the cone is a boundary near it. Intersection curves of the cone with
//! another surface through the apex end there: near the apex they are nearly straight and none is
//! closed.

use super::contact::{Contact, Kind, diagonal};
use super::neighborhood::{Sheet, Tolerances, sheet_at};
use super::octree::{Octree, is_flat};
use super::{Corner, FeatureError};
use crate::interval::Cell;
use crate::primitive::quadric::tangents;
use crate::{Geometry, Interval, Point, Surface, SurfaceId, Vector};

/// Cells that contain an apex are split at least to this depth, so that neighboring cells contain
/// the curves that end at the apex.
const LEAST_DEPTH: u32 = 6;

/// The contact at the apex of one of two surfaces in or close to a cell.
///
/// Found if the other surface passes through the apex, and is flat in the cell or has the same
/// apex.
pub(super) fn in_cell(
    geometry: &Geometry,
    pair: [SurfaceId; 2],
    cell: &Cell,
    depth: u32,
    tolerances: &Tolerances,
) -> Option<Contact> {
    if depth < LEAST_DEPTH {
        return None;
    }
    let [a, b] = pair.map(|s| &geometry.surfaces[s.index()]);
    [(a, b), (b, a)].into_iter().find_map(|(cone, other)| {
        let point = cone.apex()?;
        let is_inside = (0..3).all(|i| {
            let room = 0.01 * cell[i].width();
            Interval::new(cell[i].lo - room, cell[i].hi + room).contains(point[i])
        });
        let meets = is_inside && other.distance(&point) <= tolerances.on_surface;
        let is_simple = || match other.apex() {
            Some(apex) if (apex - point).norm() <= tolerances.on_surface => true,
            _ => is_flat(other, cell),
        };
        (meets && is_simple()).then(|| Contact { pair, point, reach: diagonal(cell), kind: Kind::Apex })
    })
}

/// Adds a corner at each apex that is on the boundary but is not an end of a curve.
pub(super) fn add_corners(
    geometry: &Geometry,
    tree: &Octree,
    corners: &mut Vec<Corner>,
    tolerances: &Tolerances,
) -> Result<(), FeatureError> {
    for (id, point, _) in boundaries(geometry, tree, tolerances)? {
        match corners.iter_mut().find(|c| (c.point - point).norm() <= tolerances.merge) {
            Some(corner) if corner.surfaces.contains(&id) => {}
            Some(corner) => {
                corner.surfaces.push(id);
                corner.surfaces.sort_unstable();
            }
            None => corners.push(super::assemble::corner(geometry, tree, point, tolerances)),
        }
    }
    Ok(())
}

/// The cones that are boundaries near their apexes, with the apexes and the sheets around them.
pub(super) fn boundaries(
    geometry: &Geometry,
    tree: &Octree,
    tolerances: &Tolerances,
) -> Result<Vec<(SurfaceId, Point, Vec<Sheet>)>, FeatureError> {
    let mut found = Vec::new();
    for (i, cone) in geometry.surfaces.iter().enumerate() {
        let id = SurfaceId::new(i);
        let Some(point) = cone.apex() else { continue };
        let sheets = sheets_around(geometry, tree, id, tolerances)?;
        if !sheets.is_empty() {
            found.push((id, point, sheets));
        }
    }
    Ok(found)
}

/// The sheets of a cone near its apex.
fn sheets_around(
    geometry: &Geometry,
    tree: &Octree,
    id: SurfaceId,
    tolerances: &Tolerances,
) -> Result<Vec<Sheet>, FeatureError> {
    /// Distance of the sample points in units of the merge tolerance, small enough that no other
    /// surface intervenes.
    const BESIDE: f64 = 100.0;
    let cone = &geometry.surfaces[id.index()];
    let Some(apex) = cone.apex() else { return Ok(Vec::new()) };
    let mut found = Vec::new();
    for line in lines(cone) {
        let point = apex + line * (BESIDE * tolerances.merge);
        let other_side = |s: SurfaceId| geometry.surfaces[s.index()].value(&point) > 0.0;
        found.extend(sheet_at(geometry, tree, id, &point, &other_side)?);
    }
    found.sort_unstable();
    found.dedup();
    Ok(found)
}

/// Unit directions of lines on the nappes of a cone from the apex, in general position.
fn lines(cone: &Surface) -> Vec<Vector> {
    const COUNT: u32 = 16;
    let round = |axis: &Vector, radius: f64, slope: f64| {
        let (u, v) = tangents(axis);
        ([u, v], [radius; 2], axis * (radius / slope))
    };
    let (axes, radii, rise) = match cone {
        Surface::Cone(c) => round(&c.axis, c.radius, c.slope),
        Surface::Nappe(c) => round(&c.axis, c.radius, c.slope),
        Surface::EllipticCone(c) => (c.axes, c.radii, c.axis / c.rate),
        _ => return Vec::new(),
    };
    let turns = (0..COUNT).map(|k| std::f64::consts::TAU * (f64::from(k) + 0.137) / f64::from(COUNT));
    turns
        .flat_map(|turn| {
            let across = axes[0] * (radii[0] * turn.cos()) + axes[1] * (radii[1] * turn.sin());
            let nappes = if matches!(cone, Surface::Nappe(_)) { 1 } else { 2 };
            [across + rise, across - rise].into_iter().take(nappes).map(|line| line.normalize())
        })
        .collect()
}
