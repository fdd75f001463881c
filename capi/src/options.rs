//! Options of a run.

use crate::callbacks::{Callback, CancelCallback, ProgressCallback, SizeCallback};
use crate::fault::{Fault, Status, guard};
use crate::pointers::{array, free, given, optional_text, store_new, text};
use crate::settings::Settings;
use std::ffi::{c_char, c_uint, c_void};
use tetmill::Point;
use tetmill::run::CutPlane;
use tetmill::size::{SizeFunction, Source};

/// Options of reading and meshing, with the names and defaults of the command line.
#[derive(Debug, Default)]
pub struct Options(pub Settings);

/// Makes options that all have their defaults. Free them with tetmill_options_free.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_options_new(options: *mut *mut Options) -> Status {
    // SAFETY: the contract of the header.
    guard(|| unsafe { store_new(options, || Ok(Options::default()), "options") })
}

/// Frees options; NULL is ignored. Geometries and meshes that were made with them stay valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_options_free(options: *mut Options) {
    // SAFETY: the contract of the header.
    unsafe { free(options) }
}

/// Sets an option by the name that it has on the command line, without the dashes: `"levels"` to
/// `"2"`. The value NULL sets it back to its default.
///
/// Sizes: `preset`, `maxh`, `minh`, `grading`, `closeness`, `mesh-size-file`, `effort`, `coarse`.
/// The fine mesh: `method`, `elements`, `levels`, `pieces`, `nested`, `refine`, `order`,
/// `allow-off-surface`, `memory`, `planes`. Reading surfaces: `keep-surface`, `keep-small`,
/// `merge`, `feature-angle`, `unit`, `solid`, `overlap-to`. The values of `nested`,
/// `allow-off-surface`, `keep-surface` and `keep-small` are `"true"` and `"false"`. Each call with
/// `solid` adds a solid.
/// The sequence of calls does not matter otherwise; `elements` excludes `coarse`, `levels` and
/// `pieces`, which is checked when a mesh is made.
///
/// Returns TETMILL_STATUS_USAGE for an unknown name or a value that the option cannot have.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_options_set(
    options: Option<&mut Options>,
    name: *const c_char,
    value: *const c_char,
) -> Status {
    guard(|| {
        let options = given(options, "options")?;
        // SAFETY: the contract of the header.
        let (name, value) = unsafe { (text(name, "name")?, optional_text(value, "value")?) };
        options.0.set(name, value)
    })
}

/// Sets the option `maxh`: the largest element size (length).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_options_set_maxh(options: Option<&mut Options>, size: f64) -> Status {
    guard(|| given(options, "options")?.0.set("maxh", Some(&size.to_string())))
}

/// Sets the option `levels`: how often each tet is split into eight.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_options_set_levels(options: Option<&mut Options>, levels: c_uint) -> Status {
    guard(|| given(options, "options")?.0.set("levels", Some(&levels.to_string())))
}

/// Sets the option `elements`: the total number of tets, of which the mesh has up to 1.3 times as
/// many.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_options_set_elements(options: Option<&mut Options>, tets: u64) -> Status {
    guard(|| given(options, "options")?.0.set("elements", Some(&tets.to_string())))
}

/// Sets a function that limits the size of the coarse mesh by place; NULL removes it. Replaces a
/// background mesh.
///
/// `user` is passed to each call. Both are used while a mesh is made only.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_options_set_size(
    options: Option<&mut Options>,
    size: SizeCallback,
    user: *mut c_void,
) -> Status {
    guard(|| {
        let options = given(options, "options")?;
        options.0.size = Callback::new(size, user);
        options.0.background = None;
        Ok(())
    })
}

/// Sets sizes (length) at the points of a tetrahedral background mesh, such as those that an error
/// estimate asks for, which limit the size of the coarse mesh: linear in each tet, outside the mesh
/// those of its nearest point. The arrays are copied.
///
/// Replaces a size function. Zero tets remove the sizes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_options_set_background(
    options: Option<&mut Options>,
    xyz: *const f64,
    points: usize,
    vertices: *const u32,
    tets: usize,
    sizes: *const f64,
) -> Status {
    guard(|| {
        let options = given(options, "options")?;
        if tets == 0 {
            options.0.background = None;
            return Ok(());
        }
        // SAFETY: the contract of the header.
        let (xyz, vertices, sizes) = unsafe {
            (
                array(xyz.cast::<[f64; 3]>(), points, "xyz")?,
                array(vertices.cast::<[u32; 4]>(), tets, "vertices")?,
                array(sizes, points, "sizes")?,
            )
        };
        let background = SizeFunction::on_mesh(xyz, vertices, sizes);
        options.0.background = Some(background.map_err(|error| Fault::input(error.to_string()))?);
        options.0.size = None;
        Ok(())
    })
}

/// Adds a size (length) at a place, from which sizes grow by the grading.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_options_add_source(
    options: Option<&mut Options>,
    xyz: *const f64,
    size: f64,
) -> Status {
    guard(|| {
        let options = given(options, "options")?;
        // SAFETY: the contract of the header.
        let point = unsafe { point(xyz, "xyz")? };
        if !(size > 0.0 && size.is_finite()) {
            return Err(Fault::usage(format!("`size` cannot be {size}: possible are positive numbers")));
        }
        options.0.sources.push(Source { point, size });
        Ok(())
    })
}

/// Adds a plane that cuts the geometry, by a point and a normal, for the method `decompose`.
///
/// Each plane cuts every piece that it meets. Without such planes, they are chosen by the option
/// `planes`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_options_add_plane(
    options: Option<&mut Options>,
    xyz: *const f64,
    normal: *const f64,
) -> Status {
    guard(|| {
        let options = given(options, "options")?;
        // SAFETY: the contract of the header.
        let (point, normal) = unsafe { (point(xyz, "xyz")?, point(normal, "normal")?.coords) };
        let normal = normal.try_normalize(0.0).ok_or_else(|| Fault::usage("`normal` is zero"))?;
        options.0.cut_planes.push(CutPlane { point, normal });
        Ok(())
    })
}

/// Sets a function that is told the progress and can cancel the run; NULL removes it.
///
/// On several ranks that of rank 0 is told the progress.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_options_set_progress(
    options: Option<&mut Options>,
    progress: ProgressCallback,
    user: *mut c_void,
) -> Status {
    guard(|| {
        given(options, "options")?.0.progress = Callback::new(progress, user);
        Ok(())
    })
}

/// Sets a function that is asked often whether to cancel the run; NULL removes it.
///
/// If one rank cancels, the run ends on all.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_options_set_cancel(
    options: Option<&mut Options>,
    cancel: CancelCallback,
    user: *mut c_void,
) -> Status {
    guard(|| {
        given(options, "options")?.0.cancel = Callback::new(cancel, user);
        Ok(())
    })
}

/// Three finite coordinates.
///
/// # Safety
/// A pointer that is not null points to three numbers.
unsafe fn point(xyz: *const f64, name: &str) -> Result<Point, Fault> {
    // SAFETY: the caller's promise.
    let xyz = unsafe { array(xyz, 3, name)? };
    match xyz.iter().find(|x| !x.is_finite()) {
        Some(x) => Err(Fault::usage(format!("`{name}` cannot have the coordinate {x}"))),
        None => Ok(Point::new(xyz[0], xyz[1], xyz[2])),
    }
}
