//! The surfaces of our own geometries' coarse meshes: closed, without crossings, and near what they stand for.

use crate::common::own_geometries;
use crate::samples::skin_of;
use csg::language::parse_geometry;
use std::path::Path;
use tetmill::mesh::{BoundaryTriangle, Mesh};
use tetmill::pipeline::{CsgModel, Model};
use tetmill::size::{Preset, SizeSettings};
use tetmill::{Point, Vector};

/// The chord error of a triangle is less than this part of its longest side, divided by the elements per radius of curvature c that the preset asks for:
/// of an equilateral triangle of side h, whose middle is h/√3 from its corners, it is h²/6 times the curvature, and sides are less than
/// 1.5 radii / c long.
const CHORD: f64 = 0.25;

/// How far the middles of a triangle and of its sides are from its patch, in units of its longest side.
fn chord_error(csg: &CsgModel, mesh: &Mesh, triangle: &BoundaryTriangle) -> f64 {
    let [a, b, c] = triangle.vertices.map(|v| mesh.points[v.0 as usize]);
    let middle = |of: &[Point]| Point::from(of.iter().map(|p| p.coords).sum::<Vector>() / of.len() as f64);
    let middles = [middle(&[a, b]), middle(&[b, c]), middle(&[c, a]), middle(&[a, b, c])];
    let off = |middle| csg.projector.patch_distance(triangle.patch, &middle);
    let longest = [b - a, c - b, a - c].map(|side| side.norm()).into_iter().fold(0.0, f64::max);
    middles.into_iter().map(off).fold(0.0, f64::max) / longest
}

/// Whether a corner of a triangle is the apex of its cone, where no size is small enough for the curvature, or within some sizes of it: that of
/// a thousandth of the diagonal is the least that curvature asks for.
fn is_at_apex(csg: &CsgModel, mesh: &Mesh, triangle: &BoundaryTriangle) -> bool {
    let near = 5e-3 * csg.features.bounds.diagonal();
    let surface = &csg.geometry.surfaces[csg.features.patches[triangle.patch.index()].surface.index()];
    triangle.vertices.iter().any(|v| surface.has_apex_at(&mesh.points[v.0 as usize], near))
}

/// Checks the surface of a coarse mesh: closed and without crossings by exact signs, chord errors as small as the preset asks.
fn check_surface(geometry: &Path, preset: Preset) {
    let what = format!("{} {preset:?}", geometry.display());
    let source = std::fs::read_to_string(geometry).unwrap();
    let parsed = parse_geometry(&source, &geometry.to_string_lossy()).unwrap();
    let model = Model::from_csg(parsed.geometry).unwrap();
    let mesh = model.coarse_mesh(&mut SizeSettings::from(preset).into()).unwrap().mesh;
    let tets = mesh.tets.iter().zip(&mesh.bodies).map(|(t, body)| (t.map(|v| v.0), Some(*body)));
    let skin = skin_of(&mesh.points, &tets.collect::<Vec<_>>(), 1);
    skin.surface().unwrap_or_else(|faults| panic!("{what}: {faults}"));

    let Model::Csg(csg) = &model else { panic!("{what}: no solids") };
    for triangle in &mesh.triangles {
        let most = if is_at_apex(csg, &mesh, triangle) { CHORD } else { CHORD / preset.curvature_safety() };
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
