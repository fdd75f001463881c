//! Checks of boundary triangles: vertices on the patches, and adjacent tets.

use super::{Fault, OffSurface, PartReport, Settings};
use crate::Point;
use crate::ground::mesh::stream::{BoundaryBlock, LocalBlock, MeshStream, NO_TET, TetBlock};
use crate::ground::mesh::{EDGE_BETWEEN, TET_FACES, TRIANGLE_EDGES};
use crate::ground::projector::Projector;

/// A side of a boundary block that has tets: the first tet, the block, and whether the tets are
/// behind it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Side {
    tet: u64,
    block: u32,
    behind: bool,
}

/// Checks the data of a boundary block on its own, and adds its sides to `sides`.
pub(super) fn check_block(
    stream: &dyn MeshStream,
    projector: Option<&Projector>,
    index: usize,
    block: &mut BoundaryBlock,
    sides: &mut Vec<Side>,
    settings: &Settings,
) -> PartReport {
    let mut report = PartReport::default();
    stream.boundary_block(index, block);
    let points = stream.points();
    let missing = |v: &&u32| **v as usize >= points.len();
    let nodes = || block.triangles.as_flattened().iter().chain(block.edge_nodes.as_flattened());
    if let Some(&vertex) = nodes().find(missing) {
        report.add_fault(Fault::NoSuchVertex { rank: stream.rank(), vertex }, settings.described);
        return report;
    }
    for (side, behind) in [(0, true), (1, false)] {
        if let Some(tet) = block.parents.first().map(|p| p[side]).filter(|&tet| tet != NO_TET) {
            sides.push(Side { tet, block: index as u32, behind });
        }
    }
    if block.parents.first().is_some_and(|p| p[0] != NO_TET) {
        report.boundary = block.triangles.len() as u64;
    }
    if let (Some(projector), Some(patch)) = (projector, block.patch) {
        let mut off = Vec::new();
        for &vertex in nodes() {
            let place = points[vertex as usize];
            let distance = projector.patch_distance(patch, &Point::from(place)).abs();
            if report.furthest.is_none_or(|f| distance >= f.distance) {
                let vertex = stream.vertex_id(vertex);
                let this = OffSurface { distance, vertex, patch: patch.0, place };
                report.furthest = Some(report.furthest.map_or(this, |f| f.further(this)));
            }
            let may_be_off = || settings.off_surface.binary_search(&stream.vertex_id(vertex)).is_ok();
            if (distance > projector.tolerance() || distance.is_nan()) && !may_be_off() {
                off.push(vertex);
            }
        }
        off.sort_unstable();
        off.dedup();
        for local in off {
            let (vertex, place) = (stream.vertex_id(local), points[local as usize]);
            let distance = projector.patch_distance(patch, &Point::from(place)).abs();
            let fault = Fault::OffSurface { vertex, patch: patch.0, distance, place };
            report.add_fault(fault, settings.described);
        }
    }
    report
}

/// The sides whose tets are in this tet block; `sides` are sorted by tet.
pub(super) fn sides_of<'a>(sides: &'a [Side], tets: &TetBlock) -> &'a [Side] {
    let end = tets.first_local + tets.tets.len() as u64;
    let from = sides.partition_point(|side| side.tet < tets.first_local);
    let to = sides.partition_point(|side| side.tet < end);
    &sides[from..to]
}

/// Checks that the triangles on one side of a boundary block are faces of their parent tets.
pub(super) fn check_parents(
    stream: &dyn MeshStream,
    side: Side,
    tets: &LocalBlock,
    block: &mut BoundaryBlock,
    settings: &Settings,
    report: &mut PartReport,
) {
    stream.boundary_block(side.block as usize, block);
    for (index, (triangle, parents)) in block.triangles.iter().zip(&block.parents).enumerate() {
        let parent = parents[usize::from(!side.behind)];
        let place = parent.checked_sub(tets.tets.first_local).and_then(|i| usize::try_from(i).ok());
        let [p, q, r] = *triangle;
        let outward = if side.behind { [p, q, r] } else { [p, r, q] };
        let fits = |place: usize| {
            let tet = tets.tet(place)?;
            Some(
                has_face(&tet, outward) && has_edges(&tet, tets, place, triangle, block.edge_nodes_of(index)),
            )
        };
        if place.and_then(fits) != Some(true) {
            report.add_fault(wrong_parent(stream, *triangle), settings.described);
        }
    }
}

/// Whether a tet has this face, oriented outward.
fn has_face(tet: &[u32; 4], [p, q, r]: [u32; 3]) -> bool {
    let faces = TET_FACES.map(|face| face.map(|k| tet[k]));
    faces.iter().any(|face| [[p, q, r], [q, r, p], [r, p, q]].contains(face))
}

/// Whether the nodes on the edges of a triangle are those of the tet at `place`.
fn has_edges(tet: &[u32; 4], tets: &LocalBlock, place: usize, triangle: &[u32; 3], nodes: &[u32]) -> bool {
    let of_tet = tets.tets.edge_nodes_of(place);
    nodes.iter().zip(TRIANGLE_EDGES).all(|(node, ends)| {
        let [p, q] = ends.map(|end| tet.iter().position(|v| *v == triangle[end]).unwrap_or(0));
        of_tet.get(EDGE_BETWEEN[p][q]).is_some_and(|&k| tets.vertices[k as usize] == *node)
    })
}

/// The fault of a triangle that is not a face of its parent tet.
pub(super) fn wrong_parent(stream: &dyn MeshStream, triangle: [u32; 3]) -> Fault {
    let [p, q, r] = triangle.map(|v| stream.points()[v as usize]);
    let place = [0, 1, 2].map(|x| (p[x] + q[x] + r[x]) / 3.0);
    Fault::WrongParent { triangle: triangle.map(|v| stream.vertex_id(v)), place }
}

/// The faults of sides whose parent tets do not exist.
pub(super) fn check_range(
    stream: &dyn MeshStream,
    sides: &[Side],
    settings: &Settings,
    report: &mut PartReport,
) {
    let tets = stream.counts().tets;
    let mut block = BoundaryBlock::default();
    for side in &sides[sides.partition_point(|side| side.tet < tets)..] {
        stream.boundary_block(side.block as usize, &mut block);
        report.add_fault(wrong_parent(stream, block.triangles[0]), settings.described);
    }
}
