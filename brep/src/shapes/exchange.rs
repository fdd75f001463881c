//! Edges whose vertices are in the wrong order.
//!
//! Some programs (FreeCAD 0.19) write them: both loops that use such an edge are broken there, and
//! closed as soon as its vertices are exchanged. Its curve still has the right direction, so an arc
//! of a circle is the other one between them.

use super::{Edges, Shapes};
use std::collections::BTreeSet;

impl Shapes {
    /// Exchanges the vertices of edges where only that closes all their loops. Returns a note.
    pub fn exchange_vertices(&mut self) -> Option<String> {
        let is_broken = |edges: &Edges| !self.is_closed(edges);
        let first = self.faces.iter().find(|face| face.loops.iter().any(is_broken))?.id;
        let wrong = self.wrong_order();
        self.exchange(&wrong);
        let has_wrong = |edges: &&Edges| edges.iter().any(|edge| wrong.contains(&edge.0));
        let mut beside = self.faces.iter().flat_map(|face| &face.loops).filter(has_wrong);
        if !beside.all(|edges| self.is_closed(edges)) {
            self.exchange(&wrong);
            return None;
        }
        let edges = match wrong.len() {
            0 => return None,
            1 => "an edge has its".to_owned(),
            count => format!("{count} edges have their"),
        };
        Some(format!("{edges} vertices in the wrong order, the first in face #{first}: they are exchanged"))
    }

    /// The corners at the start and the end of an edge of a loop.
    fn way(&self, (curve, is_forward): (usize, bool)) -> [usize; 2] {
        let [start, end] = self.curves[curve].ends;
        if is_forward { [start, end] } else { [end, start] }
    }

    fn is_closed(&self, edges: &Edges) -> bool {
        let next = edges.iter().cycle().skip(1);
        edges.iter().zip(next).all(|(&one, &next)| self.way(one)[1] == self.way(next)[0])
    }

    /// The curves whose ends must be exchanged to close the broken loops.
    fn wrong_order(&self) -> BTreeSet<usize> {
        let mut wrong = BTreeSet::new();
        let mut open = Vec::new();
        for edges in self.faces.iter().flat_map(|face| &face.loops).filter(|edges| !self.is_closed(edges)) {
            let mut starts = self.curves[edges[0].0].ends.to_vec();
            starts.dedup();
            let mut ways: Vec<_> =
                starts.into_iter().filter_map(|start| self.closing(edges, start)).collect();
            match ways.len() {
                1 => wrong.append(&mut ways[0]),
                _ => open.push(ways),
            }
        }
        // Of two edges between the same vertices either may be wrong: it is, if it is elsewhere.
        for ways in open {
            let known = ways.into_iter().find(|way| way.is_subset(&wrong));
            wrong.extend(known.into_iter().flatten());
        }
        wrong
    }

    /// The curves to exchange so that a loop leads from a corner back to it; `None` if it cannot.
    fn closing(&self, edges: &Edges, start: usize) -> Option<BTreeSet<usize>> {
        let mut wrong = BTreeSet::new();
        let mut at = start;
        for &edge in edges {
            let [from, to] = self.way(edge);
            if at == from {
                at = to;
            } else if at == to {
                wrong.insert(edge.0);
                at = from;
            } else {
                return None;
            }
        }
        (at == start).then_some(wrong)
    }

    /// Exchanges the ends of curves; a periodic one takes the other way between them.
    fn exchange(&mut self, wrong: &BTreeSet<usize>) {
        for &curve in wrong {
            let edge = &mut self.curves[curve];
            if let (Some(period), [low, high]) = (edge.curve.period(), edge.range) {
                edge.range = [high, low + period];
                edge.ends.reverse();
                continue;
            }
            // The ends of the others determine their direction.
            let uses = self.faces.iter_mut().flat_map(|face| face.loops.iter_mut().flatten());
            uses.filter(|edge| edge.0 == curve).for_each(|edge| edge.1 = !edge.1);
        }
    }
}
