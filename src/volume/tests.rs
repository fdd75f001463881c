//! Whole surfaces through the volume mesher.

use super::samples::*;
use super::*;
use crate::size::UniformSize;

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

/// As [`filled`], without points by a size field.
fn bare(soup: Soup) -> Report {
    let surface = soup.surface().unwrap();
    let (mesh, report) = mesh(&surface, &UniformSize(1.0), &EMPTY).unwrap();
    check_fills(&surface, &mesh);
    assert_eq!(mesh.points.len(), surface.points().len() + report.steiner_inside);
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

#[test]
fn the_schoenhardt_polyhedron_gets_one_point_inside() {
    for degrees in [1.0f64, 10.0, 30.0, 45.0, 55.0] {
        for sign in [1.0, -1.0] {
            let report = filled(twisted_prisms(3, sign * degrees.to_radians(), 1.0, 1), 2.0);
            // Turned the other way it is convex.
            assert_eq!(report.steiner_inside, usize::from(sign < 0.0), "{degrees} degrees");
        }
    }
}

#[test]
fn skins_of_random_bodies_in_a_bent_lattice_are_filled() {
    let mut random = crate::kernel::random::Random::new(11);
    for case in 0..60 {
        let squeeze = [0, 1, 2].map(|_| 0.15 + random.unit());
        let (shear, bend) = (5.0 * random.unit() - 2.5, 1.0 * random.unit() * f64::from(case % 2));
        let n = 2 + case % 3;
        let soup = lattice_skin(n, squeeze, shear, bend, 1, || match random.bits() % 4 {
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
        let faults = soup.surface().unwrap_err();
        assert!(faults.0.iter().all(|f| matches!(f, SurfaceFault::Intersect { .. })), "{faults}");
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
        let Ok(surface) = soup.surface() else {
            refused += 1;
            continue;
        };
        match mesh(&surface, &UniformSize(0.5), &Settings::default()) {
            Ok((mesh, _)) => {
                check_fills(&surface, &mesh);
                whole += 1;
            }
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

#[test]
fn stacks_of_prisms_twisted_nearly_to_their_limit_are_filled() {
    for (sides, layers) in [(3, 1), (3, 4), (4, 2), (6, 1), (9, 2), (16, 1)] {
        for part in [0.5, 0.9, 0.99] {
            filled(twisted_prisms(sides, -part * twist_limit(sides), 1.0, layers), 2.0);
        }
    }
}

#[test]
fn sheets_a_billionth_apart_with_other_triangles_are_filled_on_all_sides() {
    let mut random = crate::kernel::random::Random::new(21);
    for n in [3, 8, 14] {
        for gap in [1e-3, 3e-9] {
            for flips in [0, 4 * n * n] {
                bare(lens(n, gap, flips, &mut random));
            }
        }
    }
}

#[test]
fn balls_of_spikes_and_turned_edges_are_filled() {
    let mut random = crate::kernel::random::Random::new(22);
    for (levels, reach) in [(0, 1e4), (1, 1e4), (2, 1e4), (2, 10.0), (3, 3.0)] {
        for outer in [false, true] {
            bare(spiked_ball(levels, reach, 60 << (2 * levels), outer, &mut random));
        }
    }
}

#[test]
fn staircases_that_touch_themselves_are_filled() {
    let mut random = crate::kernel::random::Random::new(23);
    for case in 0..20 {
        let shift = [0.0, 0.05, 0.1][case % 3];
        let kinds = 2 + case as u64 % 3;
        bare(staircase(2 + case as u32 % 3, shift, &mut random, |random| match random.bits() % kinds {
            0 => A,
            1 => B,
            _ => None,
        }));
    }
}

#[test]
fn skins_of_refined_tets_are_filled() {
    let mut random = crate::kernel::random::Random::new(24);
    for case in 0..6 {
        let squeeze = [0, 1, 2].map(|_| 0.3 + random.unit());
        let parts = 2 + case % 2;
        bare(lattice_skin(2, squeeze, 0.5, 0.1, 4, || match random.bits() % parts {
            0 => A,
            1 => B,
            _ => None,
        }));
    }
}

#[test]
fn needles_of_aspect_ten_thousand_are_filled() {
    for sides in [5, 24, 100] {
        for wall in [0.5, 1e-3] {
            filled(needle_tube(sides, 1e4, wall), f64::INFINITY);
        }
        filled(needle_cone(sides, 1e4), f64::INFINITY);
    }
}

#[test]
fn a_surface_graded_over_four_orders_of_magnitude_is_filled() {
    bare(graded_ball(90, 60, 1e-4));
    let mut random = crate::kernel::random::Random::new(25);
    for offset in [1e6, -3e5] {
        // Units of a millionth, or far from the origin: the surface is what rounding makes of it.
        let mut far = spiked_ball(1, 3.0, 100, false, &mut random);
        far.map(|p| p + crate::Vector::new(offset, 2.0 * offset, 0.0));
        bare(far);
        let mut tiny = spiked_ball(1, 3.0, 100, true, &mut random);
        tiny.map(|p| p * 1e-6);
        bare(tiny);
    }
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
fn blocks_with_many_notches_need_fewer_points_than_edges_and_triangles_were_missing() {
    // An unlucky order of edges needed hundreds of points and came to no end.
    let turn = nalgebra::Rotation3::from_euler_angles(0.4, -0.9, 1.7);
    for gap in [0.3, 0.01, 1e-3] {
        let mut soup = notched_block(6, gap);
        soup.map(|p| turn * p);
        let report = bare(soup);
        assert!(report.missing_edges > 50, "{report:?}");
        assert!(report.steiner_on_surface < report.missing_edges + report.missing_faces, "{report:?}");
    }
}

#[test]
fn steiner_points_leave_the_surface_at_the_first_attempt() {
    // Of these 21 surfaces five took two attempts or more when points were put on the faces that they cross.
    let mut restarts = 0;
    for k in 0..7 {
        let turn = nalgebra::Rotation3::from_euler_angles(0.4 * f64::from(k), -0.9, 1.7);
        for mut soup in [
            notched_block(4, 10f64.powi(-k)),
            twisted_prisms(3 + k as u32, -0.9 * twist_limit(3 + k as u32), 1.0, 3),
            twisted_prisms(9, -0.98 * twist_limit(9), 10f64.powf(0.3 * f64::from(k)), 2),
        ] {
            soup.map(|p| turn * p);
            restarts += bare(soup).restarts;
        }
    }
    // Flips give up where three generations of points or two points for each missing edge are in vain, and exact points end it: each such surface counts once.
    assert!(restarts <= 3, "{restarts}");
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
                let report = filled(read_stl(&text), 5.0);
                // Half of those that leave the surface are not needed: of 36 on the hinge 12 stayed.
                assert!(2 * report.steiner_inside <= 1 + report.steiner_on_surface.max(9), "{report:?}");
            }
            Err(error) => eprintln!("SKIPPED, set TETMILL_SHARED: {path}: {error}"),
        }
    }
}
