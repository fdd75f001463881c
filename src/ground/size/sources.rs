//! Graded sources, and the smallest size that they impose at a point.

use crate::Point;
use csg::Aabb;

/// A point with a prescribed size: at distance d from it, the size is at most `size + grading·d`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Source {
    /// The position.
    pub point: Point,
    /// The size at this point, positive.
    pub size: f64,
}

/// A hierarchy of boxes around sources, each with its smallest size, for branch-and-bound searches.
#[derive(Debug)]
pub(super) struct Sources {
    grading: f64,
    /// The size if no source imposes a smaller one.
    maximum: f64,
    /// The sources, in the order of the leaves.
    sources: Vec<Source>,
    /// The nodes in pre-order: the first child of a node follows it.
    nodes: Vec<Node>,
}

#[derive(Debug)]
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

/// The maximum number of sources in a leaf.
const LEAF: usize = 6;

/// Nodes that could improve the best size by less than this fraction are skipped, because all
/// sources on a ball are equally near to its centre.
pub(super) const NO_LESS: f64 = 0.01;

/// The maximum number of nodes at which a search starts: more save little time, and they are copied
/// for each cell.
const START: usize = 8;

impl Sources {
    /// Growth of the size per unit of distance.
    pub fn grading(&self) -> f64 {
        self.grading
    }

    /// Builds the hierarchy of the sources with sizes below `maximum`.
    pub fn new(grading: f64, maximum: f64, sources: &[Source]) -> Self {
        let sources = sources.iter().copied().filter(|s| s.size < maximum).collect();
        let mut made = Self { grading, maximum, sources, nodes: Vec::new() };
        if !made.sources.is_empty() {
            made.build(0, made.sources.len());
        }
        made
    }

    fn build(&mut self, begin: usize, end: usize) {
        let part = &mut self.sources[begin..end];
        let bounds = Aabb {
            min: part.iter().fold(part[0].point, |m, s| m.inf(&s.point)),
            max: part.iter().fold(part[0].point, |m, s| m.sup(&s.point)),
        };
        let least = part.iter().map(|s| s.size).fold(f64::INFINITY, f64::min);
        let node = self.nodes.len();
        self.nodes.push(Node {
            bounds,
            least,
            range: [begin as u32, end as u32],
            second: 0,
            axis: 0,
            cut: 0.0,
        });
        if end - begin > LEAF {
            let axis = (bounds.max - bounds.min).imax();
            let half = part.len() / 2;
            part.select_nth_unstable_by(half, |a, b| a.point[axis].total_cmp(&b.point[axis]));
            let cut = part[half].point[axis];
            (self.nodes[node].axis, self.nodes[node].cut) = (axis as u32, cut);
            self.build(begin, begin + half);
            self.nodes[node].second = self.nodes.len() as u32;
            self.build(begin + half, end);
        }
    }

    /// The start of searches anywhere: the root.
    pub fn whole(&self) -> Start {
        Start { nodes: [0; START], count: usize::from(!self.nodes.is_empty()), near: None }
    }

    /// The start of searches in a box, for sizes below `most`.
    ///
    /// These are the nodes below `from` that may impose such a size in the box, as far down the
    /// hierarchy as [`START`] nodes allow.
    pub fn start_in(&self, min: &Point, max: &Point, most: f64, from: &Start) -> Start {
        let mut start = Start { count: 0, ..*from };
        let mut open = [0; START];
        let mut count = from.count;
        open[..count].copy_from_slice(&from.nodes[..count]);
        while count > 0 {
            count -= 1;
            let index = open[count];
            let node = &self.nodes[index as usize];
            if self.imposes_less(node.least, &node.bounds.min, &node.bounds.max, (min, max), most).is_none() {
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
        low: &Point,
        high: &Point,
        (min, max): (&Point, &Point),
        most: f64,
    ) -> Option<f64> {
        let room = most - size;
        let gap = |i: usize| f64::max(low[i] - max[i], min[i] - high[i]).max(0.0);
        let square = gap(0) * gap(0) + gap(1) * gap(1) + gap(2) * gap(2);
        (room > 0.0 && self.grading * self.grading * square < room * room).then_some(square)
    }

    /// The smallest size in a box, which may be a point, and the index of the source that imposes
    /// it.
    ///
    /// The size may be too large by [`NO_LESS`] of it.
    pub fn least_in(&self, min: &Point, max: &Point, start: &Start) -> (f64, Option<u32>) {
        let mut best = (self.maximum, None);
        let consider = |index: u32, best: &mut (f64, Option<u32>)| {
            let Source { point, size } = &self.sources[index as usize];
            if let Some(square) = self.imposes_less(*size, point, point, (min, max), best.0) {
                *best = (size + self.grading * square.sqrt(), Some(index));
            }
        };
        if let Some(near) = start.near {
            consider(near, &mut best);
        }
        // The depth of the hierarchy limits the open nodes below each start.
        let mut open = [0_u32; START + 64];
        let mut count = start.count;
        open[..count].copy_from_slice(&start.nodes[..count]);
        while count > 0 {
            count -= 1;
            let index = open[count];
            let Node { range, second, axis, cut, least, bounds } = &self.nodes[index as usize];
            if self
                .imposes_less(*least, &bounds.min, &bounds.max, (min, max), (1.0 - NO_LESS) * best.0)
                .is_none()
            {
                continue;
            }
            if *second == 0 {
                (range[0]..range[1]).for_each(|index| consider(index, &mut best));
                continue;
            }
            // The nearer child is put last and so searched first.
            let axis = *axis as usize;
            let swap = 0.5 * (min[axis] + max[axis]) < *cut;
            let (first, second) = (index + 1, *second);
            (open[count], open[count + 1]) = if swap { (second, first) } else { (first, second) };
            count += 2;
        }
        best
    }
}

/// The start of a search: nodes that may contain the source of the smallest size, and a first guess
/// of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Start {
    nodes: [u32; START],
    count: usize,
    /// Index of the guessed source, if any.
    pub near: Option<u32>,
}

/// The smallest source of each cell of grids, one grid for each power of two.
///
/// A source is in the grid whose cell width is its size rounded down to a power of two. Facets may
/// be much smaller than their sizes, and both sides of a thin region have the same sizes.
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
