//! A number of ranks that differs from the number of processes: several ranks per process, as
//! threads, or none on some.
//!
//! ```text
//!   process 0: ranks 0 1 2 ─┐                           The first thread of a process, its leader, collects
//!   process 1: ranks 3 4   ─┼─ one communicator         the messages of its ranks, performs the operation
//!   process 2: ranks 5 6 7 ─┘  of processes underneath  with the other leaders, and distributes the results.
//! ```
//! So only one thread of a process communicates with others, as MPI requires. A process without
//! ranks (if there are fewer ranks than processes) serves: before each operation process 0
//! broadcasts which it is, so that all can take part.

use super::pack::{numbers, put, take};
use super::{CommError, Communicator, Fold};
use crate::ground::comm::Rank;
use bytemuck::{cast_slice, cast_slice_mut};
use std::cell::Cell;
use std::marker::PhantomData;
use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// Messages with their destination or source rank.
type Messages = Vec<(Rank, Vec<u8>)>;

/// A collective operation. All ranks that meet must perform the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Operation {
    Barrier,
    Broadcast {
        root: Rank,
    },
    Gather {
        root: Rank,
    },
    AllGather,
    Scatter {
        root: Rank,
    },
    Exchange,
    Fold {
        fold: Fold,
        count: u32,
    },
    Rest,
    /// No more operations follow: idle processes may return.
    End,
}

impl Operation {
    /// A number of its kind, and the root or the count.
    fn code(self) -> [u32; 2] {
        match self {
            Self::Barrier => [0, 0],
            Self::Broadcast { root } => [1, root],
            Self::Gather { root } => [2, root],
            Self::AllGather => [3, 0],
            Self::Scatter { root } => [4, root],
            Self::Exchange => [5, 0],
            Self::End => [6, 0],
            Self::Fold { fold: Fold::Sum, count } => [7, count],
            Self::Fold { fold: Fold::Max, count } => [8, count],
            Self::Fold { fold: Fold::SumBefore, count } => [9, count],
            Self::Rest => [10, 0],
        }
    }

    fn from_code([kind, value]: [u32; 2]) -> Self {
        let (root, count) = (value, value);
        match kind {
            0 => Self::Barrier,
            1 => Self::Broadcast { root },
            2 => Self::Gather { root },
            3 => Self::AllGather,
            4 => Self::Scatter { root },
            5 => Self::Exchange,
            6 => Self::End,
            7 => Self::Fold { fold: Fold::Sum, count },
            8 => Self::Fold { fold: Fold::Max, count },
            9 => Self::Fold { fold: Fold::SumBefore, count },
            10 => Self::Rest,
            _ => panic!("unknown operation {kind}"),
        }
    }
}

/// The distribution of ranks to processes: in blocks of nearly equal size.
#[derive(Clone, Copy)]
struct Deal {
    ranks: u32,
    processes: u32,
}

impl Deal {
    /// The ranks of a process.
    fn of(self, process: Rank) -> Range<Rank> {
        let first =
            |p: u32| (u64::from(p) * u64::from(self.ranks)).div_ceil(u64::from(self.processes)) as u32;
        first(process)..first(process + 1)
    }

    /// The process of a rank.
    fn process(self, rank: Rank) -> Rank {
        (u64::from(rank) * u64::from(self.processes) / u64::from(self.ranks)) as u32
    }

    fn some_are_idle(self) -> bool {
        self.ranks < self.processes
    }
}

/// **Collective** over the processes. Runs `body` on each of `ranks` ranks and returns the results
/// of this process's ranks, by rank.
///
/// # Errors
/// [`CommError`] if another process fails or `ranks` is 0.
///
/// # Panics
/// If a rank of this process panics, so that the launcher ends all processes.
pub fn run<R: Send>(
    outer: &dyn Communicator,
    ranks: u32,
    body: impl Fn(&dyn Communicator) -> R + Sync,
) -> Result<Vec<R>, CommError> {
    if ranks == 0 {
        return Err(CommError::NotStarted { ranks, reason: "there must be at least one".into() });
    }
    let deal = Deal { ranks, processes: outer.size() };
    let own = deal.of(outer.rank());
    if own.is_empty() {
        return serve(outer, deal);
    }
    let meeting = Meeting::new(own.clone());
    let run_rank = |rank: Rank, outer: Option<&dyn Communicator>| {
        let comm = GroupComm { rank, deal, meeting: &meeting, outer, _one_thread: PhantomData };
        let result = catch_unwind(AssertUnwindSafe(|| body(&comm)));
        meeting.leave(rank);
        result
    };
    let results = std::thread::scope(|scope| {
        let spawn = |rank| {
            std::thread::Builder::new().stack_size(STACK).spawn_scoped(scope, move || run_rank(rank, None))
        };
        let others: Result<Vec<_>, _> = own.clone().skip(1).map(&spawn).collect();
        let first = match &others {
            Ok(_) => Ok(run_rank(own.start, Some(outer))),
            Err(error) => {
                own.clone().for_each(|rank| meeting.leave(rank));
                Err(CommError::NotStarted { ranks, reason: error.to_string() })
            }
        };
        let others = others.unwrap_or_default().into_iter().map(|thread| thread.join().unwrap_or_else(Err));
        let others: Vec<_> = others.collect();
        first.map(|first| [first].into_iter().chain(others).collect::<Vec<_>>())
    })?;
    let results: Vec<R> =
        results.into_iter().map(|result| result.unwrap_or_else(|panic| resume_unwind(panic))).collect();
    if deal.some_are_idle() {
        perform(outer, deal, Operation::End, Vec::new(), &mut || true)?;
    }
    Ok(results)
}

/// Stack of a rank's thread in bytes.
const STACK: usize = 4 << 20;

/// A process without ranks takes part in operations until the end.
fn serve<R>(outer: &dyn Communicator, deal: Deal) -> Result<Vec<R>, CommError> {
    loop {
        // The operation is received from process 0.
        if perform(outer, deal, Operation::End, Vec::new(), &mut || true)?.0 == Operation::End {
            return Ok(Vec::new());
        }
    }
}

/// The result of an operation for the ranks of one process.
#[derive(Default)]
struct Delivery {
    /// Read by all ranks: the broadcast message.
    shared: Vec<u8>,
    /// Read by all ranks: messages by rank.
    by_rank: Vec<Vec<u8>>,
    /// For each rank of the process, its own messages.
    own: Vec<Messages>,
}

/// **Collective** over the processes. Performs an operation with the messages of all ranks of this
/// process. Also returns the operation, which an idle process does not know. `is_over` ends a rest
/// and is called on process 0, whose leader is rank 0.
fn perform(
    outer: &dyn Communicator,
    deal: Deal,
    operation: Operation,
    mut brought: Vec<Messages>,
    is_over: &mut dyn FnMut() -> bool,
) -> Result<(Operation, Delivery), CommError> {
    let mut operation = operation;
    if deal.some_are_idle() {
        let mut code = operation.code().to_vec();
        outer.broadcast(0, &mut code)?;
        operation = Operation::from_code([code[0], code[1]]);
    }
    let own = deal.of(outer.rank());
    let mut delivery = Delivery::default();
    // The messages of all ranks of this process in sequence, each with its length.
    let packed = |brought: &[Messages]| {
        let mut message = Vec::new();
        brought.iter().flatten().for_each(|(_, bytes)| put(&mut message, bytes));
        message
    };
    let unpacked = |messages: Vec<Vec<u8>>| {
        let mut all = Vec::new();
        for message in messages {
            let rest = &mut &message[..];
            while !rest.is_empty() {
                all.push(take::<u8>(rest));
            }
        }
        all
    };
    match operation {
        Operation::End => {}
        Operation::Barrier => outer.barrier()?,
        Operation::Rest => outer.rest(is_over)?,
        Operation::Broadcast { root } => {
            let from_root =
                own.contains(&root).then(|| std::mem::take(&mut brought[(root - own.start) as usize]));
            let mut bytes =
                from_root.and_then(|mut messages| messages.pop()).map(|m| m.1).unwrap_or_default();
            outer.broadcast_bytes(deal.process(root), &mut bytes)?;
            delivery.shared = bytes;
        }
        Operation::Gather { root } => {
            let gathered = unpacked(outer.gather_bytes(deal.process(root), &packed(&brought))?);
            delivery.own.resize(own.len(), Vec::new());
            if own.contains(&root) {
                delivery.own[(root - own.start) as usize] = (0..).zip(gathered).collect();
            }
        }
        Operation::AllGather => delivery.by_rank = unpacked(outer.all_gather_bytes(&packed(&brought))?),
        Operation::Scatter { root } => {
            let messages = own.contains(&root).then(|| {
                let all = std::mem::take(&mut brought[(root - own.start) as usize]);
                let of = |process| {
                    let ranks = deal.of(process);
                    let mut message = Vec::new();
                    all.iter().filter(|(to, _)| ranks.contains(to)).for_each(|(_, m)| put(&mut message, m));
                    message
                };
                (0..deal.processes).map(of).collect()
            });
            let scattered = unpacked(vec![outer.scatter_bytes(deal.process(root), messages)?]);
            delivery.own = scattered.into_iter().map(|message| vec![(root, message)]).collect();
        }
        Operation::Exchange => delivery.own = exchange(outer, deal, brought)?,
        Operation::Fold { fold, count } => delivery = fold_all(outer, fold, count, &brought)?,
    }
    Ok((operation, delivery))
}

/// **Collective** over the processes. Sends one message to each process that a local rank writes
/// to.
fn exchange(
    outer: &dyn Communicator,
    deal: Deal,
    brought: Vec<Messages>,
) -> Result<Vec<Messages>, CommError> {
    let own = deal.of(outer.rank());
    let mut to_processes: std::collections::BTreeMap<Rank, Vec<u8>> = Default::default();
    for (from, messages) in own.clone().zip(brought) {
        for (to, bytes) in messages {
            let letter = to_processes.entry(deal.process(to)).or_default();
            put(letter, &[from, to]);
            put(letter, &bytes);
        }
    }
    let mut delivered: Vec<Messages> = vec![Vec::new(); own.len()];
    for (_, letter) in outer.exchange_bytes(to_processes.into_iter().collect())? {
        let rest = &mut &letter[..];
        while !rest.is_empty() {
            let address = take::<u32>(rest);
            delivered[(address[1] - own.start) as usize].push((address[0], take::<u8>(rest)));
        }
    }
    Ok(delivered)
}

/// **Collective** over the processes. Combines the numbers of the ranks of this process, then those
/// of the processes.
fn fold_all(
    outer: &dyn Communicator,
    fold: Fold,
    count: u32,
    brought: &[Messages],
) -> Result<Delivery, CommError> {
    let of_ranks = || brought.iter().flatten().map(|(_, bytes)| numbers::<u64>(bytes));
    let mut total = vec![0; count as usize];
    of_ranks().for_each(|values| fold.add(&mut total, &values));
    outer.fold(fold, &mut total)?;
    let mut delivery = Delivery::default();
    if fold == Fold::SumBefore {
        // `total` is the sum over the ranks of the processes before this one.
        for values in of_ranks() {
            delivery.own.push(vec![(0, cast_slice(&total).to_vec())]);
            fold.add(&mut total, &values);
        }
    } else {
        delivery.shared = cast_slice(&total).to_vec();
    }
    Ok(delivery)
}

/// The synchronisation point of the ranks of a process.
struct Meeting {
    own: Range<Rank>,
    state: Mutex<State>,
    changed: Condvar,
}

struct State {
    /// The number of completed operations.
    round: u64,
    operation: Option<Operation>,
    arrived: usize,
    brought: Vec<Messages>,
    /// The result of the last operation: by rank, the messages it has not collected yet.
    delivery: Result<Delivery, CommError>,
    /// The first rank that panicked or returned.
    gone: Option<Rank>,
}

impl Meeting {
    fn new(own: Range<Rank>) -> Self {
        let brought = vec![Vec::new(); own.len()];
        let delivery = Ok(Delivery::default());
        let state = State { round: 0, operation: None, arrived: 0, brought, delivery, gone: None };
        Self { own, state: Mutex::new(state), changed: Condvar::new() }
    }

    /// Locks the state. Only the leader can panic while it holds the lock, and that ends all ranks.
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn leave(&self, rank: Rank) {
        self.lock().gone.get_or_insert(rank);
        self.changed.notify_all();
    }

    fn wait<'a>(&'a self, state: MutexGuard<'a, State>) -> MutexGuard<'a, State> {
        self.changed.wait(state).unwrap_or_else(PoisonError::into_inner)
    }
}

/// One of the ranks of a process.
struct GroupComm<'a> {
    rank: Rank,
    deal: Deal,
    meeting: &'a Meeting,
    /// The communicator of the processes, on the leader.
    outer: Option<&'a dyn Communicator>,
    /// A rank is one thread: this makes the type not `Sync`.
    _one_thread: PhantomData<Cell<()>>,
}

impl GroupComm<'_> {
    /// Contributes messages to an operation and returns this rank's result.
    fn meet<T>(
        &self,
        operation: Operation,
        messages: Messages,
        pick_up: impl FnOnce(&mut Delivery, usize) -> T,
    ) -> Result<T, CommError> {
        self.meet_until(&mut || true, operation, messages, pick_up)
    }

    /// The same for an operation that `is_over` ends on rank 0.
    fn meet_until<T>(
        &self,
        is_over: &mut dyn FnMut() -> bool,
        operation: Operation,
        messages: Messages,
        pick_up: impl FnOnce(&mut Delivery, usize) -> T,
    ) -> Result<T, CommError> {
        let place = (self.rank - self.meeting.own.start) as usize;
        let count = self.meeting.own.len();
        let mut state = self.meeting.lock();
        let round = state.round;
        let wanted = *state.operation.get_or_insert(operation);
        assert_eq!(wanted, operation, "rank {} does what others do not", self.rank);
        state.brought[place] = messages;
        state.arrived += 1;
        self.meeting.changed.notify_all();
        if let Some(outer) = self.outer {
            while state.arrived < count {
                // A rank that returned cannot take part, so the process must end, and with it all
                // others.
                assert!(state.gone.is_none(), "rank {} failed", state.gone.unwrap_or(self.rank));
                state = self.meeting.wait(state);
            }
            let brought = std::mem::replace(&mut state.brought, vec![Vec::new(); count]);
            // The other ranks sleep meanwhile.
            state.delivery =
                perform(outer, self.deal, operation, brought, is_over).map(|(_, delivery)| delivery);
            (state.arrived, state.operation) = (0, None);
            state.round += 1;
            self.meeting.changed.notify_all();
        } else {
            while state.round == round {
                if let Some(gone) = state.gone {
                    return Err(CommError::RankFailed(gone));
                }
                state = self.meeting.wait(state);
            }
        }
        // No later round can complete before this rank has reached it.
        state.delivery.as_mut().map(|delivery| pick_up(delivery, place)).map_err(|error| error.clone())
    }
}

impl Communicator for GroupComm<'_> {
    fn rank(&self) -> Rank {
        self.rank
    }

    fn size(&self) -> u32 {
        self.deal.ranks
    }

    fn barrier(&self) -> Result<(), CommError> {
        self.meet(Operation::Barrier, Vec::new(), |_, _| ())
    }

    fn rest(&self, is_over: &mut dyn FnMut() -> bool) -> Result<(), CommError> {
        self.meet_until(is_over, Operation::Rest, Vec::new(), |_, _| ())
    }

    fn broadcast_bytes(&self, root: Rank, bytes: &mut Vec<u8>) -> Result<(), CommError> {
        if self.rank == root {
            let messages = vec![(root, bytes.clone())];
            return self.meet(Operation::Broadcast { root }, messages, |_, _| ());
        }
        *bytes =
            self.meet(Operation::Broadcast { root }, Vec::new(), |delivery, _| delivery.shared.clone())?;
        Ok(())
    }

    fn gather_bytes(&self, root: Rank, bytes: &[u8]) -> Result<Vec<Vec<u8>>, CommError> {
        self.meet(Operation::Gather { root }, vec![(root, bytes.to_vec())], |delivery, place| {
            std::mem::take(&mut delivery.own[place]).into_iter().map(|(_, bytes)| bytes).collect()
        })
    }

    fn all_gather_bytes(&self, bytes: &[u8]) -> Result<Vec<Vec<u8>>, CommError> {
        self.meet(Operation::AllGather, vec![(0, bytes.to_vec())], |delivery, _| delivery.by_rank.clone())
    }

    fn all_gather_equal_bytes(&self, bytes: &[u8]) -> Result<Vec<u8>, CommError> {
        self.meet(Operation::AllGather, vec![(0, bytes.to_vec())], |delivery, _| delivery.by_rank.concat())
    }

    fn scatter_bytes(&self, root: Rank, messages: Option<Vec<Vec<u8>>>) -> Result<Vec<u8>, CommError> {
        let messages: Messages = if self.rank == root {
            let messages = messages.expect("the root of a scatter gives the messages");
            assert_eq!(messages.len(), self.size() as usize, "rank {root} scatters one message to each rank");
            (0..).zip(messages).collect()
        } else {
            Vec::new()
        };
        self.meet(Operation::Scatter { root }, messages, |delivery, place| {
            delivery.own[place].pop().map(|(_, bytes)| bytes).unwrap_or_default()
        })
    }

    fn exchange_bytes(&self, messages: Vec<(Rank, Vec<u8>)>) -> Result<Vec<(Rank, Vec<u8>)>, CommError> {
        for (to, _) in &messages {
            assert!(*to < self.size(), "rank {} names rank {to} of {}", self.rank, self.size());
        }
        self.meet(Operation::Exchange, messages, |delivery, place| std::mem::take(&mut delivery.own[place]))
    }

    fn fold(&self, fold: Fold, numbers: &mut [u64]) -> Result<(), CommError> {
        let count = u32::try_from(numbers.len()).expect("a few numbers");
        let own = vec![(0, cast_slice(numbers).to_vec())];
        self.meet(Operation::Fold { fold, count }, own, |delivery, place| {
            let result = match fold {
                Fold::Sum | Fold::Max => &delivery.shared,
                Fold::SumBefore => &delivery.own[place][0].1,
            };
            cast_slice_mut(numbers).copy_from_slice(result);
        })
    }
}

#[cfg(test)]
#[path = "grouped_tests.rs"]
mod tests;
