//! Detection of MPI launchers.

/// Why the ranks of an MPI job are not available.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LaunchError {
    /// Started by `mpirun`, but this program was built without MPI.
    #[error(
        "started by an MPI launcher{}, but built without MPI: rebuild with `cargo build --release --features mpi`, \
         or start without the launcher and choose the ranks with -n",
        .ranks.map(|n| format!(" with {n} ranks")).unwrap_or_default()
    )]
    NotBuilt {
        /// The number of ranks that the launcher started, if known.
        ranks: Option<u32>,
    },
    /// MPI can be initialised only once in a process.
    #[error("MPI was initialised before in this process")]
    AlreadyInitialised,
    /// MPI was initialised without threads other than the one that calls it.
    #[error(
        "MPI grants less than MPI_THREAD_FUNNELED, and meshing uses threads: initialise MPI with this level, or take an MPI \
         library that supports it"
    )]
    NoThreads,
}

/// Variables with the number of ranks: Open MPI; MPICH, Intel MPI and Slurm's PMI; MVAPICH.
const SIZE_VARIABLES: [&str; 3] = ["OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "MV2_COMM_WORLD_SIZE"];

/// Variables that are set for each process of a job but do not contain its size: PMIx, PMI.
const RANK_VARIABLES: [&str; 2] = ["PMIX_RANK", "PMI_RANK"];

/// The launcher, according to the environment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Launch {
    /// No launcher, or a single rank.
    Alone,
    /// A launcher started several ranks, or an unknown number (`None`).
    Ranks(Option<u32>),
}

/// Reads the launcher's variables through `variable` (in a program: [`std::env::var`]).
///
/// Variables of a batch script (`SLURM_NTASKS`) are ignored: they are also set without a launcher.
pub fn detect(variable: impl Fn(&str) -> Option<String>) -> Launch {
    let size = SIZE_VARIABLES.iter().find_map(|name| variable(name)?.trim().parse::<u32>().ok());
    match size {
        Some(0 | 1) => Launch::Alone,
        Some(ranks) => Launch::Ranks(Some(ranks)),
        None if RANK_VARIABLES.iter().any(|name| variable(name).is_some()) => Launch::Ranks(None),
        None => Launch::Alone,
    }
}

/// [`detect`] for this process.
pub fn this_process() -> Launch {
    detect(|name| std::env::var(name).ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn detect_in(environment: &[(&str, &str)]) -> Launch {
        detect(|name| environment.iter().find(|(key, _)| *key == name).map(|(_, value)| value.to_string()))
    }

    #[test]
    fn launchers_are_told_by_their_variables() {
        assert_eq!(detect_in(&[]), Launch::Alone);
        assert_eq!(detect_in(&[("SLURM_NTASKS", "4")]), Launch::Alone);
        assert_eq!(detect_in(&[("OMPI_COMM_WORLD_SIZE", "4"), ("PMIX_RANK", "0")]), Launch::Ranks(Some(4)));
        assert_eq!(detect_in(&[("OMPI_COMM_WORLD_SIZE", "1"), ("PMIX_RANK", "0")]), Launch::Alone);
        assert_eq!(detect_in(&[("PMI_SIZE", "16"), ("PMI_RANK", "3")]), Launch::Ranks(Some(16)));
        assert_eq!(detect_in(&[("PMIX_RANK", "3")]), Launch::Ranks(None));
    }

    #[test]
    fn the_refusal_says_how_to_build() {
        let text = LaunchError::NotBuilt { ranks: Some(4) }.to_string();
        assert!(text.contains("with 4 ranks") && text.contains("--features mpi"), "{text}");
    }
}
