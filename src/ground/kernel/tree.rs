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

    /// Calls `visit` for each item whose box may meet a segment, until it returns false.
    pub fn along(&self, from: &Point, to: &Point, mut visit: impl FnMut(u32) -> bool) {
        if self.nodes.is_empty() {
            return;
        }
        let mut stack = [0u32; 64];
        let mut height = 1;
        while height > 0 {
            height -= 1;
            let node = &self.nodes[stack[height] as usize];
            if !may_meet(node, from, to) {
                continue;
            }
            if node.count > 0 {
                let items = &self.items[node.first as usize..(node.first + node.count) as usize];
                if !items.iter().all(|&item| visit(item)) {
                    return;
                }
                continue;
            }
            [stack[height], stack[height + 1]] = [node.first + 1, node.first];
            height += 2;
        }
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

/// Whether a segment may meet a box: false only if an axis of the box, or one perpendicular to it
/// and to the segment, separates them (Ericson, Real-Time Collision Detection, 2005, 5.3.3).
fn may_meet(node: &Node, from: &Point, to: &Point) -> bool {
    /// Bounds the rounding of the products relative to the square of the largest length.
    const ROUNDING: f64 = 1e-14;
    let mut half = [0.0; 3];
    let mut way = [0.0; 3];
    let mut apart = [0.0; 3];
    for k in 0..3 {
        if from[k].max(to[k]) < node.low[k] || from[k].min(to[k]) > node.high[k] {
            return false;
        }
        half[k] = 0.5 * (node.high[k] - node.low[k]);
        way[k] = 0.5 * (to[k] - from[k]);
        apart[k] = 0.5 * (from[k] + to[k]) - 0.5 * (node.low[k] + node.high[k]);
    }
    let largest = [half, way, apart].concat().into_iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let coordinates = from.coords.amax().max(to.coords.amax());
    let slack = ROUNDING * largest * (largest + coordinates);
    (0..3).all(|k| {
        let [i, j] = [(k + 1) % 3, (k + 2) % 3];
        let reach = half[i] * way[j].abs() + half[j] * way[i].abs();
        (apart[i] * way[j] - apart[j] * way[i]).abs() <= reach + slack
    })
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
    fn all_boxes_along_a_segment_are_visited_and_few_others() {
        let mut random = Random::new(3);
        let mut point = || Point::from([0, 1, 2].map(|_| random.unit()));
        let boxes: Vec<Aabb> = (0..500)
            .map(|_| {
                let corner = point();
                bounds(&[corner, corner + (point() - corner) * 0.1])
            })
            .collect();
        let tree = Tree::new(&boxes);
        for _ in 0..100 {
            let [from, to] = [point() * 1.5, point() * 1.5];
            let mut visited = Vec::new();
            tree.along(&from, &to, |item| {
                visited.push(item);
                true
            });
            visited.sort_unstable();
            // Points of the segment: their boxes must be among those visited.
            for step in 0..=1000 {
                let p = from + (to - from) * (f64::from(step) / 1000.0);
                let contains = |b: &Aabb| (0..3).all(|k| b.min[k] <= p[k] && p[k] <= b.max[k]);
                let missed =
                    (0..500).find(|&i| contains(&boxes[i as usize]) && visited.binary_search(&i).is_err());
                assert_eq!(missed, None);
            }
            assert!(visited.len() < 250, "{} of 500 boxes", visited.len());
        }
        let mut calls = 0;
        tree.along(&Point::origin(), &Point::new(1.0, 1.0, 1.0), |_| {
            calls += 1;
            false
        });
        assert!(calls <= 1, "the visit ends when it is told to");
    }

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
