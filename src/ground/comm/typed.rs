//! Collective operations on slices of plain numbers, for every backend.
//!
//! Numbers travel in the machine's byte order: all ranks of a job must share it, as MPI jobs do.

use super::fold::{key, value_of};
use super::{CommError, Communicator, Fold, pack::numbers};
use crate::ground::comm::Rank;
use bytemuck::{Pod, cast_slice};

impl dyn Communicator + '_ {
    /// **Collective.** Each rank gets what `root` had in `values`.
    pub fn broadcast<T: Pod>(&self, root: Rank, values: &mut Vec<T>) -> Result<(), CommError> {
        let mut bytes = if self.rank() == root { cast_slice(values).to_vec() } else { Vec::new() };
        self.broadcast_bytes(root, &mut bytes)?;
        if self.rank() != root {
            *values = numbers(&bytes);
        }
        Ok(())
    }

    /// **Collective.** `root` gets what each rank sent, by rank; the others get an empty list.
    pub fn gather<T: Pod>(&self, root: Rank, values: &[T]) -> Result<Vec<Vec<T>>, CommError> {
        let messages = self.gather_bytes(root, cast_slice(values))?;
        Ok(messages.iter().map(|bytes| numbers(bytes)).collect())
    }

    /// **Collective.** Each rank gets what each rank sent, by rank.
    pub fn all_gather<T: Pod>(&self, values: &[T]) -> Result<Vec<Vec<T>>, CommError> {
        let messages = self.all_gather_bytes(cast_slice(values))?;
        Ok(messages.iter().map(|bytes| numbers(bytes)).collect())
    }

    /// **Collective.** Each rank gets the one value of each rank, by rank.
    pub fn all_gather_one<T: Pod>(&self, value: T) -> Result<Vec<T>, CommError> {
        Ok(numbers(&self.all_gather_equal_bytes(bytemuck::bytes_of(&value))?))
    }

    /// **Collective.** `root` gives one list per rank; each rank gets its own.
    ///
    /// # Panics
    /// If `root` gives none, or not one for each rank.
    pub fn scatter<T: Pod>(&self, root: Rank, lists: Option<Vec<Vec<T>>>) -> Result<Vec<T>, CommError> {
        let messages = lists.map(|lists| lists.iter().map(|list| cast_slice(list).to_vec()).collect());
        Ok(numbers(&self.scatter_bytes(root, messages)?))
    }

    /// **Collective.** Sparse exchange of lists with some ranks. Received lists come by ascending
    /// sender, several of one sender in sending order.
    pub fn exchange<T: Pod>(&self, lists: Vec<(Rank, Vec<T>)>) -> Result<Vec<(Rank, Vec<T>)>, CommError> {
        let messages = lists.iter().map(|(to, list)| (*to, cast_slice(list).to_vec())).collect();
        let received = self.exchange_bytes(messages)?;
        Ok(received.iter().map(|(from, bytes)| (*from, numbers(bytes))).collect())
    }

    /// **Collective.** Each rank sends one list to each rank and receives one from each, by rank.
    /// Empty lists cost nothing because the exchange is sparse.
    pub fn all_to_all<T: Pod>(&self, lists: Vec<Vec<T>>) -> Result<Vec<Vec<T>>, CommError> {
        assert_eq!(lists.len(), self.size() as usize, "rank {}: one list for each rank", self.rank());
        let some = (0..).zip(lists).filter(|(_, list)| !list.is_empty()).collect();
        let mut received = vec![Vec::new(); self.size() as usize];
        for (from, list) in self.exchange(some)? {
            received[from as usize] = list;
        }
        Ok(received)
    }

    /// **Collective.** The sums over the ranks, entry by entry.
    pub fn all_reduce_sum_u64<const N: usize>(&self, mut values: [u64; N]) -> Result<[u64; N], CommError> {
        self.fold(Fold::Sum, &mut values)?;
        Ok(values)
    }

    /// **Collective.** The largest of the ranks' values, entry by entry.
    pub fn all_reduce_max_u64<const N: usize>(&self, mut values: [u64; N]) -> Result<[u64; N], CommError> {
        self.fold(Fold::Max, &mut values)?;
        Ok(values)
    }

    /// **Collective.** The sums over the ranks, entry by entry, added in rank order: bitwise the
    /// same on every rank and in every run.
    pub fn all_reduce_sum_f64<const N: usize>(&self, values: [f64; N]) -> Result<[f64; N], CommError> {
        let all: Vec<f64> = numbers(&self.all_gather_equal_bytes(cast_slice(&values))?);
        let mut sums = [0.0; N];
        sums.copy_from_slice(&all[..N]);
        for row in all.chunks_exact(N).skip(1) {
            sums.iter_mut().zip(row).for_each(|(sum, value)| *sum += value);
        }
        Ok(sums)
    }

    /// **Collective.** The least of the ranks' values, entry by entry; not-a-number is skipped.
    pub fn all_reduce_min_f64<const N: usize>(&self, values: [f64; N]) -> Result<[f64; N], CommError> {
        Ok(self.all_reduce_max_f64(values.map(|value| -value))?.map(|value| -value))
    }

    /// **Collective.** The largest of the ranks' values, entry by entry; not-a-number is skipped.
    pub fn all_reduce_max_f64<const N: usize>(&self, values: [f64; N]) -> Result<[f64; N], CommError> {
        Ok(self.all_reduce_max_u64(values.map(key))?.map(value_of))
    }

    /// **Collective.** The sums over the ranks before this one, entry by entry; zeros on rank 0.
    pub fn exclusive_scan<const N: usize>(&self, mut values: [u64; N]) -> Result<[u64; N], CommError> {
        self.fold(Fold::SumBefore, &mut values)?;
        Ok(values)
    }
}
