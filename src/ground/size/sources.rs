//! Graded sources, and the smallest size that they impose at a point.

use super::lattice::Lattice;
use crate::Point;
use csg::Aabb;
use rayon::prelude::*;
use rustc_hash::FxHashMap as HashMap;
use std::ops::Range;

/// A point with a prescribed size: at distance d from it, the size is at most `size + grading·d`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Source {
    /// The position.
    pub point: Point,
    /// The size at this point, positive.
    pub size: f64,
}

/// A hierarchy of boxes around sources, each with its smallest size, for branch-and-bound searches.
#[derive(Clone, Debug)]
pub(crate) struct Sources {
    grading: f64,
    /// The size if no source imposes a smaller one.
    maximum: f64,
    /// The sources, in the order of the leaves.
    sources: Vec<Source>,
    /// The nodes in pre-order: the first child of a node follows it.
    nodes: Vec<Node>,
}

#[derive(Clone, Debug)]
struct Node {
    bounds: Aabb,
    /// The smallest size of the sources in the node.
    least: f64,
    /// The range of the sources in the node.
    range: [u32; 2],
    /// The second child, 0 for a leaf.
    second: u32,
    /// The axis along which the children are split, at `cut`.
    axis: u32,
    cut: f64,
}

impl Node {
    fn range(&self) -> Range<usize> {
        self.range[0] as usize..self.range[1] as usize
    }
}

/// The maximum number of sources in a leaf.
const LEAF: usize = 8;

/// Parts with more sources than this are divided on two threads.
const PARALLEL: usize = 1 << 13;

/// Nodes that could improve the best size by less than this fraction are skipped, because all
/// sources on a ball are equally near to its centre.
const NO_LESS: f64 = 0.01;

/// The maximum number of nodes at which a search starts: more save little time, and they are copied
/// for each cell.
const START: usize = 8;

impl Sources {
    /// Growth of the size per unit of distance.
    pub(super) fn grading(&self) -> f64 {
        self.grading
    }

    /// The size if no source imposes a smaller one.
    pub(super) fn maximum(&self) -> f64 {
        self.maximum
    }

    /// Builds the hierarchy of the sources with sizes below `maximum`.
    pub fn new(grading: f64, maximum: f64, sources: &[Source]) -> Self {
        let mut sources: Vec<Source> = sources.iter().copied().filter(|s| s.size < maximum).collect();
        let mut nodes = Vec::new();
        if !sources.is_empty() {
            add_nodes(&mut sources, 0, &mut nodes);
        }
        Self { grading, maximum, sources, nodes }
    }

    /// The start of searches anywhere: the root.
    pub(super) fn whole(&self) -> Start {
        Start { nodes: [0; START], count: usize::from(!self.nodes.is_empty()) }
    }

    /// The start of searches in a box, for sizes below `most`.
    ///
    /// These are the nodes below `from` that may impose such a size in the box, as far down the
    /// hierarchy as [`START`] nodes allow.
    pub(super) fn start_in(&self, min: &Point, max: &Point, most: f64, from: &Start) -> Start {
        let mut start = Start { count: 0, ..*from };
        let mut open = [0; START];
        let mut count = from.count;
        open[..count].copy_from_slice(&from.nodes[..count]);
        while count > 0 {
            count -= 1;
            let index = open[count];
            let node = &self.nodes[index as usize];
            if self.imposes_less(node.least, (&node.bounds.min, &node.bounds.max), (min, max), most).is_none()
            {
                continue;
            }
            if node.second == 0 || start.count + count + 2 > START {
                start.nodes[start.count] = index;
                start.count += 1;
            } else {
                (open[count], open[count + 1]) = (node.second, index + 1);
                count += 2;
            }
        }
        start
    }

    /// The squared distance of two boxes, if sources in the first may impose less than `most` in
    /// the second.
    ///
    /// The sources are in the box from `low` to `high`, and their sizes are at least `size`.
    fn imposes_less(
        &self,
        size: f64,
        (low, high): (&Point, &Point),
        (min, max): (&Point, &Point),
        most: f64,
    ) -> Option<f64> {
        let room = most - size;
        let gap = |i: usize| f64::max(low[i] - max[i], min[i] - high[i]).max(0.0);
        let square = gap(0) * gap(0) + gap(1) * gap(1) + gap(2) * gap(2);
        (room > 0.0 && self.grading * self.grading * square < room * room).then_some(square)
    }

    /// Considers the sources below a start for the field in a cell, whose values may stay too large
    /// by [`NO_LESS`] of them.
    pub(super) fn consider(&self, start: &Start, center: &Point, lattice: &mut Lattice) {
        let visit = |node: &Node, lattice: &mut Lattice| {
            let is_needed = lattice.may_be_lower(&node.bounds, node.least, NO_LESS);
            if is_needed && node.second == 0 {
                self.sources[node.range()].iter().for_each(|source| lattice.add(source));
            }
            is_needed
        };
        self.search(start, center, lattice, visit);
    }

    /// The size at a point, which may be too large by [`NO_LESS`] of it.
    pub fn size_at(&self, point: &Point) -> f64 {
        let visit = |node: &Node, best: &mut f64| {
            let Aabb { min, max } = &node.bounds;
            let most = (1.0 - NO_LESS) * *best;
            let is_needed = self.imposes_less(node.least, (min, max), (point, point), most).is_some();
            if is_needed && node.second == 0 {
                for Source { point: at, size } in &self.sources[node.range()] {
                    if let Some(square) = self.imposes_less(*size, (at, at), (point, point), *best) {
                        *best = size + self.grading * square.sqrt();
                    }
                }
            }
            is_needed
        };
        let mut best = self.maximum;
        self.search(&self.whole(), point, &mut best, visit);
        best
    }

    /// Visits nodes below a start, those near a place first, and the children of those for which
    /// `visit` is true.
    #[inline(always)]
    fn search<T>(&self, start: &Start, near: &Point, state: &mut T, visit: impl Fn(&Node, &mut T) -> bool) {
        // The depth of the hierarchy limits the open nodes below each start.
        let mut open = [0_u32; START + 64];
        let mut count = start.count;
        open[..count].copy_from_slice(&start.nodes[..count]);
        while count > 0 {
            count -= 1;
            let index = open[count];
            let node = &self.nodes[index as usize];
            if !visit(node, state) || node.second == 0 {
                continue;
            }
            // The nearer child is put last and so searched first.
            let swap = near[node.axis as usize] < node.cut;
            let (first, second) = (index + 1, node.second);
            (open[count], open[count + 1]) = if swap { (second, first) } else { (first, second) };
            count += 2;
        }
    }
}

/// Adds the nodes of a part of the sources, the first of which has the index `first`, and orders
/// the sources by leaves.
fn add_nodes(part: &mut [Source], first: u32, nodes: &mut Vec<Node>) {
    let bounds = Aabb {
        min: part.iter().fold(part[0].point, |m, s| m.inf(&s.point)),
        max: part.iter().fold(part[0].point, |m, s| m.sup(&s.point)),
    };
    let least = part.iter().map(|s| s.size).fold(f64::INFINITY, f64::min);
    let root = nodes.len();
    let range = [first, first + part.len() as u32];
    nodes.push(Node { bounds, least, range, second: 0, axis: 0, cut: 0.0 });
    if part.len() <= LEAF {
        return;
    }
    let axis = (bounds.max - bounds.min).imax();
    let half = part.len() / 2;
    part.select_nth_unstable_by(half, |a, b| a.point[axis].total_cmp(&b.point[axis]));
    (nodes[root].axis, nodes[root].cut) = (axis as u32, part[half].point[axis]);
    let is_large = part.len() > PARALLEL;
    let (low, high) = part.split_at_mut(half);
    let middle = first + half as u32;
    if !is_large {
        add_nodes(low, first, nodes);
        nodes[root].second = nodes.len() as u32;
        add_nodes(high, middle, nodes);
        return;
    }
    let nodes_of = |part: &mut [Source], first: u32| {
        let mut nodes = Vec::new();
        add_nodes(part, first, &mut nodes);
        nodes
    };
    let (low, high) = rayon::join(|| nodes_of(low, first), || nodes_of(high, middle));
    nodes[root].second = (nodes.len() + low.len()) as u32;
    for mut part in [low, high] {
        let shift = nodes.len() as u32;
        part.iter_mut().filter(|node| node.second > 0).for_each(|node| node.second += shift);
        nodes.extend(part);
    }
}

/// The start of a search: nodes that may contain the source of the smallest size.
#[derive(Clone, Copy, Debug)]
pub(super) struct Start {
    nodes: [u32; START],
    count: usize,
}

/// The smallest source of each cell of grids, one grid for each power of two.
///
/// A source is in the grid whose cell width is its size rounded down to a power of two. Facets may
/// be much smaller than their sizes, and both sides of a thin region have the same sizes.
pub(crate) fn thinned(sources: Vec<Source>) -> Vec<Source> {
    /// Fewer sources are thinned by one thread.
    const AT_ONCE: usize = 1 << 15;
    type Cells = HashMap<(i32, [i64; 3]), Source>;
    let cell_of = |s: &Source| {
        let level = s.size.log2().floor();
        let width = level.exp2();
        (level as i32, [s.point.x, s.point.y, s.point.z].map(|x| (x / width).floor() as i64))
    };
    let add = |cells: &mut Cells, cell: (i32, [i64; 3]), source: Source| {
        let kept = cells.entry(cell).or_insert(source);
        if source.size < kept.size {
            *kept = source;
        }
    };
    let of_chunk = |sources: &[Source]| {
        let mut cells = Cells::default();
        sources.iter().for_each(|source| add(&mut cells, cell_of(source), *source));
        cells
    };
    let mut chunks = sources.par_chunks(AT_ONCE).map(of_chunk).collect::<Vec<_>>().into_iter();
    let mut cells = chunks.next().unwrap_or_default();
    chunks.flatten().for_each(|(cell, source)| add(&mut cells, cell, source));
    let mut cells: Vec<_> = cells.into_iter().collect();
    cells.par_sort_unstable_by_key(|(cell, _)| *cell);
    cells.into_iter().map(|(_, source)| source).collect()
}
