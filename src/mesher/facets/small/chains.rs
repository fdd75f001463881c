//! Composite curves: chains of edges through corners that are dropped.

use super::Layout;
use crate::Vector;

/// Corners whose curves turn by less than this are dropped (radians), as for facets.
const BENT: f64 = 0.7;

/// Edges one after the other.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Chain {
    /// The edges in order, each with whether it is used forward.
    pub edges: Vec<(usize, bool)>,
    /// The corners at both ends; `None` if it is closed and its corner was dropped.
    pub ends: Option<[usize; 2]>,
}

impl Chain {
    fn reverse(&mut self) {
        self.edges.reverse();
        self.edges.iter_mut().for_each(|edge| edge.1 = !edge.1);
        if let Some(ends) = &mut self.ends {
            ends.swap(0, 1);
        }
    }

    /// The direction in which it leaves its start: that of its first edge that is not short.
    fn start(&self, layout: &Layout, is_short: &[bool]) -> Vector {
        let long = self.edges.iter().find(|(edge, _)| !is_short[*edge]);
        let &(edge, is_forward) = long.unwrap_or(&self.edges[0]);
        layout.tangent(edge, !is_forward) * if is_forward { 1.0 } else { -1.0 }
    }

    fn is_short(&self, is_short: &[bool]) -> bool {
        self.edges.iter().all(|(edge, _)| is_short[*edge])
    }
}

/// The curves of grouped faces: `patch_of` has the patch of each face.
pub(super) fn chains(layout: &Layout, patch_of: &[usize], is_short: &[bool]) -> Vec<Chain> {
    let patches = |edge: usize| {
        let mut patches: Vec<usize> = layout.faces_of[edge].iter().map(|&face| patch_of[face]).collect();
        patches.sort_unstable();
        patches
    };
    // A curve whose faces were one before has that face on both sides and stays.
    let is_dropped =
        |&edge: &usize| matches!(layout.faces_of[edge][..], [a, b] if a != b && patch_of[a] == patch_of[b]);
    let mut may_drop = vec![false; layout.is_corner.len()];
    let mut chains: Vec<Option<Chain>> = Vec::new();
    for &edge in &layout.curves {
        let ends = layout.model.curves[edge].ends;
        let dropped = is_dropped(&edge);
        if dropped || is_short[edge] {
            ends.iter().for_each(|&end| may_drop[end] = layout.is_corner[end]);
        }
        if !dropped {
            let ends = ends.iter().all(|&end| layout.is_corner[end]).then_some(ends);
            chains.push(Some(Chain { edges: vec![(edge, true)], ends }));
        }
    }
    let mut at: Vec<Vec<usize>> = vec![Vec::new(); layout.is_corner.len()];
    for (number, chain) in chains.iter().flatten().enumerate() {
        let mut ends = chain.ends.map(Vec::from).unwrap_or_default();
        ends.dedup();
        ends.into_iter().for_each(|end| at[end].push(number));
    }
    loop {
        let mut changed = false;
        for corner in (0..may_drop.len()).filter(|&corner| may_drop[corner]) {
            changed |= drop_corner(layout, corner, &mut chains, &mut at, is_short, &patches);
        }
        if !changed {
            return chains.into_iter().flatten().collect();
        }
    }
}

/// Joins the two chains at a corner, if there are two that may be joined; `at` has the numbers of
/// the chains at each corner.
fn drop_corner(
    layout: &Layout,
    corner: usize,
    chains: &mut [Option<Chain>],
    at: &mut [Vec<usize>],
    is_short: &[bool],
    patches: &impl Fn(usize) -> Vec<usize>,
) -> bool {
    let mut ends: Vec<(usize, bool)> = Vec::new();
    for &number in &at[corner] {
        let of_chain = chains[number].as_ref().and_then(|chain| chain.ends);
        for (k, _) in of_chain.into_iter().flatten().enumerate().filter(|(_, end)| *end == corner) {
            ends.push((number, k == 1));
        }
    }
    let &[(one, one_ends), (other, other_ends)] = &ends[..] else { return false };
    let oriented = |number: usize, is_reversed: bool| {
        let mut chain = chains[number].clone().expect("a chain in use");
        if is_reversed {
            chain.reverse();
        }
        chain
    };
    // The first one leaves the corner, and the second one too.
    let (first, second) = (oriented(one, one_ends), oriented(other, other_ends));
    if patches(first.edges[0].0) != patches(second.edges[0].0) {
        return false;
    }
    let turn = first.start(layout, is_short).angle(&-second.start(layout, is_short));
    let is_tiny = first.is_short(is_short) != second.is_short(is_short);
    if one == other {
        if turn < BENT {
            chains[one] = Some(Chain { ends: None, ..first });
        }
        return turn < BENT;
    }
    if !is_tiny && turn >= BENT {
        return false;
    }
    let mut joined = first;
    joined.reverse();
    joined.edges.extend(&second.edges);
    joined.ends = joined.ends.zip(second.ends).map(|(a, b)| [a[0], b[1]]);
    let (kept, dropped) = (one.min(other), one.max(other));
    for end in joined.ends.into_iter().flatten() {
        at[end].retain(|&number| ![kept, dropped].contains(&number));
        at[end].push(kept);
        at[end].sort_unstable();
    }
    (chains[kept], chains[dropped]) = (Some(joined), None);
    true
}
