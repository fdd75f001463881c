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
}

/// Sources of a leaf.
const LEAF: usize = 6;

/// What could undercut the best so far by less than this part is not looked at: from the middle of a ball all sources on it
/// are alike.
const NO_LESS: f64 = 0.01;

impl Sources {
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
        self.nodes.push(Node { bounds, least, range: [begin as u32, end as u32], second: 0 });
        if end - begin > LEAF {
            let axis = (bounds.max - bounds.min).imax();
            let half = part.len() / 2;
            part.select_nth_unstable_by(half, |a, b| a.point[axis].total_cmp(&b.point[axis]));
            self.build(begin, begin + half);
            self.nodes[node].second = self.nodes.len() as u32;
            self.build(begin + half, end);
        }
    }

    /// The least size anywhere in a box, which may be a point, or up to a hundredth more.
    ///
    /// `near` is the index of a source that may be the one that asks for least, which saves time; the index of that one is
    /// returned.
    pub fn least_in(&self, min: &Point, max: &Point, near: Option<u32>) -> (f64, Option<u32>) {
        let reach = |low: &Point, high: &Point| {
            let gap = |i: usize| f64::max(low[i] - max[i], min[i] - high[i]).max(0.0);
            (gap(0) * gap(0) + gap(1) * gap(1) + gap(2) * gap(2)).sqrt() * self.grading
        };
        let asked = |s: &Source| s.size + reach(&s.point, &s.point);
        let mut best = (self.maximum, None);
        let consider = |index: u32, best: &mut (f64, Option<u32>)| {
            let size = asked(&self.sources[index as usize]);
            if size < best.0 {
                *best = (size, Some(index));
            }
        };
        if let Some(near) = near {
            consider(near, &mut best);
        }
        let bound = |node: usize| {
            self.nodes[node].least + reach(&self.nodes[node].bounds.min, &self.nodes[node].bounds.max)
        };
        // Never more than the depth of the hierarchy wait.
        let mut open = [(0_u32, 0.0_f64); 64];
        let mut count = usize::from(!self.nodes.is_empty());
        while count > 0 {
            count -= 1;
            let (node, at_least) = open[count];
            if at_least >= (1.0 - NO_LESS) * best.0 {
                continue;
            }
            let Node { range, second, .. } = self.nodes[node as usize];
            if second == 0 {
                (range[0]..range[1]).for_each(|index| consider(index, &mut best));
                continue;
            }
            let children = [node + 1, second].map(|child| (child, bound(child as usize)));
            let nearer = usize::from(children[1].1 < children[0].1);
            (open[count], open[count + 1]) = (children[1 - nearer], children[nearer]);
            count += 2;
        }
        best
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
