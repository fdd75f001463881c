//! Finds sizes for a requested number of tets.

use super::coarse::CoarseSettings;
use super::coarse_error::CoarseError;
use super::coarse_mesh::CoarseMesh;
use super::estimate::Estimate;
use super::model::Model;
use super::retries::{Budget, TARGETS};
use crate::ground::progress::Work;
use crate::ground::size::SizeSettings;

/// Whether a coarse mesh has the requested number of tets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Outcome {
    /// In the accepted range: up to 1.5 times the number for a coarse mesh, 1.3 times in total.
    Reached,
    /// The coarsest mesh of the geometry has more tets.
    Least,
    /// No size gives a number in the range: this is the next larger one.
    Jumped,
    /// As many coarse meshes were made as are allowed; this one has fewer tets.
    Fewer,
}

/// The number to aim at, relative to the target: inside the accepted range, which begins near 1.
const AIM: f64 = 1.15;

/// A mesh predicts the scale for numbers of tets up to this many times its own.
///
/// Beyond, its volume differs too much from that of the geometry near curved surfaces, where most
/// tets will be: from a mesh of 3,417 tets, 1.15 million were predicted where 1.85 million were
/// made (`benches/results/coarse-count-2026-11-25.md`).
const FAR: f64 = 32.0;

/// The factor between the goal and the mesh that predicts its scale, or between such meshes, which
/// together take 7 % of the time.
const STAGE: f64 = 16.0;

/// Number of trials that use the estimate.
const TRUSTED_TRIES: usize = 4;

/// Scales beyond this have no effect on the mesh.
const LARGEST_SCALE: f64 = 1e3;

/// Sizes are multiplied by no less than this at once: the number of tets is to grow by up to
/// [`FAR`], and it grows at least as fast as sizes fall, except near single points.
const LEAST_STEP: f64 = 1.0 / FAR;

/// More than this many times the goal are too many for a first mesh.
const TOO_MANY: f64 = 2.0;

/// Maximum number of steps to its scale. The number of tets falls with the third power of the scale
/// or more slowly, so no step is too long.
const FIRST_STEPS: usize = 8;

/// A bracket of scales narrower than this factor is not divided further.
const NARROW: f64 = 1.002;

/// Sizes larger by this factor that give hardly fewer tets end the search: the geometry decides the
/// number.
const MUCH_LARGER: f64 = 2.0;

/// The fraction of the number of tets that counts as hardly fewer.
const HARDLY_FEWER: f64 = 0.9;

/// Meshes with up to this many times the least number of tets are candidates if none fits; the best
/// of them is taken, because the coarsest one may have far worse tets than one with a few more.
const NEARLY_LEAST: f64 = 1.25;

/// Makes a coarse mesh whose number of tets `fits`, near the `target` or up to half above it, by
/// scaling all sizes. Otherwise the result is the best of the meshes that have nearly the least
/// number above the target.
///
/// Upper bounds set by the user or the file (`maxh`) are respected.
///
/// # Errors
/// Those of [`Model::coarse_mesh`].
pub fn mesh_to_target(
    model: &Model,
    settings: &mut CoarseSettings,
    target: u64,
    fits: &dyn Fn(u64) -> bool,
    budget: &Budget,
    work: &Work,
) -> Result<(CoarseMesh, Outcome), CoarseError> {
    let goal = AIM * target as f64;
    budget.request(target);
    let (sources, grading) = (settings.size.sources.len(), settings.size.grading);
    let mut search = Search::default();
    // The meshes made here, which together may always have as many tets as requested.
    let mut tets = 0;
    for tries in 0..TARGETS {
        work.proceed()?;
        if tries > 0 && (!budget.has_meshes() || budget.is_spent() && tets >= target) {
            break;
        }
        // What the last mesh added belongs to its scale.
        settings.size.sources.truncate(sources);
        settings.size.grading = grading;
        let scale = settings.size.scale;
        let made = match model.coarse_mesh(settings, budget, work) {
            Ok(made) => made,
            Err(error @ (CoarseError::Room(_) | CoarseError::Cancelled(_))) => return Err(error),
            // The sizes are too large for the geometry despite all corrections: treat this as too
            // few tets.
            Err(error) => {
                search.coarse = Some((scale, 0.5 * target as f64));
                search.failure = Some(error);
                settings.size.scale = search.next_scale(scale, goal, 0.5 * goal, None);
                continue;
            }
        };
        if fits(made.report.tets) {
            return Ok((made, Outcome::Reached));
        }
        let count = made.report.tets;
        tets += count;
        let estimate = Estimate::new(model, settings, &made, sources);
        let aim = search.aim(goal, count as f64);
        // If estimates do not narrow the bracket, continue without them.
        let expected = estimate.as_ref().filter(|_| tries < TRUSTED_TRIES);
        let expected = expected.and_then(|estimate| estimate.scale_for(aim));
        if count < target {
            search.coarse = Some((scale, count as f64));
        } else {
            let share = estimate.and_then(|estimate| estimate.share_at(LARGEST_SCALE, f64::INFINITY));
            if search.too_many(scale, made, share) {
                break;
            }
        }
        if search.is_narrow() {
            break;
        }
        settings.size.scale = search.next_scale(scale, aim, count as f64, expected);
    }
    match (search.best, search.failure) {
        (Some((scale, made)), _) => {
            settings.size.scale = scale;
            Ok((made, if search.is_least { Outcome::Least } else { Outcome::Jumped }))
        }
        (None, Some(error)) => Err(error),
        (None, None) => {
            let made = model.coarse_mesh(settings, budget, work)?;
            let outcome = match made.report.tets {
                tets if fits(tets) => Outcome::Reached,
                tets if tets < target => Outcome::Fewer,
                _ => Outcome::Jumped,
            };
            Ok((made, outcome))
        }
    }
}

/// The scale at which a search for this number of tets begins: larger than that of the settings if
/// their sizes let expect far more tets, because a mesh with these would take longer than all that
/// follows.
pub(super) fn first_scale(model: &Model, settings: &SizeSettings, target: u64) -> f64 {
    let goal = AIM * target as f64;
    let mut scale = settings.scale;
    for _ in 0..FIRST_STEPS {
        match model.expected_tets(&SizeSettings { scale, ..settings.clone() }) {
            // Such expectations are too low rather than too high: thin bodies have more tets.
            Some(tets) if tets > TOO_MANY * goal => scale *= (tets / goal).cbrt(),
            _ => break,
        }
    }
    scale
}

/// The state of a search for sizes.
#[derive(Default)]
struct Search {
    /// The largest scale that gave too many tets, and their number.
    fine: Option<(f64, f64)>,
    /// The smallest scale that gave too few tets or none, and their number.
    coarse: Option<(f64, f64)>,
    /// The last failure at a scale.
    failure: Option<CoarseError>,
    /// The least number of tets above the target.
    fewest: Option<u64>,
    /// The best mesh with nearly that number, and its scale.
    best: Option<(f64, CoarseMesh)>,
    /// Whether larger sizes give hardly fewer tets.
    is_least: bool,
}

impl Search {
    /// Adds a mesh with too many tets, of which a `share` is expected at the largest scale. Returns
    /// whether larger sizes give hardly fewer.
    fn too_many(&mut self, scale: f64, made: CoarseMesh, share: Option<f64>) -> bool {
        let tets = made.report.tets as f64;
        let is_stuck = |(before, more): (f64, f64)| {
            let is_far = scale >= MUCH_LARGER * before || self.failure.is_some();
            is_far && tets >= HARDLY_FEWER * more
        };
        let is_bound = share.is_some_and(|share| share >= HARDLY_FEWER);
        self.is_least |= scale >= LARGEST_SCALE || is_bound || self.fine.is_some_and(is_stuck);
        self.fine = Some((scale, tets));
        let fewest = self.fewest.map_or(made.report.tets, |fewest| fewest.min(made.report.tets));
        self.fewest = Some(fewest);
        let most = NEARLY_LEAST * fewest as f64;
        let is_best = |best: &CoarseMesh| {
            best.report.tets as f64 > most || made.report.quality.compare_angles(&best.report.quality).is_gt()
        };
        if tets <= most && self.best.as_ref().is_none_or(|(_, best)| is_best(best)) {
            self.best = Some((scale, made));
        }
        self.is_least
    }

    /// Whether the bracket is too narrow to be divided.
    fn is_narrow(&self) -> bool {
        self.fine.zip(self.coarse).is_some_and(|((low, _), (high, _))| high / low < NARROW)
    }

    /// The number to aim at after a mesh of `count` tets: the goal, or less if it is too far away.
    fn aim(&self, goal: f64, count: f64) -> f64 {
        let mut aim = goal;
        while self.fine.is_none() && aim > FAR * count.max(1.0) {
            aim /= STAGE;
        }
        aim
    }

    /// The scale to try next: the `expected` one if it is inside the bracket, else from the number
    /// of tets, which goes with the third power of the scale.
    fn next_scale(&self, scale: f64, goal: f64, count: f64, expected: Option<f64>) -> f64 {
        match (self.fine, self.coarse) {
            (Some((low, many)), Some((high, few))) => {
                // Linear between the logarithms, kept away from the ends so that the bracket
                // shrinks.
                let (low_log, high_log) = (low.ln(), high.ln());
                let (many, few) = (many.ln(), few.max(1.0).ln());
                let share = match expected {
                    Some(expected) => (expected.ln() - low_log) / (high_log - low_log),
                    None => (many - goal.ln()) / (many - few),
                };
                (low_log + share.clamp(0.15, 0.85) * (high_log - low_log)).exp()
            }
            // Still too many: coarsen ever faster, because some numbers hardly depend on the sizes.
            (Some(_), None) => (scale * (count / goal).cbrt().max(1.5).powi(2).min(16.0)).min(LARGEST_SCALE),
            _ => {
                let finer = expected.map_or((count / goal).cbrt(), |expected| expected / scale);
                scale * finer.clamp(LEAST_STEP, 0.9)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::mesh::QualitySummary;
    use crate::pipeline::coarse_mesh::CoarseReport;

    fn mesh(tets: u64, smallest_dihedral: f64) -> CoarseMesh {
        let quality = QualitySummary { smallest_dihedral, ..QualitySummary::default() };
        CoarseMesh {
            report: CoarseReport { tets, quality, ..CoarseReport::default() },
            ..CoarseMesh::default()
        }
    }

    #[test]
    fn the_best_mesh_of_nearly_the_least_number_wins() {
        let mut search = Search::default();
        let best = |search: &Search| search.best.as_ref().unwrap().1.report.tets;
        search.too_many(1.0, mesh(1000, 20.0), None);
        search.too_many(1.5, mesh(500, 8.0), None);
        assert_eq!(best(&search), 500, "half the tets");
        search.too_many(2.0, mesh(450, 1.0), None);
        assert_eq!(best(&search), 500, "a tenth more tets and a better angle");
        search.too_many(3.0, mesh(550, 9.0), None);
        assert_eq!(best(&search), 550);
        search.too_many(3.5, mesh(600, 30.0), None);
        assert_eq!(best(&search), 550, "600 is more than a quarter above 450");
    }

    #[test]
    fn far_goals_are_approached_in_stages_until_there_are_too_many_tets() {
        let mut search = Search::default();
        assert_eq!(search.aim(30_000.0, 1000.0), 30_000.0);
        assert_eq!(search.aim(160_000.0, 1000.0), 10_000.0);
        assert_eq!(search.aim(2_560_000.0, 1000.0), 10_000.0);
        search.too_many(1.0, mesh(1_000_000, 20.0), None);
        assert_eq!(search.aim(160_000.0, 1000.0), 160_000.0);
    }

    #[test]
    fn sizes_that_give_hardly_fewer_tets_end_the_search() {
        let mut search = Search::default();
        assert!(!search.too_many(1.0, mesh(1000, 20.0), None));
        assert!(!search.too_many(4.0, mesh(300, 5.0), None));
        assert!(!search.too_many(6.0, mesh(290, 5.0), None), "sizes are hardly larger");
        assert!(search.too_many(18.0, mesh(280, 5.0), None));
        assert!(search.is_least);
        let few = |share: f64| Search::default().too_many(1.0, mesh(1000, 20.0), Some(share));
        assert!(few(0.95) && !few(0.5));
    }
}
