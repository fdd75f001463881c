//! The smallest size over many graded sources, found fast.

use crate::Point;
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
/// split until few matter, or until the field varies little over the cell; the value is then exact or
/// (second case) that at the cell's middle, off by at most half the cell's diagonal times the grading.
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
    /// Range in `listed`, and a bound that holds all over the cell.
    Leaf { begin: u32, end: u32, bound: f64 },
}

/// A leaf lists this many sources at most: a handful is quicker to try than one more level (with 4 the
/// tree has twice the cells, with 16 a query is slower by half).
const LEAF_SOURCES: usize = 8;

/// A cell whose edge is below this fraction of the size in it is not split: with gradings up to 1 its
/// middle's value is then right within some ten per cent.
const SMALLEST_CELL: f64 = 0.25;

impl SourceTree {
    /// Builds the tree over `bounds` (outside it, the value of the nearest point of the box is graded on).
    ///
    /// `grading` is the growth per unit of distance, `maximum` the size where no source asks for less.
    pub fn new(bounds: Aabb, grading: f64, maximum: f64, sources: &[Source]) -> Self {
        let side = (bounds.max - bounds.min).max().max(f64::MIN_POSITIVE);
        let center = bounds.center();
        let half = nalgebra::Vector3::repeat(0.5 * side);
        let cube = Aabb { min: center - half, max: center + half };
        let mut tree = Self {
            bounds: cube,
            grading,
            maximum,
            cells: vec![Cell::Leaf { begin: 0, end: 0, bound: maximum }],
            listed: Vec::new(),
        };
        let useful: Vec<Source> = sources.iter().copied().filter(|s| s.size < maximum).collect();
        tree.build(0, cube.min, side, useful);
        tree
    }

    fn build(&mut self, cell: usize, min: Point, edge: f64, sources: Vec<Source>) {
        let sources = self.relevant(min, edge, sources);
        let center = min + nalgebra::Vector3::repeat(0.5 * edge);
        let middle = sources.iter().map(|s| self.graded(s, &center)).fold(self.maximum, f64::min);
        if sources.len() <= LEAF_SOURCES {
            let begin = self.listed.len() as u32;
            self.listed.extend(&sources);
            let end = self.listed.len() as u32;
            self.cells[cell] = Cell::Leaf { begin, end, bound: self.maximum };
        } else if edge < SMALLEST_CELL * middle {
            let begin = self.listed.len() as u32;
            self.cells[cell] = Cell::Leaf { begin, end: begin, bound: middle };
        } else {
            let first = self.cells.len();
            self.cells.extend([Cell::Leaf { begin: 0, end: 0, bound: self.maximum }; 8]);
            self.cells[cell] = Cell::Split(first as u32);
            for child in 0..8 {
                let offset = nalgebra::Vector3::from_fn(|axis, _| {
                    if child >> axis & 1 == 1 { 0.5 * edge } else { 0.0 }
                });
                self.build(first + child, min + offset, 0.5 * edge, sources.clone());
            }
        }
    }

    /// Drops the sources that another one undercuts all over the cell.
    fn relevant(&self, min: Point, edge: f64, mut sources: Vec<Source>) -> Vec<Source> {
        let center = min + nalgebra::Vector3::repeat(0.5 * edge);
        let range = |s: &Source| {
            let d = (s.point - center).map(f64::abs);
            let near = d.map(|x| (x - 0.5 * edge).max(0.0)).norm();
            let far = d.map(|x| x + 0.5 * edge).norm();
            (s.size + self.grading * near, s.size + self.grading * far)
        };
        let best = sources.iter().map(|s| range(s).1).fold(self.maximum, f64::min);
        sources.retain(|s| range(s).0 < best);
        sources
    }

    fn graded(&self, source: &Source, point: &Point) -> f64 {
        source.size + self.grading * (point - source.point).norm()
    }

    /// The size at `point`.
    pub fn size_at(&self, point: &Point) -> f64 {
        let inside = Point::from(point.coords.sup(&self.bounds.min.coords).inf(&self.bounds.max.coords));
        let mut min = self.bounds.min;
        let mut edge = self.bounds.max.x - self.bounds.min.x;
        let mut cell = 0;
        loop {
            match self.cells[cell] {
                Cell::Split(first) => {
                    edge *= 0.5;
                    let mut child = 0;
                    for axis in 0..3 {
                        if inside[axis] >= min[axis] + edge {
                            min[axis] += edge;
                            child |= 1 << axis;
                        }
                    }
                    cell = first as usize + child;
                }
                Cell::Leaf { begin, end, bound } => {
                    let listed = &self.listed[begin as usize..end as usize];
                    let size = listed.iter().map(|s| self.graded(s, &inside)).fold(bound, f64::min);
                    return (size + self.grading * (point - inside).norm()).min(self.maximum);
                }
            }
        }
    }
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
            let exact = sources
                .iter()
                .map(|s| s.size + grading * (p - s.point).norm())
                .fold(maximum, f64::min);
            let got = tree.size_at(&p);
            assert!((got - exact).abs() <= 0.5 * 3f64.sqrt() * SMALLEST_CELL * grading * exact * 1.2, "{p}: {got}, {exact}");
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
        assert!(tree.cells.len() < 100_000, "{} cells", tree.cells.len());
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
