//! Why and how often a coarse mesh is made again: nested loops with one budget.
//!
//! | loop | makes the mesh again because | by | at most |
//! |---|---|---|---|
//! | [`generate`](super::generate()) | a rank found inverted tets in the full refinement | smaller sizes there | [`REFINEMENTS`] |
//! | `mend::refinable` | a test refinement on rank 0 found inverted tets | smaller sizes there | [`INVERTED`] |
//! | | the same, between facets | curved edges, or smaller sizes there | [`INVERTED_FACETS`] |
//! | | or poor ones | smaller sizes there | [`POOR`] |
//! | `target::mesh_to_target` | it has not the requested number of tets | scaled sizes | [`TARGETS`] |
//! | `coarse::corrected` | curves or triangles cross, or a body cannot be filled | smaller sizes there | [`CORRECTIONS`] |
//!
//! An inner loop runs in each round of the outer ones. Their product would be 26,880 meshes, so all
//! share a [`Budget`]: a number of meshes, and a number of tets in proportion to the first mesh or
//! to a requested number. Once it is spent, each loop ends with the best mesh that it has, or with
//! the last error. The best mesh is the one with the largest smallest dihedral angle; for equal
//! angles their histogram decides. Budgets count meshes and tets, not seconds, so that results do
//! not depend on the machine.
//!
//! Nearly all runs need one to ten meshes. Most attempts end early, at the curves or at the
//! surface: only complete ones take as long as a coarse mesh.

use super::expected::{refuse_expected, rounded};
use super::room_error::RoomError;
use crate::ground::progress::Work;
use std::cell::Cell;

/// Maximum number of restarts after the full refinement. Few are needed, because the test
/// refinement finds nearly all inverted tets.
pub(super) const REFINEMENTS: usize = 4;

/// Maximum number of rounds in which sizes are lowered because of inverted tets. Sizes fall by
/// 0.6²⁰ ≈ 1/27,000.
pub(super) const INVERTED: u64 = 20;

/// The same for facets. The surface bends by the same angle between two facets however small the
/// tets are, so smaller sizes remove no inverted tets there: a scan had 9 in the first round and
/// 1914 after twenty. Each round still is another attempt to curve its edges, of which about half
/// succeed.
pub(super) const INVERTED_FACETS: u64 = 8;

/// Maximum number of rounds in which sizes are lowered because of poor tets too.
pub(super) const POOR: u64 = 5;

/// Maximum number of meshes for a requested number of tets; each at least halves the bracket.
pub(super) const TARGETS: usize = 24;

/// Maximum number of restarts where curves or surfaces are too close. Each lowers sizes by a factor
/// of about 1.7, so that gaps of a thousandth of the initial size are resolved.
pub(super) const CORRECTIONS: u64 = 14;

/// The number of coarse meshes of a run that may be begun.
const MESHES: u32 = 200;

/// All retries together may make this many times the tets of the first mesh.
const RETRIED: u64 = 4;

/// Retries may make this number of tets in any case: about five seconds of work.
const ALWAYS_RETRIED: u64 = 200_000;

/// What the coarse meshes of a run may still use.
#[derive(Debug)]
pub struct Budget {
    /// The number of meshes that may still be begun.
    meshes: Cell<u32>,
    /// The number of tets that retries may still make; `None` before the first mesh.
    tets: Cell<Option<u64>>,
    /// The largest number of tets that was requested so far.
    requested: Cell<u64>,
    /// The memory in bytes; by default the free memory.
    memory: Option<u64>,
    /// The number of tets that was last announced to the user; infinite if none is to be.
    announced: Cell<f64>,
    /// Whether the warnings of each kind were given.
    warned: [Cell<bool>; 3],
}

/// Warnings that a run gives once, however often it makes the mesh.
#[derive(Clone, Copy)]
pub(super) enum Once {
    /// Of walls that are close to each other, and of short edges.
    Walls,
    /// Of edges that are close to each other.
    Edges,
    /// Of solids that touch.
    Touching,
}

impl Default for Budget {
    fn default() -> Self {
        Self {
            meshes: Cell::new(MESHES),
            tets: Cell::new(None),
            requested: Cell::new(0),
            memory: None,
            announced: Cell::new(f64::INFINITY),
            warned: Default::default(),
        }
    }
}

/// Fewer tets are not announced: they take less than a second.
const WORTH_ANNOUNCING: f64 = 1e5;

/// A number of tets is announced if it is this many times the last one.
const ANNOUNCED_AGAIN: f64 = 1.5;

impl Budget {
    /// The budget of a run that may use this memory. The expected number of tets is announced if
    /// the user did not request a number.
    pub(super) fn new(memory: Option<u64>, announces: bool) -> Self {
        let announced = if announces { 0.0 } else { f64::INFINITY };
        Self { memory, announced: Cell::new(announced), ..Self::default() }
    }

    /// Refuses an expected number of tets that the memory cannot hold, and announces it if it is
    /// news.
    pub(super) fn expect(&self, tets: f64, work: &Work) -> Result<(), RoomError> {
        refuse_expected(tets, self.memory)?;
        if tets > WORTH_ANNOUNCING && tets > ANNOUNCED_AGAIN * self.announced.get() {
            work.note(&format!("about {} tets are expected in the coarse mesh", rounded(tets)));
            self.announced.set(tets);
        }
        Ok(())
    }

    /// Gives a warning, if there is one, unless the run gave one of this kind.
    pub(super) fn warn(&self, once: Once, warning: impl FnOnce() -> Option<String>, work: &Work) {
        let warned = &self.warned[once as usize];
        if !warned.get()
            && let Some(warning) = warning()
        {
            work.note(&warning);
            warned.set(true);
        }
    }

    /// Allows retries for a number of tets that is requested, as if the first mesh had as many.
    pub(super) fn request(&self, tets: u64) {
        let more = tets.saturating_sub(self.requested.get());
        self.requested.set(self.requested.get() + more);
        self.tets.set(self.tets.get().map(|left| left + RETRIED * more));
    }

    /// Counts a mesh that is begun.
    pub(super) fn spend(&self) {
        self.meshes.set(self.meshes.get().saturating_sub(1));
    }

    /// Counts the tets of a complete mesh. The first one sets the number for all retries.
    pub(super) fn made(&self, tets: u64) {
        let left = match self.tets.get() {
            None => (RETRIED * tets.max(self.requested.get())).max(ALWAYS_RETRIED),
            Some(left) => left.saturating_sub(tets),
        };
        self.tets.set(Some(left));
    }

    /// Whether a further mesh may be begun if it is needed at all.
    pub(super) fn has_meshes(&self) -> bool {
        self.meshes.get() > 0
    }

    /// Whether no further mesh should be begun that is only to be better.
    pub(super) fn is_spent(&self) -> bool {
        !self.has_meshes() || self.tets.get() == Some(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::progress::Work;
    use crate::ground::size::SizeSettings;
    use crate::pipeline::coarse::CoarseSettings;
    use crate::pipeline::geometry::Geometry;
    use crate::pipeline::target::{Outcome, mesh_to_target};

    #[test]
    fn retries_may_make_tets_in_proportion_to_the_first_mesh() {
        let spent_after = |first: u64, retries: &[u64]| {
            let budget = Budget::default();
            budget.made(first);
            retries.iter().for_each(|&tets| budget.made(tets));
            assert!(budget.has_meshes());
            budget.is_spent()
        };
        assert!(!spent_after(1_000_000, &[]));
        assert!(!spent_after(1_000_000, &[RETRIED * 1_000_000 - 1]));
        assert!(spent_after(1_000_000, &[1_000_000; RETRIED as usize]));
        // Small meshes are made again as often as is worth it.
        assert!(!spent_after(1000, &[1000; 100]));
        assert!(spent_after(1000, &[1000; ALWAYS_RETRIED as usize / 1000]));
    }

    #[test]
    fn retries_may_make_tets_in_proportion_to_the_number_that_is_requested() {
        let budget = Budget::default();
        budget.request(50_000);
        budget.made(1000);
        let left = |budget: &Budget| budget.tets.get().expect("a mesh was made");
        assert_eq!(left(&budget), RETRIED * 50_000);
        budget.request(50_000);
        assert_eq!(left(&budget), RETRIED * 50_000, "no more for the same number");
        budget.made(RETRIED * 50_000);
        assert!(budget.is_spent());
        budget.request(60_000);
        assert_eq!(left(&budget), RETRIED * 10_000);
    }

    #[test]
    fn a_spent_budget_ends_the_search_for_a_number_of_tets_with_the_mesh_that_is_there() {
        let ball = "algebraic3d\nsolid ball = sphere (0, 0, 0; 1);\ntlo ball;\n";
        let geometry = Geometry::from_text(ball).unwrap();
        let search = |budget: &Budget| {
            let mut settings = CoarseSettings::from(SizeSettings::default());
            let fits = |tets: u64| (3_000..3_300).contains(&tets);
            mesh_to_target(&geometry.model, &mut settings, 3_000, &fits, budget, Work::unwatched()).unwrap()
        };
        let (budget, small) = (Budget::default(), Budget { meshes: Cell::new(1), ..Budget::default() });
        let few_tets = Budget { tets: Cell::new(Some(1)), requested: Cell::new(3_000), ..Budget::default() };
        assert_eq!(search(&budget).1, Outcome::Reached);
        assert!(budget.meshes.get() < MESHES - 1, "one mesh was enough: the test needs another number");
        assert_eq!(search(&small).1, Outcome::Jumped);
        assert_eq!(search(&few_tets).1, Outcome::Jumped);
        // The first mesh has too few tets: one more is made, with sizes estimated from it.
        assert!(small.is_spent() && few_tets.is_spent() && few_tets.meshes.get() >= MESHES - 2);
    }
}
