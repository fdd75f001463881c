//! Better tets across interfaces, where parts were meshed each on its own.
//!
//! A rank that meshes its part keeps the triangles of the interfaces; so where these are narrow, or cross at a small angle, tets beside them are as
//! bad, and no rank alone can mend them. Here the tets around each bad one near an interface go to one rank, for which the interface is then nothing
//! but faces inside a body:
//!
//! ```text
//!   bad tets ──► regions round them ──► each to one rank ──► improved ──► ids without gaps
//!             (labels over interfaces)    (migrate_bare)     (no message)  (a scan, a list)
//! ```
//!
//! The surface of each region stays as it is ([`improve`]), so all still fits; and so does the boundary of the geometry, but for vertices that only
//! a cut needed ([`Settings::merge`]). Regions of a round may meet, and the interface is elsewhere afterwards; so there are several rounds, with other regions in each. Where three or more parts meet is
//! inside of a region like any other place. What costs time grows with the bad tets, not with the mesh.
//!
//! Compared: migrating whole layers beside all interfaces (as ParMmg does: Cirrottola, Froehly 2019) moves most of small parts, good
//! or bad; operations that only touch one rank leave the narrow triangles, which are the reason.

mod merge;
mod regions;
mod renumber;
mod rework;

#[cfg(test)]
mod tests;

use crate::comm::{CommError, Communicator};
use crate::dist::BareMesh;
use crate::improve;
use crate::migrate::{self, MigrateError};

/// How much is done.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Tets near interfaces with a smaller dihedral angle than this are bad, degrees.
    pub angle: f64,
    /// Rounds at most.
    pub rounds: u32,
    /// Whether vertices of the geometry's boundary may be merged into neighbours, where cuts have left them too near.
    pub merge: bool,
    /// How regions are improved.
    pub improve: improve::Settings,
}

impl Default for Settings {
    fn default() -> Self {
        Self { angle: 30.0, rounds: 4, merge: true, improve: improve::Settings::of(improve::Effort::Careful) }
    }
}

/// What was done: the same on all ranks.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Report {
    /// The angle below which tets are bad, degrees.
    pub angle: f64,
    /// Rounds made.
    pub rounds: u32,
    /// Tets in regions, those of all rounds.
    pub tets: u64,
    /// Of these, tets that went to other ranks for it.
    pub moved: u64,
    /// Vertices of the geometry's boundary that were merged into neighbours.
    pub merged: u64,
    /// Tets with a smaller angle than `angle` in the mesh before.
    pub bad_before: u64,
    /// Tets with a smaller angle than `angle` in the mesh afterwards.
    pub bad_after: u64,
    /// The smallest dihedral angle of the mesh before, degrees.
    pub smallest_before: f64,
    /// The smallest dihedral angle of the mesh afterwards, degrees.
    pub smallest_after: f64,
}

/// **Collective.** Improves the tets near interfaces; what is not near a bad one stays as it is.
///
/// Ids change: those of the result have no gaps. The parts may be uneven afterwards.
///
/// # Errors
/// The same on all ranks: memory, what the ranks cannot say.
pub fn improve_across(
    comm: &dyn Communicator,
    mut mesh: BareMesh,
    settings: &Settings,
) -> Result<(BareMesh, Option<Report>), MigrateError> {
    let mut report = Report { angle: settings.angle, ..Report::default() };
    (report.smallest_before, report.bad_before) = angles(comm, &mesh, settings.angle)?;
    for round in 0..settings.rounds {
        let bad = regions::bad_tets(&mesh, settings.angle);
        if comm.all_reduce_sum_u64([bad.len() as u64])? == [0] {
            break;
        }
        let regions = regions::around(comm, &mesh, &bad, round)?;
        let mine = regions.tets_to(comm, &mesh)?;
        let (moved, sent) = migrate::migrate_bare(comm, mesh, &regions.to, &migrate::Settings::default())?;
        let reworked = rework::rework(&moved, &mine, settings);
        let counts = [mine.len() as u64, sent.tets, reworked.merged];
        mesh = renumber::put_back(comm, moved, reworked)?;
        let [tets, moved, merged] = comm.all_reduce_sum_u64(counts)?;
        report.rounds += 1;
        report.tets += tets;
        report.moved += moved;
        report.merged += merged;
    }
    if report.rounds == 0 {
        return Ok((mesh, None));
    }
    (report.smallest_after, report.bad_after) = angles(comm, &mesh, settings.angle)?;
    Ok((mesh, Some(report)))
}

/// **Collective.** The smallest dihedral angle of the mesh, degrees, and how many tets have a smaller one than `angle`.
fn angles(comm: &dyn Communicator, mesh: &BareMesh, angle: f64) -> Result<(f64, u64), CommError> {
    let (mut smallest, mut bad) = (f64::INFINITY, 0);
    for tet in 0..mesh.tets.len() {
        let here = regions::smallest_angle(mesh, tet);
        smallest = smallest.min(here);
        bad += u64::from(here < angle);
    }
    Ok((comm.all_reduce_min_f64([smallest])?[0], comm.all_reduce_sum_u64([bad])?[0]))
}
