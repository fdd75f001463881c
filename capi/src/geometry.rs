//! Geometries.

use crate::fault::{Fault, Status, c_string, guard};
use crate::options::Options;
use crate::pointers::{array, free, given, store, store_new, text};
use std::collections::BTreeMap;
use std::ffi::{CString, c_char};
use tetmill::{Error, InputSettings, MeshArrays, SurfaceArrays};

/// What is meshed: bodies with named boundaries.
///
/// Never changed by a call: several threads may mesh it at the same time.
#[derive(Debug)]
pub struct Geometry {
    pub inner: tetmill::Geometry,
    notes: Vec<CString>,
}

/// The triangles of one or several closed surfaces. Set it to zero first (`= {0}`).
#[repr(C)]
pub struct Surface {
    /// Three coordinates for each point. Equal points are merged.
    pub points: *const f64,
    /// Number of points.
    pub point_count: usize,
    /// Three point indices from 0 for each triangle, counterclockwise seen from outside.
    pub triangles: *const u32,
    /// Number of triangles.
    pub triangle_count: usize,
    /// The boundary number of each triangle, positive; NULL finds boundaries from sharp edges.
    pub numbers: *const u32,
    /// Boundary numbers with a name; NULL if there are none.
    pub named: *const u32,
    /// Their names.
    pub names: *const *const c_char,
    /// Number of names.
    pub name_count: usize,
}

/// A tetrahedral mesh. Set it to zero first (`= {0}`).
#[repr(C)]
pub struct Tets {
    /// Three coordinates for each point.
    pub points: *const f64,
    /// Number of points.
    pub point_count: usize,
    /// Four point indices from 0 for each tet, all with the same orientation.
    pub tets: *const u32,
    /// Number of tets.
    pub tet_count: usize,
    /// The body number of each tet, positive; NULL if there is one body.
    pub bodies: *const u32,
    /// Three point indices for each triangle on boundaries and between bodies.
    pub triangles: *const u32,
    /// Number of triangles.
    pub triangle_count: usize,
    /// The boundary number of each triangle, positive; NULL if there is one boundary.
    pub boundaries: *const u32,
}

impl Geometry {
    fn new(made: Result<tetmill::Geometry, Error>) -> Result<Self, Fault> {
        let inner = made?;
        let notes = inner.notes().iter().map(|note| c_string(note)).collect();
        Ok(Self { inner, notes })
    }
}

fn input_settings(options: Option<&Options>) -> InputSettings {
    options.map_or_else(InputSettings::default, |options| options.0.input())
}

/// Reads a file: a geometry (`.geo`), triangles (`.stl`, `.off`, `.obj`, `.ply`, `.poly`,
/// `.smesh`), or a mesh (`.msh`, `.vol`, `.mesh`, `.meshb`, `.vtu`, `.pvtu`, `.ele`, the folder of
/// an Elmer mesh).
///
/// `options` may be NULL. Free the geometry with tetmill_geometry_free.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_geometry_from_file(
    path: *const c_char,
    options: Option<&Options>,
    geometry: *mut *mut Geometry,
) -> Status {
    let make = || {
        // SAFETY: the contract of the header.
        let path = unsafe { text(path, "path") }?;
        Geometry::new(tetmill::Geometry::from_files(&[path], &input_settings(options)))
    };
    // SAFETY: the contract of the header.
    guard(|| unsafe { store_new(geometry, make, "geometry") })
}

/// Reads the text of a geometry in NETGEN's CSG language. Free the geometry with
/// tetmill_geometry_free.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_geometry_from_text(
    text: *const c_char,
    geometry: *mut *mut Geometry,
) -> Status {
    let make = || {
        // SAFETY: the contract of the header.
        let text = unsafe { crate::pointers::text(text, "text") }?;
        Geometry::new(tetmill::Geometry::from_text(text))
    };
    // SAFETY: the contract of the header.
    guard(|| unsafe { store_new(geometry, make, "geometry") })
}

/// Takes triangles, which are copied.
///
/// `options` (`keep-surface`, `feature-angle`) may be NULL. Free the geometry with
/// tetmill_geometry_free.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_geometry_from_surface(
    surface: Option<&Surface>,
    options: Option<&Options>,
    geometry: *mut *mut Geometry,
) -> Status {
    let make = || {
        // SAFETY: the contract of the header.
        let arrays = unsafe { given(surface, "surface")?.arrays() }?;
        Geometry::new(tetmill::Geometry::from_surface(&arrays, &input_settings(options)))
    };
    // SAFETY: the contract of the header.
    guard(|| unsafe { store_new(geometry, make, "geometry") })
}

/// Takes a tetrahedral mesh, which is copied, to partition and refine it. Its boundary faces stay
/// flat. Free the geometry with tetmill_geometry_free.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_geometry_from_tets(
    tets: Option<&Tets>,
    geometry: *mut *mut Geometry,
) -> Status {
    let make = || {
        // SAFETY: the contract of the header.
        let arrays = unsafe { given(tets, "tets")?.arrays() }?;
        Geometry::new(tetmill::Geometry::from_mesh(&arrays))
    };
    // SAFETY: the contract of the header.
    guard(|| unsafe { store_new(geometry, make, "geometry") })
}

impl Surface {
    /// # Safety
    /// All pointers are null or point to as many values as the structure says.
    unsafe fn arrays(&self) -> Result<SurfaceArrays<'_>, Fault> {
        // SAFETY: the caller's promise, for all arrays and texts here.
        unsafe {
            let named = array(self.named, self.name_count, "named")?;
            let pointers = array(self.names, self.name_count, "names")?;
            let mut names = BTreeMap::new();
            for (&number, &name) in named.iter().zip(pointers) {
                names.insert(number, text(name, "names")?.to_owned());
            }
            Ok(SurfaceArrays {
                points: array(self.points.cast(), self.point_count, "points")?,
                triangles: array(self.triangles.cast(), self.triangle_count, "triangles")?,
                numbers: optional(self.numbers, self.triangle_count, "numbers")?,
                names,
            })
        }
    }
}

impl Tets {
    /// # Safety
    /// All pointers are null or point to as many values as the structure says.
    unsafe fn arrays(&self) -> Result<MeshArrays<'_>, Fault> {
        // SAFETY: the caller's promise, for all arrays here.
        unsafe {
            Ok(MeshArrays {
                points: array(self.points.cast(), self.point_count, "points")?,
                tets: array(self.tets.cast(), self.tet_count, "tets")?,
                bodies: optional(self.bodies, self.tet_count, "bodies")?,
                triangles: array(self.triangles.cast(), self.triangle_count, "triangles")?,
                boundaries: optional(self.boundaries, self.triangle_count, "boundaries")?,
                ..MeshArrays::default()
            })
        }
    }
}

/// An array that is empty if its pointer is null.
///
/// # Safety
/// As for [`array`].
unsafe fn optional<'a, T>(pointer: *const T, count: usize, name: &str) -> Result<&'a [T], Fault> {
    let count = if pointer.is_null() { 0 } else { count };
    // SAFETY: the caller's promise.
    unsafe { array(pointer, count, name) }
}

/// Frees a geometry; NULL is ignored. Meshes that were made of it stay valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_geometry_free(geometry: *mut Geometry) {
    // SAFETY: the contract of the header.
    unsafe { free(geometry) }
}

/// The number of warnings about the text, and of repairs and omissions while reading. A program
/// should show them.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_geometry_note_count(
    geometry: Option<&Geometry>,
    count: *mut usize,
) -> Status {
    // SAFETY: the contract of the header.
    guard(|| unsafe { store(count, given(geometry, "geometry")?.notes.len(), "count") })
}

/// One of these notes, by its index from 0. Valid until the geometry is freed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_geometry_note(
    geometry: Option<&Geometry>,
    index: usize,
    note: *mut *const c_char,
) -> Status {
    guard(|| {
        let notes = &given(geometry, "geometry")?.notes;
        let found = notes.get(index).ok_or_else(|| out_of_range("note", index, notes.len()))?;
        // SAFETY: the contract of the header.
        unsafe { store(note, found.as_ptr(), "note") }
    })
}

/// The error of an index that is too large.
pub fn out_of_range(what: &str, index: usize, count: usize) -> Fault {
    Fault::usage(format!("there is no {what} {index}: there are {count}, counted from 0"))
}
