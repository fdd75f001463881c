//! Faces that end in a cusp too sharp for triangles.
//!
//! Two curves of a patch may leave a corner in one direction: the patch has no angle there. Where they part with the square of the distance,
//! as a line and a circle do, triangles of the usual size have an angle of some degrees at the tip. Where they bend alike and part
//! with its third or fourth power (the end of a rod and the torus around which its own rim runs, in one point), the tip is as thin as
//! rounding before it is as wide as a triangle is long.

use super::{Curve, FeatureError, Features, Named, Place, curve_curvature};
use crate::project::{at_distance, project_to_both};
use crate::{CornerId, CurveId, Geometry, Point};
use std::collections::BTreeMap;

/// How far from the corner the curves are compared, in the least of their radii of curvature and lengths: a tenth to a half of what sizes ask for.
const REACH: f64 = 0.1;
/// The angle under which two curves of a cusp must be seen from the corner there. A line and a circle: 0.05; curves that part with
/// the fourth power: 3·10⁻⁵.
const LEAST_ANGLE: f64 = 2e-3;
/// Half as far away it is the same for curves that leave at an angle, a half where they part with the square of the distance, a quarter and less
/// where with higher powers.
const FALLING: f64 = 0.35;

/// Refuses the first cusp that is too sharp.
///
/// # Errors
/// Names the surfaces beside the two curves, other than that of the patch.
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
                let is_beside = |curve: &Curve, patch| curve.fins.iter().any(|fin| fin.patch == patch);
                let Some(fin) = c.fins.iter().find(|fin| is_beside(d, fin.patch)) else { continue };
                let angles = angles(geometry, [(c, first.1), (d, second.1)]);
                if !angles.is_some_and(|[near, far]| far < LEAST_ANGLE && near < FALLING * far) {
                    continue;
                }
                let of_patch = features.patch(fin.patch).surface;
                let [first, second] = [c, d].map(|curve| {
                    let other = curve.surfaces.iter().find(|s| **s != of_patch);
                    Named::surface(geometry, *other.unwrap_or(&of_patch))
                });
                return Err(FeatureError::Cusp {
                    first,
                    second,
                    place: Place(features.corner(corner).point),
                });
            }
        }
    }
    Ok(())
}

/// The angles under which two curves that end at a corner are seen from there, half as far away and as far away as they are
/// compared; `None` where they cannot be followed.
fn angles(geometry: &Geometry, ends: [(&Curve, usize); 2]) -> Option<[f64; 2]> {
    let traces = ends.map(|(curve, end)| {
        let mut trace = curve.trace.clone();
        if end == 1 {
            trace.reverse();
        }
        trace
    });
    let mut reach = f64::INFINITY;
    for ((curve, _), trace) in ends.iter().zip(&traces) {
        let middle = nalgebra::center(&trace[0], &trace[1]);
        reach = reach.min(curve.length()).min(1.0 / curve_curvature(geometry, curve, &middle));
    }
    let angle = |distance: f64| {
        let [p, q] = [0, 1].map(|i| {
            let [a, b] = ends[i].0.surfaces.map(|s| &geometry.surfaces[s.index()]);
            let project = |at: &Point| project_to_both(a, b, at, f64::EPSILON * distance);
            at_distance(&traces[i], distance, project)
        });
        Some((p? - q?).norm() / distance)
    };
    let far = REACH * reach;
    Some([angle(0.5 * far)?, angle(far)?])
}
