//! Calls of the C++ shim (`shim.cpp`), the only unsafe code of the project.

use std::ffi::{CString, c_char, c_int, c_void};
use std::ptr;
use tetgen_ffi::TetgenMesh;

/// Whether TetGen is built in.
pub const AVAILABLE: bool = true;

/// `ShimMesh` of the shim, field by field.
#[repr(C)]
struct ShimMesh {
    points: c_int,
    coordinates: *const f64,
    tets: c_int,
    corners: c_int,
    vertices: *const c_int,
    attributes: c_int,
    regions: *const f64,
    owner: *mut c_void,
}

unsafe extern "C" {
    fn shim_run(
        switches: *const c_char,
        points: c_int,
        coordinates: *const f64,
        facets: c_int,
        triangles: *const c_int,
        mesh: *mut ShimMesh,
    ) -> c_int;
    fn shim_free(mesh: *mut ShimMesh);
}

/// Status of an invalid request, which is not passed to TetGen.
const BAD_REQUEST: i32 = -2;

/// Runs TetGen on the coordinates of points and the vertices of triangles, three each.
///
/// # Errors
/// The code that TetGen threw; [`BAD_REQUEST`] if a triangle has a nonexistent vertex or there are
/// too many for `int`.
pub fn run(switches: Vec<u8>, coordinates: &[f64], vertices: &[i32]) -> Result<TetgenMesh, i32> {
    // Quiet, with vertices numbered from 0.
    let switches = CString::new([switches, b"Qz".to_vec()].concat()).map_err(|_| BAD_REQUEST)?;
    let (points, facets) = (coordinates.len() / 3, vertices.len() / 3);
    let exist = |&v: &i32| usize::try_from(v).is_ok_and(|v| v < points);
    let (Ok(point_count), Ok(facet_count)) = (c_int::try_from(points), c_int::try_from(facets)) else {
        return Err(BAD_REQUEST);
    };
    if !vertices.iter().all(exist) {
        return Err(BAD_REQUEST);
    }
    let mut mesh = ShimMesh {
        points: 0,
        coordinates: ptr::null(),
        tets: 0,
        corners: 0,
        vertices: ptr::null(),
        attributes: 0,
        regions: ptr::null(),
        owner: ptr::null_mut(),
    };
    // SAFETY: the arrays have 3 × point_count and 3 × facet_count entries, the text ends with 0,
    // and `mesh` has the layout of the shim's struct. The shim only reads the arrays, keeps no
    // pointer to them and lets no C++ exception escape.
    let status = unsafe {
        let (text, points, triangles) = (switches.as_ptr(), coordinates.as_ptr(), vertices.as_ptr());
        shim_run(text, point_count, points, facet_count, triangles, &mut mesh)
    };
    let result = if status == 0 { Ok(copied(&mesh)) } else { Err(status) };
    // SAFETY: `mesh` was filled by shim_run, also if it failed, and is freed once; the copies own
    // their data.
    unsafe { shim_free(&mut mesh) };
    result
}

/// Copies the shim's arrays to owned lists.
fn copied(mesh: &ShimMesh) -> TetgenMesh {
    let [points, tets, corners, attributes] =
        [mesh.points, mesh.tets, mesh.corners, mesh.attributes].map(|n| usize::try_from(n).unwrap_or(0));
    // SAFETY: TetGen's arrays have 3 coordinates for each point, and `corners` vertices and
    // `attributes` numbers for each tet (see tetgenio in tetgen.h). They live until shim_free.
    let (coordinates, vertices, regions) = unsafe {
        let coordinates = slice(mesh.coordinates, 3 * points);
        (coordinates, slice(mesh.vertices, corners * tets), slice(mesh.regions, attributes * tets))
    };
    TetgenMesh {
        points: coordinates.as_chunks().0.to_vec(),
        // Tets of second order have more than four corners; the first four are the vertices.
        // TetGen's orientation is ours.
        tets: vertices.chunks_exact(corners.max(4)).map(|tet| [0, 1, 2, 3].map(|i| tet[i] as u32)).collect(),
        regions: regions.chunks_exact(attributes.max(1)).map(|numbers| numbers[0] as i32).collect(),
    }
}

/// The array, empty if the pointer is null.
///
/// # Safety
/// A pointer that is not null must point to `length` numbers that outlive the slice.
unsafe fn slice<'a, T>(pointer: *const T, length: usize) -> &'a [T] {
    if pointer.is_null() {
        return &[];
    }
    // SAFETY: by the condition of this function.
    unsafe { std::slice::from_raw_parts(pointer, length) }
}
