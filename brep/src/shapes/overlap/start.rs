//! Where closed branches start.
//!
//! Their start becomes a vertex. Edges of a face are divided at vertices that are as close to them
//! as they are to their faces, so it must be away from edges; and two branches around a surface
//! start beside each other, because seams connect vertices, and what is between may be narrow.

use super::super::Shapes;
use super::trace::{Branch, Pair};
use crate::nearest::{nearest_on_curve, nearest_on_surface};
use std::collections::BTreeSet;

/// So many places of a branch are compared.
const PLACES: usize = 24;
/// A start is this far from edges (in tolerances).
const AWAY: f64 = 10.0;

impl Shapes {
    /// Moves the start of a closed branch: on a surface that it goes around to beside a vertex of
    /// the face, else away from edges.
    pub(super) fn move_start(&self, pair: &Pair, branch: &mut Branch, faces: [usize; 2], room: f64) {
        if !branch.is_closed {
            return;
        }
        // Seams are left out when the faces are divided.
        let edges: BTreeSet<usize> = faces.into_iter().flat_map(|face| self.curves_used_once(face)).collect();
        let clearance = |branch: &Branch, k: usize| {
            let place = &branch.points[k].point;
            let away =
                |edge: &usize| (nearest_on_curve(&self.curves[*edge].curve, place).point - place).norm();
            edges.iter().map(away).fold(f64::INFINITY, f64::min)
        };
        if let Some((which, direction)) = pair.surrounded(branch) {
            let face = &self.faces[faces[which]];
            let vertex = face.loops.iter().flatten().next().map(|edge| self.curves[edge.0].ends[0]);
            let at = vertex.map_or(0.0, |corner| {
                let point = self.corners[corner].point;
                nearest_on_surface(&face.surface, &point).parameters[direction]
            });
            if pair.start_at(branch, which, direction, at) && clearance(branch, 0) > AWAY * room {
                return;
            }
        }
        let count = branch.points.len() - 1;
        let places = (0..count).step_by(count.div_ceil(PLACES));
        let best = places.max_by(|&a, &b| clearance(branch, a).total_cmp(&clearance(branch, b)));
        branch.rotate(best.unwrap_or(0));
    }
}
