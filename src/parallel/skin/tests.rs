//! Skins of a cube, a ball and a cylinder in ragged parts, meshed inside.

use super::*;
use crate::Point;
use crate::ground::comm::thread;
use crate::ground::mesh::{Class, GlobalId, Rank, topology};
use crate::ground::size::{SizeField, UniformSize};
use crate::mesher::improve::Settings;
use crate::parallel::check::{Checksum, PartReport, check, checksum_of_all};
use crate::parallel::distribution::{DistMesh, distribute, number_shared};
use crate::parallel::refine::fixtures::{Fixture, ball, cube, cylinder};
use crate::parallel::refine::{self, refine};
use std::collections::BTreeMap;

/// Tets dealt out in threes: ragged parts that touch in vertices, edges and faces.
fn in_threes(fixture: &Fixture, ranks: u32) -> Vec<Rank> {
    (0..fixture.mesh.tets.len() as u32).map(|t| t / 3 % ranks).collect()
}

pub(super) fn parts(fixture: &Fixture, rank_of: &[Rank]) -> Vec<DistMesh> {
    let ranks = rank_of.iter().max().map_or(1, |last| last + 1);
    let given = |rank| (rank == 0).then(|| (fixture.mesh.clone(), rank_of.to_vec()));
    let parts = thread::run(ranks, |comm| distribute(comm, given(comm.rank())).expect("a classified mesh"));
    parts.expect("no rank fails")
}

/// Meshes the parts inside their skins; returns the check report, the checksum and the number of
/// rejected skins.
fn filled(
    fixture: &Fixture,
    n: u32,
    ranks: u32,
    size: &(dyn SizeField + Sync),
) -> (PartReport, Checksum, usize) {
    let rank_of = in_threes(fixture, ranks);
    let results = thread::run(ranks, |comm| {
        let mesh = (comm.rank() == 0).then(|| (fixture.mesh.clone(), rank_of.clone()));
        let part = distribute(comm, mesh).expect("a classified mesh");
        let skin = skin(&part, &fixture.projector, n).expect("a skin");
        let filled = fill_or_refine(
            &part,
            &fixture.projector,
            &skin,
            size,
            Improvement { settings: &Settings::default(), smoothness: None },
        )
        .expect("tets");
        let refused = usize::from(filled.refused.is_some());
        let boundary = skin.numbering.totals().boundary;
        let bare = number(comm, skin.skin, filled, boundary).expect("all ranks");
        let whole = number_shared(comm, bare).expect("a mesh");
        whole.check(comm).expect("a distributed mesh");
        let mesh = refine(whole, &fixture.projector, 1, &refine::Settings::default()).expect("positive tets");
        let report =
            check(comm, &mesh, Some(&fixture.projector), &crate::parallel::check::Settings::default());
        (report.expect("all ranks"), checksum_of_all(comm, &mesh).expect("all ranks"), refused)
    });
    let results = results.expect("no rank fails");
    let refused = results.iter().map(|r| r.2).sum();
    let (report, checksum, _) = results.into_iter().next().expect("a rank");
    (report, checksum, refused)
}

#[test]
fn parts_meshed_in_their_skins_fit_and_fill_the_bodies() {
    for (fixture, h) in [(ball(1.0), 0.4), (cylinder(2), 0.3), (cube(4, true), 0.2)] {
        let refined = filled(&fixture, 3, 1, &UniformSize(f64::INFINITY)).0;
        for ranks in [1, 2, 5, 16] {
            let (report, checksum, refused) = filled(&fixture, 3, ranks, &UniformSize(h));
            assert_eq!((report.faults, refused), (0, 0), "{ranks} ranks: {:?}", report.described);
            assert_eq!(checksum.open, 0, "each face is matched");
            assert!((report.volume / refined.volume - 1.0).abs() < 1e-13, "{ranks} ranks");
            assert_eq!(report.boundary, refined.boundary);
        }
    }
}

#[test]
fn both_sides_of_an_interface_have_the_same_triangles() {
    let fixture = ball(1.0);
    let bits = |p: &Point| [p.x, p.y, p.z].map(f64::to_bits);
    let mut seen = BTreeMap::new();
    for part in parts(&fixture, &in_threes(&fixture, 3)) {
        let skin = skin(&part, &fixture.projector, 4).expect("a skin").skin;
        for triangle in &skin.triangles {
            let mut corners = triangle.vertices.map(|v| bits(&skin.points[v as usize]));
            corners.sort_unstable();
            *seen.entry(corners).or_insert(0) += usize::from(triangle.beside[1].is_none());
        }
    }
    let on_patch = 16 * fixture.mesh.triangles.len();
    let [once, twice] = [1, 2].map(|times| seen.values().filter(|&&count| count == times).count());
    assert_eq!(once, on_patch);
    assert_eq!(once + twice, seen.len());
    assert!(twice > 0);
}

#[test]
fn a_skin_that_is_refused_is_filled_by_the_lattice() {
    let fixture = ball(1.0);
    let (report, checksum, refused) = filled(&fixture, 4, 3, &UniformSize(f64::NAN));
    assert_eq!(refused, 3);
    assert_eq!((report.faults, checksum.open), (0, 0), "{:?}", report.described);
    assert_eq!(report.tets, 64 * fixture.mesh.tets.len() as u64);
}

#[test]
fn a_part_without_tets_has_no_skin() {
    let fixture = cube(1, false);
    let ranks = fixture.mesh.tets.len() as u32 / 3 + 2;
    let (report, checksum, refused) = filled(&fixture, 2, ranks, &UniformSize(0.5));
    assert_eq!((report.faults, checksum.open, refused), (0, 0, 0), "{:?}", report.described);
}

#[test]
fn vertices_inside_that_are_corners_are_kept() {
    let mut fixture = cube(2, false);
    let centre = (0..fixture.mesh.points.len())
        .find(|&v| matches!(fixture.mesh.classes[v], Class::Body(_)))
        .expect("a vertex inside");
    fixture.mesh.classes[centre] = Class::Corner(csg::CornerId(99));
    let part = &parts(&fixture, &in_threes(&fixture, 1))[0];
    let skin = skin(part, &fixture.projector, 2).expect("a skin").skin;
    assert_eq!(skin.points.len(), skin.on_triangles + 1);
    assert_eq!(skin.points[skin.on_triangles], fixture.mesh.points[centre]);
    let filled =
        fill(&skin, &UniformSize(0.2), Improvement { settings: &Settings::default(), smoothness: None })
            .expect("tets");
    assert!(filled.tets.iter().flatten().any(|&v| v as usize == skin.on_triangles));
}

#[test]
fn sizes_are_linear_between_the_vertices_and_fit_the_mesh_in_the_mean() {
    let fixture = cube(2, false);
    let part = &parts(&fixture, &in_threes(&fixture, 1))[0];
    let at = |p: &Point| 1.0 + p.x + 2.0 * p.y - 0.5 * p.z;
    let sizes = PartSizes::new(part.points.clone(), part.tets.clone(), part.points.iter().map(at).collect());
    for p in [Point::new(0.3, 0.2, 0.9), Point::new(0.51, 0.77, 0.13), part.points[3]] {
        assert!((sizes.size_at(&p) - at(&p)).abs() < 1e-12, "{p}");
    }
    let [flat, field] =
        [None, Some(&UniformSize(7.0) as &dyn SizeField)].map(|field| at_vertices(&fixture.mesh, field, 4));
    assert!(field.windows(2).all(|pair| pair[0] == pair[1]));
    let mean = |sizes: &[f64]| sizes.iter().map(|s| s.ln()).sum::<f64>() / sizes.len() as f64;
    assert!((mean(&flat) - mean(&field)).abs() < 1e-12);
}

/// What a point gets does not depend on the points before it.
#[test]
fn sizes_do_not_depend_on_the_order_of_points() {
    let fixture = ball(1.0);
    let part = &parts(&fixture, &in_threes(&fixture, 1))[0];
    let new = || {
        let sizes = (0..part.points.len()).map(|v| 1.0 + 0.1 * v as f64).collect();
        PartSizes::new(part.points.clone(), part.tets.clone(), sizes)
    };
    let (often, corners) = (new(), &part.points);
    for (i, p) in corners.iter().enumerate() {
        for q in &corners[..i] {
            let point = nalgebra::center(p, q);
            assert_eq!(often.size_at(&point).to_bits(), new().size_at(&point).to_bits(), "{point}");
        }
    }
}

#[test]
fn coarse_tets_count_for_the_triangles_of_their_skins() {
    let mesh = cube(3, false).mesh;
    let (sizes, tets) = (vec![0.1; mesh.points.len()], mesh.tets.len());
    let faces = topology::matched_faces(mesh.points.len(), &mesh.tets).expect("a mesh");
    let by = |part: &[Rank], pieces| expected_tets_by_part(&mesh, &sizes, (&faces, pieces), false, part);
    let sum = |counts: &[f64]| counts.iter().sum::<f64>();
    let inside = expected_tets(&mesh, &sizes);
    let outer = |tet: usize| {
        faces.listed.tet_faces[tet].iter().filter(|face| faces.tets[face.index()][1] == u32::MAX).count()
    };
    let one = by(&vec![0; tets], 8);
    assert!((0..tets).any(|tet| outer(tet) == 0) && (0..tets).any(|tet| outer(tet) > 1));
    for tet in 0..tets {
        assert_eq!(one[tet] > inside[tet], outer(tet) > 0, "8 pieces of 1/3 are finer than 0.1");
    }
    let alone: Vec<Rank> = (0..tets as Rank).collect();
    assert!(sum(&by(&alone, 8)) > 2.0 * sum(&one), "each face is on two skins");
    assert!(sum(&by(&alone, 1)) < sum(&inside) && by(&alone, 1).iter().all(|count| *count > 0.0));
    let remeshed = expected_tets_by_part(&mesh, &sizes, (&faces, 8), true, &vec![0; tets]);
    assert_eq!(remeshed, inside, "the boundary follows the sizes");
}

#[test]
fn each_rank_gets_the_sizes_of_its_vertices() {
    let fixture = cube(2, false);
    let rank_of = in_threes(&fixture, 3);
    let all: Vec<f64> = (0..fixture.mesh.points.len()).map(|v| v as f64).collect();
    let fits = thread::run(3, |comm| {
        let first = comm.rank() == 0;
        let part = distribute(comm, first.then(|| (fixture.mesh.clone(), rank_of.clone()))).expect("a mesh");
        let sizes = scatter(comm, &part, first.then_some(&all)).expect("all ranks");
        sizes.iter().zip(&part.vertex_ids).all(|(size, id)| *size as GlobalId == *id)
    });
    assert_eq!(fits.expect("no rank fails"), [true; 3]);
}
