//! Corners of tets in the limit of repeated refinement and projection.

use crate::ground::kernel::simplex::volume6;
use crate::mesher::improve::objective::score_of_ratio;
use crate::{Point, Vector};

/// The limit directions of a tet's edges at corner k, to the vertices k+1, k+2, k+3 (mod 4), each
/// with the length of its edge; `None` for edges that keep their direction.
#[derive(Clone, Debug)]
pub(super) struct TetLimits {
    directions: [[Option<Vector>; 3]; 4],
    /// Strength of the penalty; see [`HARM`].
    harm: f64,
}

/// The remaining part of a corner above which there is no penalty.
const UNHARMED: f64 = 0.5;

/// Strength of the penalty for corners that shrink below [`UNHARMED`]: at zero, two fifths of the
/// mean ratio remain.
///
/// Chosen with NETGEN's tutorials at their coarsest size, refined twice: 3 gives worst mean ratios
/// of 0.28, 0.35 and 0.40 in `trafo`, `shaft` and `sculpture`; 8 gives 0.24, 0.22 and 0.26, because
/// other tets are flattened for the sake of a corner.
pub(super) const HARM: f64 = 3.0;

impl TetLimits {
    /// The limits; `None` if no edge changes direction.
    pub fn new(directions: [[Option<Vector>; 3]; 4], harm: f64) -> Option<Self> {
        directions.iter().flatten().any(Option::is_some).then_some(Self { directions, harm })
    }

    /// The least part of a corner that remains in the limit.
    ///
    /// A corner is measured by the volume that unit vectors along its edges span: the part is 1 if
    /// nothing changes, 0 or less if the corner flattens or is inverted.
    pub fn least_corner(&self, p: &[Point; 4]) -> f64 {
        let v6 = volume6(&p[0], &p[1], &p[2], &p[3]);
        let mut least = 1.0_f64;
        for (k, corner) in self.directions.iter().enumerate() {
            if corner.iter().any(Option::is_some) {
                let then = [0, 1, 2].map(|m| corner[m].unwrap_or_else(|| p[(k + 1 + m) % 4] - p[k]));
                let span = then[0].cross(&then[1]).dot(&then[2]);
                // Cyclic shifts of four vertices are alternately even and odd.
                least = least.min(if k % 2 == 0 { span / v6 } else { -span / v6 });
            }
        }
        least
    }

    /// The factor for the score of the tet: 1 if no corner shrinks much, never 0.
    pub fn factor(&self, p: &[Point; 4]) -> f64 {
        score_of_ratio(1.0 / (1.0 + self.harm * (UNHARMED - self.least_corner(p)).max(0.0)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corner_of_cube() -> [Point; 4] {
        [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]].map(Point::from)
    }

    #[test]
    fn limits_equal_to_the_present_edges_give_no_penalty() {
        let p = corner_of_cube();
        let edge = |k: usize, m: usize| Some(p[(k + 1 + m) % 4] - p[k]);
        let all = [0, 1, 2, 3].map(|k| [0, 1, 2].map(|m| edge(k, m)));
        let limits = TetLimits::new(all, HARM).expect("edges");
        assert!((limits.least_corner(&p) - 1.0).abs() < 1e-15);
        assert_eq!(limits.factor(&p), 1.0);
        assert!(TetLimits::new([[None; 3]; 4], HARM).is_none());
    }

    #[test]
    fn an_edge_that_bends_into_the_opposite_face_flattens_its_corner() {
        let p = corner_of_cube();
        let bent = |z: f64| {
            let mut directions = [[None; 3]; 4];
            // The third edge at the first vertex is inclined towards the plane of the others.
            directions[0][2] = Some(Vector::new((1.0 - z * z).sqrt(), 0.0, z));
            TetLimits::new(directions, HARM).expect("an edge")
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
