//! A tree of boxes for nearest-item queries.
//!
//! The caller defines the distance to an item, so facets and segments use the same structure. The
//! f64 version of parry3d is not faster (projection to a torus of 10⁴ facets: about 2 µs per point
//! in both). Equal distances are resolved by item number.

use crate::Point;
use csg::Aabb;

/// The maximum number of items in a leaf: with 2 the tree is too deep, with 8 too many items are
/// tested.
const LEAF: usize = 4;

/// Nested boxes, each around two subtrees or a few items.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Tree {
    nodes: Vec<Node>,
    /// The items, leaf by leaf.
    items: Vec<u32>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Node {
    low: [f64; 3],
    high: [f64; 3],
    /// The index of the first of two adjacent children, or of the first item.
    first: u32,
    /// The number of items; 0 if the node has children.
    count: u32,
}

impl Tree {
    /// Builds a tree over boxes.
    pub fn new(boxes: &[Aabb]) -> Self {
        let mut tree = Self { nodes: Vec::new(), items: (0..boxes.len() as u32).collect() };
        if !boxes.is_empty() {
            tree.nodes.push(Node { low: [0.0; 3], high: [0.0; 3], first: 0, count: 0 });
            tree.build(boxes, 0, 0, boxes.len());
        }
        tree
    }

    fn build(&mut self, boxes: &[Aabb], node: usize, from: usize, to: usize) {
        let items = &mut self.items[from..to];
        let (mut low, mut high) = (Point::from([f64::INFINITY; 3]), Point::from([f64::NEG_INFINITY; 3]));
        let (mut first, mut last) = (low, high);
        let center = |i: u32| nalgebra::center(&boxes[i as usize].min, &boxes[i as usize].max);
        for &i in items.iter() {
            (low, high) = (low.inf(&boxes[i as usize].min), high.sup(&boxes[i as usize].max));
            (first, last) = (first.inf(&center(i)), last.sup(&center(i)));
        }
        self.nodes[node] =
            Node { low: low.into(), high: high.into(), first: from as u32, count: items.len() as u32 };
        if items.len() <= LEAF {
            return;
        }
        let axis = (last - first).imax();
        let half = items.len() / 2;
        let key = |i: &u32| center(*i)[axis];
        items.select_nth_unstable_by(half, |i, j| key(i).total_cmp(&key(j)).then(i.cmp(j)));
        let children = self.nodes.len();
        self.nodes.extend([self.nodes[node]; 2]);
        self.nodes[node].first = children as u32;
        self.nodes[node].count = 0;
        self.build(boxes, children, from, from + half);
        self.build(boxes, children + 1, from + half, to);
    }

    /// An item whose box contains the point and that satisfies `is_it`, if any.
    pub fn find(&self, point: &Point, mut is_it: impl FnMut(u32) -> bool) -> Option<u32> {
        self.nodes.first()?;
        let mut stack = [0u32; 64];
        let mut height = 1;
        while height > 0 {
            height -= 1;
            let node = &self.nodes[stack[height] as usize];
            if squared_gap(node, point) > 0.0 {
                continue;
            }
            if node.count > 0 {
                let items = &self.items[node.first as usize..(node.first + node.count) as usize];
                if let Some(&item) = items.iter().find(|item| is_it(**item)) {
                    return Some(item);
                }
                continue;
            }
            [stack[height], stack[height + 1]] = [node.first + 1, node.first];
            height += 2;
        }
        None
    }

    /// The item nearest to a point, the first on ties; `None` if the tree is empty.
    ///
    /// `distance` is squared, and at least that to the item's box.
    pub fn nearest(&self, point: &Point, distance: impl FnMut(u32) -> f64) -> Option<(u32, f64)> {
        self.nearest_within(point, f64::INFINITY, distance)
    }

    /// The nearest item within a squared distance, if any.
    pub fn nearest_within(
        &self,
        point: &Point,
        limit: f64,
        mut distance: impl FnMut(u32) -> f64,
    ) -> Option<(u32, f64)> {
        let mut best = (u32::MAX, limit);
        let root = self.nodes.first()?;
        // Deep enough for 2³² items.
        let mut stack = [(0u32, 0.0f64); 64];
        stack[0] = (0, squared_gap(root, point));
        let mut height = 1;
        while height > 0 {
            height -= 1;
            let (node, gap) = stack[height];
            if gap > best.1 {
                continue;
            }
            let node = &self.nodes[node as usize];
            if node.count > 0 {
                for &item in &self.items[node.first as usize..(node.first + node.count) as usize] {
                    let d = distance(item);
                    if d < best.1 || (d == best.1 && item < best.0) {
                        best = (item, d);
                    }
                }
                continue;
            }
            let children =
                [node.first, node.first + 1].map(|c| (c, squared_gap(&self.nodes[c as usize], point)));
            let [near, far] = if children[1].1 < children[0].1 { [1, 0] } else { [0, 1] };
            for child in [children[far], children[near]] {
                if child.1 <= best.1 {
                    stack[height] = child;
                    height += 1;
                }
            }
        }
        (best.0 != u32::MAX).then_some(best)
    }
}

/// The squared distance of a point from a box.
#[inline]
fn squared_gap(node: &Node, point: &Point) -> f64 {
    let mut sum = 0.0;
    for k in 0..3 {
        let gap = (node.low[k] - point[k]).max(point[k] - node.high[k]).max(0.0);
        sum += gap * gap;
    }
    sum
}

/// The smallest box around points.
pub(crate) fn bounds<'a>(points: impl IntoIterator<Item = &'a Point>) -> Aabb {
    let (mut min, mut max) = (Point::from([f64::INFINITY; 3]), Point::from([f64::NEG_INFINITY; 3]));
    for p in points {
        (min, max) = (min.inf(p), max.sup(p));
    }
    Aabb { min, max }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::kernel::random::Random;

    #[test]
    fn the_tree_finds_the_same_items_as_a_search_of_all() {
        let mut random = Random::new(7);
        let mut point = || Point::from([0, 1, 2].map(|_| random.unit()));
        let boxes: Vec<Aabb> = (0..200)
            .map(|_| {
                let corner = point();
                bounds(&[corner, corner + (point() - corner) * 0.3])
            })
            .collect();
        let tree = Tree::new(&boxes);
        for _ in 0..500 {
            let p = point();
            let contains = |i: u32| {
                let b = &boxes[i as usize];
                (0..3).all(|k| b.min[k] <= p[k] && p[k] <= b.max[k])
            };
            let held: Vec<u32> = (0..200).filter(|&i| contains(i)).collect();
            assert_eq!(tree.find(&p, contains).is_some(), !held.is_empty());
            for &i in &held {
                assert_eq!(tree.find(&p, |item| item == i), Some(i));
            }
        }
        assert_eq!(Tree::new(&[]).find(&Point::origin(), |_| true), None);
    }
}
