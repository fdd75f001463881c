//! Edges that were divided where they turned out not to meet another one, in one piece again.

use super::super::{Edges, Shapes};
use std::collections::HashMap;

impl Shapes {
    /// Joins the two parts of edges that were divided at corners from `first` on, if nothing else
    /// ends there.
    pub(super) fn rejoin(&mut self, first: usize) {
        let mut at: HashMap<usize, Vec<usize>> = HashMap::new();
        let mut used: Vec<usize> =
            self.faces.iter().flat_map(|face| face.loops.iter().flatten().map(|edge| edge.0)).collect();
        used.sort_unstable();
        used.dedup();
        for curve in used {
            for end in self.curves[curve].ends.into_iter().filter(|end| *end >= first) {
                at.entry(end).or_default().push(curve);
            }
        }
        let mut corners: Vec<usize> = at.keys().copied().collect();
        corners.sort_unstable();
        for corner in corners {
            let [a, b] = at[&corner][..] else { continue };
            let (before, after) = if self.curves[a].ends[1] == corner { (a, b) } else { (b, a) };
            if before == after || !self.are_parts([before, after], corner) {
                continue;
            }
            let [_, end] = self.curves[after].ends;
            self.curves[before].ends[1] = end;
            self.curves[before].range[1] = self.curves[after].range[1];
            self.curves[before].tolerance = self.curves[before].tolerance.max(self.curves[after].tolerance);
            for edges in self.faces.iter_mut().flat_map(|face| &mut face.loops) {
                edges.retain(|edge| edge.0 != after);
            }
            if let Some(there) = at.get_mut(&end) {
                there.iter_mut().filter(|curve| **curve == after).for_each(|curve| *curve = before);
            }
        }
    }

    /// Whether two edges are parts of one curve before and after a corner that all loops follow
    /// together.
    fn are_parts(&self, [before, after]: [usize; 2], corner: usize) -> bool {
        let [one, other] = [before, after].map(|curve| &self.curves[curve]);
        let follow = |edges: &Edges| {
            let count = |curve: usize| edges.iter().filter(|edge| edge.0 == curve).count();
            count(before) == count(after)
        };
        one.ends[1] == corner
            && other.ends[0] == corner
            && one.range[1] == other.range[0]
            && one.curve == other.curve
            && self.faces.iter().flat_map(|face| &face.loops).all(follow)
    }
}
