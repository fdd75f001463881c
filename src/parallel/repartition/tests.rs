use super::*;
use crate::ground::comm::thread;
use crate::ground::mesh::fixtures::{lattice_box, lattice_cube};
use crate::ground::mesh::topology::{self, face_tets};
use crate::ground::mesh::{GlobalId, Mesh};
use crate::parallel::distribution::{BareMesh, distribute, from_serial};
use crate::parallel::migrate::{self, migrate, migrate_bare};
use crate::parallel::partition::{self, Settings};

const METHODS: &[Method] = if cfg!(feature = "metis") {
    &[BY_PLACE[0], BY_PLACE[1], Method::Smoothed(Geometric::Curve), Method::Clusters { per_part: 50 }]
} else {
    &[BY_PLACE[0], BY_PLACE[1], Method::Smoothed(Geometric::Curve)]
};

const BY_PLACE: [Method; 2] = [Method::Geometric(Geometric::Curve), Method::Geometric(Geometric::Bisection)];

/// Distributes by `part` and runs a function on all ranks. Returns the ranks that it assigns, by
/// tet id, and its other result on each rank.
fn on_parts<T: Send>(
    mesh: &Mesh,
    part: &[Rank],
    ranks: u32,
    work: impl Fn(&dyn Communicator, BareMesh) -> (Vec<(GlobalId, Rank)>, T) + Sync,
) -> (Vec<Rank>, Vec<T>) {
    let results = thread::run(ranks, |comm| {
        let given = (comm.rank() == 0).then(|| (mesh.clone(), part.to_vec()));
        work(comm, distribute(comm, given).unwrap().into())
    });
    let (parts, said): (Vec<_>, Vec<T>) = results.unwrap().into_iter().unzip();
    let mut all = parts.concat();
    all.sort_unstable();
    (all.into_iter().map(|(_, part)| part).collect(), said)
}

/// Distributes by `part`, repartitions, and returns the new part of each tet by global id, with the
/// metrics.
fn anew(mesh: &Mesh, part: &[Rank], ranks: u32, parts: u32, method: Method) -> (Vec<Rank>, Metrics) {
    let (part, metrics) = on_parts(mesh, part, ranks, |comm, mesh| {
        let neighbours = Neighbours::find(comm, &mesh).unwrap();
        let part = repartition(comm, &mesh, &neighbours, parts, method).unwrap();
        let metrics = measure(comm, &mesh, &neighbours, &part, parts).unwrap();
        (mesh.tet_ids.iter().copied().zip(part).collect(), metrics)
    });
    assert!(metrics.iter().all(|other| other.edge_cut == metrics[0].edge_cut));
    (part, metrics[0])
}

#[test]
fn parts_do_not_depend_on_who_held_the_tets_before() {
    let mesh = lattice_box([6, 4, 4], |_| 0);
    let tets = mesh.tets.len() as u32;
    for &method in METHODS {
        let (alone, whole) = anew(&mesh, &vec![0; tets as usize], 1, 5, method);
        for ranks in [2, 3, 8] {
            let scattered: Vec<Rank> = (0..tets).map(|tet| tet * 7 % ranks).collect();
            let (part, metrics) = anew(&mesh, &scattered, ranks, 5, method);
            assert_eq!(part, alone, "{method}, {ranks} ranks");
            assert_eq!(metrics.edge_cut, whole.edge_cut);
        }
        // All on the last of four ranks.
        assert_eq!(anew(&mesh, &vec![3; tets as usize], 4, 5, method).0, alone);
    }
}

#[test]
fn parts_by_place_are_balanced_to_one_tet() {
    let mesh = lattice_cube(5);
    for (method, parts) in BY_PLACE.into_iter().flat_map(|m| [1, 2, 7, 16, 749, 750].map(|parts| (m, parts)))
    {
        let (_, metrics) = anew(&mesh, &vec![0; 750], 3, parts, method);
        assert!(metrics.largest - metrics.smallest <= 1, "{method}: {metrics:?}");
        assert!(metrics.smallest >= 1);
    }
}

#[test]
fn weighted_parts_have_equal_weights_whatever_the_method() {
    let by = [Geometric::Curve, Geometric::Bisection];
    let mut weighted = by.map(Method::Geometric).to_vec();
    weighted.extend(by.map(Method::Smoothed));
    if cfg!(feature = "metis") {
        weighted.push(Method::Clusters { per_part: 20 });
    }
    let mesh = lattice_box([6, 4, 4], |_| 0);
    let tets = mesh.tets.len() as u32;
    let weight = |id: u64| 1 + (id % 7) as u32 * (id % 2) as u32;
    let heaviest = 7;
    for method in weighted {
        let weighed = |ranks: u32| {
            let held: Vec<Rank> = (0..tets).map(|tet| tet * 5 % ranks).collect();
            let parts = thread::run(ranks, |comm| {
                let given = (comm.rank() == 0).then(|| (mesh.clone(), held.clone()));
                let mesh = BareMesh::from(distribute(comm, given).unwrap());
                let neighbours = Neighbours::find(comm, &mesh).unwrap();
                let weights: Vec<u32> = mesh.tet_ids.iter().map(|&id| weight(id)).collect();
                let part = repartition_weighted(comm, &mesh, &neighbours, &weights, 5, method).unwrap();
                mesh.tet_ids.iter().copied().zip(part).collect::<Vec<_>>()
            });
            let mut all = parts.unwrap().concat();
            all.sort_unstable();
            all
        };
        let alone = weighed(1);
        assert_eq!(weighed(3), alone, "{method}");
        let mut sums = [0; 5];
        alone.iter().for_each(|&(id, part)| sums[part as usize] += weight(id));
        let fair = sums.iter().sum::<u32>() / 5;
        // Each level of bisection may be off by the heaviest tet; smoothed parts by one percent.
        let room =
            if matches!(method, Method::Geometric(_)) { 3 * heaviest } else { fair / 100 + 3 * heaviest };
        assert!(sums.iter().all(|&sum| sum <= fair + room), "{method}: {sums:?}");
        assert!(sums.iter().all(|&sum| sum + 4 * room >= fair), "{method}: {sums:?}");
    }
}

#[test]
fn cuts_are_measured_as_the_serial_partitioner_measures_them() {
    let mesh = lattice_cube(4);
    let (part, serial) = partition::partition(&mesh, 3, &Settings::default()).unwrap();
    let metrics = thread::run(3, |comm| {
        let given = (comm.rank() == 0).then(|| (mesh.clone(), part.clone()));
        let mesh = BareMesh::from(distribute(comm, given).unwrap());
        let neighbours = Neighbours::find(comm, &mesh).unwrap();
        measure(comm, &mesh, &neighbours, &vec![comm.rank(); mesh.tets.len()], 3).unwrap()
    });
    for metrics in metrics.unwrap() {
        assert_eq!(metrics.edge_cut, serial.edge_cut as u64);
        assert_eq!([metrics.smallest, metrics.largest], [serial.smallest as u64, serial.largest as u64]);
        assert_eq!(metrics.moving, 0);
    }
}

#[test]
fn smoothing_makes_the_cut_smaller_and_keeps_the_balance() {
    let mesh = lattice_box([16, 12, 12], |_| 0);
    let tets = mesh.tets.len() as u32;
    let (_, curve) = anew(&mesh, &vec![0; tets as usize], 2, 8, Method::Geometric(Geometric::Curve));
    let slabs: Vec<Rank> = (0..tets).map(|tet| tet * 3 / tets).collect();
    let (part, smoothed) = anew(&mesh, &slabs, 3, 8, Method::Smoothed(Geometric::Curve));
    assert!(smoothed.edge_cut < curve.edge_cut, "{smoothed:?} {curve:?}");
    assert!(smoothed.imbalance <= 1.01, "{smoothed:?}");
    let noise: Vec<Rank> =
        (0..tets).map(|tet| crate::ground::kernel::random::mix(tet.into()) as u32 % 2).collect();
    assert!(
        anew(&mesh, &noise, 2, 8, Method::Smoothed(Geometric::Curve)).0 == part,
        "the result depends on the previous distribution"
    );
}

#[cfg(feature = "metis")]
#[test]
fn clusters_cut_less_than_the_curve_and_a_tenth_more_than_metis_on_all_tets_at_most() {
    let mesh = lattice_box([16, 12, 12], |_| 0);
    let cut = |method| anew(&mesh, &vec![0; mesh.tets.len()], 2, 8, method).1.edge_cut as f64;
    let metis = partition::partition(&mesh, 8, &Settings::default()).unwrap().1.edge_cut as f64;
    let [curve, smoothed, clusters] = [
        Method::Geometric(Geometric::Curve),
        Method::Smoothed(Geometric::Curve),
        Method::Clusters { per_part: 400 },
    ]
    .map(cut);
    let cuts = format!("{clusters} {smoothed} {curve} {metis}");
    assert!(clusters <= smoothed && smoothed < curve, "{cuts}");
    assert!(clusters < 1.1 * metis && smoothed < 1.5 * metis && curve < 1.9 * metis, "{cuts}");
}

#[test]
fn neighbours_and_shared_vertices_are_counted_whatever_the_ranks() {
    // Eight cubes in a row, one part each: all but the ends have two neighbours and share 4
    // vertices with each.
    let mesh = lattice_box([8, 1, 1], |_| 0);
    for ranks in [1, 2, 3, 8] {
        let held: Vec<Rank> = (0..48).map(|tet| tet * 5 % ranks).collect();
        let results = thread::run(ranks, |comm| {
            let given = (comm.rank() == 0).then(|| (mesh.clone(), held.clone()));
            let mesh = BareMesh::from(distribute(comm, given).unwrap());
            let neighbours = Neighbours::find(comm, &mesh).unwrap();
            let part: Vec<Rank> = mesh.tet_ids.iter().map(|id| (id / 6) as Rank).collect();
            measure(comm, &mesh, &neighbours, &part, 8).unwrap()
        });
        for metrics in results.unwrap() {
            assert_eq!((metrics.shared_vertices, metrics.edge_cut), (28, 14));
            assert_eq!((metrics.most_neighbours, metrics.mean_neighbours), (2, 14.0 / 8.0));
        }
    }
}

#[test]
fn a_mesh_of_two_ranks_grows_to_seven_and_shrinks_to_one() {
    let mesh = lattice_cube(4);
    thread::run(7, |comm| {
        let part = (0..384).map(|tet| tet % 2).collect();
        let mut mesh = distribute(comm, (comm.rank() == 0).then(|| (mesh.clone(), part))).unwrap();
        for parts in [7, 3, 1] {
            let bare = BareMesh::from(mesh.clone());
            let neighbours = Neighbours::find(comm, &bare).unwrap();
            let to =
                repartition(comm, &bare, &neighbours, parts, Method::Geometric(Geometric::Curve)).unwrap();
            mesh = migrate(comm, mesh, &to).unwrap();
            mesh.check(comm).unwrap();
            let fair = 384_usize.div_ceil(parts as usize);
            assert!(mesh.tets.len() <= fair && mesh.tets.is_empty() == (comm.rank() >= parts));
        }
    })
    .unwrap();
}

#[test]
fn no_parts_and_more_parts_than_tets_are_refused() {
    let mesh = BareMesh::from(from_serial(lattice_cube(1)).unwrap());
    let (alone, curve) = (thread::alone(), Method::Geometric(Geometric::Curve));
    let neighbours = Neighbours::find(&alone, &mesh).unwrap();
    let refused = |parts| repartition(&alone, &mesh, &neighbours, parts, curve).unwrap_err();
    assert_eq!(refused(0), PartitionError::NoParts.into());
    assert_eq!(refused(7), PartitionError::MoreParts { parts: 7, tets: 6 }.into());
}

/// Tets of each part after `moves` diffusion steps.
fn diffused(mesh: &Mesh, part: &[Rank], ranks: u32, moves: usize) -> Vec<usize> {
    let sizes = thread::run(ranks, |comm| {
        let given = (comm.rank() == 0).then(|| (mesh.clone(), part.to_vec()));
        let mut mesh = distribute(comm, given).unwrap();
        for _ in 0..moves {
            let to = diffuse(comm, &Neighbours::find(comm, &mesh.clone().into()).unwrap()).unwrap();
            mesh = migrate(comm, mesh, &to).unwrap();
            mesh.check(comm).unwrap();
        }
        mesh.tets.len()
    });
    sizes.unwrap()
}

#[test]
fn parts_in_a_row_become_even_by_moves_to_neighbours() {
    // A bar whose first half is one part and whose last quarter is split in two.
    let mesh = lattice_box([16, 3, 3], |_| 0);
    let tets = mesh.tets.len();
    let part: Vec<Rank> = (0..tets).map(|tet| [0, 0, 0, 0, 1, 1, 2, 3][tet * 8 / tets]).collect();
    assert_eq!(diffused(&mesh, &part, 4, 0), [432, 216, 108, 108]);
    for size in diffused(&mesh, &part, 4, 2) {
        assert!((212..=220).contains(&size), "{size} of 864 in four parts");
    }
}

#[test]
fn even_parts_and_parts_alone_stay_as_they_are() {
    let mesh = lattice_box([4, 2, 2], |_| 0);
    let even: Vec<Rank> = (0..96).map(|tet| tet / 48).collect();
    assert_eq!(diffused(&mesh, &even, 2, 1), [48, 48]);
    assert_eq!(diffused(&mesh, &[0; 96], 1, 1), [96]);
    // The third rank has no neighbour to get tets from.
    assert_eq!(diffused(&mesh, &even, 3, 1), [48, 48, 0]);
}

#[test]
fn tets_pass_through_parts_that_have_few() {
    let mesh = lattice_box([12, 2, 2], |_| 0);
    // All but the last tets of the bar are on the first of five ranks.
    let part: Vec<Rank> = (0..288).map(|tet: u32| tet.saturating_sub(283)).collect();
    let sizes = diffused(&mesh, &part, 5, 8);
    assert_eq!(sizes.iter().sum::<usize>(), 288);
    assert!(sizes.iter().all(|&size| (48..=68).contains(&size)), "{sizes:?}");
}

/// The parts after one call of `absorb_small_components`, and the number of components then.
fn joined(mesh: &Mesh, part: &[Rank], ranks: u32) -> (Vec<Rank>, u64) {
    let (part, pieces) = on_parts(mesh, part, ranks, |comm, mesh| {
        let to = absorb_small_components(&mesh);
        let (mesh, _) = migrate_bare(comm, mesh, &to, &migrate::MoveSettings::default()).unwrap();
        let pieces = components::pieces(comm, &mesh).unwrap();
        (mesh.tet_ids.iter().map(|&id| (id, comm.rank())).collect(), pieces)
    });
    (part, pieces[0])
}

#[test]
fn islands_go_to_the_part_around_them() {
    let mesh = lattice_box([12, 4, 4], |_| 0);
    let tets = mesh.tets.len();
    let halves: Vec<Rank> = (0..tets).map(|tet| (tet % 72 / 36) as Rank).collect();
    assert_eq!(joined(&mesh, &halves, 2), (halves.clone(), 2));
    let mut part = halves.clone();
    // A tet of the second half in the first, and two the other way round; one of the three parts
    // has only these.
    (part[0], part[66], part[67]) = (1, 0, 0);
    assert_eq!(joined(&mesh, &part, 2), (halves.clone(), 2));
    (part[0], part[66], part[67]) = (2, 1, 1);
    assert_eq!(joined(&mesh, &part, 3), (part, 3), "the only component of a part stays");
}

#[test]
fn large_pieces_stay_where_they_are() {
    // Stripes: the first of two parts has both ends of a bar.
    let mesh = lattice_box([12, 2, 2], |_| 0);
    let part: Vec<Rank> = (0..288).map(|tet| u32::from((24..48).contains(&(tet % 72)))).collect();
    assert_eq!(joined(&mesh, &part, 2), (part, 3));
}

#[test]
fn interfaces_are_joined_whoever_holds_the_tets() {
    let mesh = lattice_box([10, 10, 10], |[x, y, _]| u32::from(x > y));
    let tets = mesh.tets.len();
    let cut_interfaces = |part: &[Rank]| {
        let faces = topology::faces(mesh.points.len(), &mesh.tets);
        let sides = face_tets(faces.faces.len(), &faces.tet_faces).unwrap();
        let [one, other] = [0, 1].map(|side| move |pair: &[u32; 2]| pair[side] as usize);
        let between = sides.iter().filter(|pair| pair[1] != u32::MAX);
        let between = between.filter(|pair| mesh.bodies[one(pair)] != mesh.bodies[other(pair)]);
        between.filter(|pair| part[one(pair)] != part[other(pair)]).count()
    };
    // Equal segments, cut anywhere.
    let part: Vec<Rank> = (0..tets).map(|tet| (tet * 4 / tets) as Rank).collect();
    assert!(cut_interfaces(&part) > 0);
    let join = |ranks: u32, most: f64| {
        let held: Vec<Rank> = (0..tets as u32).map(|tet| tet * 7 % ranks).collect();
        let (joined, _) = on_parts(&mesh, &held, ranks, |comm, mesh| {
            let mut to: Vec<Rank> = mesh.tet_ids.iter().map(|&id| part[id as usize]).collect();
            let neighbours = Neighbours::find(comm, &mesh).unwrap();
            join_interfaces(comm, &mesh, &neighbours, &mut to, 4, most).unwrap();
            (mesh.tet_ids.iter().copied().zip(to).collect(), ())
        });
        joined
    };
    let alone = join(1, 1.1);
    assert_eq!(cut_interfaces(&alone), 0);
    assert_ne!(alone, part);
    for ranks in [2, 5] {
        assert_eq!(join(ranks, 1.1), alone);
    }
    assert_eq!(join(2, 1.0), part, "unchanged if parts would become too uneven");
}
