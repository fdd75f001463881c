//! Revolutions and extrusions: features, and volumes by Pappus' theorem.

use crate::common::{own, report_of};
use std::f64::consts::PI;

/// Points of a segment of kind 3 without its first: x(t) with the weight that the language gives to
/// the control point.
fn arc(points: [[f64; 2]; 3]) -> impl Iterator<Item = [f64; 2]> {
    const PARTS: u32 = 2000;
    let [p, q, r] = points;
    let square = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2);
    let weight = (square(p, r) / (0.5 * (square(p, q) + square(q, r)))).sqrt();
    (1..=PARTS).map(move |i| {
        let t = f64::from(i) / f64::from(PARTS);
        let [a, b, c] = [(1.0 - t) * (1.0 - t), weight * t * (1.0 - t), t * t];
        [0, 1].map(|k| (a * p[k] + b * q[k] + c * r[k]) / (a + b + c))
    })
}

/// A profile: points, and the control points of arcs before their ends.
fn profile(parts: &[&[[f64; 2]]]) -> Vec<[f64; 2]> {
    let mut points: Vec<[f64; 2]> = Vec::new();
    for part in parts {
        match (*part, points.last().copied()) {
            ([q, r], Some(p)) => points.extend(arc([p, *q, *r])),
            (part, _) => points.extend(part),
        }
    }
    points
}

/// The volume of a closed polygon in (height, distance from the axis) swept through a full turn.
fn turned(points: &[[f64; 2]]) -> f64 {
    let next = points.iter().cycle().skip(1);
    let each = points.iter().zip(next).map(|([x, r], [y, s])| (y - x) * (r * r + r * s + s * s));
    PI / 3.0 * each.sum::<f64>().abs()
}

/// Each part with its volume and its numbers of corners, curves and patches.
fn parts() -> Vec<(&'static str, f64, [u64; 3])> {
    let beam = 2.0 * 4.0 * 0.5 + 4.0 * 0.4 + 4.0 * (1.0 - PI / 4.0) * 0.09;
    let groove: &[_] = &[[5.5, 1.0], [6.0, 1.5]];
    let spindle = profile(&[
        &[[0., 0.]],
        &[[0., 1.]],
        &[[0.2, 1.2]],
        &[[3., 1.2]],
        &[[3., 2.]],
        &[[5., 2.]],
        &[[5., 1.5]],
        groove,
        &[[8., 1.]],
        &[[10., 1.]],
        &[[10.3, 0.7]],
        &[[10.3, 0.]],
    ]);
    let vase = profile(&[
        &[[0., 0.]],
        &[[0., 2.]],
        &[[1., 5.], [5., 3.2]],
        &[[7.5, 1.6], [9., 2.5]],
        &[[8.9, 2.3]],
        &[[7.5, 1.5], [5.2, 2.7]],
        &[[2.5, 3.7], [1.5, 2.2]],
        &[[0.5, 2.2], [0.5, 0.]],
    ]);
    let ring = profile(&[&[[-0.5, 1.5]], &[[-0.5, 2.5]], &[[0., 3.], [0.5, 2.5]], &[[0.5, 1.5]]]);
    // An arc of a circle with a chord of √300 between tangents of length √125.
    let cosine = 300.0_f64.sqrt() / (2.0 * 125.0_f64.sqrt());
    let half = cosine.acos();
    let quarter: Vec<[f64; 2]> = profile(&[&[[0., 0.]], &[[2., 0.], [2., 1.]]]);
    let oval: f64 = quarter.windows(2).map(|w| (w[1][0] - w[0][0]).hypot(w[1][1] - w[0][1])).sum();
    let bar = 4.0 * (2.0 * half * 125.0_f64.sqrt() / half.tan());
    vec![
        ("pipe_bend", 0.09 * PI * (3.0 + PI), [0, 8, 8]),
        ("square_ring", 80.0 * PI, [0, 4, 4]),
        ("i_beam", 10.0 * beam, [32, 48, 14]),
        ("spindle", turned(&spindle), [0, 10, 11]),
        ("vase", turned(&vase), [0, 6, 7]),
        ("swept_copies", 2.0 * turned(&ring) + 0.24 * 1.5 * PI, [8, 20, 14]),
        ("twisted_bar", bar, [8, 12, 6]),
        ("oval_twist", 0.16 * (2.5 + oval), [16, 28, 14]),
        // Two straight segments as long as two sides of the arc's triangle.
        ("winding_bar", bar + 8.0 * 125.0_f64.sqrt(), [16, 28, 14]),
    ]
}

#[test]
fn swept_parts_have_their_features_and_volumes() {
    for (name, exact, entities) in parts() {
        let error = |levels: &str| {
            let report = report_of(&own(name), &["--levels", levels, "--preset", "coarse"]);
            let found =
                ["corners", "curves", "patches"].map(|kind| report["entities"][kind].as_u64().unwrap());
            assert_eq!(found, entities, "{name}");
            (report["mesh"]["volume"].as_f64().unwrap() - exact).abs()
        };
        let [once, thrice] = [error("1"), error("3")];
        // Two halvings divide the error of chords by sixteen asymptotically; the errors inside and
        // outside a pipe have different signs.
        assert!(thrice <= 0.002 * exact, "{name}: {thrice} of {exact}");
        assert!(thrice <= 0.15 * once + 1e-9 * exact, "{name}: {once}, then {thrice}");
    }
}
