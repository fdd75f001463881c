//! Repartitions a mesh on disk: reads, moves and checks it on any number of ranks.

use super::error::{Error, InvalidMesh, RequestError};
use super::verify::verify;
use crate::files::elmer::{self};
use crate::ground::comm::Communicator;
use crate::ground::mesh::Names;
use crate::ground::progress::{Progress, Stage, Work};
use crate::parallel::check::{self, Checksum, PartReport};
use crate::parallel::distribution::BareMesh;
use crate::parallel::migrate::{self, BareStream, Moved};
use crate::parallel::repartition::{self, Method, Metrics, Neighbours};
use std::path::{Path, PathBuf};

/// A repartitioned mesh.
#[derive(Debug)]
pub struct Repartitioned {
    /// This rank's part.
    pub part: BareStream,
    /// Numbers and names of bodies and boundaries.
    pub names: Names,
    /// The folder with the files that were read.
    pub folder: PathBuf,
    /// Quality of the old partition. All fields but `part` are the same on all ranks.
    pub before: Metrics,
    /// Quality of the new partition.
    pub after: Metrics,
    /// The amount of data moved between ranks.
    pub moved: Moved,
    /// Messages about the files, one sentence each.
    pub notes: Vec<String>,
    /// The check of the whole mesh.
    pub check: PartReport,
    /// Checksum of the mesh, the same before and after the move.
    pub checksum: Checksum,
}

/// **Collective.** Reads the partition in `dir` and redistributes it to one part for each rank.
///
/// With `periodic_together` a mesh with periodic faces is refused unless there is one part: the
/// pairs are not read, so faces and their copies could be in different parts.
///
/// # Errors
/// The same on all ranks: files that cannot be read or have no valid mesh; more parts than tets;
/// periodic faces; not enough memory.
pub fn repartition(
    comm: &dyn Communicator,
    dir: &Path,
    method: Method,
    periodic_together: bool,
    progress: &Progress,
) -> Result<Repartitioned, Error> {
    let loaded = progress.stage(Stage::Read, |_| elmer::load(comm, dir))?;
    if periodic_together && loaded.is_periodic && comm.size() > 1 {
        return Err(RequestError::PeriodicRepartition(loaded.folder).into());
    }
    let (mesh, parts) = (BareMesh::from(loaded.mesh), comm.size());
    let (to, before, after) = progress.stage(Stage::Partition, |_| {
        let neighbours = Neighbours::find(comm, &mesh)?;
        let to = repartition::repartition(comm, &mesh, &neighbours, parts, method)?;
        let before = repartition::measure(comm, &mesh, &neighbours, &loaded.part, loaded.parts)?;
        let after = repartition::measure(comm, &mesh, &neighbours, &to, parts)?;
        Ok::<_, Error>((to, before, after))
    })?;
    let stream = BareStream::new(mesh);
    let checksum = check::checksum_of_all(comm, &stream)?;
    let (bare, mine) = progress.stage(Stage::Move, |_| {
        migrate::migrate_bare(comm, stream.into_mesh(), &to, &migrate::MoveSettings::default())
    })?;
    let [tets, bytes] = comm.all_reduce_sum_u64([mine.tets, mine.bytes])?;
    let part = BareStream::new(bare);
    let check = progress.stage(Stage::Check, |work| verdict(comm, &part, checksum, work))?;
    Ok(Repartitioned {
        part,
        names: loaded.names,
        folder: loaded.folder,
        before,
        after,
        moved: Moved { tets, bytes },
        notes: loaded.notes,
        check,
        checksum,
    })
}

/// **Collective.** Checks all tets, and that the mesh is unchanged.
fn verdict(
    comm: &dyn Communicator,
    part: &BareStream,
    before: Checksum,
    work: &Work,
) -> Result<PartReport, Error> {
    let (report, after) = verify(comm, part, None, &[], work)?;
    if after == before { Ok(report) } else { Err(InvalidMesh::Changed { before, after }.into()) }
}
