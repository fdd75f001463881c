//! Initial triangulations of whole sheets.

use super::{Site, TURN_GRID};
use crate::Vector;
use std::f64::consts::TAU;

/// The initial triangulation of a whole sheet.
pub(in crate::mesher::surface) struct Start {
    /// The sites of its vertices.
    pub sites: Vec<Site>,
    /// Its triangles, counter-clockwise.
    pub triangles: Vec<[u32; 3]>,
}

/// A ring of four outside vertices between the two poles; vertex 4 is the pole of the apex, if
/// there is one.
pub(super) fn bipyramid(height: f64, shift: f64, apex: f64) -> Start {
    let on_grid = |t: f64| (t.fract() * TURN_GRID).floor() / TURN_GRID;
    let mut sites: Vec<Site> = (0..4).map(|k| [on_grid(shift + f64::from(k) * 0.25), height, 0.0]).collect();
    let first = if apex == 0.0 { -1.0 } else { apex };
    sites.push([0.0, 0.0, first]);
    sites.push([0.0, 0.0, -first]);
    let (up, down) = if first > 0.0 { (4, 5) } else { (5, 4) };
    let triangles = (0..4).flat_map(|k| [[k, (k + 1) % 4, up], [(k + 1) % 4, k, down]]).collect();
    Start { sites, triangles }
}

/// A grid on the torus: rings along the axis direction, four around the tube, shifted by half a
/// step against each other.
///
/// The number of vertices per ring makes the triangles about as long as wide.
pub(super) fn torus_grid(shift: f64, ratio: f64) -> Start {
    /// Limits the memory for extremely thin tubes.
    const MOST: f64 = 10_000.0;
    let on_grid = |t: f64| (t.fract() * TURN_GRID).floor() / TURN_GRID;
    let count = (2.0 * (ratio + 1.0)).ceil().clamp(4.0, MOST) as u32;
    let sites = (0..4 * count)
        .map(|k| {
            let (i, j) = (k % count, k / count);
            let along = (f64::from(i) + 0.5 * f64::from(j % 2)) / f64::from(count);
            [on_grid(shift + along), on_grid(0.7 * shift + f64::from(j) * 0.25), 0.0]
        })
        .collect();
    let at = |i: u32, j: u32| (i % count) + count * (j % 4);
    let mut triangles = Vec::new();
    for j in 0..4 {
        for i in 0..count {
            // Odd rows are shifted by half a step.
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)];
            triangles.extend(if j % 2 == 0 { [[a, b, c], [b, d, c]] } else { [[a, d, c], [a, b, d]] });
        }
    }
    Start { sites, triangles }
}

/// A rotated icosahedron.
pub(super) fn icosahedron(shift: f64) -> Start {
    let g = 0.5 * (1.0 + 5.0_f64.sqrt());
    let turned = nalgebra::Rotation3::from_euler_angles(TAU * shift, 1.0 + shift, 2.0 - shift);
    let base = [[0.0, 1.0, g], [1.0, g, 0.0], [g, 0.0, 1.0]];
    let mut corners: Vec<Vector> = Vec::new();
    for [x, y, z] in base {
        for (s, t) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
            // The zero coordinate stays; the other two get both signs.
            let v = if x == 0.0 {
                [0.0, s * y, t * z]
            } else if z == 0.0 {
                [s * x, t * y, 0.0]
            } else {
                [s * x, 0.0, t * z]
            };
            corners.push(turned * (Vector::from(v) / (1.0 + g * g).sqrt()));
        }
    }
    // Faces are the triples at mutual edge distance 2/√(1+g²), oriented outward by the sign of
    // their determinant.
    let edge = 4.0 / (1.0 + g * g);
    let close = |a: usize, b: usize| (corners[a] - corners[b]).norm_squared() < 1.2 * edge;
    let mut triangles = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if close(a, b) && close(b, c) && close(c, a) {
                    let outward = corners[a].dot(&corners[b].cross(&corners[c])) > 0.0;
                    let [b, c] = if outward { [b, c] } else { [c, b] };
                    triangles.push([a as u32, b as u32, c as u32]);
                }
            }
        }
    }
    Start { sites: corners.iter().map(|v| [v.x, v.y, v.z]).collect(), triangles }
}
