use super::*;
use crate::ground::comm::conformance::conformance;
use crate::ground::comm::thread;

#[test]
fn any_number_of_ranks_on_any_number_of_processes_conforms() {
    for (processes, ranks) in [(1, 1), (1, 5), (2, 2), (2, 3), (3, 8), (3, 1), (5, 3)] {
        let ran = thread::run(processes, |outer| {
            let mine = run(outer, ranks, |comm| {
                assert_eq!(comm.size(), ranks);
                conformance(comm);
                comm.rank()
            });
            mine.unwrap()
        });
        assert_eq!(ran.unwrap().concat(), (0..ranks).collect::<Vec<_>>(), "{processes} processes");
    }
}

#[test]
fn a_rank_that_panics_ends_all_processes() {
    for failing in 0..4 {
        let ran = thread::run(2, |outer| {
            run(outer, 4, |comm| {
                comm.barrier().unwrap();
                assert_ne!(comm.rank(), failing, "a broken invariant");
                comm.barrier().unwrap_err();
            })
        });
        let failed = ran.is_err() || ran.is_ok_and(|results| results.iter().any(Result::is_err));
        assert!(failed, "rank {failing}");
    }
}

#[test]
fn no_ranks_are_refused() {
    assert!(run(&thread::alone(), 0, |_| ()).is_err());
}
