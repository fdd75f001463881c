//! A box that contains all bodies, found without their features.

use super::{FeatureError, Named};
use crate::interval::Cell;
use crate::solid::Pruned;
use crate::{Aabb, BodyId, Geometry, Interval, Point, Solid, Surface};

/// A body that reaches this many times the extent of all primitives counts as unbounded.
const HUGE: f64 = 1e4;
/// The box is accurate enough if undecided cells at its faces are smaller than this fraction of its
/// longest side.
const RESOLUTION: f64 = 1.0 / 16.0;

/// Bodies smaller than this fraction of the huge cube (10⁻¹⁰ of the extent of the primitives) count
/// as empty, for example the common point of two touching balls.
const NOTHING: f64 = 1e-14;

/// Largest number of cells in the search for unbounded bodies. Far out, only small cells show
/// whether a sharp wedge ends: this number suffices for an angle of 10⁻³, and an unbounded slab is
/// detected quickly.
const MOST_PARTS: usize = 20_000;

/// A cell of the huge cube and the bodies that may meet it (`None`: the cell is inside the body).
struct Part {
    cell: Cell,
    bodies: Vec<(BodyId, Option<Solid>)>,
}

/// A box that contains all bodies with a small margin, found by pruning a huge cube.
///
/// # Errors
/// [`FeatureError::NoBody`], [`FeatureError::Empty`], or [`FeatureError::Unbounded`] if a body
/// reaches the faces of the cube.
pub(super) fn bounding_cell(geometry: &Geometry) -> Result<Cell, FeatureError> {
    if geometry.bodies.is_empty() {
        return Err(FeatureError::NoBody);
    }
    let cube = huge_cube(geometry);
    let bodies = geometry.bodies.iter().enumerate();
    let all = bodies.map(|(i, body)| (BodyId::new(i), Some(body.solid.clone()))).collect();
    let mut parts: Vec<Part> = prune(geometry, Part { cell: cube, bodies: all }).into_iter().collect();
    loop {
        let mut is_somewhere = vec![false; geometry.bodies.len()];
        parts.iter().flat_map(|part| &part.bodies).for_each(|body| is_somewhere[body.0.index()] = true);
        let nowhere = (0..geometry.bodies.len()).filter(|&body| !is_somewhere[body]);
        let empty: Vec<Named> = nowhere.map(|body| Named::body(geometry, BodyId::new(body))).collect();
        if !empty.is_empty() {
            return Err(FeatureError::Empty(empty));
        }
        let hull = hull(&parts);
        let longest = hull.iter().map(Interval::width).fold(0.0, f64::max);
        if longest < NOTHING * cube[0].width() {
            return Err(FeatureError::Empty(vec![Named::body(geometry, parts[0].bodies[0].0)]));
        }
        let is_rough = |part: &Part| {
            let touches = (0..3).any(|i| part.cell[i].lo == hull[i].lo || part.cell[i].hi == hull[i].hi);
            let undecided = part.bodies.iter().any(|b| b.1.is_some());
            touches && undecided && part.cell[0].width() > RESOLUTION * longest
        };
        if !parts.iter().any(is_rough) {
            let Some(part) = parts.iter().find(|part| is_at_face(part, &cube)) else {
                // Uneven margins, so that planes of symmetry do not coincide with faces of cells.
                let room = [0.0123, 0.0217, 0.0181].map(|part| part * longest);
                return Ok([0, 1, 2].map(|i| Interval::new(hull[i].lo - room[i], hull[i].hi + 1.3 * room[i])));
            };
            let goes_on = |part: &Part| is_at_face(part, &cube) && part.bodies.iter().any(|b| b.1.is_none());
            if parts.len() > MOST_PARTS || parts.iter().any(goes_on) {
                return Err(FeatureError::Unbounded(Named::body(geometry, part.bodies[0].0)));
            }
            parts = refined(geometry, parts, &|part: &Part| is_at_face(part, &cube));
            continue;
        }
        parts = refined(geometry, parts, &is_rough);
    }
}

/// Whether a part touches a face of the cube.
fn is_at_face(part: &Part, cube: &Cell) -> bool {
    (0..3).any(|i| part.cell[i].lo == cube[i].lo || part.cell[i].hi == cube[i].hi)
}

/// Splits the parts selected by `is_rough`.
fn refined(geometry: &Geometry, parts: Vec<Part>, is_rough: &dyn Fn(&Part) -> bool) -> Vec<Part> {
    let (rough, mut parts): (Vec<_>, Vec<_>) = parts.into_iter().partition(is_rough);
    for part in rough {
        let children = split(&part.cell).map(|cell| Part { cell, bodies: part.bodies.clone() });
        parts.extend(children.into_iter().filter_map(|child| prune(geometry, child)));
    }
    parts
}

/// Prunes the bodies to the cell of a part; `None` if all are disjoint from it.
fn prune(geometry: &Geometry, part: Part) -> Option<Part> {
    let mut range = |id: crate::SurfaceId| geometry.surfaces[id.index()].value_range(&part.cell);
    let left = |(id, solid): (BodyId, Option<Solid>)| match solid.map(|s| s.prune(&mut range)) {
        None | Some(Pruned::Full) => Some((id, None)),
        Some(Pruned::Part(solid)) => Some((id, Some(solid))),
        Some(Pruned::Empty) => None,
    };
    let bodies: Vec<_> = part.bodies.into_iter().filter_map(left).collect();
    (!bodies.is_empty()).then_some(Part { cell: part.cell, bodies })
}

/// The bounding box of all parts.
fn hull(parts: &[Part]) -> Cell {
    let first = parts[0].cell;
    parts.iter().fold(first, |hull, part| {
        [0, 1, 2].map(|i| Interval::new(hull[i].lo.min(part.cell[i].lo), hull[i].hi.max(part.cell[i].hi)))
    })
}

/// The eight octants of a box; x varies fastest.
pub(super) fn split(cell: &Cell) -> [Cell; 8] {
    let halves = cell.map(|side| {
        let middle = side.middle();
        [Interval::new(side.lo, middle), Interval::new(middle, side.hi)]
    });
    [0, 1, 2, 3, 4, 5, 6, 7]
        .map(|child| [halves[0][child & 1], halves[1][child >> 1 & 1], halves[2][child >> 2]])
}

/// A cube around the points that define the primitives, much larger than their extent.
fn huge_cube(geometry: &Geometry) -> Cell {
    let extents: Vec<(Point, f64)> = geometry
        .bodies
        .iter()
        .flat_map(|body| body.solid.surfaces())
        .map(|id| match &geometry.surfaces[id.index()] {
            Surface::Plane(p) => (p.point, 0.0),
            Surface::Sphere(s) => (s.center, s.radius),
            Surface::Cylinder(c) => (c.point, c.radius),
            Surface::Cone(c) => (c.point, c.radius.max((c.radius / c.slope).abs())),
            Surface::Torus(t) => (t.center, t.major + t.minor),
            Surface::Ellipsoid(e) => (e.center, e.radii.iter().copied().fold(0.0, f64::max)),
            Surface::EllipticCylinder(e) => (e.point, e.radii[0].max(e.radii[1])),
            Surface::EllipticCone(e) => (e.point, e.radii[0].max(e.radii[1]).max(1.0 / e.rate.abs())),
            Surface::Nappe(c) => (c.point, c.radius.max((c.radius / c.slope).abs())),
            Surface::Revolved(r) => (r.point, r.reach()),
            Surface::Sweep(s) => (s.center, s.reach()),
        })
        .collect();
    let mut hull = Aabb { min: Point::from([f64::INFINITY; 3]), max: Point::from([f64::NEG_INFINITY; 3]) };
    for (point, reach) in &extents {
        hull.min = hull.min.inf(&(point.map(|x| x - reach)));
        hull.max = hull.max.sup(&(point.map(|x| x + reach)));
    }
    if extents.is_empty() {
        hull = Aabb { min: Point::origin(), max: Point::origin() };
    }
    // If all primitives are planes through one point, its coordinates are the only known length.
    let size = match hull.diagonal() {
        0.0 => hull.min.coords.amax().max(1.0),
        diagonal => diagonal,
    };
    let center = hull.center();
    [0, 1, 2].map(|i| Interval::new(center[i] - HUGE * size, center[i] + HUGE * size))
}
