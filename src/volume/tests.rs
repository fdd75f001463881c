//! Whole surfaces through the volume mesher.

use super::samples::{INSIDE, Soup, check_fills};
use super::*;
use crate::size::UniformSize;
use csg::BodyId;

const A: Option<BodyId> = Some(BodyId(0));
const B: Option<BodyId> = Some(BodyId(1));

const EMPTY: Settings = Settings { fill: false, growth: 0.5, max_tets: 1 << 20 };

/// Meshes a surface without and with points inside, checks both and returns the report of the latter.
fn filled(soup: Soup, size: f64) -> Report {
    let surface = soup.surface().unwrap();
    let (empty, bare) = mesh(&surface, &UniformSize(size), &EMPTY).unwrap();
    check_fills(&surface, &empty);
    let (full, report) = mesh(&surface, &UniformSize(size), &Settings::default()).unwrap();
    check_fills(&surface, &full);
    assert_eq!(report, Report { points_inside: report.points_inside, ..bare });
    assert_eq!(full.points.len(), surface.points().len() + report.steiner_inside + report.points_inside);
    report
}

#[test]
fn cubes_with_any_number_of_squares_are_filled() {
    for n in [1, 2, 3, 8, 13u32] {
        let mut soup = Soup::default();
        soup.brick([0.; 3], [1.; 3], n as usize, INSIDE);
        assert_eq!(filled(soup, 1.0 / f64::from(n)).steiner_inside, 0, "{n} squares a side");
    }
}

#[test]
fn turned_cubes_whose_sides_are_flat_up_to_rounding_are_filled() {
    for k in 0..10 {
        let mut soup = Soup::default();
        soup.brick([-1.; 3], [1.; 3], 6, INSIDE);
        let turn = nalgebra::Rotation3::from_euler_angles(0.1 * f64::from(k), 0.7, 0.3 * f64::from(k));
        soup.map(|p| turn * p);
        filled(soup, 0.25);
    }
}

#[test]
fn a_cube_in_a_cube_is_a_hole_or_a_body() {
    for inner in [None, B] {
        for (n, m) in [(1, 1), (4, 1), (1, 4), (6, 5)] {
            let mut soup = Soup::default();
            soup.brick([0.; 3], [1.; 3], n, INSIDE);
            soup.brick([0.3; 3], [0.6; 3], m, [inner, A]);
            filled(soup, 0.25);
        }
    }
}

#[test]
fn a_crack_in_a_cube_has_one_body_on_both_sides() {
    for n in [1, 3] {
        let mut soup = Soup::default();
        soup.brick([0.; 3], [1.; 3], n, INSIDE);
        soup.brick_side([0.2, 0.3, 0.0], [0.8, 0.9, 0.4], n, 2, true, [A, A]);
        filled(soup, 0.25);
    }
}

#[test]
fn two_cubes_share_a_face() {
    for n in [1, 2, 5] {
        let mut soup = Soup::default();
        for (axis, upper) in [(0, false), (1, false), (1, true), (2, false), (2, true)] {
            soup.brick_side([0.; 3], [1.; 3], n, axis, upper, [A, None]);
        }
        for (axis, upper) in [(0, true), (1, false), (1, true), (2, false), (2, true)] {
            soup.brick_side([1., 0., 0.], [2., 1., 1.], n, axis, upper, [B, None]);
        }
        soup.brick_side([0.; 3], [1.; 3], n, 0, true, [A, B]);
        filled(soup, 0.25);
    }
}

#[test]
fn cubes_that_touch_in_a_vertex_or_an_edge_are_filled() {
    for high in [[2.; 3], [2., 2., 1.]] {
        for n in [1, 3] {
            let mut soup = Soup::default();
            soup.brick([0.; 3], [1.; 3], n, INSIDE);
            let low = [1., 1., high[2] - 1.];
            soup.brick(low, high, n, INSIDE);
            filled(soup, 0.25);
        }
    }
}

#[test]
fn spheres_and_tori_are_filled() {
    for levels in 0..4 {
        let mut soup = Soup::default();
        soup.sphere(Point::new(0.1, 0.2, 0.3), 0.7, levels, INSIDE);
        filled(soup, 0.25);
    }
    let mut links = Soup::default();
    links.torus([1.0, 0.3], [20, 8], INSIDE);
    links.map(|p| Point::new(p.x + 1.0, p.z, p.y));
    links.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    links.torus([1.0, 0.3], [20, 8], [B, None]);
    filled(links, 0.25);
    for (m, n) in [(3, 3), (8, 5), (24, 12), (60, 8), (10, 40)] {
        let mut soup = Soup::default();
        soup.torus([1.0, 0.4], [m, n], INSIDE);
        filled(soup, 0.25);
    }
}

#[test]
fn a_sphere_in_a_cube_is_filled_from_both_sides() {
    for (n, levels) in [(1, 0), (1, 3), (6, 1), (8, 3)] {
        let mut soup = Soup::default();
        soup.brick([-1.; 3], [1.; 3], n, INSIDE);
        soup.sphere(Point::origin(), 0.6, levels, [B, A]);
        filled(soup, 0.25);
    }
}

#[test]
fn thin_plates_are_filled() {
    for thickness in [1e-1, 1e-2, 1e-3, 1e-6, 1e-9] {
        let mut soup = Soup::default();
        soup.brick([0.; 3], [1., 1., thickness], 8, INSIDE);
        filled(soup, 0.25);
    }
}

#[test]
fn extreme_units_change_nothing() {
    let build = |scale: f64| {
        let mut soup = Soup::default();
        soup.torus([1.0, 0.4], [12, 6], INSIDE);
        soup.map(|p| p * scale);
        let surface = soup.surface().unwrap();
        mesh(&surface, &UniformSize(1.0), &EMPTY).unwrap().0.tets
    };
    assert_eq!(build(1.0), build(2f64.powi(-300)));
    assert_eq!(build(1.0), build(2f64.powi(300)));
}

/// The Schönhardt polyhedron: a prism whose top is turned so that its sides bend inward along their diagonals. It has no
/// tetrahedralisation without a point inside.
fn schoenhardt(turn: f64) -> Soup {
    let at = |angle: f64, z: f64| Point::new(angle.cos(), angle.sin(), z);
    let third = std::f64::consts::TAU / 3.0;
    let low: Vec<Point> = (0..3).map(|i| at(third * f64::from(i), 0.0)).collect();
    let high: Vec<Point> = (0..3).map(|i| at(third * f64::from(i) + turn, 1.0)).collect();
    let mut soup = Soup::default();
    soup.add([low[0], low[2], low[1]], INSIDE);
    soup.add([high[0], high[1], high[2]], INSIDE);
    for i in 0..3 {
        let j = (i + 1) % 3;
        // The diagonal that makes the side concave for a turn in the negative sense.
        soup.add([low[i], low[j], high[i]], INSIDE);
        soup.add([low[j], high[j], high[i]], INSIDE);
    }
    soup
}

#[test]
fn the_schoenhardt_polyhedron_gets_one_point_inside() {
    for degrees in [1.0f64, 10.0, 30.0, 45.0, 55.0] {
        for sign in [1.0, -1.0] {
            let report = filled(schoenhardt(sign * degrees.to_radians()), 2.0);
            // Turned the other way it is convex.
            assert_eq!(report.steiner_inside, usize::from(sign < 0.0), "{degrees} degrees");
        }
    }
}

/// Any surface between tets of some mesh can be filled. A lattice of n³ cubes of six tets each, squeezed and sheared so
/// that it is far from Delaunay, each tet in one of two bodies or in none: surfaces that touch themselves everywhere.
fn lattice_skin(
    n: u32,
    squeeze: [f64; 3],
    shear: f64,
    bend: f64,
    mut body: impl FnMut() -> Option<BodyId>,
) -> Soup {
    let at = |c: [u32; 3]| {
        let [x, y, z] = [0, 1, 2].map(|k| f64::from(c[k]) * squeeze[k]);
        // Triangular, so every tet keeps its volume.
        Point::new(x, y + shear * x, z + shear * y + bend * (x * x + y * y))
    };
    let mut sides = std::collections::BTreeMap::<[[u32; 3]; 3], Vec<([[u32; 3]; 3], Option<BodyId>)>>::new();
    for i in 0..n * n * n {
        let base = [i % n, i / n % n, i / n / n];
        for path in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
            let mut tet = [base; 4];
            for (k, &axis) in path.iter().enumerate() {
                tet[k + 1] = tet[k];
                tet[k + 1][axis] += 1;
            }
            let [a, b, c, d] = tet.map(at);
            if crate::kernel::simplex::volume6(&a, &b, &c, &d) < 0.0 {
                tet.swap(0, 1);
            }
            let body = body();
            for face in crate::mesh::TET_FACES {
                let face = face.map(|k| tet[k]);
                let mut key = face;
                key.sort_unstable();
                sides.entry(key).or_default().push((face, body));
            }
        }
    }
    let mut soup = Soup::default();
    for found in sides.values() {
        let (face, behind) = found[0];
        let front = found.get(1).and_then(|other| other.1);
        if behind != front {
            soup.add(face.map(at), [behind, front]);
        }
    }
    soup
}

#[test]
fn skins_of_random_bodies_in_a_bent_lattice_are_filled() {
    let mut random = crate::kernel::random::Random::new(11);
    for case in 0..60 {
        let squeeze = [0, 1, 2].map(|_| 0.15 + random.unit());
        let (shear, bend) = (5.0 * random.unit() - 2.5, 1.0 * random.unit() * f64::from(case % 2));
        let n = 2 + case % 3;
        let soup = lattice_skin(n, squeeze, shear, bend, || match random.bits() % 4 {
            0 | 1 => None,
            2 => A,
            _ => B,
        });
        filled(soup, 0.25);
    }
}

#[test]
fn the_same_input_gives_the_same_mesh_and_the_wanted_number_of_tets() {
    let size = 0.15;
    let build = || {
        let mut soup = Soup::default();
        soup.sphere(Point::origin(), 1.0, 3, INSIDE);
        let surface = soup.surface().unwrap();
        mesh(&surface, &UniformSize(size), &Settings::default()).unwrap().0
    };
    let (one, other) = (build(), build());
    assert_eq!(one.points, other.points);
    assert_eq!(one.tets, other.tets);
    let volume = 4.0 / 3.0 * std::f64::consts::PI;
    let ratio = one.tets.len() as f64 / (6.0 * 2f64.sqrt() * volume / size.powi(3));
    assert!((0.7..1.3).contains(&ratio), "{ratio}");
}

struct Graded;

impl SizeField for Graded {
    fn size_at(&self, point: &Point) -> f64 {
        0.03 + 0.2 * (point - Point::origin()).norm()
    }
}

#[test]
fn tets_follow_a_graded_size() {
    let mut soup = Soup::default();
    soup.brick([-1.; 3], [1.; 3], 8, INSIDE);
    let surface = soup.surface().unwrap();
    let (mesh, _) = mesh(&surface, &Graded, &Settings::default()).unwrap();
    check_fills(&surface, &mesh);
    let mut ratios: Vec<f64> = Vec::new();
    for tet in &mesh.tets {
        for [i, j] in crate::mesh::TET_EDGES {
            let [p, q] = [tet[i], tet[j]].map(|v| mesh.points[v as usize]);
            let middle = nalgebra::center(&p, &q);
            if middle.coords.amax() < 0.7 {
                ratios.push((p - q).norm() / Graded.size_at(&middle));
            }
        }
    }
    ratios.sort_by(f64::total_cmp);
    let (low, median, high) = (ratios[0], ratios[ratios.len() / 2], ratios[ratios.len() - 1]);
    assert!(low > 0.5 && (0.85..1.15).contains(&median) && high < 2.0, "{low} {median} {high}");
}

/// Whether the edges of tets that share a vertex differ in length by less than this factor, but for one vertex in a thousand.
fn grows_smoothly(mesh: &VolumeMesh, factor: f64) -> bool {
    let mut range = vec![[f64::INFINITY, 0.0]; mesh.points.len()];
    for tet in &mesh.tets {
        for [i, j] in crate::mesh::TET_EDGES {
            let length = (mesh.points[tet[i] as usize] - mesh.points[tet[j] as usize]).norm();
            for v in [tet[i], tet[j]] {
                let [low, high] = range[v as usize];
                range[v as usize] = [low.min(length), f64::max(high, length)];
            }
        }
    }
    let abrupt = range.iter().filter(|[low, high]| *high > factor * low).count();
    1000 * abrupt <= mesh.points.len()
}

#[test]
fn without_a_size_field_tets_grow_from_the_skin() {
    let mut soup = Soup::default();
    soup.brick([0.; 3], [1.; 3], 20, INSIDE);
    let surface = soup.surface().unwrap().with_kept_points(vec![Point::new(0.5, 0.52, 0.47)]);
    let uniform = mesh(&surface, &UniformSize(0.05), &Settings::default()).unwrap().0;
    let grown = mesh(&surface, &UniformSize(f64::INFINITY), &Settings::default()).unwrap().0;
    check_fills(&surface, &grown);
    assert!(grows_smoothly(&grown, 4.0));
    assert!(2 * grown.tets.len() < uniform.tets.len(), "{} {}", grown.tets.len(), uniform.tets.len());
}

#[test]
fn a_skin_of_very_different_edges_is_filled_smoothly() {
    // Inversion at a point near a sphere: a sphere again, its triangles similar, their sizes in a ratio of 200.
    let mut soup = Soup::default();
    soup.sphere(Point::origin(), 1.0, 4, INSIDE);
    let near = Point::new(0.0, 0.0, 1.15);
    soup.map(|p| Point::from((p - near) / (p - near).norm_squared()));
    soup.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    let surface = soup.surface().unwrap();
    let mesh = mesh(&surface, &UniformSize(f64::INFINITY), &Settings::default()).unwrap().0;
    check_fills(&surface, &mesh);
    assert!(grows_smoothly(&mesh, 4.0));
}

#[test]
fn where_the_size_is_level_most_tets_are_those_of_the_lattice() {
    let mut soup = Soup::default();
    soup.brick([0.; 3], [1.; 3], 16, INSIDE);
    let surface = soup.surface().unwrap();
    let mesh = mesh(&surface, &UniformSize(1.0 / 16.0), &Settings::default()).unwrap().0;
    check_fills(&surface, &mesh);
    let is_regular = |tet: &&[u32; 4]| {
        let [a, b, c, d] = tet.map(|v| &mesh.points[v as usize]);
        (crate::kernel::quality::mean_ratio(a, b, c, d) - 0.952).abs() < 0.001
    };
    assert!(3 * mesh.tets.iter().filter(is_regular).count() > mesh.tets.len());
}

#[test]
fn kept_points_become_vertices_and_others_are_refused() {
    let mut soup = Soup::default();
    soup.brick([0.; 3], [1.; 3], 3, INSIDE);
    let surface = soup.surface().unwrap();
    let kept = vec![Point::new(0.5, 0.5, 0.5), Point::new(0.51, 0.5, 0.5), Point::new(0.01, 0.3, 0.4)];
    let wanted = surface.clone().with_kept_points(kept.clone());
    for settings in [EMPTY, Settings::default()] {
        let (mesh, _) = mesh(&wanted, &UniformSize(0.3), &settings).unwrap();
        check_fills(&wanted, &mesh);
        for p in &kept {
            assert!(mesh.points.contains(p));
        }
    }
    for (point, fault) in [
        (Point::new(2.0, 0.5, 0.5), KeptPointFault::Outside),
        (Point::new(0.0, 0.5, 0.5), KeptPointFault::OnSurface),
        (Point::new(1.0, 1.0, 0.5), KeptPointFault::OnSurface),
        (Point::new(1.0, 1.0, 1.0), KeptPointFault::Twice),
    ] {
        let refused = surface.clone().with_kept_points(vec![kept[0], point]);
        let error = mesh(&refused, &UniformSize(0.3), &EMPTY).unwrap_err();
        assert_eq!(error, VolumeError::KeptPoint { index: 1, place: point, fault });
    }
}

#[test]
fn bad_sizes_and_too_many_tets_are_errors() {
    let mut soup = Soup::default();
    soup.brick([0.; 3], [1.; 3], 2, INSIDE);
    let surface = soup.surface().unwrap();
    for size in [0.0, -1.0, f64::NAN, f64::NEG_INFINITY] {
        let error = mesh(&surface, &UniformSize(size), &Settings::default()).unwrap_err();
        assert!(matches!(error, VolumeError::BadSize { .. }), "{error}");
    }
    let few = Settings { max_tets: 1000, ..Settings::default() };
    let error = mesh(&surface, &UniformSize(1e-3), &few).unwrap_err();
    assert_eq!(error, VolumeError::TooManyTets { limit: 1000 });
}

#[test]
fn surfaces_that_intersect_are_refused_with_the_place() {
    // Two cubes, one shifted into the other; and a cube pierced by a needle.
    let mut cubes = Soup::default();
    cubes.brick([0.; 3], [1.; 3], 2, INSIDE);
    cubes.brick([0.7, 0.6, 0.55], [1.7, 1.6, 1.55], 2, INSIDE);
    let mut needle = Soup::default();
    needle.brick([0.; 3], [1.; 3], 2, INSIDE);
    needle.brick([0.3, 0.31, -0.5], [0.32, 0.33, 1.5], 1, INSIDE);
    // A torus drawn through another one, and a vertex that touches a face from inside.
    let mut rings = Soup::default();
    rings.torus([1.0, 0.3], [16, 8], INSIDE);
    rings.map(|p| Point::new(p.x + 0.2, p.z, p.y));
    rings.torus([1.0, 0.3], [16, 8], INSIDE);
    let mut touching = Soup::default();
    touching.brick([-1.; 3], [1.; 3], 1, INSIDE);
    touching.sphere(Point::origin(), 0.5, 1, [None, A]);
    let top = touching.points.len() - 1;
    touching.points[top] = Point::new(0.25, 0.5, 1.0);
    for soup in [cubes, needle, rings, touching] {
        let surface = soup.surface().unwrap();
        match mesh(&surface, &UniformSize(1.0), &Settings::default()).unwrap_err() {
            VolumeError::SelfIntersection { triangles, places } => {
                assert!(!triangles.is_empty() && triangles.len() == places.len());
            }
            other => panic!("{other}"),
        }
    }
}

#[test]
fn crumpled_surfaces_are_refused_or_filled_but_never_worse() {
    let mut random = crate::kernel::random::Random::new(3);
    let (mut refused, mut whole) = (0, 0);
    for case in 0..200 {
        let mut soup = Soup::default();
        if case % 2 == 0 {
            soup.torus([1.0, 0.4], [5, 4], INSIDE);
        } else {
            soup.sphere(Point::origin(), 1.0, 1, INSIDE);
        }
        // From a dent to a tangle; on a coarse lattice, where corners meet faces and edges exactly.
        let (amount, cells) = (0.02 * f64::from(case), if case % 3 == 0 { 8.0 } else { 1e9 });
        soup.points.iter_mut().for_each(|p| {
            *p = p.map(|x| ((x + amount * (random.unit() - 0.5)) * cells).round() / cells);
        });
        let Ok(surface) = soup.surface() else { continue };
        match mesh(&surface, &UniformSize(0.5), &Settings::default()) {
            Ok((mesh, _)) => {
                check_fills(&surface, &mesh);
                whole += 1;
            }
            Err(VolumeError::SelfIntersection { .. }) => refused += 1,
            // An inverted but whole surface has its body outside.
            Err(VolumeError::Inconsistent { .. }) => {}
            Err(other) => panic!("case {case}: {other}"),
        }
    }
    assert!(refused > 50 && whole > 10, "{refused} refused, {whole} whole");
}

#[test]
fn bodies_inside_out_are_refused() {
    // A void that names another body than the one around it.
    let mut soup = Soup::default();
    soup.brick([0.; 3], [1.; 3], 1, INSIDE);
    soup.brick([0.3; 3], [0.6; 3], 1, [None, B]);
    let surface = soup.surface().unwrap();
    let error = mesh(&surface, &UniformSize(1.0), &Settings::default()).unwrap_err();
    assert!(matches!(error, VolumeError::Inconsistent { .. }), "{error}");
    // A body on the outside.
    let mut soup = Soup::default();
    soup.brick([0.; 3], [1.; 3], 1, [None, A]);
    let surface = soup.surface().unwrap();
    let error = mesh(&surface, &UniformSize(1.0), &Settings::default()).unwrap_err();
    assert!(matches!(error, VolumeError::Inconsistent { .. }), "{error}");
}

/// A block with n notches from below along y and n from above along x, whose edges nearly meet on the saddle z = xy
/// (after Chazelle 1984): any tetrahedralisation needs many points inside.
fn notched_block(n: usize, gap: f64) -> Soup {
    let side = n as f64 + 1.0;
    // Far enough for the sides of the notches, bent along their diagonals, to stay clear of the saddle.
    let (low, high) = (-side, side * side + side);
    // The profile across the notches: position and, at the tip of a notch, its number.
    let mut profile = vec![(0.0, None)];
    for i in 1..=n {
        let x = i as f64;
        profile.extend([(x - 0.25, None), (x, Some(x)), (x + 0.25, None)]);
    }
    profile.push((side, None));
    let below = |(x, tip): (f64, Option<f64>), y: f64| Point::new(x, y, tip.map_or(low, |i| i * y - gap));
    let above = |(y, tip): (f64, Option<f64>), x: f64| Point::new(x, y, tip.map_or(high, |j| x * j + gap));
    let mut soup = Soup::default();
    for pair in profile.windows(2) {
        let [p, q] = [pair[0], pair[1]];
        soup.quad([below(p, 0.0), below(p, side), below(q, side), below(q, 0.0)], INSIDE);
        soup.quad([above(p, 0.0), above(p, side), above(q, side), above(q, 0.0)], INSIDE);
    }
    let mut wall = |mut outline: Vec<Point>, outward: crate::Vector| {
        let corners: Vec<u32> = (0..outline.len() as u32).collect();
        let area: crate::Vector = (1..outline.len() - 1)
            .map(|i| crate::kernel::simplex::area_vector(&outline[0], &outline[i], &outline[i + 1]))
            .sum();
        if area.dot(&outward) < 0.0 {
            outline.reverse();
        }
        let first = Point::origin();
        let (u, v) = if outward.x != 0.0 {
            (crate::Vector::y(), crate::Vector::z())
        } else {
            (crate::Vector::z(), crate::Vector::x())
        };
        let (u, v) = if outward.sum() > 0.0 { (u, v) } else { (v, u) };
        let shadow = polygon::Shadow::of([&first, &(first + u), &(first + v)]);
        for t in polygon::triangulate(&outline, shadow, &corners).unwrap() {
            soup.add(t.map(|i| outline[i as usize]), INSIDE);
        }
    };
    for end in [0.0, side] {
        let mut outline: Vec<Point> = profile.iter().map(|&p| below(p, end)).collect();
        outline.extend([Point::new(side, end, high), Point::new(0.0, end, high)]);
        wall(outline, crate::Vector::new(0.0, if end > 0.0 { 1.0 } else { -1.0 }, 0.0));
        let mut outline: Vec<Point> = profile.iter().map(|&p| above(p, end)).collect();
        outline.extend([Point::new(end, side, low), Point::new(end, 0.0, low)]);
        wall(outline, crate::Vector::new(if end > 0.0 { 1.0 } else { -1.0 }, 0.0, 0.0));
    }
    soup
}

#[test]
fn blocks_with_crossing_notches_are_filled() {
    for n in [1, 2, 3, 4] {
        for gap in [0.2, 0.01] {
            filled(notched_block(n, gap), 1.0);
        }
    }
}

#[test]
fn flat_ellipsoids_and_thin_shells_are_filled() {
    for (levels, flat) in [(2, 0.1), (3, 0.01), (3, 1e-4), (2, 5.0)] {
        let mut soup = Soup::default();
        soup.sphere(Point::origin(), 1.0, levels, INSIDE);
        soup.map(|p| Point::new(p.x + 0.3 * p.z, p.y, p.z * flat));
        filled(soup, 0.2);
    }
    for thickness in [0.1, 0.01, 1e-5] {
        let mut soup = Soup::default();
        soup.sphere(Point::origin(), 1.0, 3, INSIDE);
        soup.sphere(Point::origin(), 1.0 - thickness, 3, [None, A]);
        filled(soup, 0.2);
    }
}

/// The triangles of an ASCII STL file, equal points made one.
fn read_stl(text: &str) -> Soup {
    let numbers: Vec<f64> = text
        .lines()
        .filter_map(|line| line.trim().strip_prefix("vertex "))
        .flat_map(|line| line.split_whitespace().map(|x| x.parse::<f64>().unwrap()))
        .collect();
    let mut soup = Soup::default();
    for t in numbers.chunks_exact(9) {
        soup.add([0, 3, 6].map(|i| Point::new(t[i], t[i + 1], t[i + 2])), INSIDE);
    }
    soup
}

#[test]
fn machine_parts_of_needle_triangles_are_filled() {
    let shared = std::env::var("TETMILL_SHARED")
        .unwrap_or_else(|_| concat!(env!("CARGO_MANIFEST_DIR"), "/../shared").to_owned());
    for part in ["hinge", "part1"] {
        let path = format!("{shared}/netgen-tutorials/{part}.stl");
        match std::fs::read_to_string(&path) {
            Ok(text) => {
                filled(read_stl(&text), 5.0);
            }
            Err(error) => eprintln!("SKIPPED, set TETMILL_SHARED: {path}: {error}"),
        }
    }
}
