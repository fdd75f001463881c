//! Complete runs on small meshes.

use super::blocks::whole;
use super::legality::Legality;
use super::samples::{
    HollowCube, UnitSphere, ball, cube, fan, half_ball, hollow_cube, refined_on_sphere, two_boxes,
};
use super::{Effort, InsertionSteps, Measure, Report, Settings, Smoothness, improve, make_refinable};
use crate::ground::kernel::simplex::volume;
use crate::ground::mesh::QualitySummary;
use crate::ground::mesh::{BoundaryTriangle, Class, Mesh, Segment, VertexId};
use crate::ground::size::UniformSize;
use csg::BodyId;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

fn body_volume(mesh: &Mesh, body: BodyId) -> f64 {
    let tets = mesh.tets.iter().zip(&mesh.bodies).filter(|(_, b)| **b == body);
    tets.map(|(t, _)| t.map(|v| mesh.points[v.index()])).map(|p| volume(&p[0], &p[1], &p[2], &p[3])).sum()
}

fn illegal(mesh: &Mesh, smoothness: &dyn Smoothness) -> usize {
    let legality = Legality::new(mesh, smoothness);
    mesh.tets.iter().filter(|t| legality.evaluate(t.map(|v| v.0)).0).count()
}

/// Checks the result of every run: a valid mesh, the same boundary and bodies, no deterioration.
fn check(before: &Mesh, after: &Mesh, report: &Report) {
    whole(after).check().unwrap();
    assert_eq!(after.points.len(), after.classes.len());
    assert_eq!(after.tets.len(), after.bodies.len());
    let triangles = |m: &Mesh| -> Vec<_> {
        m.triangles.iter().map(|t| (t.patch, t.vertices.map(|v| m.points[v.index()]))).collect()
    };
    assert_eq!(triangles(before), triangles(after), "the boundary moved");
    let segments = |m: &Mesh| -> Vec<_> {
        m.segments.iter().map(|s| (s.curve, s.vertices.map(|v| m.points[v.index()]))).collect()
    };
    assert_eq!(segments(before), segments(after), "a segment moved");
    for body in [BodyId(0), BodyId(1)] {
        let (old, new) = (body_volume(before, body), body_volume(after, body));
        assert!((old - new).abs() < 1e-9 * (1.0 + old), "body {body:?} had volume {old}, has {new}");
    }
    for (tet, body) in after.tets.iter().zip(&after.bodies) {
        for v in tet {
            if let Class::Body(b) = after.classes[v.index()] {
                assert_eq!(b, *body, "vertex {v:?} in the wrong body");
            }
        }
    }
    assert_eq!(report.after, QualitySummary::of(after));
}

#[test]
fn insertions_end_with_their_budget_and_the_mesh_is_valid() {
    let before = cube(6, 1);
    let settings = Settings { change_below: 0.9, target: 0.9, ..Settings::default() };
    let run = |settings: &Settings| {
        let mut mesh = before.clone();
        let report = improve(&mut mesh, &UniformSize(0.4), settings);
        check(&before, &mesh, &report);
        report.insertion_steps
    };
    let full = run(&settings);
    assert!(full > 10_000, "{full} steps are too few for this test");
    let insertion_steps = InsertionSteps { of_block: full / 10, of_tet: 0 };
    let limited = run(&Settings { insertion_steps, ..settings.clone() });
    assert!(limited >= full / 10 && limited < full / 3, "{limited} of {full} steps");
    let none = InsertionSteps { of_block: 0, of_tet: 0 };
    assert_eq!(run(&Settings { insertion_steps: none, ..settings }), 0);
}

#[test]
fn a_shaken_cube_gets_good_angles_and_keeps_its_boundary() {
    for seed in 1..4 {
        for measure in [Measure::MeanRatio, Measure::Refined] {
            let before = cube(6, seed);
            let mut mesh = before.clone();
            let report = improve(&mut mesh, &UniformSize(0.4), &Settings { measure, ..Settings::default() });
            check(&before, &mesh, &report);
            assert!(report.after.worst_mean_ratio >= report.before.worst_mean_ratio);

            assert!(report.after.smallest_dihedral > 25.0, "{:?}", report.after);
        }
    }
}

#[test]
fn interfaces_between_bodies_stay() {
    let before = two_boxes(6, 1);
    let mut mesh = before.clone();
    let report = improve(&mut mesh, &UniformSize(0.4), &Settings::of(Effort::Thorough, Measure::Refined));
    check(&before, &mesh, &report);
    assert!(report.after.smallest_dihedral > 25.0, "{:?}", report.after);
}

#[test]
fn a_ball_has_no_tet_left_that_flattens_on_the_sphere() {
    for n in [2, 3, 6] {
        let before = ball(n);
        assert!(illegal(&before, &UnitSphere) > 0);
        let mut mesh = before.clone();
        let report =
            make_refinable(&mut mesh, &UniformSize(2.0 / n as f64), &UnitSphere, &Settings::default());
        check(&before, &mesh, &report);

        assert_eq!(report.illegal_before, illegal(&before, &UnitSphere));
        assert_eq!((report.illegal_left, illegal(&mesh, &UnitSphere)), (0, 0));
    }
}

#[test]
fn a_half_ball_has_no_tet_left_that_flattens_at_its_rim() {
    let before = half_ball(6);
    let mut mesh = before.clone();
    let report = make_refinable(&mut mesh, &UniformSize(0.4), &UnitSphere, &Settings::default());
    check(&before, &mesh, &report);

    assert!(report.illegal_before > 0);
    assert_eq!((report.illegal_left, illegal(&mesh, &UnitSphere)), (0, 0));
    assert_eq!(report.illegal_triangles, 2, "two corners of the disc have both edges on the rim");
}

/// The worst mean ratio after `levels` refinements with projection to the sphere.
fn worst_after(mesh: &Mesh, radius: f64, levels: usize) -> f64 {
    let mut fine = mesh.clone();
    for _ in 0..levels {
        fine = refined_on_sphere(&fine, radius);
    }
    QualitySummary::of(&fine).worst_mean_ratio
}

#[test]
fn refined_and_snapped_tets_stay_good() {
    // The ball has illegal tets; the void of the hollow cube bends towards legal tets.
    let ball = (1.0, ball(2), 1.0, &UnitSphere as &dyn Smoothness);
    let hollow = (0.5, hollow_cube(4), 0.5, &HollowCube as &dyn Smoothness);
    for (size, before, radius, smoothness) in [ball, hollow] {
        let mut mesh = before.clone();
        let report = make_refinable(&mut mesh, &UniformSize(size), smoothness, &Settings::default());
        check(&before, &mesh, &report);
        assert_eq!((report.illegal_left, report.folding_left), (0, 0));
        let [old, new] = [&before, &mesh].map(|m| worst_after(m, radius, 3));
        assert!(old < 0.3 && new > 0.4, "from {old} to {new}");
        let mut plain = before.clone();
        improve(&mut plain, &UniformSize(size), &Settings::default());
        assert!(worst_after(&plain, radius, 3) < new + 1e-9, "limits give no improvement");
    }
}

#[test]
fn the_same_input_gives_the_same_mesh() {
    let run = || {
        let mut mesh = half_ball(6);
        make_refinable(&mut mesh, &UniformSize(0.4), &UnitSphere, &Settings::default());
        format!("{mesh:?}")
    };
    assert!(run() == run());
}

#[test]
fn any_number_of_threads_gives_the_same_mesh() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut mesh = cube(8, 1);
            let settings = Settings { block: 300, ..Settings::default() };
            let report = improve(&mut mesh, &UniformSize(0.3), &settings);
            (format!("{mesh:?}"), report)
        })
    };
    let one = run(1);
    assert!(one == run(2));
    assert!(one == run(4));
}

#[test]
fn blocks_leave_no_bad_tets_at_their_seams() {
    for block in [500, 2000] {
        let before = two_boxes(8, 1);
        let mut mesh = before.clone();
        let settings = Settings { block, ..Settings::of(Effort::Thorough, Measure::Refined) };
        let report = improve(&mut mesh, &UniformSize(0.3), &settings);
        check(&before, &mesh, &report);
        assert!(report.after.smallest_dihedral > 25.0, "{:?}", report.after);
    }
}

#[test]
fn a_ball_in_blocks_has_no_tet_left_that_flattens() {
    let before = ball(6);
    for block in [60, 300] {
        let mut mesh = before.clone();
        let settings = Settings { block, ..Settings::default() };
        let report = make_refinable(&mut mesh, &UniformSize(0.4), &UnitSphere, &settings);
        check(&before, &mesh, &report);
        assert_eq!(report.illegal_before, illegal(&before, &UnitSphere));
        assert_eq!((report.illegal_left, illegal(&mesh, &UnitSphere)), (0, 0), "blocks of {block}");
    }
}

#[test]
#[should_panic(expected = "a boundary triangle is not a face of a tet")]
fn a_boundary_triangle_off_the_tets_is_refused() {
    let mut mesh = cube(2, 1);
    let tet = mesh.tets[0];
    let far = mesh.triangles[0].vertices[0].0.max(20);
    mesh.triangles[0].vertices = [tet[0], tet[1], VertexId(far)];
    improve(&mut mesh, &UniformSize(1.0), &Settings::default());
}

#[test]
fn more_effort_gives_better_angles() {
    for measure in [Measure::MeanRatio, Measure::Refined] {
        let ends = [Effort::Quick, Effort::Standard, Effort::Careful].map(|effort| {
            let mut mesh = cube(8, 3);
            improve(&mut mesh, &UniformSize(0.3), &Settings::of(effort, measure)).after.first_percentile
        });
        assert!(ends.is_sorted(), "{measure:?}: {ends:?}");
    }
}

#[test]
fn an_empty_mesh_and_a_single_tet_are_left_alone() {
    let mut empty = Mesh::default();
    assert_eq!(improve(&mut empty, &UniformSize(1.0), &Settings::default()).after.tets, 0);
    let mut fan = fan(5, 0.6);
    let before = format!("{fan:?}");
    improve(&mut fan, &UniformSize(1.0), &Settings { passes: 1, change_below: 0.0, ..Settings::default() });
    assert_eq!(before, format!("{fan:?}"));
}

#[test]
#[should_panic(expected = "not positively oriented")]
fn an_inverted_tet_is_refused_with_its_id() {
    let mut mesh = cube(2, 1);
    mesh.tets[3].swap(0, 1);
    improve(&mut mesh, &UniformSize(1.0), &Settings::default());
}

#[test]
fn points_of_the_user_inside_a_body_stay() {
    let mut mesh = cube(4, 2);
    let inside = (0..mesh.points.len()).find(|&v| matches!(mesh.classes[v], Class::Body(_))).unwrap();
    mesh.classes[inside] = Class::Corner(csg::CornerId(0));
    let before = mesh.clone();
    let report = improve(&mut mesh, &UniformSize(0.5), &Settings::default());
    check(&before, &mesh, &report);
    let after = mesh.classes.iter().position(|c| matches!(c, Class::Corner(_))).expect("the point is there");
    assert_eq!(before.points[inside], mesh.points[after]);
    assert!(mesh.tets.iter().flatten().any(|v| v.index() == after), "and is a vertex of tets");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() })]
    #[test]
    fn any_shaken_mesh_stays_valid_and_gets_no_worse(
        n in 1..4_usize, seed in 0..1000_u64, boxes: bool, below in 0.2..1.0, size in 0.2..2.0, block in 20..800_usize
    ) {
        let before = if boxes { two_boxes(2 * n, seed) } else { cube(2 * n, seed) };
        let mut mesh = before.clone();
        let settings =
            Settings { measure: Measure::MeanRatio, passes: 3, change_below: below, block, ..Settings::default() };
        let report = improve(&mut mesh, &UniformSize(size), &settings);
        check(&before, &mesh, &report);
        prop_assert!(report.after.worst_mean_ratio >= report.before.worst_mean_ratio);
    }
}

#[test]
fn segments_inside_bodies_stay() {
    let mut before = cube(6, 2);
    let inside = |v: &VertexId| matches!(before.classes[v.index()], Class::Body(_));
    let edges = before.tets.iter().step_by(9).map(|tet| [tet[0], tet[3]]);
    let kept: Vec<[VertexId; 2]> = edges.filter(|edge| edge.iter().all(inside)).collect();
    assert!(kept.len() > 20);
    before.segments.extend(kept.iter().map(|&vertices| Segment { vertices, curve: csg::CurveId(7) }));
    let mut mesh = before.clone();
    let report = improve(&mut mesh, &UniformSize(0.4), &Settings::default());
    check(&before, &mesh, &report);
    assert!(report.after.worst_mean_ratio > report.before.worst_mean_ratio);
    for segment in &mesh.segments {
        let is_there = |tet: &[VertexId; 4]| segment.vertices.iter().all(|v| tet.contains(v));
        assert!(mesh.tets.iter().any(is_there), "{segment:?}");
    }
}

#[test]
fn a_cavity_may_not_have_both_sides_of_a_face_that_stays() {
    let mut mesh = cube(4, 1);
    // Faces between interior vertices become cracks, with one body on both sides.
    let inside = |v: &VertexId| matches!(mesh.classes[v.index()], Class::Body(_));
    let faces = mesh.tets.iter().step_by(11).map(|tet| [tet[1], tet[2], tet[3]]);
    let cracks: Vec<[VertexId; 3]> = faces.filter(|face| face.iter().all(inside)).collect();
    assert!(!cracks.is_empty());
    let patch = csg::PatchId(6);
    mesh.triangles.extend(cracks.iter().map(|&vertices| BoundaryTriangle { vertices, patch }));
    let complex = whole(&mesh);
    for face in &cracks {
        let at = |t: &u32| face.iter().all(|v| complex.tets[*t as usize].contains(&v.0));
        let sides: Vec<u32> = complex.living().filter(at).collect();
        let same: Vec<([u32; 4], f64)> = sides.iter().map(|&t| (complex.tets[t as usize], 0.0)).collect();
        assert!(!complex.may_replace(&sides, &same));
        assert!(complex.may_replace(&sides[..1], &same[..1]));
    }
    let before = mesh.clone();
    let report = improve(&mut mesh, &UniformSize(0.4), &Settings::default());
    check(&before, &mesh, &report);
}
