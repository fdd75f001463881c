//! Tets of other parts beside a part.

use crate::fault::{Fault, Status, guard};
use crate::group::{on_ranks, own};
use crate::mesh::Mesh;
use crate::part::Part;
use crate::pointers::{given, store, store_array};
use std::ffi::c_int;
use tetmill::mesh::{By, Ghosts};

/// Ghosts share a face with a tet of the part.
pub const TETMILL_BY_FACES: c_int = 0;
/// Ghosts share a vertex with a tet of the part.
pub const TETMILL_BY_VERTICES: c_int = 1;

/// Ghosts as plain arrays.
pub struct GhostArrays {
    points: Vec<[f64; 3]>,
    vertex_ids: Vec<u64>,
    tets: Vec<[u32; 4]>,
    tet_ids: Vec<u64>,
    bodies: Vec<u32>,
    owners: Vec<u32>,
    indices: Vec<u64>,
}

impl From<Ghosts> for GhostArrays {
    fn from(ghosts: Ghosts) -> Self {
        let (vertices, tets) = (&ghosts.vertices, &ghosts.tets);
        Self {
            points: vertices.iter().map(|vertex| vertex.point).collect(),
            vertex_ids: vertices.iter().map(|vertex| vertex.id).collect(),
            tets: tets.iter().map(|tet| tet.vertices).collect(),
            tet_ids: tets.iter().map(|tet| tet.id).collect(),
            bodies: tets.iter().map(|tet| tet.body.0).collect(),
            owners: tets.iter().map(|tet| tet.owner).collect(),
            indices: tets.iter().map(|tet| tet.index).collect(),
        }
    }
}

fn kind(by: c_int) -> Result<(By, usize), Fault> {
    match by {
        TETMILL_BY_FACES => Ok((By::Faces, 0)),
        TETMILL_BY_VERTICES => Ok((By::Vertices, 1)),
        _ => Err(Fault::usage(format!("`by` cannot be {by}: TETMILL_BY_FACES or TETMILL_BY_VERTICES"))),
    }
}

/// *Collective.* Finds the tets of other parts beside each part, TETMILL_BY_FACES or
/// TETMILL_BY_VERTICES.
///
/// Needed once, before the functions that return them.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_mesh_find_ghosts(mesh: Option<&Mesh>, by: c_int) -> Status {
    guard(|| {
        let Mesh { parts, group, .. } = given(mesh, "mesh")?;
        let (by, place) = kind(by)?;
        on_ranks(group, |comm| {
            let part = own(parts, comm.rank(), Part::rank);
            let ghosts = part.made()?.ghosts(comm, by)?;
            part.ghosts[place].get_or_init(|| ghosts.into());
            Ok(())
        })?;
        Ok(())
    })
}

fn found(part: Option<&Part>, by: c_int) -> Result<&GhostArrays, Fault> {
    let (part, (_, place)) = (given(part, "part")?, kind(by)?);
    let ghosts = part.ghosts[place].get();
    ghosts.ok_or_else(|| Fault::usage("there are no ghosts yet: call tetmill_mesh_find_ghosts first"))
}

/// The vertices that only ghost tets have: coordinates and global ids. Their local indices follow
/// those of the part.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_part_ghost_vertices(
    part: Option<&Part>,
    by: c_int,
    xyz: *mut *const f64,
    ids: *mut *const u64,
    count: *mut usize,
) -> Status {
    guard(|| {
        let ghosts = found(part, by)?;
        // SAFETY: the contract of the header.
        unsafe {
            store(ids, ghosts.vertex_ids.as_ptr(), "ids")?;
            store_array(&ghosts.points, xyz, count, "xyz")
        }
    })
}

/// The ghost tets: four local vertices each, those of the part or of tetmill_part_ghost_vertices,
/// global ids, and bodies.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_part_ghost_tets(
    part: Option<&Part>,
    by: c_int,
    vertices: *mut *const u32,
    ids: *mut *const u64,
    bodies: *mut *const u32,
    count: *mut usize,
) -> Status {
    guard(|| {
        let ghosts = found(part, by)?;
        // SAFETY: the contract of the header.
        unsafe {
            store(ids, ghosts.tet_ids.as_ptr(), "ids")?;
            store(bodies, ghosts.bodies.as_ptr(), "bodies")?;
            store_array(&ghosts.tets, vertices, count, "vertices")
        }
    })
}

/// Where the ghost tets come from: the rank of the part that has each, and the tet's index there.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_part_ghost_owners(
    part: Option<&Part>,
    by: c_int,
    ranks: *mut *const u32,
    indices: *mut *const u64,
    count: *mut usize,
) -> Status {
    guard(|| {
        let ghosts = found(part, by)?;
        // SAFETY: the contract of the header.
        unsafe {
            store(indices, ghosts.indices.as_ptr(), "indices")?;
            store_array(&ghosts.owners, ranks, count, "ranks")
        }
    })
}
