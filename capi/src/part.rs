//! The arrays of a part.

use crate::fault::{Fault, Status, guard};
use crate::ghosts::GhostArrays;
use crate::levels::Parents;
use crate::pointers::{given, store, store_array};
use crate::sharing::SharingArrays;
use std::sync::{Arc, OnceLock};
use tetmill::mesh::{Arrays, GlobalId, MeshStream, Order};
use tetmill::{Generated, Hierarchy};

/// One part of a mesh, or a refinement level of it (tetmill_part_level).
///
/// Its arrays are made when they are first requested, and borrowed until the mesh is freed. Local
/// indices of vertices are positions in the array of points.
pub struct Part {
    source: Source,
    /// `None` inside if the part has no levels.
    pub levels: OnceLock<Option<Vec<Part>>>,
    /// The parents of a level's vertices and tets.
    pub parents: OnceLock<Parents>,
    arrays: OnceLock<FlatArrays>,
    sharing: OnceLock<SharingArrays>,
    /// By faces, by vertices.
    pub ghosts: [OnceLock<GhostArrays>; 2],
    /// MFEM's text with a NUL at its end.
    pub mfem: OnceLock<Vec<u8>>,
}

/// Where the arrays of a part come from.
enum Source {
    Finest(Box<Generated>),
    Level(Arc<Hierarchy>, usize),
}

/// `Arrays` with plain numbers.
struct FlatArrays {
    points: Vec<[f64; 3]>,
    vertex_ids: Vec<GlobalId>,
    order: Order,
    tets: Vec<[u32; 4]>,
    /// All nodes, only for second order.
    tet_nodes: Vec<[u32; 10]>,
    tet_ids: Vec<GlobalId>,
    tet_bodies: Vec<u32>,
    triangles: Vec<[u32; 3]>,
    /// All nodes, only for second order.
    triangle_nodes: Vec<[u32; 6]>,
    triangle_patches: Vec<u32>,
    triangle_bodies: Vec<[i32; 2]>,
}

/// Marks a side of a triangle without a tet of the part.
const NO_BODY: i32 = -1;

/// All nodes of a tet in the order of VTK: the corners, then the edges 01 12 02 03 13 23. The
/// library's edges are 01 02 03 12 13 23.
fn vtk_nodes((&[a, b, c, d], &[ab, ac, ad, bc, bd, cd]): (&[u32; 4], &[u32; 6])) -> [u32; 10] {
    [a, b, c, d, ab, bc, ac, ad, bd, cd]
}

impl From<Arrays> for FlatArrays {
    fn from(arrays: Arrays) -> Self {
        let bodies = |of: [Option<tetmill::mesh::BodyId>; 2]| {
            of.map(|body| body.map_or(NO_BODY, |body| body.0 as i32))
        };
        Self {
            points: arrays.points,
            vertex_ids: arrays.vertex_ids,
            order: arrays.order,
            tet_nodes: arrays.tets.iter().zip(&arrays.tet_edge_nodes).map(vtk_nodes).collect(),
            tets: arrays.tets,
            tet_ids: arrays.tet_ids,
            tet_bodies: arrays.tet_bodies.into_iter().map(|body| body.0).collect(),
            triangle_nodes: arrays
                .triangles
                .iter()
                .zip(&arrays.triangle_edge_nodes)
                .map(|(&[a, b, c], &[ab, bc, ca])| [a, b, c, ab, bc, ca])
                .collect(),
            triangles: arrays.triangles,
            triangle_patches: arrays.triangle_patches.into_iter().map(|patch| patch.0).collect(),
            triangle_bodies: arrays.triangle_bodies.into_iter().map(bodies).collect(),
        }
    }
}

impl Part {
    pub fn new(made: Generated) -> Self {
        Self::of(Source::Finest(Box::new(made)))
    }

    /// A refinement level.
    pub fn of_level(hierarchy: Arc<Hierarchy>, level: usize) -> Self {
        Self::of(Source::Level(hierarchy, level))
    }

    fn of(source: Source) -> Self {
        Self {
            source,
            levels: OnceLock::new(),
            parents: OnceLock::new(),
            arrays: OnceLock::new(),
            sharing: OnceLock::new(),
            ghosts: [OnceLock::new(), OnceLock::new()],
            mfem: OnceLock::new(),
        }
    }

    /// The part, unless it is a level.
    pub fn made(&self) -> Result<&Generated, Fault> {
        match &self.source {
            Source::Finest(made) => Ok(made),
            Source::Level(..) => Err(Fault::usage("`part` is a level of a part")),
        }
    }

    /// The levels and this one's index, if it is one.
    pub fn level(&self) -> Option<(&Hierarchy, usize)> {
        match &self.source {
            Source::Finest(_) => None,
            Source::Level(hierarchy, level) => Some((hierarchy, *level)),
        }
    }

    fn stream(&self) -> &dyn MeshStream {
        match &self.source {
            Source::Finest(made) => made.stream(),
            Source::Level(hierarchy, level) => &*hierarchy.levels[*level],
        }
    }

    pub fn rank(&self) -> u32 {
        self.stream().rank()
    }

    pub fn vertex_count(&self) -> usize {
        self.stream().counts().vertices as usize
    }

    fn arrays(&self) -> &FlatArrays {
        self.arrays.get_or_init(|| Arrays::of(self.stream()).into())
    }

    pub fn sharing(&self) -> &SharingArrays {
        self.sharing.get_or_init(|| SharingArrays::of(self.stream()))
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

/// The corners of the tets by local index, four for each of `count` tets, positively oriented:
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

/// All nodes of the tets by local index, `nodes_per_tet` for each of `count` tets: 10 in a mesh of
/// order 2, otherwise 4, those of tetmill_part_tets.
///
/// First the corners, then the nodes on the edges 01 12 02 03 13 23: the order of VTK and Abaqus.
/// Nodes on edges are vertices of the part, too, with coordinates, ids and owners.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_part_tet_nodes(
    part: Option<&Part>,
    nodes: *mut *const u32,
    count: *mut usize,
    nodes_per_tet: *mut usize,
) -> Status {
    guard(|| {
        let arrays = given(part, "part")?.arrays();
        // SAFETY: the contract of the header.
        unsafe {
            store(nodes_per_tet, arrays.order.tet_nodes(), "nodes_per_tet")?;
            match arrays.order {
                Order::First => store_array(&arrays.tets, nodes, count, "nodes"),
                Order::Second => store_array(&arrays.tet_nodes, nodes, count, "nodes"),
            }
        }
    })
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

/// The triangles on patches by local index, three corners for each of `count` triangles. Their
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

/// All nodes of the triangles by local index, `nodes_per_triangle` for each of `count` triangles: 6
/// in a mesh of order 2, otherwise 3, those of tetmill_part_triangles.
///
/// First the corners, then the nodes on the edges 01 12 20.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_part_triangle_nodes(
    part: Option<&Part>,
    nodes: *mut *const u32,
    count: *mut usize,
    nodes_per_triangle: *mut usize,
) -> Status {
    guard(|| {
        let arrays = given(part, "part")?.arrays();
        // SAFETY: the contract of the header.
        unsafe {
            store(nodes_per_triangle, arrays.order.triangle_nodes(), "nodes_per_triangle")?;
            match arrays.order {
                Order::First => store_array(&arrays.triangles, nodes, count, "nodes"),
                Order::Second => store_array(&arrays.triangle_nodes, nodes, count, "nodes"),
            }
        }
    })
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
