//! Properties of curves and surfaces, damaged files, and convergence of tessellations.

use crate::bspline::{Basis, SplineCurve, SplineSurface};
use crate::*;
use nalgebra::{Matrix3, Rotation3, Vector2, Vector4};
use proptest::prelude::*;
use std::f64::consts::TAU;

/// A fixed seed, so every run tries the same cases.
fn seeded() -> proptest::test_runner::Config {
    proptest::test_runner::Config { rng_seed: proptest::test_runner::RngSeed::Fixed(1), ..Default::default() }
}

/// Random numbers from −1 to 1, in a circle.
#[derive(Debug)]
struct Numbers(Vec<f64>, usize);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.1 += 1;
        self.0[self.1 % self.0.len()]
    }

    fn vector(&mut self) -> Vector {
        Vector::new(self.next(), self.next(), self.next())
    }

    fn frame(&mut self) -> [Vector; 3] {
        let turn = Rotation3::new(self.vector() * 3.0);
        [Vector::x(), Vector::y(), Vector::z()].map(|a| turn * a)
    }

    fn spline_curve(&mut self, is_rational: bool, is_periodic: bool) -> Curve<3> {
        let (knots, multiplicities, poles): (Vec<f64>, Vec<usize>, usize) = if is_periodic {
            (vec![0.0, 0.4, 1.0, 1.7, 2.5], vec![1, 1, 2, 1, 1], 5)
        } else {
            (vec![-1.0, 0.2, 0.9, 2.0], vec![4, 1, 2, 4], 7)
        };
        let basis = Basis::new(3, &knots, &multiplicities, poles, is_periodic).unwrap();
        let angle = |k: usize| k as f64 * if is_periodic { 1.25 } else { 0.5 };
        let around = |k: usize| Vector::new(angle(k).cos(), angle(k).sin(), 0.0) * 2.0;
        let poles: Vec<Vector> = (0..poles).map(|k| around(k) + self.vector() * 0.3).collect();
        let weights =
            if is_rational { poles.iter().map(|_| 1.0 + 0.4 * self.next()).collect() } else { vec![] };
        Curve::Spline(SplineCurve { basis, poles, weights })
    }

    fn curves(&mut self) -> Vec<Curve<3>> {
        let [x, y, z] = self.frame();
        let center = self.vector();
        let axes = [x * 1.5, y];
        let mut all = vec![
            Curve::Line { start: center, direction: z },
            Curve::Ellipse { center, axes },
            Curve::Parabola { apex: center, axes },
            Curve::Hyperbola { center, axes },
        ];
        for (rational, periodic) in [(false, false), (true, false), (false, true), (true, true)] {
            all.push(self.spline_curve(rational, periodic));
        }
        for basis in [all[1].clone(), all[4].clone(), all[5].clone()] {
            let direction = (z + self.vector() * 0.2).normalize();
            all.push(Curve::Offset { basis: Box::new(basis), distance: 0.05, direction });
        }
        all
    }

    fn surfaces(&mut self) -> Vec<Surface> {
        let axes = self.frame();
        let origin = self.vector();
        let round = |profile| Surface::Round { origin, axes, profile };
        let mut all = vec![
            Surface::Plane { origin, axes: [axes[0], axes[1]] },
            round(Profile::Line { radius: 1.2, slope: [0.0, 1.0] }),
            round(Profile::Line { radius: 1.2, slope: [0.6, 0.8] }),
            round(Profile::Circle { major: 0.0, minor: 1.1 }),
            round(Profile::Circle { major: 2.0, minor: 0.7 }),
        ];
        for curve in self.curves() {
            all.push(Surface::Extrusion { curve: curve.clone(), direction: axes[2] });
            let far = origin + axes[0] * 9.0;
            all.push(Surface::Revolution { curve, origin: far, axis: axes[1] });
        }
        for is_rational in [false, true] {
            let bases = [
                Basis::new(3, &[0.0, 0.7, 1.5], &[4, 1, 4], 5, false).unwrap(),
                Basis::new(2, &[0.0, 1.0, 2.0], &[3, 1, 3], 4, false).unwrap(),
            ];
            let mut poles = Vec::new();
            for i in 0..5 {
                for j in 0..4 {
                    let weight = if is_rational { 1.0 + 0.4 * self.next() } else { 1.0 };
                    let pole = Vector::new(f64::from(i), f64::from(j), 0.0) + self.vector() * 0.3;
                    poles.push((pole * weight).push(weight));
                }
            }
            all.push(Surface::Spline(SplineSurface { bases, poles, is_rational }));
        }
        // Offsets of curves have no exact third derivatives: offsets of their sweeps are left out.
        let splines = all[all.len() - 2..].to_vec();
        for basis in [all[1].clone(), all[4].clone(), splines[0].clone(), splines[1].clone()] {
            all.push(Surface::Offset { basis: Box::new(basis), distance: 0.15 });
        }
        all
    }
}

fn numbers() -> impl Strategy<Value = Numbers> {
    proptest::collection::vec(-1.0..1.0f64, 61).prop_map(|all| Numbers(all, 0))
}

/// Whether a derivative is the difference quotient of the one before.
fn is_derivative(before: Vector, after: Vector, step: f64, derivative: Vector) -> bool {
    let quotient = (after - before) / (2.0 * step);
    (quotient - derivative).norm() <= 2e-5 * (1.0 + derivative.norm())
}

/// The step of difference quotients.
const STEP: f64 = 1e-5;

#[test]
fn projection_to_a_line_that_starts_far_away_converges() {
    // From a part of a robot: an edge near the origin, on a line that starts 500 m away.
    let start = Vector::new(-500000.00000000006, 8.261363636363543, 3.9914519976553575);
    let line = Curve::Line { start, direction: Vector::new(-1000.0, 0.0, 0.0) };
    for x in [5.432460108626531, 3.1, 4.777] {
        let point = Point::new(x, start.y, start.z);
        let foot = project_to_curve(&line, [-500.006, -500.003], &point, -500.004);
        assert!(foot.is_converged && (foot.point - point).norm() < 1e-9, "{foot:?}");
    }
}

proptest! {
    #![proptest_config(seeded())]

    #[test]
    fn derivatives_of_curves_are_limits_of_difference_quotients(mut random in numbers(), t in 0.25..0.85f64) {
        for curve in random.curves() {
            let [before, at, after] = [t - STEP, t, t + STEP].map(|t| curve.jet(t));
            for order in 0..3 {
                // No knot is between the parameters.
                let breaks = curve.breaks([t - STEP, t + STEP]);
                let is_right = is_derivative(before[order], after[order], STEP, at[order + 1]);
                let only_to_second = matches!(curve, Curve::Offset { .. }) && order == 2;
                prop_assert!(is_right || !breaks.is_empty() || only_to_second, "{order} of {curve:?}");
            }
        }
    }

    #[test]
    fn derivatives_of_surfaces_are_limits_of_difference_quotients(
        mut random in numbers(), u in 0.25..0.6f64, v in 0.25..0.6f64,
    ) {
        for surface in random.surfaces() {
            let at = surface.jet(u, v, 2).d;
            let [west, east] = [-STEP, STEP].map(|h| surface.jet(u + h, v, 2).d);
            let [south, north] = [-STEP, STEP].map(|h| surface.jet(u, v + h, 2).d);
            for (i, j) in [(0, 0), (1, 0), (0, 1)] {
                prop_assert!(is_derivative(west[i][j], east[i][j], STEP, at[i + 1][j]), "{i}{j} {surface:?}");
                prop_assert!(is_derivative(south[i][j], north[i][j], STEP, at[i][j + 1]), "{i}{j} {surface:?}");
            }
        }
    }

    #[test]
    fn a_placed_surface_has_the_placed_points_at_the_same_parameters(
        mut random in numbers(), u in 0.2..0.7f64, v in 0.2..0.7f64, scale in 0.3..3.0f64, mirrors in any::<bool>(),
    ) {
        let turn = Rotation3::new(random.vector() * 3.0).into_inner();
        let mirror = Matrix3::from_diagonal(&Vector::new(if mirrors { -1.0 } else { 1.0 }, 1.0, 1.0));
        let by = Placement { linear: turn * mirror * scale, shift: random.vector() };
        prop_assert!(by.is_similarity() && by.is_mirrored() == mirrors);
        for surface in random.surfaces() {
            let (placed, expected) = (surface.placed(&by).point([u, v]), by.point(&surface.point([u, v])));
            prop_assert!((placed - expected).norm() < 1e-12 * (1.0 + expected.coords.norm()), "{surface:?}");
        }
        for curve in random.curves() {
            let (placed, expected) = (curve.placed(&by).point(u), by.point(&curve.point(u).into()));
            prop_assert!((placed - expected.coords).norm() < 1e-12 * (1.0 + expected.coords.norm()));
        }
    }

    #[test]
    fn no_sample_is_nearer_than_the_foot_found_from_the_nearest_sample(
        mut random in numbers(), u in 0.25..0.38f64, v in 0.25..0.38f64, off in -0.1..0.1f64,
    ) {
        let samples = || (0..=40).map(|k| f64::from(k) * 0.04 - 0.1);
        for surface in random.surfaces() {
            let jet = surface.jet(u, v, 1);
            let point = jet.point() + jet.normal().unwrap() * off;
            let distance = |p: &[f64; 2]| (surface.point(*p) - point).norm();
            let grid = samples().flat_map(|u| samples().map(move |v| [u, v]));
            let nearest = grid.min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap();
            let foot = project_to_surface(&surface, &point, nearest);
            prop_assert!(foot.is_converged, "{:e} {off:e} {foot:?} {surface:?}", (foot.point - point).norm());
            prop_assert!((foot.point - point).norm() <= distance(&nearest) + 1e-12);
            // Samples of sweeps of parabolas and hyperbolas may miss a part that bends much.
            let is_sampled = match &surface {
                Surface::Extrusion { curve, .. } | Surface::Revolution { curve, .. } => {
                    !matches!(curve, Curve::Parabola { .. } | Curve::Hyperbola { .. })
                }
                _ => true,
            };
            let whole = nearest_on_surface(&surface, &point);
            let found = (whole.point - point).norm();
            prop_assert!(!is_sampled || found <= distance(&nearest) + 1e-12, "{found} {whole:?} {surface:?}");
            // From near its parameters, with no knot between, the point is found from which this
            // one was moved.
            let back = project_to_surface(&surface, &point, [u + 0.01, v - 0.01]);
            let (converged, found) = (back.is_converged, (back.point - point).norm());
            prop_assert!(converged && found <= off.abs() + 1e-9, "{converged} {found} {off} at {u} {v}: {back:?} {surface:?}");
        }
        for curve in random.curves() {
            let point = Point::from(curve.point(u) + random.vector() * 0.05);
            let distance = |t: &f64| (Point::from(curve.point(*t)) - point).norm();
            let nearest = samples().min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap();
            let foot = project_to_curve(&curve, [-0.1, 1.5], &point, nearest);
            prop_assert!(foot.is_converged, "{foot:?} {curve:?}");
            prop_assert!((foot.point - point).norm() <= distance(&nearest) + 1e-12);
            prop_assert!((nearest_on_curve(&curve, &point).point - point).norm() <= distance(&nearest) + 1e-12);
        }
    }

    #[test]
    fn projections_onto_a_crease_end_at_its_nearest_point(
        shear in -2.0..2.0f64, other in -2.0..2.0f64, slope in 0.02..1.0f64, x in 0.1..0.9f64,
        up in 0.001..0.5f64, u in 0.0..1.0f64, v in 0.0..2.0f64,
    ) {
        // A roof whose ridge is the x-axis: its parameters are sheared, on both sides differently.
        let row = |u: f64| [[u - shear, -1.0, -slope], [u, 0.0, 0.0], [u + other, 1.0, -slope]];
        let poles = [row(0.0), row(1.0)].concat();
        let poles: Vec<Vector4<f64>> = poles.into_iter().map(|[x, y, z]| Vector4::new(x, y, z, 1.0)).collect();
        let across = Basis::new(1, &[0.0, 1.0, 2.0], &[2, 1, 2], 3, false).unwrap();
        let along = Basis::new(1, &[0.0, 1.0], &[2, 2], 2, false).unwrap();
        let roof = Surface::Spline(SplineSurface { bases: [along, across], poles, is_rational: false });
        let foot = project_to_surface(&roof, &Point::new(x, 0.5 * slope * up, up), [u, v]);
        let off = (foot.point - Point::new(x, 0.0, 0.0)).norm();
        prop_assert!(foot.is_converged && off < 1e-7 * up, "{off:e} {foot:?}");
    }

    #[test]
    fn a_periodic_spline_repeats(mut random in numbers(), t in 0.0..2.5f64) {
        for is_rational in [false, true] {
            let curve = random.spline_curve(is_rational, true);
            let period = curve.period().unwrap();
            prop_assert!((period - 2.5).abs() < 1e-15);
            for (a, b) in curve.jet(t).into_iter().zip(curve.jet(t + 3.0 * period)) {
                prop_assert!((a - b).norm() < 1e-9 * (1.0 + a.norm()));
            }
            // Degree 3 and simple knots: two derivatives are continuous at the ends of the period.
            for (a, b) in curve.jet(1e-10).into_iter().zip(curve.jet(period - 1e-10)).take(3) {
                prop_assert!((a - b).norm() < 1e-7 * (1.0 + a.norm()));
            }
        }
    }

    #[test]
    fn a_rational_spline_with_equal_weights_is_the_plain_one(mut random in numbers(), t in -1.0..2.0f64) {
        let Curve::Spline(plain) = random.spline_curve(false, false) else { unreachable!("a spline") };
        let weighted = SplineCurve { weights: vec![1.7; plain.poles.len()], ..plain.clone() };
        for (a, b) in plain.jet(t).into_iter().zip(weighted.jet(t)) {
            prop_assert!((a - b).norm() < 1e-10 * (1.0 + a.norm()));
        }
    }
}

#[test]
fn a_full_circle_as_a_rational_spline_has_one_radius() {
    let basis = Basis::new(2, &[0.0, 1.0, 2.0, 3.0, 4.0], &[3, 2, 2, 2, 3], 9, false).unwrap();
    let corner = [[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1], [1, 0]];
    let poles = corner.map(|[x, y]| Vector2::new(f64::from(x), f64::from(y))).to_vec();
    let weights = (0..9).map(|k| if k % 2 == 0 { 1.0 } else { 0.5_f64.sqrt() }).collect();
    let circle = SplineCurve { basis, poles, weights };
    for k in 0..=100 {
        assert!((circle.jet(0.04 * f64::from(k))[0].norm() - 1.0).abs() < 1e-15);
    }
}

#[test]
fn points_close_to_short_arcs_of_large_circles_have_feet_on_them() {
    let (radius, range) = (4000.0, [TAU - 2e-4, TAU + 2e-4]);
    let axes = [Vector::x() * radius, Vector::y() * radius];
    let circle = Curve::Ellipse { center: Vector::new(-radius, 0.0, 1.0), axes };
    for k in 1..400 {
        let angle = range[0] + (range[1] - range[0]) * f64::from(k) / 400.0;
        let off = Vector::new(2e-5, 0.0, 3e-5);
        let point = Point::from(circle.point(angle) + off);
        let foot = project_to_curve(&circle, range, &point, range[usize::from(k > 200)]);
        let along = (foot.point - point).dot(&foot.tangent).abs();
        assert!(foot.is_converged && along < 1e-10, "{angle} {along:e}");
    }
}

#[test]
fn an_offset_in_the_plane_is_to_the_right() {
    let circle = Curve::<2>::Ellipse { center: Vector2::zeros(), axes: [Vector2::x(), Vector2::y()] };
    let offset = Curve::Offset { basis: Box::new(circle), distance: 0.5, direction: Vector2::zeros() };
    assert!((offset.point(0.7).norm() - 1.5).abs() < 1e-15);
}

#[test]
fn bases_with_numbers_that_do_not_fit_are_refused() {
    assert!(Basis::new(0, &[0.0, 1.0], &[1, 1], 1, false).is_err());
    assert!(Basis::new(26, &[0.0, 1.0], &[27, 27], 27, false).is_err());
    assert!(Basis::new(2, &[0.0, 1.0], &[3, 3], 4, false).is_err());
    assert!(Basis::new(2, &[1.0, 0.0], &[3, 3], 3, false).is_err());
    assert!(Basis::new(2, &[0.0, 1.0], &[3, 0], 3, false).is_err());
    assert!(Basis::new(2, &[0.0, 1.0, 2.0], &[1, 1, 2], 2, true).is_err());
    assert!(Basis::new(2, &[0.0, 1.0, 2.0], &[1, 1, 1], 2, true).is_ok());
}

/// A file of the repository.
fn file(name: &str) -> Vec<u8> {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../geometries/brep");
    std::fs::read(folder.join(name).with_extension("brep")).expect("a file of the repository")
}

/// The angle between normals that goes with a chord error.
fn angle(chord: f64) -> f64 {
    8.0 * chord.sqrt()
}

fn tessellated(name: &str, chord: f64) -> (Model, Tessellation) {
    let mut model = Model::read(&file(name)).unwrap();
    let tessellation = Tessellation::of(&mut model, &Settings { chord, angle: angle(chord) }).unwrap();
    (model, tessellation)
}

#[test]
fn areas_and_volumes_converge_to_those_of_opencascade() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../geometries/brep");
    let text = std::fs::read(folder.join("measures.json")).unwrap();
    let measures: serde_json::Value = serde_json::from_slice(&text).unwrap();
    let list = |part: &serde_json::Value, key: &str| -> Vec<f64> {
        let mut all: Vec<f64> = part[key].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect();
        all.sort_by(f64::total_cmp);
        all
    };
    for (name, part) in measures.as_object().unwrap() {
        let errors = [2e-3, 1.25e-4].map(|chord| {
            let (model, tessellation) = tessellated(name, chord);
            let mut volumes: Vec<f64> =
                (0..model.bodies).map(|body| tessellate::volume(&model, &tessellation, body)).collect();
            let mut areas: Vec<f64> =
                (0..model.patches.len()).map(|patch| tessellate::area(&tessellation, patch)).collect();
            volumes.sort_by(f64::total_cmp);
            areas.sort_by(f64::total_cmp);
            let worst = |found: Vec<f64>, exact: Vec<f64>| -> f64 {
                assert_eq!(found.len(), exact.len(), "{name}");
                found.iter().zip(&exact).map(|(a, b)| (a - b).abs() / b).fold(0.0, f64::max)
            };
            worst(volumes, list(part, "volumes")).max(worst(areas, list(part, "areas")))
        });
        // A sixteenth of the chord error, with room for the steps in which edges are divided; the
        // share of a circle's area beyond its chords if knots divide more finely than was asked.
        let chords = angle(1.25e-4).powi(2) / 6.0;
        assert!(errors[0] < 0.06 && errors[1] < (0.2 * errors[0]).max(chords), "{name}: {errors:?}");
    }
}

#[test]
fn every_vertex_of_a_tessellation_is_at_its_parameters() {
    for name in ["cone", "fragments", "pipe_along_spline", "mirrored"] {
        let (model, tessellation) = tessellated(name, 1e-3);
        for t in &tessellation.triangles {
            for (v, parameters) in t.vertices.into_iter().zip(t.parameters) {
                let on = model.patches[t.patch as usize].surface.point(parameters);
                let off = (on - tessellation.points[v as usize]).norm();
                assert!(off <= tessellation.gap.max(1e-12), "{name}: {off:e}");
            }
        }
    }
}

#[test]
fn a_face_of_two_solids_is_one_patch_with_both_beside_it() {
    let (model, _) = tessellated("fragments", 1e-3);
    assert!(model.bodies > 3);
    assert!(model.patches.iter().any(|patch| patch.bodies.iter().all(Option::is_some)));
}

#[test]
fn faces_of_no_solid_are_one_if_they_enclose_it() {
    for name in ["box_with_hole", "thick_cylinder"] {
        let text = String::from_utf8(file(name)).unwrap();
        assert_eq!(text.matches("\nSo\n").count(), 1);
        let volume = |text: &str| {
            let mut model = Model::read(text.as_bytes()).unwrap();
            let settings = Settings { chord: 1e-3, angle: angle(1e-3) };
            let tessellation = Tessellation::of(&mut model, &settings).unwrap();
            (model.notes.len(), model.bodies, tessellate::volume(&model, &tessellation, 0))
        };
        let (solid, faces) = (volume(&text), volume(&text.replace("\nSo\n", "\nCo\n")));
        assert_eq!((faces.0, faces.1), (1, 1), "{name}");
        assert!((faces.2 / solid.2 - 1.0).abs() < 1e-3, "{name}: {faces:?}, {solid:?}");
    }
}

#[test]
fn a_finer_patch_leaves_those_that_it_does_not_touch() {
    let mut model = Model::read(&file("box_with_hole")).unwrap();
    let before = Tessellation::of(&mut model, &Settings::default()).unwrap();
    let triangles = |t: &Tessellation, patch: usize| -> Vec<[Point; 3]> {
        let of_patch = t.triangles.iter().filter(|triangle| triangle.patch as usize == patch);
        of_patch.map(|triangle| triangle.vertices.map(|v| t.points[v as usize])).collect()
    };
    let hole = (0..model.patches.len()).find(|&k| !model.patches[k].surface.is_plane()).unwrap();
    let mut settings = before.settings().to_vec();
    settings[hole] = Settings { chord: 1e-5, angle: 0.05 };
    // The tessellation checks that the body is closed.
    let after = before.with_settings(&mut model, settings.clone()).unwrap();
    assert_eq!(after.settings(), settings);
    let is_same = |patch: &usize| triangles(&before, *patch) == triangles(&after, *patch);
    let [same, other]: [Vec<usize>; 2] =
        [true, false].map(|same| (0..model.patches.len()).filter(|patch| is_same(patch) == same).collect());
    // Four sides of the box have no edge in common with the hole, two have.
    assert!(same.len() == 4 && other.len() == 3 && other.contains(&hole), "{same:?} {other:?}");
    let [few, many] = [&before, &after].map(|t| triangles(t, hole).len());
    assert!(many > 2 * few, "{few} {many}");
    // What is as fine as before is the same.
    let again = after.with_settings(&mut model, settings).unwrap();
    assert_eq!(again.triangles, after.triangles);
}

#[test]
fn errors_have_the_line() {
    let text = String::from_utf8(file("torus")).unwrap();
    let broken = text.replace("\nEd", "\nXd");
    let line = 1 + broken.lines().position(|line| line == "Xd").unwrap();
    let error = Model::read(broken.as_bytes()).unwrap_err();
    assert_eq!(error, BrepError::Syntax { line, what: "`Xd` is no kind of shape".into() });
    let huge = text.replace("TShapes ", "TShapes 99999999");
    assert!(matches!(Model::read(huge.as_bytes()), Err(BrepError::Syntax { .. })));
    assert!(Model::read(b"solid cube").unwrap_err().to_string().contains("no BREP text"));
}

#[test]
fn cut_and_damaged_files_give_errors_or_models_but_no_panic() {
    let text = file("cone");
    let end = text.iter().rposition(|c| !c.is_ascii_whitespace()).unwrap();
    for length in 0..end - 4 {
        assert!(Model::read(&text[..length]).is_err(), "{length}");
    }
    let coarse = Settings { chord: 0.05, angle: 1.0 };
    for at in 0..text.len() {
        for new in [b' ', b'-', b'0', b'1', b'9', b'.', b'e', b'+', b'*', 0xff] {
            let mut damaged = text.clone();
            damaged[at] = new;
            if let Ok(mut model) = Model::read(&damaged) {
                let _ = Tessellation::of(&mut model, &coarse);
            }
        }
    }
}

#[test]
fn a_vertex_far_away_from_its_edge_is_refused_however_far() {
    let text = String::from_utf8(file("thick_cylinder")).unwrap();
    let coarse = Settings { chord: 0.05, angle: 1.0 };
    for far in ["1e2", "1e30"] {
        // The first vertex: its tolerance and three coordinates follow.
        let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
        let vertex = lines.iter().position(|line| line == "Ve").unwrap();
        let mut place: Vec<&str> = lines[vertex + 2].split(' ').collect();
        place[1] = far;
        lines[vertex + 2] = place.join(" ");
        let refused = Model::read(lines.join("\n").as_bytes())
            .and_then(|mut model| Tessellation::of(&mut model, &coarse))
            .expect_err("a vertex off its edge");
        assert!(refused.to_string().contains("a vertex of edge 1 is "), "{far}: {refused}");
    }
}

#[test]
fn huge_numbers_give_errors_or_models_but_no_panic() {
    let coarse = Settings { chord: 0.05, angle: 1.0 };
    let read =
        |text: &str| Model::read(text.as_bytes()).and_then(|mut model| Tessellation::of(&mut model, &coarse));
    let text = String::from_utf8(file("cone")).unwrap();
    let words: Vec<&str> = text.split(' ').collect();
    let mut refused = 0;
    for at in (0..words.len()).filter(|&at| words[at].parse::<f64>().is_ok()) {
        let mut damaged = words.clone();
        damaged[at] = "1e308";
        refused += usize::from(read(&damaged.join(" ")).is_err());
    }
    assert!(refused > 0);
    // A pole whose curve has no finite place on its surface.
    let damaged = String::from_utf8(file("loft")).unwrap().replacen("0.89258220330181093", "1e308", 1);
    let error = read(&damaged).unwrap_err().to_string();
    assert!(error.contains("finite"), "{error}");
}

#[test]
fn splines_with_weighted_poles_survive_serialization() {
    let bases = [Basis::bezier(1).unwrap(), Basis::bezier(1).unwrap()];
    let poles = [1.0, 2.0, 0.5, 3.0].map(|w| Vector4::new(w, 0.1 + w, 1.0 / 3.0, w)).to_vec();
    let surface = Surface::Spline(SplineSurface { bases, poles, is_rational: true });
    let text = serde_json::to_string(&surface).unwrap();
    assert_eq!(serde_json::from_str::<Surface>(&text).unwrap(), surface);
}

#[test]
fn tessellations_do_not_depend_on_the_number_of_threads() {
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| ["fragments.brep", "filleted_variable.brep"].map(|name| tessellated(name, 1e-4)))
    };
    let [one, several] = [on(1), on(3)];
    assert!(one.iter().all(|(_, made)| made.triangles.len() > 1000));
    assert_eq!(one, several);
}

#[test]
fn curvatures_are_those_of_the_smaller_circle() {
    let axes = [Vector::x(), Vector::y(), Vector::z()];
    let round = |profile| Surface::Round { origin: Vector::zeros(), axes, profile };
    let curvature = |surface: &Surface, u: f64, v: f64| surface.jet(u, v, 2).curvature().unwrap();
    let cylinder = round(Profile::Line { radius: 0.25, slope: [0.0, 1.0] });
    let torus = round(Profile::Circle { major: 2.0, minor: 0.5 });
    for (u, v) in [(0.3, 0.7), (2.0, -1.0), (4.0, 2.0)] {
        assert!((curvature(&cylinder, u, v) - 4.0).abs() < 1e-12);
        assert!((curvature(&torus, u, v) - 2.0).abs() < 1e-12);
    }
    let cone = round(Profile::Line { radius: 0.0, slope: [1.0, 1.0] });
    assert!((curvature(&cone, 1.0, 0.1) * 0.1 * 2.0_f64.sqrt() - 1.0).abs() < 1e-12);
    assert_eq!(cone.jet(1.0, 0.0, 2).curvature(), None);
}

#[test]
fn a_spline_moves_between_its_ends_by_interpolation() {
    let basis = Basis::clamped(3, &[0.0, 0.3, 1.0], 2).unwrap();
    let poles: Vec<Vector> =
        (0..6).map(|k| Vector::new(f64::from(k), f64::from(k * k), -f64::from(k % 2))).collect();
    let before = SplineCurve { basis, poles, weights: Vec::new() };
    let mut after = before.clone();
    let moves = [Vector::new(0.1, 0.0, 2.0), Vector::new(0.0, -3.0, 1.0)];
    after.move_ends([before.poles[0] + moves[0], before.poles[5] + moves[1]]);
    for t in [0.0, 0.1, 0.3, 0.8, 1.0] {
        let expected = before.jet(t)[0] + moves[0] * (1.0 - t) + moves[1] * t;
        assert!((after.jet(t)[0] - expected).norm() < 1e-12, "{t}");
    }
}
