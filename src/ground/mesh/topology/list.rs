//! The list of the edges or faces of tets, on all threads.
//!
//! ```text
//! tets ──► buckets by smallest vertex ──► each bucket sorted and listed ──► position of each tet's
//! ```
//! A bucket holds the positions in tets of its entities, four bytes for each, and is so small that
//! it is sorted within the cache of one core. A second loop over the tets takes the positions in
//! the list from the buckets in the order in which the first has filled these: all large arrays are
//! read and written in order.

use super::{MAX_TETS, VertexId};
use crate::ground::kernel::buckets::{Buckets, concat, cut, map_each, ranges};
use bytemuck::Pod;
use rayon::prelude::*;

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
    assert!(
        tets.len() <= MAX_TETS,
        "{} tets are more than {MAX_TETS}, the most that can be listed",
        tets.len()
    );
    // Buckets have the vertices that are equal without their last bits.
    let wanted = (tets.len() * K / BUCKET).clamp(1, MOST_BUCKETS);
    let bits = vertices.div_ceil(wanted).next_power_of_two().trailing_zeros();
    let buckets = ((vertices.max(1) - 1) >> bits) + 1;
    let bucket = |tet: &[VertexId; 4], k: usize| {
        local[k].iter().map(|&i| tet[i]).min().expect("entities have vertices").index() >> bits
    };
    let ranges = ranges(tets.len());
    let mut filled = Buckets::collect(&ranges, buckets, |range| {
        let places = (range.start * K) as u32..;
        let of_tet = |tet| (0..K).map(move |k| (bucket(tet, k), ()));
        places.zip(tets[range].iter().flat_map(of_tet)).map(|(place, (bucket, ()))| (bucket, place))
    });

    let sort = |scratch: &mut Scratch, (index, places): (usize, &mut [u32])| {
        let first = index << bits;
        scratch.fill(places, first, (vertices - first).min(1 << bits), |place| {
            let (tet, k) = (place as usize / K, place as usize % K);
            (tet as u32, local[k].map(|i| tets[tet][i].0))
        });
        scratch.list(places, first, &value)
    };
    let slices = filled.all_mut();
    let lists: Vec<_> = if buckets == 1 {
        slices.into_iter().enumerate().map(|bucket| sort(&mut Scratch::default(), bucket)).collect()
    } else {
        slices.into_par_iter().enumerate().map_init(Scratch::default, sort).collect()
    };
    let start = |next: &mut u32, (list, _): &(Vec<_>, _)| {
        *next += list.len() as u32;
        Some(*next - list.len() as u32)
    };
    let starts: Vec<u32> = lists.iter().scan(0, start).collect();
    let (lists, values): (Vec<_>, Vec<_>) = lists.into_iter().unzip();
    let entities = concat(lists).into_iter().map(|entity: [u32; V]| entity.map(VertexId)).collect();

    let mut of_tets: Vec<[u32; K]> = bytemuck::allocation::zeroed_vec(tets.len());
    let slices = cut(&mut of_tets, ranges.iter().map(std::iter::ExactSizeIterator::len));
    let firsts = std::mem::take(&mut filled.firsts);
    let tasks = ranges.into_iter().zip(slices).zip(firsts).collect();
    map_each(tasks, |((range, of_tets), mut next)| {
        for (tet, positions) in tets[range].iter().zip(of_tets) {
            for (k, position) in positions.iter_mut().enumerate() {
                let bucket = bucket(tet, k);
                *position = starts[bucket] + filled.items[next[bucket] as usize];
                next[bucket] += 1;
            }
        }
    });
    Listed { entities, of_tets, values: concat(values) }
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
