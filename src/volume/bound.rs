//! From the surface to tets that fill its bodies, with no more points than the surface needs.

use super::constraints::Constraints;
use super::recover::{Recovery, Unrecovered, lock_facets};
use super::tetrahedra::{NONE, Tetrahedra};
use super::{ClosedSurface, Report, VolumeError, carve, delaunay, finish, intersect, relocate};
use crate::Point;
use crate::kernel::simplex::area_vector;

/// How often the recovery is begun anew where it fails. Of 1500 skins of random bodies in a lattice 4 need a second
/// attempt, of six turned cubes with flat grids of 20 to 100 squares a side one does; none was seen to need a third.
const ATTEMPTS: u32 = 5;

/// Helping points stand off the surface by this fraction of the root of a triangle's doubled area. Not a
/// round number, so that they do not lie on the other side of a plate.
const STAND_OFF: f64 = 0.37;

/// The bodies in as few tets as the surface needs: its facets locked, nothing outside of them.
///
/// Where the surface is flat up to rounding, the Delaunay mesh stacks slivers on it that no flip may be able to
/// rearrange. Each further attempt has **helping points** on both sides of the triangles that were not recovered:
/// inside the slivers' circumspheres, so that these are gone. Those outside of the bodies are carved away in the end.
pub(super) fn bound(
    surface: &ClosedSurface,
    mut points: Vec<Point>,
    scale: f64,
    report: &mut Report,
) -> Result<Tetrahedra, VolumeError> {
    let mut attempt = 0;
    loop {
        match attempt_to_bound(surface, &points, scale, attempt, report) {
            Err(VolumeError::NotRecovered { triangles: suspects, places }) => {
                let found = intersect::intersections(&surface.points, &surface.triangles, &suspects);
                if !found.is_empty() {
                    let (triangles, places) = found.into_iter().unzip();
                    return Err(VolumeError::SelfIntersection { triangles, places });
                }
                attempt += 1;
                if attempt == ATTEMPTS {
                    return Err(VolumeError::NotRecovered { triangles: suspects, places });
                }
                add_helping_points(&mut points, surface, &suspects, STAND_OFF / f64::from(attempt));
            }
            result => return result,
        }
    }
}

/// Adds points over and under the middle of some triangles.
fn add_helping_points(points: &mut Vec<Point>, surface: &ClosedSurface, triangles: &[u32], stand_off: f64) {
    for &t in triangles {
        let [a, b, c] = surface.triangles[t as usize].map(|v| points[v as usize]);
        let normal = area_vector(&a, &b, &c);
        let center = Point::from((a.coords + b.coords + c.coords) / 3.0);
        let away = normal * (stand_off / normal.norm().sqrt());
        for point in [center + away, center - away] {
            if !points.contains(&point) {
                points.push(point);
            }
        }
    }
}

/// One attempt; `points` are those of the surface, then helping points.
fn attempt_to_bound(
    surface: &ClosedSurface,
    points: &[Point],
    scale: f64,
    attempt: u32,
    report: &mut Report,
) -> Result<Tetrahedra, VolumeError> {
    let mut tets = delaunay::delaunay(points);
    let mut constraints = Constraints::new(&surface.triangles);
    // Each Steiner point brings an end nearer, but rounding may spoil that: stop where they are many more than points.
    let mut recovery = Recovery::new(&mut tets, &mut constraints, 2 * points.len() + 100, attempt);
    let recovered = recovery.run();
    let (counts, steiner) = (recovery.counts, std::mem::take(&mut recovery.steiner));
    report.missing_edges = counts.missing_edges;
    report.missing_faces = counts.missing_faces;
    report.steiner_on_surface = steiner.len();
    recovered.map_err(|left| finish::not_recovered(surface, &constraints, &left, scale))?;
    lock_facets(&mut tets, &constraints);
    let far = points.len();
    carve::carve(&mut tets, &constraints, &surface.regions, far as u32).map_err(|d| {
        let place = surface.points[surface.triangles[d.triangle as usize][0] as usize];
        VolumeError::Inconsistent { triangle: d.triangle, place, regions: d.regions }
    })?;
    let (inside, stayed) = relocate::relocate(&mut tets, &mut constraints, &surface.triangles, &steiner);
    if !stayed.is_empty() {
        let facets = stayed.iter().flat_map(|&p| constraints.facets_at(p)).collect();
        let left = Unrecovered { facets, intersections: Vec::new() };
        return Err(finish::not_recovered(surface, &constraints, &left, scale));
    }
    let helping = tets.at_vertex[surface.points.len()..far].iter().filter(|&&t| t != NONE).count();
    report.steiner_inside = inside.len() + helping;
    Ok(tets)
}
