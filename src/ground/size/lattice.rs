//! The field of graded sources in a cell: at its corners, and at the corners and centres of its
//! children, as well as its minimum over each child.
//!
//! These 43 values are computed together, because mostly the same few sources impose them: one
//! search serves them all, and the arithmetic is that of vectors of four numbers.

use super::Source;
use crate::Point;
use csg::Aabb;

/// Four numbers that are computed side by side.
type Lanes = [f32; 4];

/// One number for each of these, in this order:
///
/// - the 27 corners of the children, in 9 rows along x and by y first, with a copy at the end of
///   each row;
/// - the 8 centres of the children;
/// - the 8 children.
type Values = [Lanes; 13];

const CENTERS: usize = 9;
const CHILDREN: usize = 11;

/// Slack of values that are known before, for their rounding.
const SLACK: f32 = 1e-6;

/// The field in a cell, as far as sources were considered.
///
/// Lengths are in units of the cell's edge here, from its lower corner, so that single precision
/// is enough.
pub(super) struct Lattice {
    min: Point,
    edge: f64,
    per_edge: f64,
    grading: f32,
    /// The size without sources.
    maximum: f64,
    least: Values,
}

impl Lattice {
    /// The cell at `min` with a size of `maximum` everywhere.
    pub fn new(min: Point, edge: f64, grading: f64, maximum: f64) -> Self {
        let per_edge = 1.0 / edge;
        let least = [[(maximum * per_edge) as f32; 4]; 13];
        Self { min, edge, per_edge, grading: grading as f32, maximum, least }
    }

    /// Considers sizes that are known at the corners of the cell and in its centre.
    pub fn add_known(&mut self, corners: &[f64; 8], center: f64) {
        let known = |lattice: &mut Self, at: [f32; 3], size: f64| {
            let size = (size * lattice.per_edge) as f32;
            lattice.lower(at, size + SLACK * (size + lattice.grading));
        };
        for (c, corner) in corners.iter().enumerate() {
            known(self, [0, 1, 2].map(|axis| (c >> axis & 1) as f32), *corner);
        }
        known(self, [0.5; 3], center);
    }

    /// Considers a source.
    #[inline(always)]
    pub fn add(&mut self, source: &Source) {
        self.lower(self.local(&source.point), (source.size * self.per_edge) as f32);
    }

    #[inline(always)]
    fn lower(&mut self, point: [f32; 3], size: f32) {
        let squares = squared_distances(point, point);
        for (least, squares) in self.least.iter_mut().zip(&squares) {
            let mut here = [0.0; 4];
            for lane in 0..4 {
                here[lane] = size + self.grading * squares[lane].sqrt();
            }
            for lane in 0..4 {
                least[lane] = if here[lane] < least[lane] { here[lane] } else { least[lane] };
            }
        }
    }

    /// Whether sources of at least this size in a box could lower a value by more than `part` of
    /// it.
    #[inline(always)]
    pub fn may_be_lower(&self, bounds: &Aabb, size: f64, part: f64) -> bool {
        let size = (size * self.per_edge) as f32;
        let left = (1.0 - part) as f32;
        let square_grading = self.grading * self.grading;
        let squares = squared_distances(self.local(&bounds.min), self.local(&bounds.max));
        let mut most: Lanes = [0.0; 4];
        for (least, squares) in self.least.iter().zip(&squares) {
            let mut by = [0.0; 4];
            for lane in 0..4 {
                let room = left * least[lane] - size;
                by[lane] = if room > 0.0 { room } else { 0.0 };
            }
            for lane in 0..4 {
                by[lane] = by[lane] * by[lane] - square_grading * squares[lane];
                most[lane] = if by[lane] > most[lane] { by[lane] } else { most[lane] };
            }
        }
        most.iter().any(|&by| by > 0.0)
    }

    #[inline(always)]
    fn local(&self, point: &Point) -> [f32; 3] {
        let along = |axis: usize| ((point[axis] - self.min[axis]) * self.per_edge) as f32;
        [along(0), along(1), along(2)]
    }

    fn value(&self, at: usize, lane: usize) -> f64 {
        let least = self.least[at][lane];
        let is_maximum = least >= (self.maximum * self.per_edge) as f32;
        if is_maximum { self.maximum } else { self.edge * f64::from(least) }
    }

    /// The size at a corner of the children, by its place along the axes.
    pub fn at_corner(&self, [x, y, z]: [usize; 3]) -> f64 {
        self.value(y + 3 * z, x)
    }

    /// The size in the centre of a child.
    pub fn in_center(&self, child: usize) -> f64 {
        self.value(CENTERS + child / 4, child % 4)
    }

    /// The smallest size in a child.
    pub fn least_in(&self, child: usize) -> f64 {
        self.value(CHILDREN + child / 4, child % 4)
    }
}

/// The squared distances of a box from each of the [`Values`].
///
/// Loops instead of closures on arrays: the compiler makes vectors of them.
#[inline(always)]
fn squared_distances(low: [f32; 3], high: [f32; 3]) -> Values {
    let square = |axis: usize, from: f32, to: f32| {
        let (above, below) = (low[axis] - to, from - high[axis]);
        let gap = if above > below { above } else { below };
        let gap = if gap > 0.0 { gap } else { 0.0 };
        gap * gap
    };
    let corners = |axis: usize| [square(axis, 0.0, 0.0), square(axis, 0.5, 0.5), square(axis, 1.0, 1.0)];
    let centers = |axis: usize| [square(axis, 0.25, 0.25), square(axis, 0.75, 0.75)];
    let children = |axis: usize| [square(axis, 0.0, 0.5), square(axis, 0.5, 1.0)];
    let mut values = [[0.0; 4]; 13];
    let ([x, middle, end], y, z) = (corners(0), corners(1), corners(2));
    for row in 0..9 {
        let other = y[row % 3] + z[row / 3];
        values[row] = [x + other, middle + other, end + other, end + other];
    }
    let of_centers = [centers(0), centers(1), centers(2)];
    let of_children = [children(0), children(1), children(2)];
    for ([x, y, z], at) in [(of_centers, CENTERS), (of_children, CHILDREN)] {
        let plane = [x[0] + y[0], x[1] + y[0], x[0] + y[1], x[1] + y[1]];
        for side in 0..2 {
            for lane in 0..4 {
                values[at + side][lane] = plane[lane] + z[side];
            }
        }
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_those_of_the_nearest_sources() {
        let (grading, maximum) = (0.3, 1.5);
        let sources = [
            Source { point: Point::new(1.2, 2.1, 3.4), size: 0.1 },
            Source { point: Point::new(2.6, 1.5, 3.0), size: 0.2 },
            Source { point: Point::new(9.0, 2.0, 3.0), size: 0.01 },
        ];
        let (min, edge) = (Point::new(1.0, 2.0, 3.0), 2.0);
        let mut lattice = Lattice::new(min, edge, grading, maximum);
        sources.iter().for_each(|source| lattice.add(source));
        let field = |distance: &dyn Fn(&Point) -> f64| {
            sources.iter().map(|s| s.size + grading * distance(&s.point)).fold(maximum, f64::min)
        };
        let agree = |got: f64, wanted: f64| assert!((got / wanted - 1.0).abs() < 1e-6, "{got} for {wanted}");
        for i in 0..27 {
            let at = [i % 3, i / 3 % 3, i / 9];
            let point = min + 0.5 * edge * crate::Vector::from(at.map(|step| step as f64));
            agree(lattice.at_corner(at), field(&|source| (source - point).norm()));
        }
        for child in 0..8 {
            let low = min + crate::Vector::from([0, 1, 2].map(|axis| (child >> axis & 1) as f64));
            let center = low + crate::Vector::repeat(0.5);
            agree(lattice.in_center(child), field(&|source| (source - center).norm()));
            let gap = |source: &Point| (source - center).map(|d| (d.abs() - 0.5).max(0.0)).norm();
            agree(lattice.least_in(child), field(&gap));
        }
    }

    #[test]
    fn boxes_that_lower_nothing_are_known() {
        let (grading, maximum) = (0.5, 1.0);
        let mut lattice = Lattice::new(Point::origin(), 1.0, grading, maximum);
        let far = |x: f64| Aabb { min: Point::new(x, 0.0, 0.0), max: Point::new(x + 1.0, 1.0, 1.0) };
        assert!(lattice.may_be_lower(&far(2.5), 0.2, 0.0));
        assert!(!lattice.may_be_lower(&far(2.7), 0.2, 0.0));
        assert!(!lattice.may_be_lower(&far(2.5), 0.2, 0.1));
        lattice.add_known(&[0.4; 8], 0.5);
        // The largest value is 0.75 then, in the middle of the cell's faces.
        assert!(lattice.may_be_lower(&far(2.0), 0.2, 0.0));
        assert!(!lattice.may_be_lower(&far(2.2), 0.2, 0.0));
    }
}
