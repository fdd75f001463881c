//! An octree that stores the smallest size over many graded sources.

use super::lattice::Lattice;
use super::sources::{Sources, Start};
use super::{LEAST_SIZE, Source};
use crate::{Point, Vector};
use csg::Aabb;
use rayon::prelude::*;

/// An octree that interpolates the field of graded sources between the corners of its cells.
///
/// Cells are split until they are small relative to the smallest size in them, or until the field
/// is nearly linear in them, as it is far from the sources.
#[derive(Clone, Debug)]
pub struct SourceTree {
    bounds: Aabb,
    grading: f64,
    maximum: f64,
    root: Cell,
    cells: Cells,
}

/// Cells without their places. The way down to a leaf is in few bytes, which stay in the cache, and
/// ends with one read of its values.
#[derive(Clone, Debug, Default)]
struct Cells {
    /// The children of each split cell.
    split: Vec<[Cell; 8]>,
    leaves: Vec<Leaf>,
}

/// A split cell, or a leaf if its highest bit is set; the other bits are its index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Cell(u32);

const IS_LEAF: u32 = 1 << 31;

/// The values at the corners: bit 0 of the index is x, bit 1 y, bit 2 z.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
struct Leaf([f32; 8]);

/// Places in the tree are multiples of 2⁻⁶³ of its edge: one bit for each level.
const PLACE_BITS: u32 = 63;

impl Cell {
    /// Stands for a cell that is not finished.
    const OPEN: Self = Self(IS_LEAF - 1);

    fn split(index: usize) -> Self {
        assert!(index < IS_LEAF as usize, "a tree of sizes has too many cells");
        Self(index as u32)
    }

    fn leaf(index: usize) -> Self {
        assert!(index < IS_LEAF as usize, "a tree of sizes has too many leaves");
        Self(index as u32 | IS_LEAF)
    }

    fn is_leaf(self) -> bool {
        self.0 & IS_LEAF != 0
    }

    fn index(self) -> usize {
        (self.0 & !IS_LEAF) as usize
    }
}

impl Cells {
    /// Adds the cells of another tree, with their root `root`, which is returned as a cell of this
    /// one.
    fn append(&mut self, root: Cell, other: Cells) -> Cell {
        let (split, leaves) = (self.split.len(), self.leaves.len());
        let moved = |cell: Cell| {
            if cell.is_leaf() { Cell::leaf(leaves + cell.index()) } else { Cell::split(split + cell.index()) }
        };
        self.split.extend(other.split.into_iter().map(|children| children.map(moved)));
        self.leaves.extend(other.leaves);
        moved(root)
    }
}

/// A cell whose edge is below this multiple of the smallest size in it is not split.
///
/// A source in its centre is half a diagonal away from the corners, so the relative error there is
/// at most `√3/2·grading` times this multiple.
const SMALL: f64 = 0.7;

/// A cell whose edge is above this multiple of the smallest size in it is split.
///
/// So the field in a cell differs from its values at centre and corners by less than `√3·grading`
/// of the smallest size.
const LARGE: f64 = 1.0;

/// The factor of [`LARGE`] if the smallest size is nearly attained at the centre or a corner.
const SHOWN: f64 = 2.0;

/// Above this grading the multiples are lowered to keep the error: without this, sizes on a ball
/// are 40 % too large at a grading of 0.7.
const STEEP: f64 = 0.45;

/// The relative tolerance of interpolation.
///
/// Between the two multiples, a cell is split if the error at its centre is larger. The smallest
/// size counts as attained if it is lower than the known values by no more than this.
const BENT: f64 = 0.04;

/// The 64 subtrees below this depth are built in parallel.
const PARALLEL_DEPTH: u32 = 2;

/// When a cell is split: [`SMALL`], [`LARGE`] and [`BENT`] at a grading and a roughness.
struct Limits {
    small: f64,
    large: f64,
    bent: f64,
    /// The edge of cells at which places have no bits left.
    least_edge: f64,
}

impl Limits {
    fn new(grading: f64, roughness: f64, side: f64) -> Self {
        let part = (STEEP / grading).min(1.0) * roughness;
        let least_edge = side * 0.5_f64.powi(PLACE_BITS as i32 - 2);
        Self { small: SMALL * part, large: LARGE * part, bent: BENT * roughness, least_edge }
    }

    /// Whether interpolation in a cell is accurate enough.
    fn allow(&self, draft: &Draft, maximum: f64) -> bool {
        let Draft { edge, corners, center, least, .. } = *draft;
        let least_known = corners.iter().copied().fold(center, f64::min);
        let large = if least > (1.0 - self.bent) * least_known { SHOWN * self.large } else { self.large };
        let mean = corners.iter().sum::<f64>() / 8.0;
        let is_flat = edge < large * least && (mean - center).abs() < self.bent * center;
        least >= maximum || edge < (self.small * least).max(self.least_edge) || is_flat
    }
}

/// A cell during construction.
#[derive(Clone, Copy)]
struct Draft {
    min: Point,
    edge: f64,
    corners: [f64; 8],
    center: f64,
    /// The smallest size in the cell.
    least: f64,
    /// The start of searches in the cell.
    start: Start,
}

impl SourceTree {
    /// Builds the tree over `bounds`.
    ///
    /// Outside, the size grows from the nearest point of the box. `grading` is the growth per unit
    /// of distance, `maximum` the size if no source imposes a smaller one.
    pub fn new(bounds: Aabb, grading: f64, maximum: f64, sources: &[Source]) -> Self {
        Self::with_roughness(bounds, grading, maximum, sources, 1.0)
    }

    /// [`new`](Self::new) with an error larger by a factor.
    pub(super) fn with_roughness(
        bounds: Aabb,
        grading: f64,
        maximum: f64,
        sources: &[Source],
        roughness: f64,
    ) -> Self {
        let side = (bounds.max - bounds.min).max().max(f64::MIN_POSITIVE);
        let limits = Limits::new(grading, roughness, side);
        let center = bounds.center();
        let half = Vector::repeat(0.5 * side);
        let cube = Aabb { min: center - half, max: center + half };
        // Smaller ones could be 0 in the leaves, and cells would be split without end.
        let least = LEAST_SIZE * side;
        let sources: Vec<Source> =
            sources.iter().map(|source| Source { size: source.size.max(least), ..*source }).collect();
        let sources = Sources::new(grading, maximum, &sources);
        // The first child of a cell in which nothing is known.
        let around = Draft {
            min: cube.min,
            edge: 2.0 * side,
            corners: [maximum; 8],
            center: maximum,
            least: 0.0,
            start: sources.whole(),
        };
        let [root, ..] = children(&sources, &around);
        let (root, cells) = grow(&sources, &limits, &root, PARALLEL_DEPTH);
        Self { bounds: cube, grading, maximum, root, cells }
    }

    /// The size at `point`.
    pub fn size_at(&self, point: &Point) -> f64 {
        let Aabb { min, max } = self.bounds;
        let inside = Point::from(point.coords.sup(&min.coords).inf(&max.coords));
        let most = (1_u64 << PLACE_BITS) - 1;
        let per_step = (1_u64 << PLACE_BITS) as f64 / (max.x - min.x);
        let place = [0, 1, 2].map(|axis| (((inside[axis] - min[axis]) * per_step) as u64).min(most));
        let (mut cell, mut level) = (self.root, PLACE_BITS);
        while !cell.is_leaf() {
            level -= 1;
            let side = |axis: usize| (place[axis] >> level & 1) << axis;
            cell = self.cells.split[cell.index()][(side(0) | side(1) | side(2)) as usize];
        }
        let edge = 1_u64 << level;
        let at = Vector::from(place.map(|x| (x & (edge - 1)) as i64 as f64 / edge as f64));
        let size = interpolate(&self.cells.leaves[cell.index()].0, at);
        (size + self.grading * (point - inside).norm()).min(self.maximum)
    }
}

/// The cells of the subtree below a draft, and its root; the subtrees `parallel` levels below are
/// built by all threads.
fn grow(sources: &Sources, limits: &Limits, draft: &Draft, parallel: u32) -> (Cell, Cells) {
    let mut cells = Cells::default();
    if parallel == 0 || limits.allow(draft, sources.maximum()) {
        let root = grow_alone(sources, limits, draft, &mut cells);
        return (root, cells);
    }
    let below = |child: &Draft| grow(sources, limits, child, parallel - 1);
    let parts: Vec<(Cell, Cells)> = children(sources, draft).par_iter().map(below).collect();
    cells.split.push([Cell::OPEN; 8]);
    for (i, (root, part)) in parts.into_iter().enumerate() {
        cells.split[0][i] = cells.append(root, part);
    }
    (Cell::split(0), cells)
}

/// Adds the subtree below a draft to `cells`; returns its root.
fn grow_alone(sources: &Sources, limits: &Limits, draft: &Draft, cells: &mut Cells) -> Cell {
    if limits.allow(draft, sources.maximum()) {
        cells.leaves.push(Leaf(draft.corners.map(|value| value as f32)));
        return Cell::leaf(cells.leaves.len() - 1);
    }
    let index = cells.split.len();
    cells.split.push([Cell::OPEN; 8]);
    for (i, child) in children(sources, draft).iter().enumerate() {
        cells.split[index][i] = grow_alone(sources, limits, child, cells);
    }
    Cell::split(index)
}

/// The eight children of a cell.
fn children(sources: &Sources, draft: &Draft) -> [Draft; 8] {
    let Draft { min, edge, corners, center: size, start, .. } = *draft;
    let (center, far) = (min + Vector::repeat(0.5 * edge), min + Vector::repeat(edge));
    // Each point of the cell is within half a diagonal of the centre, and a diagonal of a corner.
    let half = 0.5 * 3.0_f64.sqrt() * edge * sources.grading();
    let most = corners.iter().fold(size + half, |most, corner| most.min(corner + 2.0 * half));
    let start = sources.start_in(&min, &far, most, &start);
    let mut lattice = Lattice::new(min, edge, sources.grading(), sources.maximum());
    lattice.add_known(&corners, size);
    sources.consider(&start, &center, &mut lattice);
    let child = |i: usize| {
        let corner = |c: usize| lattice.at_corner([0, 1, 2].map(|axis| (i >> axis & 1) + (c >> axis & 1)));
        Draft {
            min: min + octant(i, 0.5 * edge),
            edge: 0.5 * edge,
            corners: [0, 1, 2, 3, 4, 5, 6, 7].map(corner),
            center: lattice.in_center(i),
            least: lattice.least_in(i),
            start,
        }
    };
    [0, 1, 2, 3, 4, 5, 6, 7].map(child)
}

/// The lower corner of an octant: bit 0 of `index` is x, bit 1 y, bit 2 z.
fn octant(index: usize, edge: f64) -> Vector {
    Vector::from_fn(|axis, _| if index >> axis & 1 == 1 { edge } else { 0.0 })
}

/// Trilinear interpolation at `at` in the unit cube.
fn interpolate(corners: &[f32; 8], at: Vector) -> f64 {
    let c = corners.map(f64::from);
    let along = |a: f64, b: f64, t: f64| a + (b - a) * t;
    let x = |i: usize| along(c[i], c[i + 1], at.x);
    along(along(x(0), x(2), at.y), along(x(4), x(6), at.y), at.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    impl SourceTree {
        fn leaves(&self) -> usize {
            self.cells.leaves.len()
        }
    }

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
        // A source may be half a diagonal away from all corners of its cell.
        let most = 0.5 * 3.0_f64.sqrt() * SMALL * grading + BENT;
        let errors = |size_at: &dyn Fn(&Point) -> f64| -> (f64, f64) {
            let error = |p: Point| {
                let exact =
                    sources.iter().map(|s| s.size + grading * (p - s.point).norm()).fold(maximum, f64::min);
                (size_at(&p) - exact).abs() / exact
            };
            let all: Vec<f64> = scattered(3000).map(error).collect();
            (all.iter().copied().fold(0.0, f64::max), all.iter().sum::<f64>() / 3000.0)
        };
        let tree = SourceTree::new(bounds, grading, maximum, &sources);
        let (worst, mean) = errors(&|p| tree.size_at(p));
        assert!(worst <= most && mean < 0.02, "{worst}, {mean}");
        let rough = SourceTree::with_roughness(bounds, grading, maximum, &sources, 2.0);
        let (worst, mean) = errors(&|p| rough.size_at(p));
        assert!(worst <= 2.0 * most && mean < 0.04, "{worst}, {mean}");
        assert!(2 * rough.leaves() < tree.leaves(), "{} leaves", rough.leaves());
        let searched = Sources::new(grading, maximum, &sources);
        let (worst, mean) = errors(&|p| searched.size_at(p));
        assert!(worst <= 0.0102 && mean < 0.005, "{worst}, {mean}");
    }

    #[test]
    fn sources_on_a_sphere_do_not_blow_up_in_its_centre() {
        let center = Point::new(0.5, 0.5, 0.5);
        let sources: Vec<Source> = scattered(4000)
            .map(|p| Source { point: center + 0.4 * (p - center).normalize(), size: 0.02 })
            .collect();
        let bounds = Aabb { min: Point::new(0., 0., 0.), max: Point::new(1., 1., 1.) };
        let tree = SourceTree::new(bounds, 0.3, 10.0, &sources);
        assert!(tree.leaves() < 50 * sources.len(), "{} leaves", tree.leaves());
        assert!((tree.size_at(&center) - 0.14).abs() < 0.01);
        assert!(tree.size_at(&Point::new(2.0, 0.5, 0.5)) > 0.02 + 0.3 * 1.09);
    }

    #[test]
    fn the_steepest_field_ends_where_places_do() {
        let source = Source { point: Point::new(0.3, 0.4, 0.6), size: 1e-300 };
        let bounds = Aabb { min: Point::new(0., 0., 0.), max: Point::new(1., 1., 1.) };
        let tree = SourceTree::new(bounds, 1e9, 1.0, &[source]);
        assert!(tree.size_at(&source.point) < 1e-8);
        assert_eq!(tree.size_at(&bounds.max), 1.0);
    }

    #[test]
    fn without_sources_the_size_is_the_maximum() {
        let p = Point::new(1., 2., 3.);
        let tree = SourceTree::new(Aabb { min: p, max: p }, 0.3, 2.5, &[]);
        assert_eq!(tree.size_at(&p), 2.5);
    }
}
