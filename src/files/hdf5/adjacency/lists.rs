//! Rows of ranks, and lists of values for rows.

use crate::ground::comm::{CommError, Communicator, Rank};
use bytemuck::Pod;
use rayon::prelude::*;
use std::ops::Range;

/// Rows of a table of all ranks, contiguous by rank.
#[derive(Clone, Debug)]
pub(super) struct Rows {
    rank: Rank,
    /// The first row of each rank, then the number of all rows.
    starts: Vec<u64>,
}

impl Rows {
    /// **Collective.** Numbers the rows of all ranks; `count` is the number of this rank's.
    pub fn of(comm: &dyn Communicator, count: u64) -> Result<Self, CommError> {
        let mut starts = vec![0];
        for count in comm.all_gather_one(count)? {
            starts.push(starts[starts.len() - 1] + count);
        }
        Ok(Self { rank: comm.rank(), starts })
    }

    /// The number of rows.
    pub fn total(&self) -> u64 {
        self.starts[self.starts.len() - 1]
    }

    /// The rows of this rank.
    pub fn own(&self) -> Range<u64> {
        self.starts[self.rank as usize]..self.starts[self.rank as usize + 1]
    }

    /// The rank of a row.
    pub fn rank_of(&self, row: u64) -> Rank {
        debug_assert!(row < self.total());
        // Of several ranks with one start, all but the last have no rows.
        self.starts.partition_point(|start| *start <= row) as Rank - 1
    }
}

/// Entries on their way to the ranks of their rows; the row is the first number of an entry.
pub(super) struct Entries<'a, const N: usize> {
    rows: &'a Rows,
    own: Vec<[u64; N]>,
    to_each: Vec<Vec<[u64; N]>>,
}

impl<'a, const N: usize> Entries<'a, N>
where
    [u64; N]: Pod,
{
    /// No entries, with memory for `expected` of this rank.
    pub fn new(comm: &dyn Communicator, rows: &'a Rows, expected: usize) -> Self {
        Self { rows, own: Vec::with_capacity(expected), to_each: vec![Vec::new(); comm.size() as usize] }
    }

    pub fn push(&mut self, entry: [u64; N]) {
        if self.rows.own().contains(&entry[0]) {
            self.own.push(entry);
        } else {
            self.to_each[self.rows.rank_of(entry[0]) as usize].push(entry);
        }
    }

    /// **Collective.** The entries of this rank's rows, sorted.
    pub fn sorted(self, comm: &dyn Communicator) -> Result<Vec<[u64; N]>, CommError> {
        let mut entries = self.own;
        let received = comm.all_to_all(self.to_each)?;
        entries.reserve_exact(received.iter().map(Vec::len).sum());
        entries.extend(received.into_iter().flatten());
        entries.par_sort_unstable();
        Ok(entries)
    }
}

/// Values of rows, on their way to the ranks of these.
pub(super) type Pairs<'a> = Entries<'a, 2>;

/// Ascending values for each row of this rank, of all ranks' lists.
#[derive(Debug)]
pub(super) struct Lists {
    /// Where the list of each row begins among the values of all ranks.
    pub begins: Vec<u64>,
    /// The values of this rank's rows.
    pub values: Vec<u64>,
    /// The number of values of all ranks.
    pub total: u64,
}

impl Pairs<'_> {
    /// **Collective.** The lists of this rank's rows.
    pub fn lists(self, comm: &dyn Communicator) -> Result<Lists, CommError> {
        let own = self.rows.own();
        let pairs = self.sorted(comm)?;
        let mut counts = vec![0; (own.end - own.start) as usize];
        pairs.iter().for_each(|[row, _]| counts[(row - own.start) as usize] += 1);
        Lists::new(comm, counts, pairs.iter().map(|[_, value]| *value).collect())
    }
}

impl Lists {
    /// **Collective.** Makes lists from pairs of a row and a value, `expected` of them.
    pub fn of(
        comm: &dyn Communicator,
        rows: &Rows,
        expected: usize,
        pairs: impl Iterator<Item = [u64; 2]>,
    ) -> Result<Self, CommError> {
        let mut gathered = Pairs::new(comm, rows, expected);
        pairs.for_each(|pair| gathered.push(pair));
        gathered.lists(comm)
    }

    /// **Collective.** Makes lists from their lengths and all values.
    pub fn new(comm: &dyn Communicator, mut counts: Vec<u64>, values: Vec<u64>) -> Result<Self, CommError> {
        let [first] = comm.exclusive_scan([values.len() as u64])?;
        let [total] = comm.all_reduce_sum_u64([values.len() as u64])?;
        let mut next = first;
        for count in &mut counts {
            next += std::mem::replace(count, next);
        }
        Ok(Self { begins: counts, values, total })
    }

    /// The place of this rank's first value among those of all ranks. Ranks without rows have none.
    pub fn first(&self) -> u64 {
        self.begins.first().copied().unwrap_or_default()
    }

    /// The values of a row of this rank.
    pub fn list(&self, row: usize) -> &[u64] {
        let place = |row: usize| {
            self.begins.get(row).map_or(self.values.len(), |begin| (begin - self.first()) as usize)
        };
        &self.values[place(row)..place(row + 1)]
    }
}
