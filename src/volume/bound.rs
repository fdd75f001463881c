//! From the surface to tets that fill its bodies, with no more points than the surface needs.

use super::constraints::Constraints;
use super::recover::{Recovery, lock_facets};
use super::tetrahedra::{NONE, Tetrahedra};
use super::{ClosedSurface, Report, VolumeError, carve, delaunay, finish, inside, relocate};
use crate::Point;

/// How often the recovery is begun anew, taking edges and facets in another order, where it fails. Of 360 prisms twisted nearly to their limit,
/// blocks with crossing notches, skins, staircases, spikes and lenses two need one; prisms of 50 sides some (`MOST_HELP` mostly ends
/// these before).
const ATTEMPTS: u32 = 40;

/// No attempt is begun after so many helping flips were tried: some tens of seconds. The second is mostly the last where thousands of
/// edges are missing and do not come back, as where sheets come nearer and nearer to each other; forty would take an hour.
const MOST_HELP: u64 = 3_000_000;

/// The bodies in as few tets as the surface needs: its facets locked, nothing outside of them.
pub(super) fn bound(
    surface: &ClosedSurface,
    points: &[Point],
    report: &mut Report,
) -> Result<(Tetrahedra, Constraints), VolumeError> {
    let mut fewest: Option<Vec<u32>> = None;
    let mut help = 0;
    for attempt in 0..ATTEMPTS {
        if help > MOST_HELP {
            break;
        }
        report.restarts = attempt as usize;
        match attempt_to_bound(surface, points, attempt, &mut help, report) {
            Ok(tets) => return Ok(tets),
            Err(Stop::Inconsistent(error)) => return Err(error),
            Err(Stop::Left(left)) => {
                if fewest.as_ref().is_none_or(|other| left.len() < other.len()) {
                    fewest = Some(left);
                }
            }
        }
    }
    Err(finish::not_recovered(surface, fewest.expect("an attempt was made")))
}

/// Why an attempt ended.
enum Stop {
    /// These triangles could not be recovered, or not without Steiner points on them: another attempt may.
    Left(Vec<u32>),
    /// The surface is wrong.
    Inconsistent(VolumeError),
}

fn attempt_to_bound(
    surface: &ClosedSurface,
    points: &[Point],
    attempt: u32,
    help: &mut u64,
    report: &mut Report,
) -> Result<(Tetrahedra, Constraints), Stop> {
    let mut tets = delaunay::delaunay(points, &surface.triangles);
    let mut constraints = Constraints::new(&surface.triangles);
    let mut recovery = Recovery::new(&mut tets, &mut constraints, attempt);
    let recovered = recovery.run();
    let counts = recovery.counts;
    *help += recovery.help_spent();
    let (steiner, helping) = (std::mem::take(&mut recovery.steiner), std::mem::take(&mut recovery.helping));
    report.missing_edges = counts.missing_edges;
    report.missing_faces = counts.missing_faces;
    report.steiner_on_surface = steiner.len();
    recovered.map_err(|left| Stop::Left(finish::triangles_of(&constraints, &left)))?;
    lock_facets(&mut tets, &constraints);
    carve::carve(&mut tets, &constraints, &surface.regions, points.len() as u32).map_err(|d| {
        let place = surface.points[surface.triangles[d.triangle as usize][0] as usize];
        Stop::Inconsistent(VolumeError::Inconsistent { triangle: d.triangle, place, regions: d.regions })
    })?;
    let (inside, stayed) = relocate::relocate(&mut tets, &mut constraints, &surface.triangles, &steiner);
    if !stayed.is_empty() {
        let left: Vec<u32> = stayed.iter().flat_map(|&p| constraints.facets_at(p)).collect();
        return Err(Stop::Left(finish::triangles_of(&constraints, &left)));
    }
    let helping = helping.into_iter().filter(|&v| tets.at_vertex[v as usize] != NONE);
    let inside = inside.into_iter().chain(helping.collect::<Vec<_>>()).collect();
    report.steiner_inside = inside::delete(&mut tets, &constraints, inside);
    Ok((tets, constraints))
}
