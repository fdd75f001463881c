use super::*;
use crate::ground::comm::conformance::conformance;
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

#[test]
fn threads_conform() {
    for ranks in [1, 2, 3, 4, 7, 16] {
        run(ranks, |comm| conformance(comm)).unwrap();
    }
}

#[test]
fn a_single_communicator_conforms() {
    conformance(&alone());
}

#[test]
fn a_thousand_ranks_add_up() {
    let sums = run(1024, |comm| {
        let next = (comm.rank() + 1) % comm.size();
        let received = comm.exchange(vec![(next, vec![comm.rank()])]).unwrap();
        comm.all_reduce_sum_u64([u64::from(received[0].1[0])]).unwrap()[0]
    })
    .unwrap();
    assert_eq!(sums, vec![1023 * 512; 1024]);
}

#[test]
fn a_rank_that_panics_fails_the_others_instead_of_leaving_them_waiting() {
    for ranks in [1, 2, 7, 64] {
        let seen = Mutex::new(Vec::new());
        let culprit = ranks / 2;
        let result = run(ranks, |comm| {
            comm.barrier().unwrap();
            if comm.rank() == culprit {
                panic!("this rank fails on purpose");
            }
            seen.lock().unwrap().push(comm.all_gather_bytes(&[1]).unwrap_err());
            seen.lock().unwrap().push(comm.barrier().unwrap_err());
        });
        assert_eq!(result, Err(CommError::RankFailed(culprit)));
        let seen = seen.into_inner().unwrap();
        assert_eq!(seen, vec![CommError::RankFailed(culprit); 2 * (ranks as usize - 1)]);
    }
}

#[test]
fn the_rank_that_panicked_first_is_named_where_others_panic_in_consequence() {
    let result = run(4, |comm| {
        assert_ne!(comm.rank(), 3, "this rank fails on purpose");
        comm.barrier().unwrap();
    });
    assert_eq!(result, Err(CommError::RankFailed(3)));
}

#[test]
fn a_rank_that_leaves_early_fails_the_others() {
    let results = run(3, |comm| if comm.rank() == 1 { Ok(()) } else { comm.barrier() }).unwrap();
    assert_eq!(results, [Err(CommError::RankFailed(1)), Ok(()), Err(CommError::RankFailed(1))]);
}

#[test]
fn ranks_that_go_separate_ways_are_told_so() {
    let result =
        run(2, |comm| if comm.rank() == 0 { comm.barrier() } else { comm.all_gather_bytes(&[]).map(drop) });
    assert!(matches!(result, Err(CommError::RankFailed(_))));
}

#[test]
fn no_ranks_are_refused() {
    assert!(matches!(run(0, |_| ()), Err(CommError::NotStarted { ranks: 0, .. })));
}

/// Messages that each rank sends: some to some.
fn letters() -> impl Strategy<Value = Vec<Vec<(Rank, Vec<u8>)>>> {
    (1..6u32).prop_flat_map(|ranks| vec(vec((0..ranks, vec(any::<u8>(), 0..9)), 0..7), ranks as usize))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() })]
    #[test]
    fn an_exchange_delivers_each_message_once_by_sender_and_in_order(letters in letters()) {
        let received = run(letters.len() as u32, |comm| {
            comm.exchange_bytes(letters[comm.rank() as usize].clone()).unwrap()
        });
        for (to, received) in (0..).zip(received.unwrap()) {
            let sent = (0..).zip(&letters).flat_map(|(from, letters)| letters.iter().map(move |l| (from, l)));
            let expected = sent.filter(|(_, letter)| letter.0 == to).map(|(from, letter)| (from, letter.1.clone()));
            prop_assert_eq!(received, expected.collect::<Vec<_>>());
        }
    }
}

#[test]
fn methods_for_numbers_are_found_on_the_type_itself() {
    let comm = alone();
    assert_eq!(comm.all_reduce_sum_f64([1.5]), Ok([1.5]));
    assert_eq!(comm.agree::<u32, CommError>(Ok(1)), Ok(1));
}

#[test]
fn the_error_of_a_run_is_that_of_the_rank_that_failed() {
    let refused = CommError::NotStarted { ranks: 5, reason: "on purpose".into() };
    for failing in 0..3 {
        let run = try_run(3, |comm| {
            let mine = if comm.rank() == failing { Err(refused.clone()) } else { Ok(()) };
            comm.agree(mine)
        });
        assert_eq!(run, Err(refused.clone()));
    }
    assert_eq!(try_run(3, |comm| Ok::<_, CommError>(comm.rank())), Ok(vec![0, 1, 2]));
    // Without an agreement the others get `RankFailed`.
    let left = try_run(2, |comm| if comm.rank() == 1 { Err(refused.clone()) } else { comm.barrier() });
    assert_eq!(left, Err(refused));
    assert!(matches!(try_run(0, |_| Ok::<_, CommError>(())), Err(CommError::NotStarted { .. })));
}
