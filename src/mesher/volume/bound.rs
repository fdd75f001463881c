//! From the closed surface to tets that fill its bodies, with no more points than the surface
//! needs.

use super::constraints::Constraints;
use super::recover::{Recovery, lock_facets};
use super::tetrahedra::Tetrahedra;
use super::{ClosedSurface, Report, VolumeError, carve, delaunay, finish, inside, relocate, round};
use crate::Point;
use std::collections::BTreeSet;

/// Attempts per surface, each with another order of edges and triangles. An attempt fails if a
/// Steiner point finds no position inside in double precision; blocks with 30 crossing notches need
/// up to five.
const ATTEMPTS: u32 = 6;

/// Meshes the bodies with as few tets as the surface needs: facets are locked faces, and all tets
/// are inside.
///
/// Makes up to [`ATTEMPTS`] attempts.
///
/// # Errors
/// [`VolumeError::Inconsistent`] if triangles assign different bodies to one region, and the error
/// of [`finish::not_recovered`], for the best attempt, if no attempt recovers all triangles.
pub(super) fn bound(
    surface: &ClosedSurface,
    points: &[Point],
    report: &mut Report,
) -> Result<(Tetrahedra, Constraints), VolumeError> {
    let mut fewest: Option<Vec<u32>> = None;
    for attempt in 0..ATTEMPTS {
        report.restarts = attempt as usize;
        match attempt_to_bound(surface, points, attempt, report) {
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

/// Why an attempt failed.
enum Stop {
    /// These triangles were not recovered, or not without Steiner points on them; another attempt
    /// may succeed.
    Left(Vec<u32>),
    /// The surface is inconsistent, so every attempt would fail.
    Inconsistent(VolumeError),
}

fn attempt_to_bound(
    surface: &ClosedSurface,
    points: &[Point],
    attempt: u32,
    report: &mut Report,
) -> Result<(Tetrahedra, Constraints), Stop> {
    let mut tets = delaunay::delaunay(points, &surface.triangles);
    let mut constraints = Constraints::new(&surface.triangles);
    let mut recovery = Recovery::new(&mut tets, &mut constraints, attempt);
    let recovered = recovery.conform();
    let (counts, steiner) = (recovery.counts, std::mem::take(&mut recovery.steiner));
    report.missing_edges = counts.missing_edges;
    report.missing_faces = counts.missing_faces;
    report.steiner_on_surface = steiner.len();
    recovered.map_err(|left| Stop::Left(finish::triangles_of(&constraints, &left)))?;
    lock_facets(&mut tets, &constraints);
    carve::carve(&mut tets, &constraints, &surface.regions, points.len() as u32).map_err(|d| {
        let place = surface.points[surface.triangles[d.triangle as usize][0] as usize];
        Stop::Inconsistent(VolumeError::Inconsistent { triangle: d.triangle, place, regions: d.regions })
    })?;
    let (mut inside, stayed) = relocate::relocate(&mut tets, &mut constraints, &surface.triangles, &steiner);
    if !stayed.is_empty() {
        let left: Vec<u32> = stayed.iter().flat_map(|&p| constraints.facets_at(p)).collect();
        return Err(Stop::Left(finish::triangles_of(&constraints, &left)));
    }
    inside::delete(&mut tets, &constraints, &mut inside);
    let rough = round::round(&mut tets, &constraints, &mut inside);
    if !rough.is_empty() {
        return Err(Stop::Left(triangles_near(&mut tets, &surface.triangles, &rough)));
    }
    tets.forget_exact();
    report.steiner_inside = inside.len();
    Ok((tets, constraints))
}

/// The triangles that have a corner adjacent to one of the vertices `inside`.
fn triangles_near(tets: &mut Tetrahedra, triangles: &[[u32; 3]], inside: &[u32]) -> Vec<u32> {
    let mut star = Vec::new();
    let mut beside = BTreeSet::new();
    for &q in inside {
        beside.extend(tets.neighbours(q, &mut star));
    }
    let has_any = |t: &u32| triangles[*t as usize].iter().any(|v| beside.contains(v));
    (0..triangles.len() as u32).filter(has_any).collect()
}

#[cfg(test)]
mod tests {
    use super::super::samples::{Soup, check_fills, notched_block, twist_limit, twisted_prisms};
    use super::*;

    #[test]
    fn steiner_points_leave_the_surface_in_any_order() {
        let prism = |sides: u32, layers: u32| twisted_prisms(sides, -0.98 * twist_limit(sides), 1.0, layers);
        let soups: [Soup; 4] = [prism(3, 1), prism(9, 2), notched_block(2, 0.01), notched_block(3, 0.3)];
        for (i, soup) in soups.into_iter().enumerate() {
            let surface = soup.surface().unwrap();
            let scale = finish::scale_of(&surface.points);
            let points: Vec<Point> = surface.points.iter().map(|p| p * scale).collect();
            let mut report = Report::default();
            let Ok((tets, _)) = attempt_to_bound(&surface, &points, i as u32, &mut report) else {
                panic!("surface {i} was not recovered")
            };
            assert!(report.steiner_on_surface > 0, "surface {i} needs points");
            assert_eq!(tets.check(), Vec::<String>::new());
            check_fills(&surface, &finish::finish(&surface, tets, &[], Vec::new(), scale));
        }
    }
}
