//! MFEM's parallel text.

use crate::fault::{Fault, Status, guard};
use crate::group::{on_ranks, own};
use crate::mesh::Mesh;
use crate::part::Part;
use crate::pointers::{given, store};
use std::ffi::c_char;
use tetmill::Error;
use tetmill::files::mfem::part_text;

/// *Collective.* Makes MFEM's parallel text of each part, which tetmill_part_mfem returns.
///
/// The texts take about 60 bytes a tet until the mesh is freed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_mesh_make_mfem(mesh: Option<&Mesh>) -> Status {
    guard(|| {
        let Mesh { parts, group, .. } = given(mesh, "mesh")?;
        on_ranks(group, |comm| {
            let part = own(parts, comm.rank(), Part::rank);
            let made = part.made()?;
            let mut text = part_text(comm, made.stream(), &made.names).map_err(Error::from)?;
            text.push(0);
            part.mfem.get_or_init(|| text);
            Ok(())
        })?;
        Ok(())
    })
}

/// The text of a part that MFEM's `ParMesh(comm, stream)` reads on this rank; `length` is without
/// the NUL at its end. Written to files NAME.000000, NAME.000001 and so on by rank, it is what
/// MFEM's programs read. Attributes are the numbers of tetmill_mesh_body and tetmill_mesh_patch.
///
/// Needs tetmill_mesh_make_mfem before. Valid until the mesh is freed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_part_mfem(
    part: Option<&Part>,
    text: *mut *const c_char,
    length: *mut usize,
) -> Status {
    guard(|| {
        let made = given(part, "part")?.mfem.get();
        let made =
            made.ok_or_else(|| Fault::usage("there is no text yet: call tetmill_mesh_make_mfem first"))?;
        // SAFETY: the contract of the header.
        unsafe {
            store(text, made.as_ptr().cast(), "text")?;
            store(length, made.len() - 1, "length")
        }
    })
}
