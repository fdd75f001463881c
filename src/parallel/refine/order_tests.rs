//! Refinement to elements of second order.

use super::fixtures::{Fixture, ball, cube, cylinder, shell, whole};
use super::*;
use crate::Point;
use crate::ground::comm::thread;
use crate::ground::mesh::stream::{BoundaryBlock, LocalBlock, MeshStream, TetBlock};
use crate::ground::mesh::{Arrays, TET_EDGES, TRIANGLE_EDGES};
use crate::parallel::check::{Checksum, check, check_part, checksum_of_all};
use crate::parallel::distribution::distribute;
use std::collections::BTreeMap;

fn second_order(fixture: &Fixture, n: u32) -> RefinedMesh {
    let settings = Settings { order: Order::Second, ..Settings::default() };
    refine(whole(&fixture.mesh), &fixture.projector, n, &settings).expect("valid in second order")
}

#[test]
fn corners_are_the_mesh_of_first_order_and_nodes_the_vertices_of_the_next_level() {
    for n in [1, 2, 3, 4, 6] {
        for fixture in [cube(2, true), ball(1.0), cylinder(2)] {
            let level =
                |n| refine(whole(&fixture.mesh), &fixture.projector, n, &Settings::default()).unwrap();
            let (made, first, finer) = (second_order(&fixture, n), level(n), level(2 * n));
            let (made, first) = (Arrays::of(&made), Arrays::of(&first));
            let finer = Arrays::of(&finer);
            assert_eq!((&made.points, &made.vertex_ids), (&finer.points, &finer.vertex_ids));
            assert_eq!(made.tet_ids, first.tet_ids);
            for (tet, of_first) in made.tets.iter().zip(&first.tets) {
                let at = |points: &[[f64; 3]], tet: &[u32; 4]| tet.map(|v| points[v as usize]);
                assert_eq!(at(&made.points, tet), at(&first.points, of_first), "n = {n}");
            }
            assert_eq!(made.triangle_patches, first.triangle_patches);
        }
    }
}

#[test]
fn each_edge_has_one_node_in_all_tets_and_triangles() {
    for n in [1, 2, 3, 4] {
        for (fixture, is_flat) in [(cube(2, true), true), (ball(1.0), false), (cylinder(2), false)] {
            let mesh = second_order(&fixture, n);
            let arrays = Arrays::of(&mesh);
            let mut node_of: BTreeMap<[u32; 2], u32> = BTreeMap::new();
            let mut see = |p: u32, q: u32, node: u32| {
                assert_eq!(*node_of.entry([p.min(q), p.max(q)]).or_insert(node), node, "edge {p} {q}");
            };
            for (tet, nodes) in arrays.tets.iter().zip(&arrays.tet_edge_nodes) {
                TET_EDGES.iter().zip(nodes).for_each(|([i, j], node)| see(tet[*i], tet[*j], *node));
            }
            for (triangle, nodes) in arrays.triangles.iter().zip(&arrays.triangle_edge_nodes) {
                let edges = TRIANGLE_EDGES.iter().zip(nodes);
                edges.for_each(|([i, j], node)| see(triangle[*i], triangle[*j], *node));
            }
            let corners: std::collections::BTreeSet<u32> = arrays.tets.iter().flatten().copied().collect();
            assert_eq!(corners.len() + node_of.len(), arrays.points.len(), "every vertex is used");
            if is_flat {
                for ([p, q], node) in node_of {
                    let [p, q, node] = [p, q, node].map(|v| Point::from(arrays.points[v as usize]));
                    assert!((nalgebra::center(&p, &q) - node).norm() < 1e-15);
                }
            }
        }
    }
}

#[test]
fn the_volume_of_a_ball_converges_with_the_fourth_power() {
    let fixture = ball(1.0);
    let error = |n| {
        let mesh = second_order(&fixture, n);
        let report = check_part(&mesh, Some(&fixture.projector), &Default::default());
        assert_eq!((report.faults, report.described.len()), (0, 0));
        let scaled = report.scaled_jacobian.expect("second order is measured").value;
        assert!(scaled > 0.2 && scaled < 1.0, "n = {n}: {scaled}");
        4.0 / 3.0 * std::f64::consts::PI - report.volume
    };
    let errors = [2, 4, 8].map(error);
    for pair in errors.windows(2) {
        assert!(pair[0] / pair[1] > 14.0, "{errors:?}");
    }
}

#[test]
fn the_mesh_is_the_same_on_every_number_of_ranks_and_if_inner_nodes_are_not_stored() {
    let fixture = cylinder(2);
    let of = |ranks: u32, keep: Keep| -> Checksum {
        let sums = thread::run(ranks, |comm| {
            let parts = (0..fixture.mesh.tets.len() as u32).map(|tet| tet * 7 % 5 % ranks).collect();
            let whole = (comm.rank() == 0).then(|| (fixture.mesh.clone(), parts));
            let settings = Settings { order: Order::Second, keep, ..Settings::default() };
            let part = refine(distribute(comm, whole).unwrap(), &fixture.projector, 4, &settings).unwrap();
            let report = check(comm, &part, Some(&fixture.projector), &Default::default()).unwrap();
            assert_eq!(report.faults, 0, "{:?}", report.described);
            checksum_of_all(comm, &part).unwrap()
        });
        let sums = sums.unwrap();
        assert_eq!(sums[0].open, 0, "all faces are matched, with their nodes");
        sums[0]
    };
    let one = of(1, Keep::All);
    for ranks in [1, 2, 5] {
        assert_eq!(of(ranks, Keep::Boundary), one);
        assert_eq!(of(ranks, Keep::All), one);
    }
}

#[test]
fn blocks_by_positions_are_the_blocks_by_local_index() {
    let mesh = second_order(&ball(1.0), 3);
    let (mut block, mut local, mut points) = (TetBlock::default(), LocalBlock::default(), Vec::new());
    for index in 0..mesh.tet_blocks() {
        mesh.tet_block(index, &mut block);
        mesh.local_block(index, &mut local);
        mesh.block_points(&local, &mut points);
        let at = |k: u32| (local.vertices[k as usize], points[k as usize]);
        for (nodes, of_local) in block.edge_nodes.iter().zip(&local.tets.edge_nodes) {
            for (node, k) in nodes.iter().zip(of_local) {
                assert_eq!(at(*k), (*node, mesh.points()[*node as usize]));
            }
        }
    }
    let mut boundary = BoundaryBlock::default();
    mesh.boundary_block(0, &mut boundary);
    assert_eq!(boundary.edge_nodes.len(), 9);
}

/// A thin shell, whose tets are too curved for second order.
#[test]
fn edges_become_straight_where_tets_would_not_be_valid_on_all_ranks_alike() {
    let fixture = shell(1.0, 1.05);
    let settings = Settings { order: Order::Second, ..Settings::default() };
    let error = refine(whole(&fixture.mesh), &fixture.projector, 1, &settings);
    assert!(matches!(error, Err(RefineError::Inverted { .. })), "{error:?}");
    let of = |ranks: u32| {
        let made = thread::run(ranks, |comm| {
            let parts = (0..fixture.mesh.tets.len() as u32).map(|tet| tet % ranks).collect();
            let whole = (comm.rank() == 0).then(|| (fixture.mesh.clone(), parts));
            let mesh = distribute(comm, whole).unwrap();
            let work = Work::unwatched();
            let (part, straight) =
                refine_straightening(comm, &mesh, &fixture.projector, 1, &settings, work).unwrap();
            let part = part.expect("valid with straight edges");
            let how = crate::parallel::check::Settings { off_surface: &straight, ..Default::default() };
            let report = check(comm, &part, Some(&fixture.projector), &how).unwrap();
            assert_eq!(report.faults, 0, "{:?}", report.described);
            let strict = check(comm, &part, Some(&fixture.projector), &Default::default()).unwrap();
            assert!(strict.faults > 0, "straight edges are off the surface");
            (straight, checksum_of_all(comm, &part).unwrap())
        });
        let made = made.unwrap();
        assert!(made.iter().all(|one| *one == made[0]));
        made[0].clone()
    };
    let one = of(1);
    assert!(!one.0.is_empty() && one.1.open == 0);
    assert_eq!(of(3), one);
}
