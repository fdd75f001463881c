//! Where a cut is wanted.

/// A plane, and a box around the wanted piece of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Region {
    /// The unit normal of the plane.
    pub normal: [f64; 3],
    /// The offset of the plane: the scalar product of the normal and any of its points.
    pub offset: f64,
    /// The lowest corner of the box.
    pub low: [f64; 3],
    /// The highest corner of the box.
    pub high: [f64; 3],
}

impl Region {
    /// Whether a tet has points on both sides of the plane, or on it, and its bounding box meets
    /// the box.
    pub fn meets(&self, tet: &[[f64; 3]; 4]) -> bool {
        self.may_meet(tet, 0.0)
    }

    /// The same for a tet whose points can be this far outside the straight one.
    pub fn may_meet(&self, tet: &[[f64; 3]; 4], slack: f64) -> bool {
        let sides = tet.map(|p| (0..3).map(|k| self.normal[k] * p[k]).sum::<f64>() - self.offset);
        let spans = |values: [f64; 4], [low, high]: [f64; 2]| {
            values.iter().any(|x| *x >= low - slack) && values.iter().any(|x| *x <= high + slack)
        };
        spans(sides, [0.0; 2])
            && (0..3).all(|k| spans(tet.map(|point| point[k]), [self.low[k], self.high[k]]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tet_meets_a_plane_that_separates_its_corners() {
        let all = Region { normal: [0.0, 0.0, 1.0], offset: 0.5, low: [-9.0; 3], high: [9.0; 3] };
        let tet = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        assert!(all.meets(&tet));
        assert!(Region { offset: 1.0, ..all }.meets(&tet), "the plane touches a corner");
        for offset in [1.1, -0.1] {
            let region = Region { offset, ..all };
            assert!(!region.meets(&tet) && region.may_meet(&tet, 0.2));
        }
        assert!(!Region { low: [1.1, -9.0, -9.0], ..all }.meets(&tet), "outside the box");
    }
}
