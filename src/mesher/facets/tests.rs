//! Tests of the features found in facets as CAD programs export them.

use super::remesh_tests::{closed, remeshed, sizes};
use super::samples::{Soup, read_ply, read_stl, shared};
use super::*;
use crate::ground::size::SizeField;
use crate::{Point, Vector};
use csg::BodyId;

fn model(soups: &[Soup]) -> FacetModel {
    let files: Vec<Facets> = soups.iter().map(|s| s.facets.clone()).collect();
    FacetModel::new(&files, &Settings::default()).unwrap()
}

/// The numbers of corners, curves, patches and bodies.
fn counts(model: &FacetModel) -> [usize; 4] {
    [model.corners.len(), model.curves.len(), model.patches.len(), model.bodies.len()]
}

fn soup(make: impl FnOnce(&mut Soup)) -> Soup {
    let mut soup = Soup::default();
    make(&mut soup);
    soup
}

#[test]
fn simple_solids_have_the_expected_corners_curves_and_patches() {
    let unit = [[0.0; 3], [1.0; 3]];
    assert_eq!(counts(&model(&[soup(|s| s.brick(unit[0], unit[1], false))])), [8, 12, 6, 1]);
    assert_eq!(counts(&model(&[soup(|s| s.cylinder(1.0, 3.0, 40))])), [0, 2, 3, 1]);
    assert_eq!(counts(&model(&[soup(|s| s.sphere(Point::origin(), 1.0, 40, 20, false))])), [0, 0, 1, 1]);
    assert_eq!(counts(&model(&[soup(|s| s.torus(3.0, 1.0, 40, 20))])), [0, 0, 1, 1]);
    assert_eq!(counts(&model(&[soup(|s| s.plate_with_hole(2.0, 1.0, 0.5, 24))])), [8, 14, 7, 1]);
    assert_eq!(counts(&model(&[soup(|s| s.cone(1.0, 2.0, 40))])), [1, 1, 2, 1], "the tip is a corner");
}

#[test]
fn the_same_is_found_at_every_scale_and_tilt_in_single_precision() {
    let plate = soup(|s| s.plate_with_hole(2.0, 1.0, 0.5, 24));
    for scale in [1e-3, 1.0, 1e6] {
        let turn = nalgebra::Rotation3::from_euler_angles(0.4, -1.1, 2.0);
        let moved = plate.clone().map(|p| {
            let q = turn * p * scale + Vector::new(3.0, -2.0, 1.0) * scale;
            q.map(|x| f64::from(x as f32))
        });
        assert_eq!(counts(&model(&[moved])), [8, 14, 7, 1], "{scale}");
    }
}

#[test]
fn a_surface_inside_another_is_a_void_or_a_body_by_its_orientation() {
    let outer = |s: &mut Soup| s.brick([0.0; 3], [4.0; 3], false);
    let hollow = model(&[soup(|s| {
        outer(s);
        s.brick([1.0; 3], [2.0; 3], true);
    })]);
    assert_eq!(counts(&hollow), [16, 24, 12, 1]);
    assert!(hollow.patches.iter().all(|p| p.inside == Some(BodyId(0)) && p.outside.is_none()));
    let inclusion = model(&[soup(|s| {
        outer(s);
        s.brick([1.0; 3], [2.0; 3], false);
    })]);
    assert_eq!(counts(&inclusion), [16, 24, 12, 2]);
    let interfaces = inclusion.patches.iter().filter(|p| p.outside.is_some()).count();
    assert_eq!(interfaces, 6);
    // A body in the void, and a separate one.
    let nested = model(&[soup(|s| {
        outer(s);
        s.brick([1.0; 3], [3.0; 3], true);
        s.brick([1.5; 3], [2.0; 3], false);
        s.brick([9.0; 3], [10.0; 3], false);
    })]);
    assert_eq!(counts(&nested)[3], 3);
    closed(&nested, &keep(&nested));
}

/// Rays between components whose largest triangles face each other lead in a circle.
#[test]
fn components_that_face_each_other_are_all_found() {
    let corners = [[0., 0., 0.], [0., 4., 0.], [0., 0., 4.], [-1., 1., 1.]].map(Point::from);
    let tet = |s: &mut Soup, moved: &dyn Fn(Point) -> Point, mirrored: bool| {
        for [a, b, c] in [[0, 1, 2], [0, 3, 1], [1, 3, 2], [0, 2, 3]] {
            let [b, c] = if mirrored { [c, b] } else { [b, c] };
            s.add([a, b, c].map(|v: usize| moved(corners[v])));
        }
    };
    let facing = soup(|s| {
        tet(s, &|p| p, false);
        tet(s, &|p| Point::new(1.0 - p.x, p.y, p.z), true);
    });
    assert_eq!(counts(&model(&[facing]))[3], 2);
    let many = soup(|s| {
        for k in 0..216 {
            let center = [k % 6, k / 6 % 6, k / 36].map(|i| 3.0 * f64::from(i));
            s.sphere(Point::from(center), 1.0, 8, 6, false);
        }
    });
    assert_eq!(counts(&model(&[many]))[3], 216);
}

#[test]
fn two_files_that_share_facets_have_an_interface() {
    let one = soup(|s| s.brick([0.0; 3], [1.0; 3], false));
    let two = soup(|s| s.brick([1.0, 0.0, 0.0], [2.0, 1.0, 1.0], false));
    let three = soup(|s| s.brick([3.0, 0.0, 0.0], [4.0, 1.0, 1.0], true));
    // The diagonals of the common side must agree.
    let both = FacetModel::new(&[one.facets.clone(), two.facets.clone()], &Settings::default());
    let both = match both {
        Ok(both) => both,
        Err(error) => panic!("{error}"),
    };
    assert_eq!(counts(&both), [12, 20, 11, 2]);
    let shared: Vec<&FacetPatch> = both.patches.iter().filter(|p| p.outside.is_some()).collect();
    assert_eq!(shared.len(), 1);
    assert_eq!(shared[0].labels, [(0, 0), (1, 0)]);
    closed(&both, &keep(&both));
    // A surface with inward normals bounds a body too.
    let apart = model(&[one, three]);
    assert_eq!(apart.bodies, [0, 1].map(|file| FacetBody { file, number: None }));
    closed(&apart, &keep(&apart));
}

#[test]
fn inconsistently_oriented_triangles_are_reoriented() {
    let mut mixed = soup(|s| {
        s.brick([0.0; 3], [4.0; 3], false);
        s.brick([1.0; 3], [2.0; 3], true);
    });
    for t in [1, 5, 6, 13, 20] {
        mixed.facets.triangles[t].swap(0, 2);
    }
    let found = model(&[mixed]);
    assert_eq!(counts(&found), [16, 24, 12, 1]);
    closed(&found, &keep(&found));
}

#[test]
fn gaps_and_overlaps_are_refused_with_their_place() {
    let refused = |soup: Soup| FacetModel::new(&[soup.facets], &Settings::default()).unwrap_err();
    let mut open = soup(|s| s.brick([0.0; 3], [1.0; 3], false));
    open.facets.triangles.pop();
    let FacetError::Open { count: 3, places } = refused(open) else { panic!("open") };
    assert!(places.iter().all(|p| p.z == 1.0 || p.y == 1.0 || p.x == 1.0));
    let empty = refused(Soup::default());
    assert_eq!(empty, FacetError::Empty);
    let mut wild = soup(|s| s.brick([0.0; 3], [1.0; 3], false));
    wild.facets.points[4].y = f64::NAN;
    assert_eq!(refused(wild), FacetError::NotFinite { file: 0, point: 4 });
    let mut beyond = soup(|s| s.brick([0.0; 3], [1.0; 3], false));
    beyond.facets.triangles[2][1] = 999;
    assert_eq!(refused(beyond), FacetError::NoSuchPoint { file: 0, triangle: 2, point: 999 });
}

#[test]
fn patches_end_at_changes_of_group() {
    let marked = soup(|s| {
        s.torus(3.0, 1.0, 40, 20);
        s.facets.groups[..400].fill(7);
    });
    let found = model(&[marked]);
    assert_eq!(counts(&found), [0, 2, 2, 1]);
    assert_eq!(found.patches[0].labels, [(0, 7)]);
}

#[test]
fn a_needle_with_a_wild_normal_makes_no_curve() {
    // A box with a vertex on the middle line of a side, moved by rounding, and a cap there with an
    // arbitrary normal.
    let base = |x: f64, y: f64| Point::new(x, y, 0.0);
    let lift = 3e-8;
    let mut bent = Soup::default();
    let (a, b, c, d) = (base(0.0, 0.0), base(1.0, 0.0), base(1.0, 1.0), base(0.0, 1.0));
    let m = Point::new(0.5, 0.5 + lift, lift).map(|x| f64::from(x as f32));
    // The bottom, seen from below: a cap a m c between two triangles.
    bent.add([a, c, b]);
    bent.add([a, m, c]);
    bent.add([a, d, m]);
    bent.add([m, d, c]);
    for axis in 0..3 {
        for upper in [false, true] {
            if axis != 2 || upper {
                bent.side([0.0; 3], [1.0; 3], axis, upper, false);
            }
        }
    }
    assert_eq!(counts(&model(&[bent])), [8, 12, 6, 1]);
}

/// A box whose bottom has a cap from corner to corner, pushed up by `lift` at its middle.
fn box_with_cap(lift: f64) -> FacetModel {
    let (a, b, c, d) =
        (Point::origin(), Point::new(1.0, 0.0, 0.0), Point::new(1.0, 1.0, 0.0), Point::new(0.0, 1.0, 0.0));
    // The cap is steep: it is as wide as high.
    let m = Point::new(0.5 - lift, 0.5 + lift, lift);
    model(&[soup(|s| {
        [[a, c, b], [a, m, c], [a, d, m], [m, d, c]].into_iter().for_each(|t| s.add(t));
        for (axis, upper) in [(0, false), (0, true), (1, false), (1, true), (2, true)] {
            s.side([0.0; 3], [1.0; 3], axis, upper, false);
        }
    })])
}

#[test]
fn a_steep_cap_between_facets_that_agree_makes_no_curve() {
    // Its normal is 35° off those beside it; its corners have 0.7°.
    let flat = box_with_cap(0.005);
    assert_eq!(counts(&flat), [8, 12, 6, 1]);
    let (mesh, report) = remeshed(&flat, &sizes(&flat, 0.2));
    assert!(report.crossings.is_empty(), "{report:?}");
    closed(&flat, &mesh);
    // A pyramid is no cap.
    assert!(counts(&box_with_cap(0.3))[2] > 6);
}

#[test]
fn bands_are_resolved_unless_they_are_far_narrower_than_all_else() {
    let size_halfway = |length: f64| {
        let needle = model(&[soup(|s| s.brick([0.0; 3], [length, 1.0, 1.0], false))]);
        sizes(&needle, 1.0).size_at(&Point::new(0.5 * length, 0.0, 0.0))
    };
    // A size of 1.8 widths, which grows between the places where it is wanted.
    assert!(size_halfway(100.0) < 2.2);
    assert!(size_halfway(1e4) < 2.2);
    assert!(size_halfway(1e6) > 1e4);
}

#[test]
fn the_riser_of_a_low_step_keeps_its_curves() {
    // Its triangles are needles of 0.6°, at right angles to both treads.
    let outline = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 1.01], [0.0, 1.01]];
    let stairs = soup(|s| {
        let at = |k: usize, y: f64| Point::new(outline[k % 6][0], y, outline[k % 6][1]);
        (0..6).for_each(|k| s.quad([at(k, 0.0), at(k + 1, 0.0), at(k + 1, 1.0), at(k, 1.0)]));
        for k in [4, 5, 0, 1] {
            s.add([at(3, 0.0), at(k + 1, 0.0), at(k, 0.0)]);
            s.add([at(3, 1.0), at(k, 1.0), at(k + 1, 1.0)]);
        }
    });
    assert_eq!(counts(&model(&[stairs])), [12, 18, 8, 1]);
}

#[test]
fn the_tutorial_parts_have_the_expected_patches() {
    // The countersinks of the hinge meet its plate at 31°, the slope of the other part its front at
    // 25°.
    for (name, expected) in
        [("netgen-tutorials/hinge.stl", [12, 31, 16, 1]), ("netgen-tutorials/part1.stl", [6, 13, 8, 1])]
    {
        let Some(file) = shared(name) else { continue };
        let facets = read_stl(&std::fs::read_to_string(file).unwrap());
        let found = FacetModel::new(&[facets], &Settings::default()).unwrap();
        assert_eq!(counts(&found), expected, "{name}");
        closed(&found, &keep(&found));
    }
    let Some(file) = shared("surfaces/shaft_100k.ply") else { return };
    let shaft = FacetModel::new(&[read_ply(&std::fs::read(file).unwrap())], &Settings::default()).unwrap();
    assert_eq!(counts(&shaft), [0, 18, 19, 1]);
}
