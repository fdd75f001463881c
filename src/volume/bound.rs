//! From the surface to tets that fill its bodies, with no more points than the surface needs.

use super::constraints::Constraints;
use super::recover::{Recovery, lock_facets};
use super::tetrahedra::{NONE, Tetrahedra};
use super::{ClosedSurface, Report, VolumeError, carve, delaunay, finish, inside, relocate};
use crate::Point;

/// How often the recovery is begun anew where it fails: by flips, by points alone (`conform`), and so both again in another order. Of 360 prisms
/// twisted nearly to their limit, blocks with crossing notches, skins, staircases, spikes and lenses two need a second.
const ATTEMPTS: u32 = 6;

/// No third attempt and none later is begun after so many helping flips were tried: some tens of seconds. The second is mostly the last where
/// thousands of edges are missing and do not come back, as where sheets come nearer and nearer to each other; more would take an hour.
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
        if attempt >= 2 && help > MOST_HELP {
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
    // By flips with a few points and by points alone in turn: the one makes fewer, the other ends where many edges pass by each other.
    let recovered = if attempt.is_multiple_of(2) { recovery.run() } else { recovery.conform() };
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

#[cfg(test)]
mod tests {
    use super::super::samples::{Soup, check_fills, notched_block, twist_limit, twisted_prisms};
    use super::*;

    #[test]
    fn points_alone_recover_a_surface_and_leave_it_again() {
        let prism = |sides: u32, layers: u32| twisted_prisms(sides, -0.98 * twist_limit(sides), 1.0, layers);
        let soups: [Soup; 4] = [prism(3, 1), prism(9, 2), notched_block(2, 0.01), notched_block(3, 0.3)];
        for (i, soup) in soups.into_iter().enumerate() {
            let surface = soup.surface().unwrap();
            let scale = finish::scale_of(&surface.points);
            let points: Vec<Point> = surface.points.iter().map(|p| p * scale).collect();
            let (mut help, mut report) = (0, Report::default());
            // Odd attempts are those without flips that help.
            let Ok((tets, _)) = attempt_to_bound(&surface, &points, 1, &mut help, &mut report) else {
                panic!("surface {i} was not recovered")
            };
            assert!(report.steiner_on_surface > 0, "surface {i} needs points");
            assert_eq!(tets.check(), Vec::<String>::new());
            check_fills(&surface, &finish::finish(&surface, tets, &[], Vec::new(), scale));
        }
    }
}
