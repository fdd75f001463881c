//! Volume meshing of simple surfaces.

use super::samples::*;
use super::*;
use crate::ground::size::UniformSize;

const EMPTY: Settings = Settings { fill: false, growth: 0.5, max_tets: 1 << 20 };

/// Meshes a surface without and with interior points, checks both meshes and returns the report of
/// the latter.
pub(super) fn filled(soup: Soup, size: f64) -> Report {
    let surface = soup.surface().unwrap();
    let (empty, bare) = mesh(&surface, &UniformSize(size), &EMPTY).unwrap();
    check_fills(&surface, &empty);
    let (full, report) = mesh(&surface, &UniformSize(size), &Settings::default()).unwrap();
    check_fills(&surface, &full);
    assert_eq!(report, Report { points_inside: report.points_inside, ..bare });
    assert_eq!(full.points.len(), surface.points().len() + report.steiner_inside + report.points_inside);
    report
}

/// Like [`filled`], without interior points.
pub(super) fn bare(soup: Soup) -> Report {
    let surface = soup.surface().unwrap();
    let (mesh, report) = mesh(&surface, &UniformSize(1.0), &EMPTY).unwrap();
    check_fills(&surface, &mesh);
    assert_eq!(mesh.points.len(), surface.points().len() + report.steiner_inside);
    report
}

#[test]
fn without_its_free_slots_a_mesh_has_the_same_tets() {
    // Many tets of the Delaunay mesh are in the hole.
    let mut soup = Soup::default();
    soup.torus([3.0, 1.0], [40, 20], INSIDE);
    let surface = soup.surface().unwrap();
    let (mut mesh, _) = bound::bound(&surface, surface.points(), &mut Report::default()).unwrap();
    let tets = |mesh: &tetrahedra::Tetrahedra| -> Vec<([u32; 4], u32, u8)> {
        let of = |t: usize| (mesh.tets[t], mesh.bodies[t], mesh.locked[t]);
        mesh.alive().map(|t| of(t as usize)).collect()
    };
    let before = tets(&mesh);
    assert!(mesh.free.len() > before.len() / 4, "{} free slots", mesh.free.len());
    mesh.remove_free_slots();
    assert_eq!((mesh.tets.len(), mesh.free.len()), (before.len(), 0));
    assert_eq!(tets(&mesh), before);
    assert_eq!(mesh.check(), Vec::<String>::new());
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
            // With the opposite turn it is convex.
            assert_eq!(report.steiner_inside, usize::from(sign < 0.0), "{degrees} degrees");
        }
    }
}

#[test]
fn boundaries_of_random_bodies_in_a_bent_lattice_are_filled() {
    let mut random = crate::ground::kernel::random::Random::new(11);
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
        for [i, j] in crate::ground::mesh::TET_EDGES {
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

/// Whether the edge lengths at each vertex differ by less than this factor, except at one vertex in
/// a thousand.
fn grows_smoothly(mesh: &VolumeMesh, factor: f64) -> bool {
    let mut range = vec![[f64::INFINITY, 0.0]; mesh.points.len()];
    for tet in &mesh.tets {
        for [i, j] in crate::ground::mesh::TET_EDGES {
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
fn without_a_size_field_tets_grow_from_the_surface() {
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
fn a_surface_of_very_different_edges_is_filled_smoothly() {
    // Inversion maps the sphere to a sphere with similar triangles, whose sizes have a ratio of
    // 200.
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
fn at_constant_size_most_tets_have_the_shape_of_the_lattice() {
    let mut soup = Soup::default();
    soup.brick([0.; 3], [1.; 3], 16, INSIDE);
    let surface = soup.surface().unwrap();
    let mesh = mesh(&surface, &UniformSize(1.0 / 16.0), &Settings::default()).unwrap().0;
    check_fills(&surface, &mesh);
    let is_regular = |tet: &&[u32; 4]| {
        let [a, b, c, d] = tet.map(|v| &mesh.points[v as usize]);
        (crate::ground::kernel::quality::mean_ratio(a, b, c, d) - 0.952).abs() < 0.001
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
    // Two overlapping cubes; a cube pierced by a needle.
    let mut cubes = Soup::default();
    cubes.brick([0.; 3], [1.; 3], 2, INSIDE);
    cubes.brick([0.7, 0.6, 0.55], [1.7, 1.6, 1.55], 2, INSIDE);
    let mut needle = Soup::default();
    needle.brick([0.; 3], [1.; 3], 2, INSIDE);
    needle.brick([0.3, 0.31, -0.5], [0.32, 0.33, 1.5], 1, INSIDE);
    // Two linked tori that intersect; a vertex that touches a face from inside.
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
fn crumpled_surfaces_are_rejected_or_filled_correctly() {
    let mut random = crate::ground::kernel::random::Random::new(3);
    let (mut refused, mut whole) = (0, 0);
    for case in 0..200 {
        let mut soup = Soup::default();
        if case % 2 == 0 {
            soup.torus([1.0, 0.4], [5, 4], INSIDE);
        } else {
            soup.sphere(Point::origin(), 1.0, 1, INSIDE);
        }
        // From a dent to a tangle; every third on a coarse lattice, so that corners meet faces and
        // edges exactly.
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
            // An inverted surface without intersections has its body outside.
            Err(VolumeError::Inconsistent { .. }) => {}
            Err(other) => panic!("case {case}: {other}"),
        }
    }
    assert!(refused > 50 && whole > 10, "{refused} refused, {whole} whole");
}

#[test]
fn bodies_inside_out_are_refused() {
    // A void whose outer region differs from the surrounding body.
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
