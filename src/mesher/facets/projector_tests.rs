//! Tests of the projection to facets, against brute force.

use super::samples::Soup;
use super::{FacetModel, FacetProjector, Settings};
use crate::Point;
use crate::ground::kernel::nearest::{at, in_triangle};
use crate::ground::kernel::random::Random;
use csg::{CurveId, PatchId};

fn model(make: impl FnOnce(&mut Soup)) -> FacetModel {
    let mut soup = Soup::default();
    make(&mut soup);
    FacetModel::new(&[soup.facets], &Settings::default()).unwrap()
}

fn random_points(count: usize, reach: f64) -> Vec<Point> {
    let mut random = Random::new(3);
    let mut number = || (2.0 * random.unit() - 1.0) * reach;
    (0..count).map(|_| Point::new(number(), number(), number())).collect()
}

#[test]
fn the_tree_finds_the_nearest_facet() {
    let torus = model(|s| s.torus(2.0, 0.7, 24, 16));
    for p in random_points(300, 3.0) {
        let nearest = torus
            .triangles
            .iter()
            .map(|t| {
                let corners = t.vertices.map(|v| torus.points[v.index()]);
                (at(&corners, in_triangle(&p, &corners)) - p).norm()
            })
            .fold(f64::INFINITY, f64::min);
        assert!((torus.projector.patch_distance(PatchId(0), &p) - nearest).abs() < 1e-14, "{p}");
    }
}

#[test]
fn a_projected_point_stays_where_it_is_projected_again() {
    for solid in [model(|s| s.torus(2.0, 0.7, 24, 16)), model(|s| s.plate_with_hole(2.0, 1.0, 0.5, 24))] {
        let projector = &solid.projector;
        for p in random_points(200, 3.0) {
            for patch in (0..projector.patches()).map(PatchId::new) {
                // Between the point and its foot.
                let near = p + (projector.project_patch(patch, &p) - p) * 0.9;
                let once = projector.project_patch(patch, &near);
                let step = projector.patch_distance(patch, &once);
                assert!(step <= projector.tolerance(), "{patch:?} {p} {step}");
            }
            for curve in (0..projector.curves()).map(CurveId::new) {
                let once = projector.project_curve(curve, &p);
                assert!(projector.curve_distance(curve, &once) <= projector.tolerance());
            }
        }
    }
}

#[test]
fn a_patch_goes_on_beyond_its_rim_in_its_tangent_plane() {
    let cylinder = model(|s| s.cylinder(1.0, 3.0, 40));
    let wall = cylinder.triangles.iter().find(|t| {
        let z = t.vertices.map(|v| cylinder.points[v.index()].z);
        z.contains(&0.0) && z.contains(&3.0)
    });
    let wall = wall.unwrap().patch;
    // Above the wall and at a distance of 0.1: the foot is above the rim, not on it.
    let foot = cylinder.projector.project_patch(wall, &Point::new(1.1, 0.0, 3.2));
    assert!((foot - Point::new(1.0, 0.0, 3.2)).norm() < 1e-12, "{foot}");
    let inside = cylinder.projector.project_patch(wall, &Point::new(0.9, 0.0, 1.5));
    assert!((inside - Point::new(1.0, 0.0, 1.5)).norm() < 1e-2, "{inside}");
}

#[test]
fn flat_patches_and_straight_curves_are_known_as_such() {
    let plate = model(|s| s.plate_with_hole(2.0, 1.0, 0.5, 24));
    let flat = (0..plate.patches.len()).filter(|&p| plate.projector.is_flat_patch(PatchId::new(p))).count();
    assert_eq!(flat, 6);
    let curves = 0..plate.curves.len();
    let straight = curves.filter(|&c| plate.projector.is_straight_curve(CurveId::new(c))).count();
    assert_eq!(straight, 12);
}

#[test]
fn a_projector_survives_encoding_and_invalid_bytes_are_rejected() {
    let projector = model(|s| s.cone(1.0, 2.0, 40)).projector;
    let bytes = projector.encode();
    assert_eq!(FacetProjector::decode(&bytes).as_ref(), Some(&projector));
    assert_eq!(FacetProjector::decode(&bytes[..bytes.len() - 1]), None);
    assert_eq!(FacetProjector::decode(&[&bytes[..], &[0]].concat()), None);
    let mut wrong = bytes.clone();
    wrong[15] = 255;
    assert_eq!(FacetProjector::decode(&wrong), None);
    let last = bytes.len() - 6;
    wrong = bytes;
    wrong[last] = 255;
    assert_eq!(FacetProjector::decode(&wrong), None);
}

#[test]
fn needles_and_points_are_triangles_too() {
    let p = Point::new(0.5, 1.0, 0.0);
    let line = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.25, 0.0, 0.0]].map(Point::from);
    assert_eq!(at(&line, in_triangle(&p, &line)), Point::new(0.5, 0.0, 0.0));
    let point = [Point::new(1.0, 1.0, 1.0); 3];
    assert_eq!(at(&point, in_triangle(&p, &point)), point[0]);
}
