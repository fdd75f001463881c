//! Meshes across the processes of an MPI job (feature `mpi`).

use crate::fault::{Fault, Status, guard};
use crate::generate::generate;
use crate::geometry::Geometry;
use crate::group::Group;
use crate::mesh::Mesh;
use crate::options::Options;
use crate::pointers::store_new;
use std::ffi::c_uint;
use std::mem::ManuallyDrop;
use tetmill::comm::mpi::duplicate_of;
use tetmill::comm::mpi::rsmpi::environment::{is_finalized, is_initialized};
use tetmill::comm::mpi::rsmpi::ffi::{MPI_Comm, MPI_Comm_test_inter, RSMPI_COMM_NULL};
use tetmill::comm::mpi::rsmpi::raw::{AsRaw, FromRaw};
use tetmill::comm::mpi::rsmpi::topology::SimpleCommunicator;

/// *Collective.* Makes a mesh across the processes of a communicator, of which the library keeps a
/// duplicate until the mesh is freed.
///
/// `parts` of 0 is one part for each process; another number is distributed over the processes, and
/// a process has several parts or none. Only process 0 needs the geometry (the others may pass
/// NULL), sources and the size function; all other options must be the same on all, which is
/// checked. Free the mesh with tetmill_mesh_free.
///
/// MPI must have been initialised by the calling thread with MPI_THREAD_FUNNELED or more. An error
/// is an error on all processes, of the same kind, except for a wrong `mesh`. A bug of the library
/// on one process (a panic) ends the job with status 5, because the others wait for it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_generate_comm(
    geometry: Option<&Geometry>,
    options: Option<&Options>,
    comm: MPI_Comm,
    parts: c_uint,
    mesh: *mut *mut Mesh,
) -> Status {
    let make = || {
        if !is_initialized() || is_finalized() {
            return Err(Fault::usage("MPI is not initialised, or finalised already"));
        }
        // SAFETY: the contract of the header.
        let given = unsafe { borrowed(comm) }?;
        let own = duplicate_of(&*given).map_err(|error| Fault::usage(error.to_string()))?;
        generate(geometry, options, Group::of_processes(Box::new(own), parts))
    };
    // SAFETY: the contract of the header.
    guard(|| unsafe { store_new(mesh, make, "mesh") })
}

/// A communicator of the caller, which is not freed here.
///
/// # Safety
/// It is null or valid, and MPI is initialised.
unsafe fn borrowed(comm: MPI_Comm) -> Result<ManuallyDrop<SimpleCommunicator>, Fault> {
    let predefined = [SimpleCommunicator::world(), SimpleCommunicator::self_comm()];
    if let Some(same) = predefined.into_iter().find(|predefined| predefined.as_raw() == comm) {
        return Ok(ManuallyDrop::new(same));
    }
    // SAFETY: MPI itself defines this handle.
    if comm == unsafe { RSMPI_COMM_NULL } {
        return Err(Fault::usage("`comm` is MPI_COMM_NULL"));
    }
    let mut is_inter = 0;
    // SAFETY: a valid communicator, by the caller's promise.
    unsafe { MPI_Comm_test_inter(comm, &mut is_inter) };
    if is_inter != 0 {
        return Err(Fault::usage("`comm` is an inter-communicator"));
    }
    // SAFETY: a valid communicator of the program, by the caller's promise.
    Ok(ManuallyDrop::new(unsafe { SimpleCommunicator::from_raw(comm) }))
}
