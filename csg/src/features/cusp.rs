//! Curves that leave a corner too much alike for triangles.
//!
//! Two curves of a patch may leave a corner in the same direction, so that the patch has no angle
//! there. If their distance grows quadratically, as between a line and a circle, triangles of the
//! usual size have an angle of some degrees at the tip. If their curvatures are equal and the
//! distance grows with the third or fourth power (as between the rim of a rod and the circle where
//! a torus touches the rod's end), the tip is thinner than rounding over the length of a triangle.

use super::cut_cusps::Cusp;
use super::{Curve, FeatureError, Features, Named, Place, curve_curvature};
use crate::project::{at_distance, project_to_both};
use crate::{CornerId, CurveId, Geometry, Point};
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
                if !angles(geometry, ends, REACH * reach).is_some_and(is_sharp) {
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
                let [first, second] = surfaces.map(|s| Named::surface(geometry, s));
                let cusp = Cusp { surfaces, between: None, point, arc: Vec::new(), reach: CUT * reach };
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

/// The angles at a corner between the points of two curves at half and at full distance.
///
/// `None` if a curve cannot be followed that far.
fn angles(geometry: &Geometry, ends: [(&Curve, usize); 2], far: f64) -> Option<[f64; 2]> {
    let traces = ends.map(|(curve, end)| {
        let mut trace = curve.trace.clone();
        if end == 1 {
            trace.reverse();
        }
        trace
    });
    let angle = |distance: f64| {
        let [p, q] = [0, 1].map(|i| {
            let [a, b] = ends[i].0.surfaces.map(|s| &geometry.surfaces[s.index()]);
            let project = |at: &Point| project_to_both(a, b, at, f64::EPSILON * distance);
            at_distance(&traces[i], distance, project)
        });
        Some((p? - q?).norm() / distance)
    };
    Some([angle(0.5 * far)?, angle(far)?])
}
