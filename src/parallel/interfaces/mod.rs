//! Interface improvement: better tets near interfaces between parts that were meshed independently.
//!
//! A rank that meshes its part keeps the triangles of the interfaces. If these are narrow, or cross
//! at a small angle, the tets next to them are bad, and no rank alone can repair them. Here the
//! tets around each bad one near an interface migrate to one rank, for which the interface then
//! consists of ordinary interior faces:
//!
//! ```text
//!     bad tets ──► regions around them ──► each to one rank ──► improved ──► ids without gaps ──► back to their ranks
//!          (labels across interfaces)    (migrate_bare)     (no message)    (a scan, a list)   (migrate_bare)
//! ```
//!
//! The surface of each region is kept ([`improve`]), so regions remain conforming. The boundary of
//! the geometry is kept too, except for vertices that only a cut required
//! ([`Settings::merge_angle`]). The smallest angle of a region never decreases. Afterwards each tet
//! goes to the rank that had its position before, so parts keep their shape, balance and
//! connectivity, and tets that are still bad are again next to an interface. Regions of one round
//! may touch, so each round uses different regions. Points where three or more parts meet need no
//! special case. The cost is proportional to the number of bad tets, not to the mesh.
//!
//! Alternatives: migrating whole layers next to all interfaces (ParMmg: Cirrottola, Froehly 2019)
//! moves most of a small part, good or bad. Operations local to one rank cannot remove the narrow
//! triangles, which are the cause. Keeping regions on the rank that improved them makes parts
//! ragged and disconnected, and moves the remaining bad tets away from the interfaces by which they
//! are found.

mod merge;
mod regions;
mod renumber;
mod rework;

#[cfg(test)]
mod tests;

use crate::ground::comm::{CommError, Communicator};
use crate::ground::mesh::periodic::Link;
use crate::mesher::improve::{self, Effort, Measure, Smoothness};
use crate::parallel::distribution::BareMesh;
use crate::parallel::migrate::{self, MigrateError};
use crate::parallel::repartition::periodic::touching;

/// Parameters of `improve_across`.
#[derive(Clone, Debug)]
pub struct Settings {
    /// For each round, the dihedral angle in degrees below which tets near interfaces are bad.
    pub angles: Vec<f64>,
    /// The rounds to use instead if more than one percent of all tets are below the first of
    /// `angles`, degrees.
    pub angles_if_many: Vec<f64>,
    /// At tets with a smaller dihedral angle than this (degrees), boundary vertices may be merged
    /// into neighbours that a cut has left too close ([`MERGE_ANGLE`]); `None` for no merging.
    pub merge_angle: Option<f64>,
    /// Settings for the improvement of regions.
    pub improve: improve::Settings,
}

/// See [`Settings::merge_angle`], degrees.
pub const MERGE_ANGLE: f64 = 30.0;

impl Settings {
    /// The settings for a mesh whose tets are measured like this.
    ///
    /// The first round treats the tets that determine the 1st percentile of the angles, later ones
    /// the worst. With 30° alone, cubes in 64 parts stay 2° below one part. The gain of more rounds
    /// is small: for a ball of 1.5 million tets in 64 parts, twice the time (two rounds of 34° and
    /// two of 30°) raised the 1st percentile by 0.3°.
    ///
    /// Vertices of an interface are merged and inserted at tets of higher quality than usual inside
    /// parts, because there may be too many of them. With the usual threshold, the thin-walled pipe
    /// tee in 64 parts had a 1st percentile of 26° instead of 29.5°.
    pub fn of(measure: Measure) -> Self {
        let (target, change_below) = match measure {
            Measure::Refined => (0.85, 0.75),
            Measure::MeanRatio => (0.8, 0.65),
        };
        let usual = improve::Settings::of(Effort::Careful, measure);
        Self {
            angles: vec![32.0, 30.0, 30.0],
            angles_if_many: vec![34.0, 34.0, 30.0, 30.0],
            merge_angle: Some(MERGE_ANGLE),
            improve: improve::Settings { passes: 4, target, change_below, ..usual },
        }
    }
}

/// Statistics of `improve_across`, the same on all ranks.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct InterfaceReport {
    /// The angle below which tets are bad, degrees.
    pub angle: f64,
    /// The number of rounds.
    pub rounds: u32,
    /// Tets in regions, summed over rounds.
    pub tets: u64,
    /// Tets that migrated to another rank for improvement.
    pub moved: u64,
    /// Boundary vertices that were merged into neighbours.
    pub merged: u64,
    /// Tets with a dihedral angle below `angle` before.
    pub bad_before: u64,
    /// Tets with a dihedral angle below `angle` after.
    pub bad_after: u64,
    /// The smallest dihedral angle of the mesh before, degrees.
    pub smallest_before: f64,
    /// The smallest dihedral angle of the mesh after, degrees.
    pub smallest_after: f64,
}

/// **Collective.** Improves the tets near interfaces; tets that are not near a bad one do not
/// change.
///
/// Vertex and tet ids are renumbered without gaps. The parts may be slightly uneven afterwards. The
/// report is `None` if no tet was bad. `smoothness` is that of the geometry if the mesh will be
/// refined: then no tet becomes one that refinement would flatten. Tets that touch the periodic
/// patches of `links` do not change.
///
/// # Errors
/// [`MigrateError`] if memory runs out or another rank fails. All ranks return an error.
pub fn improve_across(
    comm: &dyn Communicator,
    mut mesh: BareMesh,
    links: &[Link],
    settings: &Settings,
    smoothness: Option<&dyn Smoothness>,
) -> Result<(BareMesh, Option<InterfaceReport>), MigrateError> {
    let largest = |angles: &[f64]| angles.iter().copied().fold(0.0, f64::max);
    let choices = [&settings.angles, &settings.angles_if_many];
    let first = settings.angles.first().copied().unwrap_or(0.0);
    let (smallest, [worse, few, many]) =
        smallest_and_bad(comm, &mesh, [first, largest(choices[0]), largest(choices[1])])?;
    let [tets] = comm.all_reduce_sum_u64([mesh.tets.len() as u64])?;
    let (angles, bad) = if worse > tets / 100 { (choices[1], many) } else { (choices[0], few) };
    let angle = largest(angles);
    let mut report =
        InterfaceReport { angle, smallest_before: smallest, bad_before: bad, ..InterfaceReport::default() };
    for (round, &angle) in (0..).zip(angles) {
        let bad = regions::bad_tets(&mesh, angle);
        if comm.all_reduce_sum_u64([bad.len() as u64])? == [0] {
            break;
        }
        let fixed = touching(comm, &mesh, links)?;
        let regions = regions::around(comm, &mesh, (&bad, &fixed), round)?;
        let mine = regions.tets_to(comm, &mesh)?;
        let (moved, sent) =
            migrate::migrate_bare(comm, mesh, &regions.to, &migrate::MoveSettings::default())?;
        let reworked = rework::rework(&moved, &mine, settings, smoothness);
        let counts = [mine.len() as u64, sent.tets, reworked.merged];
        let (improved, destination) = renumber::put_back(comm, moved, reworked)?;
        (mesh, _) = migrate::migrate_bare(comm, improved, &destination, &migrate::MoveSettings::default())?;
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

/// **Collective.** The smallest dihedral angle of the mesh in degrees, and for each of `angles` the
/// number of tets with a smaller one.
fn smallest_and_bad<const N: usize>(
    comm: &dyn Communicator,
    mesh: &BareMesh,
    angles: [f64; N],
) -> Result<(f64, [u64; N]), CommError> {
    let (mut largest, mut bad) = (-1.0, [0; N]);
    let cosines = angles.map(|angle| angle.to_radians().cos());
    for tet in &mesh.tets {
        let here = regions::cosine(mesh, tet);
        largest = here.max(largest);
        bad.iter_mut().zip(cosines).for_each(|(bad, cosine)| *bad += u64::from(here > cosine));
    }
    let smallest = largest.acos().to_degrees();
    Ok((comm.all_reduce_min_f64([smallest])?[0], comm.all_reduce_sum_u64(bad)?))
}
