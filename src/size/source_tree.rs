//! The smallest size over many graded sources, found fast.

use crate::{Point, Vector};
use csg::Aabb;

/// A place that asks for a size: at distance d from it the size is at most `size + grading·d`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Source {
    /// Where.
    pub point: Point,
    /// The size wanted there, positive.
    pub size: f64,
}

/// An octree whose leaves know the few sources that can matter in them.
///
/// A source matters in a cell if at some point of it, it may be the one that asks for least. Cells are
/// split until few matter, or until they are small against the size in them; the value is then exact or
/// (second case) interpolated between those at the corners of the cell.
#[derive(Clone, Debug)]
pub struct SourceTree {
    bounds: Aabb,
    grading: f64,
    maximum: f64,
    cells: Vec<Cell>,
    listed: Vec<Source>,
}

#[derive(Clone, Copy, Debug)]
enum Cell {
    /// Index of the first of eight children.
    Split(u32),
    /// Range in `listed`.
    Listed(u32, u32),
    /// The values at the corners: bit 0 of the index is x, bit 1 y, bit 2 z.
    Interpolated([f32; 8]),
}

/// A leaf lists this many sources at most: a handful is quicker to try than one more level.
const LEAF_SOURCES: usize = 8;

/// A cell whose edge is below this fraction of the size in its middle interpolates. With gradings up to 1
/// the field bends within such a cell by some ten per cent at most; at half of it, sources all over a
/// sphere, a size apart, make eight times the cells.
const SMALLEST_CELL: f64 = 0.7;

impl SourceTree {
    /// Builds the tree over `bounds` (outside it, the value of the nearest point of the box is graded on).
    ///
    /// `grading` is the growth per unit of distance, `maximum` the size where no source asks for less.
    pub fn new(bounds: Aabb, grading: f64, maximum: f64, sources: &[Source]) -> Self {
        let side = (bounds.max - bounds.min).max().max(f64::MIN_POSITIVE);
        let center = bounds.center();
        let half = Vector::repeat(0.5 * side);
        let cube = Aabb { min: center - half, max: center + half };
        let mut tree =
            Self { bounds: cube, grading, maximum, cells: vec![Cell::Listed(0, 0)], listed: Vec::new() };
        let useful: Vec<Source> = sources.iter().copied().filter(|s| s.size < maximum).collect();
        tree.build(0, cube.min, side, &useful);
        tree
    }

    fn build(&mut self, cell: usize, min: Point, edge: f64, around: &[Source]) {
        let sources = self.relevant(min, edge, around);
        let center = min + Vector::repeat(0.5 * edge);
        let middle = self.least(&sources, &center);
        if sources.len() <= LEAF_SOURCES {
            let begin = self.listed.len() as u32;
            self.listed.extend(&sources);
            self.cells[cell] = Cell::Listed(begin, self.listed.len() as u32);
        } else if edge < SMALLEST_CELL * middle {
            let corners =
                [0, 1, 2, 3, 4, 5, 6, 7].map(|c| self.least(&sources, &(min + octant(c, edge))) as f32);
            self.cells[cell] = Cell::Interpolated(corners);
        } else {
            let first = self.cells.len();
            self.cells.extend([Cell::Listed(0, 0); 8]);
            self.cells[cell] = Cell::Split(first as u32);
            for child in 0..8 {
                self.build(first + child, min + octant(child, 0.5 * edge), 0.5 * edge, &sources);
            }
        }
    }

    /// The sources that no other one undercuts all over the cell.
    ///
    /// Most are dropped at first sight, by the least upper bound so far and without a square root.
    fn relevant(&self, min: Point, edge: f64, sources: &[Source]) -> Vec<Source> {
        let half = 0.5 * edge;
        let center = min + Vector::repeat(half);
        let mut best = self.maximum;
        let matters = |s: &Source, best: f64| {
            let reach = (best - s.size) / self.grading;
            let near = (s.point - center).map(|x| (x.abs() - half).max(0.0)).norm_squared();
            reach > 0.0 && near < reach * reach
        };
        let mut kept = Vec::with_capacity(sources.len());
        for s in sources {
            if matters(s, best) {
                let far = (s.point - center).map(|x| x.abs() + half).norm();
                best = best.min(s.size + self.grading * far);
                kept.push(*s);
            }
        }
        kept.retain(|s| matters(s, best));
        kept
    }

    /// The exact field of some sources.
    fn least(&self, sources: &[Source], point: &Point) -> f64 {
        let graded = |s: &Source| s.size + self.grading * (point - s.point).norm();
        sources.iter().map(graded).fold(self.maximum, f64::min)
    }

    /// The size at `point`.
    pub fn size_at(&self, point: &Point) -> f64 {
        let inside = Point::from(point.coords.sup(&self.bounds.min.coords).inf(&self.bounds.max.coords));
        let mut min = self.bounds.min;
        let mut edge = self.bounds.max.x - self.bounds.min.x;
        let mut cell = 0;
        while let Cell::Split(first) = self.cells[cell] {
            edge *= 0.5;
            let child =
                (0..3).filter(|&axis| inside[axis] >= min[axis] + edge).fold(0, |c, axis| c | 1 << axis);
            min += octant(child, edge);
            cell = first as usize + child;
        }
        let size = match &self.cells[cell] {
            Cell::Listed(begin, end) => self.least(&self.listed[*begin as usize..*end as usize], &inside),
            Cell::Interpolated(corners) => interpolate(corners, (inside - min) / edge),
            Cell::Split(_) => unreachable!("descended to a leaf"),
        };
        (size + self.grading * (point - inside).norm()).min(self.maximum)
    }
}

/// Of sources in one cell of a grid that is as wide as they are large, or half so, the smallest: facets may be far smaller than
/// the sizes that they ask for, and both sides of a wall ask for the same.
pub(crate) fn thinned(sources: Vec<Source>) -> Vec<Source> {
    let keyed = |s: Source| {
        let level = s.size.log2().floor();
        let width = level.exp2();
        let cell = [s.point.x, s.point.y, s.point.z].map(|x| (x / width).floor() as i64);
        (level as i32, cell, s)
    };
    let mut keyed: Vec<_> = sources.into_iter().map(keyed).collect();
    keyed.sort_by(|a, b| (a.0, a.1).cmp(&(b.0, b.1)).then(a.2.size.total_cmp(&b.2.size)));
    keyed.dedup_by_key(|(level, cell, _)| (*level, *cell));
    keyed.into_iter().map(|(_, _, source)| source).collect()
}

/// The lower corner of an octant: bit 0 of `index` is x, bit 1 y, bit 2 z.
fn octant(index: usize, edge: f64) -> Vector {
    Vector::from_fn(|axis, _| if index >> axis & 1 == 1 { edge } else { 0.0 })
}

/// Trilinear interpolation at `at` in the unit cube.
fn interpolate(corners: &[f32; 8], at: Vector) -> f64 {
    let weight = |corner: usize| -> f64 {
        (0..3).map(|axis| if corner >> axis & 1 == 1 { at[axis] } else { 1.0 - at[axis] }).product()
    };
    (0..8).map(|c| weight(c) * f64::from(corners[c])).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points of a low-discrepancy sequence in the unit cube.
    fn scattered(count: usize) -> impl Iterator<Item = Point> {
        (1..=count).map(|i| {
            let at = |step: f64| (i as f64 * step).fract();
            Point::new(at(0.819_172_513_396_164_4), at(0.671_043_606_703_789_2), at(0.549_700_477_901_970_2))
        })
    }

    #[test]
    fn the_tree_agrees_with_trying_all_sources() {
        let sources: Vec<Source> = scattered(500)
            .enumerate()
            .map(|(i, point)| Source { point, size: 0.01 + 0.2 * (i % 7) as f64 })
            .collect();
        let bounds = Aabb { min: Point::new(0., 0., 0.), max: Point::new(1., 1., 1.) };
        let (grading, maximum) = (0.3, 0.5);
        let tree = SourceTree::new(bounds, grading, maximum, &sources);
        for p in scattered(3000) {
            let exact =
                sources.iter().map(|s| s.size + grading * (p - s.point).norm()).fold(maximum, f64::min);
            let got = tree.size_at(&p);
            assert!((got - exact).abs() <= 0.1 * exact, "{p}: {got}, {exact}");
        }
    }

    #[test]
    fn sources_on_a_sphere_do_not_blow_up_in_its_centre() {
        let center = Point::new(0.5, 0.5, 0.5);
        let sources: Vec<Source> = scattered(4000)
            .map(|p| Source { point: center + 0.4 * (p - center).normalize(), size: 0.02 })
            .collect();
        let bounds = Aabb { min: Point::new(0., 0., 0.), max: Point::new(1., 1., 1.) };
        let tree = SourceTree::new(bounds, 0.3, 10.0, &sources);
        assert!(tree.cells.len() < 50 * sources.len(), "{} cells", tree.cells.len());
        assert!((tree.size_at(&center) - 0.14).abs() < 0.01);
        assert!(tree.size_at(&Point::new(2.0, 0.5, 0.5)) > 0.02 + 0.3 * 1.09);
    }

    #[test]
    fn without_sources_the_size_is_the_maximum() {
        let p = Point::new(1., 2., 3.);
        let tree = SourceTree::new(Aabb { min: p, max: p }, 0.3, 2.5, &[]);
        assert_eq!(tree.size_at(&p), 2.5);
    }
}
