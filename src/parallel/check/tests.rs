//! Streams with one fault each, and the resulting reports.

use super::*;
use crate::Point;
use crate::ground::kernel::quality::mean_ratio;
use crate::ground::mesh::Rank;
use crate::ground::mesh::stream::{BoundaryBlock, Counts, MeshStream, TetBlock, VertexBlock};
use crate::parallel::refine::fixtures::{Fixture, ball, cube, cylinder, whole};
use crate::parallel::refine::{RefinedMesh, refine};

fn refined(fixture: &Fixture, n: u32) -> RefinedMesh {
    refine(whole(&fixture.mesh), &fixture.projector, n, &crate::parallel::refine::Settings::default())
        .expect("refinable")
}

/// A stream whose points, tets and triangles pass through functions.
struct Changed<'a> {
    of: &'a RefinedMesh,
    points: Vec<[f64; 3]>,
    tets: fn(&mut TetBlock),
    boundary: fn(&mut BoundaryBlock),
}

impl<'a> Changed<'a> {
    fn new(of: &'a RefinedMesh) -> Self {
        Self { of, points: of.points().to_vec(), tets: |_| (), boundary: |_| () }
    }
}

impl MeshStream for Changed<'_> {
    fn rank(&self) -> Rank {
        self.of.rank()
    }
    fn ranks(&self) -> u32 {
        self.of.ranks()
    }
    fn counts(&self) -> Counts {
        self.of.counts()
    }
    fn totals(&self) -> Counts {
        self.of.totals()
    }
    fn points(&self) -> &[[f64; 3]] {
        &self.points
    }
    fn vertex_blocks(&self) -> usize {
        self.of.vertex_blocks()
    }
    fn vertex_block(&self, index: usize) -> VertexBlock<'_> {
        self.of.vertex_block(index)
    }
    fn tet_blocks(&self) -> usize {
        self.of.tet_blocks()
    }
    fn tet_block(&self, index: usize, block: &mut TetBlock) {
        self.of.tet_block(index, block);
        if index == 3 {
            (self.tets)(block);
        }
    }
    fn boundary_blocks(&self) -> usize {
        self.of.boundary_blocks()
    }
    fn boundary_block(&self, index: usize, block: &mut BoundaryBlock) {
        self.of.boundary_block(index, block);
        if index == 2 {
            (self.boundary)(block);
        }
    }
}

fn report(stream: &dyn MeshStream, fixture: &Fixture) -> PartReport {
    check_part(stream, Some(&fixture.projector), &Settings::default())
}

#[test]
fn a_good_mesh_has_no_fault_and_the_shapes_that_its_tets_have() {
    for (fixture, volume) in [(cube(4, true), 1.0), (ball(1.0), 4.1), (cylinder(2), 6.2)] {
        let mesh = refined(&fixture, 8);
        let report = report(&mesh, &fixture);
        assert_eq!((report.faults, &report.described), (0, &vec![]));
        let totals = mesh.totals();
        assert_eq!(
            [report.vertices, report.tets, report.boundary],
            [totals.vertices, totals.tets, totals.boundary]
        );
        assert!((report.volume / volume - 1.0).abs() < 0.02, "{}", report.volume);
        assert!((report.body_volumes.iter().sum::<f64>() - report.volume).abs() < 1e-13);
        let shape = report.shape.as_ref().expect("tets");
        let mut block = TetBlock::default();
        let (mut worst, mut sum) = (1.0_f64, 0.0);
        for index in 0..mesh.tet_blocks() {
            mesh.tet_block(index, &mut block);
            for tet in &block.tets {
                let [p, q, r, s] = tet.map(|v| Point::from(mesh.points()[v as usize]));
                worst = worst.min(mean_ratio(&p, &q, &r, &s));
                sum += mean_ratio(&p, &q, &r, &s);
            }
        }
        assert!((shape.worst_ratio.value - worst).abs() < 1e-13);
        assert!((shape.sum_of_ratios / sum - 1.0).abs() < 1e-11, "rounding of 200,000 terms");
        for bins in [&shape.ratios, &shape.smallest_angles, &shape.largest_angles] {
            assert_eq!(bins.iter().sum::<u64>(), report.tets);
        }
        let percentile = shape.smallest_angle_percentile(0.01);
        assert!(percentile >= shape.smallest_angle.value && percentile < 70.6, "{percentile}");
        assert!(report.furthest.is_some_and(|f| f.distance <= fixture.projector.tolerance()));
        assert_eq!(checksum(&mesh).open, 0);
    }
}

#[test]
fn an_inverted_tet_is_found_with_its_id_and_place() {
    let fixture = ball(1.0);
    let mesh = refined(&fixture, 4);
    let changed = Changed { tets: |block| block.tets[5].swap(0, 1), ..Changed::new(&mesh) };
    let found = report(&changed, &fixture);
    assert_eq!(found.faults, 1);
    let Fault::NotPositive { tet, place } = found.described[0] else { panic!("{:?}", found.described) };
    assert_eq!(tet, 3 * 64 + 5);
    assert!(Point::from(place).coords.norm() < 1.0);
    assert!(found.shape.is_some_and(|s| s.worst_ratio.tet == tet && s.worst_ratio.value < 0.0));
    assert_ne!(checksum(&changed).open, 0, "its faces are seen from the wrong side");
}

#[test]
fn a_tet_with_other_vertices_leaves_faces_open() {
    let fixture = cube(1, false);
    let mesh = refined(&fixture, 4);
    let good = checksum(&mesh);
    let changed = Changed { tets: |block| block.tets[0][1] = block.tets[1][2], ..Changed::new(&mesh) };
    assert_ne!(checksum(&changed).open, 0);
    assert_ne!(checksum(&changed).tets, good.tets);
    let missing = Changed { tets: |block| block.tets.truncate(63), ..Changed::new(&mesh) };
    assert_ne!(checksum(&missing).open, 0);
    assert!(report(&missing, &fixture).described.iter().any(|f| matches!(f, Fault::Gap { at: 255, .. })));
}

#[test]
fn vertices_that_do_not_exist_are_found() {
    let fixture = cube(1, false);
    let mesh = refined(&fixture, 2);
    let changed = Changed { tets: |block| block.tets[0][1] = 1 << 20, ..Changed::new(&mesh) };
    assert!(report(&changed, &fixture).described.contains(&Fault::NoSuchVertex { rank: 0, vertex: 1 << 20 }));
    let changed = Changed { boundary: |block| block.triangles[0][1] = 1 << 21, ..Changed::new(&mesh) };
    assert!(report(&changed, &fixture).described.contains(&Fault::NoSuchVertex { rank: 0, vertex: 1 << 21 }));
}

#[test]
fn boundary_triangles_must_be_faces_of_the_tets_they_name() {
    let fixture = cube(4, true);
    let mesh = refined(&fixture, 4);
    let changes: [fn(&mut BoundaryBlock); 4] = [
        |block| block.parents[3][0] += 1,
        |block| block.triangles[3].swap(0, 1),
        |block| block.parents[3][0] = crate::ground::mesh::stream::NO_TET,
        |block| block.parents.iter_mut().for_each(|p| p[0] = 1 << 40),
    ];
    for boundary in changes {
        let changed = Changed { boundary, ..Changed::new(&mesh) };
        let found = report(&changed, &fixture);
        assert_eq!(found.faults, 1, "{:?}", found.described);
        assert!(matches!(found.described[0], Fault::WrongParent { .. }));
    }
}

#[test]
fn a_vertex_off_its_patch_is_found_with_its_distance() {
    let fixture = ball(2.0);
    let mesh = refined(&fixture, 4);
    let mut changed = Changed::new(&mesh);
    // The first vertex inside the first edge that lies on the sphere.
    let edge =
        mesh.coarse().edge_classes.iter().position(|c| matches!(c, crate::ground::mesh::Class::Patch(_)));
    let vertex = mesh.coarse().points.len() + 3 * edge.expect("an edge on the sphere");
    changed.points[vertex] = changed.points[vertex].map(|x| x * (1.0 + 1e-9));
    let found = report(&changed, &fixture);
    let ids: Vec<_> = found.described.iter().filter(|f| matches!(f, Fault::OffSurface { .. })).collect();
    assert_eq!(ids.len(), 2, "once in each of the two coarse triangles: {ids:?}");
    let furthest = found.furthest.expect("boundary vertices");
    assert_eq!(furthest.vertex, vertex as u64);
    assert!((furthest.distance - 2e-9).abs() < 1e-12, "{furthest:?}");
}

#[test]
fn reports_survive_being_sent() {
    let fixture = ball(1.0);
    let mesh = refined(&fixture, 4);
    let report = report(&mesh, &fixture);
    let text = serde_json::to_string(&report).expect("plain data");
    let back: PartReport = serde_json::from_str(&text).expect("what was written");
    assert_eq!(back, report, "to the last bit");
}

#[test]
fn a_coordinate_that_is_no_number_is_a_fault_on_all_ranks_and_not_a_panic() {
    let fixture = ball(1.0);
    let mesh = refined(&fixture, 4);
    let mut changed = Changed::new(&mesh);
    changed.points[1] = [f64::NAN, 0.0, f64::INFINITY];
    let comm = crate::ground::comm::thread::alone();
    let report = check(&comm, &changed, Some(&fixture.projector), &Settings::default()).expect("one rank");
    assert!(report.described.iter().any(|f| matches!(f, Fault::NotPositive { .. })));
    assert!(report.volume.is_nan());
}
