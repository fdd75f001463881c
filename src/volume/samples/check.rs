//! The check that a mesh fills a surface, by what callers can see of both.

use super::{BodyId, ClosedSurface, Point, Sign, TET_FACES, VolumeMesh, orient3d, volume6};
use std::collections::BTreeMap;

/// The volume of each body by the surface integral, and the sum of what cancels in it.
fn volumes_by_surface(surface: &ClosedSurface) -> BTreeMap<BodyId, [f64; 2]> {
    let mut volumes = BTreeMap::new();
    let center = surface.points()[0];
    for (triangle, [behind, front]) in surface.triangles().iter().zip(surface.regions()) {
        let [a, b, c] = triangle.map(|v| &surface.points()[v as usize]);
        let v = volume6(&center, a, b, c) / 6.0;
        for (region, sign) in [(behind, 1.0), (front, -1.0)] {
            if let Some(body) = region {
                let [sum, all] = volumes.entry(*body).or_insert([0.0; 2]);
                *sum += sign * v;
                *all += v.abs();
            }
        }
    }
    volumes
}

/// Everything that a volume mesh promises of its surface; panics with what is broken.
pub fn check_fills(surface: &ClosedSurface, mesh: &VolumeMesh) {
    assert_eq!(mesh.points[..surface.points().len()], surface.points()[..]);
    assert_eq!(mesh.tets.len(), mesh.bodies.len());
    let mut used = vec![false; mesh.points.len()];
    let mut sides: BTreeMap<[u32; 3], Vec<([u32; 3], BodyId)>> = BTreeMap::new();
    let mut volumes: BTreeMap<BodyId, f64> = BTreeMap::new();
    for (tet, &body) in mesh.tets.iter().zip(&mesh.bodies) {
        let [a, b, c, d] = tet.map(|v| &mesh.points[v as usize]);
        assert_eq!(orient3d(a, b, c, d), Sign::Positive, "tet {tet:?} at {a}");
        *volumes.entry(body).or_insert(0.0) += volume6(a, b, c, d) / 6.0;
        for face in TET_FACES {
            let face = face.map(|i| tet[i]);
            sides.entry(sorted(face)).or_default().push((face, body));
        }
        tet.iter().for_each(|&v| used[v as usize] = true);
    }
    assert!(used.iter().all(|&u| u), "a vertex without tets");
    for (&triangle, &[behind, front]) in surface.triangles().iter().zip(surface.regions()) {
        let found = sides.remove(&sorted(triangle)).unwrap_or_default();
        for (region, outward) in [(behind, true), (front, false)] {
            let here: Vec<BodyId> = found
                .iter()
                .filter(|(face, _)| is_even(*face, triangle) == outward)
                .map(|(_, body)| *body)
                .collect();
            assert_eq!(here, region.into_iter().collect::<Vec<_>>(), "beside triangle {triangle:?}");
        }
    }
    for (face, found) in sides {
        assert!(found.len() == 2 && found[0].1 == found[1].1, "face {face:?} inside has {found:?}");
        assert!(!is_even(found[0].0, found[1].0), "face {face:?} has one side twice");
    }
    let expected = volumes_by_surface(surface);
    assert_eq!(expected.keys().collect::<Vec<_>>(), volumes.keys().collect::<Vec<_>>());
    // A thin body's volume is known as well as its points are.
    let diagonal = diagonal_of(surface.points());
    for (body, [v, all]) in expected {
        let error = (volumes[&body] - v).abs();
        let allowed = 1e-12 * all + 1e-15 * diagonal.powi(3);
        assert!(error < allowed, "body {body:?}: {} instead of {v}", volumes[&body]);
    }
}

fn diagonal_of(points: &[Point]) -> f64 {
    let (low, high) = points.iter().fold((points[0], points[0]), |(l, h), p| (l.inf(p), h.sup(p)));
    (high - low).norm()
}

fn sorted(mut face: [u32; 3]) -> [u32; 3] {
    face.sort_unstable();
    face
}

/// Whether two lists of the same three vertices go round the same way.
fn is_even(face: [u32; 3], other: [u32; 3]) -> bool {
    (0..3).any(|k| face == [other[k], other[(k + 1) % 3], other[(k + 2) % 3]])
}
