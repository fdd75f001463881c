//! Points where two surfaces are tangent, and whether they affect the features.

use super::neighborhood::{Tolerances, region, stay_apart};
use super::octree::{Leaf, Octree, is_flat};
use super::{FeatureError, Inconsistency};
use crate::interval::{Cell, middle};
use crate::primitive::quadric::{extremes, tangents};
use crate::project::project_to_both;
use crate::{BodyId, Geometry, Interval, Point, Seam, Surface, SurfaceId, Vector};
use nalgebra::Matrix3;

/// A point where two surfaces are tangent or cannot be separated.
#[derive(Clone, Copy, Debug)]
pub(super) struct Contact {
    /// The surfaces, ascending.
    pub pair: [SurfaceId; 2],
    /// The coordinates.
    pub point: Point,
    /// The diagonal of the cell in which it was found.
    pub reach: f64,
    /// Why the point is special.
    pub kind: Kind,
}

/// The kind of a contact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// The surfaces are tangent.
    Tangent,
    /// One passes through the apex of the other.
    Apex,
}

/// Surfaces are tangent if the sine of their angle is below this: a sharper wedge cannot be meshed.
const TANGENT: f64 = 1e-6;

impl Contact {
    /// A contact at the center of a cell in which two surfaces could not be separated.
    pub fn at_middle(pair: [SurfaceId; 2], cell: &Cell) -> Self {
        Self { pair, point: middle(cell), reach: diagonal(cell), kind: Kind::Tangent }
    }
}

/// The length of the diagonal of a cell.
pub(super) fn diagonal(cell: &Cell) -> f64 {
    cell.iter().map(|side| side.width().powi(2)).sum::<f64>().sqrt()
}

/// The point in or close to a cell where both surfaces meet and are tangent, if there is one.
///
/// Surfaces with a gap below the tolerance count as meeting.
pub(super) fn find(
    geometry: &Geometry,
    pair: [SurfaceId; 2],
    cell: &Cell,
    tolerances: &Tolerances,
) -> Option<Contact> {
    /// Convergence is quadratic; an iteration that needs more steps leads elsewhere.
    const STEPS: usize = 12;
    let [a, b] = pair.map(|s| &geometry.surfaces[s.index()]);
    let center = middle(cell);
    let reach = diagonal(cell);
    let mut at = center;
    for _ in 0..STEPS {
        let step = least_squares_step(a, b, None, &at)?;
        at += step;
        if (at - center).norm() > 2.0 * reach {
            return None;
        }
        if step.norm() <= f64::EPSILON * at.coords.amax() {
            break;
        }
    }
    if a.distance(&at).max(b.distance(&at)) > tolerances.on_surface || sine(a, b, &at) > TANGENT {
        return None;
    }
    let point = on_a_third_surface(geometry, pair, &at, reach, tolerances).unwrap_or(at);
    let inside = (0..3).all(|i| {
        let room = 0.01 * cell[i].width();
        Interval::new(cell[i].lo - room, cell[i].hi + room).contains(point[i])
    });
    inside.then_some(Contact { pair, point, reach, kind: Kind::Tangent })
}

/// The sine of the angle between two surfaces at a point.
fn sine(a: &Surface, b: &Surface, at: &Point) -> f64 {
    a.normal(at).cross(&b.normal(at)).norm()
}

/// The point of contact on a third surface, if both surfaces are tangent there as well.
///
/// If two surfaces have equal curvatures in one direction, rounding determines the contact along it
/// only to about a thousandth of the radius. A third surface that passes within that distance was
/// probably meant to pass through it: the end of a rod from which a torus bends away.
fn on_a_third_surface(
    geometry: &Geometry,
    pair: [SurfaceId; 2],
    contact: &Point,
    reach: f64,
    tolerances: &Tolerances,
) -> Option<Point> {
    /// Ratio of the differences of curvatures below which the contact is uncertain along a line.
    const EQUAL: f64 = 1e-2;
    /// The least share of the larger difference along the third surface: that surface crosses the
    /// line, instead of containing it.
    const CROSSING: f64 = 0.1;
    /// Most steps: convergence is quadratic with the third surface.
    const STEPS: usize = 8;
    let [a, b] = pair.map(|s| &geometry.surfaces[s.index()]);
    let normal = a.normal(contact);
    let difference = curvature_difference([a, b], contact);
    let [low, high] = extremes(&difference, &normal).map(f64::abs);
    if low.min(high) >= EQUAL * low.max(high) {
        return None;
    }
    let cuts_line = |third: &Surface| {
        let section = normal.cross(&third.normal(contact)).try_normalize(1e-3);
        section.is_some_and(|s| s.dot(&(difference * s)).abs() >= CROSSING * low.max(high))
    };
    let others = geometry.surfaces.iter().enumerate().filter(|(i, _)| pair.iter().all(|s| s.index() != *i));
    let mut others = others.map(|(_, third)| third);
    others.find_map(|third| {
        if third.distance(contact) > reach || !cuts_line(third) {
            return None;
        }
        let mut at = *contact;
        for _ in 0..STEPS {
            at += least_squares_step(a, b, Some(third), &at)?;
        }
        let is_on_all = [a, b, third].iter().all(|s| s.distance(&at) <= tolerances.exact);
        let middle = nalgebra::center(&at, contact);
        let is_tangent = [middle, at].iter().all(|p| sine(a, b, p) <= TANGENT);
        (is_on_all && is_tangent).then_some(at)
    })
}

/// Whether a seam passes through a cell in which both of its surfaces are flat; records it as a
/// contact.
///
/// Other intersection curves of the pair may end on the seam.
pub(super) fn on_seam(geometry: &Geometry, seam: &Seam, cell: &Cell, contacts: &mut Vec<Contact>) -> bool {
    if !seam.pair.iter().all(|s| is_flat(&geometry.surfaces[s.index()], cell)) {
        return false;
    }
    let [a, b] = seam.surfaces.map(|s| &geometry.surfaces[s.index()]);
    let center = middle(cell);
    let reach = diagonal(cell);
    let Ok(point) = project_to_both(a, b, &center, f64::EPSILON * center.coords.amax().max(reach)) else {
        return false;
    };
    let is_on = seam.pair.iter().all(|s| geometry.surfaces[s.index()].distance(&point) <= TANGENT * reach);
    let is_near = (point - center).norm() <= reach;
    if is_on && is_near {
        contacts.push(Contact { pair: seam.pair, point, reach, kind: Kind::Tangent });
    }
    is_on && is_near
}

/// One Gauss-Newton step toward a point of tangency, on a third surface if there is one.
///
/// The shortest least-squares solution of the linearized equations: all values vanish and the
/// gradients of the first two are parallel.
fn least_squares_step(a: &Surface, b: &Surface, third: Option<&Surface>, at: &Point) -> Option<Vector> {
    let (ga, gb) = (a.gradient(at), b.gradient(at));
    let (ha, hb) = (a.hessian(at), b.hessian(at));
    let mut matrix = nalgebra::SMatrix::<f64, 6, 3>::zeros();
    let mut values = nalgebra::SVector::<f64, 6>::zeros();
    let (la, lb) = (ga.norm(), gb.norm());
    if la == 0.0 || lb == 0.0 {
        return None;
    }
    matrix.row_mut(0).copy_from(&(ga.transpose() / la));
    matrix.row_mut(1).copy_from(&(gb.transpose() / lb));
    values[0] = a.value(at) / la;
    values[1] = b.value(at) / lb;
    // Sines have no unit: divide by a curvature to get lengths, like the other equations.
    let bend = ha.amax() / la + hb.amax() / lb;
    if bend > 0.0 {
        let cross = ga.cross(&gb) / (la * lb * bend);
        for j in 0..3 {
            let column = (ha.column(j).cross(&gb) + ga.cross(&hb.column(j))) / (la * lb * bend);
            matrix.fixed_view_mut::<3, 1>(2, j).copy_from(&column);
        }
        values.fixed_rows_mut::<3>(2).copy_from(&cross);
    }
    if let Some(third) = third {
        let gradient = third.gradient(at);
        let length = gradient.norm();
        matrix.row_mut(5).copy_from(&(gradient.transpose() / length));
        values[5] = third.value(at) / length;
    }
    // Along a curve of contact one direction is free: drop singular values
    // that vanish up to the error of the position, a root of that of the surfaces.
    let svd = matrix.svd(true, true);
    svd.solve(&values, 1e-6).ok().map(|step| -step)
}

/// Whether the regions beside a contact are the same as without one of the two surfaces.
///
/// If the sheets are tangent with different curvatures, a wedge lies between them. Up to three
/// different regions lie below, in and above the wedge. The contact matters if both sheets separate
/// regions.
fn is_harmless(geometry: &Geometry, tree: &Octree, contact: &Contact, tolerances: &Tolerances) -> bool {
    let Some(leaf) = tree.leaf(&contact.point) else { return true };
    if contact.kind == Kind::Apex || !leaf.has_both(contact.pair) {
        return true;
    }
    let wedges = possible_wedges(geometry, contact);
    // For surfaces through the point, try both sides.
    let others: Vec<SurfaceId> = leaf
        .surfaces
        .iter()
        .copied()
        .filter(|s| !contact.pair.contains(s))
        .filter(|s| geometry.surfaces[s.index()].distance(&contact.point) <= tolerances.on_surface)
        .collect();
    for sides in 0..1_u32 << others.len().min(8) {
        let other_side = |s: SurfaceId| match others.iter().position(|&o| o == s) {
            Some(i) => sides >> i & 1 == 1,
            None => geometry.surfaces[s.index()].value(&contact.point) > 0.0,
        };
        // An error belongs to sides that do not occur: bodies overlap on them.
        if matches!(depends_on_one(geometry, leaf, contact, &wedges, &other_side), Ok(false)) {
            return false;
        }
    }
    true
}

/// Whether the region depends on the side of only one of the two surfaces, over the given pairs of
/// sides.
fn depends_on_one(
    geometry: &Geometry,
    leaf: &Leaf,
    contact: &Contact,
    wedges: &[[bool; 2]],
    other_side: &dyn Fn(SurfaceId) -> bool,
) -> Result<bool, FeatureError> {
    let region_at = |sides: &[bool; 2]| {
        region(geometry, leaf, &contact.point, &|s| match contact.pair.iter().position(|&p| p == s) {
            Some(i) => sides[i],
            None => other_side(s),
        })
    };
    let regions = wedges.iter().map(region_at).collect::<Result<Vec<_>, _>>()?;
    Ok((0..2).any(|i| {
        let same_side = |side: bool| {
            let mut on_it = wedges.iter().zip(&regions).filter(|(w, _)| w[i] == side).map(|(_, r)| r);
            let first = on_it.next();
            on_it.all(|r| Some(r) == first)
        };
        same_side(false) && same_side(true)
    }))
}

/// The pairs of sides (positive or not) of the two surfaces that occur near a contact.
fn possible_wedges(geometry: &Geometry, contact: &Contact) -> Vec<[bool; 2]> {
    let [a, b] = contact.pair.map(|s| &geometry.surfaces[s.index()]);
    let turned = a.normal(&contact.point).dot(&b.normal(&contact.point)) < 0.0;
    let [lowest, highest] = curvature_differences(geometry, contact);
    let (first_above, second_above) = (highest > SAME_CURVATURE, lowest < -SAME_CURVATURE);
    let osculating = !first_above && !second_above;
    let mut sides = vec![[false, false], [true, true]];
    // Between the sheets: below the upper one, above the lower one.
    if first_above || osculating {
        sides.push([false, true]);
    }
    if second_above || osculating {
        sides.push([true, false]);
    }
    if turned {
        for side in &mut sides {
            side[1] = !side[1];
        }
    }
    sides
}

/// Curvatures count as equal if they differ by less than this fraction of their sum.
const SAME_CURVATURE: f64 = 1e-6;

/// The smallest and the largest difference of the curvatures of the two sheets in a direction of
/// their common tangent plane, relative to the sum of the curvatures.
///
/// The difference is positive where the first sheet is above, as seen along its gradient.
fn curvature_differences(geometry: &Geometry, contact: &Contact) -> [f64; 2] {
    let [a, b] = contact.pair.map(|s| &geometry.surfaces[s.index()]);
    let at = &contact.point;
    let size = [a, b].map(|s| s.hessian(at).amax() / s.gradient(at).norm());
    curvature_differences_at([a, b], at).map(|difference| difference / (size[0] + size[1]))
}

/// The smallest and the largest difference of the curvatures of two tangent surfaces in a direction
/// of their common tangent plane, 1/length.
pub(super) fn curvature_differences_at([a, b]: [&Surface; 2], at: &Point) -> [f64; 2] {
    extremes(&curvature_difference([a, b], at), &a.normal(at))
}

/// The difference of the curvatures of two tangent surfaces as a quadratic form on their common
/// tangent plane.
fn curvature_difference([a, b]: [&Surface; 2], at: &Point) -> Matrix3<f64> {
    let (na, nb) = (a.normal(at), b.normal(at));
    let sign = if na.dot(&nb) < 0.0 { -1.0 } else { 1.0 };
    let (ha, hb) = (a.hessian(at) / a.gradient(at).norm(), b.hessian(at) / b.gradient(at).norm() * sign);
    // The heights of the sheets over the common tangent plane are minus one half of these forms.
    hb - ha
}

/// Finds the points where boundaries touch, and rejects those between which no tets fit.
///
/// Returns the points where the space between the sheets is outside all bodies and opens like that
/// between a ball and a plate. If other surfaces through the contact leave the regions ambiguous,
/// the neighborhood is sampled.
///
/// # Errors
/// [`FeatureError::Tangent`] at the first contact with a wedge of zero angle inside a body, or one
/// that opens too slowly for the triangles of the two sheets to stay apart.
pub(super) fn check(
    geometry: &Geometry,
    tree: &Octree,
    tolerances: &Tolerances,
) -> Result<Vec<Point>, FeatureError> {
    let mut touching: Vec<Point> = Vec::new();
    for contact in &tree.contacts {
        if is_harmless(geometry, tree, contact, tolerances) {
            continue;
        }
        match wedge(geometry, contact) {
            Wedge::None => {}
            Wedge::Open => {
                if !touching.iter().any(|p| (p - contact.point).norm() <= tolerances.merge) {
                    touching.push(contact.point);
                }
            }
            Wedge::Closed(between) => return Err(tangent_error(geometry, contact, between)),
        }
    }
    Ok(touching)
}

/// What lies between two tangent sheets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Wedge {
    /// The sheets are not both boundaries.
    None,
    /// The exterior, and triangles that approximate the sheets stay apart.
    Open,
    /// A body, or the exterior with less space than triangles need.
    Closed(Option<BodyId>),
}

/// What lies between the sheets around a contact.
///
/// Samples a small circle instead of the point itself because other surfaces may pass through the
/// contact: in a block with rounded edges, a plane, a ball and two rods touch at one point, and
/// each is a boundary in its own sector.
fn wedge(geometry: &Geometry, contact: &Contact) -> Wedge {
    /// Number of samples.
    const DIRECTIONS: u32 = 61;
    /// The sheets separate in all directions if the differences of their curvatures have one sign
    /// and are at least this.
    const DEFINITE: f64 = 1e-2;
    let normal = geometry.surfaces[contact.pair[0].index()].normal(&contact.point);
    let (u, v) = tangents(&normal);
    let mut found = Wedge::None;
    for k in 0..DIRECTIONS {
        let angle = std::f64::consts::TAU * f64::from(k) / f64::from(DIRECTIONS) + 0.1;
        match wedge_towards(geometry, contact, &normal, &(u * angle.cos() + v * angle.sin())) {
            Wedge::None => {}
            Wedge::Open => found = Wedge::Open,
            closed => return closed,
        }
    }
    let [lowest, highest] = curvature_differences(geometry, contact);
    if found == Wedge::Open && lowest < DEFINITE && highest > -DEFINITE { Wedge::Closed(None) } else { found }
}

/// What lies between the sheets beside a contact, in one direction of their tangent plane.
fn wedge_towards(geometry: &Geometry, contact: &Contact, normal: &Vector, direction: &Vector) -> Wedge {
    /// Distance from the contact relative to the radius of curvature: the gap between the sheets is
    /// half its square.
    const CIRCLE: f64 = 1e-3;
    /// Sheets closer than this fraction of the squared radius continue each other.
    const APART: f64 = 1e-5;
    let [a, b] = contact.pair.map(|s| &geometry.surfaces[s.index()]);
    let at = &contact.point;
    let radius = CIRCLE / a.curvature(at).max(b.curvature(at));
    let beside = at + direction * radius;
    let (Some(p), Some(q)) = (on_line(a, &beside, normal), on_line(b, &beside, normal)) else {
        return Wedge::Closed(None);
    };
    let way = q - p;
    let gap = way.norm();
    if gap <= APART * CIRCLE * radius {
        return Wedge::None;
    }
    let body = |place: Point| {
        let positive = |s: SurfaceId| geometry.surfaces[s.index()].value(&place) > 0.0;
        geometry.bodies.iter().position(|body| body.solid.contains(&positive))
    };
    let [below, between, above] = [-0.5, 0.5, 1.5].map(|part| body(p + way * part));
    if below == between || between == above {
        return Wedge::None;
    }
    let height = |p: &Point| (p - at).dot(&way) / gap;
    if between.is_none() && stay_apart(height(&p), height(&q)) {
        Wedge::Open
    } else {
        Wedge::Closed(between.map(BodyId::new))
    }
}

/// The intersection of a surface with a line that crosses it near `start`.
fn on_line(surface: &Surface, start: &Point, direction: &Vector) -> Option<Point> {
    /// Newton's method starts within a millionth of the radius of curvature.
    const STEPS: usize = 5;
    let mut at = *start;
    for _ in 0..STEPS {
        at -= direction * (surface.value(&at) / surface.gradient(&at).dot(direction));
    }
    at.coords.iter().all(|x| x.is_finite()).then_some(at)
}

/// Replaces an error by the contact that caused it, if one that matters is near.
pub(super) fn explain(
    geometry: &Geometry,
    tree: &Octree,
    error: FeatureError,
    tolerances: &Tolerances,
) -> FeatureError {
    let (FeatureError::LooseCurve { place, .. }
    | FeatureError::Inconsistent(Inconsistency::OpenBoundary { place, .. })) = error
    else {
        return error;
    };
    let is_near = |contact: &&Contact| (contact.point - place.0).norm() <= 2.0 * contact.reach;
    let matters = |contact: &&Contact| !is_harmless(geometry, tree, contact, tolerances);
    let reason = tree.contacts.iter().filter(is_near).find(matters);
    reason.map_or(error, |contact| {
        let between = match wedge(geometry, contact) {
            Wedge::Closed(between) => between,
            _ => None,
        };
        tangent_error(geometry, contact, between)
    })
}

/// The error for a contact that matters.
fn tangent_error(geometry: &Geometry, contact: &Contact, between: Option<BodyId>) -> FeatureError {
    FeatureError::tangent(geometry, contact.pair, contact.point, between)
}
