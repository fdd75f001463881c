//! Meshes.

use crate::fault::{Fault, Status, c_string, guard};
use crate::geometry::out_of_range;
use crate::group::Group;
use crate::part::Part;
use crate::pointers::{array_mut, free, given, store, text};
use std::ffi::{CString, c_char};
use tetmill::mesh::{Label, Names};
use tetmill::{Error, Generated};

/// A mesh: the parts that this process has, and what is known of the whole.
pub struct Mesh {
    pub parts: Vec<Part>,
    pub group: Group,
    whole: Whole,
    bodies: Vec<Named>,
    patches: Vec<Named>,
}

/// What all processes know, also those without a part.
#[derive(Clone, serde::Serialize, serde::Deserialize)]
struct Whole {
    names: Names,
    /// Vertices, tets, triangles.
    totals: [u64; 3],
    /// The degree of the elements.
    order: u32,
    volume: f64,
    least_angle: f64,
}

impl From<&Generated> for Whole {
    fn from(made: &Generated) -> Self {
        let totals = made.stream().totals();
        Self {
            names: made.names.clone(),
            totals: [totals.vertices, totals.tets, totals.boundary],
            order: made.stream().order().degree(),
            volume: made.check.volume,
            least_angle: made.check.shape.as_ref().map_or(0.0, |shape| shape.smallest_angle.value),
        }
    }
}

/// A body or patch.
struct Named {
    number: u32,
    /// The main name; empty if it has none.
    name: CString,
}

impl From<&Label> for Named {
    fn from(label: &Label) -> Self {
        Self { number: label.number, name: c_string(label.name().unwrap_or_default()) }
    }
}

impl Mesh {
    /// **Collective** over the processes of the group.
    pub fn new(made: Vec<Generated>, group: Group) -> Result<Self, Fault> {
        let whole = group.share(made.first().map(Whole::from))?;
        Ok(Self {
            parts: made.into_iter().map(Part::new).collect(),
            group,
            bodies: whole.names.bodies.iter().map(Named::from).collect(),
            patches: whole.names.patches.iter().map(Named::from).collect(),
            whole,
        })
    }
}

/// Frees a mesh with its parts and all arrays borrowed from them; NULL is ignored.
///
/// After tetmill_generate_comm, *Collective* unless MPI is finalised.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_mesh_free(mesh: *mut Mesh) {
    // SAFETY: the contract of the header.
    unsafe { free(mesh) }
}

/// Stores the counts of the whole mesh: vertices, tets, and triangles on patches, each counted
/// once. In a mesh of order 2 the vertices include the nodes on edges.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_mesh_totals(
    mesh: Option<&Mesh>,
    vertices: *mut u64,
    tets: *mut u64,
    triangles: *mut u64,
) -> Status {
    guard(|| {
        let [all_vertices, all_tets, all_triangles] = given(mesh, "mesh")?.whole.totals;
        // SAFETY: the contract of the header.
        unsafe {
            store(vertices, all_vertices, "vertices")?;
            store(tets, all_tets, "tets")?;
            store(triangles, all_triangles, "triangles")
        }
    })
}

/// Stores the order of the elements of the whole mesh: 1, or 2 if tets have a node on each edge,
/// too (option `order`).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_mesh_order(mesh: Option<&Mesh>, order: *mut u32) -> Status {
    // SAFETY: the contract of the header.
    guard(|| unsafe { store(order, given(mesh, "mesh")?.whole.order, "order") })
}

/// Stores the shape of the whole mesh: its volume, and the smallest dihedral angle in degrees.
///
/// In a mesh of order 2 the volume is that of the curved tets, and the angle that of tets with the
/// same corners and straight edges.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_mesh_shape(
    mesh: Option<&Mesh>,
    volume: *mut f64,
    least_angle: *mut f64,
) -> Status {
    guard(|| {
        let whole = &given(mesh, "mesh")?.whole;
        // SAFETY: the contract of the header.
        unsafe {
            store(volume, whole.volume, "volume")?;
            store(least_angle, whole.least_angle, "least_angle")
        }
    })
}

/// The number of parts that this process has.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_mesh_part_count(mesh: Option<&Mesh>, count: *mut usize) -> Status {
    // SAFETY: the contract of the header.
    guard(|| unsafe { store(count, given(mesh, "mesh")?.parts.len(), "count") })
}

/// A part of this process, by its index from 0. Valid until the mesh is freed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_mesh_part(
    mesh: Option<&Mesh>,
    index: usize,
    part: *mut *const Part,
) -> Status {
    guard(|| {
        let parts = &given(mesh, "mesh")?.parts;
        let found = parts.get(index).ok_or_else(|| out_of_range("part", index, parts.len()))?;
        // SAFETY: the contract of the header.
        unsafe { store(part, std::ptr::from_ref(found), "part") }
    })
}

/// The number of bodies, which tetmill_part_tet_bodies refers to.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_mesh_body_count(mesh: Option<&Mesh>, count: *mut usize) -> Status {
    // SAFETY: the contract of the header.
    guard(|| unsafe { store(count, given(mesh, "mesh")?.bodies.len(), "count") })
}

/// Stores the number of a body in output files, and its main name: the material, or the name of
/// its solid. Valid until the mesh is freed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_mesh_body(
    mesh: Option<&Mesh>,
    body: usize,
    number: *mut u32,
    name: *mut *const c_char,
) -> Status {
    // SAFETY: the contract of the header.
    guard(|| unsafe { describe(&given(mesh, "mesh")?.bodies, "body", body, number, name) })
}

/// The number of patches, which tetmill_part_triangle_patches refers to.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_mesh_patch_count(mesh: Option<&Mesh>, count: *mut usize) -> Status {
    // SAFETY: the contract of the header.
    guard(|| unsafe { store(count, given(mesh, "mesh")?.patches.len(), "count") })
}

/// Stores the boundary number of a patch, and its main name, which is empty if it has none. Valid
/// until the mesh is freed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_mesh_patch(
    mesh: Option<&Mesh>,
    patch: usize,
    number: *mut u32,
    name: *mut *const c_char,
) -> Status {
    // SAFETY: the contract of the header.
    guard(|| unsafe { describe(&given(mesh, "mesh")?.patches, "patch", patch, number, name) })
}

/// # Safety
/// The outputs can be written to.
unsafe fn describe(
    all: &[Named],
    what: &str,
    index: usize,
    number: *mut u32,
    name: *mut *const c_char,
) -> Result<(), Fault> {
    let found = all.get(index).ok_or_else(|| out_of_range(what, index, all.len()))?;
    // SAFETY: the caller's promise.
    unsafe {
        store(number, found.number, "number")?;
        store(name, found.name.as_ptr(), "name")
    }
}

/// Copies the indices of the bodies with this name, by their main name or a further one.
///
/// Stores as many as there are in `count`, and copies at most `capacity` of them to `bodies`, which
/// may be NULL if `capacity` is 0. A name that no body has is TETMILL_STATUS_INPUT; the text lists
/// the names.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_mesh_bodies_named(
    mesh: Option<&Mesh>,
    name: *const c_char,
    bodies: *mut u32,
    capacity: usize,
    count: *mut usize,
) -> Status {
    guard(|| {
        let names = &given(mesh, "mesh")?.whole.names;
        // SAFETY: the contract of the header.
        let found = names.bodies_named(unsafe { text(name, "name")? }).map_err(Error::from)?;
        let found: Vec<u32> = found.iter().map(|body| body.0).collect();
        // SAFETY: the contract of the header.
        unsafe { copy(&found, bodies, capacity, count, "bodies") }
    })
}

/// Copies the indices of the patches with this name, by their main name or a further one.
///
/// Stores as many as there are in `count`, and copies at most `capacity` of them to `patches`,
/// which may be NULL if `capacity` is 0. A name that no boundary has is TETMILL_STATUS_INPUT; the
/// text lists the names.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_mesh_patches_named(
    mesh: Option<&Mesh>,
    name: *const c_char,
    patches: *mut u32,
    capacity: usize,
    count: *mut usize,
) -> Status {
    guard(|| {
        let names = &given(mesh, "mesh")?.whole.names;
        // SAFETY: the contract of the header.
        let found = names.patches_named(unsafe { text(name, "name")? }).map_err(Error::from)?;
        let found: Vec<u32> = found.iter().map(|patch| patch.0).collect();
        // SAFETY: the contract of the header.
        unsafe { copy(&found, patches, capacity, count, "patches") }
    })
}

/// # Safety
/// `count` can be written to, and `to` has room for `capacity` values.
unsafe fn copy(
    values: &[u32],
    to: *mut u32,
    capacity: usize,
    count: *mut usize,
    name: &str,
) -> Result<(), Fault> {
    let copied = capacity.min(values.len());
    // SAFETY: the caller's promise.
    unsafe {
        array_mut(to, copied, name)?.copy_from_slice(&values[..copied]);
        store(count, values.len(), "count")
    }
}
