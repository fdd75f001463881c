//! Spurs: narrow parts of wide faces that end in a short edge.
//!
//! Where two plane faces differ by a little, as extrusions that should end at one height, the riser
//! between them may be part of a larger face. Elements in it would be as small as it is high. So it
//! is cut off where the face becomes wider, and merged as a narrow face of its own.

use super::group::Allowed;
use super::layout::Layout;
use super::strips::{Division, Rest};
use super::tips::{Candidate, Part, overlap, parts};
use crate::ground::size::UniformSize;
use crate::mesher::facets::sharp_places::angles;
use brep::{On, Piece};
use std::f64::consts::PI;

/// The edges on both sides of a spur are at least this many times as long as its end.
const LONGER: f64 = 20.0;

/// A spur is cut off where it becomes this many times as wide as its end.
const WIDER: f64 = 2.0;

/// The sum of the angles at its end differs from that of parallel sides by at most this (radians).
const PARALLEL: f64 = 0.35;

/// A spur is as long as a tip must be beside elements of the larger of these sizes: this share of
/// its shorter side, ...
const SHARE: f64 = 0.25;
/// ... and so many times its width.
const LONG: f64 = 25.0;

/// Faces with spurs that end in edges that may be merged, unless they are narrow altogether or
/// along faces that are `divided`.
pub(super) fn spurs(layout: &Layout, allowed: &Allowed, divided: &[Division]) -> Vec<Division> {
    if !allowed.edges.contains(&true) {
        return Vec::new();
    }
    let triangles = layout.tessellation.triangles.iter().map(|t| (t.vertices, t.patch));
    let corners = layout.model.corners.len();
    let angles = angles(&layout.tessellation.points, triangles, |v| (v as usize) < corners);
    let angle = |corner: usize, face: usize| angles.get(&(corner as u32, face as u32)).copied();
    let mut taken: Vec<Vec<Part>> =
        divided.iter().flat_map(|face| &face.pieces).map(|piece| parts(layout.model, piece)).collect();
    let mut found = Vec::new();
    for face in (0..allowed.faces.len()).filter(|&face| !allowed.faces[face]) {
        let mut pieces = Vec::new();
        for (of_loop, fins) in layout.model.patches[face].loops.iter().enumerate() {
            for (end, fin) in fins.iter().enumerate() {
                let On::Curve(edge) = fin.on else { continue };
                let ends = layout.model.curves[edge].ends.map(|corner| angle(corner, face));
                let [Some(a), Some(b)] = ends else { continue };
                if !allowed.edges[edge] || (a + b - PI).abs() >= PARALLEL {
                    continue;
                }
                let Some(spur) = spur(layout, face, of_loop, end) else { continue };
                let own = parts(layout.model, &spur);
                if taken.iter().all(|other| !overlap(&own, other)) {
                    taken.push(own);
                    pieces.push(spur);
                }
            }
        }
        if !pieces.is_empty() {
            found.push(Division { face, pieces, along: Vec::new(), rest: Rest::Kept });
        }
    }
    found
}

/// The spur of a face with this end, a side of a loop.
fn spur(layout: &Layout, face: usize, of_loop: usize, end: usize) -> Option<Piece> {
    let fins = &layout.model.patches[face].loops[of_loop];
    let sides = [end + fins.len() - 1, end + 1].map(|side| side % fins.len());
    if sides[0] == sides[1] {
        return None;
    }
    let [one, other] = sides.map(|side| layout.beyond(face, &fins[side]));
    let shorter = layout.lengths[one?.0].min(layout.lengths[other?.0]);
    let (end, _) = layout.beyond(face, &fins[end])?;
    let width = layout.lengths[end];
    if shorter < LONGER * width {
        return None;
    }
    let corner = layout.model.curves[end].ends[0];
    let tip = Piece { patch: face, of_loop, sides, at: [None; 2] };
    let size = UniformSize((LONG * width).max(SHARE * shorter));
    let narrow = Candidate::of(tip, corner).narrow(layout, &size, [size.0 / (WIDER * width); 2], 0)?;
    Some(narrow.tip)
}
