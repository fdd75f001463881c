//! The surfaces of coarse meshes: closed, without intersections, and close to the geometry.

use crate::folders::own_geometries;
use crate::samples::skin_of;
use csg::language::parse_geometry;
use std::path::Path;
use tetmill::internals::{Budget, CsgModel, Model};
use tetmill::mesh::{BoundaryTriangle, Mesh};
use tetmill::progress::Work;
use tetmill::size::{Preset, SizeSettings};
use tetmill::{Point, Vector};

/// Bound of the chord error, relative to the longest side of the triangle over the preset's
/// elements per radius of curvature c.
///
/// For an equilateral triangle of side h the centre is h/√3 from its corners, so the error is h²/6
/// times the curvature; sides are less than 1.5 radii / c long.
const CHORD: f64 = 0.25;

/// Bound of the chord error near the apex of a cone, relative to the longest side: that of a circle
/// with three chords, half a radius over √3 radii.
const CHORD_AT_APEX: f64 = 0.29;

/// Largest distance of the midpoints of a triangle and its sides from the patch, relative to the
/// longest side.
fn chord_error(csg: &CsgModel, mesh: &Mesh, triangle: &BoundaryTriangle) -> f64 {
    let [a, b, c] = triangle.vertices.map(|v| mesh.points[v.0 as usize]);
    let middle = |of: &[Point]| Point::from(of.iter().map(|p| p.coords).sum::<Vector>() / of.len() as f64);
    let middles = [middle(&[a, b]), middle(&[b, c]), middle(&[c, a]), middle(&[a, b, c])];
    let off = |middle| csg.projector.patch_distance(triangle.patch, &middle);
    let longest = [b - a, c - b, a - c].map(|side| side.norm()).into_iter().fold(0.0, f64::max);
    middles.into_iter().map(off).fold(0.0, f64::max) / longest
}

/// Whether a corner of a triangle is at or near the apex of its cone.
///
/// At the apex no size is small enough for the curvature; near means within some sizes of it, where
/// curvature requests a thousandth of the diagonal at least.
fn is_at_apex(csg: &CsgModel, mesh: &Mesh, triangle: &BoundaryTriangle) -> bool {
    let near = 5e-3 * csg.features.bounds.diagonal();
    let surface = &csg.geometry.surfaces[csg.features.patches[triangle.patch.index()].surface.index()];
    triangle.vertices.iter().any(|v| surface.has_apex_at(&mesh.points[v.0 as usize], near))
}

/// Checks the surface of a coarse mesh: closed, without intersections by exact signs, and with
/// chord errors as the preset requires.
fn check_surface(geometry: &Path, preset: Preset) {
    let what = format!("{} {preset:?}", geometry.display());
    let source = std::fs::read_to_string(geometry).unwrap();
    let parsed = parse_geometry(&source, &geometry.to_string_lossy()).unwrap();
    let model = Model::from_csg(parsed.geometry).unwrap();
    let mesh = model
        .coarse_mesh(&mut SizeSettings::from(preset).into(), &Budget::default(), Work::unwatched())
        .unwrap()
        .mesh;
    let tets = mesh.tets.iter().zip(&mesh.bodies).map(|(t, body)| (t.map(|v| v.0), Some(*body)));
    let skin = skin_of(&mesh.points, &tets.collect::<Vec<_>>(), 1);
    skin.surface().unwrap_or_else(|faults| panic!("{what}: {faults}"));

    let Model::Csg(csg) = &model else { panic!("{what}: no solids") };
    for triangle in &mesh.triangles {
        let most =
            if is_at_apex(csg, &mesh, triangle) { CHORD_AT_APEX } else { CHORD / preset.curvature_safety() };
        let error = chord_error(csg, &mesh, triangle);
        assert!(
            error < most,
            "{what}: {error} of {most} at {}",
            mesh.points[triangle.vertices[0].0 as usize]
        );
    }
}

#[test]
fn coarse_surfaces_do_not_cross_and_are_as_near_as_curvature_asks() {
    own_geometries().iter().for_each(|geometry| check_surface(geometry, Preset::VeryCoarse));
}

#[test]
fn fine_surfaces_do_not_cross_and_are_as_near_as_curvature_asks() {
    own_geometries().iter().for_each(|geometry| check_surface(geometry, Preset::Fine));
}
