//! Loops over ranges, and stable distribution of numbers to buckets by counting, on all threads.
//!
//! The results do not depend on the number of threads. Few items are processed by the calling
//! thread alone: a task costs some microseconds.

use bytemuck::Zeroable;
use rayon::prelude::*;
use std::ops::Range;

/// Fewer items than this are one range: at some nanoseconds per item, a range then costs much more
/// than the start of its task.
const LEAST: usize = 1 << 14;
/// The maximum number of ranges: enough for the threads of one machine. The table of a distribution
/// has an entry for each range and bucket.
const MOST: usize = 64;

/// Divides 0 to `count` into ranges of nearly equal length; at least one, which may be empty.
pub fn ranges(count: usize) -> Vec<Range<usize>> {
    let pieces = (count / LEAST).clamp(1, MOST);
    let start = |piece: usize| (piece as u128 * count as u128 / pieces as u128) as usize;
    (0..pieces).map(|piece| start(piece)..start(piece + 1)).collect()
}

/// Maps items in parallel; a single one without a task.
pub fn map_each<T: Send, R: Send>(items: Vec<T>, map: impl Fn(T) -> R + Sync + Send) -> Vec<R> {
    if items.len() <= 1 {
        return items.into_iter().map(map).collect();
    }
    items.into_par_iter().map(map).collect()
}

/// The values of 0 to `count`, computed in parallel if there are many.
pub fn tabulate<R: Send>(count: usize, value: impl Fn(usize) -> R + Sync + Send) -> Vec<R> {
    if count < LEAST {
        return (0..count).map(value).collect();
    }
    (0..count).into_par_iter().with_min_len(LEAST / 4).map(value).collect()
}

/// The first of 0 to `count` with a property.
pub fn first(count: usize, has: impl Fn(usize) -> bool + Sync + Send) -> Option<usize> {
    let in_range = |mut range: Range<usize>| range.find(|&index| has(index));
    map_each(ranges(count), in_range).into_iter().flatten().next()
}

/// Joins lists in their order.
pub fn concat<T: Zeroable + Copy + Send + Sync>(lists: Vec<Vec<T>>) -> Vec<T> {
    if lists.len() == 1 {
        return lists.into_iter().next().unwrap_or_default();
    }
    let mut all = bytemuck::allocation::zeroed_vec(lists.iter().map(Vec::len).sum());
    let slices = cut(&mut all, lists.iter().map(Vec::len));
    // Each list is freed as soon as it is copied.
    map_each(slices.into_iter().zip(lists).collect(), |(to, list)| to.copy_from_slice(&list));
    all
}

/// Cuts a slice into consecutive slices of these lengths.
pub fn cut<T>(slice: &mut [T], lengths: impl IntoIterator<Item = usize>) -> Vec<&mut [T]> {
    let mut rest = slice;
    let mut next = |length| rest.split_off_mut(..length).expect("the slice is as long as its pieces");
    lengths.into_iter().map(&mut next).collect()
}

/// Numbers in buckets.
///
/// They come from several ranges of a loop. The items of a bucket keep the order of the loop.
#[derive(Clone, Debug, Default)]
pub struct Buckets {
    /// The start of each bucket in `items`; one more entry than buckets.
    pub offsets: Vec<u32>,
    /// The items of all buckets.
    pub items: Vec<u32>,
    /// For each range of the loop, the position in `items` of its first item of each bucket.
    pub firsts: Vec<Vec<u32>>,
}

impl Buckets {
    /// Distributes the pairs (bucket, item) of `pairs`, which is called twice for each range.
    ///
    /// # Panics
    /// With 2³² items or more, or if the pairs of a range differ between the calls.
    pub fn collect<I: Iterator<Item = (usize, u32)>>(
        ranges: &[Range<usize>],
        buckets: usize,
        pairs: impl Fn(Range<usize>) -> I + Sync + Send,
    ) -> Self {
        let count = |range: Range<usize>| {
            let mut counts = vec![0u32; buckets];
            pairs(range).for_each(|(bucket, _)| counts[bucket] += 1);
            counts
        };
        let counts: Vec<Vec<u32>> = map_each(ranges.to_vec(), count);
        let mut firsts = vec![vec![0u32; buckets]; ranges.len()];
        let mut offsets = Vec::with_capacity(buckets + 1);
        let mut next = 0u32;
        for bucket in 0..buckets {
            offsets.push(next);
            for (firsts, counts) in firsts.iter_mut().zip(&counts) {
                firsts[bucket] = next;
                next = next.checked_add(counts[bucket]).expect("fewer than 2^32 items");
            }
        }
        offsets.push(next);

        let mut items = bytemuck::allocation::zeroed_vec(next as usize);
        let lengths = (0..buckets).flat_map(|bucket| counts.iter().map(move |of| of[bucket] as usize));
        let mut to: Vec<Vec<_>> = ranges.iter().map(|_| Vec::with_capacity(buckets)).collect();
        for (slice, index) in cut(&mut items, lengths).into_iter().zip((0..ranges.len()).cycle()) {
            to[index].push(slice.iter_mut());
        }
        map_each(ranges.iter().cloned().zip(to).collect(), |(range, mut to)| {
            let put = |(bucket, item): (usize, u32)| *to[bucket].next().expect("as many as counted") = item;
            pairs(range).for_each(put);
        });
        Self { offsets, items, firsts }
    }

    /// The items of one bucket.
    pub fn of(&self, bucket: usize) -> &[u32] {
        &self.items[self.offsets[bucket] as usize..self.offsets[bucket + 1] as usize]
    }

    /// The items of all buckets.
    pub fn all_mut(&mut self) -> Vec<&mut [u32]> {
        cut(&mut self.items, self.offsets.windows(2).map(|ends| (ends[1] - ends[0]) as usize))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_cover_all_items_in_order() {
        for count in [0, 1, LEAST - 1, LEAST, 5 * LEAST + 3, 1000 * LEAST] {
            let ranges = ranges(count);
            assert!(ranges.windows(2).all(|pair| pair[0].end == pair[1].start));
            assert_eq!((ranges[0].start, ranges[ranges.len() - 1].end), (0, count));
            assert!(ranges.len() <= MOST);
        }
    }

    #[test]
    fn items_of_a_bucket_keep_their_order_over_many_ranges() {
        let count = 10 * LEAST;
        let bucket = |item: usize| item * 7919 % 13;
        let pairs = |range: Range<usize>| range.map(|item| (bucket(item), item as u32));
        let found = Buckets::collect(&ranges(count), 13, pairs);
        assert_eq!(found.items.len(), count);
        for index in 0..13 {
            assert!(found.of(index).is_sorted());
            assert!(found.of(index).iter().all(|&item| bucket(item as usize) == index));
        }
    }

    #[test]
    fn the_first_index_and_the_joined_list_do_not_depend_on_ranges() {
        let count = 5 * LEAST;
        assert_eq!(first(count, |index| index % LEAST == LEAST - 1), Some(LEAST - 1));
        assert_eq!(first(count, |index| index > count), None);
        let lists = (0..40).map(|list| vec![list; list as usize % 3]).collect::<Vec<Vec<u32>>>();
        assert_eq!(concat(lists.clone()), lists.concat());
        assert_eq!(tabulate(count, |index| index), (0..count).collect::<Vec<_>>());
    }
}
