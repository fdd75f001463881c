//! Parts of a cube, a ball and a cylinder that were meshed independently, and a slab between two
//! cuts.

use super::*;
use crate::ground::comm::thread;
use crate::ground::mesh::Rank;
use crate::ground::size::UniformSize;
use crate::mesher::improve::{Measure, Settings as Improve};
use crate::parallel::check::{self, PartReport, check, checksum_of_all};
use crate::parallel::distribution::{distribute, number_shared};
use crate::parallel::refine::fixtures::{Fixture, ball, cube, cylinder};
use crate::parallel::refine::{self, refine};
use crate::parallel::skin;

/// The ragged parts of a fixture, each meshed inside its surface.
fn filled(comm: &dyn Communicator, fixture: &Fixture, h: f64) -> BareMesh {
    let rank_of: Vec<Rank> = (0..fixture.mesh.tets.len() as u32).map(|t| t / 3 % comm.size()).collect();
    let given = (comm.rank() == 0).then(|| (fixture.mesh.clone(), rank_of));
    let part = distribute(comm, given).expect("a classified mesh");
    let skin = skin::skin(&part, &fixture.projector, 2).expect("a skin");
    let tets = skin::fill_or_refine(
        &part,
        &fixture.projector,
        &skin,
        &UniformSize(h),
        skin::Improvement { settings: &Improve::default(), smoothness: None },
    );
    let boundary = skin.numbering.totals().boundary;
    skin::number(comm, skin.skin, tets.expect("tets"), boundary).expect("all ranks")
}

/// The check report of a distributed mesh.
fn checked(comm: &dyn Communicator, fixture: &Fixture, mesh: BareMesh) -> PartReport {
    let whole = number_shared(comm, mesh).expect("a mesh");
    whole.check(comm).expect("a distributed mesh, with ids without gaps");
    let mesh = refine(whole, &fixture.projector, 1, &refine::Settings::default()).expect("positive tets");
    let report =
        check(comm, &mesh, Some(&fixture.projector), &check::Settings::default()).expect("all ranks");
    assert_eq!(report.faults, 0, "{:?}", report.described);
    assert_eq!(checksum_of_all(comm, &mesh).expect("all ranks").open, 0, "each face is matched");
    report
}

/// Settings with these angles for each round, however many tets are bad.
fn with_angles(angles: &[f64]) -> Settings {
    Settings { angles: angles.to_vec(), angles_if_many: angles.to_vec(), ..Settings::of(Measure::Refined) }
}

#[test]
fn improved_parts_still_fit_and_fill_the_bodies() {
    for (fixture, h) in [(ball(1.0), 0.4), (cylinder(2), 0.3)] {
        for (ranks, merge_angle) in [(2, None), (5, Some(35.0)), (16, None), (16, Some(35.0))] {
            let settings = Settings { merge_angle, ..with_angles(&[35.0; 4]) };
            let made = thread::run(ranks, |comm| {
                let before = filled(comm, &fixture, h);
                let volume = checked(comm, &fixture, before.clone()).volume;
                let count = before.tets.len();
                let (after, report) = improve_across(comm, before, &[], &settings, None).expect("all ranks");
                let sizes = comm.all_gather_one(after.tets.len() as f64).expect("all ranks");
                let sizes = sizes.iter().zip(comm.all_gather_one(count as f64).expect("all ranks"));
                let most = sizes.map(|(after, before)| after / before).fold(0.0, f64::max);
                (volume, checked(comm, &fixture, after), report.expect("ragged parts have bad tets"), most)
            });
            let (volume, after, report, most) = made.expect("no rank fails").swap_remove(0);
            assert!(most < 1.3, "{ranks} ranks: a part has {most} of the tets that it had");
            assert!(report.merged == 0 || merge_angle.is_some(), "{ranks} ranks: {report:?}");
            let off = if report.merged > 0 { 0.02 } else { 1e-13 };
            assert!((after.volume / volume - 1.0).abs() < off, "{ranks} ranks: {} {volume}", after.volume);
            assert!(report.smallest_after > report.smallest_before - 1e-6, "{ranks} ranks: {report:?}");
            assert!(report.bad_after < report.bad_before, "{ranks} ranks: {report:?}");
        }
    }
}

#[test]
fn bodies_side_by_side_keep_the_face_between_them() {
    let fixture = cube(4, true);
    let settings = with_angles(&[50.0; 4]);
    let made = thread::run(7, |comm| {
        let before = filled(comm, &fixture, 0.2);
        let volumes = checked(comm, &fixture, before.clone()).body_volumes;
        let (after, report) = improve_across(comm, before, &[], &settings, None).expect("all ranks");
        (volumes, checked(comm, &fixture, after).body_volumes, report)
    });
    let (before, after, report) = made.expect("no rank fails").swap_remove(0);
    assert!(report.is_some_and(|report| report.tets > 0));
    assert_eq!(before.len(), 2);
    assert!(before.iter().zip(after).all(|(before, after)| (after / before - 1.0).abs() < 1e-12));
}

#[test]
fn parts_without_bad_tets_stay_as_they_are() {
    let fixture = cube(3, false);
    let settings = with_angles(&[1.0]);
    let same = thread::run(3, |comm| {
        let before = filled(comm, &fixture, 0.3);
        improve_across(comm, before.clone(), &[], &settings, None).expect("all ranks") == (before, None)
    });
    assert_eq!(same.expect("no rank fails"), [true; 3]);
}

#[test]
fn the_same_parts_become_the_same_with_any_number_of_threads() {
    let fixture = cylinder(2);
    let sum = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let sums = pool.install(|| {
            thread::run(4, |comm| {
                let mesh = filled(comm, &fixture, 0.3);
                let (after, _) = improve_across(comm, mesh, &[], &Settings::of(Measure::MeanRatio), None)
                    .expect("all ranks");
                checksum_of_all(comm, &crate::parallel::migrate::BareStream::new(after)).expect("all ranks")
            })
        });
        sums.expect("no rank fails").swap_remove(0)
    };
    assert_eq!(sum(1), sum(3));
}
