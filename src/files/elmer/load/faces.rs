//! Finds the tets beside each face and turns the boundary elements into triangles on patches.

use super::super::faults::FaultKind;
use super::own::{OwnParts, TetPlace};
use super::{LoadError, distinct, fault};
use crate::files::input::ReadError;
use crate::ground::comm::{CommError, Communicator};
use crate::ground::mesh::topology::face_tets;
use crate::ground::mesh::{Class, EdgeId, FaceId, Rank, TET_FACES, TetId, VertexId};
use crate::parallel::distribution::{BoundaryFace, DistMesh, Shared};
use csg::{BodyId, PatchId};
use std::collections::BTreeMap;

/// No tet on this side of a face.
const NONE: u32 = u32::MAX;
/// In a [`Patch`]: no body in front.
const OUTSIDE: u32 = u32::MAX;

/// A patch: a boundary number, and the bodies (by index) behind it and in front of it.
type Patch = [u32; 3];

/// The result of [`find_boundary`].
pub(super) struct Found {
    /// The boundary number of each patch.
    pub numbers: Vec<u32>,
    /// Number of outer faces of the whole mesh without boundary element.
    pub bare_faces: u64,
}

/// A boundary element: its face, and its position in the files.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Listed {
    face: u32,
    part: u32,
    place: u32,
}

/// The boundary elements of one face on this rank.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Listing {
    /// The boundary number; 0 if there is none.
    number: u32,
    /// Whether the normal points out of the first (lower local id) of the two tets.
    out_of_first: bool,
}

/// The message about a shared face: the element's id in the files, its part (from 1), body, the
/// tet's global id in two words, the boundary number, and two bits: whether the face is reversed,
/// and whether the boundary element's normal points out of the tet.
type FaceMessage = [u32; 7];

/// **Collective.** Puts the boundary elements on the faces of the mesh, and classifies its
/// entities.
///
/// # Errors
/// With file and line: a face of three tets, overlapping tets, a boundary element that is not a
/// face, is there twice or names a wrong parent.
pub(super) fn find_boundary(
    comm: &dyn Communicator,
    own: &OwnParts,
    of_tet: &[TetPlace],
    local: &[Vec<VertexId>],
    mesh: &mut DistMesh,
) -> Result<Found, LoadError> {
    let beside = comm.agree(tets_beside(own, of_tet, mesh).map_err(LoadError::from))?;
    let listings =
        comm.agree(boundary_elements(own, of_tet, local, mesh, &beside).map_err(LoadError::from))?;
    let message = |face: u32| {
        let tet = beside[face as usize][0];
        let at = of_tet[tet as usize];
        let id = mesh.tet_ids[tet as usize];
        let element = own.element(at);
        let bits = u32::from(turned(mesh, tet, face)) << 1 | u32::from(listings[face as usize].out_of_first);
        let body = mesh.tet_bodies[tet as usize].0;
        [
            element.id,
            own.number(at.part) + 1,
            body,
            id as u32,
            (id >> 32) as u32,
            listings[face as usize].number,
            bits,
        ]
    };
    let received = mesh.shared_faces.exchange::<FaceMessage>(comm, message)?;
    let fit = received.iter().try_for_each(|&(face, _, theirs)| {
        expect_fit(own, of_tet[beside[face as usize][0] as usize], message(face), theirs)
    });
    comm.agree(fit.map_err(LoadError::from))?;
    let others: BTreeMap<u32, FaceMessage> =
        received.into_iter().map(|(face, _, message)| (face, message)).collect();

    let mut patches: Vec<(FaceId, Patch, [Option<TetId>; 2])> = Vec::new();
    let mut bare_faces = 0;
    for (face, (tets, own_listing)) in (0..).zip(beside.iter().zip(&listings)) {
        // Only a face with one tet here can have another on a different rank; most faces have two
        // here.
        let other = if tets[1] == NONE { others.get(&face) } else { None };
        if own_listing.number > 0 || other.is_some_and(|message| message[5] > 0) {
            let (patch, parents) = sides(mesh, *tets, *own_listing, other);
            patches.push((FaceId(face), patch, parents));
        } else if tets[1] == NONE && other.is_none() {
            bare_faces += 1;
        }
    }
    let all = distinct(comm, patches.iter().map(|(_, patch, _)| *patch))?;
    let place = |patch: &Patch| PatchId(all.binary_search(patch).expect("all patches are listed") as u32);
    mesh.boundary = patches
        .iter()
        .map(|(face, patch, parents)| BoundaryFace { face: *face, patch: place(patch), parents: *parents })
        .collect();
    classify(comm, mesh)?;
    let counted = |face: &&BoundaryFace| mesh.face_holders(face.face)[0] == mesh.rank;
    let counts = [mesh.boundary.iter().filter(counted).count() as u64, bare_faces];
    let [boundary, bare_faces] = comm.all_reduce_sum_u64(counts)?;
    mesh.totals.boundary = boundary;
    Ok(Found { numbers: all.iter().map(|patch| patch[0]).collect(), bare_faces })
}

/// The patch of a face with a boundary number, and this rank's tets behind it and in front of it.
fn sides(
    mesh: &DistMesh,
    [first, second]: [u32; 2],
    listing: Listing,
    other: Option<&FaceMessage>,
) -> (Patch, [Option<TetId>; 2]) {
    let body = |tet: u32| mesh.tet_bodies[tet as usize].0;
    let (number, front, parents, first_behind) = match other {
        Some(message) => {
            let theirs = (message[2], u64::from(message[3]) | u64::from(message[4]) << 32);
            let lower = (body(first), mesh.tet_ids[first as usize]) < theirs;
            (
                listing.number.max(message[5]),
                message[2],
                [Some(TetId(first)), None],
                first_is_behind(listing, message, lower),
            )
        }
        // An outer face has its body behind it, whatever the orientation of its boundary element.
        None if second == NONE => (listing.number, OUTSIDE, [Some(TetId(first)), None], true),
        None => (listing.number, body(second), [first, second].map(|t| Some(TetId(t))), listing.out_of_first),
    };
    if first_behind {
        ([number, body(first), front], parents)
    } else {
        ([number, front, body(first)], [parents[1], parents[0]])
    }
}

/// Whether this rank's tet lies behind a shared face. The boundary elements on both sides, or the
/// only one, decide; if they disagree, the lower tet lies behind.
fn first_is_behind(mine: Listing, theirs: &FaceMessage, lower: bool) -> bool {
    let out_of_theirs = (theirs[5] != 0).then_some(theirs[6] & 1 == 1);
    match (mine.number != 0, out_of_theirs) {
        (true, None) => mine.out_of_first,
        (false, Some(out)) => !out,
        (true, Some(out)) if out != mine.out_of_first => mine.out_of_first,
        _ => lower,
    }
}

/// Finds the tets on both sides of each face, which must lie on different sides.
fn tets_beside(own: &OwnParts, of_tet: &[TetPlace], mesh: &DistMesh) -> Result<Vec<[u32; 2]>, ReadError> {
    let ids =
        |tets: &[u32]| -> Vec<u32> { tets.iter().map(|&t| own.element(of_tet[t as usize]).id).collect() };
    let beside = face_tets(mesh.faces.len(), &mesh.tet_faces).map_err(|face| {
        let has = |tet: &u32| mesh.tet_faces[*tet as usize].contains(&face);
        let tets: Vec<u32> = (0..mesh.tets.len() as u32).filter(has).collect();
        let what = format!("elements {:?} have a face in common", ids(&tets));
        own.element_fault(FaultKind::CrowdedFace, of_tet[tets[2] as usize], what)
    })?;
    for tets in mesh.shared_faces.ids.iter().map(|&face| &beside[face as usize]) {
        if tets[1] != NONE {
            let what = format!("elements {:?} and one of another part have a face in common", ids(tets));
            return Err(own.element_fault(FaultKind::CrowdedFace, of_tet[tets[1] as usize], what));
        }
    }
    for (face, tets) in (0..).zip(&beside).filter(|(_, tets)| tets[1] != NONE) {
        if turned(mesh, tets[0], face) == turned(mesh, tets[1], face) {
            let what = format!("elements {:?}", ids(tets));
            return Err(own.element_fault(FaultKind::Overlap, of_tet[tets[1] as usize], what));
        }
    }
    Ok(beside)
}

/// The vertices of a face as seen from outside a tet that has it.
fn outward(mesh: &DistMesh, tet: u32, face: u32) -> [VertexId; 3] {
    let place = mesh.tet_faces[tet as usize].iter().position(|f| f.0 == face).expect("the tet has the face");
    TET_FACES[place].map(|k| mesh.tets[tet as usize][k])
}

/// Whether three distinct vertices form an odd permutation of ascending order.
fn descends([a, b, c]: [VertexId; 3]) -> bool {
    (a > b) ^ (b > c) ^ (a > c)
}

/// Whether a face seen from outside a tet is an odd permutation of its ascending vertices.
fn turned(mesh: &DistMesh, tet: u32, face: u32) -> bool {
    descends(outward(mesh, tet, face))
}

/// Collects and checks the boundary elements of each face.
fn boundary_elements(
    own: &OwnParts,
    of_tet: &[TetPlace],
    local: &[Vec<VertexId>],
    mesh: &DistMesh,
    beside: &[[u32; 2]],
) -> Result<Vec<Listing>, ReadError> {
    let mut listed: Vec<Listed> = Vec::new();
    for (part, of_part) in (0u32..).zip(&own.list) {
        for (place, element) in (0..).zip(&of_part.files.boundary) {
            let line = || of_part.files.boundary.line(place as usize);
            let error = |kind, what| Err(fault(kind, of_part.files.file("boundary"), line(), what));
            let vertices =
                element.nodes.map(|id| local[part as usize][of_part.nodes.find(id).expect("checked before")]);
            let mut key = vertices;
            key.sort_unstable();
            let face = mesh.faces.binary_search(&key).ok();
            let here = |tet: &&u32| **tet != NONE && of_tet[**tet as usize].part == part;
            let Some(face) = face.filter(|face| beside[*face].iter().any(|tet| here(&tet))) else {
                let what = format!("boundary element {}, nodes {:?}", element.id, element.nodes);
                return error(FaultKind::NoFace, what);
            };
            let is_beside = |parent: u32| {
                beside[face].iter().any(|&tet| tet != NONE && own.element(of_tet[tet as usize]).id == parent)
            };
            // A parent in another part is accepted: Elmer's own writer names such parents.
            let wrong = |parent: &u32| *parent != 0 && !is_beside(*parent) && of_part.has_element(*parent);
            if let Some(parent) = element.parents.into_iter().find(wrong) {
                let what = format!("element {parent} is not beside boundary element {}", element.id);
                return error(FaultKind::WrongParent, what);
            }
            listed.push(Listed { face: face as u32, part, place });
        }
    }
    listed.sort_unstable();
    let element = |listed: &Listed| &own.list[listed.part as usize].files.boundary[listed.place as usize];
    let mut listings = vec![Listing::default(); mesh.faces.len()];
    for of_face in listed.chunk_by(|a, b| a.face == b.face) {
        for pair in of_face.windows(2) {
            let (before, here) = (element(&pair[0]), element(&pair[1]));
            let files = &own.list[pair[1].part as usize].files;
            let (file, line) = (files.file("boundary"), files.boundary.line(pair[1].place as usize));
            let what = format!("boundary elements {} and {}", before.id, here.id);
            if pair[0].part == pair[1].part {
                return Err(fault(FaultKind::BoundaryTwice, file, line, what));
            }
            if before.boundary != here.boundary {
                return Err(fault(FaultKind::NumbersDiffer, file, line, what));
            }
        }
        let face = of_face[0].face;
        let [first, second] = beside[face as usize];
        let out = |listed: &Listed| {
            let part = listed.part as usize;
            let vertex = |id| local[part][own.list[part].nodes.find(id).expect("checked before")];
            descends(element(listed).nodes.map(vertex)) == turned(mesh, first, face)
        };
        let same = of_face.iter().all(|listed| out(listed) == out(&of_face[0]));
        // If the boundary elements of two parts disagree, the lower tet lies behind, as in
        // `first_is_behind`: the result must not depend on which rank reads which part.
        let lower = |tet: u32| (mesh.tet_bodies[tet as usize], mesh.tet_ids[tet as usize]);
        let out_of_first = if same { out(&of_face[0]) } else { lower(first) < lower(second) };
        listings[face as usize] = Listing { number: element(&of_face[0]).boundary, out_of_first };
    }
    Ok(listings)
}

/// Checks a shared face: the other rank's tet must lie on the other side, with the same boundary
/// number if both have one.
fn expect_fit(own: &OwnParts, at: TetPlace, mine: FaceMessage, theirs: FaceMessage) -> Result<(), ReadError> {
    let elements = format!("element {} and element {} of part {}", mine[0], theirs[0], theirs[1]);
    if mine[6] >> 1 == theirs[6] >> 1 {
        return Err(own.element_fault(FaultKind::Overlap, at, elements));
    }
    if mine[5] != theirs[5] && mine[5] != 0 && theirs[5] != 0 {
        let what = format!("{} and {}, between {elements}", mine[5], theirs[5]);
        return Err(own.element_fault(FaultKind::NumbersDiffer, at, what));
    }
    Ok(())
}

/// **Collective.** Classifies vertices, edges and faces on the lowest patch of a triangle that
/// contains them on any rank, else on the lowest body.
fn classify(comm: &dyn Communicator, mesh: &mut DistMesh) -> Result<(), CommError> {
    let mut vertices = vec![u64::MAX; mesh.points.len()];
    let mut edges = vec![u64::MAX; mesh.edges.len()];
    let mut faces = vec![u64::MAX; mesh.faces.len()];
    let lower = |key: &mut u64, class: u64| *key = class.min(*key);
    for (tet, body) in mesh.tet_bodies.iter().enumerate() {
        let class = code(Class::Body(*body));
        mesh.tets[tet].iter().for_each(|v| lower(&mut vertices[v.index()], class));
        mesh.tet_edges[tet].iter().for_each(|e| lower(&mut edges[e.index()], class));
        mesh.tet_faces[tet].iter().for_each(|f| lower(&mut faces[f.index()], class));
    }
    for triangle in &mesh.boundary {
        let class = code(Class::Patch(triangle.patch));
        faces[triangle.face.index()] = class;
        let tet = triangle.parents.iter().flatten().next().expect("a boundary triangle has a parent");
        let of_face = mesh.faces[triangle.face.index()];
        of_face.iter().for_each(|v| lower(&mut vertices[v.index()], class));
        let has = |edge: &EdgeId| mesh.edges[edge.index()].iter().all(|v| of_face.contains(v));
        let of_tet = mesh.tet_edges[tet.index()].iter();
        of_tet.filter(|edge| has(edge)).for_each(|edge| lower(&mut edges[edge.index()], class));
    }
    agree_on_least(comm, &mesh.shared_vertices, &mut vertices)?;
    agree_on_least(comm, &mesh.shared_edges, &mut edges)?;
    agree_on_least(comm, &mesh.shared_faces, &mut faces)?;
    mesh.vertex_classes = vertices.into_iter().map(class).collect();
    mesh.edge_classes = edges.into_iter().map(class).collect();
    mesh.face_classes = faces.into_iter().map(class).collect();
    Ok(())
}

/// **Collective.** Sets each shared entity's message to the minimum over all ranks that share it.
fn agree_on_least(comm: &dyn Communicator, shared: &Shared, words: &mut [u64]) -> Result<(), CommError> {
    let received: Vec<(u32, Rank, u64)> = shared.exchange(comm, |id| words[id as usize])?;
    received.into_iter().for_each(|(id, _, theirs)| words[id as usize] = theirs.min(words[id as usize]));
    Ok(())
}

/// Encodes a class as a number; patches sort before bodies.
fn code(class: Class) -> u64 {
    match class {
        Class::Patch(patch) => patch.0.into(),
        Class::Body(body) => 1 << 32 | u64::from(body.0),
        Class::Corner(_) | Class::Curve(_) => unreachable!("files have no corners and curves"),
    }
}

/// The inverse of [`code`].
fn class(code: u64) -> Class {
    if code >> 32 == 0 { Class::Patch(PatchId(code as u32)) } else { Class::Body(BodyId(code as u32)) }
}
