//! The nearest point of a triangle and of a segment.

use crate::Point;

/// A triangle whose height is below this fraction of its longest side is treated as its sides,
/// because its plane is dominated by rounding.
const NEEDLE: f64 = 1e-9;

/// Below this ratio of the height to the longest side the weights are computed with more care. The
/// usual ones have the error of rounding over the square of the ratio, which moves points along a
/// thin triangle.
const THIN: f64 = 0.1;

/// The barycentric weights of the point of a triangle nearest to `p`.
///
/// If that point is on a side or corner, the weights of the other corners are exactly 0. The
/// regions of corners and sides are found by dot products, as in Ericson 2005, section 5.1.5.
#[inline]
pub(crate) fn in_triangle(p: &Point, [a, b, c]: &[Point; 3]) -> [f64; 3] {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(&ap), ac.dot(&ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(&bp), ac.dot(&bp));
    if d3 >= 0.0 && d4 <= d3 {
        return [0.0, 1.0, 0.0];
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(&cp), ac.dot(&cp));
    if d6 >= 0.0 && d5 <= d6 {
        return [0.0, 0.0, 1.0];
    }
    // The weights of c, b and a, times the square of twice the area.
    let vc = d1 * d4 - d3 * d2;
    let vb = d5 * d2 - d1 * d6;
    let va = d3 * d6 - d5 * d4;
    let scale = ab.norm_squared().max(ac.norm_squared());
    if va + vb + vc <= NEEDLE * NEEDLE * scale * scale {
        return in_sides(p, [a, b, c]);
    }
    if va + vb + vc <= THIN * THIN * scale * scale {
        return in_thin(p, [a, b, c]);
    }
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let t = d1 / (d1 - d3);
        return [1.0 - t, t, 0.0];
    }
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let t = d2 / (d2 - d6);
        return [1.0 - t, 0.0, t];
    }
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        let t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return [0.0, 1.0 - t, t];
    }
    let (v, w) = (vb / (va + vb + vc), vc / (va + vb + vc));
    [1.0 - v - w, v, w]
}

/// The same for thin triangles.
#[cold]
fn in_thin(p: &Point, corners: [&Point; 3]) -> [f64; 3] {
    let [a, b, c] = corners;
    let (ab, ac, bc) = (b - a, c - a, c - b);
    // Products of areas have the error of rounding over the ratio only.
    let normal = ab.cross(&ac);
    let of_a = normal.dot(&bc.cross(&(p - b)));
    let weights = |ap: crate::Vector| [normal.dot(&ap.cross(&ac)), normal.dot(&ab.cross(&ap))];
    let [of_b, of_c] = weights(p - a);
    if of_a <= 0.0 || of_b <= 0.0 || of_c <= 0.0 {
        return in_sides(p, corners);
    }
    let square = normal.norm_squared();
    let [v, w] = [of_b / square, of_c / square];
    // What is left between the point and its foot is short, and so is the error of its weights.
    let [dv, dw] = weights(p - (a + ab * v + ac * w));
    let [v, w] = [v + dv / square, w + dw / square];
    if v > 0.0 && w > 0.0 && v + w < 1.0 { [1.0 - v - w, v, w] } else { in_sides(p, corners) }
}

/// The same for the sides only.
#[cold]
fn in_sides(p: &Point, corners: [&Point; 3]) -> [f64; 3] {
    let mut best = (f64::INFINITY, [0.0; 3]);
    for (i, j) in [(0, 1), (1, 2), (2, 0)] {
        let (t, squared) = in_segment(p, corners[i], corners[j]);
        if squared < best.0 {
            best = (squared, [0.0; 3]);
            best.1[i] = 1.0 - t;
            best.1[j] = t;
        }
    }
    best.1
}

/// The parameter, from 0 to 1, of the point of a segment nearest to `p`, and the squared distance.
#[inline]
pub(crate) fn in_segment(p: &Point, a: &Point, b: &Point) -> (f64, f64) {
    let (along, to) = (b - a, p - a);
    let length = along.norm_squared();
    let t = if length > 0.0 { (along.dot(&to) / length).clamp(0.0, 1.0) } else { 0.0 };
    (t, (to - along * t).norm_squared())
}

/// The point with these weights; exact at corners.
#[inline]
pub(crate) fn at(corners: &[Point; 3], weights: [f64; 3]) -> Point {
    let [a, b, c] = corners;
    match weights {
        [_, 0.0, 0.0] => *a,
        [0.0, _, 0.0] => *b,
        [0.0, 0.0, _] => *c,
        [_, v, w] => a + (b - a) * v + (c - a) * w,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::kernel::random::Random;
    use nalgebra::Rotation3;

    #[test]
    fn points_of_thin_triangles_are_their_own_nearest_points() {
        let mut random = Random::new(5);
        for ratio in [0.5, 0.09, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6] {
            let turn = Rotation3::from_euler_angles(0.4, -1.1, 2.0);
            let corners = [[3.0, 7.0, -2.0], [103.0, 7.0, -2.0], [33.0, 7.0 + 100.0 * ratio, -2.0]];
            let corners = corners.map(|p| turn * Point::from(p));
            for _ in 0..1000 {
                let (v, w) = (random.unit(), random.unit());
                let [v, w] = if v + w > 1.0 { [1.0 - v, 1.0 - w] } else { [v, w] };
                let [a, b, c] = &corners;
                let point = a + (b - a) * v + (c - a) * w;
                let off = (at(&corners, in_triangle(&point, &corners)) - point).norm();
                assert!(off <= 1e-12, "height {ratio}: {off:e} off");
            }
        }
    }
}
