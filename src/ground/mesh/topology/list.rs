//! The list of the edges or faces of tets, on all threads.
//!
//! ```text
//! tets ─► buckets by smallest vertex ─► each bucket sorted and listed ─► position of each tet's
//! ```
//! [`list`] lists entities; [`neighbours`] only matches the faces of tets, in a fifth of the
//! memory.
//!
//! A bucket holds the positions in tets of its entities, four bytes for each, and is so small that
//! it is sorted within the cache of one core. A second loop over the tets takes the positions in
//! the list from the buckets in the order in which the first has filled these: all large arrays are
//! read and written in order.

use super::{MAX_TETS, TET_FACES, VertexId};
use crate::ground::kernel::buckets::{Buckets, concat, cut, map_each, ranges};
use bytemuck::Pod;
use rayon::prelude::*;
use std::ops::Range;

/// The wanted size of a bucket, in entities of tets: with 32 bytes for each while it is sorted, a
/// bucket fits the second-level cache.
const BUCKET: usize = 1 << 14;
/// The maximum number of buckets: all are filled at once, each at its own place.
const MOST_BUCKETS: usize = 4096;

/// A sub-entity of a tet.
#[derive(Clone, Copy, Default)]
pub(super) struct Entry {
    /// Its vertices except the smallest, ascending.
    rest: u64,
    /// Its position in its bucket.
    place: u32,
    /// The tet.
    pub tet: u32,
}

/// Distinct entities of V vertices, K of them in each tet.
pub(super) struct Listed<const V: usize, const K: usize, T> {
    /// The vertices of each, ascending; in lexicographic order.
    pub entities: Vec<[VertexId; V]>,
    /// The positions of those of each tet.
    pub of_tets: Vec<[u32; K]>,
    /// A value for each.
    pub values: Vec<T>,
}

/// Lists the distinct entities that have the vertices `local` in a tet. `value` gets the tets of an
/// entity in any order.
pub(super) fn list<const V: usize, const K: usize, T: Pod + Send + Sync>(
    vertices: usize,
    tets: &[[VertexId; 4]],
    local: &[[usize; V]; K],
    value: impl Fn(&[Entry]) -> T + Sync + Send,
) -> Listed<V, K, T>
where
    [u32; V]: Pod,
    [u32; K]: Pod,
{
    let mut table = Table::collect(vertices, tets, local);
    let lists = table.sort_each(tets, local, |scratch, places, first| scratch.list(places, first, &value));
    let start = |next: &mut u32, (list, _): &(Vec<_>, _)| {
        *next += list.len() as u32;
        Some(*next - list.len() as u32)
    };
    let starts: Vec<u32> = lists.iter().scan(0, start).collect();
    let (lists, values): (Vec<_>, Vec<_>) = lists.into_iter().unzip();
    let entities = concat(lists).into_iter().map(|entity: [u32; V]| entity.map(VertexId)).collect();

    let of_tets = table.by_tet(tets, local, |bucket, position| starts[bucket] + position);
    Listed { entities, of_tets, values: concat(values) }
}

/// No neighbour.
const NONE: u32 = u32::MAX;

/// For each tet, the tet across each face, in the order of [`TET_FACES`]; `u32::MAX` if there is
/// none.
///
/// # Errors
/// The vertices of a face that has more than two tets.
pub(super) fn neighbours(vertices: usize, tets: &[[VertexId; 4]]) -> Result<Vec<[u32; 4]>, [VertexId; 3]> {
    let mut table = Table::collect(vertices, tets, &TET_FACES);
    let crowded = table.sort_each(tets, &TET_FACES, |scratch, places, _| scratch.match_pairs(places));
    if let Some((tet, k)) = crowded.into_iter().flatten().min() {
        let mut face = TET_FACES[k as usize].map(|i| tets[tet as usize][i]);
        face.sort_unstable();
        return Err(face);
    }
    Ok(table.by_tet(tets, &TET_FACES, |_, neighbour| neighbour))
}

/// The K entities of each tet, in buckets by their smallest vertices. A bucket has the vertices
/// that are equal without their last `bits`.
struct Table {
    vertices: usize,
    bits: u32,
    ranges: Vec<Range<usize>>,
    /// First the positions of the entities in tets, later a result for each entity of each tet.
    filled: Buckets,
}

impl Table {
    fn collect<const V: usize, const K: usize>(
        vertices: usize,
        tets: &[[VertexId; 4]],
        local: &[[usize; V]; K],
    ) -> Self {
        assert!(
            tets.len() <= MAX_TETS,
            "{} tets are more than {MAX_TETS}, the most that can be listed",
            tets.len()
        );
        let wanted = (tets.len() * K / BUCKET).clamp(1, MOST_BUCKETS);
        let bits = vertices.div_ceil(wanted).next_power_of_two().trailing_zeros();
        let buckets = ((vertices.max(1) - 1) >> bits) + 1;
        let ranges = ranges(tets.len());
        let filled = Buckets::collect(&ranges, buckets, |range| {
            let places = (range.start * K) as u32..;
            let of_tet = |tet| (0..K).map(move |k| bucket(tet, &local[k], bits));
            places.zip(tets[range].iter().flat_map(of_tet)).map(|(place, bucket)| (bucket, place))
        });
        Self { vertices, bits, ranges, filled }
    }

    /// Sorts each bucket and calls `visit` with its items, which it replaces, and its first vertex.
    fn sort_each<const V: usize, const K: usize, R: Send>(
        &mut self,
        tets: &[[VertexId; 4]],
        local: &[[usize; V]; K],
        visit: impl Fn(&mut Scratch, &mut [u32], usize) -> R + Sync + Send,
    ) -> Vec<R> {
        let (bits, vertices) = (self.bits, self.vertices);
        let sort = |scratch: &mut Scratch, (index, places): (usize, &mut [u32])| {
            let first = index << bits;
            scratch.fill(places, first, (vertices - first).min(1 << bits), |place| {
                let (tet, k) = (place as usize / K, place as usize % K);
                (tet as u32, local[k].map(|i| tets[tet][i].0))
            });
            visit(scratch, places, first)
        };
        let slices = self.filled.all_mut();
        if slices.len() == 1 {
            return slices
                .into_iter()
                .enumerate()
                .map(|bucket| sort(&mut Scratch::default(), bucket))
                .collect();
        }
        slices.into_par_iter().enumerate().map_init(Scratch::default, sort).collect()
    }

    /// The results of the entities of each tet; `result` gets a bucket and an item of it.
    fn by_tet<const V: usize, const K: usize>(
        self,
        tets: &[[VertexId; 4]],
        local: &[[usize; V]; K],
        result: impl Fn(usize, u32) -> u32 + Sync + Send,
    ) -> Vec<[u32; K]>
    where
        [u32; K]: Pod,
    {
        let Self { bits, ranges, filled: Buckets { items, firsts, .. }, .. } = self;
        let mut of_tets: Vec<[u32; K]> = bytemuck::allocation::zeroed_vec(tets.len());
        let slices = cut(&mut of_tets, ranges.iter().map(std::iter::ExactSizeIterator::len));
        let tasks = ranges.into_iter().zip(slices).zip(firsts).collect();
        map_each(tasks, |((range, of_tets), mut next)| {
            for (tet, results) in tets[range].iter().zip(of_tets) {
                for (k, to) in results.iter_mut().enumerate() {
                    let bucket = bucket(tet, &local[k], bits);
                    *to = result(bucket, items[next[bucket] as usize]);
                    next[bucket] += 1;
                }
            }
        });
        of_tets
    }
}

/// The bucket of an entity of a tet.
fn bucket<const V: usize>(tet: &[VertexId; 4], local: &[usize; V], bits: u32) -> usize {
    local.iter().map(|&i| tet[i]).min().expect("entities have vertices").index() >> bits
}

/// Scratch space of one thread.
#[derive(Default)]
struct Scratch {
    /// The entries of a bucket and the smallest vertex of each, counted from the first of the
    /// bucket.
    unsorted: Vec<(u32, Entry)>,
    /// The entries by smallest vertex.
    entries: Vec<Entry>,
    /// The end of the entries of each smallest vertex.
    ends: Vec<u32>,
}

impl Scratch {
    /// Distributes the entries of a bucket by smallest vertex, of `count` vertices from `first` on.
    /// `entity` gives the tet and the vertices at a position.
    fn fill<const V: usize>(
        &mut self,
        places: &[u32],
        first: usize,
        count: usize,
        entity: impl Fn(u32) -> (u32, [u32; V]),
    ) {
        let Self { unsorted, entries, ends } = self;
        ends.clear();
        ends.resize(count + 1, 0);
        unsorted.clear();
        unsorted.extend((0..).zip(places).map(|(place, &position)| {
            let (tet, mut vertices) = entity(position);
            vertices.sort_unstable();
            let rest = vertices[1..].iter().fold(0, |rest, &vertex| rest << 32 | u64::from(vertex));
            let smallest = vertices[0] - first as u32;
            ends[smallest as usize + 1] += 1;
            (smallest, Entry { rest, place, tet })
        }));
        for vertex in 0..count {
            ends[vertex + 1] += ends[vertex];
        }
        // Here `ends` has the start of each vertex; filling moves it to the end.
        entries.resize(unsorted.len(), Entry::default());
        for &(smallest, entry) in &*unsorted {
            let end = &mut ends[smallest as usize];
            entries[*end as usize] = entry;
            *end += 1;
        }
        ends.truncate(count);
    }

    /// Replaces each of `places` by the tet on the other side of the face. Returns the tet and the
    /// local number of a face that has more than two tets.
    fn match_pairs(&mut self, places: &mut [u32]) -> Option<(u32, u32)> {
        let (mut begin, mut crowded) = (0, None);
        for &end in &self.ends {
            let of_vertex = &mut self.entries[begin..end as usize];
            of_vertex.sort_unstable_by_key(|entry| entry.rest);
            for of_face in of_vertex.chunk_by(|a, b| a.rest == b.rest) {
                match *of_face {
                    [one] => places[one.place as usize] = NONE,
                    [one, other] => {
                        places[one.place as usize] = other.tet;
                        places[other.place as usize] = one.tet;
                    }
                    _ => {
                        crowded = crowded
                            .or_else(|| of_face.iter().map(|e| (e.tet, places[e.place as usize] % 4)).min())
                    }
                }
            }
            begin = end as usize;
        }
        crowded
    }

    /// Lists the distinct entities, and replaces each of `places` by the position in the list.
    fn list<const V: usize, T>(
        &mut self,
        places: &mut [u32],
        first: usize,
        value: impl Fn(&[Entry]) -> T,
    ) -> (Vec<[u32; V]>, Vec<T>) {
        let mut begin = 0;
        let mut distinct = 0;
        for &end in &self.ends {
            let of_vertex = &mut self.entries[begin..end as usize];
            of_vertex.sort_unstable_by_key(|entry| entry.rest);
            distinct += of_vertex.chunk_by(|a, b| a.rest == b.rest).count();
            begin = end as usize;
        }
        let (mut list, mut values) = (Vec::with_capacity(distinct), Vec::with_capacity(distinct));
        begin = 0;
        for (vertex, &end) in (first as u32..).zip(&self.ends) {
            for of_entity in self.entries[begin..end as usize].chunk_by(|a, b| a.rest == b.rest) {
                of_entity.iter().for_each(|entry| places[entry.place as usize] = list.len() as u32);
                let rest = of_entity[0].rest;
                let other = |i: usize| (rest >> (32 * (V - 1 - i))) as u32;
                list.push(std::array::from_fn(|i| if i == 0 { vertex } else { other(i) }));
                values.push(value(of_entity));
            }
            begin = end as usize;
        }
        (list, values)
    }
}
