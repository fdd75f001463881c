//! Reliable normals of facets.
//!
//! Files in single precision or with seven digits move each vertex by a **rounding**. A needle or
//! cap of about this height is a **sliver**: its normal is arbitrary. It takes the normal of the
//! facet across its longest side, because it is in the plane of that facet up to the rounding.

use super::edges::Edges;
use crate::ground::kernel::simplex::area_vector;
use crate::{Point, Vector};

/// A facet whose height is at most this many roundings is a sliver; the normals of others are
/// accurate to about 2°.
pub(crate) const SLIVER_HEIGHT: f64 = 50.0;

/// Relative rounding of coordinates in single precision.
const SINGLE: f64 = 6e-8;
/// Relative rounding of coordinates with seven digits.
const SEVEN_DIGITS: f64 = 5e-7;
/// Relative rounding of other coordinates.
const DOUBLE: f64 = 1e-15;

/// The rounding of the vertices (length), estimated from the digits of the coordinates.
pub(crate) fn rounding(points: &[Point]) -> f64 {
    let largest = points.iter().map(|p| p.coords.amax()).fold(0.0, f64::max);
    let all = |contains: &dyn Fn(f64) -> bool| points.iter().all(|p| p.iter().all(|&x| contains(x)));
    let relative = if all(&|x| f64::from(x as f32) == x) {
        SINGLE
    } else if all(&|x| format!("{x:.6e}").parse() == Ok(x)) {
        SEVEN_DIGITS
    } else {
        DOUBLE
    };
    relative * largest
}

/// The unit normals of all facets, those of slivers from other facets, and whether each is a
/// sliver.
pub(crate) fn trusted(
    points: &[Point],
    triangles: &[[u32; 3]],
    edges: &Edges,
    rounding: f64,
) -> (Vec<Vector>, Vec<bool>) {
    let corners = |t: usize| triangles[t].map(|v| &points[v as usize]);
    let shape: Vec<(Vector, usize, f64)> = (0..triangles.len())
        .map(|t| {
            let p = corners(t);
            let area = area_vector(p[0], p[1], p[2]);
            let length = |k: usize| (p[(k + 2) % 3] - p[(k + 1) % 3]).norm();
            let longest = (0..3).max_by(|&i, &j| length(i).total_cmp(&length(j))).unwrap_or(0);
            (area, longest, area.norm() / length(longest).max(f64::MIN_POSITIVE))
        })
        .collect();
    let sliver: Vec<bool> = shape.iter().map(|(_, _, height)| *height <= SLIVER_HEIGHT * rounding).collect();
    let own = |t: usize| shape[t].0.try_normalize(0.0).unwrap_or_else(Vector::zeros);
    let normals = (0..triangles.len())
        .map(|t| {
            let (mut at, mut sign) = (t, 1.0);
            // Chains of slivers are short, but they can be cyclic.
            for _ in 0..LONGEST_CHAIN {
                if !sliver[at] {
                    return sign * own(at);
                }
                let side = shape[at].1;
                let edge = edges.of_side[at][side] as usize;
                let [a, b] = edges.uses(edge) else { break };
                let (here, there) = if a.triangle as usize == at { (a, b) } else { (b, a) };
                if here.along == there.along {
                    sign = -sign;
                }
                at = there.triangle as usize;
            }
            own(t)
        })
        .collect();
    (normals, sliver)
}

/// The maximum number of slivers between a sliver and the facet whose normal it takes.
const LONGEST_CHAIN: usize = 64;

/// The unit normals of a patch at the corners of its facets.
///
/// The normal at a vertex is the mean over the patch's facets there, weighted by their angles
/// (Thürmer, Wüthrich 1998), without slivers unless all are slivers. At `tips` (in ascending
/// order), each facet has its own normal.
pub(crate) fn of_corners(
    points: &[Point],
    facets: &[[u32; 3]],
    normals: &[Vector],
    sliver: &[bool],
    tips: &[u32],
) -> Vec<[Vector; 3]> {
    let mut shares: Vec<(u32, usize, usize)> = Vec::with_capacity(3 * facets.len());
    for (t, v) in facets.iter().enumerate() {
        shares.extend((0..3).map(|k| (v[k], t, k)));
    }
    shares.sort_unstable();
    let mut out = vec![[Vector::zeros(); 3]; facets.len()];
    for at_vertex in shares.chunk_by(|a, b| a.0 == b.0) {
        let angle = |&(_, t, k): &(u32, usize, usize)| {
            let p = facets[t].map(|v| &points[v as usize]);
            (p[(k + 1) % 3] - p[k]).angle(&(p[(k + 2) % 3] - p[k]))
        };
        let sum = |all: bool| -> Vector {
            let some = at_vertex.iter().filter(|(_, t, _)| all || !sliver[*t]);
            some.map(|share| normals[share.1] * angle(share)).sum()
        };
        // Normals that cancel to 10⁻⁹ have no direction but that of rounding.
        let normal = sum(false).try_normalize(1e-9).or_else(|| sum(true).try_normalize(0.0));
        let normal = normal.filter(|_| tips.binary_search(&at_vertex[0].0).is_err());
        for &(_, t, k) in at_vertex {
            out[t][k] = normal.unwrap_or(normals[t]);
        }
    }
    out
}
