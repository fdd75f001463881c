//! Finds the curves and corners of a mesh with patches: where patches meet, and along edges in the
//! file.

use super::assemble::numbered;
use crate::files::input::counted;
use crate::ground::mesh::{Class, Mesh, Segment, VertexId};
use csg::{BodyId, CornerId, CurveId, PatchId};
use std::collections::BTreeMap;

/// The common properties of one curve's segments: label in the file, and index of the list of
/// patches that meet there.
type CurveKey = (Option<i64>, u32);

/// Finds the segments and classifies all vertices of a mesh with bodies and boundary triangles.
pub(super) fn classify(mesh: &mut Mesh, edges: &[[u32; 2]], labels: &[i64], notes: &mut Vec<String>) {
    let mut named: BTreeMap<[VertexId; 2], i64> = BTreeMap::new();
    for (edge, label) in edges.iter().zip(labels) {
        named.entry(ascending(edge.map(VertexId))).or_insert(*label);
    }
    let (segments, keys) = segments(mesh, &mut named);
    let (_, curves) = numbered(&keys);
    mesh.segments = segments
        .into_iter()
        .zip(curves)
        .map(|(vertices, curve)| Segment { vertices, curve: CurveId(curve) })
        .collect();
    if !named.is_empty() {
        notes.push(format!("{} that are not on the boundary left out", counted(named.len(), "edge")));
    }
    mesh.classes = classes(mesh);
}

fn ascending([a, b]: [VertexId; 2]) -> [VertexId; 2] {
    [a.min(b), a.max(b)]
}

/// Returns the edges on curves with their curves, and removes these edges from `named`.
fn segments(mesh: &Mesh, named: &mut BTreeMap<[VertexId; 2], i64>) -> (Vec<[VertexId; 2]>, Vec<CurveKey>) {
    let mut sides: Vec<([VertexId; 2], PatchId)> = Vec::with_capacity(3 * mesh.triangles.len());
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.vertices;
        sides.extend([[a, b], [b, c], [c, a]].map(|edge| (ascending(edge), triangle.patch)));
    }
    sides.sort_unstable();
    let mut lists: BTreeMap<Vec<PatchId>, u32> = BTreeMap::new();
    let (mut segments, mut keys) = (Vec::new(), Vec::new());
    for at_edge in sides.chunk_by(|a, b| a.0 == b.0) {
        let edge = at_edge[0].0;
        let name = named.remove(&edge);
        let one_patch = at_edge[0].1 == at_edge[at_edge.len() - 1].1;
        if name.is_none() && one_patch && at_edge.len() == 2 {
            continue;
        }
        let mut patches: Vec<PatchId> = at_edge.iter().map(|(_, patch)| *patch).collect();
        patches.dedup();
        let next = lists.len() as u32;
        keys.push((name, *lists.entry(patches).or_insert(next)));
        segments.push(edge);
    }
    (segments, keys)
}

/// Classifies vertices: on a corner unless inside one curve, one patch or one body.
fn classes(mesh: &Mesh) -> Vec<Class> {
    /// The classification of a vertex so far.
    #[derive(Clone, Copy)]
    enum On {
        Body(BodyId),
        Patch(PatchId),
        Curve(CurveId, u32),
        Corner,
    }
    let mut on = vec![On::Body(BodyId(0)); mesh.points.len()];
    for (tet, body) in mesh.tets.iter().zip(&mesh.bodies).rev() {
        tet.iter().for_each(|v| on[v.index()] = On::Body(*body));
    }
    for triangle in &mesh.triangles {
        for v in triangle.vertices {
            on[v.index()] = match on[v.index()] {
                On::Body(_) => On::Patch(triangle.patch),
                On::Patch(patch) if patch == triangle.patch => On::Patch(patch),
                // Patches that touch at a vertex only. If they meet along edges, the curves
                // overwrite this.
                _ => On::Corner,
            };
        }
    }
    for v in mesh.segments.iter().flat_map(|segment| segment.vertices) {
        on[v.index()] = On::Body(BodyId(0));
    }
    for segment in &mesh.segments {
        for v in segment.vertices {
            on[v.index()] = match on[v.index()] {
                On::Body(_) => On::Curve(segment.curve, 1),
                On::Curve(curve, 1) if curve == segment.curve => On::Curve(curve, 2),
                _ => On::Corner,
            };
        }
    }
    let mut corners = (0..).map(CornerId);
    let class = |on| match on {
        On::Body(body) => Class::Body(body),
        On::Patch(patch) => Class::Patch(patch),
        On::Curve(curve, 2) => Class::Curve(curve),
        On::Curve(..) | On::Corner => Class::Corner(corners.next().expect("an endless range of ids")),
    };
    on.into_iter().map(class).collect()
}
