//! Checks meshes of tetmill and TetGen inside the same surface, and measures their quality.

use crate::samples::volumes::{assert_same_volumes, volumes_by_surface, volumes_by_tets};
use csg::BodyId;
use std::collections::{BTreeMap, BTreeSet};
use tetgen_ffi::{Error, TetgenMesh, tetrahedralize};
use tetmill::Point;
use tetmill::internals::volume::ClosedSurface;
use tetmill::mesh::{Mesh, QualitySummary, TET_FACES, VertexId};

/// The bodies behind and in front of each face, by its sorted vertices.
type Sides<R> = BTreeMap<[u32; 3], [Option<R>; 2]>;

/// The sorted vertices, and whether the permutation is even.
fn sorted(mut face: [u32; 3]) -> ([u32; 3], bool) {
    let before = face;
    face.sort_unstable();
    (face, (0..3).any(|k| face == [before[k], before[(k + 1) % 3], before[(k + 2) % 3]]))
}

/// The faces of tets with the bodies on both sides.
fn sides<R: Copy>(tets: impl Iterator<Item = ([u32; 4], R)>) -> Sides<R> {
    let mut sides = Sides::new();
    for (tet, region) in tets {
        for face in TET_FACES {
            let (face, outward) = sorted(face.map(|k| tet[k]));
            let side = &mut sides.entry(face).or_insert([None; 2])[usize::from(!outward)];
            assert!(side.replace(region).is_none(), "the face {face:?} has one side twice");
        }
    }
    sides
}

/// The surface around and between the bodies of a mesh; its vertices come first in the mesh.
pub fn surface_of(mesh: &Mesh) -> ClosedSurface {
    let tets = mesh.tets.iter().map(|t| t.map(|v| v.0)).zip(mesh.bodies.iter().copied());
    let (triangles, regions): (Vec<[u32; 3]>, Vec<_>) =
        sides(tets).into_iter().filter(|(_, [behind, front])| behind != front).unzip();
    let used: BTreeSet<u32> = triangles.iter().flatten().copied().collect();
    assert!(used.iter().copied().eq(0..used.len() as u32), "the surface's points come first");
    ClosedSurface::new(mesh.points[..used.len()].to_vec(), triangles, regions).unwrap()
}

/// Asserts that tets fill a surface exactly.
///
/// The points come first, the triangles separate the same bodies, no other faces do, and each body
/// has its volume. A triangle inside one body only needs to be a face.
fn check_fills(what: &str, surface: &ClosedSurface, points: &[Point], tets: &[([u32; 4], BodyId)]) {
    assert!(points[..surface.points().len()] == *surface.points(), "{what}: other points");
    let mut found = sides(tets.iter().copied());
    for (&triangle, &[behind, front]) in surface.triangles().iter().zip(surface.regions()) {
        let (face, same) = sorted(triangle);
        let expected = if same { [behind, front] } else { [front, behind] };
        assert_eq!(found.remove(&face), Some(expected), "{what}: beside triangle {triangle:?}");
    }
    let other = found.iter().find(|(_, [behind, front])| behind != front);
    assert_eq!(other, None, "{what}: a boundary triangle that the surface does not have");
    let by_surface = volumes_by_surface(surface.points(), surface.triangles(), surface.regions());
    let by_tets = volumes_by_tets(points, tets.iter().map(|(tet, body)| (tet, *body)));
    assert_same_volumes(what, &by_surface, &by_tets);
}

/// Asserts that tetmill's tets fill a surface, and returns their quality.
pub fn check_ours(what: &str, surface: &ClosedSurface, mesh: &Mesh) -> QualitySummary {
    let tets: Vec<_> = mesh.tets.iter().map(|t| t.map(|v| v.0)).zip(mesh.bodies.iter().copied()).collect();
    check_fills(what, surface, &mesh.points, &tets);
    QualitySummary::of(mesh)
}

/// The quality of TetGen's mesh of a surface, made with `switches`; asserts that it fills the
/// surface.
///
/// TetGen does not know the bodies: it also fills voids and numbers each region between facets
/// (`A`). The sides of the triangles identify the body of each region.
///
/// # Errors
/// If TetGen rejects the input or crashes.
pub fn check_theirs(what: &str, surface: &ClosedSurface, switches: &str) -> Result<QualitySummary, Error> {
    let points: Vec<[f64; 3]> = surface.points().iter().map(|&p| p.into()).collect();
    let made = tetrahedralize(&points, surface.triangles(), &format!("pYA{switches}"))?;
    let points: Vec<Point> = made.points.iter().map(|&p| p.into()).collect();
    let tets = in_bodies(what, surface, &made);
    check_fills(what, surface, &points, &tets);
    let tets: Vec<[VertexId; 4]> = tets.iter().map(|(tet, _)| tet.map(VertexId)).collect();
    Ok(QualitySummary::of_tets(&points, &tets))
}

/// The tets in bodies, without those in voids.
fn in_bodies(what: &str, surface: &ClosedSurface, made: &TetgenMesh) -> Vec<([u32; 4], BodyId)> {
    assert_eq!(made.tets.len(), made.regions.len(), "{what}: TetGen gives each tet a region");
    let numbered = || made.tets.iter().copied().zip(made.regions.iter().copied());
    let found = sides(numbered());
    let mut bodies = BTreeMap::<i32, Option<BodyId>>::new();
    for (&triangle, &[behind, front]) in surface.triangles().iter().zip(surface.regions()) {
        let (face, same) = sorted(triangle);
        let regions = if same { [behind, front] } else { [front, behind] };
        let numbers = found.get(&face).unwrap_or_else(|| panic!("{what}: TetGen lost triangle {triangle:?}"));
        for (number, body) in numbers.iter().zip(regions) {
            let Some(number) = *number else { continue };
            let before = *bodies.entry(number).or_insert(body);
            assert_eq!(before, body, "{what}: TetGen's region {number} beside triangle {triangle:?}");
        }
    }
    numbered().filter_map(|(tet, number)| bodies[&number].map(|body| (tet, body))).collect()
}
