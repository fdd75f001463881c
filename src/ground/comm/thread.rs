//! Ranks as threads of this process: no system package, any number of ranks.
//!
//! All collective operations are one step: each rank deposits its messages; the last one to arrive
//! sorts them by receiver and wakes the others, which sleep on a condition variable. A rank that
//! panics or returns early wakes them too, with an error.
//!
//! All ranks share rayon's global pool but are not threads of it, so a waiting rank occupies no
//! worker.

use super::pack::numbers;
use super::{CommError, Communicator, Fold};
use crate::ground::comm::Rank;
use crate::ground::error::HasKind;
use bytemuck::{cast_slice, cast_slice_mut};
use std::cell::Cell;
use std::marker::PhantomData;
use std::ops::Deref;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;

/// Stack of a rank's thread in bytes. Only address space is reserved: 1024 ranks fit in 4 GiB.
const STACK: usize = 4 << 20;

/// The maximum number of ranks. With twice as many, threads and guard pages exceed Linux's limit of
/// mappings per process, which ends it.
pub const MOST_RANKS: u32 = 8192;

/// Messages with their destination or source rank.
type Messages = Vec<(Rank, Vec<u8>)>;

/// A collective operation. All ranks that meet must perform the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Operation {
    Barrier,
    Broadcast { root: Rank },
    Gather { root: Rank },
    AllGather,
    AllGatherEqual { bytes: usize },
    Fold { fold: Fold, count: usize },
    Scatter { root: Rank },
    Exchange,
}

/// The messages sorted by receiver.
#[derive(Default)]
struct Delivery {
    /// Read by all ranks: a broadcast message, or those of all ranks concatenated.
    shared: Vec<u8>,
    /// Read by all ranks: messages by rank.
    by_rank: Vec<Vec<u8>>,
    /// For each rank, its own messages.
    own: Vec<Mutex<Messages>>,
}

/// Sorts the messages of all ranks, given by sender, by receiver.
fn deliver(operation: Operation, deposits: Vec<Messages>) -> Delivery {
    let size = deposits.len();
    let mut own: Vec<Messages> = Vec::new();
    let mut delivery = Delivery::default();
    let sent = (0..).zip(deposits).flat_map(|(from, messages)| messages.into_iter().map(move |m| (from, m)));
    match operation {
        Operation::Barrier => {}
        Operation::Broadcast { .. } => {
            delivery.shared = sent.map(|(_, (_, bytes))| bytes).next().unwrap_or_default()
        }
        Operation::AllGather => delivery.by_rank = sent.map(|(_, (_, bytes))| bytes).collect(),
        Operation::AllGatherEqual { bytes } => {
            delivery.shared.reserve(bytes * size);
            sent.for_each(|(_, (_, bytes))| delivery.shared.extend(bytes));
        }
        Operation::Fold { fold, count } => {
            let mut total = vec![0; count];
            for (_, (_, bytes)) in sent {
                if fold == Fold::SumBefore {
                    own.push(vec![(0, cast_slice(&total).to_vec())]);
                }
                fold.add(&mut total, &numbers(&bytes));
            }
            delivery.shared = cast_slice(&total).to_vec();
        }
        Operation::Gather { .. } | Operation::Scatter { .. } | Operation::Exchange => {
            own.resize(size, Vec::new());
            sent.for_each(|(from, (to, bytes))| own[to as usize].push((from, bytes)));
        }
    }
    delivery.own = own.into_iter().map(Mutex::new).collect();
    delivery
}

/// The state that the ranks share.
struct State {
    /// Rounds completed.
    round: u64,
    /// The operation of the first rank to arrive in this round, and that rank.
    operation: Option<(Operation, Rank)>,
    /// The number of ranks that have arrived in this round.
    arrived: u32,
    /// Their messages.
    deposits: Vec<Messages>,
    /// The result of the last completed round. No later round can complete before all ranks have
    /// read it.
    delivery: Arc<Delivery>,
    /// The first rank that panicked or returned.
    gone: Option<Rank>,
    /// The first rank that panicked; later ones may panic only as a consequence.
    panicked: Option<Rank>,
}

/// A group of ranks in one process.
struct World {
    size: u32,
    state: Mutex<State>,
    changed: Condvar,
}

impl World {
    fn new(size: u32) -> Self {
        let state = State {
            round: 0,
            operation: None,
            arrived: 0,
            deposits: vec![Vec::new(); size as usize],
            delivery: Arc::default(),
            gone: None,
            panicked: None,
        };
        Self { size, state: Mutex::new(state), changed: Condvar::new() }
    }

    /// Locks the state; no rank panics while it holds the lock.
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Wakes the other ranks and marks `rank` as gone.
    fn leave(&self, rank: Rank, panicked: bool) {
        let mut state = self.lock();
        state.gone.get_or_insert(rank);
        if panicked {
            state.panicked.get_or_insert(rank);
        }
        drop(state);
        self.changed.notify_all();
    }
}

/// One rank of a group of threads.
pub struct ThreadComm {
    rank: Rank,
    world: Arc<World>,
    /// A rank is one thread: this makes the type not `Sync`.
    _one_thread: PhantomData<Cell<()>>,
}

/// *Local.* A group of one rank, for serial use of parallel functions.
pub fn alone() -> ThreadComm {
    ThreadComm { rank: 0, world: Arc::new(World::new(1)), _one_thread: PhantomData }
}

/// The stack size that the threads of rayon's pool should have if many ranks share it; only the
/// used part takes memory. A thread that waits for a part of one rank's work takes up work of
/// another rank meanwhile, recursively: with 64 ranks the default 2 MiB have overflowed. The
/// program `tetmill` sets it; other programs that run ranks should too
/// (`rayon::ThreadPoolBuilder::stack_size`).
pub const POOL_STACK: usize = 256 << 20;

/// Runs `body` on each of `ranks` threads and returns their results by rank.
///
/// With one rank `body` runs on the calling thread.
///
/// # Errors
/// [`CommError::RankFailed`] with the rank that panicked first (its message goes to stderr as
/// usual); [`CommError::NotStarted`] if `ranks` is 0 or the system cannot start the threads.
pub fn run<R: Send>(ranks: u32, body: impl Fn(&dyn Communicator) -> R + Sync) -> Result<Vec<R>, CommError> {
    let not_started = |reason: String| CommError::NotStarted { ranks, reason };
    if ranks == 0 {
        return Err(not_started("there must be at least one".into()));
    }
    if ranks > MOST_RANKS {
        return Err(not_started(format!("ranks are threads here, at most {MOST_RANKS}: take MPI's")));
    }
    let world = Arc::new(World::new(ranks));
    let run_rank = |rank| {
        let comm = ThreadComm { rank, world: Arc::clone(&world), _one_thread: PhantomData };
        let result = catch_unwind(AssertUnwindSafe(|| body(&comm))).ok();
        world.leave(rank, result.is_none());
        result
    };
    let results = if ranks == 1 {
        vec![run_rank(0)]
    } else {
        let (run_rank, world) = (&run_rank, &world);
        thread::scope(|scope| {
            let mut threads = Vec::with_capacity(ranks as usize);
            for rank in 0..ranks {
                let builder = thread::Builder::new().name(format!("rank {rank}")).stack_size(STACK);
                match builder.spawn_scoped(scope, move || run_rank(rank)) {
                    Ok(thread) => threads.push(thread),
                    Err(error) => {
                        world.leave(rank, false);
                        return Err(not_started(error.to_string()));
                    }
                }
            }
            // Panics of ranks were caught above, so any panic here is a bug in this file.
            Ok(threads.into_iter().map(|t| t.join().unwrap_or_else(|panic| resume_unwind(panic))).collect())
        })?
    };
    if let Some(rank) = world.lock().panicked {
        return Err(CommError::RankFailed(rank));
    }
    Ok(results.into_iter().flatten().collect())
}

/// [`run`] for functions that return a `Result`: the results by rank, or the error of the run.
///
/// If several ranks have an error, it is that of the lowest rank with an error of its own. A rank
/// that stopped because of another one ([`CommError::Elsewhere`], [`CommError::RankFailed`]) only
/// has the text of that one's error.
///
/// # Errors
/// Those of `body` and of [`run`].
pub fn try_run<T, E>(ranks: u32, body: impl Fn(&dyn Communicator) -> Result<T, E> + Sync) -> Result<Vec<T>, E>
where
    T: Send,
    E: HasKind + From<CommError> + Send,
{
    let (mut values, mut failure) = (Vec::with_capacity(ranks as usize), None::<E>);
    for result in run(ranks, body)? {
        match result {
            Ok(value) => values.push(value),
            Err(error) if failure.as_ref().is_none_or(|f| f.is_elsewhere() && !error.is_elsewhere()) => {
                failure = Some(error);
            }
            Err(_) => {}
        }
    }
    failure.map_or(Ok(values), Err)
}

impl ThreadComm {
    /// Deposits messages, waits for the other ranks, and returns what was made of all of them.
    ///
    /// # Panics
    /// If another rank is in a different operation: the ranks' programs have gone separate ways.
    fn meet(&self, operation: Operation, messages: Messages) -> Result<Arc<Delivery>, CommError> {
        let mut state = self.world.lock();
        if let Some(rank) = state.gone {
            return Err(CommError::RankFailed(rank));
        }
        let (expected, first) = *state.operation.get_or_insert((operation, self.rank));
        if operation != expected {
            drop(state);
            panic!("rank {} is in {operation:?} where rank {first} is in {expected:?}", self.rank);
        }
        state.deposits[self.rank as usize] = messages;
        state.arrived += 1;
        if state.arrived == self.world.size {
            let deposits = std::mem::replace(&mut state.deposits, vec![Vec::new(); self.world.size as usize]);
            state.delivery = Arc::new(deliver(operation, deposits));
            state.operation = None;
            state.arrived = 0;
            state.round += 1;
            self.world.changed.notify_all();
        } else {
            let round = state.round;
            while state.round == round {
                if let Some(rank) = state.gone {
                    return Err(CommError::RankFailed(rank));
                }
                state = self.world.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
            }
        }
        Ok(Arc::clone(&state.delivery))
    }

    /// Takes what was delivered to this rank alone.
    fn own(&self, delivery: &Delivery) -> Messages {
        std::mem::take(&mut delivery.own[self.rank as usize].lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// # Panics
    /// If there is no such rank.
    fn expect_rank(&self, rank: Rank) {
        assert!(rank < self.world.size, "rank {} names rank {rank} of {}", self.rank, self.world.size);
    }
}

impl Deref for ThreadComm {
    type Target = dyn Communicator;

    fn deref(&self) -> &Self::Target {
        self
    }
}

impl Communicator for ThreadComm {
    fn rank(&self) -> Rank {
        self.rank
    }

    fn size(&self) -> u32 {
        self.world.size
    }

    fn barrier(&self) -> Result<(), CommError> {
        self.meet(Operation::Barrier, Vec::new()).map(drop)
    }

    fn broadcast_bytes(&self, root: Rank, bytes: &mut Vec<u8>) -> Result<(), CommError> {
        self.expect_rank(root);
        let sent = if self.rank == root { vec![(root, bytes.clone())] } else { Vec::new() };
        let delivery = self.meet(Operation::Broadcast { root }, sent)?;
        if self.rank != root {
            bytes.clone_from(&delivery.shared);
        }
        Ok(())
    }

    fn gather_bytes(&self, root: Rank, bytes: &[u8]) -> Result<Vec<Vec<u8>>, CommError> {
        self.expect_rank(root);
        let delivery = self.meet(Operation::Gather { root }, vec![(root, bytes.to_vec())])?;
        Ok(self.own(&delivery).into_iter().map(|(_, bytes)| bytes).collect())
    }

    fn all_gather_bytes(&self, bytes: &[u8]) -> Result<Vec<Vec<u8>>, CommError> {
        let delivery = self.meet(Operation::AllGather, vec![(self.rank, bytes.to_vec())])?;
        Ok(delivery.by_rank.clone())
    }

    fn all_gather_equal_bytes(&self, bytes: &[u8]) -> Result<Vec<u8>, CommError> {
        let operation = Operation::AllGatherEqual { bytes: bytes.len() };
        let delivery = self.meet(operation, vec![(self.rank, bytes.to_vec())])?;
        Ok(delivery.shared.clone())
    }

    fn scatter_bytes(&self, root: Rank, messages: Option<Vec<Vec<u8>>>) -> Result<Vec<u8>, CommError> {
        self.expect_rank(root);
        let sent: Messages = if self.rank == root {
            let messages = messages.expect("the root of a scatter gives the messages");
            assert_eq!(messages.len(), self.size() as usize, "rank {root} scatters one message to each rank");
            (0..).zip(messages).collect()
        } else {
            Vec::new()
        };
        let delivery = self.meet(Operation::Scatter { root }, sent)?;
        Ok(self.own(&delivery).pop().map(|(_, bytes)| bytes).unwrap_or_default())
    }

    fn exchange_bytes(&self, messages: Vec<(Rank, Vec<u8>)>) -> Result<Vec<(Rank, Vec<u8>)>, CommError> {
        messages.iter().for_each(|&(to, _)| self.expect_rank(to));
        let delivery = self.meet(Operation::Exchange, messages)?;
        Ok(self.own(&delivery))
    }

    fn fold(&self, fold: Fold, numbers: &mut [u64]) -> Result<(), CommError> {
        let operation = Operation::Fold { fold, count: numbers.len() };
        let delivery = self.meet(operation, vec![(self.rank, cast_slice(numbers).to_vec())])?;
        match fold {
            Fold::Sum | Fold::Max => cast_slice_mut(numbers).copy_from_slice(&delivery.shared),
            Fold::SumBefore => {
                self.own(&delivery).iter().for_each(|(_, sum)| cast_slice_mut(numbers).copy_from_slice(sum));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
#[path = "thread_tests.rs"]
mod tests;
