//! The arrays of a part.

use crate::fault::{Status, guard};
use crate::ghosts::GhostArrays;
use crate::pointers::{given, store, store_array};
use crate::sharing::SharingArrays;
use std::sync::OnceLock;
use tetmill::Generated;
use tetmill::mesh::{Arrays, GlobalId};

/// One part of a mesh.
///
/// Its arrays are made when they are first requested, and borrowed until the mesh is freed. Local
/// indices of vertices are positions in the array of points.
pub struct Part {
    pub made: Generated,
    arrays: OnceLock<FlatArrays>,
    sharing: OnceLock<SharingArrays>,
    /// By faces, by vertices.
    pub ghosts: [OnceLock<GhostArrays>; 2],
    /// MFEM's text with a NUL at its end.
    pub mfem: OnceLock<Vec<u8>>,
}

/// `Arrays` with plain numbers.
struct FlatArrays {
    points: Vec<[f64; 3]>,
    vertex_ids: Vec<GlobalId>,
    tets: Vec<[u32; 4]>,
    tet_ids: Vec<GlobalId>,
    tet_bodies: Vec<u32>,
    triangles: Vec<[u32; 3]>,
    triangle_patches: Vec<u32>,
    triangle_bodies: Vec<[i32; 2]>,
}

/// Marks a side of a triangle without a tet of the part.
const NO_BODY: i32 = -1;

impl From<Arrays> for FlatArrays {
    fn from(arrays: Arrays) -> Self {
        let bodies = |of: [Option<tetmill::mesh::BodyId>; 2]| {
            of.map(|body| body.map_or(NO_BODY, |body| body.0 as i32))
        };
        Self {
            points: arrays.points,
            vertex_ids: arrays.vertex_ids,
            tets: arrays.tets,
            tet_ids: arrays.tet_ids,
            tet_bodies: arrays.tet_bodies.into_iter().map(|body| body.0).collect(),
            triangles: arrays.triangles,
            triangle_patches: arrays.triangle_patches.into_iter().map(|patch| patch.0).collect(),
            triangle_bodies: arrays.triangle_bodies.into_iter().map(bodies).collect(),
        }
    }
}

impl Part {
    pub fn new(made: Generated) -> Self {
        Self {
            made,
            arrays: OnceLock::new(),
            sharing: OnceLock::new(),
            ghosts: [OnceLock::new(), OnceLock::new()],
            mfem: OnceLock::new(),
        }
    }

    pub fn rank(&self) -> u32 {
        self.made.stream().rank()
    }

    pub fn vertex_count(&self) -> usize {
        self.made.stream().counts().vertices as usize
    }

    fn arrays(&self) -> &FlatArrays {
        self.arrays.get_or_init(|| self.made.arrays().into())
    }

    pub fn sharing(&self) -> &SharingArrays {
        self.sharing.get_or_init(|| SharingArrays::of(self.made.stream()))
    }
}

/// The rank of the part: its index from 0 among all parts of the mesh.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_part_rank(part: Option<&Part>, rank: *mut u32) -> Status {
    // SAFETY: the contract of the header.
    guard(|| unsafe { store(rank, given(part, "part")?.rank(), "rank") })
}

/// Coordinates of the vertices, three for each of `count`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_part_points(
    part: Option<&Part>,
    xyz: *mut *const f64,
    count: *mut usize,
) -> Status {
    // SAFETY: the contract of the header.
    guard(|| unsafe { store_array(&given(part, "part")?.arrays().points, xyz, count, "xyz") })
}

/// Global ids of the vertices: 0 to the number of vertices of the whole mesh, without gaps.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_part_vertex_ids(
    part: Option<&Part>,
    ids: *mut *const u64,
    count: *mut usize,
) -> Status {
    // SAFETY: the contract of the header.
    guard(|| unsafe { store_array(&given(part, "part")?.arrays().vertex_ids, ids, count, "ids") })
}

/// The vertices of the tets by local index, four for each of `count` tets, positively oriented:
/// (v1-v0)x(v2-v0).(v3-v0) > 0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_part_tets(
    part: Option<&Part>,
    vertices: *mut *const u32,
    count: *mut usize,
) -> Status {
    // SAFETY: the contract of the header.
    guard(|| unsafe { store_array(&given(part, "part")?.arrays().tets, vertices, count, "vertices") })
}

/// Global ids of the tets: 0 to the number of tets of the whole mesh, without gaps.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_part_tet_ids(
    part: Option<&Part>,
    ids: *mut *const u64,
    count: *mut usize,
) -> Status {
    // SAFETY: the contract of the header.
    guard(|| unsafe { store_array(&given(part, "part")?.arrays().tet_ids, ids, count, "ids") })
}

/// The body of each tet, by the index of tetmill_mesh_body.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_part_tet_bodies(
    part: Option<&Part>,
    bodies: *mut *const u32,
    count: *mut usize,
) -> Status {
    // SAFETY: the contract of the header.
    guard(|| unsafe { store_array(&given(part, "part")?.arrays().tet_bodies, bodies, count, "bodies") })
}

/// The triangles on patches by local index, three vertices for each of `count` triangles. Their
/// right-hand normal points from the patch's inside to its outside.
///
/// A triangle between two parts is in the arrays of both.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_part_triangles(
    part: Option<&Part>,
    vertices: *mut *const u32,
    count: *mut usize,
) -> Status {
    // SAFETY: the contract of the header.
    guard(|| unsafe { store_array(&given(part, "part")?.arrays().triangles, vertices, count, "vertices") })
}

/// The patch of each triangle, by the index of tetmill_mesh_patch.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_part_triangle_patches(
    part: Option<&Part>,
    patches: *mut *const u32,
    count: *mut usize,
) -> Status {
    // SAFETY: the contract of the header.
    guard(|| unsafe {
        store_array(&given(part, "part")?.arrays().triangle_patches, patches, count, "patches")
    })
}

/// The bodies of this part's tets behind and in front of each triangle, two for each of `count`
/// triangles; -1 on a side without a tet of this part.
///
/// An integral over a boundary counts each triangle once if it takes those with a body behind.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_part_triangle_bodies(
    part: Option<&Part>,
    bodies: *mut *const i32,
    count: *mut usize,
) -> Status {
    // SAFETY: the contract of the header.
    guard(|| unsafe { store_array(&given(part, "part")?.arrays().triangle_bodies, bodies, count, "bodies") })
}
