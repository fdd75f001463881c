//! Reliable normals of facets.
//!
//! Files in single precision or with seven digits move each vertex by a **rounding**. A needle or
//! cap of about this height is a **sliver**: its normal is arbitrary. It takes the normal of the
//! facet across its longest side, because it is in the plane of that facet up to the rounding.
//! Higher needles and caps are slivers if their normal strays from those beside them, which agree:
//! scans and decimated surfaces have folds of such facets, which are no edges of the shape.

use super::edges::Edges;
use crate::ground::kernel::simplex::area_vector;
use crate::{Point, Vector};
use rayon::prelude::*;

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
    (relative * largest).max(fixed_point(points, largest).unwrap_or(0.0))
}

/// Half of the last decimal place of coordinates in fixed point, if they were rounded to it.
///
/// Programs write coordinates with six places, or snap those of Boolean results to integers.
/// Coordinates of a drawing are multiples of a power of ten too, but most of these end in zeros, or
/// the part has few vertices.
fn fixed_point(points: &[Point], largest: f64) -> Option<f64> {
    /// The most decimal places: of more, doubles hold too few multiples to tell.
    const MOST_PLACES: i32 = 9;
    /// The fewest vertices from which a conclusion is drawn.
    const FEWEST: usize = 50;
    /// The coarsest rounding, relative to the largest coordinate.
    const COARSEST: f64 = 1e-5;
    /// The least share of coordinates with a last digit other than zero; nine tenths are expected.
    const LEAST_SHARE: f64 = 0.6;
    let coordinates = || points.iter().flat_map(|p| p.iter().copied());
    let is_whole = |x: f64| (x - x.round()).abs() <= 4.0 * f64::EPSILON * x.abs();
    let places = (0..=MOST_PLACES).find(|&d| coordinates().all(|x| is_whole(x * 10f64.powi(d))))?;
    let unit = 10f64.powi(-places);
    let uneven = coordinates().filter(|x| !is_whole(0.1 * (x / unit).round())).count();
    let is_rounded = points.len() >= FEWEST && uneven as f64 >= LEAST_SHARE * 3.0 * points.len() as f64;
    (is_rounded && unit <= COARSEST * largest).then_some(0.5 * unit)
}

/// The unit normals of all facets, those of slivers from other facets, and whether each is a
/// sliver.
pub(crate) fn trusted(
    points: &[Point],
    triangles: &[[u32; 3]],
    edges: &Edges,
    rounding: f64,
) -> (Vec<Vector>, Vec<bool>) {
    let shapes: Vec<Shape> =
        triangles.par_iter().map(|t| Shape::of(t.map(|v| &points[v as usize]))).collect();
    let mut sliver: Vec<bool> = shapes.iter().map(|s| s.height <= SLIVER_HEIGHT * rounding).collect();
    let mut normals = normals_without(&shapes, &sliver, edges);
    // A sliver beside another one is found after it.
    for _ in 0..ROUNDS {
        let strays = |&t: &usize| !sliver[t] && is_astray(t, &shapes[t], &normals, edges);
        let astray: Vec<usize> = (0..shapes.len()).into_par_iter().filter(strays).collect();
        if astray.is_empty() {
            break;
        }
        astray.into_iter().for_each(|t| sliver[t] = true);
        normals = normals_without(&shapes, &sliver, edges);
    }
    (normals, sliver)
}

/// See [`trusted`].
const ROUNDS: usize = 4;

/// The shape of a facet.
struct Shape {
    area: Vector,
    /// The sides (opposite to the corner of the same number), the longest first.
    sides: [usize; 3],
    /// The distance of the corner opposite to the longest side from that side.
    height: f64,
    /// The sine of the angles between the longest side and the second and third.
    sines: [f64; 2],
}

impl Shape {
    fn of(p: [&Point; 3]) -> Self {
        let area = area_vector(p[0], p[1], p[2]);
        let length = |k: usize| (p[(k + 2) % 3] - p[(k + 1) % 3]).norm().max(f64::MIN_POSITIVE);
        let mut sides = [0, 1, 2];
        sides.sort_by(|&i, &j| length(j).total_cmp(&length(i)));
        let height = area.norm() / length(sides[0]);
        Self { area, sides, height, sines: [sides[1], sides[2]].map(|side| height / length(side)) }
    }

    fn normal(&self) -> Vector {
        self.area.try_normalize(0.0).unwrap_or_else(Vector::zeros)
    }
}

/// Whether the normal of a needle or cap strays from those of the facets at its long sides, of
/// which that at the longest agrees with another.
///
/// Scans and decimated surfaces contain such facets; they are higher than the rounding, but no
/// part of the shape.
fn is_astray(t: usize, shape: &Shape, normals: &[Vector], edges: &Edges) -> bool {
    let turn = |side: usize| {
        let [a, b] = edges.uses(edges.of_side[t][side] as usize) else { return None };
        let other = if a.triangle as usize == t { b } else { a };
        let normal = normals[other.triangle as usize];
        Some(if a.along == b.along { -normal } else { normal })
    };
    let long = |&k: &usize| k == 0 || shape.sines[k - 1] < SHARP;
    let beside: Option<Vec<Vector>> = (0..3).filter(long).map(|k| turn(shape.sides[k])).collect();
    let Some(beside) = beside.filter(|beside| beside.len() > 1) else { return false };
    let strays = beside.iter().map(|n| n.angle(&normals[t])).fold(f64::INFINITY, f64::min);
    let differ = beside[1..].iter().map(|n| n.angle(&beside[0])).fold(f64::INFINITY, f64::min);
    strays > STRAYS && differ < AGREE * strays
}

/// Sine of the largest angle of a needle at its tip (10°).
const SHARP: f64 = 0.174;
/// The least angle by which a stray normal differs from both others (radians; 20°).
const STRAYS: f64 = 0.35;
/// These differ from each other by less than this fraction of it.
const AGREE: f64 = 0.5;

/// The normals of facets, those of slivers from the facets across their longest sides.
fn normals_without(shapes: &[Shape], sliver: &[bool], edges: &Edges) -> Vec<Vector> {
    let normal = |t: usize| {
        let (mut at, mut sign) = (t, 1.0);
        // Chains of slivers are short, but they can be cyclic.
        for _ in 0..LONGEST_CHAIN {
            if !sliver[at] {
                return sign * shapes[at].normal();
            }
            let edge = edges.of_side[at][shapes[at].sides[0]] as usize;
            let [a, b] = edges.uses(edge) else { break };
            let (here, there) = if a.triangle as usize == at { (a, b) } else { (b, a) };
            if here.along == there.along {
                sign = -sign;
            }
            at = there.triangle as usize;
        }
        shapes[t].normal()
    };
    (0..shapes.len()).map(normal).collect()
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::kernel::random::Random;

    #[test]
    fn the_rounding_of_fixed_point_is_half_of_the_last_place() {
        let mut random = Random::new(7);
        let mut coordinate = |unit: f64| (40.0 * random.unit() / unit).round() * unit;
        let mut points = |unit: f64| -> Vec<Point> {
            (0..60).map(|_| Point::from([0; 3].map(|_| coordinate(unit)))).collect()
        };
        let rounded = points(1e-6);
        assert!((rounding(&rounded) / 5e-7 - 1.0).abs() < 1e-9, "{}", rounding(&rounded));
        // Too few to tell, a drawing in tenths, and coordinates of a scan with all digits.
        assert!(rounding(&rounded[..40]) < 1e-12);
        assert!(rounding(&points(0.1)) < 1e-3);
        assert!(rounding(&points(1e-6 / 3.0)) < 1e-12);
    }
}
