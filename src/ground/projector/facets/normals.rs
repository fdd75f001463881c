//! Directions of facets that can be trusted.
//!
//! Files of single precision, or with seven digits, move each vertex by a **rounding** that a needle or a cap of the same
//! height does not survive: its normal may be anything. Such facets are **slivers**; they take the normal of the facet across their
//! longest side, in whose plane they lie up to the rounding.

use super::edges::Edges;
use crate::ground::kernel::simplex::area_vector;
use crate::{Point, Vector};

/// A facet lower than this many roundings is a sliver: the normal of any other is right within about 2°.
pub(crate) const SLIVER_HEIGHT: f64 = 50.0;

/// Relative rounding of coordinates in single precision.
const SINGLE: f64 = 6e-8;
/// Relative rounding of coordinates with seven digits.
const SEVEN_DIGITS: f64 = 5e-7;
/// Relative rounding of others.
const DOUBLE: f64 = 1e-15;

/// How far a vertex may be from where it was meant to be, a length: judged from the digits that the coordinates have.
pub(crate) fn rounding(points: &[Point]) -> f64 {
    let largest = points.iter().map(|p| p.coords.amax()).fold(0.0, f64::max);
    let all = |holds: &dyn Fn(f64) -> bool| points.iter().all(|p| p.iter().all(|&x| holds(x)));
    let relative = if all(&|x| f64::from(x as f32) == x) {
        SINGLE
    } else if all(&|x| format!("{x:.6e}").parse() == Ok(x)) {
        SEVEN_DIGITS
    } else {
        DOUBLE
    };
    relative * largest
}

/// The unit normals of all facets, those of slivers borrowed; and which are slivers.
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
            // Chains of slivers end soon; one that goes round ends where it began.
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

/// Slivers in a row that are followed to the facet whose normal they take.
const LONGEST_CHAIN: usize = 64;

/// For each corner of each facet of one patch, the unit normal of the patch there: the mean over the patch's facets at the
/// vertex, by their angles (Thürmer, Wüthrich 1998), slivers left out where there are others. At `tips` (ascending), each facet's own.
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
        let normal = sum(false).try_normalize(1e-9).or_else(|| sum(true).try_normalize(0.0));
        let normal = normal.filter(|_| tips.binary_search(&at_vertex[0].0).is_err());
        for &(_, t, k) in at_vertex {
            out[t][k] = normal.unwrap_or(normals[t]);
        }
    }
    out
}
