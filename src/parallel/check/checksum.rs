//! A checksum that is independent of ranks, threads and order, and proves that every face is
//! matched.
//!
//! It consists of sums, modulo 2⁶⁴, of strong hashes of each vertex (global id and coordinate bits;
//! counted by its owner), each tet (global id, vertices, body) and each side of a boundary triangle
//! (patch, vertices, side). They add across ranks, like the partition-independent checksums of
//! p4est and Omega_h.
//!
//! [`Checksum::open`] is a signed sum. A hash gives each vertex a random point p in the space of
//! 64-bit integers modulo 2⁶⁴. Each tet adds its volume there, det(q−p, r−p, s−p), which is the sum
//! of det(p, q, r) over its outward faces; each side of a boundary triangle subtracts its own
//! det(p, q, r). Two tets that share a face cancel there. So the sum over all ranks is 0 for a
//! conforming mesh whose boundary is exactly its boundary triangles. For any other mesh it is a
//! nonzero polynomial of the random points, and 0 with probability near 2⁻⁶⁴. This tests the
//! identity "the boundary of the chain of all tets is the chain of all boundary triangles" on a
//! random cochain, without a table of faces.
//!
//! In a mesh of second order a face has three more nodes, and a second sum tests that the two tets
//! beside it have the same: the determinant of three points, one for each edge, made of its node
//! and of the corner opposite.

use crate::ground::comm::{CommError, Communicator};
use crate::ground::kernel::simplex::from_lowest;
use crate::ground::mesh::stream::{BoundaryBlock, LocalBlock, MeshStream, NO_TET};
use crate::ground::mesh::{EDGE_BETWEEN, GlobalId, TET_FACES, TRIANGLE_EDGES};
use rayon::prelude::*;

/// The checksum of a mesh or a part, see the [module](self).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
pub struct Checksum {
    /// The hash sum of the vertices.
    pub vertices: u64,
    /// The hash sum of the tets.
    pub tets: u64,
    /// The hash sum of the boundary triangles.
    pub boundary: u64,
    /// The signed sum of unmatched faces: over all ranks 0 if there are none.
    pub open: u64,
}

impl Checksum {
    /// The checksum of the union of two parts.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        Self {
            vertices: self.vertices.wrapping_add(other.vertices),
            tets: self.tets.wrapping_add(other.tets),
            boundary: self.boundary.wrapping_add(other.boundary),
            open: self.open.wrapping_add(other.open),
        }
    }
}

impl std::fmt::Display for Checksum {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(out, "{:016x}-{:016x}-{:016x}", self.vertices, self.tets, self.boundary)
    }
}

/// **Collective.** The checksum of the whole mesh, on every rank.
///
/// # Errors
/// [`CommError`] if another rank fails.
pub fn checksum_of_all(comm: &dyn Communicator, stream: &dyn MeshStream) -> Result<Checksum, CommError> {
    sum_of_all(comm, checksum(stream))
}

/// **Collective.** The checksum of the whole mesh, from those of the parts.
pub(super) fn sum_of_all(comm: &dyn Communicator, mine: Checksum) -> Result<Checksum, CommError> {
    let bytes = [mine.vertices, mine.tets, mine.boundary, mine.open].map(u64::to_le_bytes).concat();
    let all = comm.all_gather_bytes(&bytes)?;
    let sum = |sum: Checksum, bytes: &Vec<u8>| {
        let number = |k: usize| {
            u64::from_le_bytes(bytes[8 * k..8 * k + 8].try_into().expect("four numbers from every rank"))
        };
        sum.plus(Checksum { vertices: number(0), tets: number(1), boundary: number(2), open: number(3) })
    };
    Ok(all.iter().fold(Checksum::default(), sum))
}

/// *Local.* The checksum of this rank's part.
pub fn checksum(stream: &dyn MeshStream) -> Checksum {
    let of_tets = |(block, hashed): &mut (LocalBlock, Hashed), index| {
        if stream.work().is_cancelled() {
            return Checksum::default();
        }
        stream.local_block(index, block);
        of_tets(stream, block, hashed)
    };
    let tets = (0..stream.tet_blocks()).into_par_iter().map_init(Default::default, of_tets);
    without_tets(stream).plus(tets.reduce(Checksum::default, Checksum::plus))
}

/// The checksum of this rank's vertices and boundary.
pub(super) fn without_tets(stream: &dyn MeshStream) -> Checksum {
    let vertices = (0..stream.vertex_blocks()).into_par_iter().map(|index| of_vertices(stream, index));
    let boundary = (0..stream.boundary_blocks())
        .into_par_iter()
        .map_init(BoundaryBlock::default, |block, index| of_boundary(stream, index, block));
    vertices.chain(boundary).reduce(Checksum::default, Checksum::plus)
}

fn of_vertices(stream: &dyn MeshStream, index: usize) -> Checksum {
    let block = stream.vertex_block(index);
    let mut sum = 0_u64;
    for (point, id) in stream.vertex_points(index).iter().zip(block.ids()) {
        if block.owner(id, stream.rank()) == stream.rank() {
            let [x, y, z] = point.map(f64::to_bits);
            sum = sum.wrapping_add(hash([id, x, y, z]));
        }
    }
    Checksum { vertices: sum, ..Checksum::default() }
}

/// The vertices of a block; scratch space of one thread.
#[derive(Default)]
pub(super) struct Hashed {
    ids: Vec<GlobalId>,
    places: Vec<Place>,
}

/// The checksum of the tets of a block, all of whose vertices must exist.
pub(super) fn of_tets(stream: &dyn MeshStream, block: &LocalBlock, hashed: &mut Hashed) -> Checksum {
    let Hashed { ids, places } = hashed;
    stream.block_ids(block, ids);
    places.clear();
    places.extend(ids.iter().map(|&id| place(id)));
    let body = block.tets.body.map_or(u64::MAX, |body| u64::from(body.0)) ^ KEYS[5];
    let mut sum = Checksum::default();
    for (id, tet) in (block.tets.first_id..).zip(&block.tets.tets) {
        let at = |corner: usize| places[tet[corner] as usize];
        let (p, q, r, s) = (at(0), at(1), at(2), at(3));
        let first = fold(p[0] ^ KEYS[0], q[0] ^ KEYS[1]);
        let second = fold(r[0] ^ KEYS[2], s[0] ^ KEYS[3]);
        sum.tets = sum.tets.wrapping_add(fold(first ^ id.wrapping_mul(KEYS[4] | 1), second ^ body));
        sum.open = sum.open.wrapping_add(determinant(minus(q, p), minus(r, p), minus(s, p)));
    }
    for (index, (id, tet)) in (block.tets.first_id..).zip(&block.tets.tets).enumerate() {
        let Some(nodes) = block.tets.edge_nodes.get(index) else { break };
        let (corners, nodes) = (tet.map(|k| places[k as usize]), nodes.map(|k| places[k as usize]));
        let hashed = nodes.iter().fold(id, |hash, node| fold(hash.rotate_left(9) ^ KEYS[4], node[0] | 1));
        sum.tets = sum.tets.wrapping_add(hashed);
        for face in TET_FACES {
            let between = TRIANGLE_EDGES.map(|[i, j]| nodes[EDGE_BETWEEN[face[i]][face[j]]]);
            sum.open = sum.open.wrapping_add(oriented_nodes(face.map(|k| corners[k]), between));
        }
    }
    sum
}

/// The value of the second cochain on an outward face with nodes on its edges.
#[inline]
fn oriented_nodes([p, q, r]: [Place; 3], [pq, qr, rp]: [Place; 3]) -> u64 {
    let with = |node: Place, opposite: Place| {
        [0, 1, 2].map(|x| node[x].wrapping_add(opposite[x].wrapping_mul(KEYS[2] | 1)))
    };
    determinant(with(pq, r), with(qr, p), with(rp, q))
}

fn of_boundary(stream: &dyn MeshStream, index: usize, block: &mut BoundaryBlock) -> Checksum {
    stream.boundary_block(index, block);
    let patch = block.patch.map_or(u64::MAX, |patch| u64::from(patch.0));
    let mut sum = Checksum::default();
    for (index, (triangle, parents)) in block.triangles.iter().zip(&block.parents).enumerate() {
        let ids = triangle.map(|vertex| stream.vertex_id(vertex));
        // Sort, because a triangle may be listed starting at any of its vertices.
        let [p, q, r] = from_lowest(ids);
        let mut face = oriented(ids);
        if let Some(nodes) = block.edge_nodes.get(index) {
            let nodes = nodes.map(|node| place(stream.vertex_id(node)));
            face = face.wrapping_add(oriented_nodes(ids.map(place), nodes));
        }
        // The triangle is outward for the tet behind it and inward for the one in front.
        for (side, seen) in [(0, face), (1, face.wrapping_neg())] {
            if parents[side] != NO_TET {
                sum.boundary = sum.boundary.wrapping_add(hash([patch, p, q, r, side as u64]));
                sum.open = sum.open.wrapping_sub(seen);
            }
        }
    }
    sum
}

/// A point in the space of 64-bit integers.
type Place = [u64; 3];

/// The random point of a vertex.
#[inline]
fn place(id: GlobalId) -> Place {
    [hash([id, 0]), hash([id, 1]), hash([id, 2])]
}

/// The value of the cochain on an outward face.
fn oriented(face: [GlobalId; 3]) -> u64 {
    let [p, q, r] = face.map(place);
    determinant(p, q, r)
}

#[inline]
fn minus(p: Place, q: Place) -> Place {
    [p[0].wrapping_sub(q[0]), p[1].wrapping_sub(q[1]), p[2].wrapping_sub(q[2])]
}

/// The determinant modulo 2⁶⁴.
#[inline]
fn determinant(u: Place, v: Place, w: Place) -> u64 {
    let minor = |i: usize, j: usize| v[i].wrapping_mul(w[j]).wrapping_sub(v[j].wrapping_mul(w[i]));
    let term = |i: usize, j: usize, k: usize| u[i].wrapping_mul(minor(j, k));
    term(0, 1, 2).wrapping_add(term(1, 2, 0)).wrapping_add(term(2, 0, 1))
}

/// Digits of π, unrelated to any structure of ids.
const KEYS: [u64; 6] = [
    0x2438_6A88_85A3_08D3,
    0x1319_8A2E_0370_7344,
    0xA409_3822_299F_31D0,
    0x082E_FA98_EC4E_6C89,
    0x4528_21E6_38D0_1377,
    0xBE54_66CF_34E9_0C6C,
];

/// A hash of several numbers: each enters through a multiplication to 128 bits whose halves are
/// combined.
#[inline]
fn hash<const N: usize>(numbers: [u64; N]) -> u64 {
    let mut state = KEYS[5] ^ N as u64;
    for (number, key) in numbers.into_iter().zip(KEYS) {
        state = state.rotate_left(32) ^ fold(number ^ key, state | 1);
    }
    // Mix once more, so that the last number too affects all bits.
    fold(state ^ KEYS[0], KEYS[3])
}

/// The 128-bit product, its halves combined.
#[inline]
fn fold(a: u64, b: u64) -> u64 {
    let product = u128::from(a) * u128::from(b);
    product as u64 ^ (product >> 64) as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hash_changes_half_of_its_bits_with_any_bit_of_its_input() {
        let flips = |numbers: [u64; 4], word: usize, bit: u32| {
            let mut other = numbers;
            other[word] ^= 1 << bit;
            (hash(numbers) ^ hash(other)).count_ones()
        };
        let mut total = 0;
        for word in 0..4 {
            for bit in 0..64 {
                let changed = flips([3, 1, 4, 1], word, bit);
                assert!((8..=56).contains(&changed), "word {word}, bit {bit}: {changed}");
                total += changed;
            }
        }
        assert!((total / 256).abs_diff(32) <= 1, "{total}");
    }

    #[test]
    fn a_triangle_is_the_same_whichever_vertex_it_begins_with_but_not_turned_round() {
        let turned = [[2, 7, 5], [7, 5, 2], [5, 2, 7]].map(from_lowest);
        assert_eq!(turned, [[2, 7, 5]; 3]);
        assert_eq!(from_lowest([7, 2, 5]), [2, 5, 7]);
    }

    #[test]
    fn faces_of_two_tets_that_share_one_cancel() {
        let volume = |tet: [u64; 4]| {
            let [p, q, r, s] = tet.map(place);
            determinant(minus(q, p), minus(r, p), minus(s, p))
        };
        let sum = volume([0, 1, 2, 3]).wrapping_add(volume([1, 2, 3, 4]));
        let left = [[0, 1, 2], [0, 3, 1], [0, 2, 3]].map(|[p, q, r]| oriented([p, r, q]));
        let right = [[1, 2, 4], [2, 3, 4], [3, 1, 4]].map(oriented);
        let outside = left.into_iter().chain(right).fold(0_u64, u64::wrapping_add);
        assert_eq!(sum, outside);
        assert_ne!(sum, 0);
    }
}
