//! A partition on the disk, partitioned anew: read, moved, checked, on any number of ranks.

use crate::check::{self, Checksum, PartReport};
use crate::comm::Communicator;
use crate::dist::BareMesh;
use crate::error::{Failure, Status, agree};
use crate::io::elmer::{self, LoadError};
use crate::mesh::Names;
use crate::migrate::{self, BareStream, MigrateError, Moved};
use crate::partition::PartitionError;
use crate::progress::Progress;
use crate::repartition::{self, Method, Metrics, RepartitionError};
use std::path::{Path, PathBuf};

/// A mesh that was read in parts and is in others now.
#[derive(Debug)]
pub struct Repartitioned {
    /// This rank's part.
    pub part: BareStream,
    /// Numbers and names of bodies and boundaries.
    pub names: Names,
    /// The folder with the files that were read.
    pub folder: PathBuf,
    /// The partition that was read. All fields but `part` are the same on all ranks.
    pub before: Metrics,
    /// The new one.
    pub after: Metrics,
    /// What moved between ranks.
    pub moved: Moved,
    /// What was found of the files that users should know, a sentence each.
    pub notes: Vec<String>,
    /// The check of the whole mesh.
    pub check: PartReport,
    /// What identifies the mesh, before and after the move.
    pub checksum: Checksum,
}

/// **Collective.** Reads the partition in `dir`, and gives each rank one of as many parts as there are ranks. With `periodic_together` a mesh
/// with periodic faces is refused unless there is one part: pairs are not read, so that faces and their images would come to be in different parts.
///
/// # Errors
/// The same on all ranks: files that cannot be read or hold no valid mesh; more parts than tets; periodic faces; memory.
pub fn repartition(
    comm: &dyn Communicator,
    dir: &Path,
    method: Method,
    periodic_together: bool,
    progress: &Progress,
) -> Result<Repartitioned, Failure> {
    let loaded = progress.stage("read", || elmer::load(comm, dir))?;
    if periodic_together && loaded.is_periodic && comm.size() > 1 {
        return Err(Failure::input(format!(
            "{} has periodic faces, and parts are chosen without regard to them, so that Elmer's `Periodic BC` would be wrong: make other \
             parts of it with `tetmill generate`, which reads pairs, or insist with --allow-split-periodic",
            loaded.folder.display()
        )));
    }
    let (mesh, parts) = (loaded.mesh, comm.size());
    let (to, before, after) = progress.stage("partition", || {
        let to = repartition::repartition(comm, &mesh, parts, method)?;
        let before = repartition::measure(comm, &mesh, &loaded.part, loaded.parts)?;
        let after = repartition::measure(comm, &mesh, &to, parts)?;
        Ok::<_, Failure>((to, before, after))
    })?;
    let stream = BareStream::new(BareMesh::from(mesh));
    let checksum = check::checksum_of_all(comm, &stream)?;
    let (bare, mine) = progress.stage("move", || {
        migrate::migrate_bare(comm, stream.into_mesh(), &to, &migrate::Settings::default())
    })?;
    let [tets, bytes] = comm.all_reduce_sum_u64([mine.tets, mine.bytes])?;
    let part = BareStream::new(bare);
    let check = progress.stage("check", || verdict(comm, &part, checksum))?;
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

/// **Collective.** Checks every tet, and that the mesh is the one that was read.
fn verdict(comm: &dyn Communicator, part: &BareStream, before: Checksum) -> Result<PartReport, Failure> {
    let report = check::check(comm, part, None, &check::Settings::default())?;
    let after = check::checksum_of_all(comm, part)?;
    let described = report.described.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ");
    let sound = if report.faults > 0 {
        Err(format!("the mesh has {} faults, nothing was written: {described}", report.faults))
    } else if after != before {
        Err(format!("the mesh is {after} after the move, {before} before; nothing was written"))
    } else {
        Ok(report)
    };
    agree(comm, sound.map_err(|message| Failure::new(Status::NoValidMesh, message)))
}

impl From<LoadError> for Failure {
    fn from(error: LoadError) -> Self {
        let status = if matches!(error, LoadError::Comm(_)) { Status::Rank } else { Status::Input };
        Self::new(status, error)
    }
}

impl From<RepartitionError> for Failure {
    fn from(error: RepartitionError) -> Self {
        match error {
            RepartitionError::Partition(error @ PartitionError::MoreParts { .. }) => Self::input(error),
            RepartitionError::Partition(error) => error.into(),
            RepartitionError::Elsewhere { message, .. } => Self::input(message),
            RepartitionError::Comm(error) => error.into(),
        }
    }
}

impl From<MigrateError> for Failure {
    fn from(error: MigrateError) -> Self {
        let status = match error {
            MigrateError::OutOfMemory { .. } | MigrateError::TooMany { .. } => Status::Resources,
            MigrateError::Elsewhere { .. } => Status::Resources,
            MigrateError::Comm(_) => Status::Rank,
            _ => Status::NoValidMesh,
        };
        Self::new(status, error)
    }
}
