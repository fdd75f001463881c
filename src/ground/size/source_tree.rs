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
    cells: Vec<Cell>,
}

#[derive(Clone, Copy, Debug)]
enum Cell {
    /// Index of the first of eight children.
    Split(u32),
    /// The values at the corners: bit 0 of the index is x, bit 1 y, bit 2 z.
    Leaf([f32; 8]),
}

impl Cell {
    /// The same cell after all cells of its tree are moved by `shift` indices.
    fn shifted(&self, shift: u32) -> Cell {
        match self {
            Cell::Split(first) => Cell::Split(first + shift),
            Cell::Leaf(corners) => Cell::Leaf(*corners),
        }
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
}

impl Limits {
    fn new(grading: f64, roughness: f64) -> Self {
        let part = (STEEP / grading).min(1.0) * roughness;
        Self { small: SMALL * part, large: LARGE * part, bent: BENT * roughness }
    }

    /// Whether interpolation in a cell is accurate enough.
    fn allow(&self, draft: &Draft, maximum: f64) -> bool {
        let Draft { edge, corners, center, least, .. } = *draft;
        let least_known = corners.iter().copied().fold(center, f64::min);
        let large = if least > (1.0 - self.bent) * least_known { SHOWN * self.large } else { self.large };
        let mean = corners.iter().sum::<f64>() / 8.0;
        let is_flat = edge < large * least && (mean - center).abs() < self.bent * center;
        least >= maximum || edge < self.small * least || is_flat
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
        let limits = Limits::new(grading, roughness);
        let side = (bounds.max - bounds.min).max().max(f64::MIN_POSITIVE);
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
        Self { bounds: cube, grading, maximum, cells: grow(&sources, &limits, root) }
    }

    /// The size at `point`.
    pub fn size_at(&self, point: &Point) -> f64 {
        let inside = Point::from(point.coords.sup(&self.bounds.min.coords).inf(&self.bounds.max.coords));
        let mut min = self.bounds.min;
        let mut edge = self.bounds.max.x - self.bounds.min.x;
        let mut cell = 0;
        let corners = loop {
            match &self.cells[cell] {
                Cell::Leaf(corners) => break corners,
                Cell::Split(first) => {
                    edge *= 0.5;
                    let child = (0..3)
                        .filter(|&axis| inside[axis] >= min[axis] + edge)
                        .fold(0, |c, axis| c | 1 << axis);
                    min += octant(child, edge);
                    cell = *first as usize + child;
                }
            }
        };
        let size = interpolate(corners, (inside - min) / edge);
        (size + self.grading * (point - inside).norm()).min(self.maximum)
    }
}

/// The cells of the subtree below a draft, its root first.
fn grow(sources: &Sources, limits: &Limits, root: Draft) -> Vec<Cell> {
    let mut cells = vec![Cell::Split(0)];
    let mut open = vec![(0, root)];
    for _ in 0..PARALLEL_DEPTH {
        for (at, draft) in std::mem::take(&mut open) {
            finish((sources, limits), at, &draft, &mut cells, &mut open);
        }
    }
    let below = |(_, draft): &(usize, Draft)| {
        let mut cells = vec![Cell::Split(0)];
        let mut open = vec![(0, *draft)];
        while let Some((at, draft)) = open.pop() {
            finish((sources, limits), at, &draft, &mut cells, &mut open);
        }
        cells
    };
    let parts: Vec<Vec<Cell>> = open.par_iter().map(below).collect();
    for ((at, _), part) in open.iter().zip(&parts) {
        // The root of a part replaces its placeholder, the others are appended.
        let shift = cells.len() as u32 - 1;
        cells[*at] = part[0].shifted(shift);
        cells.extend(part[1..].iter().map(|cell| cell.shifted(shift)));
    }
    cells
}

/// Makes a cell a leaf, or splits it and adds its children to the open cells.
fn finish(
    (sources, limits): (&Sources, &Limits),
    at: usize,
    draft: &Draft,
    cells: &mut Vec<Cell>,
    open: &mut Vec<(usize, Draft)>,
) {
    if limits.allow(draft, sources.maximum()) {
        cells[at] = Cell::Leaf(draft.corners.map(|value| value as f32));
        return;
    }
    let first = cells.len();
    cells[at] = Cell::Split(first as u32);
    cells.extend([Cell::Split(0); 8]);
    open.extend((first..).zip(children(sources, draft)));
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
        assert!(2 * rough.cells.len() < tree.cells.len(), "{} cells", rough.cells.len());
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
