//! Graded sources, and the least size that any of them asks for at a place.

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

/// A hierarchy of boxes around sources, each with the least size in it, for searches by branch and bound.
#[derive(Debug)]
pub(super) struct Sources {
    grading: f64,
    /// The size where no source asks for less.
    maximum: f64,
    /// In the order of the leaves.
    sources: Vec<Source>,
    /// In pre-order: the first child of a node follows it.
    nodes: Vec<Node>,
}

#[derive(Debug)]
struct Node {
    bounds: Aabb,
    /// The least size below.
    least: f64,
    /// A leaf's range of sources; of other nodes that of all below.
    range: [u32; 2],
    /// The second child, 0 for a leaf.
    second: u32,
    /// The coordinate along `axis` at which its sources are parted.
    axis: u32,
    cut: f64,
}

/// Sources of a leaf.
const LEAF: usize = 6;

/// What could undercut the best so far by less than this part is not looked at: from the middle of a ball all sources on it
/// are alike.
pub(super) const NO_LESS: f64 = 0.01;

/// Nodes that a search begins at, at most: more save little, and are copied for each cell.
const START: usize = 8;

impl Sources {
    /// Growth of the size per unit of distance.
    pub fn grading(&self) -> f64 {
        self.grading
    }

    /// The hierarchy of the sources that ask for less than `maximum`.
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

    /// Where searches begin that know nothing of their place.
    pub fn whole(&self) -> Start {
        Start { nodes: [0; START], count: usize::from(!self.nodes.is_empty()), near: None }
    }

    /// Where searches in a box begin whose field is nowhere above `most`: `from` without what asks for more everywhere there, and
    /// as far down as there is room.
    pub fn start_in(&self, min: &Point, max: &Point, most: f64, from: &Start) -> Start {
        let mut start = Start { count: 0, ..*from };
        let mut open = [0; START];
        let mut count = from.count;
        open[..count].copy_from_slice(&from.nodes[..count]);
        while count > 0 {
            count -= 1;
            let index = open[count];
            let node = &self.nodes[index as usize];
            if self.asks_less(node.least, &node.bounds.min, &node.bounds.max, (min, max), most).is_none() {
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

    /// What sources in the box from `low` to `high` of `size` or more may ask for in another box, as the square of the distance, if that may
    /// be less than `most`.
    fn asks_less(
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

    /// The least size anywhere in a box, which may be a point, or up to a hundredth more; and the index of the source that asks for it.
    pub fn least_in(&self, min: &Point, max: &Point, start: &Start) -> (f64, Option<u32>) {
        let mut best = (self.maximum, None);
        let consider = |index: u32, best: &mut (f64, Option<u32>)| {
            let Source { point, size } = &self.sources[index as usize];
            if let Some(square) = self.asks_less(*size, point, point, (min, max), best.0) {
                *best = (size + self.grading * square.sqrt(), Some(index));
            }
        };
        if let Some(near) = start.near {
            consider(near, &mut best);
        }
        // Never more than the depth of the hierarchy wait below each node of the start.
        let mut open = [0_u32; START + 64];
        let mut count = start.count;
        open[..count].copy_from_slice(&start.nodes[..count]);
        while count > 0 {
            count -= 1;
            let index = open[count];
            let Node { range, second, axis, cut, least, bounds } = &self.nodes[index as usize];
            if self
                .asks_less(*least, &bounds.min, &bounds.max, (min, max), (1.0 - NO_LESS) * best.0)
                .is_none()
            {
                continue;
            }
            if *second == 0 {
                (range[0]..range[1]).for_each(|index| consider(index, &mut best));
                continue;
            }
            // The nearer child is looked into first.
            let axis = *axis as usize;
            let swap = 0.5 * (min[axis] + max[axis]) < *cut;
            let (first, second) = (index + 1, *second);
            (open[count], open[count + 1]) = if swap { (second, first) } else { (first, second) };
            count += 2;
        }
        best
    }
}

/// Where a search begins: nodes that may hold the source that asks for least, and one that may be it, which saves time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Start {
    nodes: [u32; START],
    count: usize,
    /// Index of a source.
    pub near: Option<u32>,
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
