//! What becomes of the corners of a tet when it is refined and snapped for ever.

use crate::improve::objective::score_of_ratio;
use crate::kernel::simplex::volume6;
use crate::{Point, Vector};

/// The directions in which the edges of a tet finally leave its corner k, to the vertices k+1, k+2, k+3 (mod 4), each as
/// long as its edge; `None` for as they do now.
#[derive(Clone, Debug)]
pub(super) struct TetLimits([[Option<Vector>; 3]; 4]);

/// What must be left of a corner for it to count as unharmed.
const UNHARMED: f64 = 0.5;

/// How much less a tet is worth as its worst corner shrinks below [`UNHARMED`]: at zero two fifths of its mean ratio are left.
///
/// By trial on NETGEN's tutorials at their coarsest, refined twice and snapped: with 8 the worst fine tets of `trafo`,
/// `shaft` and `sculpture` have mean ratios of 0.24, 0.22 and 0.26, as tets are flattened elsewhere to please
/// a corner; with 3 they have 0.28, 0.35 and 0.40. Mild limits (0.15 above, 8 here) leave 0.04 in `cubeandspheres`,
/// where these leave 0.24.
const HARM: f64 = 3.0;

impl TetLimits {
    /// The limits, `None` if no edge bends.
    pub fn new(directions: [[Option<Vector>; 3]; 4]) -> Option<Self> {
        directions.iter().flatten().any(Option::is_some).then_some(Self(directions))
    }

    /// The least part of a corner that is left in the limit, where a corner is measured by the volume that
    /// unit vectors along its edges span: 1 if nothing bends, 0 or less if a corner flattens or turns over.
    pub fn least_corner(&self, p: &[Point; 4]) -> f64 {
        let v6 = volume6(&p[0], &p[1], &p[2], &p[3]);
        let mut least = 1.0_f64;
        for (k, corner) in self.0.iter().enumerate() {
            if corner.iter().any(Option::is_some) {
                let then = [0, 1, 2].map(|m| corner[m].unwrap_or_else(|| p[(k + 1 + m) % 4] - p[k]));
                let span = then[0].cross(&then[1]).dot(&then[2]);
                // Every second turn of the vertices is an odd permutation.
                least = least.min(if k % 2 == 0 { span / v6 } else { -span / v6 });
            }
        }
        least
    }

    /// What the score of the tet is to be multiplied with: 1 if no corner suffers much, never 0.
    pub fn factor(&self, p: &[Point; 4]) -> f64 {
        score_of_ratio(1.0 / (1.0 + HARM * (UNHARMED - self.least_corner(p)).max(0.0)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corner_of_cube() -> [Point; 4] {
        [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]].map(Point::from)
    }

    #[test]
    fn limits_as_the_edges_are_now_leave_every_corner_whole() {
        let p = corner_of_cube();
        let edge = |k: usize, m: usize| Some(p[(k + 1 + m) % 4] - p[k]);
        let all = [0, 1, 2, 3].map(|k| [0, 1, 2].map(|m| edge(k, m)));
        let limits = TetLimits::new(all).expect("edges");
        assert!((limits.least_corner(&p) - 1.0).abs() < 1e-15);
        assert_eq!(limits.factor(&p), 1.0);
        assert!(TetLimits::new([[None; 3]; 4]).is_none());
    }

    #[test]
    fn an_edge_that_bends_into_the_opposite_face_flattens_its_corner() {
        let p = corner_of_cube();
        let bent = |z: f64| {
            let mut directions = [[None; 3]; 4];
            // At the first vertex the third edge goes from upright down to the plane of the others.
            directions[0][2] = Some(Vector::new((1.0 - z * z).sqrt(), 0.0, z));
            TetLimits::new(directions).expect("an edge")
        };
        for z in [1.0, 0.7, 0.2, 0.0, -0.3] {
            assert!((bent(z).least_corner(&p) - z).abs() < 1e-15);
        }
        assert_eq!(bent(0.7).factor(&p), 1.0);
        assert!(bent(0.2).factor(&p) > bent(0.0).factor(&p));
        assert_eq!(bent(0.0).factor(&p), score_of_ratio(0.4));
        assert!(bent(-0.3).factor(&p) > 0.0);
    }
}
