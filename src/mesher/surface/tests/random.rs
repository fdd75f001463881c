//! Random holes in planes, spheres, tori and ellipsoids, and pipes with wavy ends, at random
//! positions and scales.

use super::*;
use crate::ground::size::UniformSize;
use csg::primitive::{Ellipsoid, Sphere, Torus};
use nalgebra::{Isometry3, Translation3, UnitQuaternion};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

/// A random motion and scale.
fn placement() -> impl Strategy<Value = (Isometry3<f64>, f64)> {
    let angles = (0.0..TAU, 0.0..TAU, 0.0..TAU);
    let shift = (-100.0..100.0_f64, -100.0..100.0_f64, -100.0..100.0_f64);
    (angles, shift, prop::sample::select(vec![1e-3, 1.0, 1e3])).prop_map(|((a, b, c), (x, y, z), scale)| {
        let turn = UnitQuaternion::from_euler_angles(a, b, c);
        (Isometry3::from_parts(Translation3::new(x * scale, y * scale, z * scale), turn), scale)
    })
}

/// A hole: its position in a grid cell, its size relative to the cell, its number of segments.
fn hole() -> impl Strategy<Value = (f64, f64, f64, usize)> {
    (0.0..1.0, 0.0..1.0, 0.05..0.9, 3..20_usize)
}

fn seeded() -> ProptestConfig {
    ProptestConfig {
        cases: 24,
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(7),
        ..ProptestConfig::default()
    }
}

proptest! {
    #![proptest_config(seeded())]

    #[test]
    fn a_plate_with_random_holes_is_filled(
        (motion, scale) in placement(),
        holes in prop::collection::vec(hole(), 9),
        h in 0.03..3.0_f64,
    ) {
        let at = |x: f64, y: f64| motion * Point::new(x * scale, y * scale, 0.0);
        let plane = Surface::Plane(Plane { point: at(0.0, 0.0), normal: motion * Vector::z() });
        let mut made = Made::new(vec![plane]);
        let square = [(0.0, 0.0), (3.0, 0.0), (3.0, 3.0), (0.0, 3.0)];
        let corners = square.map(|(x, y)| made.corner(at(x, y), &[0]));
        let mut boundary = Vec::new();
        for k in 0..4 {
            let ((x, y), (u, v)) = (square[k], square[(k + 1) % 4]);
            let n = (3.0 / h).ceil() as usize;
            let ends = [corners[k], corners[(k + 1) % 4]];
            boundary.push((made.arc([0, 0], ends, n, |t| at(x + t * (u - x), y + t * (v - y))), true));
        }
        for (k, &(x, y, size, n)) in holes.iter().enumerate() {
            let radius = 0.5 * size;
            let place = |t: f64, cell: usize| cell as f64 + radius + t * (1.0 - 2.0 * radius);
            let (cx, cy) = (place(x, k % 3), place(y, k / 3));
            let ring = made.ring([0, 0], n, |t| {
                let (s, c) = (TAU * t).sin_cos();
                // Inside the boundary of the cell, which other holes and the square may touch.
                at(cx + 0.98 * radius * c, cy + 0.98 * radius * s)
            });
            boundary.push((ring, false));
        }
        made.patch(0, false, &boundary, &[]);
        let (mesh, report) = made.mesh(&UniformSize(h * scale));
        prop_assert_eq!(euler(&mesh), 1 - 9);
        prop_assert!(report.worst_quality() > 0.0);
    }

    #[test]
    fn a_sphere_with_random_round_holes_is_filled(
        (motion, scale) in placement(),
        holes in prop::collection::vec(hole(), 6),
        h in 0.05..2.0_f64,
    ) {
        let center = motion * Point::origin();
        let mut made =
            Made::new(vec![Surface::Sphere(Sphere { center, radius: scale })]);
        let directions =
            [Vector::x(), -Vector::x(), Vector::y(), -Vector::y(), Vector::z(), -Vector::z()];
        let mut boundary = Vec::new();
        for (axis, &(x, y, size, n)) in directions.iter().zip(&holes) {
            // At most 45° from the axis in total.
            let opening = 0.4 * size;
            let tilt = (0.7 - opening) * x;
            let side = axis.yzx();
            let axis = motion * (axis * tilt.cos() + (side * (TAU * y).cos() + axis.cross(&side) * (TAU * y).sin()) * tilt.sin());
            let u = axis.cross(&(motion * side)).normalize();
            let v = axis.cross(&u);
            let ring = made.ring([0, 0], n, |t| {
                let (s, c) = (TAU * t).sin_cos();
                center + (axis * opening.cos() + (u * c + v * s) * opening.sin()) * scale
            });
            boundary.push((ring, false));
        }
        made.patch(0, false, &boundary, &[]);
        let (mesh, _) = made.mesh(&UniformSize(h * scale));
        prop_assert_eq!(euler(&mesh), 2 - 6);
    }

    #[test]
    fn a_pipe_with_wavy_ends_is_filled(
        (motion, scale) in placement(),
        (waves, amplitude) in (1..5_u32, 0.0..0.5),
        (n, m) in (12..60_usize, 12..60_usize),
        (length, h) in (1.5..10.0, 0.1..2.0),
    ) {
        let cylinder = Cylinder { point: motion * Point::origin(), axis: motion * Vector::z(), radius: scale };
        let mut made = Made::new(vec![Surface::Cylinder(cylinder)]);
        let end = |z: f64, phase: f64| move |t: f64| {
            let (s, c) = (TAU * t).sin_cos();
            let z = z + amplitude * (TAU * t * f64::from(waves) + phase).sin();
            motion * (Point::new(c, s, z) * scale)
        };
        let bottom = made.ring([0, 0], n, end(0.0, 0.0));
        let top = made.ring([0, 0], m, end(length, 1.0));
        made.patch(0, false, &[(bottom, true), (top, false)], &[]);
        let (mesh, report) = made.mesh(&UniformSize(h * scale));
        prop_assert_eq!(euler(&mesh), 0);
        prop_assert!(report.worst_normal() < 75.0, "{:?}", report);
    }

    #[test]
    fn a_torus_with_random_holes_is_filled(
        (motion, scale) in placement(),
        holes in prop::collection::vec(hole(), 12),
        minor in 0.05..0.9_f64,
        (fineness, flipped) in (0.1..2.0_f64, any::<bool>()),
    ) {
        let (center, axis) = (motion * Point::origin(), motion * Vector::z());
        let torus = Surface::Torus(Torus { center, axis, major: scale, minor: minor * scale });
        let spots = holes.iter().enumerate().map(|(k, &(x, y, _, _))| {
            // Four around the axis, three around the tube.
            let angle = |cell: usize, of: f64, t: f64| TAU * (cell as f64 + 0.2 * t) / of;
            let (u, v) = (angle(k % 4, 4.0, x), angle(k / 4, 3.0, y));
            let radius = 1.0 + minor * v.cos();
            motion * (Point::new(radius * u.cos(), radius * u.sin(), minor * v.sin()) * scale)
        });
        // Holes fit between the axis and the tube.
        let room = 0.5 * scale * minor.min(1.0 - minor);
        let made = pierced(torus, spots.collect(), &holes, room, flipped);
        let (mesh, _) = made.mesh(&UniformSize(fineness * scale));
        prop_assert_eq!(euler(&mesh), 0 - 12);
    }

    #[test]
    fn an_ellipsoid_with_random_holes_is_filled(
        (motion, scale) in placement(),
        holes in prop::collection::vec(hole(), 6),
        (a, b) in (0.6..1.6_f64, 0.6..1.6_f64),
        (fineness, flipped) in (0.1..2.0_f64, any::<bool>()),
    ) {
        let axes = [Vector::x(), Vector::y(), Vector::z()].map(|axis| motion * axis);
        let radii = [scale, a * scale, b * scale];
        let center = motion * Point::origin();
        let spots = (0..6).map(|k| center + axes[k / 2] * (radii[k / 2] * if k % 2 == 0 { 1.0 } else { -1.0 }));
        let least = 1.0_f64.min(a).min(b);
        let room = 0.5 * scale * least * least / 1.0_f64.max(a).max(b);
        let ellipsoid = Surface::Ellipsoid(Ellipsoid { center, axes, radii });
        let made = pierced(ellipsoid, spots.collect(), &holes, room, flipped);
        let (mesh, _) = made.mesh(&UniformSize(fineness * scale));
        prop_assert_eq!(euler(&mesh), 2 - 6);
    }
}

/// A closed surface with holes of at most the given radius around given points.
fn pierced(
    surface: Surface,
    spots: Vec<Point>,
    holes: &[(f64, f64, f64, usize)],
    room: f64,
    flipped: bool,
) -> Made {
    let mut made = Made::new(vec![surface.clone()]);
    let mut boundary = Vec::new();
    for (spot, &(_, _, size, n)) in spots.iter().zip(holes) {
        let normal = surface.normal(spot);
        let u = normal.cross(&normal.yzx()).normalize();
        let v = normal.cross(&u);
        let ring = made.ring([0, 0], n, |t| {
            let (s, c) = (TAU * t).sin_cos();
            surface.project(&(spot + (u * c + v * s) * (room * size))).expect("near the surface")
        });
        boundary.push((ring, flipped));
    }
    made.patch(0, flipped, &boundary, &[]);
    made
}
