//! Joins arcs to curves and corners, and sheets to patches.

use super::arcs::{Arc, Nodes, loose_curve};
use super::neighborhood::{Sheet, Tolerances, sheet_at};
use super::octree::Octree;
use super::{Corner, Curve, FeatureError, Features, Fin, Named, Patch, Place};
use crate::geometry::UserPoint;
use crate::{Aabb, BodyId, CornerId, CurveId, Geometry, Interval, PatchId, Point, SurfaceId, Vector};
use std::collections::{BTreeMap, HashMap};

/// Joins arcs that continue each other at nodes without other arcs.
///
/// Each returned arc ends at corners or is closed. Points of the user, and those where another
/// sheet touches the curve (`inner`), are corners too.
///
/// # Errors
/// [`FeatureError::LooseCurve`] or [`FeatureError::Tangent`] if only one arc ends at a node.
pub(super) fn join(
    geometry: &Geometry,
    arcs: Vec<Arc>,
    nodes: &Nodes,
    inner: &[(Sheet, Point)],
    tolerances: &Tolerances,
) -> Result<Vec<Arc>, FeatureError> {
    let mut ends: BTreeMap<usize, Vec<(usize, usize)>> = BTreeMap::new();
    for (i, arc) in arcs.iter().enumerate() {
        for (end, node) in arc.ends.into_iter().flatten().flatten().enumerate() {
            ends.entry(node).or_default().push((i, end));
        }
    }
    let mut mates: HashMap<(usize, usize), (usize, usize)> = HashMap::new();
    for (&node, ends) in &ends {
        let point = nodes.point(node);
        if let [(arc, _)] = ends[..] {
            return Err(loose_curve(geometry, arcs[arc].pair, &point));
        }
        let given = geometry.user_points.iter().map(|user| user.point);
        let mut own = given.chain(inner.iter().map(|(_, point)| *point));
        let is_corner = own.any(|own| (own - point).norm() <= tolerances.merge);
        if let ([first, second], false) = (&ends[..], is_corner) {
            let (into, out) = (taken(&arcs[first.0], 1 - first.1), taken(&arcs[second.0], second.1));
            if into.continues_in(geometry, &out) {
                mates.insert(*first, *second);
                mates.insert(*second, *first);
            }
        }
    }
    Ok(chains(arcs, &mates))
}

/// Concatenates the arcs along the links of `mates`.
fn chains(arcs: Vec<Arc>, mates: &HashMap<(usize, usize), (usize, usize)>) -> Vec<Arc> {
    let mut used = vec![false; arcs.len()];
    let mut chains = Vec::new();
    // Open chains first, starting at corners; the rest are closed.
    let begins = |i: usize| [0, 1].into_iter().find(|&end| !mates.contains_key(&(i, end)));
    let starts = (0..arcs.len()).filter_map(|i| begins(i).map(|end| (i, end)));
    let starts: Vec<_> = starts.chain((0..arcs.len()).map(|i| (i, 0))).collect();
    for (mut arc, mut end) in starts {
        if used[arc] {
            continue;
        }
        let mut chain = taken(&arcs[arc], end);
        used[arc] = true;
        let is_closed = loop {
            match mates.get(&(arc, 1 - end)) {
                None => break chain.ends.is_none(),
                Some(&(next, _)) if used[next] => break true,
                Some(&mate) => (arc, end) = mate,
            }
            used[arc] = true;
            let next = taken(&arcs[arc], end);
            chain.points.extend_from_slice(&next.points[1..]);
            chain.ends = chain.ends.zip(next.ends).map(|(a, b)| [a[0], b[1]]);
        };
        if is_closed {
            chain.ends = None;
        }
        chains.push(chain);
    }
    chains
}

/// The arc, traversed from the end with the given index.
fn taken(arc: &Arc, end: usize) -> Arc {
    if end == 0 { arc.clone() } else { arc.clone().reversed() }
}

/// Makes the geometric entities from joined arcs, and from closed surfaces without arcs.
///
/// `inner` are corners inside sheets.
pub(super) fn entities(
    geometry: &Geometry,
    tree: &Octree,
    arcs: &[Arc],
    nodes: &Nodes,
    inner: &[(Sheet, Point)],
    tolerances: &Tolerances,
) -> Result<Features, FeatureError> {
    let mut corners: Vec<Corner> = Vec::new();
    let mut corner_of: HashMap<usize, CornerId> = HashMap::new();
    let mut curves = Vec::new();
    let mut patches: BTreeMap<Sheet, Patch> = BTreeMap::new();
    for (i, arc) in arcs.iter().enumerate() {
        let ends = arc.ends.map(|ends| {
            ends.map(|node| {
                let node = node.expect("an arc of a feature ends at nodes");
                *corner_of.entry(node).or_insert_with(|| {
                    corners.push(corner(geometry, tree, nodes.point(node), tolerances));
                    CornerId::new(corners.len() - 1)
                })
            })
        });
        curves.push(Curve { surfaces: arc.pair, ends, trace: arc.points.clone(), fins: Vec::new() });
        for &(sheet, left) in &arc.neighborhood.sheets {
            patches.entry(sheet).or_insert_with(|| patch(&sheet)).boundary.push((CurveId::new(i), left));
        }
    }
    for (sheet, seed) in closed_sheets(geometry, tree, &patches, tolerances)? {
        patches.entry(sheet).or_insert_with(|| patch(&sheet)).seeds.push(seed);
    }
    for (sheet, point) in inner {
        let known = corners.iter().position(|c| (c.point - point).norm() <= tolerances.merge);
        let id = CornerId::new(known.unwrap_or(corners.len()));
        if known.is_none() {
            corners.push(corner(geometry, tree, *point, tolerances));
        }
        patches.entry(*sheet).or_insert_with(|| patch(sheet)).corners.push(id);
    }
    let patches: Vec<Patch> = patches.into_values().collect();
    // The coarse box cells do not detect all empty bodies, but a body of zero volume has no
    // boundary.
    let is_bounded = |id: &BodyId| patches.iter().any(|p| p.inside == Some(*id) || p.outside == Some(*id));
    let unbounded = (0..geometry.bodies.len()).map(BodyId::new).filter(|id| !is_bounded(id));
    let empty: Vec<Named> = unbounded.map(|id| Named::body(geometry, id)).collect();
    if !empty.is_empty() {
        return Err(FeatureError::Empty(empty));
    }
    for (i, patch) in patches.iter().enumerate() {
        for &(curve, forward) in &patch.boundary {
            curves[curve.index()].fins.push(Fin { patch: PatchId::new(i), forward });
        }
    }
    super::apex::add_corners(geometry, tree, &mut corners, tolerances)?;
    for user in &geometry.user_points {
        if !corners.iter().any(|c| (c.point - user.point).norm() <= tolerances.merge) {
            check_inside(geometry, tree, user, tolerances)?;
            corners.push(corner(geometry, tree, user.point, tolerances));
        }
    }
    let bounds = Aabb { min: Point::origin(), max: Point::origin() };
    let mut features = Features { corners, curves, patches, bounds, identified: Vec::new() };
    features.bounds = super::extent::extent(geometry, tree, &features, tolerances);
    Ok(features)
}

/// A corner with the relevant surfaces through it.
pub(super) fn corner(geometry: &Geometry, tree: &Octree, point: Point, tolerances: &Tolerances) -> Corner {
    let near = |x: f64| Interval::new(x - tolerances.merge, x + tolerances.merge);
    let mut surfaces = tree.surfaces_in(&[near(point.x), near(point.y), near(point.z)]);
    surfaces.retain(|s| geometry.surfaces[s.index()].distance(&point) <= tolerances.merge);
    Corner { point, surfaces }
}

fn patch(sheet: &Sheet) -> Patch {
    Patch {
        surface: sheet.surface,
        flipped: sheet.flipped,
        inside: sheet.inside,
        outside: sheet.outside,
        cutout: sheet.cutout,
        boundary: Vec::new(),
        corners: Vec::new(),
        seeds: Vec::new(),
        bc: 0,
        name: None,
    }
}

/// The closed surfaces (spheres, tori, ellipsoids) that are boundaries without curves, with a point
/// on each.
///
/// The regions on both sides of a connected surface change at curves only, so one point decides.
fn closed_sheets(
    geometry: &Geometry,
    tree: &Octree,
    patches: &BTreeMap<Sheet, Patch>,
    tolerances: &Tolerances,
) -> Result<Vec<(Sheet, Point)>, FeatureError> {
    /// Distance of the point from other surfaces, in units of the tolerance: ample if possible,
    /// else just enough, as for the walls of a very thin shell.
    const CLEARANCES: [f64; 2] = [1e3, 10.0];
    let mut found = Vec::new();
    for (i, surface) in geometry.surfaces.iter().enumerate() {
        let id = SurfaceId::new(i);
        if patches.keys().any(|sheet| sheet.surface == id) {
            continue;
        }
        let is_clear = |point: &Point, clearance: f64| {
            let clear = |s: &SurfaceId| {
                *s == id || geometry.surfaces[s.index()].distance(point) > clearance * tolerances.on_surface
            };
            tree.leaf(point).is_some_and(|leaf| leaf.surfaces.iter().all(clear))
        };
        let points: Vec<Point> = scattered_directions().filter_map(|d| surface.support(&d)).collect();
        let clear = |clearance| points.iter().copied().find(|point| is_clear(point, clearance));
        if let Some(seed) = CLEARANCES.into_iter().find_map(clear) {
            let other_side = |s: SurfaceId| geometry.surfaces[s.index()].value(&seed) > 0.0;
            found.extend(sheet_at(geometry, tree, id, &seed, &other_side)?.map(|sheet| (sheet, seed)));
        }
    }
    Ok(found)
}

/// Directions spread over the sphere, in general position.
fn scattered_directions() -> impl Iterator<Item = Vector> {
    const COUNT: u32 = 32;
    // A spiral from pole to pole that turns by the golden angle (Vogel 1979 for the disk).
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    (0..COUNT).map(move |i| {
        let height = 0.9 - 1.7 * (f64::from(i) + 0.3) / f64::from(COUNT);
        let angle = golden * f64::from(i) + 0.7;
        let radius = (1.0 - height * height).sqrt();
        Vector::new(radius * angle.cos(), height, radius * angle.sin())
    })
}

/// Rejects a point of the user outside all bodies.
fn check_inside(
    geometry: &Geometry,
    tree: &Octree,
    user: &UserPoint,
    tolerances: &Tolerances,
) -> Result<(), FeatureError> {
    let in_some_body = tree.leaf(&user.point).is_some_and(|leaf| {
        let side = |solid: &crate::Solid| solid.side(&geometry.surfaces, &user.point, tolerances.on_surface);
        leaf.bodies.iter().any(|(_, solid)| side(solid) != crate::solid::Side::Outside)
    });
    if in_some_body {
        return Ok(());
    }
    Err(FeatureError::PointOutside { place: Place(user.point), line: user.span.line })
}
