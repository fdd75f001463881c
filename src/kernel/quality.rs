//! Shape measures of tets: 1 for the regular tet, 0 for a flat one, negative for an inverted one.

use crate::Point;
use crate::kernel::simplex::volume6;

/// The mean ratio 12·(3V)^(2/3) / Σl² with the sign of the volume (Liu, Joe 1994).
pub fn mean_ratio(a: &Point, b: &Point, c: &Point, d: &Point) -> f64 {
    let v6 = volume6(a, b, c, d);
    let squares = (b - a).norm_squared()
        + (c - a).norm_squared()
        + (d - a).norm_squared()
        + (c - b).norm_squared()
        + (d - b).norm_squared()
        + (d - c).norm_squared();
    if squares > 0.0 { 12.0 * (0.5 * v6.abs()).cbrt().powi(2).copysign(v6) / squares } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_regular_tet_has_mean_ratio_one() {
        let p = [[1., 1., 1.], [1., -1., -1.], [-1., 1., -1.], [-1., -1., 1.]].map(Point::from);
        let q = mean_ratio(&p[0], &p[1], &p[2], &p[3]);
        assert!((q.abs() - 1.0).abs() < 1e-14, "{q}");
        assert!((mean_ratio(&p[1], &p[0], &p[2], &p[3]) + q).abs() < 1e-14);
    }
}
