//! Quality of a partition, and the repair of empty parts.

use super::Method;
use super::dual::Dual;
use crate::ground::mesh::Rank;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

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

/// Measures a partition.
pub fn measure(dual: &Dual, part: &[Rank], parts: u32, method: Option<Method>, repaired: usize) -> Metrics {
    let sizes = sizes(part, parts);
    let cut = |tet: usize| dual.of(tet).iter().filter(|&&other| part[other as usize] != part[tet]).count();
    let largest = sizes.iter().copied().max().unwrap_or(0);
    Metrics {
        method,
        parts,
        smallest: sizes.iter().copied().min().unwrap_or(0),
        largest,
        imbalance: largest as f64 * f64::from(parts) / part.len().max(1) as f64,
        edge_cut: (0..part.len()).map(cut).sum::<usize>() / 2,
        pieces: pieces(dual, part),
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

/// The number of sets of tets that are connected by faces within one part.
fn pieces(dual: &Dual, part: &[Rank]) -> usize {
    let mut seen = vec![false; part.len()];
    let mut to_visit = Vec::new();
    let mut count = 0;
    for start in 0..part.len() {
        if seen[start] {
            continue;
        }
        count += 1;
        seen[start] = true;
        to_visit.push(start);
        while let Some(tet) = to_visit.pop() {
            for other in dual.of(tet).iter().map(|&other| other as usize) {
                if part[other] == part[tet] && !seen[other] {
                    seen[other] = true;
                    to_visit.push(other);
                }
            }
        }
    }
    count
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
