//! Changes that are decided on by all threads and made in their order: the result is the same for
//! any number of threads.

use rayon::prelude::*;

/// How many changes are decided on before they are made. Of more, more decisions are invalid when
/// their turn comes; fewer are not worth the threads.
const BATCH: usize = 1024;

/// The fewest decisions that a thread takes at once.
const FEWEST: usize = 16;

/// Decides on a change at each item and makes the changes in the order of the items.
///
/// `decide` sees the state as it was before some of the changes in front of it. If its decision
/// does not hold any more when its turn comes, which `holds` finds from the `time` at which it was
/// made, it is made again: so the result is as if one thread decided on and made one change after
/// the other, as one thread does (speculation with commits in order, compare Blelloch, Fineman,
/// Gibbons, Shun 2012).
pub fn in_order<S: Sync, T: Copy + Sync, D: Send>(
    state: &mut S,
    items: &[T],
    time: impl Fn(&S) -> u64,
    decide: impl Fn(&S, T) -> D + Sync,
    holds: impl Fn(&S, u64, T, &D) -> bool,
    mut make: impl FnMut(&mut S, T, D),
) {
    if rayon::current_num_threads() == 1 {
        for &item in items {
            let decision = decide(state, item);
            make(state, item, decision);
        }
        return;
    }
    for batch in items.chunks(BATCH) {
        let began = time(state);
        let seen: &S = state;
        let decisions: Vec<D> =
            batch.par_iter().with_min_len(FEWEST).map(|&item| decide(seen, item)).collect();
        for (&item, decision) in batch.iter().zip(decisions) {
            let decision = if holds(state, began, item, &decision) { decision } else { decide(state, item) };
            make(state, item, decision);
        }
    }
}

/// [`in_order`] for decisions that do not depend on the changes before them.
pub fn independent<S: Sync, T: Copy + Sync, D: Send>(
    state: &mut S,
    items: &[T],
    decide: impl Fn(&S, T) -> D + Sync,
    make: impl FnMut(&mut S, T, D),
) {
    in_order(state, items, |_| 0, decide, |_, _, _, _| true, make);
}

/// [`in_order`] for changes of vertices, ascending, that depend on their neighbours alone.
///
/// `neighbours` appends the neighbours of a vertex, which the changes must leave as they are.
pub fn over_vertices<S: Sync, D: Send>(
    state: &mut S,
    vertices: &[u32],
    neighbours: impl Fn(&S, u32, &mut Vec<u32>),
    decide: impl Fn(&S, u32) -> D + Sync,
    mut make: impl FnMut(&mut S, u32, D),
) {
    // One thread decides on each when its turn comes.
    if rayon::current_num_threads() == 1 {
        return independent(state, vertices, decide, make);
    }
    for block in vertices.chunks(BLOCK) {
        for group in levels(block, |v, near| neighbours(state, v, near)) {
            independent(state, &group, &decide, &mut make);
        }
    }
}

/// How many vertices are taken at a time. More would be in fewer groups each, but less of them
/// stays in caches.
const BLOCK: usize = 8192;

/// Ascending vertices in groups: no two of a group are neighbours, and of two neighbours the lower
/// is in an earlier group.
fn levels(vertices: &[u32], mut neighbours: impl FnMut(u32, &mut Vec<u32>)) -> Vec<Vec<u32>> {
    let mut level_of = vec![0_u32; vertices.len()];
    let mut groups: Vec<Vec<u32>> = Vec::new();
    let mut near = Vec::new();
    for (i, &v) in vertices.iter().enumerate() {
        near.clear();
        neighbours(v, &mut near);
        let before = near.iter().filter(|w| **w < v).filter_map(|w| vertices[..i].binary_search(w).ok());
        let level = before.map(|k| level_of[k] + 1).max().unwrap_or(0);
        level_of[i] = level;
        if groups.len() <= level as usize {
            groups.push(Vec::new());
        }
        groups[level as usize].push(v);
    }
    groups
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers in a ring; each change depends on the numbers beside it.
    fn changed(threads: usize) -> Vec<u64> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let count = 5000;
        let mut numbers: Vec<u64> = (0..count as u64).map(|k| k * k % 97).collect();
        let beside = |v: u32| [(v + 1) % count, (v + count - 1) % count, (v * 7 + 3) % count];
        pool.install(|| {
            for stride in [1, 3] {
                let mut all: Vec<u32> = (0..count).filter(|v| v % stride == 0).collect();
                let decide = |numbers: &Vec<u64>, v: u32| {
                    beside(v)
                        .iter()
                        .fold(numbers[v as usize], |sum, &w| sum.wrapping_mul(31) ^ numbers[w as usize])
                };
                let make = |numbers: &mut Vec<u64>, v: u32, new: u64| numbers[v as usize] = new;
                let neighbours = |_: &Vec<u64>, v: u32, near: &mut Vec<u32>| {
                    near.extend(beside(v));
                    // Those that v is beside of.
                    near.extend((0..count).filter(|&w| beside(w).contains(&v)));
                };
                over_vertices(&mut numbers, &all, neighbours, decide, make);
                all.reverse();
                // The times are those of the last changes.
                let mut state = (numbers.clone(), vec![0_u64; count as usize], 1);
                let holds = |state: &(Vec<u64>, Vec<u64>, u64), began: u64, v: u32, _: &u64| {
                    beside(v).iter().chain([&v]).all(|&w| state.1[w as usize] <= began)
                };
                let make = |state: &mut (Vec<u64>, Vec<u64>, u64), v: u32, new: u64| {
                    state.2 += 1;
                    (state.0[v as usize], state.1[v as usize]) = (new, state.2);
                };
                in_order(&mut state, &all, |state| state.2, |state, v| decide(&state.0, v), holds, make);
                numbers = state.0;
            }
        });
        numbers
    }

    #[test]
    fn any_number_of_threads_gives_the_same_result() {
        let one = changed(1);
        assert_eq!(changed(2), one);
        assert_eq!(changed(5), one);
    }
}
