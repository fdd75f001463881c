//! Making meshes.

use crate::callbacks::{Refusal, Watch};
use crate::fault::{Fault, Status, guard};
use crate::geometry::Geometry;
use crate::group::{Group, of_threads, on_ranks, start_threads};
use crate::mesh::Mesh;
use crate::options::Options;
use crate::pointers::{given, store_new};
use crate::settings::Settings;
use std::ffi::c_uint;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tetmill::comm::Communicator;
use tetmill::{Generated, Mesher};

/// Makes a mesh in this process, in `parts` parts. A part is a rank: a thread of its own while
/// ranks meet.
///
/// `options` may be NULL: all have their defaults. The mesh does not depend on `parts`, except for
/// the methods `surface` and `decompose`. Free it with tetmill_mesh_free.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_generate(
    geometry: Option<&Geometry>,
    options: Option<&Options>,
    parts: c_uint,
    mesh: *mut *mut Mesh,
) -> Status {
    let make = || generate(Some(given(geometry, "geometry")?), options, of_threads(parts)?);
    // SAFETY: the contract of the header.
    guard(|| unsafe { store_new(mesh, make, "mesh") })
}

/// **Collective** over the processes of the group. Makes a mesh.
pub fn generate(geometry: Option<&Geometry>, options: Option<&Options>, group: Group) -> Result<Mesh, Fault> {
    start_threads();
    let defaults = Settings::default();
    let settings = options.map_or(&defaults, |options| &options.0);
    let geometry = geometry.map(|geometry| &geometry.inner).filter(|_| group.is_first());
    let refusal = Arc::new(Refusal::default());
    let watch = Watch {
        progress: settings.progress,
        cancel: settings.cancel,
        refusal: Arc::clone(&refusal),
        cancelled: AtomicBool::new(false),
    };
    let made = on_ranks(&group, |comm| {
        let geometry = geometry.filter(|_| comm.rank() == 0);
        let mesher = comm.agree(settings.mesher(geometry, &refusal))?;
        run(comm, geometry, &mesher.observer(&watch), &refusal)
    })?;
    Mesh::new(made, group)
}

/// **Collective.** Makes the part of a rank.
fn run(
    comm: &dyn Communicator,
    geometry: Option<&tetmill::Geometry>,
    mesher: &Mesher,
    refusal: &Refusal,
) -> Result<Generated, Fault> {
    let made = mesher.generate_on(comm, geometry).map_err(Fault::from);
    // Only rank 0 calls the size function. A refused value cancels the run, if not too late.
    let refused = if comm.rank() == 0 { refusal.check() } else { Ok(()) };
    comm.agree(refused)?;
    made
}
