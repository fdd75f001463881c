//! Tied tets, which belong in one part: those of an interface between bodies if balance allows,
//! those of a periodic face and its copy always.
//!
//! Tied tets form **clusters**, which the partitioner sees as one vertex with their total weight.
//! Periodic faces need more: a solver that eliminates the nodes of a periodic copy (Elmer's
//! `SetPeriodicBoundariesPass1` in `fem/src/SolverUtils.F90`) does so part by part, with the
//! boundary elements of the part. A part with a node of a periodic face but no face at that node
//! keeps matrix rows that no part eliminates. So a tet that touches a periodic face only in a
//! vertex or edge goes to a part that has a periodic face at that vertex or edge.

use super::contract::{WeightedDual, contract};
use super::dual::Dual;
use super::weighted::Graph;
use crate::ground::kernel::random::mix;
use crate::ground::mesh::Rank;
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet, VecDeque};

/// A vertex or edge of a periodic face.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Touched {
    /// The tets that have a periodic face with this vertex or edge, on one side of one
    /// identification.
    pub with_face: Vec<u32>,
    /// All tets with this vertex or edge.
    pub all: Vec<u32>,
}

/// Ties between the tets of a mesh.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Ties {
    /// Pairs of tets that must be in one part: those of a periodic face and of its copy.
    pub pairs: Vec<[u32; 2]>,
    /// Constraints on the tets around periodic faces: each tet of `all` is in a part with a tet of
    /// `with_face`.
    pub touched: Vec<Touched>,
}

/// The maximum size of an interface cluster as a fraction of a part, for balance. A body one tet
/// thick would otherwise be a single cluster.
const MOST: f64 = 0.05;

/// Sets of tets that go to the same part.
pub(super) struct Clusters {
    /// For each tet its cluster, numbered by first tets.
    pub of: Vec<u32>,
    /// The tets of each cluster of more than one.
    tets: BTreeMap<u32, Vec<u32>>,
    count: usize,
}

impl Clusters {
    /// Joins tied tets always, and those of an interface until a cluster is too large. `None` if
    /// nothing is tied.
    pub fn new(tets: usize, ties: &Ties, beside_interfaces: &[[u32; 2]], parts: u32) -> Option<Self> {
        if ties.pairs.is_empty() && beside_interfaces.is_empty() {
            return None;
        }
        let mut sets = Sets::new(tets);
        ties.pairs.iter().for_each(|pair| sets.join(*pair, u32::MAX));
        let most = (MOST * tets as f64 / f64::from(parts)).max(2.0) as u32;
        beside_interfaces.iter().for_each(|pair| sets.join(*pair, most));
        let mut number = vec![u32::MAX; tets];
        let mut count = 0;
        let mut of = Vec::with_capacity(tets);
        let mut members: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for tet in 0..tets as u32 {
            let root = sets.root(tet);
            if number[root as usize] == u32::MAX {
                number[root as usize] = count;
                count += 1;
            }
            let cluster = number[root as usize];
            of.push(cluster);
            if sets.size[root as usize] > 1 {
                members.entry(cluster).or_default().push(tet);
            }
        }
        Some(Self { of, tets: members, count: count as usize })
    }

    /// The graph of the clusters, weighted by numbers (or weights) of tets and by numbers of faces
    /// between them.
    pub fn graph(&self, dual: &Dual, of_tets: Option<&[i32]>) -> Graph {
        match of_tets {
            None => contract(dual, &self.of, self.count),
            Some(weights) => contract(&WeightedDual { dual, weights }, &self.of, self.count),
        }
    }

    /// All tets of the cluster of a tet.
    fn around(&self, tet: u32) -> Vec<u32> {
        self.tets.get(&self.of[tet as usize]).cloned().unwrap_or_else(|| vec![tet])
    }

    /// Gives each cluster the part of most of its tets, the lowest on ties.
    pub fn gather(&self, part: &mut [Rank]) {
        for tets in self.tets.values() {
            let to = most_frequent(tets.iter().map(|&tet| part[tet as usize])).expect("a cluster has tets");
            tets.iter().for_each(|&tet| part[tet as usize] = to);
        }
    }
}

/// Disjoint sets of tets.
struct Sets {
    parent: Vec<u32>,
    size: Vec<u32>,
}

impl Sets {
    fn new(count: usize) -> Self {
        Self { parent: (0..count as u32).collect(), size: vec![1; count] }
    }

    fn root(&mut self, mut item: u32) -> u32 {
        while self.parent[item as usize] != item {
            self.parent[item as usize] = self.parent[self.parent[item as usize] as usize];
            item = self.parent[item as usize];
        }
        item
    }

    /// Joins two sets unless the union would have more than `most` items.
    fn join(&mut self, [a, b]: [u32; 2], most: u32) {
        let [a, b] = [self.root(a), self.root(b)];
        let size = self.size[a as usize] + self.size[b as usize];
        if a != b && size <= most {
            self.parent[a.max(b) as usize] = a.min(b);
            self.size[a.min(b) as usize] = size;
        }
    }
}

/// The most frequent item, the lowest on ties.
fn most_frequent(items: impl Iterator<Item = Rank>) -> Option<Rank> {
    let mut counts: BTreeMap<Rank, usize> = BTreeMap::new();
    items.for_each(|item| *counts.entry(item).or_default() += 1);
    counts.into_iter().max_by_key(|&(item, count)| (count, Reverse(item))).map(|(item, _)| item)
}

/// The tets around periodic faces, with their constraints.
struct Around<'a> {
    ties: &'a Ties,
    /// For each tet the vertices and edges that it touches.
    of_tet: BTreeMap<u32, Vec<u32>>,
}

impl<'a> Around<'a> {
    fn new(ties: &'a Ties) -> Self {
        let mut of_tet: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for (index, touched) in (0..).zip(&ties.touched) {
            touched.all.iter().for_each(|&tet| of_tet.entry(tet).or_default().push(index));
        }
        Self { ties, of_tet }
    }

    /// The vertices and edges of periodic faces that a tet touches.
    fn touched_by(&self, tet: u32) -> impl Iterator<Item = &'a Touched> + '_ {
        self.of_tet.get(&tet).into_iter().flatten().map(|&touched| &self.ties.touched[touched as usize])
    }

    /// The number of vertices and edges of periodic faces at which a tet's part has no face.
    fn conflicts_of(&self, tet: u32, part: &[Rank]) -> usize {
        let here = part[tet as usize];
        let alone = |touched: &&Touched| !touched.with_face.iter().any(|&with| part[with as usize] == here);
        self.touched_by(tet).filter(alone).count()
    }

    /// The total conflicts of some tets.
    fn conflicts(&self, tets: &[u32], part: &[Rank]) -> usize {
        tets.iter().map(|&tet| self.conflicts_of(tet, part)).sum()
    }

    /// All tets whose conflicts depend on the parts of the given ones.
    fn beside(&self, tets: &[u32]) -> Vec<u32> {
        let touched = tets.iter().flat_map(|&tet| self.touched_by(tet));
        let mut beside: Vec<u32> = touched.flat_map(|touched| touched.all.iter().copied()).collect();
        beside.sort_unstable();
        beside.dedup();
        beside
    }
}

/// The number of violated ties: tets at a periodic face whose part has no face there, or whose tied
/// partner is in another part.
pub(super) fn lost(ties: &Ties, part: &[Rank]) -> usize {
    let around = Around::new(ties);
    let alone = around.of_tet.keys().filter(|&&tet| around.conflicts_of(tet, part) > 0).count();
    alone + ties.pairs.iter().filter(|[a, b]| part[*a as usize] != part[*b as usize]).count()
}

/// The maximum number of moves per tet that touches a periodic face.
const MOVES: usize = 40;
/// The number of moves for which a moved cluster is not moved again (unless nothing else is left),
/// to avoid cycles.
const RESTS: u64 = 12;

/// Moves clusters until each tet that touches a periodic face is in a part with a face there.
/// Clusters move one after another, each to the neighbouring part with the fewest remaining
/// conflicts, the smaller part on ties (the min-conflicts heuristic of Minton and others 1992, with
/// a tabu list). If conflicts remain, everything that touches periodic faces goes to one part,
/// which is correct but unbalanced.
pub(super) fn settle_around(dual: &Dual, clusters: &Clusters, ties: &Ties, parts: u32, part: &mut [Rank]) {
    let around = Around::new(ties);
    let all: Vec<u32> = around.of_tet.keys().copied().collect();
    let mut search =
        Search { dual, clusters, around: &around, sizes: vec![0; parts as usize], moved: BTreeMap::new() };
    part.iter().for_each(|&rank| search.sizes[rank as usize] += 1);
    let mut open: VecDeque<u32> =
        all.iter().copied().filter(|&tet| around.conflicts_of(tet, part) > 0).collect();
    let mut waits: BTreeSet<u32> = open.iter().copied().collect();
    let mut turn = 0;
    while let Some(tet) = open.pop_front().filter(|_| turn < (MOVES * all.len()) as u64) {
        waits.remove(&tet);
        if around.conflicts_of(tet, part) == 0 {
            continue;
        }
        turn += 1;
        let changed = search.improve(tet, turn, part);
        open.extend(
            changed.into_iter().filter(|&tet| around.conflicts_of(tet, part) > 0 && waits.insert(tet)),
        );
    }
    if around.conflicts(&all, part) > 0 {
        let to = most_frequent(all.iter().map(|&tet| part[tet as usize])).expect("some touch periodic faces");
        all.iter().for_each(|&tet| clusters.around(tet).iter().for_each(|&tet| part[tet as usize] = to));
    }
}

/// The state of [`settle_around`].
struct Search<'a> {
    dual: &'a Dual,
    clusters: &'a Clusters,
    around: &'a Around<'a>,
    /// Tets in each part.
    sizes: Vec<usize>,
    /// The number of tets in each part.
    moved: BTreeMap<u32, u64>,
}

impl Search<'_> {
    /// Makes the best move for a tet with conflicts: of its own cluster, or of one that has a face
    /// where it has none. Returns the tets whose conflicts may have changed.
    fn improve(&mut self, tet: u32, turn: u64, part: &mut [Rank]) -> Vec<u32> {
        let here = part[tet as usize];
        let missing = self
            .around
            .touched_by(tet)
            .filter(|touched| !touched.with_face.iter().any(|&with| part[with as usize] == here));
        let with_face: Vec<u32> = missing.flat_map(|touched| touched.with_face.iter().copied()).collect();
        let there = with_face.iter().map(|&with| (tet, part[with as usize]));
        let follow = with_face.iter().map(|&with| (with, here));
        let mut moves: Vec<(u32, Rank)> =
            there.chain(follow).map(|(tet, to)| (self.clusters.of[tet as usize], to)).collect();
        moves.sort_unstable();
        moves.dedup();
        let firsts: BTreeMap<u32, u32> =
            with_face.iter().chain([&tet]).map(|&tet| (self.clusters.of[tet as usize], tet)).collect();
        let judged = moves.into_iter().map(|(cluster, to)| {
            let tets = self.clusters.around(firsts[&cluster]);
            let rests = self.moved.get(&cluster).is_some_and(|&last| last + RESTS > turn);
            let (conflicts, cut) = self.judge(&tets, to, part);
            (
                (rests, conflicts, cut, self.sizes[to as usize], mix(turn ^ u64::from(cluster) << 32)),
                cluster,
                to,
                tets,
            )
        });
        let Some((_, cluster, to, tets)) = judged.min_by_key(|(key, ..)| *key) else { return vec![tet] };
        for &tet in &tets {
            self.sizes[part[tet as usize] as usize] -= 1;
            self.sizes[to as usize] += 1;
            part[tet as usize] = to;
        }
        self.moved.insert(cluster, turn);
        self.around.beside(&tets)
    }

    /// The increase of conflicts and of the cut if these tets move.
    fn judge(&self, tets: &[u32], to: Rank, part: &mut [Rank]) -> (i64, i64) {
        let beside = self.around.beside(tets);
        let cut = |part: &[Rank]| {
            let of = |&tet: &u32| {
                self.dual
                    .of(tet as usize)
                    .iter()
                    .filter(|&&other| part[other as usize] != part[tet as usize])
                    .count()
            };
            tets.iter().map(of).sum::<usize>() as i64
        };
        let measure = |part: &[Rank]| (self.around.conflicts(&beside, part) as i64, cut(part));
        let before = measure(part);
        let old: Vec<Rank> = tets.iter().map(|&tet| part[tet as usize]).collect();
        tets.iter().for_each(|&tet| part[tet as usize] = to);
        let after = measure(part);
        tets.iter().zip(old).for_each(|(&tet, rank)| part[tet as usize] = rank);
        (after.0 - before.0, after.1 - before.1)
    }
}
