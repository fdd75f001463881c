//! Quality of a partition, and the repair of empty parts.

use super::Method;
use super::dual::Dual;
use crate::ground::kernel::buckets::{map_each, ranges, tabulate};
use crate::ground::mesh::Rank;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::ops::Range;
use std::sync::atomic::AtomicU32;
use std::sync::atomic::Ordering::Relaxed;

/// Quality of a partition.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Metrics {
    /// The method that made it, if a partitioner did.
    pub method: Option<Method>,
    /// The number of parts.
    pub parts: u32,
    /// Tets in the smallest part.
    pub smallest: usize,
    /// Tets in the largest part.
    pub largest: usize,
    /// Tets in the largest part over the mean: 1 is perfect. With weights, the same of weights.
    pub imbalance: f64,
    /// Faces between parts.
    pub edge_cut: usize,
    /// Connected components (by faces) of all parts together: equal to `parts` if each part is
    /// connected.
    pub pieces: usize,
    /// Triangles between bodies whose tets are in different parts.
    pub cut_interfaces: usize,
    /// Tets that violate their [`Ties`](super::ties::Ties).
    pub lost_ties: usize,
    /// Parts that the method left empty and that were given a tet.
    pub repaired: usize,
}

/// Measures a partition of tets with these faces.
pub fn measure(
    faces: &[[u32; 2]],
    part: &[Rank],
    parts: u32,
    method: Option<Method>,
    repaired: usize,
) -> Metrics {
    let sizes = sizes(part, parts);
    let largest = sizes.iter().copied().max().unwrap_or(0);
    let (edge_cut, pieces) = cut_and_pieces(faces, part);
    Metrics {
        method,
        parts,
        smallest: sizes.iter().copied().min().unwrap_or(0),
        largest,
        imbalance: largest as f64 * f64::from(parts) / part.len().max(1) as f64,
        edge_cut,
        pieces,
        cut_interfaces: 0,
        lost_ties: 0,
        repaired,
    }
}

/// The largest weight of a part over the mean.
pub fn imbalance(part: &[Rank], parts: u32, weights: &[f64]) -> f64 {
    let mut sums = vec![0.0; parts as usize];
    part.iter().zip(weights).for_each(|(&p, weight)| sums[p as usize] += weight);
    let mean = sums.iter().sum::<f64>() / f64::from(parts);
    sums.into_iter().fold(0.0, f64::max) / mean
}

/// The number of tets in each part.
fn sizes(part: &[Rank], parts: u32) -> Vec<usize> {
    let mut sizes = vec![0; parts as usize];
    part.iter().for_each(|&p| sizes[p as usize] += 1);
    sizes
}

/// The number of faces between parts, and the number of sets of tets that are connected by faces
/// within one part.
fn cut_and_pieces(faces: &[[u32; 2]], part: &[Rank]) -> (usize, usize) {
    let sets = Sets::new(part.len());
    let of_range = |range: Range<usize>| {
        let (mut cut, mut joined) = (0, 0);
        for &[first, second] in faces[range].iter().filter(|[_, second]| *second != u32::MAX) {
            if part[first as usize] == part[second as usize] {
                joined += usize::from(sets.join(first, second));
            } else {
                cut += 1;
            }
        }
        (cut, joined)
    };
    let found = map_each(ranges(faces.len()), of_range);
    let (cut, joined) = found.into_iter().fold((0, 0), |sum, one| (sum.0 + one.0, sum.1 + one.1));
    (cut, part.len() - joined)
}

/// Disjoint sets that several threads join at once (Anderson and Woll 1991). A set is a tree whose
/// root has the lowest index; only roots get a parent, so the number of joins does not depend on
/// the order.
struct Sets {
    parents: Vec<AtomicU32>,
}

impl Sets {
    fn new(count: usize) -> Self {
        Self { parents: tabulate(count, |index| AtomicU32::new(index as u32)) }
    }

    /// The root of an element; halves the path to it.
    fn root(&self, mut element: u32) -> u32 {
        loop {
            let parent = self.parents[element as usize].load(Relaxed);
            if parent == element {
                return element;
            }
            let above = self.parents[parent as usize].load(Relaxed);
            if above != parent {
                // Any ancestor is right, so a value that another thread has stored may be lost.
                self.parents[element as usize].store(above, Relaxed);
            }
            element = above;
        }
    }

    /// Joins the sets of two elements; returns whether they were different.
    fn join(&self, one: u32, other: u32) -> bool {
        let (mut one, mut other) = (one, other);
        loop {
            (one, other) = (self.root(one), self.root(other));
            if one == other {
                return false;
            }
            let (low, high) = (one.min(other), one.max(other));
            // Fails if another thread has joined `high` meanwhile.
            if self.parents[high as usize].compare_exchange(high, low, Relaxed, Relaxed).is_ok() {
                return true;
            }
        }
    }
}

/// Gives each empty part a tet of the currently largest part (the lowest on ties): the tet with the
/// fewest neighbours there (the lowest on ties). Returns the number of empty parts.
///
/// There must be at least as many tets as parts.
pub fn fill_empty_parts(dual: &Dual, part: &mut [Rank], parts: u32) -> usize {
    let sizes = sizes(part, parts);
    let empty: Vec<Rank> = (0..parts).filter(|&p| sizes[p as usize] == 0).collect();
    if empty.is_empty() {
        return 0;
    }
    let mut tets_of = vec![Vec::new(); parts as usize];
    (0u32..).zip(&*part).for_each(|(tet, &p)| tets_of[p as usize].push(tet));
    let mut by_size: BinaryHeap<_> = (0..parts).map(|p| (sizes[p as usize], Reverse(p))).collect();
    for &to in &empty {
        let (size, Reverse(from)) = by_size.pop().expect("there are parts");
        assert!(size > 1, "{} tets cannot fill {parts} parts", part.len());
        let tets = &mut tets_of[from as usize];
        let beside = |tet: u32| dual.of(tet as usize).iter().filter(|&&o| part[o as usize] == from).count();
        let loosest =
            (0..tets.len()).min_by_key(|&i| (beside(tets[i]), tets[i])).expect("a part of two or more");
        part[tets.swap_remove(loosest) as usize] = to;
        by_size.push((size - 1, Reverse(from)));
    }
    empty.len()
}
