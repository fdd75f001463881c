//! Checks that a mesh fills a surface, through public interfaces only.

use super::volumes::{assert_same_volumes, volumes_by_surface, volumes_by_tets};
use super::{BodyId, ClosedSurface, Sign, TET_FACES, VolumeMesh, orient3d};
use std::collections::BTreeMap;

/// Checks all guarantees of a volume mesh with respect to its surface; panics if one is violated.
pub fn check_fills(surface: &ClosedSurface, mesh: &VolumeMesh) {
    assert_eq!(mesh.points[..surface.points().len()], surface.points()[..]);
    assert_eq!(mesh.tets.len(), mesh.bodies.len());
    let mut used = vec![false; mesh.points.len()];
    let mut sides: BTreeMap<[u32; 3], Vec<([u32; 3], BodyId)>> = BTreeMap::new();
    for (tet, &body) in mesh.tets.iter().zip(&mesh.bodies) {
        let [a, b, c, d] = tet.map(|v| &mesh.points[v as usize]);
        assert_eq!(orient3d(a, b, c, d), Sign::Positive, "tet {tet:?} at {a}");
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
    let by_surface = volumes_by_surface(surface.points(), surface.triangles(), surface.regions());
    let by_tets = volumes_by_tets(&mesh.points, mesh.tets.iter().zip(mesh.bodies.iter().copied()));
    assert_same_volumes("the surface and its tets", &by_surface, &by_tets);
}

fn sorted(mut face: [u32; 3]) -> [u32; 3] {
    face.sort_unstable();
    face
}

/// Whether two permutations of the same three vertices have the same orientation.
fn is_even(face: [u32; 3], other: [u32; 3]) -> bool {
    (0..3).any(|k| face == [other[k], other[(k + 1) % 3], other[(k + 2) % 3]])
}
