//! Fewer edges between the parts of a graph, by moves of single vertices.
//!
//! Vertices move one after another, those that lower the cut most first, and each once in a pass. A
//! pass goes on for a while where moves raise the cut, because later ones may lower it more, and at
//! last returns to the best partition met (Fiduccia and Mattheyses 1982; between many parts as in
//! Karypis and Kumar 1998, "Multilevel k-way partitioning scheme for irregular graphs").

use super::contract::Adjacency;
use crate::ground::kernel::random::mix;
use crate::ground::mesh::Rank;
use rayon::prelude::*;
use std::collections::BinaryHeap;

/// Passes end when one lowers the cut by less than this part of it.
const LITTLE: f64 = 0.002;

/// The most passes.
const PASSES: usize = 8;

/// A pass ends after this many moves without a better partition, and one more for each
/// [`MORE`] vertices at the cut.
const PATIENCE: usize = 100;

/// See [`PATIENCE`].
const MORE: usize = 50;

/// A possible move of a vertex; the largest is tried first. Equal gains are in random order, which
/// prefers no direction.
type Wish = (i64, u64, u32);

/// Lowers the cut of a partition into parts none of which shall weigh more than `most`; those that
/// do lose vertices first, whatever that costs.
pub(super) fn refine(graph: &impl Adjacency, part: &mut [Rank], parts: u32, most: i64) {
    let mut weights = vec![0; parts as usize];
    (0..).zip(&*part).for_each(|(vertex, &p)| weights[p as usize] += graph.weight(vertex));
    let mut state = State { graph, part, weights, most, beside: Vec::new() };
    state.relieve();
    let mut moved = vec![false; graph.len()];
    for _ in 0..PASSES {
        let at_cut = state.at_cut();
        let cut = state.cut(&at_cut);
        let gained = state.pass(&at_cut, &mut moved);
        if (gained as f64) < LITTLE * cut as f64 {
            break;
        }
    }
}

struct State<'a, A> {
    graph: &'a A,
    part: &'a mut [Rank],
    /// The weight of each part.
    weights: Vec<i64>,
    most: i64,
    /// The weights of edges from a vertex to parts; scratch memory.
    beside: Vec<(Rank, i64)>,
}

impl<A: Adjacency> State<'_, A> {
    fn is_at_cut(&self, vertex: u32) -> bool {
        let own = self.part[vertex as usize];
        self.graph.edges(vertex).any(|(other, _)| self.part[other as usize] != own)
    }

    /// The vertices with neighbours in other parts.
    fn at_cut(&self) -> Vec<u32>
    where
        Self: Sync,
    {
        (0..self.part.len() as u32).into_par_iter().filter(|&vertex| self.is_at_cut(vertex)).collect()
    }

    /// The weight of all edges between parts.
    fn cut(&self, at_cut: &[u32]) -> i64 {
        let of = |&vertex: &u32| {
            let own = self.part[vertex as usize];
            let edges = self.graph.edges(vertex).filter(|(other, _)| self.part[*other as usize] != own);
            edges.map(|(_, weight)| weight).sum::<i64>()
        };
        at_cut.iter().map(of).sum::<i64>() / 2
    }

    /// The part to which a vertex moves with the largest gain, of those that `has_room`; the
    /// lightest on ties.
    fn best_move(&mut self, vertex: u32, has_room: impl Fn(i64) -> bool) -> Option<(i64, Rank)> {
        let own = self.part[vertex as usize];
        let mut inside = 0;
        self.beside.clear();
        for (other, weight) in self.graph.edges(vertex) {
            let there = self.part[other as usize];
            if there == own {
                inside += weight;
            } else if let Some((_, sum)) = self.beside.iter_mut().find(|(known, _)| *known == there) {
                *sum += weight;
            } else {
                self.beside.push((there, weight));
            }
        }
        let open = self.beside.iter().filter(|(to, _)| has_room(self.weights[*to as usize]));
        let best =
            open.max_by_key(|&&(to, weight)| (weight, std::cmp::Reverse((self.weights[to as usize], to))));
        best.map(|&(to, weight)| (weight - inside, to))
    }

    fn wish(&mut self, vertex: u32) -> Option<(Wish, Rank)> {
        let room = self.most - self.graph.weight(vertex);
        let (gain, to) = self.best_move(vertex, |weight| weight <= room)?;
        Some(((gain, mix(vertex.into()), vertex), to))
    }

    fn shift(&mut self, vertex: u32, to: Rank) -> Rank {
        let from = std::mem::replace(&mut self.part[vertex as usize], to);
        let weight = self.graph.weight(vertex);
        self.weights[from as usize] -= weight;
        self.weights[to as usize] += weight;
        from
    }

    /// One pass; `moved` is false for all vertices, before and afterwards. Returns by how much the
    /// cut fell.
    fn pass(&mut self, at_cut: &[u32], moved: &mut [bool]) -> i64 {
        let mut wishes: BinaryHeap<Wish> = BinaryHeap::with_capacity(2 * at_cut.len());
        wishes.extend(at_cut.iter().filter_map(|&vertex| self.wish(vertex)).map(|(wish, _)| wish));
        let patience = PATIENCE + at_cut.len() / MORE;
        let mut moves: Vec<(u32, Rank)> = Vec::new();
        let (mut gained, mut best, mut kept) = (0, 0, 0);
        while let Some(wish) = wishes.pop() {
            let vertex = wish.2;
            if moved[vertex as usize] {
                continue;
            }
            let Some((now, to)) = self.wish(vertex) else { continue };
            if now < wish {
                wishes.push(now);
                continue;
            }
            moves.push((vertex, self.shift(vertex, to)));
            moved[vertex as usize] = true;
            gained += now.0;
            if gained > best {
                (best, kept) = (gained, moves.len());
            } else if moves.len() - kept > patience {
                break;
            }
            for (other, _) in self.graph.edges(vertex) {
                if !moved[other as usize] {
                    wishes.extend(self.wish(other).map(|(wish, _)| wish));
                }
            }
        }
        moves.iter().for_each(|&(vertex, _)| moved[vertex as usize] = false);
        for &(vertex, from) in moves[kept..].iter().rev() {
            self.shift(vertex, from);
        }
        best
    }

    /// Moves vertices out of parts that are too heavy, to lighter ones beside them, with the least
    /// loss.
    fn relieve(&mut self)
    where
        Self: Sync,
    {
        while let Some(from) = (0..self.weights.len()).max_by_key(|&p| self.weights[p]) {
            let before = self.weights[from];
            if before <= self.most {
                break;
            }
            let at_cut: Vec<u32> = (0..self.part.len() as u32)
                .into_par_iter()
                .filter(|&vertex| self.part[vertex as usize] as usize == from && self.is_at_cut(vertex))
                .collect();
            let wish = |state: &mut Self, vertex: u32| {
                let weight = state.graph.weight(vertex);
                let here = state.weights[from];
                let (gain, to) = state.best_move(vertex, |there| there + weight < here)?;
                Some(((gain, mix(vertex.into()), vertex), to))
            };
            let mut wishes: BinaryHeap<Wish> =
                at_cut.iter().filter_map(|&vertex| wish(self, vertex)).map(|(wish, _)| wish).collect();
            while let Some(old) = wishes.pop().filter(|_| self.weights[from] > self.most) {
                let vertex = old.2;
                if self.part[vertex as usize] as usize != from {
                    continue;
                }
                let Some((now, to)) = wish(self, vertex) else { continue };
                if now < old {
                    wishes.push(now);
                    continue;
                }
                self.shift(vertex, to);
                for (other, _) in self.graph.edges(vertex) {
                    if self.part[other as usize] as usize == from {
                        wishes.extend(wish(self, other).map(|(wish, _)| wish));
                    }
                }
            }
            if self.weights[from] == before {
                break;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::dual::{self, Dual};
    use super::super::matched_faces;
    use super::*;
    use crate::ground::mesh::fixtures::lattice_cube;

    fn graph() -> Dual {
        dual::dual(&matched_faces(&lattice_cube(8)).unwrap())
    }

    fn cut(graph: &Dual, part: &[Rank]) -> usize {
        let across = |tet: usize| graph.of(tet).iter().filter(|&&o| part[o as usize] != part[tet]).count();
        (0..graph.len()).map(across).sum::<usize>() / 2
    }

    fn weights(part: &[Rank], parts: u32) -> Vec<usize> {
        (0..parts).map(|p| part.iter().filter(|&&q| q == p).count()).collect()
    }

    #[test]
    fn tets_in_the_wrong_part_go_back() {
        let graph = graph();
        // Six tets a cube, 64 cubes a layer: four slabs.
        let slabs: Vec<Rank> = (0..graph.len()).map(|tet| (tet / (6 * 128)) as Rank).collect();
        let wrong =
            |(tet, &p): (usize, &Rank)| if mix(tet as u64).is_multiple_of(16) { (p + 1) % 4 } else { p };
        let mut part: Vec<Rank> = slabs.iter().enumerate().map(wrong).collect();
        assert!(cut(&graph, &part) > 2 * cut(&graph, &slabs));
        refine(&graph, &mut part, 4, 780);
        assert!(cut(&graph, &part) <= cut(&graph, &slabs), "{} faces", cut(&graph, &part));
        assert!(weights(&part, 4).iter().all(|&weight| weight <= 780), "{:?}", weights(&part, 4));
    }

    #[test]
    fn heavy_parts_give_tets_to_those_beside_them_and_on_to_the_next() {
        let graph = graph();
        let ends = [2000, 2400, 2700, 3072];
        let mut part: Vec<Rank> =
            (0..graph.len()).map(|tet| ends.partition_point(|&e| e <= tet) as Rank).collect();
        refine(&graph, &mut part, 4, 775);
        assert!(weights(&part, 4).iter().all(|&weight| weight <= 775), "{:?}", weights(&part, 4));
    }

    #[test]
    fn parts_without_neighbours_stay_as_they_are() {
        // Two tets without a common face.
        let graph = Dual { offsets: vec![0, 0, 0], neighbours: vec![] };
        let mut part = vec![0, 0];
        refine(&graph, &mut part, 2, 1);
        assert_eq!(part, [0, 0]);
    }
}
