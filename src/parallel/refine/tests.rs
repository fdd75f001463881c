//! Refinement of a cube, a ball and a cylinder, serial and in parts.

use super::fixtures::{Fixture, as_mesh, ball, cube, cylinder, shell, tet, whole};
use super::*;
use crate::ground::comm::thread;
use crate::ground::kernel::predicates::{Sign, orient3d};
use crate::ground::kernel::simplex::volume;
use crate::ground::mesh::TET_FACES;
use crate::ground::mesh::stream::{BoundaryBlock, MeshStream, NO_TET, TetBlock};
use crate::parallel::check::{Checksum, PartReport, check, check_part, checksum_of_all};
use crate::parallel::distribution::distribute;
use crate::{Point, Vector};
use csg::PatchId;
use std::collections::{BTreeMap, BTreeSet};

fn refined(fixture: &Fixture, n: u32) -> RefinedMesh {
    refine(whole(&fixture.mesh), &fixture.projector, n, &Settings::default()).expect("a refinable mesh")
}

fn all_tets(mesh: &dyn MeshStream) -> Vec<[u32; 4]> {
    let (mut tets, mut block) = (Vec::new(), TetBlock::default());
    for index in 0..mesh.tet_blocks() {
        mesh.tet_block(index, &mut block);
        assert_eq!(block.first_local, tets.len() as u64);
        tets.extend_from_slice(&block.tets);
    }
    tets
}

fn corners_of(mesh: &dyn MeshStream, tet: [u32; 4]) -> [Point; 4] {
    tet.map(|v| Point::from(mesh.points()[v as usize]))
}

fn total_volume(mesh: &dyn MeshStream) -> f64 {
    let volumes = all_tets(mesh).into_iter().map(|tet| {
        let [p, q, r, s] = corners_of(mesh, tet);
        assert_eq!(orient3d(&p, &q, &r, &s), Sign::Positive, "{tet:?}");
        volume(&p, &q, &r, &s)
    });
    volumes.sum()
}

/// Checks that every face has a tet on both sides or is a boundary triangle, and that the parents
/// of boundary triangles are right.
fn check_conformity(mesh: &dyn MeshStream) {
    let tets = all_tets(mesh);
    let mut sides: BTreeMap<[u32; 3], Vec<(u64, [u32; 3])>> = BTreeMap::new();
    for (index, tet) in tets.iter().enumerate() {
        for face in TET_FACES {
            let face = face.map(|k| tet[k]);
            let mut key = face;
            key.sort_unstable();
            sides.entry(key).or_default().push((index as u64, face));
        }
    }
    let is_rotation = |[p, q, r]: [u32; 3], of: [u32; 3]| [[p, q, r], [q, r, p], [r, p, q]].contains(&of);
    let mut block = BoundaryBlock::default();
    let mut boundary = BTreeMap::new();
    for index in 0..mesh.boundary_blocks() {
        mesh.boundary_block(index, &mut block);
        for (triangle, parents) in block.triangles.iter().zip(&block.parents) {
            let mut key = *triangle;
            key.sort_unstable();
            let beside = &sides[&key];
            assert_eq!(beside.len(), parents.iter().filter(|p| **p != NO_TET).count());
            for (tet, face) in beside {
                let behind = is_rotation(*face, *triangle);
                assert_eq!(
                    parents[usize::from(!behind)],
                    *tet,
                    "triangle {triangle:?}, {parents:?}, {beside:?}"
                );
            }
            assert!(boundary.insert(key, block.patch).is_none(), "{triangle:?} twice");
        }
    }
    for (key, beside) in &sides {
        match beside[..] {
            [_] => assert!(boundary.contains_key(key), "face {key:?} has one tet"),
            [(_, [p, q, r]), (_, other)] => assert!(is_rotation([p, r, q], other), "{beside:?}"),
            _ => panic!("face {key:?} has {} tets", beside.len()),
        }
    }
    assert_eq!(mesh.counts().boundary, boundary.len() as u64);
    let edges: std::collections::BTreeSet<_> = tets
        .iter()
        .flat_map(|t| crate::ground::mesh::TET_EDGES.map(|[i, j]| [t[i].min(t[j]), t[i].max(t[j])]))
        .collect();
    let euler = mesh.counts().vertices as i64 - edges.len() as i64 + sides.len() as i64 - tets.len() as i64;
    assert_eq!(euler, 1, "a ball, topologically");
}

fn check_counts(fixture: &Fixture, mesh: &RefinedMesh) {
    let n = u64::from(mesh.pieces());
    let counts = mesh.counts();
    assert_eq!(counts, mesh.totals(), "one part is the whole");
    assert_eq!(counts.tets, fixture.mesh.tets.len() as u64 * n.pow(3));
    assert_eq!(counts.boundary, fixture.mesh.triangles.len() as u64 * n.pow(2));
    let mut next = 0;
    for index in 0..mesh.vertex_blocks() {
        let block = mesh.vertex_block(index);
        assert_eq!(block.local.start, next);
        for (local, id) in block.local.clone().zip(block.first_id..) {
            assert_eq!(mesh.vertex_id(local), id);
            assert_eq!(crate::ground::mesh::stream::vertex_block_of(mesh, local), index);
        }
        next = block.local.end;
    }
    assert_eq!(u64::from(next), counts.vertices);
}

#[test]
fn a_refined_cube_conforms_and_fills_the_cube() {
    for n in [1, 2, 3, 5] {
        let fixture = cube(4, true);
        let mesh = refined(&fixture, n);
        check_counts(&fixture, &mesh);
        check_conformity(&mesh);
        assert!((total_volume(&mesh) - 1.0).abs() < 1e-12);
    }
}

#[test]
fn refined_balls_and_cylinders_conform() {
    for n in [1, 2, 3, 5, 6, 8] {
        for fixture in [ball(1.0), cylinder(2)] {
            let mesh = refined(&fixture, n);
            check_counts(&fixture, &mesh);
            check_conformity(&mesh);
        }
    }
}

#[test]
fn the_volume_of_a_ball_converges_with_the_square_of_the_mesh_size() {
    let radius = 1.5_f64;
    let exact = 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3);
    for series in [[4, 8, 16], [3, 6, 12], [5, 10, 20]] {
        let errors = series.map(|n| exact - total_volume(&refined(&ball(radius), n)));
        for pair in errors.windows(2) {
            let ratio = pair[0] / pair[1];
            assert!((3.8..4.2).contains(&ratio), "{errors:?}");
        }
    }
}

#[test]
fn boundary_vertices_are_on_their_patches() {
    for (fixture, n) in [(ball(1.0), 8), (cylinder(2), 8), (ball(3.0), 7), (cylinder(1), 12)] {
        let mesh = refined(&fixture, n);
        let mut block = BoundaryBlock::default();
        for index in 0..mesh.boundary_blocks() {
            mesh.boundary_block(index, &mut block);
            let patch: PatchId = block.patch.expect("a patch");
            for vertex in block.triangles.iter().flatten() {
                let point = Point::from(mesh.points()[*vertex as usize]);
                let distance = fixture.projector.patch_distance(patch, &point);
                assert!(
                    distance <= fixture.projector.tolerance(),
                    "{point} is {distance} off patch {patch:?}"
                );
            }
        }
    }
}

#[test]
fn refining_twice_gives_the_points_of_refining_once_on_edges_and_faces_and_inside() {
    // The points of n = 2 are bitwise among those of n = 4, and so are those of refining the n = 2
    // mesh by 2 (as a mesh of its own; interior points only where diagonals do not matter).
    let key = |p: &[f64; 3]| p.map(f64::to_bits);
    for fixture in [ball(1.0), cylinder(1), cube(1, false)] {
        let two = refined(&fixture, 2);
        let four = refined(&fixture, 4);
        let mut all: Vec<_> = four.points().iter().map(key).collect();
        all.sort_unstable();
        assert!(two.points().iter().all(|p| all.binary_search(&key(p)).is_ok()));
        let again = refined(&Fixture { mesh: as_mesh(&two), projector: fixture.projector.clone() }, 2);
        let mut block = BoundaryBlock::default();
        for index in 0..again.boundary_blocks() {
            again.boundary_block(index, &mut block);
            for vertex in block.triangles.iter().flatten() {
                assert!(
                    all.binary_search(&key(&again.points()[*vertex as usize])).is_ok(),
                    "vertex {vertex}"
                );
            }
        }
    }
}

#[test]
fn points_inside_a_flat_tet_are_its_barycentric_lattice() {
    for n in [5, 6, 8] {
        flat_lattice(n);
    }
}

fn flat_lattice(n: u32) {
    let mut fixture = cube(1, false);
    for point in &mut fixture.mesh.points {
        *point = Point::from(point.coords + Vector::new(0.3 * point.y, 0.1 * point.z, -0.2 * point.x));
    }
    let mesh = refined(&fixture, n);
    let lattice = lattice::Lattice::new(n);
    for tet in 0..fixture.mesh.tets.len() {
        let corners = fixture.mesh.tets[tet].map(|v| fixture.mesh.points[v.index()].coords);
        let mut ids = Vec::new();
        let numbering = numbering::Numbering::new(mesh.coarse(), n, Order::First).expect("small");
        numbering.lattice_ids(mesh.coarse(), crate::ground::mesh::TetId::new(tet), &mut ids);
        for d in 0..=n {
            for c in 0..=n - d {
                for b in 0..=n - d - c {
                    let weights = [n - b - c - d, b, c, d].map(|w| f64::from(w) / f64::from(n));
                    let exact: Vector = corners.iter().zip(weights).map(|(p, w)| p * w).sum();
                    let point = Point::from(mesh.points()[ids[lattice.index([b, c, d]) as usize] as usize]);
                    assert!((point.coords - exact).norm() < 1e-14, "{point} at {weights:?}");
                }
            }
        }
    }
}

#[test]
fn stored_tets_are_those_of_the_stream() {
    let mesh = refined(&cylinder(1), 4);
    let streamed = all_tets(&mesh);
    let stored = mesh.materialize().expect("small");
    assert_eq!(stored.tets(), &streamed[..]);
    assert_eq!(all_tets(&stored), streamed);
}

#[test]
fn pieces_beyond_the_finest_lattice_are_refused() {
    for n in [0, 1025] {
        let fixture = cube(1, false);
        let error = refine(whole(&fixture.mesh), &fixture.projector, n, &Settings::default());
        assert_eq!(error.err(), Some(RefineError::Pieces { n, most: 1024 }));
    }
}

#[test]
fn the_least_pieces_that_make_enough_tets_are_chosen() {
    assert_eq!(pieces_for(80_000, 1_000_000_000), 24);
    assert_eq!(pieces_for(6, 6), 1);
    assert_eq!(pieces_for(6, 7), 2);
    assert_eq!(pieces_for(1, u64::MAX), 1025);
}

/// The checksum and the report of a mesh that is refined in parts.
fn in_parts(fixture: &Fixture, n: u32, ranks: u32) -> (Checksum, PartReport) {
    with_displacements(fixture, n, ranks, &EdgeDisplacements::default())
}

fn with_displacements(
    fixture: &Fixture,
    n: u32,
    ranks: u32,
    displacements: &EdgeDisplacements,
) -> (Checksum, PartReport) {
    // Tets dealt out in threes: ragged parts that touch in vertices, edges and faces.
    let rank_of: Vec<Rank> = (0..fixture.mesh.tets.len() as u32).map(|t| t / 3 % ranks).collect();
    let settings = crate::parallel::check::Settings::default();
    let results = thread::run(ranks, |comm| {
        let mesh = (comm.rank() == 0).then(|| (fixture.mesh.clone(), rank_of.clone()));
        let part = distribute(comm, mesh).expect("a classified mesh");
        part.check(comm).expect("a distributed mesh");
        let bent = Settings { displacements: displacements.clone(), ..Settings::default() };
        let part = refine(part, &fixture.projector, n, &bent).expect("refinable");
        let report = check(comm, &part, Some(&fixture.projector), &settings).expect("all ranks");
        (checksum_of_all(comm, &part).expect("all ranks"), report)
    });
    let results = results.expect("no rank fails");
    assert!(results.windows(2).all(|pair| pair[0] == pair[1]), "all ranks get the same");
    results.into_iter().next().expect("a rank")
}

#[test]
fn every_number_of_ranks_makes_the_same_mesh() {
    for fixture in [ball(1.0), cylinder(2), cube(4, true)] {
        for n in [4, 7] {
            let (sum, report) = in_parts(&fixture, n, 1);
            assert_eq!(sum.open, 0, "each face is matched");
            for ranks in [2, 3, 4, 7, 16] {
                let (others, parts) = in_parts(&fixture, n, ranks);
                assert_eq!(others, sum, "{ranks} ranks");
                assert_eq!(parts.faults, 0, "{:?}", parts.described);
                let counts = |r: &PartReport| [r.vertices, r.tets, r.boundary];
                assert_eq!(counts(&parts), counts(&report));
                assert!((parts.volume / report.volume - 1.0).abs() < 1e-14);
                let shape = |r: &PartReport| {
                    let s = r.shape.clone().expect("tets");
                    (s.worst_ratio, s.smallest_angle, s.largest_angle, s.smallest_angles, s.ratios)
                };
                assert_eq!(shape(&parts), shape(&report));
            }
        }
    }
}

#[test]
fn every_number_of_threads_makes_the_same_mesh_and_the_same_report() {
    let fixture = cylinder(3);
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| in_parts(&fixture, 8, 2))
    };
    assert_eq!(with(1), with(2));
}

#[test]
fn coarse_tets_whose_children_would_invert_are_named() {
    // A tet outside the sphere, so flat over its face that the projected face passes through its
    // apex.
    let Fixture { mesh, projector } = ball(1.0);
    let base = mesh.tets[7].map(|v| mesh.points[v.index()].coords);
    let tip = (base[1] + base[2] + base[3]) / 3.0 * 1.05;
    let corners = [tip, base[1], base[3], base[2]].map(Into::into);
    let Projector::Csg(surfaces) = &projector else { panic!("{projector:?}") };
    let low = tet(corners, Some(surfaces.patch_surface(PatchId(0)).clone()));
    let error = refine(whole(&low.mesh), &low.projector, 8, &Settings::default()).expect_err("inverted");
    let RefineError::Inverted { children, coarse, corners: at, faults } = &error else { panic!("{error}") };
    assert!((1..512).contains(children));
    assert_eq!((coarse, at), (&vec![0], &vec![corners.map(crate::Point::from)]));
    assert_eq!(faults.len(), 8.min(*children as usize));
    assert!(matches!(faults[0], Fault::NotPositive { tet: 0..512, .. }), "{error}");
}

#[test]
fn more_vertices_than_local_ids_are_refused_before_memory_is_asked_for() {
    let fixture = cube(2, false);
    let error = refine(whole(&fixture.mesh), &fixture.projector, 1024, &Settings::default());
    assert!(matches!(error, Err(RefineError::TooManyVertices { rank: 0, needed }) if needed > 1 << 33));
}

#[test]
fn bent_edges_make_room_beside_a_hollow_sphere() {
    let fixture = shell(1.0, 1.95);
    let coarse = whole(&fixture.mesh);
    let failed = refine(coarse.clone(), &fixture.projector, 8, &Settings::default());
    let Err(RefineError::Inverted { coarse: bad, .. }) = failed else {
        panic!("a shell that needs no mending")
    };
    let settings = mend::Settings { pieces: 8, ..mend::Settings::default() };
    let mended = mend(&coarse, &fixture.projector, &settings).expect("projects");
    assert_eq!((mended.before, mended.left), (bad, vec![]));
    let (sum, report) = with_displacements(&fixture, 8, 1, &mended.displacements);
    assert_eq!((report.faults, sum.open), (0, 0), "{:?}", report.described);
    assert_eq!(with_displacements(&fixture, 8, 3, &mended.displacements).0, sum);
}

#[test]
fn bent_edges_make_angles_larger_that_are_too_small() {
    let fixture = shell(1.0, 2.6);
    let coarse = whole(&fixture.mesh);
    let tried = |displacements: &EdgeDisplacements, dihedral: f64| {
        let least = Least { dihedral, ..Least::VALID };
        let settings = Settings { displacements: displacements.clone(), ..Settings::default() };
        trial(&coarse, &fixture.projector, 8, &settings, least, 90.0).expect("projects")
    };
    let before = tried(&EdgeDisplacements::default(), 90.0);
    assert!(before.inverted.is_empty());
    let few = tried(&EdgeDisplacements::default(), before.smallest_dihedral + 0.5);
    let both: BTreeSet<_> = few.poor.iter().chain(&few.improvable).copied().collect();
    assert!(!few.poor.is_empty() && !few.improvable.is_empty());
    assert_eq!(both.len(), few.poor.len() + few.improvable.len(), "a tet is one or the other");
    assert_eq!(both.into_iter().collect::<Vec<_>>(), before.poor, "all tets have a child below 90°");
    let wanted = before.smallest_dihedral + 1.0;
    let least = Least { dihedral: wanted, ..Least::VALID };
    let settings = mend::Settings { pieces: 8, least, margin: 0.01, enough: 0.03, ..Default::default() };
    let mended = mend(&coarse, &fixture.projector, &settings).expect("projects");
    assert!(!mended.before.is_empty());
    assert!(mended.left.is_empty(), "{:?}", mended.left);
    let after = tried(&mended.displacements, wanted);
    assert!(after.inverted.is_empty() && after.poor.is_empty(), "{:?}", after.poor);
}

#[test]
fn a_sound_mesh_needs_no_mending() {
    let fixture = cylinder(2);
    let mended = mend(&whole(&fixture.mesh), &fixture.projector, &mend::Settings::default());
    assert_eq!(mended, Ok(Mended::default()));
}

proptest::proptest! {
    #[test]
    fn children_of_a_flat_tet_are_of_three_classes_however_fine(
        corners in proptest::prelude::prop::array::uniform4(proptest::prelude::prop::array::uniform3(-1.0..1.0)),
        n in 2_u32..9,
    ) {
        let [p, q, r, s] = corners.map(Point::from);
        proptest::prop_assume!(volume(&p, &q, &r, &s) > 0.02);
        let mesh = refined(&tet(corners, None), n);
        let mut classes: Vec<[f64; 6]> = Vec::new();
        for tet in all_tets(&mesh) {
            let points = corners_of(&mesh, tet);
            let edges = crate::ground::mesh::TET_EDGES.map(|[i, j]| (points[i] - points[j]).norm_squared() * f64::from(n * n));
            let mut edges = edges;
            edges.sort_by(f64::total_cmp);
            let same = |class: &[f64; 6]| class.iter().zip(edges).all(|(a, b)| (a - b).abs() < 1e-9);
            if !classes.iter().any(same) {
                classes.push(edges);
            }
        }
        proptest::prop_assert!(classes.len() <= 3, "{classes:?}");
    }

    #[test]
    fn the_best_diagonal_does_not_depend_on_the_names_of_the_corners(
        corners in proptest::prelude::prop::array::uniform4(proptest::prelude::prop::array::uniform3(-1.0..1.0)),
    ) {
        let [a, b, c, d] = corners.map(Point::from);
        proptest::prop_assume!(volume(&a, &b, &c, &d) > 0.02);
        let [p, q, r, s] = corners;
        let worst = |corners: [[f64; 3]; 4]| {
            let mesh = refined(&tet(corners, None), 2);
            let report = check_part(&mesh, None, &crate::parallel::check::Settings::default());
            report.shape.expect("tets").worst_ratio.value
        };
        let one = worst([p, q, r, s]);
        for renamed in [[q, r, p, s], [q, p, s, r], [s, q, p, r]] {
            proptest::prop_assert!((worst(renamed) - one).abs() < 1e-12);
        }
    }
}
