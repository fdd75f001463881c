//! Surface meshes of geometries given by a few lines of text.

use super::*;
use crate::ground::size::{GeometricSize, Preset, SizeSettings, UniformSize};
use crate::mesher::surface::curves::{crowded, mesh_curves};
use crate::mesher::surface::narrow::narrow;

/// A geometry with its features.
fn read(text: &str) -> (Geometry, Features, Projector) {
    let geometry = csg::language::parse_geometry(text, "test.geo").expect("a geometry").geometry;
    let features = Features::find(&geometry).expect("features");
    let projector = Projector::new(&geometry, &features);
    (geometry, features, projector)
}

/// The surface mesh of a geometry at moderate sizes.
fn meshed(text: &str) -> Result<(SurfaceMesh, Features), SurfaceError> {
    let (geometry, features, projector) = read(text);
    let size = GeometricSize::new(&geometry, &features, &SizeSettings::default());
    let curves = mesh_curves(&features, &projector, &size).expect("curves");
    let (mesh, _) = mesh_patches(&geometry, &features, curves, &size, &Settings::default())?;
    assert_eq!(mesh.check(&features, &projector), []);
    Ok((mesh, features))
}

#[test]
fn the_tip_of_a_skew_cone_has_no_tiny_triangles() {
    // The computed apex is some ulp off the point in which the plane cuts the cone.
    let (mesh, features) = meshed(
        "algebraic3d
solid c = cone (-0.4018, -0.3177, 0.2946; 0.5526; -0.3036, 0.0514, 1.6624; 0)
    and plane (-0.4018, -0.3177, 0.2946; -0.0982, -0.3691, -1.3678)
    and plane (-0.3036, 0.0514, 1.6624; 0.0982, 0.3691, 1.3678);
tlo c;",
    )
    .unwrap();
    assert_eq!([features.corners.len(), features.curves.len(), features.patches.len()], [1, 1, 2]);
    let point = |v: VertexId| mesh.points[v.index()];
    let sides = mesh.triangles.iter().flat_map(|t| {
        let [a, b, c] = t.vertices.map(point);
        [(b - a).norm(), (c - b).norm(), (a - c).norm()]
    });
    let shortest = sides.fold(f64::INFINITY, f64::min);
    assert!(shortest > 1e-4, "{shortest}");
}

#[test]
fn no_triangle_connects_the_sides_of_an_elliptic_cone_through_its_inside() {
    let (geometry, features, projector) = read(
        "algebraic3d
solid c = ellipticcone (0, 0, 0; 2, 0, 0; 0, 1, 0; 0.5; 0.5)
    and plane (0, 0, 0; 0, 0, -1) and plane (0, 0, 1; 0, 0, 1);
tlo c;",
    );
    let settings = SizeSettings { scale: 0.15, ..Preset::Coarse.into() };
    let size = GeometricSize::new(&geometry, &features, &settings);
    let curves = mesh_curves(&features, &projector, &size).expect("curves");
    let (mesh, _) = mesh_patches(&geometry, &features, curves, &size, &Settings::default()).unwrap();
    assert_eq!(mesh.check(&features, &projector), []);
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.vertices.map(|v| mesh.points[v.index()]);
        let longest = (b - a).norm().max((c - b).norm()).max((a - c).norm());
        let most = 4.0 * size.size_at(&nalgebra::center(&a, &b));
        assert!(longest < most, "a side of {longest}, where {most} is long, at {a}");
    }
}

#[test]
fn a_lens_between_arcs_that_leave_a_corner_at_a_small_angle_needs_shorter_segments_if_it_is_inverted() {
    // Two arcs with the same ends are a hundredth of a sagitta apart, and only one has two
    // segments.
    let radius = |middle: f64| (1.0 + middle * middle).sqrt();
    let lens = |counts: [usize; 2]| {
        let mut made = Made::new(vec![
            Surface::Plane(Plane { point: Point::origin(), normal: Vector::z() }),
            Surface::Cylinder(Cylinder {
                point: Point::new(0.0, -1.0, 0.0),
                axis: Vector::z(),
                radius: radius(1.0),
            }),
            Surface::Cylinder(Cylinder {
                point: Point::new(0.0, -1.01, 0.0),
                axis: Vector::z(),
                radius: radius(1.01),
            }),
        ]);
        let ends = [-1.0, 1.0].map(|x| made.corner(Point::new(x, 0.0, 0.0), &[0, 1, 2]));
        let arc = |middle: f64| {
            let half = 1.0_f64.atan2(middle);
            move |t: f64| {
                let turn = half * (2.0 * t - 1.0);
                Point::new(radius(middle) * turn.sin(), radius(middle) * turn.cos() - middle, 0.0)
            }
        };
        let outer = made.arc([0, 1], ends, counts[0], arc(1.0));
        let inner = made.arc([0, 2], ends, counts[1], arc(1.01));
        made.patch(0, false, &[(outer, false), (inner, true)], &[]);
        made
    };
    let coarse = lens([1, 2]);
    let failed = mesh_patches(
        &coarse.geometry,
        &coarse.features,
        coarse.curves,
        &UniformSize(0.5),
        &Settings::default(),
    );
    let failed = failed.unwrap_err();
    assert!(
        matches!(&failed, SurfaceError::TooCoarse { segments, .. } if !segments.is_empty()),
        "{failed:?}"
    );
    lens([64, 64]).mesh(&UniformSize(0.5));
}

#[test]
fn internally_tangent_circles_have_vertices_at_the_same_distances_from_the_point_of_contact() {
    let (_, features, projector) = read(
        "algebraic3d
solid shaft = cylinder (0, 0, 0; 0, 0, 1; 1) and plane (0, 0, 0; 0, 0, -1) and plane (0, 0, 1; 0, 0, 1);
solid pin = cylinder (0.2, 0, 0; 0.2, 0, 1; 0.8) and plane (0, 0, 1; 0, 0, -1) and plane (0, 0, 2; 0, 0, 1);
solid eccentric = shaft or pin;
tlo eccentric;",
    );
    let size = UniformSize(0.25);
    let curves = mesh_curves(&features, &projector, &size).expect("curves");
    let cusp = features.corners[0].point;
    // For each curve, the distances of its vertices from the cusp, up to about half a radius.
    let ending = (0..).zip(&features.curves).filter(|(_, curve)| curve.ends.is_some());
    let distances = ending.map(|(id, _)| {
        let of_curve = curves.segments.iter().filter(|s| s.curve == CurveId(id));
        let mut near: Vec<f64> = of_curve
            .map(|s| (curves.points[s.vertices[1].index()] - cusp).norm())
            .filter(|d| *d < 0.6)
            .collect();
        near.sort_by(f64::total_cmp);
        near
    });
    let [outer, inner] =
        <[Vec<f64>; 2]>::try_from(distances.collect::<Vec<_>>()).expect("two curves end at the cusp");
    assert!(outer.len() > 4 && outer.len() == inner.len());
    assert!(outer.iter().zip(&inner).all(|(p, q)| (p - q).abs() < 1e-12), "{outer:?} {inner:?}");
    // Near the cusp the chords are closer to each other than to their curves, but in order.
    let crowded = crowded(&curves, &features, &size);
    assert!(!crowded.places.iter().any(|place| (place.source.point - cusp).norm() < 0.6));
}

#[test]
fn a_gap_between_edges_tells_the_segments_that_it_needs() {
    for step in [0.02, 1e-3] {
        let (_, features, projector) = read(&format!(
            "algebraic3d
solid low = cylinder (0, 0, 0; 0, 0, 1; 1) and plane (0, 0, 0; 0, 0, -1) and plane (0, 0, 1; 0, 0, 1);
solid high = cylinder (0, 0, 1; 0, 0, 2; {}) and plane (0, 0, 1; 0, 0, -1) and plane (0, 0, 2; 0, 0, 1);
solid step = low or high;
tlo step;",
            1.0 + step
        ));
        let gap = |size: f64| {
            let size = UniformSize(size);
            let curves = mesh_curves(&features, &projector, &size).expect("curves");
            crowded(&curves, &features, &size).gap(&features, &projector)
        };
        let found = gap(0.5).expect("a gap");
        assert!((found.width - step).abs() < 1e-9 && (found.at.z - 1.0).abs() < 1e-9, "{found:?}");
        // Two rims of about six radii; the test of chords is stricter by a factor of two.
        assert!((6.0..25.0).contains(&(found.segments * found.needed)), "{found:?}");
        assert!(gap(0.7 * found.needed).is_none() && gap(2.0 * found.needed).is_some(), "{found:?}");
    }
}

#[test]
fn segments_along_a_narrow_band_are_shortened_but_not_those_across_a_gap() {
    // A disk whose rim is a band, and two blocks whose tops are one patch with a gap.
    let disk = "algebraic3d
solid disk = cylinder (0, 0, 0; 0, 0, 1; 1) and plane (0, 0, 0; 0, 0, -1) and plane (0, 0, 0.1; 0, 0, 1);
tlo disk;";
    let blocks = "algebraic3d
solid low = orthobrick (0, 0, 0; 2, 1, 1);
solid high = orthobrick (2.1, 0, 0; 4.1, 1, 1);
solid blocks = low or high;
tlo blocks;";
    let found_at = |text: &str, size: f64| {
        let (_, features, projector) = read(text);
        let size = UniformSize(size);
        let curves = mesh_curves(&features, &projector, &size).expect("curves");
        narrow(&curves, &features, &projector, [&size, &size])
    };
    let found = |text: &str| found_at(text, 0.5);
    let sources = found(disk);
    assert!(
        !sources.is_empty() && sources.iter().all(|source| (0.17..0.35).contains(&source.size)),
        "{sources:?}"
    );
    assert_eq!(found(blocks), []);
    // A step of a thousandth of the radius: the band is too narrow, and segments that are not
    // opposite each other are farther apart than it is wide.
    let step = "algebraic3d
solid low = cylinder (0, 0, 0; 0, 0, 1; 1) and plane (0, 0, 0; 0, 0, -1) and plane (0, 0, 1; 0, 0, 1);
solid high = cylinder (0, 0, 1; 0, 0, 2; 1.001) and plane (0, 0, 1; 0, 0, -1) and plane (0, 0, 2; 0, 0, 1);
solid step = low or high;
tlo step;";
    assert_eq!(found_at(step, 0.03), []);
}
