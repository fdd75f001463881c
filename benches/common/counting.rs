//! A communicator that counts its calls and bytes.

use std::cell::Cell;
use tetmill::comm::{CommError, Communicator, Fold, Rank};

/// A communicator that counts its calls and bytes.
pub struct Counting<'a> {
    inner: &'a dyn Communicator,
    calls: Cell<u64>,
    sent: Cell<u64>,
    received: Cell<u64>,
}

impl<'a> Counting<'a> {
    /// Counts what goes through `inner`.
    pub fn new(inner: &'a dyn Communicator) -> Self {
        Self { inner, calls: Cell::new(0), sent: Cell::new(0), received: Cell::new(0) }
    }

    fn count(&self, sent: usize, received: usize) {
        self.calls.set(self.calls.get() + 1);
        self.sent.set(self.sent.get() + sent as u64);
        self.received.set(self.received.get() + received as u64);
    }

    /// Calls, bytes sent and bytes received since the last time.
    pub fn taken(&self) -> [u64; 3] {
        [&self.calls, &self.sent, &self.received].map(|cell| cell.replace(0))
    }
}

fn total(messages: &[Vec<u8>]) -> usize {
    messages.iter().map(Vec::len).sum()
}

impl Communicator for Counting<'_> {
    fn rank(&self) -> Rank {
        self.inner.rank()
    }
    fn size(&self) -> u32 {
        self.inner.size()
    }
    fn barrier(&self) -> Result<(), CommError> {
        self.count(0, 0);
        self.inner.barrier()
    }
    fn broadcast_bytes(&self, root: Rank, bytes: &mut Vec<u8>) -> Result<(), CommError> {
        self.inner.broadcast_bytes(root, bytes)?;
        let mine = self.rank() == root;
        self.count(if mine { bytes.len() } else { 0 }, if mine { 0 } else { bytes.len() });
        Ok(())
    }
    fn gather_bytes(&self, root: Rank, bytes: &[u8]) -> Result<Vec<Vec<u8>>, CommError> {
        let all = self.inner.gather_bytes(root, bytes)?;
        self.count(bytes.len(), total(&all));
        Ok(all)
    }
    fn all_gather_bytes(&self, bytes: &[u8]) -> Result<Vec<Vec<u8>>, CommError> {
        let all = self.inner.all_gather_bytes(bytes)?;
        self.count(bytes.len(), total(&all));
        Ok(all)
    }
    fn all_gather_equal_bytes(&self, bytes: &[u8]) -> Result<Vec<u8>, CommError> {
        let all = self.inner.all_gather_equal_bytes(bytes)?;
        self.count(bytes.len(), all.len());
        Ok(all)
    }
    fn scatter_bytes(&self, root: Rank, messages: Option<Vec<Vec<u8>>>) -> Result<Vec<u8>, CommError> {
        let sent = messages.as_deref().map_or(0, total);
        let own = self.inner.scatter_bytes(root, messages)?;
        self.count(sent, own.len());
        Ok(own)
    }
    fn exchange_bytes(&self, messages: Vec<(Rank, Vec<u8>)>) -> Result<Vec<(Rank, Vec<u8>)>, CommError> {
        let bytes = |messages: &[(Rank, Vec<u8>)]| messages.iter().map(|m| m.1.len()).sum();
        let sent = bytes(&messages);
        let got = self.inner.exchange_bytes(messages)?;
        self.count(sent, bytes(&got));
        Ok(got)
    }
    fn fold(&self, fold: Fold, numbers: &mut [u64]) -> Result<(), CommError> {
        self.count(size_of_val(numbers), size_of_val(numbers));
        self.inner.fold(fold, numbers)
    }
}
