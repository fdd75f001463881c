//! A requested number of tets for parts that are meshed separately: their sizes are scaled until
//! the parts together have it.

use super::settings::Wanted;
use crate::ground::comm::{CommError, Communicator};

/// The number to aim at relative to the requested one, which is the least that is accepted. Eleven
/// geometries of 10⁶ tets get 0.97 to 1.04 of the expected number, one of 5·10⁶ tets 0.95.
const AIM: f64 = 1.15;

/// The most tets that are accepted, relative to the requested number.
const MOST: f64 = 1.3;

/// Maximum number of times that parts are meshed.
const TRIES: u32 = 4;

/// The requested number, and the scale of the sizes for it; the same on all ranks.
pub(super) struct Goal {
    count: Option<u64>,
    tries: u32,
    /// The factor on all sizes.
    pub scale: f64,
}

impl Goal {
    /// The goal of a run. With the sizes as they are, `expected` tets are expected.
    pub fn new(wanted: Wanted, expected: f64) -> Self {
        let count = match wanted {
            Wanted::Elements(count) => Some(count),
            Wanted::Sizes { .. } | Wanted::Coarse { .. } => None,
        };
        let scale = count.map_or(1.0, |count| (expected / (AIM * count as f64)).cbrt());
        Self { count, tries: 0, scale }
    }

    /// **Collective.** Whether all parts together have the requested number, or cannot come nearer;
    /// `mine` are the tets of this rank's part. Otherwise corrects the scale.
    ///
    /// # Errors
    /// [`CommError`] if another rank fails.
    pub fn is_reached(&mut self, comm: &dyn Communicator, mine: usize) -> Result<bool, CommError> {
        let [made] = comm.all_reduce_sum_u64([mine as u64])?;
        let Some(count) = self.count else { return Ok(true) };
        self.tries += 1;
        let share = made as f64 / count as f64;
        if (1.0..=MOST).contains(&share) || self.tries == TRIES || made == 0 {
            return Ok(true);
        }
        self.scale *= (share / AIM).cbrt();
        Ok(false)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::comm::thread;

    /// Tets go with the third power of the sizes, 1.5 times as many as expected.
    #[test]
    fn sizes_are_scaled_until_the_number_is_reached() {
        let comm = thread::alone();
        let made = |scale: f64| (1.5 * 8000.0 / scale.powi(3)) as usize;
        let mut goal = Goal::new(Wanted::Elements(1000), 8000.0);
        assert!(!goal.is_reached(&comm, made(goal.scale)).unwrap());
        assert!(goal.is_reached(&comm, made(goal.scale)).unwrap());
        assert!((1000..1300).contains(&made(goal.scale)));
    }

    #[test]
    fn a_number_out_of_reach_ends_after_some_tries_and_sizes_alone_are_kept() {
        let comm = thread::alone();
        let mut goal = Goal::new(Wanted::Elements(1000), 1000.0);
        let tries = (1..).find(|_| goal.is_reached(&comm, 5000).unwrap());
        assert_eq!(tries, Some(TRIES));
        let mut goal = Goal::new(Wanted::Sizes { pieces: 2 }, 8000.0);
        assert!(goal.is_reached(&comm, 1).unwrap() && goal.scale == 1.0);
    }
}
