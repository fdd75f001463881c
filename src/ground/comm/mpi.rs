//! Ranks as processes of an MPI job (feature `mpi`), the only file that uses MPI.
//!
//! Messages are bytes: derived datatypes are several times slower in some MPI libraries, and counts
//! are `i32`. So a long message is sent in **chunks** of at most a limit; the last one is shorter
//! than the limit (possibly empty), which marks the end. MPI keeps the order of messages between
//! two ranks.
//!
//! MPI cannot continue without a rank. So no function here returns [`CommError::RankFailed`]. With
//! [`run`] a rank that panics ends the job. A program that initialises MPI itself must call
//! [`abort_on_panic`] for that: otherwise the other ranks wait for the rank without end, and so
//! does the rank itself in `MPI_Finalize`.

/// The crate whose communicators [`duplicate_of`] takes.
pub use ::mpi as rsmpi;

use super::launch::{Launch, LaunchError, this_process};
use super::{CommError, Communicator, Fold, REST, sleep_until};
use crate::ground::comm::Rank;
use mpi::collective::{CommunicatorCollectives, SystemOperation};
use mpi::datatype::PartitionMut;
use mpi::environment::{Threading, is_finalized, is_initialized, threading_support};
use mpi::point_to_point::{Destination, Source};
use mpi::request::multiple_scope;
use mpi::topology::{Communicator as _, SimpleCommunicator};
use mpi::traits::Root;
use std::cell::Cell;
use std::collections::BTreeMap;
use std::ops::Deref;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// The longest chunk in bytes: well below the 2³¹ that MPI can count, displacements included.
const CHUNK: usize = 1 << 30;

/// Exit status of a job in which a rank failed.
const RANK_FAILED: i32 = 5;

/// Tag of gathered and scattered messages.
const TAG_ROOTED: i32 = 1;

/// Tags of exchanges, used alternately: a rank can be one exchange ahead of another, but never two.
const TAG_EXCHANGE: [i32; 2] = [2, 3];

/// *Local.* Whether a launcher (`mpirun`, `srun`, ...) started this process as one of several
/// ranks.
pub fn launched() -> bool {
    this_process() != Launch::Alone
}

/// Initialises MPI, runs `body` on this rank, and finalises MPI. Without a launcher there is one
/// rank.
///
/// If `body` panics, the whole job ends with status 5 after the panic's message, because the other
/// ranks could only wait.
///
/// # Errors
/// [`LaunchError`] if MPI is not available, or was initialised before in this process.
pub fn run<R>(body: impl FnOnce(&dyn Communicator) -> R) -> Result<R, LaunchError> {
    run_with_chunks(CHUNK, body)
}

/// [`run`] with a lower limit for chunks, in bytes: for tests.
#[doc(hidden)]
pub fn run_with_chunks<R>(chunk: usize, body: impl FnOnce(&dyn Communicator) -> R) -> Result<R, LaunchError> {
    assert!((1..=CHUNK).contains(&chunk), "chunks of {chunk} bytes");
    // Rayon's threads run in addition to the one that calls MPI.
    let (universe, threading) =
        mpi::initialize_with_threading(Threading::Funneled).ok_or(LaunchError::AlreadyInitialised)?;
    if threading < Threading::Funneled {
        return Err(LaunchError::NoThreads);
    }
    let world = universe.world();
    let comm = MpiComm { chunk, exchanges: Cell::new(0), world: Some(world) };
    match catch_unwind(AssertUnwindSafe(|| body(&comm))) {
        Ok(result) => Ok(result),
        Err(_) => end_after_panic(comm.world()),
    }
}

/// Ends the job after a panic, whose message is on the standard error.
fn end_after_panic(world: &SimpleCommunicator) -> ! {
    eprintln!("rank {} panicked: the job ends", world.rank());
    abort(world, RANK_FAILED)
}

fn abort(world: &SimpleCommunicator, status: i32) -> ! {
    // The launcher drops output that it has not forwarded yet when it ends the job.
    std::thread::sleep(BEFORE_ABORT);
    world.abort(status)
}

/// *Local.* Ends all processes of the job with this exit status, without unwinding. Returns if MPI
/// is not initialised.
///
/// For failures after which this process cannot take part in an agreement, e.g. if memory runs out.
pub fn end_job(status: i32) {
    if is_initialized() && !is_finalized() {
        abort(&SimpleCommunicator::world(), status);
    }
}

/// *Local.* Makes panics of this process end the whole job with status 5, after the panic's
/// message: for programs that initialise MPI themselves. [`run`] does not need it.
///
/// Installs a panic hook, which first calls the hook before it. Every panic of every thread ends
/// the job while MPI is initialised, including panics that the program would catch. Call it on all
/// ranks, before or after MPI is initialised.
pub fn abort_on_panic() {
    let report = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        report(panic);
        if is_initialized() && !is_finalized() {
            end_after_panic(&SimpleCommunicator::world());
        }
    }));
}

/// **Collective.** The communicator for a program that initialised MPI itself: a duplicate of the
/// program's, so that their messages do not mix.
///
/// MPI must have been initialised by the calling thread, with at least `MPI_THREAD_FUNNELED`,
/// because meshing uses other threads too. The communicator cannot be used after MPI is finalised;
/// it may be dropped then.
///
/// A rank that panics does not end the job unless [`abort_on_panic`] was called: the other ranks
/// wait for it.
///
/// ```no_run
/// use tetmill::comm::mpi::{abort_on_panic, duplicate_of, rsmpi};
/// # use tetmill::{Geometry, Mesher};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// abort_on_panic();
/// let (universe, _) = rsmpi::initialize_with_threading(rsmpi::Threading::Funneled).expect("MPI");
/// let comm = duplicate_of(&universe.world())?;
/// # let part = Geometry::from_file("part.geo")?;
/// let mesh = Mesher::new().levels(3).generate_on(&comm, Some(&part))?;
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// [`LaunchError::NoThreads`] if MPI was initialised with less than `MPI_THREAD_FUNNELED`.
pub fn duplicate_of(communicator: &impl mpi::traits::Communicator) -> Result<MpiComm, LaunchError> {
    if threading_support() < Threading::Funneled {
        return Err(LaunchError::NoThreads);
    }
    Ok(MpiComm { chunk: CHUNK, exchanges: Cell::new(0), world: Some(communicator.duplicate()) })
}

/// Time for the launcher to forward a last message; without it, about one run in thirty lost the
/// message.
const BEFORE_ABORT: std::time::Duration = std::time::Duration::from_millis(300);

/// One rank of an MPI job.
pub struct MpiComm {
    /// `None` only while it is dropped.
    world: Option<SimpleCommunicator>,
    /// The longest chunk in bytes.
    chunk: usize,
    /// The number of exchanges so far.
    exchanges: Cell<usize>,
}

/// MPI's number of a rank.
fn number(rank: Rank) -> i32 {
    i32::try_from(rank).expect("MPI counts ranks by i32")
}

/// The rank of MPI's number.
fn rank_of(number: i32) -> Rank {
    Rank::try_from(number).expect("MPI's ranks are not negative")
}

impl Drop for MpiComm {
    /// Frees the communicator, unless MPI is finalised: it must not be called then.
    fn drop(&mut self) {
        if is_finalized() {
            std::mem::forget(self.world.take());
        }
    }
}

impl Deref for MpiComm {
    type Target = dyn Communicator;

    fn deref(&self) -> &Self::Target {
        self
    }
}

impl MpiComm {
    fn world(&self) -> &SimpleCommunicator {
        self.world.as_ref().expect("taken by `drop` only")
    }

    /// The chunks of a message, of which only the last is shorter than the limit.
    fn chunks<'a>(&self, message: &'a [u8]) -> impl Iterator<Item = &'a [u8]> + use<'a> {
        let end = if message.len().is_multiple_of(self.chunk) { Some(&message[..0]) } else { None };
        message.chunks(self.chunk).chain(end)
    }

    fn send(&self, to: Rank, message: &[u8]) {
        let process = self.world().process_at_rank(number(to));
        self.chunks(message).for_each(|chunk| process.send_with_tag(chunk, TAG_ROOTED));
    }

    fn receive(&self, from: Rank) -> Vec<u8> {
        let process = self.world().process_at_rank(number(from));
        let mut message = Vec::new();
        loop {
            let (chunk, _) = process.receive_vec_with_tag::<u8>(TAG_ROOTED);
            let is_last = chunk.len() < self.chunk;
            append(&mut message, chunk);
            if is_last {
                return message;
            }
        }
    }

    /// Receives one chunk of an exchange, if one is there.
    fn receive_chunk(&self, tag: i32, inbox: &mut Inbox) {
        let Some((message, status)) = self.world().any_process().immediate_matched_probe_with_tag(tag) else {
            std::thread::yield_now();
            return;
        };
        let mut chunk = vec![0; status.count(u8_datatype()) as usize];
        message.matched_receive_into(&mut chunk[..]);
        let is_last = chunk.len() < self.chunk;
        let letters = inbox.entry(rank_of(status.source_rank())).or_default();
        append(&mut letters.incomplete, chunk);
        if is_last {
            letters.complete.push(std::mem::take(&mut letters.incomplete));
        }
    }
}

/// The messages received from one rank in an exchange.
#[derive(Default)]
struct Received {
    complete: Vec<Vec<u8>>,
    incomplete: Vec<u8>,
}

/// Received messages, by sender.
type Inbox = BTreeMap<Rank, Received>;

/// Appends a chunk; moves it without a copy if the message is empty.
fn append(message: &mut Vec<u8>, chunk: Vec<u8>) {
    if message.is_empty() { *message = chunk } else { message.extend(chunk) }
}

fn u8_datatype() -> mpi::datatype::SystemDatatype {
    use mpi::datatype::Equivalence;
    u8::equivalent_datatype()
}

impl Communicator for MpiComm {
    fn rank(&self) -> Rank {
        rank_of(self.world().rank())
    }

    fn size(&self) -> u32 {
        rank_of(self.world().size())
    }

    fn barrier(&self) -> Result<(), CommError> {
        self.world().barrier();
        Ok(())
    }

    /// MPI libraries wait busily in a barrier, so a nonblocking one is tested now and then.
    fn rest(&self, is_over: &mut dyn FnMut() -> bool) -> Result<(), CommError> {
        sleep_until(self.rank(), is_over);
        let mut barrier = self.world().immediate_barrier();
        while let Err(not_yet) = barrier.test() {
            barrier = not_yet;
            std::thread::sleep(REST);
        }
        Ok(())
    }

    fn broadcast_bytes(&self, root: Rank, bytes: &mut Vec<u8>) -> Result<(), CommError> {
        let process = self.world().process_at_rank(number(root));
        let mut length = bytes.len() as u64;
        process.broadcast_into(&mut length);
        // The root has this length already.
        bytes.resize(length as usize, 0);
        bytes.chunks_mut(self.chunk).for_each(|chunk| process.broadcast_into(chunk));
        Ok(())
    }

    fn gather_bytes(&self, root: Rank, bytes: &[u8]) -> Result<Vec<Vec<u8>>, CommError> {
        if self.rank() != root {
            self.send(root, bytes);
            return Ok(Vec::new());
        }
        let from = |rank| if rank == root { bytes.to_vec() } else { self.receive(rank) };
        Ok((0..self.size()).map(from).collect())
    }

    fn all_gather_bytes(&self, bytes: &[u8]) -> Result<Vec<Vec<u8>>, CommError> {
        let mut lengths = vec![0u64; self.size() as usize];
        self.world().all_gather_into(&(bytes.len() as u64), &mut lengths[..]);
        let total: u64 = lengths.iter().sum();
        if total == 0 {
            return Ok(vec![Vec::new(); lengths.len()]);
        }
        if total > self.chunk as u64 {
            return (0..self.size())
                .map(|rank| {
                    let mut message = if rank == self.rank() { bytes.to_vec() } else { Vec::new() };
                    self.broadcast_bytes(rank, &mut message).map(|()| message)
                })
                .collect();
        }
        // The total is below the limit, which i32 can count.
        let counts: Vec<i32> = lengths.iter().map(|&length| length as i32).collect();
        let starts = counts.iter().scan(0, |end, count| Some(std::mem::replace(end, *end + count)));
        let mut all = vec![0u8; total as usize];
        let mut parts = PartitionMut::new(&mut all[..], &counts[..], starts.collect::<Vec<i32>>());
        // An empty slice may have address 1, which Open MPI takes for MPI_IN_PLACE: pass a valid
        // address.
        let bytes = if bytes.is_empty() { &[0u8][..0] } else { bytes };
        self.world().all_gather_varcount_into(bytes, &mut parts);
        let mut rest = &all[..];
        let mut next = |length: u64| {
            let (message, after) = rest.split_at(length as usize);
            rest = after;
            message.to_vec()
        };
        Ok(lengths.into_iter().map(&mut next).collect())
    }

    fn all_gather_equal_bytes(&self, bytes: &[u8]) -> Result<Vec<u8>, CommError> {
        if bytes.is_empty() {
            return Ok(Vec::new());
        }
        if bytes.len() * self.size() as usize > self.chunk {
            return Ok(self.all_gather_bytes(bytes)?.concat());
        }
        let mut all = vec![0; bytes.len() * self.size() as usize];
        self.world().all_gather_into(bytes, &mut all[..]);
        Ok(all)
    }

    fn scatter_bytes(&self, root: Rank, messages: Option<Vec<Vec<u8>>>) -> Result<Vec<u8>, CommError> {
        if self.rank() != root {
            return Ok(self.receive(root));
        }
        let messages = messages.expect("the root of a scatter gives the messages");
        assert_eq!(messages.len(), self.size() as usize, "rank {root} scatters one message to each rank");
        let mut own = Vec::new();
        for (rank, message) in (0..).zip(messages) {
            if rank == root { own = message } else { self.send(rank, &message) }
        }
        Ok(own)
    }

    /// Nonblocking consensus (Hoefler, Siebert, Lumsdaine 2010, algorithm NBX): send synchronously
    /// and receive; a rank whose messages have all been received enters a nonblocking barrier; when
    /// all ranks have entered it, no message is in transit.
    fn exchange_bytes(&self, messages: Vec<(Rank, Vec<u8>)>) -> Result<Vec<(Rank, Vec<u8>)>, CommError> {
        let tag = TAG_EXCHANGE[self.exchanges.replace(self.exchanges.get() + 1) % 2];
        let mut inbox = Inbox::new();
        for (to, _) in &messages {
            assert!(*to < self.size(), "rank {} names rank {to} of {}", self.rank(), self.size());
        }
        multiple_scope(messages.len(), |scope, sends| {
            for (to, message) in messages.iter().filter(|(to, _)| *to != self.rank()) {
                let process = self.world().process_at_rank(number(*to));
                for chunk in self.chunks(message) {
                    sends.add(process.immediate_synchronous_send_with_tag(scope, chunk, tag));
                }
            }
            let mut done = Vec::new();
            while !sends.test_all(&mut done) {
                self.receive_chunk(tag, &mut inbox);
            }
        });
        let mut barrier = self.world().immediate_barrier();
        while let Err(not_yet) = barrier.test() {
            barrier = not_yet;
            self.receive_chunk(tag, &mut inbox);
        }
        let to_itself = messages.into_iter().filter(|(to, _)| *to == self.rank()).map(|(_, message)| message);
        inbox.entry(self.rank()).or_default().complete = to_itself.collect();
        let letters = inbox.into_iter().flat_map(|(from, l)| l.complete.into_iter().map(move |m| (from, m)));
        Ok(letters.collect())
    }

    fn fold(&self, fold: Fold, numbers: &mut [u64]) -> Result<(), CommError> {
        let own = numbers.to_vec();
        match fold {
            Fold::Sum => self.world().all_reduce_into(&own[..], numbers, SystemOperation::sum()),
            Fold::Max => self.world().all_reduce_into(&own[..], numbers, SystemOperation::max()),
            Fold::SumBefore => {
                self.world().exclusive_scan_into(&own[..], numbers, SystemOperation::sum());
                // MPI leaves the result on the first rank undefined.
                if self.rank() == 0 {
                    numbers.fill(0);
                }
            }
        }
        Ok(())
    }
}
