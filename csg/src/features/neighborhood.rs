//! The regions around a point of a curve, sector by sector.
//!
//! ```text
//!            \ B |
//!             \  |  exterior         Three sheets through a curve that points out of the page:
//!          A   \ |                   six rays, six sectors. A ray with different regions on its
//!      -----------x-----------       sides is part of a patch; the other rays are not boundaries.
//!          A     | \      A
//!             A  |  \
//!                | A \
//! ```

use super::octree::{Leaf, Octree};
use super::trace::tangent;
use super::{FeatureError, Named, Place};
use crate::{BodyId, Geometry, Point, SurfaceId, Vector};

/// Absolute tolerances, all lengths.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tolerances {
    /// Largest distance from the surfaces after Newton's method.
    pub exact: f64,
    /// A point within this distance of a surface is on the surface.
    pub on_surface: f64,
    /// Corners within this distance are merged.
    pub merge: f64,
}

impl Tolerances {
    /// Tolerances for bodies in a box with this diagonal and largest coordinate.
    ///
    /// Coordinates written with all decimals make surfaces that share a curve miss each other by
    /// 10⁻¹⁶ to 10⁻¹² of the size. Real features are larger than 10⁻⁷ of the size.
    pub fn new(diagonal: f64, largest: f64) -> Self {
        let rounding = 16.0 * f64::EPSILON * largest;
        Self {
            exact: f64::max(1e-13 * diagonal, rounding),
            on_surface: f64::max(1e-9 * diagonal, 16.0 * rounding),
            merge: f64::max(1e-8 * diagonal, 64.0 * rounding),
        }
    }
}

/// The body that contains a point near `at`, `None` for the exterior; `positive` is the sign of
/// each surface there.
///
/// # Errors
/// [`FeatureError::Overlap`] if two bodies contain the point.
pub(super) fn region(
    geometry: &Geometry,
    leaf: &Leaf,
    at: &Point,
    positive: &dyn Fn(SurfaceId) -> bool,
) -> Result<Option<BodyId>, FeatureError> {
    let mut holding = leaf.bodies.iter().filter(|(_, solid)| solid.contains(positive)).map(|(body, _)| *body);
    let first = holding.next();
    match (first, holding.next()) {
        (Some(a), Some(b)) => {
            let [first, second] = [a, b].map(|body| Named::body(geometry, body));
            Err(FeatureError::Overlap { first, second, place: Place(*at) })
        }
        _ => Ok(first),
    }
}

/// One side of a surface at a curve, separating two different regions: part of a patch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Sheet {
    /// The surface.
    pub surface: SurfaceId,
    /// The body behind the normal of the patch.
    pub inside: Option<BodyId>,
    /// The body in front of the normal.
    pub outside: Option<BodyId>,
    /// Whether the normal is opposite to the gradient.
    pub flipped: bool,
    /// Index of the cutout it belongs to.
    pub cutout: Option<u32>,
}

impl Sheet {
    /// The sheet between the regions behind and in front of a surface (along its gradient), if they
    /// differ.
    ///
    /// The normal points to the exterior, or to the body with the larger id.
    pub fn between(surface: SurfaceId, behind: Option<BodyId>, before: Option<BodyId>) -> Option<Self> {
        let flipped = match (behind, before) {
            (a, b) if a == b => return None,
            (Some(a), Some(b)) => a > b,
            (a, _) => a.is_none(),
        };
        let (inside, outside) = if flipped { (before, behind) } else { (behind, before) };
        Some(Self { surface, inside, outside, flipped, cutout: None })
    }
}

/// The first cutout that contains a point of a surface: its solid lies on one side of the surface
/// only.
///
/// `behind` and `before` return the signs of all surfaces just behind the point and just in front
/// of it.
fn cutout_at(
    geometry: &Geometry,
    leaf: &Leaf,
    surface: SurfaceId,
    [behind, before]: [&dyn Fn(SurfaceId) -> bool; 2],
) -> Option<u32> {
    let mut here = leaf.cutouts.iter().filter(|(i, _)| geometry.cutouts[*i as usize].surface == surface);
    here.find(|(_, solid)| solid.contains(behind) != solid.contains(before)).map(|(i, _)| *i)
}

/// The sheet of a surface at one of its points; `None` if the surface is not a boundary there.
///
/// `other_side` returns whether the point is on the positive side of another surface.
///
/// # Errors
/// [`FeatureError::Overlap`] if two bodies contain a point beside it.
pub(super) fn sheet_at(
    geometry: &Geometry,
    tree: &Octree,
    id: SurfaceId,
    at: &Point,
    other_side: &dyn Fn(SurfaceId) -> bool,
) -> Result<Option<Sheet>, FeatureError> {
    let Some(leaf) = tree.leaf(at).filter(|leaf| leaf.surfaces.contains(&id)) else { return Ok(None) };
    let behind = |s| s != id && other_side(s);
    let before = |s| s == id || other_side(s);
    let sheet =
        Sheet::between(id, region(geometry, leaf, at, &behind)?, region(geometry, leaf, at, &before)?);
    Ok(sheet.map(|sheet| Sheet { cutout: cutout_at(geometry, leaf, id, [&behind, &before]), ..sheet }))
}

/// The surfaces and sheets around a point of a curve.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Neighborhood {
    /// The surfaces through the curve, ascending.
    pub surfaces: Vec<SurfaceId>,
    /// The sheets that start at the curve, sorted, each with whether it lies to the left of the
    /// curve, seen along the curve with the sheet's normal up.
    pub sheets: Vec<(Sheet, bool)>,
}

impl Neighborhood {
    /// Whether the curve is a feature: neither inside one smooth sheet nor off all sheets.
    pub fn is_feature(&self) -> bool {
        match &self.sheets[..] {
            [] => false,
            [(first, left), (second, right)] => first != second || left == right,
            _ => true,
        }
    }
}

/// Half of the intersection of a surface with the plane perpendicular to the curve.
struct Ray {
    surface: SurfaceId,
    /// Unit direction.
    direction: Vector,
    /// Angle of the direction, radians.
    angle: f64,
    /// Curvature term at the start, positive counterclockwise, 1/length.
    curvature: f64,
}

/// Rays within this angle (radians) have the same direction; their order is decided by curvature.
const SAME_ANGLE: f64 = 1e-6;

/// The neighborhood of the point `at` on the intersection of a pair of surfaces, seen along
/// `forward`.
///
/// `None` if the pair is not relevant there.
///
/// # Errors
/// [`FeatureError::Overlap`] if bodies overlap there; [`FeatureError::Tangent`] if two sheets leave
/// the curve in the same direction.
pub(super) fn neighborhood(
    geometry: &Geometry,
    tree: &Octree,
    pair: [SurfaceId; 2],
    at: &Point,
    forward: &Vector,
    tolerances: &Tolerances,
) -> Result<Option<Neighborhood>, FeatureError> {
    let Some(leaf) = tree.leaf(at).filter(|leaf| tree.is_relevant(leaf, pair)) else { return Ok(None) };
    /// Largest gap at a seam in units of the merge tolerance. Seams are found with a tolerance
    /// relative to all primitives, which may be larger than the bodies.
    const SEAM_GAP: f64 = 100.0;
    let tangent_surfaces: Vec<SurfaceId> = tree.tangent_surfaces(leaf, pair).collect();
    let is_through = |s: &SurfaceId| {
        // The gap between tangent surfaces is wider than usual, but not where the seam surfaces
        // intersect away from the tangent pair.
        let gap =
            if tangent_surfaces.contains(s) { SEAM_GAP * tolerances.merge } else { tolerances.on_surface };
        pair.contains(s) || geometry.surfaces[s.index()].distance(at) <= gap
    };
    let surfaces: Vec<SurfaceId> = leaf.surfaces.iter().copied().filter(is_through).collect();
    let [a, b] = pair.map(|s| &geometry.surfaces[s.index()]);
    let mut axis = tangent(a, b, at);
    if axis.dot(forward) < 0.0 {
        axis = -axis;
    }
    let rays = sorted_rays(geometry, &surfaces, at, &axis)?;

    // Start in the widest sector, where the side of each surface is certain, then cross ray by ray.
    let gap = |i: usize| {
        let next =
            rays[(i + 1) % rays.len()].angle + if i + 1 == rays.len() { std::f64::consts::TAU } else { 0.0 };
        next - rays[i].angle
    };
    let widest = (0..rays.len()).fold(0, |best, i| if gap(i) > gap(best) { i } else { best });
    let (u, v) = frame(&axis);
    let angle = rays[widest].angle + 0.5 * gap(widest);
    let outward = u * angle.cos() + v * angle.sin();
    let mut positive: Vec<bool> =
        surfaces.iter().map(|s| geometry.surfaces[s.index()].gradient(at).dot(&outward) > 0.0).collect();
    let side = |positive: &[bool], s: SurfaceId| match surfaces.binary_search(&s) {
        Ok(i) => positive[i],
        Err(_) => geometry.surfaces[s.index()].value(at) > 0.0,
    };
    let region_of = |positive: &[bool]| region(geometry, leaf, at, &|s| side(positive, s));
    let mut sheets = Vec::new();
    let mut leaving: Vec<&Ray> = Vec::new();
    let mut before = region_of(&positive)?;
    for step in 1..=rays.len() {
        let ray = &rays[(widest + step) % rays.len()];
        let index = surfaces.binary_search(&ray.surface).expect("a ray of a surface through the curve");
        let last = positive.clone();
        positive[index] = !positive[index];
        let after = region_of(&positive)?;
        let up = axis.cross(&ray.direction);
        let along_gradient = geometry.surfaces[ray.surface.index()].gradient(at).dot(&up) > 0.0;
        let (behind, front) = if along_gradient { (before, after) } else { (after, before) };
        if let Some(sheet) = Sheet::between(ray.surface, behind, front) {
            // Two sheets in the same direction bound a wedge of zero angle: no tets fit into it.
            let tangent = leaving.iter().find(|r| (r.direction - ray.direction).norm() <= SAME_ANGLE);
            if let Some(other) =
                tangent.filter(|other| before.is_some() || !stay_apart(other.curvature, ray.curvature))
            {
                return Err(tangent_rays(geometry, [other, ray], at, before));
            }
            leaving.push(ray);
            let cutout =
                cutout_at(geometry, leaf, ray.surface, [&|s| side(&last, s), &|s| side(&positive, s)]);
            let sheet = Sheet { cutout, ..sheet };
            // The sheet is to the left if its normal is `up`.
            sheets.push((sheet, along_gradient != sheet.flipped));
        }
        before = after;
    }
    sheets.sort_unstable();
    Ok(Some(Neighborhood { surfaces, sheets }))
}

/// Whether the chords of two tangent curves or sheets stay apart, given the heights of the lower
/// and the upper one over their common tangent, or numbers in proportion to them.
pub(super) fn stay_apart(low: f64, high: f64) -> bool {
    /// The gap must be this many times larger than the sagittas of chords that are inside it.
    const ROOM: f64 = 1.5;
    // One that bends toward the other has its chords in the gap.
    high - low > ROOM * (low.max(0.0) + (-high).max(0.0))
}

/// The error for two rays in the same direction, with the body between them.
fn tangent_rays(geometry: &Geometry, rays: [&Ray; 2], at: &Point, between: Option<BodyId>) -> FeatureError {
    FeatureError::tangent(geometry, rays.map(|ray| ray.surface), *at, between)
}

/// Two unit vectors perpendicular to `axis`; rotating the first to the second is counterclockwise.
fn frame(axis: &Vector) -> (Vector, Vector) {
    crate::primitive::quadric::tangents(axis)
}

/// The two rays of each surface in counterclockwise order around `axis`.
fn sorted_rays(
    geometry: &Geometry,
    surfaces: &[SurfaceId],
    at: &Point,
    axis: &Vector,
) -> Result<Vec<Ray>, FeatureError> {
    /// Curvatures with a smaller relative difference count as equal.
    const SAME_CURVATURE: f64 = 1e-6;
    let (u, v) = frame(axis);
    let mut rays = Vec::with_capacity(2 * surfaces.len());
    for &id in surfaces {
        let surface = &geometry.surfaces[id.index()];
        let gradient = surface.gradient(at);
        let normal = surface.normal(at);
        let Some(tangent) = axis.cross(&normal).try_normalize(0.0) else { continue };
        for direction in [tangent, -tangent] {
            let up = axis.cross(&direction);
            let curvature = -0.5 * direction.dot(&(surface.hessian(at) * direction)) / gradient.dot(&up);
            let angle = direction.dot(&v).atan2(direction.dot(&u));
            rays.push(Ray { surface: id, direction, angle, curvature });
        }
    }
    // Angles just below π and just above -π are the same direction.
    let turn = std::f64::consts::TAU;
    for ray in &mut rays {
        if ray.angle > 0.5 * turn - SAME_ANGLE {
            ray.angle -= turn;
        }
    }
    rays.sort_by(|x, y| x.angle.total_cmp(&y.angle));
    let mut start = 0;
    while start < rays.len() {
        let end =
            start + rays[start..].iter().take_while(|r| r.angle - rays[start].angle <= SAME_ANGLE).count();
        rays[start..end].sort_by(|x, y| x.curvature.total_cmp(&y.curvature));
        for two in rays[start..end].windows(2) {
            let [first, second] = [two[0].surface, two[1].surface];
            // At a seam only one of the two surfaces is a boundary.
            let is_seam = geometry.seam([first.min(second), first.max(second)]).is_some();
            let apart = SAME_CURVATURE * (two[1].curvature.abs() + two[0].curvature.abs());
            if !is_seam && two[1].curvature - two[0].curvature <= apart {
                return Err(tangent_rays(geometry, [&two[0], &two[1]], at, None));
            }
        }
        start = end;
    }
    Ok(rays)
}
