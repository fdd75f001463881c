//! The loops of a patch as constraints of its triangulation.

use super::Tessellation;
use super::chain::Sides;
use super::face::{Face, Failure, is_finite, sorted};
use super::frame::Node;
use crate::BrepError;
use spade::handles::FixedVertexHandle;
use spade::{Point2, Triangulation};

/// Nodes of one vertex are at one place if they are this close, compared with the nodes beside them
/// ...
const TOGETHER: f64 = 1e-3;
/// ... and no further apart than this (fraction of the diagonal).
const FARTHEST: f64 = 1e-5;

/// Sides are curved outward by this fraction of their length. Otherwise rounding makes straight
/// ones concave, and triangles without height remain between their points.
const BULGE: f64 = 1e-6;

impl Face<'_> {
    fn crossing(&self, vertex: u32, out: &Tessellation) -> Failure {
        let place = out.points.get(vertex as usize).copied();
        let what = "its loops cross or touch in the parameters of its surface";
        Failure::Crossing(BrepError::face(self.number, what, place))
    }

    /// A node of a loop, or the one that was added before for the same vertex, where loops touch
    /// there: the ends of several curves at a vertex differ by tolerances.
    fn at_known_place(&mut self, nodes: &[Node], k: usize) -> Node {
        let node = nodes[k];
        let away = |other: &Node| (other.scaled.x - node.scaled.x).hypot(other.scaled.y - node.scaled.y);
        let [before, after] = [nodes.len() - 1, 1].map(|step| away(&nodes[(k + step) % nodes.len()]));
        let near = (TOGETHER * before.min(after)).min(FARTHEST * self.tolerances.diagonal);
        let known = self.known.entry(node.vertex).or_default();
        if let Some(place) = known.iter().find(|place| away(place) <= near) {
            return *place;
        }
        known.push(node);
        node
    }

    /// Adds a loop as constraints.
    ///
    /// # Errors
    /// [`Failure::Crossing`] if it crosses itself or one that was added before.
    pub fn add_chain(&mut self, sides: &Sides, turn: f64, out: &Tessellation) -> Result<(), Failure> {
        let mut handles: Vec<FixedVertexHandle> = Vec::new();
        let mut nodes = Vec::new();
        for (k, side) in sides.iter().enumerate() {
            let end = self.frame.scaled(sides[(k + 1) % sides.len()][0].0);
            let start = self.frame.scaled(side[0].0);
            let (x, y) = (turn * (end.x - start.x), turn * (end.y - start.y));
            let squared = (x * x + y * y).max(f64::MIN_POSITIVE);
            for &(parameters, vertex) in side {
                let p = self.frame.scaled(parameters);
                let share = turn * ((p.x - start.x) * x + (p.y - start.y) * y) / squared;
                let out = BULGE * 4.0 * (share * (1.0 - share)).max(0.0);
                nodes.push(Node { scaled: Point2::new(p.x + out * y, p.y - out * x), parameters, vertex });
            }
        }
        for k in 0..nodes.len() {
            let node = self.at_known_place(&nodes, k);
            let vertex = node.vertex;
            if !is_finite(&node.scaled) {
                let place = out.points.get(vertex as usize).copied();
                let what = "its edges have no finite place in the parameters of its surface";
                return Err(Failure::Final(BrepError::face(self.number, what, place)));
            }
            let count = self.plane.num_vertices();
            let before = self.plane.locate_vertex(node.scaled).map(|old| old.data().vertex);
            let handle = self.plane.insert(node).map_err(|_| self.crossing(vertex, out))?;
            if self.plane.num_vertices() == count && before != Some(vertex) {
                return Err(self.crossing(vertex, out));
            }
            handles.push(handle);
        }
        for k in 0..handles.len() {
            let (a, b) = (handles[k], handles[(k + 1) % handles.len()]);
            if a == b {
                continue;
            }
            if !self.plane.can_add_constraint(a, b) {
                return Err(self.crossing(nodes[k].vertex, out));
            }
            self.plane.add_constraint(a, b);
            if self.plane.get_edge_from_neighbors(a, b).is_none_or(|edge| !edge.is_constraint_edge()) {
                return Err(self.crossing(nodes[k].vertex, out));
            }
            *self.sides.entry(sorted(a.index(), b.index())).or_default() += 1;
        }
        Ok(())
    }
}
