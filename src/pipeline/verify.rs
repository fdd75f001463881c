//! The check of a finished mesh.

use super::error::{Error, InvalidMesh};
use crate::ground::comm::Communicator;
use crate::ground::mesh::stream::MeshStream;
use crate::ground::mesh::{GlobalId, Watched};
use crate::ground::progress::Work;
use crate::ground::projector::Projector;
use crate::parallel::check::{self, Checksum, PartReport};

/// **Collective.** Checks all tets, and all boundary vertices if there is a `projector` (except
/// those that may be `off_surface`), and computes the checksum.
///
/// # Errors
/// On all ranks: a mesh with faults; a cancelled run.
pub(super) fn verify(
    comm: &dyn Communicator,
    part: &dyn MeshStream,
    projector: Option<&Projector>,
    off_surface: &[GlobalId],
    work: &Work,
) -> Result<(PartReport, Checksum), Error> {
    let part = &Watched::new(part, work, 1);
    let settings = check::Settings { off_surface, ..check::Settings::default() };
    let (report, checksum) = check::check_and_sum(comm, part, projector, &settings)?;
    // A cancelled check has not seen all tets.
    comm.agree(work.proceed().map_err(Error::from))?;
    if report.faults > 0 {
        return Err(InvalidMesh::Faults { count: report.faults, first: report.described }.into());
    }
    Ok((report, checksum))
}
