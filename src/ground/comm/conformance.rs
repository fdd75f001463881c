//! The conformance suite of all backends, as a function that any group of ranks can run.
//!
//! Each check computes the expected messages from the rank numbers, so it needs no other channel.

use super::{CommError, Communicator};
use crate::ground::comm::Rank;
use crate::ground::error::{ErrorKind, HasKind};

/// Runs all checks. **Collective.**
///
/// # Panics
/// If the backend does not conform.
pub fn conformance(comm: &dyn Communicator) {
    comm.barrier().unwrap();
    broadcast_reaches_all(comm);
    gather_and_scatter_are_by_rank(comm);
    reductions_and_scans_go_by_rank(comm);
    sparse_exchange_keeps_order(comm);
    consecutive_exchanges_do_not_mix(comm);
    long_messages_arrive_whole(comm);
    errors_are_agreed_on(comm);
    a_rest_ends_when_rank_0_says_so(comm);
}

fn a_rest_ends_when_rank_0_says_so(comm: &dyn Communicator) {
    for calls in [1, 4] {
        let mut called = 0;
        let mut is_over = || {
            called += 1;
            called == calls
        };
        comm.rest(&mut is_over).unwrap();
        assert_eq!(called, if comm.rank() == 0 { calls } else { 0 });
    }
    comm.barrier().unwrap();
}

/// A message that encodes its sender, receiver and length.
fn test_message(from: Rank, to: Rank, length: usize) -> Vec<u32> {
    (0..length as u32).map(|i| i.wrapping_mul(2_654_435_761) ^ (from << 16) ^ to).collect()
}

fn broadcast_reaches_all(comm: &dyn Communicator) {
    for root in 0..comm.size() {
        for length in [0, 1, 1000] {
            let mut values = if comm.rank() == root { test_message(root, 0, length) } else { vec![9; 3] };
            comm.broadcast(root, &mut values).unwrap();
            assert_eq!(values, test_message(root, 0, length));
        }
    }
}

fn gather_and_scatter_are_by_rank(comm: &dyn Communicator) {
    let (rank, size) = (comm.rank(), comm.size());
    let root = size - 1;
    // Rank 0 sends nothing: empty messages keep their position.
    let mine = test_message(rank, 7, 3 * rank as usize);
    let expected: Vec<Vec<u32>> = (0..size).map(|from| test_message(from, 7, 3 * from as usize)).collect();
    let gathered = comm.gather(root, &mine).unwrap();
    assert_eq!(gathered, if rank == root { expected.clone() } else { Vec::new() });
    assert_eq!(comm.all_gather(&mine).unwrap(), expected);
    assert_eq!(comm.all_gather::<f64>(&[]).unwrap(), vec![Vec::<f64>::new(); size as usize]);
    assert_eq!(comm.all_gather_one([rank, 5]).unwrap(), (0..size).map(|r| [r, 5]).collect::<Vec<_>>());
    let lists = (rank == root).then(|| (0..size).map(|to| test_message(root, to, 2 * to as usize)).collect());
    assert_eq!(comm.scatter(root, lists).unwrap(), test_message(root, rank, 2 * rank as usize));
}

fn reductions_and_scans_go_by_rank(comm: &dyn Communicator) {
    let (rank, size) = (u64::from(comm.rank()), u64::from(comm.size()));
    assert_eq!(comm.all_reduce_sum_u64([rank, 1]).unwrap(), [size * (size - 1) / 2, size]);
    assert_eq!(comm.all_reduce_max_u64([rank, size - rank]).unwrap(), [size - 1, size]);
    assert_eq!(comm.exclusive_scan([rank, 1]).unwrap(), [rank * rank.saturating_sub(1) / 2, rank]);
    let x = 0.1 * (rank as f64 + 1.0);
    assert_eq!(comm.all_reduce_min_f64([x, -x]).unwrap(), [0.1, -0.1 * size as f64]);
    assert_eq!(comm.all_reduce_max_f64([x]).unwrap(), [0.1 * size as f64]);
    // Not-a-number is skipped, unless all ranks have it.
    let on_rank_0 = if rank == 0 { -x } else { f64::NAN };
    assert_eq!(comm.all_reduce_min_f64([on_rank_0]).unwrap(), [-0.1]);
    assert_eq!(comm.all_reduce_max_f64([on_rank_0]).unwrap(), [-0.1]);
    assert!(comm.all_reduce_max_f64([f64::NAN]).unwrap()[0].is_nan());
    let in_order = (1..=size).map(|i| 0.1 * i as f64).fold(0.0, |sum, x| sum + x);
    assert_eq!(comm.all_reduce_sum_f64([x]).unwrap()[0].to_bits(), in_order.to_bits());
}

fn sparse_exchange_keeps_order(comm: &dyn Communicator) {
    let (rank, size) = (comm.rank(), comm.size());
    assert!(comm.exchange::<u8>(Vec::new()).unwrap().is_empty());

    // To itself, and two messages to the next rank, the first of them empty.
    let next = (rank + 1) % size;
    let previous = (rank + size - 1) % size;
    let lists =
        vec![(next, Vec::new()), (rank, test_message(rank, rank, 5)), (next, test_message(rank, next, 9))];
    let mut expected = vec![
        (previous, Vec::new()),
        (rank, test_message(rank, rank, 5)),
        (previous, test_message(previous, rank, 9)),
    ];
    if size > 1 {
        expected.sort_by_key(|&(from, _)| from);
    }
    assert_eq!(comm.exchange(lists).unwrap(), expected);

    // All to all, with lengths that depend on sender and receiver, some of them zero.
    let length = |from: Rank, to: Rank| (from as usize * 3 + to as usize) % 5;
    let lists = (0..size).map(|to| test_message(rank, to, length(rank, to))).collect();
    let expected: Vec<_> = (0..size).map(|from| test_message(from, rank, length(from, rank))).collect();
    assert_eq!(comm.all_to_all(lists).unwrap(), expected);

    // All to one.
    let received = comm.exchange(vec![(0, vec![rank])]).unwrap();
    let expected = if rank == 0 { (0..size).map(|from| (from, vec![from])).collect() } else { Vec::new() };
    assert_eq!(received, expected);
}

/// A fast rank may be in the next exchange while a slow one is still in this one.
fn consecutive_exchanges_do_not_mix(comm: &dyn Communicator) {
    let (rank, size) = (comm.rank(), comm.size());
    for round in 0..50u32 {
        let to = (rank + round) % size;
        let from = (rank + size - round % size) % size;
        let received = comm.exchange(vec![(to, vec![round, rank])]).unwrap();
        assert_eq!(received, [(from, vec![round, from])]);
    }
}

/// Longer than the chunk limits of backends in tests, and exact multiples of them.
fn long_messages_arrive_whole(comm: &dyn Communicator) {
    let (rank, size) = (comm.rank(), comm.size());
    for length in [249, 250, 251, 500, 12_345] {
        let root = length as u32 % size;
        let mut values = if rank == root { test_message(root, 1, length) } else { Vec::new() };
        comm.broadcast(root, &mut values).unwrap();
        assert_eq!(values, test_message(root, 1, length));
        let gathered = comm.gather(root, &test_message(rank, 2, length)).unwrap();
        assert!((0..).zip(&gathered).all(|(from, list)| *list == test_message(from, 2, length)));
        let gathered = comm.all_gather(&test_message(rank, 3, length)).unwrap();
        assert!((0..).zip(&gathered).all(|(from, list)| *list == test_message(from, 3, length)));
        let equal =
            comm.all_gather_equal_bytes(bytemuck::cast_slice(&test_message(rank, 4, length))).unwrap();
        let expected: Vec<u32> = (0..size).flat_map(|from| test_message(from, 4, length)).collect();
        assert_eq!(equal, bytemuck::cast_slice::<u32, u8>(&expected));
        let lists = (rank == root).then(|| (0..size).map(|to| test_message(root, to, length)).collect());
        assert_eq!(comm.scatter(root, lists).unwrap(), test_message(root, rank, length));
        let received = comm.all_to_all((0..size).map(|to| test_message(rank, to, length)).collect()).unwrap();
        assert!((0..).zip(&received).all(|(from, list)| *list == test_message(from, rank, length)));
    }
}

#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
enum Unlucky {
    #[error("no luck on {0}")]
    Here(u32),
    #[error(transparent)]
    Comm(#[from] CommError),
}

impl HasKind for Unlucky {
    fn kind(&self) -> ErrorKind {
        match self {
            Self::Here(_) => ErrorKind::NoMesh,
            Self::Comm(error) => error.kind(),
        }
    }
}

fn errors_are_agreed_on(comm: &dyn Communicator) {
    let (rank, size) = (comm.rank(), comm.size());
    assert_eq!(comm.agree(Ok::<_, Unlucky>(rank)), Ok(rank));
    // The last two ranks have an error: all others get that of the lower one.
    let lower = size.saturating_sub(2);
    let result = if rank < lower { Ok(()) } else { Err(Unlucky::Here(rank)) };
    let elsewhere =
        CommError::Elsewhere { rank: lower, kind: ErrorKind::NoMesh, message: format!("no luck on {lower}") };
    let expected = result.clone().err().unwrap_or(Unlucky::Comm(elsewhere));
    assert_eq!(comm.agree(result), Err(expected));
}
