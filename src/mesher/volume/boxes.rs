//! Bounding-volume hierarchy of axis-aligned boxes, and all pairs of boxes that intersect.
//!
//! The boxes are halved recursively at the median of their centres, along the longest extent of the
//! centres. All leaves have the same depth, so intersecting pairs are found by a dual-tree
//! traversal level by level.

use crate::Point;

/// The most items in a leaf; the least is half of it. Smaller leaves make more nodes to visit,
/// larger ones more pairs to test.
const LEAF: usize = 8;

/// Subtrees with fewer items are not worth a parallel task.
const TASK: usize = 4096;

/// An axis-aligned box.
#[derive(Clone, Copy, Debug)]
pub(super) struct Box3 {
    low: [f64; 3],
    high: [f64; 3],
}

impl Box3 {
    const EMPTY: Self = Self { low: [f64::INFINITY; 3], high: [f64::NEG_INFINITY; 3] };

    /// The bounding box of points.
    pub fn of<'a>(points: impl IntoIterator<Item = &'a Point>) -> Self {
        points.into_iter().fold(Self::EMPTY, |b, p| {
            let p: [f64; 3] = (*p).into();
            b.joined(&Self { low: p, high: p })
        })
    }

    fn joined(&self, other: &Self) -> Self {
        Self {
            low: [0, 1, 2].map(|k| self.low[k].min(other.low[k])),
            high: [0, 1, 2].map(|k| self.high[k].max(other.high[k])),
        }
    }

    /// Whether two boxes intersect (touching counts).
    #[inline]
    pub fn meets(&self, other: &Self) -> bool {
        // No short-circuit `&&`: six branches cost more than six comparisons.
        (self.low[0] <= other.high[0])
            & (other.low[0] <= self.high[0])
            & (self.low[1] <= other.high[1])
            & (other.low[1] <= self.high[1])
            & (self.low[2] <= other.high[2])
            & (other.low[2] <= self.high[2])
    }

    /// Twice the centre coordinate along an axis.
    fn middle(&self, axis: usize) -> f64 {
        self.low[axis] + self.high[axis]
    }
}

/// A complete binary tree in preorder: the left child of a node at height h follows it directly,
/// the right child is 2^h after it.
pub(super) struct Tree {
    nodes: Vec<Box3>,
    height: u32,
    /// The boxes with their indices, leaf by leaf.
    items: Vec<(Box3, u32)>,
}

/// A node during traversal: its index, its height above the leaves, its range of items.
#[derive(Clone, Copy)]
struct Node {
    at: usize,
    height: u32,
    first: usize,
    last: usize,
}

impl Node {
    fn children(self) -> [Self; 2] {
        let middle = self.first.midpoint(self.last);
        let height = self.height - 1;
        [
            Self { at: self.at + 1, height, last: middle, ..self },
            Self { at: self.at + (1 << self.height), height, first: middle, ..self },
        ]
    }
}

impl Tree {
    /// Builds the tree; item `i` is `boxes[i]`.
    pub fn new(boxes: Vec<Box3>) -> Self {
        let mut items: Vec<(Box3, u32)> = boxes.into_iter().zip(0..).collect();
        let height = items.len().div_ceil(LEAF).next_power_of_two().ilog2();
        let mut nodes = vec![Box3::EMPTY; (2 << height) - 1];
        build(&mut nodes, &mut items);
        Self { nodes, height, items }
    }

    /// Calls `test` once for each pair of different items whose boxes intersect, and collects its
    /// results.
    ///
    /// The order of the results depends on the boxes only, not on the threads.
    pub fn find_pairs<T: Send>(&self, test: &(impl Fn(u32, u32) -> Option<T> + Sync)) -> Vec<T> {
        let root = Node { at: 0, height: self.height, first: 0, last: self.items.len() };
        self.within(root, test)
    }

    fn within<T: Send>(&self, node: Node, test: &(impl Fn(u32, u32) -> Option<T> + Sync)) -> Vec<T> {
        if node.height == 0 {
            let items = &self.items[node.first..node.last];
            let pairs =
                items.iter().enumerate().flat_map(|(i, a)| items[i + 1..].iter().map(move |b| (a, b)));
            return pairs.filter(|(a, b)| a.0.meets(&b.0)).filter_map(|(a, b)| test(a.1, b.1)).collect();
        }
        let [left, right] = node.children();
        let parallel = node.last - node.first >= TASK;
        let inside = || both(parallel, || self.within(left, test), || self.within(right, test));
        let ((mut found, other), between) = both(parallel, inside, || self.between(left, right, test));
        found.extend(other);
        found.extend(between);
        found
    }

    /// Tests the pairs of one item under each of two different nodes of equal height.
    fn between<T: Send>(
        &self,
        one: Node,
        other: Node,
        test: &(impl Fn(u32, u32) -> Option<T> + Sync),
    ) -> Vec<T> {
        let mut found = Vec::new();
        let mut open = vec![(one, other)];
        while let Some((one, other)) = open.pop() {
            let (here, there) = (&self.nodes[one.at], &self.nodes[other.at]);
            if !here.meets(there) {
                continue;
            }
            if one.height > 0 {
                for a in one.children() {
                    open.extend(other.children().map(|b| (a, b)));
                }
                continue;
            }
            for a in self.items[one.first..one.last].iter().filter(|a| a.0.meets(there)) {
                let near = self.items[other.first..other.last].iter().filter(|b| a.0.meets(&b.0));
                found.extend(near.filter_map(|b| test(a.1, b.1)));
            }
        }
        found
    }
}

/// Sorts the items of a subtree into leaves and fills its nodes.
fn build(nodes: &mut [Box3], items: &mut [(Box3, u32)]) {
    let whole = items.iter().fold(Box3::EMPTY, |b, item| b.joined(&item.0));
    nodes[0] = whole;
    if nodes.len() == 1 {
        return;
    }
    let mut low = [f64::INFINITY; 3];
    let mut high = [f64::NEG_INFINITY; 3];
    for (b, _) in &*items {
        for k in 0..3 {
            low[k] = low[k].min(b.middle(k));
            high[k] = high[k].max(b.middle(k));
        }
    }
    let extent = [0, 1, 2].map(|k| high[k] - low[k]);
    let axis = (0..3).max_by(|&i, &j| extent[i].total_cmp(&extent[j])).expect("three axes");
    let middle = items.len() / 2;
    if middle < items.len() {
        items.select_nth_unstable_by(middle, |a, b| {
            a.0.middle(axis).total_cmp(&b.0.middle(axis)).then(a.1.cmp(&b.1))
        });
    }
    let (lower, upper) = items.split_at_mut(middle);
    let half = nodes.len() / 2;
    let (left, right) = nodes[1..].split_at_mut(half);
    both(lower.len() >= TASK, || build(left, lower), || build(right, upper));
}

/// Runs two closures, in parallel if that pays.
fn both<A: Send, B: Send>(
    parallel: bool,
    one: impl FnOnce() -> A + Send,
    other: impl FnOnce() -> B + Send,
) -> (A, B) {
    if parallel { rayon::join(one, other) } else { (one(), other()) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::kernel::random::Random;

    #[test]
    fn the_tree_finds_the_pairs_that_a_test_of_all_pairs_finds() {
        let mut random = Random::new(1);
        for n in [1, 2, 3, 9, 100, 1000] {
            let boxes: Vec<Box3> = (0..n)
                .map(|_| {
                    let p = Point::from([0; 3].map(|_| random.unit()));
                    let size = 0.5 * random.unit().powi(6);
                    Box3::of([&p, &(p + crate::Vector::from([0; 3].map(|_| size * random.unit())))])
                })
                .collect();
            let tree = Tree::new(boxes.clone());
            let mut found = tree.find_pairs(&|i, j| Some([i.min(j), i.max(j)]));
            found.sort_unstable();
            let meets = |i: u32, j: u32| boxes[i as usize].meets(&boxes[j as usize]);
            let all: Vec<[u32; 2]> =
                (0..n).flat_map(|i| (i + 1..n).map(move |j| [i, j])).filter(|p| meets(p[0], p[1])).collect();
            assert_eq!(found, all);
        }
    }
}
