//! Faces that end in a cusp too sharp for triangles.
//!
//! Two curves of a patch may leave a corner in the same direction, so that the patch has no angle
//! there. If their distance grows quadratically, as between a line and a circle, triangles of the
//! usual size have an angle of some degrees at the tip. If their curvatures are equal and the
//! distance grows with the third or fourth power (as between the rim of a rod and the circle where
//! a torus touches the rod's end), the tip is thinner than rounding over the length of a triangle.

use super::{Curve, FeatureError, Features, Named, Place, curve_curvature};
use crate::project::{at_distance, project_to_both};
use crate::{CornerId, CurveId, Geometry, Point};
use std::collections::BTreeMap;

/// Distance from the corner at which the curves are compared, relative to the smallest of their
/// radii of curvature and lengths. Usual mesh sizes are two to ten times larger.
const REACH: f64 = 0.1;
/// Smallest angle at the corner between the points of the two curves at that distance. A line and a
/// circle have 0.05, curves that separate with the fourth power 3·10⁻⁵.
const LEAST_ANGLE: f64 = 2e-3;
/// Largest ratio of the angles at half and at full distance for a sharp cusp: the ratio is 1 for
/// curves at an angle, 1/2 for quadratic and at most 1/4 for higher-order separation.
const FALLING: f64 = 0.35;

/// Rejects the first cusp that is too sharp.
///
/// # Errors
/// [`FeatureError::Cusp`] with the surfaces beside the two curves other than that of the patch.
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

/// The angles at a corner between the points of two curves at half and at full distance.
///
/// `None` if a curve cannot be followed that far.
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
