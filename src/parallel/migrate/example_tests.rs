//! The worked example of the thesis "A parallel mesh generator based on sequential NETGEN", section
//! 5.1, message by message.

use super::owners::{self, Holders, NewHolders, Update};
use super::*;
use crate::ground::comm::thread;
use crate::ground::mesh::Mesh;
use crate::ground::mesh::fixtures::lattice_box;
use crate::parallel::distribution::{distribute, owner};

/// Vertices of a box of 4 × 4 × 8 cells; each quadrant seen from above belongs to one rank.
///
/// ```text
///     y          a is on the line where all four meet, b between ranks 0 and 1,
///     | 2 | 3    c and d are inside rank 0. Rank 2 owns a, and rank 0 b.
///     |---a---
///     | 0 b 1
///     +-------- x    All tets at a leave ranks 0 and 2 for rank 1; those at b leave rank 1 for rank 0;
///                    those at c leave rank 0 for 1 and 2; those at d leave rank 0 for 2.
/// ```
const A: GlobalId = id(2, 2, 2);
const B: GlobalId = id(2, 1, 7);
const C: GlobalId = id(1, 1, 1);
const D: GlobalId = id(1, 1, 5);

const fn id(x: u64, y: u64, z: u64) -> GlobalId {
    (z * 5 + y) * 5 + x
}

fn mesh_and_parts() -> (Mesh, Vec<Rank>) {
    let mesh = lattice_box([4, 4, 8], |_| 0);
    let center = |tet: &[crate::ground::mesh::VertexId; 4], axis: usize| {
        tet.iter().map(|v| mesh.points[v.index()][axis]).sum::<f64>() / 4.0
    };
    let part = |tet| Rank::from(center(tet, 0) > 0.5) + 2 * Rank::from(center(tet, 1) > 0.5);
    let parts = mesh.tets.iter().map(part).collect();
    (mesh, parts)
}

/// The destinations of the tets of a part in the example.
fn destinations(part: &BareMesh) -> Vec<Rank> {
    let to = |tet: &[crate::ground::mesh::VertexId; 4]| {
        let has = |id| tet.iter().any(|v| part.vertex_ids[v.index()] == id);
        let in_first_cells = tet.iter().all(|v| part.points[v.index()][0] <= 0.25);
        match part.rank {
            0 if has(A) => 1,
            0 if has(C) && in_first_cells => 1,
            0 if has(C) || has(D) => 2,
            1 if has(B) => 0,
            2 if has(A) => 1,
            rank => rank,
        }
    };
    part.tets.iter().map(to).collect()
}

/// The triples (vertex, rank, 1 for add or 0 for delete) about the four vertices.
fn triples(updates: impl IntoIterator<Item = Update>) -> Vec<(GlobalId, Rank, u8)> {
    let of_four = |update: &Update| [A, B, C, D].contains(&update.vertex);
    updates.into_iter().filter(of_four).map(|u| (u.vertex, u.rank, u8::from(u.gets))).collect()
}

#[test]
fn the_thesis_example_gives_the_lists_and_messages_of_the_thesis() {
    let (mesh, parts) = mesh_and_parts();
    let results = thread::run(4, |comm| {
        let given = (comm.rank() == 0).then(|| (mesh.clone(), parts.clone()));
        let part: BareMesh = distribute(comm, given).unwrap().into();
        let room = rebuild::Room { rank: part.rank, limit: u64::MAX };
        let leaving = pack::pack(&part, &destinations(&part), room).unwrap();
        let sent = owners::updates(&part, &leaving);
        let (mut received, mut holders_received) = (Vec::new(), Vec::new());
        for (_, message) in comm.exchange_bytes(owners::update_messages(&sent)).unwrap() {
            owners::read_updates(&message[1..], &mut received);
        }
        let update = owners::new_holders(&part, received.clone());
        for (_, message) in comm.exchange_bytes(owners::holder_messages(&update)).unwrap() {
            holders_received.extend(owners::read_holders(&message));
        }
        (sent, received, update, holders_received)
    });
    let results = results.unwrap();

    // The changes that each rank sends to each owner.
    let sent = |rank: usize, to: Rank| {
        triples(results[rank].0.iter().filter(|(owner, _)| *owner == to).map(|(_, update)| *update))
    };
    assert_eq!(sent(0, 0), [(C, 0, 0), (C, 1, 1), (C, 2, 1), (D, 0, 0), (D, 2, 1)]);
    assert_eq!(sent(0, 2), [(A, 0, 0), (A, 1, 1)]);
    assert_eq!(sent(1, 0), [(B, 1, 0), (B, 0, 1)]);
    assert_eq!(sent(2, 2), [(A, 2, 0), (A, 1, 1)]);
    for (rank, to) in
        [(0, 1), (0, 3), (1, 1), (1, 2), (1, 3), (2, 0), (2, 1), (2, 3), (3, 0), (3, 1), (3, 2), (3, 3)]
    {
        assert_eq!(sent(rank, to), [], "from {rank} to {to}");
    }
    // The changes that each owner received: only of vertices that it owns.
    let mut received = results.iter().map(|result| triples(result.1.iter().copied()));
    let to_0 = [(C, 0, 0), (C, 1, 1), (C, 2, 1), (D, 0, 0), (D, 2, 1), (B, 1, 0), (B, 0, 1)];
    assert_eq!(received.next().unwrap(), to_0);
    assert_eq!(received.next().unwrap(), []);
    assert_eq!(received.next().unwrap(), [(A, 0, 0), (A, 1, 1), (A, 2, 0), (A, 1, 1)]);
    assert_eq!(received.next().unwrap(), []);
    // The new lists of holders.
    let lists = |rank: usize| {
        let of_four = |update: &&NewHolders| [A, B, C, D].contains(&update.new.vertex);
        let mut lists: Vec<_> =
            results[rank].2.iter().filter(of_four).map(|n| (n.new.vertex, n.new.holders.clone())).collect();
        lists.sort_by_key(|(vertex, _)| [A, B, C, D].iter().position(|v| v == vertex));
        lists
    };
    assert_eq!(lists(0), [(B, vec![0]), (C, vec![1, 2]), (D, vec![2])]);
    assert_eq!(lists(2), [(A, vec![1, 3])]);
    assert_eq!([lists(1), lists(3)], [vec![], vec![]]);
    // Ranks that are notified: those on the list; none for d, which stays inside one part.
    let received = |rank: usize, vertex| {
        let of_vertex = |update: &&Holders| update.vertex == vertex;
        results[rank].3.iter().filter(of_vertex).map(|update| update.holders.clone()).collect::<Vec<_>>()
    };
    for rank in 0..4 {
        let on =
            |ranks: &[usize], list: &[Rank]| if ranks.contains(&rank) { vec![list.to_vec()] } else { vec![] };
        assert_eq!(received(rank, A), on(&[1, 3], &[1, 3]));
        assert_eq!(received(rank, B), on(&[0], &[0]));
        assert_eq!(received(rank, C), on(&[1, 2], &[1, 2]));
        assert_eq!(received(rank, D), on(&[], &[]));
    }
}

#[test]
fn the_thesis_example_ends_with_the_holders_of_the_thesis() {
    let (mesh, parts) = mesh_and_parts();
    let holders = thread::run(4, |comm| {
        let given = (comm.rank() == 0).then(|| (mesh.clone(), parts.clone()));
        let part = distribute(comm, given).unwrap();
        let to = destinations(&part.clone().into());
        let moved = migrate(comm, part, &to).unwrap();
        moved.check(comm).unwrap();
        [A, B, C, D].map(|id| {
            let v = moved.vertex_ids.binary_search(&id).ok()?;
            Some(moved.vertex_holders(crate::ground::mesh::VertexId::new(v)).to_vec())
        })
    });
    let expected = [
        [None, Some(vec![0]), None, None],
        [Some(vec![1, 3]), None, Some(vec![1, 2]), None],
        [None, None, Some(vec![1, 2]), Some(vec![2])],
        [Some(vec![1, 3]), None, None, None],
    ];
    assert_eq!(holders.unwrap(), expected);
    // Owners before and after are spread evenly over the holders.
    assert_eq!([owner(&[0, 1, 2, 3], A), owner(&[0, 1], B)], [2, 0]);
    assert_eq!([owner(&[1, 3], A), owner(&[1, 2], C)], [1, 2]);
}
