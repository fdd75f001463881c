//! Curves that leave a corner too much alike for triangles.
//!
//! Two curves of a patch may leave a corner in the same direction, so that the patch has no angle
//! there. If their distance grows quadratically, as between a line and a circle, triangles of the
//! usual size have an angle of some degrees at the tip. If their curvatures are equal and the
//! distance grows with the third or fourth power (as between the rim of a rod and the circle where
//! a torus touches the rod's end), the tip is thinner than rounding over the length of a triangle.
//!
//! If two surfaces are tangent at the corner and both curves are intersections of these two, a body
//! between them is a **spike**, whose thickness vanishes with the fourth power.

use super::cut_cusps::{Cusp, Parting};
use super::{Curve, FeatureError, Features, Named, Place, curve_curvature};
use crate::project::{at_distance, project_to_both};
use crate::{CornerId, CurveId, Geometry, Point, SurfaceId, Vector};
use std::collections::BTreeMap;

/// Distance from the corner at which the curves are compared, relative to the smallest of their
/// radii of curvature and lengths. Usual mesh sizes are two to ten times larger.
const REACH: f64 = 0.1;
/// Radius at which a cusp may be cut off, relative to the same.
const CUT: f64 = 0.2;
/// Smallest angle at the corner between the points of the two curves at that distance. A line and a
/// circle have 0.05, curves that separate with the fourth power 3·10⁻⁵.
const LEAST_ANGLE: f64 = 2e-3;
/// Largest ratio of the angles at half and at full distance for a sharp cusp: the ratio is 1 for
/// curves at an angle, 1/2 for quadratic and at most 1/4 for higher-order separation.
const FALLING: f64 = 0.35;

/// Rejects the first cusp that is too sharp.
///
/// # Errors
/// [`FeatureError::Cusp`] with the surfaces beside the two curves, without that of a common patch.
pub(super) fn check(geometry: &Geometry, features: &Features) -> Result<(), FeatureError> {
    let mut ends: BTreeMap<CornerId, Vec<(CurveId, usize)>> = BTreeMap::new();
    for (i, curve) in features.curves.iter().enumerate() {
        for (end, corner) in curve.ends.into_iter().flatten().enumerate() {
            ends.entry(corner).or_default().push((CurveId::new(i), end));
        }
    }
    for (corner, ends) in ends {
        for (k, first) in ends.iter().enumerate() {
            for second in &ends[k + 1..] {
                let [c, d] = [first, second].map(|end| features.curve(end.0));
                let ends = [(c, first.1), (d, second.1)];
                let reach = reach(geometry, &ends);
                let is_sharp = |[near, far]: [f64; 2]| far < LEAST_ANGLE && near < FALLING * far;
                let angles = angles(geometry, ends, REACH * reach);
                let is_spike = angles.is_some_and(|angles| is_spike(geometry, ends, REACH * reach, angles));
                if !is_spike && !angles.is_some_and(is_sharp) {
                    continue;
                }
                // Curves without a common patch are on boundaries that touch at the corner.
                let common = c.fins.iter().find(|fin| d.fins.iter().any(|other| other.patch == fin.patch));
                let of_patch = common.map(|fin| features.patch(fin.patch).surface);
                let surfaces = [c, d].map(|curve| {
                    let other = curve.surfaces.iter().find(|s| Some(**s) != of_patch);
                    *other.unwrap_or(&curve.surfaces[0])
                });
                let point = features.corner(corner).point;
                let along = parting(geometry, ends, reach, is_spike);
                // Both surfaces of a spike end there.
                let surfaces = if is_spike { c.surfaces } else { surfaces };
                let cusp =
                    Cusp { surfaces, between: None, point, arc: Vec::new(), reach: CUT * reach, along };
                let [first, second] = surfaces.map(|s| Named::surface(geometry, s));
                return Err(FeatureError::Cusp { first, second, place: Place(point), cusp: Box::new(cusp) });
            }
        }
    }
    Ok(())
}

/// The smallest radius of curvature or length of two curves that end at a corner.
fn reach(geometry: &Geometry, ends: &[(&Curve, usize); 2]) -> f64 {
    let of = |(curve, end): &(&Curve, usize)| {
        let trace = &curve.trace;
        let [p, q] = if *end == 0 { [0, 1] } else { [trace.len() - 1, trace.len() - 2] }.map(|i| trace[i]);
        curve.length().min(1.0 / curve_curvature(geometry, curve, &nalgebra::center(&p, &q)))
    };
    of(&ends[0]).min(of(&ends[1]))
}

/// The points of two curves at a distance from their common corner.
///
/// `None` if a curve cannot be followed that far.
fn points_at(geometry: &Geometry, ends: [(&Curve, usize); 2], distance: f64) -> Option<[Point; 2]> {
    let point = |(curve, end): (&Curve, usize)| {
        let mut trace = curve.trace.clone();
        if end == 1 {
            trace.reverse();
        }
        let [a, b] = curve.surfaces.map(|s| &geometry.surfaces[s.index()]);
        at_distance(&trace, distance, |at| project_to_both(a, b, at, f64::EPSILON * distance))
    };
    let [first, second] = ends;
    Some([point(first)?, point(second)?])
}

/// The angles at a corner between the points of two curves at half and at full distance.
///
/// `None` if a curve cannot be followed that far.
fn angles(geometry: &Geometry, ends: [(&Curve, usize); 2], far: f64) -> Option<[f64; 2]> {
    let angle = |distance: f64| {
        let [p, q] = points_at(geometry, ends, distance)?;
        Some((p - q).norm() / distance)
    };
    Some([angle(0.5 * far)?, angle(far)?])
}

/// Whether two curves bound a spike of a body: they leave the corner alike, between the same two
/// surfaces, which are tangent there.
///
/// `angles` are those between the points of the curves at half the distance and at the distance.
/// Where the curves separate quadratically, the thickness of the spike grows with the fourth power.
fn is_spike(geometry: &Geometry, ends: [(&Curve, usize); 2], distance: f64, angles: [f64; 2]) -> bool {
    /// Largest ratio of the angles; 1/2 for quadratic separation.
    const FALLING: f64 = 0.6;
    if ends[0].0.surfaces != ends[1].0.surfaces || angles[0] > FALLING * angles[1] {
        return false;
    }
    let dihedral = |part: f64| dihedral(geometry, ends, part * distance);
    let (Some(half), Some(whole)) = (dihedral(0.5), dihedral(1.0)) else { return false };
    half < FALLING * whole && whole < LEAST_DIHEDRAL && is_inside(geometry, ends, distance)
}

/// The least sine of the angle between the two surfaces of a spike at which it may begin (6°).
const LEAST_DIHEDRAL: f64 = 0.1;

/// The sine of the angle between two surfaces on the first of two curves of their intersection.
fn dihedral(geometry: &Geometry, ends: [(&Curve, usize); 2], distance: f64) -> Option<f64> {
    let [p, _] = points_at(geometry, ends, distance)?;
    let [a, b] = ends[0].0.surfaces.map(|s| geometry.surfaces[s.index()].normal(&p));
    Some(a.cross(&b).norm())
}

/// Whether the space between the two surfaces, halfway between the curves, belongs to a body.
fn is_inside(geometry: &Geometry, ends: [(&Curve, usize); 2], distance: f64) -> bool {
    let Some([p, q]) = points_at(geometry, ends, distance) else { return false };
    let on = ends[0].0.surfaces.map(|s| geometry.surfaces[s.index()].project(&nalgebra::center(&p, &q)));
    let [Ok(a), Ok(b)] = on else { return false };
    let between = nalgebra::center(&a, &b);
    let positive = |s: SurfaceId| geometry.surfaces[s.index()].value(&between) > 0.0;
    geometry.bodies.iter().any(|body| body.solid.contains(&positive))
}

/// Where two curves that leave a corner alike are far enough apart, and in a spike the surfaces
/// too.
///
/// `None` if that is nowhere within `reach` (about twice of it for a spike), or if they do not
/// leave their tangent.
fn parting(geometry: &Geometry, ends: [(&Curve, usize); 2], reach: f64, is_spike: bool) -> Option<Parting> {
    /// Distances, relative to the reach; those above 1 are for spikes.
    const SHARES: [f64; 10] = [0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 1.0, 1.3, 1.7, 2.2];
    /// The wanted angle between the points of the curves, seen from the corner, radians.
    const WANTED: f64 = 2e-3;
    let corner = ends[0].0.trace[if ends[0].1 == 0 { 0 } else { ends[0].0.trace.len() - 1 }];
    let towards = |distance: f64| -> Option<Vector> {
        let [p, q] = points_at(geometry, ends, distance)?;
        Some((nalgebra::center(&p, &q) - corner) / distance)
    };
    // Very near the corner the curves cannot be told apart; their directions change linearly.
    let (half, whole) = (towards(0.5 * REACH * reach)?, towards(REACH * reach)?);
    let tangent = (half * 2.0 - whole).try_normalize(0.0)?;
    SHARES.into_iter().filter(|share| is_spike || *share < 1.0).find_map(|share| {
        let distance = share * reach;
        let points = points_at(geometry, ends, distance)?;
        let aside = points.iter().map(|p| (p - corner).cross(&tangent).norm()).fold(0.0, f64::max);
        let apart = (points[0] - points[1]).norm();
        let is_thick = !is_spike || dihedral(geometry, ends, distance)? > LEAST_DIHEDRAL;
        let along = points.iter().map(|p| (p - corner).dot(&tangent)).fold(f64::INFINITY, f64::min);
        let parting = Parting { tangent, distance: along, aside, is_spike };
        (apart > WANTED * distance && apart < aside && is_thick).then_some(parting)
    })
}
