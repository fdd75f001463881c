//! Where a cut is wanted.

use super::overlap::overlaps;

/// What cuts a mesh, and a window around the wanted piece of the cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Region {
    /// What cuts the mesh.
    pub cutter: Cutter,
    /// The lowest corner of the window, which is parallel to the axes.
    pub low: [f64; 3],
    /// The highest corner of the window.
    pub high: [f64; 3],
}

/// What cuts a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cutter {
    /// A plane.
    Plane {
        /// The unit normal.
        normal: [f64; 3],
        /// The scalar product of the normal and any point of the plane.
        offset: f64,
    },
    /// The surface of a box that is parallel to the axes.
    Box {
        /// The lowest corner.
        low: [f64; 3],
        /// The highest corner.
        high: [f64; 3],
    },
}

impl Cutter {
    /// Whether a tet has points on both sides, or on it; points of the tet can be `slack` outside
    /// the straight one.
    fn meets(&self, tet: &[[f64; 3]; 4], slack: f64) -> bool {
        match *self {
            Self::Plane { normal, offset } => {
                let sides = tet.map(|p| (0..3).map(|k| normal[k] * p[k]).sum::<f64>() - offset);
                spans(sides, [0.0; 2], slack)
            }
            Self::Box { low, high } => {
                let holds =
                    |p: &[f64; 3], more: f64| (0..3).all(|k| low[k] - more < p[k] && p[k] < high[k] + more);
                // Most tets are decided by their bounding box or a corner, much faster.
                (0..3).all(|k| spans(tet.map(|p| p[k]), [low[k], high[k]], slack))
                    && !tet.iter().all(|p| holds(p, -slack))
                    && (tet.iter().any(|p| holds(p, slack))
                        || overlaps(tet, low.map(|x| x - slack), high.map(|x| x + slack)))
            }
        }
    }
}

impl Region {
    /// Whether a tet has points on both sides of the cutter, or on it, and its bounding box meets
    /// the window.
    pub fn meets(&self, tet: &[[f64; 3]; 4]) -> bool {
        self.may_meet(tet, 0.0)
    }

    /// The same for a tet whose points can be this far outside the straight one.
    pub fn may_meet(&self, tet: &[[f64; 3]; 4], slack: f64) -> bool {
        let in_window = |k| spans(tet.map(|point| point[k]), [self.low[k], self.high[k]], slack);
        (0..3).all(in_window) && self.cutter.meets(tet, slack)
    }

    /// The region with its window shrunk about the middle.
    pub fn shrunk(&self, factor: f64) -> Self {
        let [middle, half] = self.middle_and_half();
        let end = |sign: f64| [0, 1, 2].map(|k| middle[k] + sign * factor * half[k]);
        Self { low: end(-1.0), high: end(1.0), ..*self }
    }

    /// The least factor of [`shrunk`](Self::shrunk) with which the window meets the bounding box of
    /// a tet; infinite if none does.
    pub fn least_factor(&self, tet: &[[f64; 3]; 4]) -> f64 {
        let [middle, half] = self.middle_and_half();
        let factor = |k: usize| {
            let along = tet.map(|point| point[k] - middle[k]);
            let outside = along.iter().copied().fold(f64::INFINITY, f64::min);
            let outside = outside.max(along.iter().map(|x| -x).fold(f64::INFINITY, f64::min)).max(0.0);
            if outside > 0.0 { outside / half[k] } else { 0.0 }
        };
        (0..3).map(factor).fold(0.0, f64::max)
    }

    fn middle_and_half(&self) -> [[f64; 3]; 2] {
        [1.0, -1.0].map(|sign| [0, 1, 2].map(|k| 0.5 * (self.high[k] + sign * self.low[k])))
    }
}

/// Whether the range of some values meets another range, both widened by `slack` together.
fn spans(values: [f64; 4], [low, high]: [f64; 2], slack: f64) -> bool {
    values.iter().any(|x| *x >= low - slack) && values.iter().any(|x| *x <= high + slack)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TET: [[f64; 3]; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

    fn at(offset: f64) -> Region {
        let cutter = Cutter::Plane { normal: [0.0, 0.0, 1.0], offset };
        Region { cutter, low: [-9.0; 3], high: [9.0; 3] }
    }

    #[test]
    fn a_tet_meets_a_plane_that_separates_its_corners() {
        assert!(at(0.5).meets(&TET));
        assert!(at(1.0).meets(&TET), "the plane touches a corner");
        for offset in [1.1, -0.1] {
            assert!(!at(offset).meets(&TET) && at(offset).may_meet(&TET, 0.2));
        }
        assert!(!Region { low: [1.1, -9.0, -9.0], ..at(0.5) }.meets(&TET), "outside the window");
    }

    #[test]
    fn a_tet_meets_the_surface_of_a_box() {
        let of = |low: f64, high: f64| Region {
            cutter: Cutter::Box { low: [low; 3], high: [high; 3] },
            ..at(0.0)
        };
        assert!(of(0.1, 9.0).meets(&TET), "a corner of the box is in the tet");
        assert!(of(0.1, 0.2).meets(&TET), "the box is in the tet");
        assert!(of(0.0, 9.0).meets(&TET), "faces of both coincide");
        // The bounding boxes of these overlap.
        assert!(!of(0.4, 9.0).meets(&TET) && of(0.4, 9.0).may_meet(&TET, 0.1));
        assert!(!of(-1.0, 2.0).meets(&TET) && of(-1.0, 2.0).may_meet(&TET, 1.1), "the tet is in the box");
    }

    #[test]
    fn a_window_shrinks_to_its_middle() {
        let region = Region { low: [-3.0, -1.0, -1.0], high: [-1.0, 5.0, 1.0], ..at(0.5) };
        assert_eq!(region.least_factor(&TET), 2.0, "two away from the middle, and the half is one");
        assert_eq!(region.shrunk(0.5).low, [-2.5, 0.5, -0.5]);
        let wide = Region { low: [-3.0, -4.0, -9.0], high: [2.0, 16.0, 9.0], ..at(0.5) };
        let least = wide.least_factor(&TET);
        assert_eq!(least, 0.5);
        assert!(wide.shrunk(1.01 * least).meets(&TET) && !wide.shrunk(0.99 * least).meets(&TET));
        assert_eq!(Region { low: [2.0; 3], high: [2.0; 3], ..at(0.5) }.least_factor(&TET), f64::INFINITY);
    }
}
