use super::*;
use crate::files::plain::PlainPart;
use crate::files::testing::{cube, scattered, slabs, together, two_tets};
use crate::ground::mesh::stream::{Counts, LocalBlock, TetBlock};
use crate::ground::mesh::{Mesh, Order, TET_FACES};
use crate::parallel::distribution::distribute;
use crate::parallel::migrate::BareStream;
use crate::parallel::refine::{Keep, Settings, fixtures, refine};
use std::collections::BTreeSet;

/// A tet for comparison: rank, id, index in its part, body, vertices.
type Told = [u64; 8];

/// The tets of a stream from a given block on.
fn tets(stream: &dyn MeshStream, first_block: usize) -> Vec<Told> {
    let mut all = Vec::new();
    let mut block = TetBlock::default();
    for index in first_block..stream.tet_blocks() {
        stream.tet_block(index, &mut block);
        for (k, tet) in (0..).zip(&block.tets) {
            let [a, b, c, d] = tet.map(|vertex| stream.vertex_id(vertex));
            let body = block.body.unwrap().0.into();
            all.push([stream.rank().into(), block.first_id + k, block.first_local + k, body, a, b, c, d]);
        }
    }
    all
}

fn faces(tet: &Told) -> impl Iterator<Item = [u64; 3]> + '_ {
    TET_FACES.iter().map(|face| {
        let mut face = face.map(|k| tet[4 + k]);
        face.sort_unstable();
        face
    })
}

/// The expected ghosts of a rank, from all tets of the mesh.
fn expected(all: &[Told], rank: Rank, by: By) -> Vec<&Told> {
    let mine = |tet: &&Told| tet[0] == u64::from(rank);
    let vertices: BTreeSet<u64> = all.iter().filter(mine).flat_map(|tet| tet[4..].to_vec()).collect();
    let own_faces: BTreeSet<[u64; 3]> = all.iter().filter(mine).flat_map(faces).collect();
    let touches = |tet: &&Told| match by {
        By::Vertices => tet[4..].iter().any(|vertex| vertices.contains(vertex)),
        By::Faces => faces(tet).any(|face| own_faces.contains(&face)),
    };
    let mut ghosts: Vec<&Told> = all.iter().filter(|tet| !mine(tet)).filter(touches).collect();
    ghosts.sort_by_key(|tet| tet[1]);
    ghosts
}

/// **Collective.** Compares the ghosts of a part with those computed from all tets.
fn expect_halo(comm: &dyn Communicator, part: &dyn MeshStream, by: By) -> Ghosts {
    let ghosts = halo(comm, part, by).unwrap();
    let stream = WithHalo::new(part, &ghosts);
    let all = comm.all_gather(&tets(part, 0)).unwrap().concat();
    let found = tets(&stream, part.tet_blocks());
    let of_all: Vec<Vec<&Told>> = (0..comm.size()).map(|rank| expected(&all, rank, by)).collect();
    let mine = &of_all[comm.rank() as usize];
    assert_eq!(found.len(), mine.len());
    for ((tet, ghost), expected) in found.iter().zip(&ghosts.tets).zip(mine) {
        assert_eq!([u64::from(ghost.owner), ghost.index], [expected[0], expected[2]]);
        assert_eq!((tet[1], &tet[3..]), (expected[1], &expected[3..]), "id, body, vertices in their order");
    }
    expect_vertices(comm, &stream, &all, &of_all);
    ghosts
}

/// Coordinates, holders and watchers of all vertices of a part and its ghosts.
fn expect_vertices(comm: &dyn Communicator, stream: &WithHalo, all: &[Told], of_all: &[Vec<&Told>]) {
    let mut holders: BTreeMap<u64, BTreeSet<Rank>> = BTreeMap::new();
    let mut seen: BTreeMap<u64, BTreeSet<Rank>> = BTreeMap::new();
    for tet in all {
        tet[4..].iter().for_each(|&vertex| _ = holders.entry(vertex).or_default().insert(tet[0] as Rank));
    }
    for (rank, tets) in (0..).zip(of_all) {
        let watched = tets.iter().flat_map(|tet| &tet[4..]).filter(|vertex| !holders[vertex].contains(&rank));
        watched.for_each(|&vertex| _ = seen.entry(vertex).or_default().insert(rank));
    }
    let (ghosts, mut places) = (stream.ghosts().unwrap(), Vec::new());
    for index in 0..stream.vertex_blocks() {
        let block = stream.vertex_block(index);
        let points = stream.vertex_points(index);
        assert_eq!(points.len(), block.local.len());
        for ((local, id), point) in block.local.clone().zip(block.ids()).zip(points.iter()) {
            let held: Vec<Rank> = holders[&id].iter().copied().collect();
            let said = if block.holders.is_empty() { &[comm.rank()] } else { block.holders };
            assert_eq!(said, held, "holders of vertex {id}");
            assert_eq!(block.owner(id, comm.rank()), owner(&held, id));
            let watchers: Vec<Rank> =
                seen.get(&id).map(|ranks| ranks.iter().copied().collect()).unwrap_or_default();
            assert_eq!(ghosts.watchers_of(local), watchers, "watchers of vertex {id}");
            places.push((id, point.map(f64::to_bits)));
        }
    }
    let bits: Vec<[u64; 4]> = places.iter().map(|(id, [x, y, z])| [*id, *x, *y, *z]).collect();
    let mut all = comm.all_gather(&bits).unwrap().concat();
    all.sort_unstable();
    all.dedup();
    assert_eq!(all.len(), holders.len(), "copies have the same coordinates");
}

/// Checks that a local block is consistent with its tets.
fn expect_blocks(stream: &dyn MeshStream) {
    let mut block = LocalBlock::default();
    let (mut ids, mut points, mut count) = (Vec::new(), Vec::new(), 0);
    for index in 0..stream.tet_blocks() {
        stream.local_block(index, &mut block);
        stream.block_ids(&block, &mut ids);
        stream.block_points(&block, &mut points);
        for (k, vertex) in block.vertices.iter().enumerate() {
            assert_eq!(ids[k], stream.vertex_id(*vertex));
            assert!(points[k].iter().all(|x| x.is_finite()));
        }
        count += block.tets.tets.len() as u64;
    }
    assert_eq!(count, stream.counts().tets);
}

fn plain(mesh: &Mesh, part: &[Rank], ranks: u32) {
    together(ranks, |comm| {
        let part = PlainPart::part(mesh, part, ranks, comm.rank());
        for by in [By::Faces, By::Vertices] {
            let ghosts = expect_halo(comm, &part, by);
            expect_blocks(&WithHalo::new(&part, &ghosts));
        }
    });
}

#[test]
fn each_of_two_tets_sees_the_other() {
    plain(&two_tets(), &[0, 1], 2);
    let mesh = two_tets();
    let sizes = together(2, |comm| {
        let part = PlainPart::part(&mesh, &[0, 1], 2, comm.rank());
        let ghosts = halo(comm, &part, By::Faces).unwrap();
        let counts = WithHalo::new(&part, &ghosts).counts();
        (counts, ghosts.watched.len())
    });
    // Each rank has one vertex that the other watches, and watches one of the other.
    let counts = Counts { vertices: 5, tets: 2, boundary: 3 };
    assert_eq!(sizes, [(counts, 2), (counts, 2)]);
}

#[test]
fn ghosts_are_exactly_the_neighbours_across_the_cuts() {
    let mesh = cube(4);
    for ranks in 1..=5 {
        plain(&mesh, &slabs(&mesh, ranks), ranks);
        plain(&mesh, &scattered(&mesh, ranks), ranks);
    }
}

#[test]
fn ranks_without_tets_have_no_ghosts() {
    let mesh = cube(2);
    plain(&mesh, &vec![1; mesh.tets.len()], 3);
}

#[test]
fn refined_parts_have_the_ghosts_of_their_fine_tets_whether_coordinates_are_kept_or_not() {
    for fixture in [fixtures::ball(2.5), fixtures::cube(2, true)] {
        for (ranks, pieces) in [(1, 2), (3, 4), (5, 3)] {
            together(ranks, |comm| {
                let tets = &fixture.mesh.tets;
                let to = (0..tets.len()).map(|tet| tet as u32 * 7 % ranks).collect::<Vec<Rank>>();
                let dist = distribute(comm, (comm.rank() == 0).then(|| (fixture.mesh.clone(), to))).unwrap();
                let of = |keep| {
                    let settings = Settings { keep, ..Settings::default() };
                    refine(dist.clone(), &fixture.projector, pieces, &settings).unwrap()
                };
                let part = of(Keep::All);
                for by in [By::Faces, By::Vertices] {
                    let ghosts = expect_halo(comm, &part, by);
                    let shell = of(Keep::Boundary);
                    let of_shell = halo(comm, &shell, by).unwrap();
                    assert_eq!(of_shell, ghosts);
                    expect_blocks(&WithHalo::new(&shell, &of_shell));
                    let stored = BareStream::new(crate::parallel::migrate::bare(&part).unwrap());
                    assert_eq!(halo(comm, &stored, by).unwrap(), ghosts);
                }
            });
        }
    }
}

/// Length of a record of [`nodes`].
const RECORD: usize = 1 + 10 * 4;

/// Each tet of second order of a stream from a given block on: its id, and the ids and coordinates
/// of its nodes.
fn nodes(stream: &dyn MeshStream, first_block: usize) -> Vec<u64> {
    let (mut block, mut ids, mut points) = (LocalBlock::default(), Vec::new(), Vec::new());
    let mut found = Vec::new();
    for index in first_block..stream.tet_blocks() {
        stream.local_block(index, &mut block);
        stream.block_ids(&block, &mut ids);
        stream.block_points(&block, &mut points);
        for (k, (tet, edges)) in block.tets.tets.iter().zip(&block.tets.edge_nodes).enumerate() {
            found.push(block.tets.first_id + k as u64);
            for &node in tet.iter().chain(edges) {
                found.push(ids[node as usize]);
                found.extend(points[node as usize].map(f64::to_bits));
            }
        }
    }
    found
}

#[test]
fn ghosts_of_second_order_have_the_nodes_of_their_tets() {
    let fixture = fixtures::ball(1.0);
    together(3, |comm| {
        let to = scattered(&fixture.mesh, 3);
        let dist = distribute(comm, (comm.rank() == 0).then(|| (fixture.mesh.clone(), to))).unwrap();
        for keep in [Keep::All, Keep::Boundary] {
            let settings = Settings { keep, order: Order::Second, ..Settings::default() };
            let part = refine(dist.clone(), &fixture.projector, 2, &settings).unwrap();
            let all = comm.all_gather(&nodes(&part, 0)).unwrap().concat();
            let of_id: BTreeMap<u64, &[u64]> = all.chunks_exact(RECORD).map(|tet| (tet[0], tet)).collect();
            for by in [By::Faces, By::Vertices] {
                let ghosts = halo(comm, &part, by).unwrap();
                let stream = WithHalo::new(&part, &ghosts);
                let found = nodes(&stream, part.tet_blocks());
                assert_eq!(found.len(), ghosts.tets.len() * RECORD);
                assert!(!found.is_empty() && found.chunks_exact(RECORD).all(|tet| of_id[&tet[0]] == tet));
                expect_blocks(&stream);
            }
        }
    });
}

/// Delivers messages in reverse order.
struct Reversed<'a>(&'a dyn Communicator);

impl Communicator for Reversed<'_> {
    fn rank(&self) -> Rank {
        self.0.rank()
    }
    fn size(&self) -> u32 {
        self.0.size()
    }
    fn barrier(&self) -> Result<(), CommError> {
        self.0.barrier()
    }
    fn broadcast_bytes(&self, root: Rank, bytes: &mut Vec<u8>) -> Result<(), CommError> {
        self.0.broadcast_bytes(root, bytes)
    }
    fn gather_bytes(&self, root: Rank, bytes: &[u8]) -> Result<Vec<Vec<u8>>, CommError> {
        self.0.gather_bytes(root, bytes)
    }
    fn all_gather_bytes(&self, bytes: &[u8]) -> Result<Vec<Vec<u8>>, CommError> {
        self.0.all_gather_bytes(bytes)
    }
    fn all_gather_equal_bytes(&self, bytes: &[u8]) -> Result<Vec<u8>, CommError> {
        self.0.all_gather_equal_bytes(bytes)
    }
    fn scatter_bytes(&self, root: Rank, messages: Option<Vec<Vec<u8>>>) -> Result<Vec<u8>, CommError> {
        self.0.scatter_bytes(root, messages)
    }
    fn exchange_bytes(&self, messages: Vec<(Rank, Vec<u8>)>) -> Result<Vec<(Rank, Vec<u8>)>, CommError> {
        self.0.exchange_bytes(messages).map(|received| received.into_iter().rev().collect())
    }
}

#[test]
fn the_order_of_messages_changes_nothing() {
    let mesh = cube(3);
    let to = scattered(&mesh, 5);
    together(5, |comm| {
        let part = PlainPart::part(&mesh, &to, 5, comm.rank());
        for by in [By::Faces, By::Vertices] {
            assert_eq!(halo(&Reversed(comm), &part, by).unwrap(), halo(comm, &part, by).unwrap());
        }
    });
}
