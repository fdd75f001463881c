//! Changes that are decided on by all threads and made in their order by one: the mesh is the same
//! for any number of threads.

use super::sheet::Sheet;
use rayon::prelude::*;

/// How many changes are decided on before they are made. Of more, more decisions are invalid when
/// their turn comes; fewer are not worth the threads.
const BATCH: usize = 1024;

/// The fewest decisions that a thread takes at once.
const FEWEST: usize = 16;

/// Decides on a change at each item and makes the changes in the order of the items.
///
/// `decide` sees the sheet as it was before some of the changes in front of it. If its decision
/// does not hold any more when its turn comes, which `holds` finds from the time at which it was
/// made, it is made again: so the result is as if one thread decided on and made one change after
/// the other, as one thread does (speculation with commits in order, compare Blelloch, Fineman,
/// Gibbons, Shun 2012).
pub(super) fn in_order<T: Copy + Sync, D: Send>(
    sheet: &mut Sheet<'_>,
    items: &[T],
    decide: impl Fn(&Sheet<'_>, T) -> D + Sync,
    holds: impl Fn(&Sheet<'_>, u64, T, &D) -> bool,
    mut make: impl FnMut(&mut Sheet<'_>, T, D),
) {
    if rayon::current_num_threads() == 1 {
        for &item in items {
            let decision = decide(sheet, item);
            make(sheet, item, decision);
        }
        return;
    }
    for batch in items.chunks(BATCH) {
        let began = sheet.changes.now();
        let seen: &Sheet<'_> = sheet;
        let decisions: Vec<D> =
            batch.par_iter().with_min_len(FEWEST).map(|&item| decide(seen, item)).collect();
        for (&item, decision) in batch.iter().zip(decisions) {
            let decision = if holds(sheet, began, item, &decision) { decision } else { decide(sheet, item) };
            make(sheet, item, decision);
        }
    }
}
