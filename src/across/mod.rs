//! Better tets across interfaces, where parts were meshed each on its own.
//!
//! A rank that meshes its part keeps the triangles of the interfaces; so where these are narrow, or cross at a small angle, tets beside them are as
//! bad, and no rank alone can mend them. Here the tets around each bad one near an interface go to one rank, for which the interface is then nothing
//! but faces inside a body:
//!
//! ```text
//!   bad tets ──► regions round them ──► each to one rank ──► improved ──► ids without gaps ──► back to the ranks they came from
//!             (labels over interfaces)    (migrate_bare)     (no message)  (a scan, a list)     (migrate_bare)
//! ```
//!
//! The surface of each region stays as it is ([`improve`]), so all still fits; and so does the boundary of the geometry, but for vertices that only
//! a cut needed ([`Settings::merge_angle`]). No angle in a region gets smaller than its smallest. Then each tet goes to the rank that had its place before: parts stay where
//! they were, as even and as connected, and what is still bad is beside an interface as before. Regions of a round may meet; so there are several rounds, with other regions in
//! each. Where three or more parts meet is inside of a region like any other place. What costs time grows with the bad tets, not with the mesh.
//!
//! Compared: migrating whole layers beside all interfaces (as ParMmg does: Cirrottola, Froehly 2019) moves most of small parts, good
//! or bad; operations that only touch one rank leave the narrow triangles, which are the reason. Regions that stay where they were improved (as here at first) make parts
//! ragged, with islands, and take what is still bad away from the interfaces, by which it is found.

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
    /// For each round: tets near interfaces with a smaller dihedral angle than this are bad, degrees.
    pub angles: Vec<f64>,
    /// The rounds instead if more than a hundredth of all tets are worse than the first of these angles, degrees.
    pub angles_if_many: Vec<f64>,
    /// At tets with a smaller angle than this, degrees, vertices of the geometry's boundary may be merged into neighbours: where cuts have left them too
    /// near.
    pub merge_angle: Option<f64>,
    /// How regions are improved.
    pub improve: improve::Settings,
}

impl Default for Settings {
    /// First the tets that the 1st percentile depends on, then the worst. A ball of 1.5 million tets in 64 parts has a 1st percentile of 34.6° so, with 0.8
    /// million tets in regions; with two rounds of 34° and two of 30° it is 34.9°, with 1.9 million and in twice the time. With 30° alone those of cubes
    /// in 64 parts are 2° below the one on one rank; and with 32° that of a ball of 0.1 million tets, where parts are nothing but interfaces.
    ///
    /// Vertices of an interface are merged and added where tets are worse than 0.75, as there may be too many: at 0.6, usual inside of parts, the thin wall
    /// of a pipe tee in 64 parts has a 1st percentile of 26°, then 29.5°.
    fn default() -> Self {
        let improve = improve::Settings {
            passes: 4,
            change_below: 0.75,
            ..improve::Settings::of(improve::Effort::Careful)
        };
        Self {
            angles: vec![32.0, 30.0, 30.0],
            angles_if_many: vec![34.0, 34.0, 30.0, 30.0],
            merge_angle: Some(30.0),
            improve,
        }
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
    let largest = |angles: &[f64]| angles.iter().copied().fold(0.0, f64::max);
    let choices = [&settings.angles, &settings.angles_if_many];
    let first = settings.angles.first().copied().unwrap_or(0.0);
    let (smallest, [worse, few, many]) =
        smallest_and_bad(comm, &mesh, [first, largest(choices[0]), largest(choices[1])])?;
    let [tets] = comm.all_reduce_sum_u64([mesh.tets.len() as u64])?;
    let (angles, bad) = if worse > tets / 100 { (choices[1], many) } else { (choices[0], few) };
    let angle = largest(angles);
    let mut report = Report { angle, smallest_before: smallest, bad_before: bad, ..Report::default() };
    for (round, &angle) in (0..).zip(angles) {
        let bad = regions::bad_tets(&mesh, angle);
        if comm.all_reduce_sum_u64([bad.len() as u64])? == [0] {
            break;
        }
        let regions = regions::around(comm, &mesh, &bad, round)?;
        let mine = regions.tets_to(comm, &mesh)?;
        let (moved, sent) = migrate::migrate_bare(comm, mesh, &regions.to, &migrate::Settings::default())?;
        let reworked = rework::rework(&moved, &mine, settings);
        let counts = [mine.len() as u64, sent.tets, reworked.merged];
        let (improved, home) = renumber::put_back(comm, moved, reworked)?;
        (mesh, _) = migrate::migrate_bare(comm, improved, &home, &migrate::Settings::default())?;
        let [tets, moved, merged] = comm.all_reduce_sum_u64(counts)?;
        report.rounds += 1;
        report.tets += tets;
        report.moved += moved;
        report.merged += merged;
    }
    if report.rounds == 0 {
        return Ok((mesh, None));
    }
    (report.smallest_after, [report.bad_after]) = smallest_and_bad(comm, &mesh, [angle])?;
    Ok((mesh, Some(report)))
}

/// **Collective.** The smallest dihedral angle of the mesh, degrees, and how many tets have a smaller one than each of some angles.
fn smallest_and_bad<const N: usize>(
    comm: &dyn Communicator,
    mesh: &BareMesh,
    angles: [f64; N],
) -> Result<(f64, [u64; N]), CommError> {
    let (mut smallest, mut bad) = (f64::INFINITY, [0; N]);
    for tet in 0..mesh.tets.len() {
        let here = regions::smallest_angle(mesh, tet);
        smallest = smallest.min(here);
        bad.iter_mut().zip(angles).for_each(|(bad, angle)| *bad += u64::from(here < angle));
    }
    Ok((comm.all_reduce_min_f64([smallest])?[0], comm.all_reduce_sum_u64(bad)?))
}
