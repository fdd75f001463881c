//! An octree that stores the smallest size over many graded sources.

use super::sources::{NO_LESS, Sources, Start};
use super::{LEAST_SIZE, Source};
use crate::ground::kernel::hash::WordHash;
use crate::{Point, Vector};
use csg::Aabb;
use rayon::prelude::*;
use std::collections::HashMap;

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

/// How closely a tree follows the field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Accuracy {
    /// Closely enough for a mesh.
    Fine,
    /// With twice the error, which is enough to compare numbers of tets: cells are twice as large,
    /// so that a quarter of them are built on a surface.
    Rough,
}

/// The factor of all these limits in a rough tree.
const ROUGH: f64 = 2.0;

/// The 64 subtrees below this depth are built in parallel.
const PARALLEL_DEPTH: u32 = 2;

/// When a cell is split: [`SMALL`], [`LARGE`] and [`BENT`] at a grading and an accuracy.
#[derive(Clone, Copy)]
struct Limits {
    small: f64,
    large: f64,
    bent: f64,
}

impl Limits {
    fn new(grading: f64, accuracy: Accuracy) -> Self {
        let roughness = match accuracy {
            Accuracy::Fine => 1.0,
            Accuracy::Rough => ROUGH,
        };
        let part = (STEEP / grading).min(1.0) * roughness;
        Self { small: SMALL * part, large: LARGE * part, bent: BENT * roughness }
    }
}

/// A cell during construction.
#[derive(Clone, Copy)]
struct Draft {
    min: Point,
    edge: f64,
    corners: [f64; 8],
    /// A lower bound of the field in the cell.
    least: f64,
    /// The start of searches in the cell.
    start: Start,
}

/// The values at corners computed before, by the bits of the coordinates, because cells share
/// corners.
type Known = HashMap<[u64; 3], f64, WordHash>;

impl SourceTree {
    /// Builds the tree over `bounds`.
    ///
    /// Outside, the size grows from the nearest point of the box. `grading` is the growth per unit
    /// of distance, `maximum` the size if no source imposes a smaller one.
    pub fn new(bounds: Aabb, grading: f64, maximum: f64, sources: &[Source]) -> Self {
        Self::with_accuracy(bounds, grading, maximum, sources, Accuracy::Fine)
    }

    /// [`new`](Self::new), as accurate as needed.
    pub(crate) fn with_accuracy(
        bounds: Aabb,
        grading: f64,
        maximum: f64,
        sources: &[Source],
        accuracy: Accuracy,
    ) -> Self {
        let limits = Limits::new(grading, accuracy);
        let side = (bounds.max - bounds.min).max().max(f64::MIN_POSITIVE);
        let center = bounds.center();
        let half = Vector::repeat(0.5 * side);
        let cube = Aabb { min: center - half, max: center + half };
        // Smaller ones could be 0 in the leaves, and cells would be split without end.
        let least = LEAST_SIZE * side;
        let sources: Vec<Source> =
            sources.iter().map(|source| Source { size: source.size.max(least), ..*source }).collect();
        let sources = Sources::new(grading, maximum, &sources);
        let corner = |c: usize| {
            let point = cube.min + octant(c, side);
            sources.least_in(&point, &point, &sources.whole()).0
        };
        let corners = [0, 1, 2, 3, 4, 5, 6, 7].map(corner);
        let root = Draft { min: cube.min, edge: side, corners, least: 0.0, start: sources.whole() };
        Self { bounds: cube, grading, maximum, cells: grow(&sources, limits, root) }
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
fn grow(sources: &Sources, limits: Limits, root: Draft) -> Vec<Cell> {
    let mut cells = vec![Cell::Split(0)];
    let mut open = vec![(0, root)];
    let mut known = Known::default();
    for _ in 0..PARALLEL_DEPTH {
        open =
            open.iter().flat_map(|draft| finish((sources, limits), &mut cells, draft, &mut known)).collect();
    }
    let below = |(_, draft): &(usize, Draft)| {
        let mut cells = vec![Cell::Split(0)];
        let mut open = vec![(0, *draft)];
        let mut known = Known::default();
        while let Some(next) = open.pop() {
            open.extend(finish((sources, limits), &mut cells, &next, &mut known));
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

/// Makes a cell a leaf, or splits it and returns the indices and drafts of its children.
fn finish(
    field: (&Sources, Limits),
    cells: &mut Vec<Cell>,
    (at, draft): &(usize, Draft),
    known: &mut Known,
) -> Vec<(usize, Draft)> {
    match split(field, draft, known) {
        None => {
            cells[*at] = Cell::Leaf(draft.corners.map(|value| value as f32));
            Vec::new()
        }
        Some(parts) => {
            let first = cells.len();
            cells[*at] = Cell::Split(first as u32);
            cells.extend([Cell::Split(0); 8]);
            parts.into_iter().enumerate().map(|(i, part)| (first + i, part)).collect()
        }
    }
}

/// The eight children of a cell, or `None` if interpolation in the cell is accurate enough.
fn split((sources, limits): (&Sources, Limits), draft: &Draft, known: &mut Known) -> Option<[Draft; 8]> {
    let Draft { min, edge, corners, least, start } = *draft;
    let far = min + Vector::repeat(edge);
    let least_corner = corners.iter().copied().fold(f64::INFINITY, f64::min);
    // Each point of the cell is within half a diagonal of a corner, and within √5/4 of an edge of a
    // corner or the centre.
    let reach = edge * sources.grading();
    let Limits { small, large, bent } = limits;
    if edge < small * least.max(least_corner - 0.5 * 3.0_f64.sqrt() * reach) {
        return None;
    }
    let mut start = sources.start_in(&min, &far, least_corner + 3.0_f64.sqrt() * reach, &start);
    let at = |point: Point, start: &Start| sources.least_in(&point, &point, start);
    let (middle, near) = at(min + Vector::repeat(0.5 * edge), &start);
    let least_known = least_corner.min(middle);
    if edge < small * (least_known - 0.25 * 5.0_f64.sqrt() * reach) {
        return None;
    }
    start.near = near.or(start.near);
    let (least, nearest) = sources.least_in(&min, &far, &start);
    let mean = corners.iter().sum::<f64>() / 8.0;
    let large = if least > (1.0 - bent) * least_known { SHOWN * large } else { large };
    let flat = edge < large * least && (mean - middle).abs() < bent * middle;
    if nearest.is_none() || edge < small * least || flat {
        return None;
    }
    let lattice = lattice(draft, middle, &|point| at(point, &start).0, known);
    let part = |i: usize| {
        let corner = |c: usize| {
            let along = |axis: usize| (i >> axis & 1) + (c >> axis & 1);
            lattice[along(0) + 3 * along(1) + 9 * along(2)]
        };
        let corners = [0, 1, 2, 3, 4, 5, 6, 7].map(corner);
        Draft {
            min: min + octant(i, 0.5 * edge),
            edge: 0.5 * edge,
            corners,
            least: (1.0 - NO_LESS) * least,
            start,
        }
    };
    Some([0, 1, 2, 3, 4, 5, 6, 7].map(part))
}

/// The field at the 27 corners of the children of a cell, x fastest.
fn lattice(draft: &Draft, middle: f64, field: &dyn Fn(Point) -> f64, known: &mut Known) -> [f64; 27] {
    std::array::from_fn(|i| {
        let step = [i % 3, i / 3 % 3, i / 9];
        if step.iter().all(|&s| s != 1) {
            draft.corners[step[0] / 2 + step[1] + 2 * step[2]]
        } else if step == [1, 1, 1] {
            middle
        } else {
            let point = draft.min + 0.5 * draft.edge * Vector::from(step.map(|s| s as f64));
            *known.entry([0, 1, 2].map(|axis| point[axis].to_bits())).or_insert_with(|| field(point))
        }
    })
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
        let agrees = |tree: &SourceTree, most: f64, mean: f64| {
            let mut sum = 0.0;
            for p in scattered(3000) {
                let exact =
                    sources.iter().map(|s| s.size + grading * (p - s.point).norm()).fold(maximum, f64::min);
                let error = (tree.size_at(&p) - exact).abs() / exact;
                assert!(error <= most, "{p}: {error}");
                sum += error;
            }
            assert!(sum / 3000.0 < mean, "{sum}");
        };
        let tree = SourceTree::new(bounds, grading, maximum, &sources);
        agrees(&tree, most, 0.02);
        let rough = SourceTree::with_accuracy(bounds, grading, maximum, &sources, Accuracy::Rough);
        agrees(&rough, ROUGH * most, ROUGH * 0.02);
        assert!(2 * rough.cells.len() < tree.cells.len(), "{} cells", rough.cells.len());
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
