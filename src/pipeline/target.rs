//! Sizes that give a wanted number of tets.

use super::coarse::{CoarseError, CoarseMesh, CoarseSettings};
use super::estimate;
use super::model::Model;

/// How a coarse mesh with a wanted number of tets came out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Outcome {
    /// As many as asked for, or as few more as were promised: 1.5 times for a coarse mesh, 1.3 times in all.
    Reached,
    /// The least that the geometry allows is more.
    Least,
    /// The number jumps over the range: this is the next above.
    Jumped,
}

/// What is aimed at, in units of the target: inside what fits, which begins there or a little below.
const AIM: f64 = 1.15;

/// Meshes made to find the sizes at most: a bracket is cut by half or better each time.
const MOST_TRIES: usize = 24;

/// Estimates are asked for so often.
const TRUSTED_TRIES: usize = 4;

/// Sizes that are this many times larger than what the settings say change nothing any more.
const LARGEST_SCALE: f64 = 1e3;

/// A bracket of sizes narrower than this factor will not come to lie on another number.
const NARROW: f64 = 1.002;

/// Makes a coarse mesh whose number of tets `fits`, near the `target` or up to half above it, by scaling all sizes; or the
/// least above the target.
///
/// Bounds that the user or the file sets (`maxh`) stay upper bounds.
///
/// # Errors
/// As [`Model::coarse_mesh`].
pub fn mesh_to_target(
    model: &Model,
    settings: &mut CoarseSettings,
    target: u64,
    fits: &dyn Fn(u64) -> bool,
) -> Result<(CoarseMesh, Outcome), CoarseError> {
    let goal = AIM * target as f64;
    let sources = settings.size.sources.len();
    let mut fine: Option<(f64, CoarseMesh)> = None;
    let mut coarse: Option<(f64, f64)> = None;
    let mut finest_failure: Option<CoarseError> = None;
    for tries in 0..MOST_TRIES {
        settings.size.sources.truncate(sources);
        let made = match model.coarse_mesh(settings) {
            Ok(made) => made,
            // Sizes that are too large for the geometry, whatever was corrected: as too few tets.
            Err(error) => {
                coarse = Some((settings.size.scale, 0.5 * target as f64));
                finest_failure = Some(error);
                settings.size.scale =
                    next_scale(settings.size.scale, goal, 0.5 * goal, None, fine.as_ref(), coarse);
                continue;
            }
        };
        let count = made.report.tets as f64;
        if fits(made.report.tets) {
            return Ok((made, Outcome::Reached));
        }
        let scale = settings.size.scale;
        // A bracket that estimates do not narrow is narrowed without them.
        let expected = (tries < TRUSTED_TRIES)
            .then(|| estimate::scale_for(model, settings, &made, sources, goal))
            .flatten();
        if made.report.tets < target {
            coarse = Some((scale, count));
        } else {
            if scale >= LARGEST_SCALE {
                return Ok((made, Outcome::Least));
            }
            fine = Some((scale, made));
        }
        if let (Some((low, _)), Some((high, _))) = (&fine, coarse)
            && high / low < NARROW
        {
            break;
        }
        settings.size.scale = next_scale(scale, goal, count, expected, fine.as_ref(), coarse);
    }
    match (fine, finest_failure) {
        (Some((scale, made)), _) => {
            settings.size.scale = scale;
            Ok((made, Outcome::Jumped))
        }
        (None, Some(error)) => Err(error),
        (None, None) => model.coarse_mesh(settings).map(|made| (made, Outcome::Jumped)),
    }
}

/// The scale to try next: the one that is `expected` to give the number, where there is one within what is known; else by the third
/// power of the scale, with which the number of tets goes.
fn next_scale(
    scale: f64,
    goal: f64,
    count: f64,
    expected: Option<f64>,
    fine: Option<&(f64, CoarseMesh)>,
    coarse: Option<(f64, f64)>,
) -> f64 {
    match (fine, coarse) {
        (Some((low, made)), Some((high, few))) => {
            // Linear between the logarithms, kept off the ends so that the bracket shrinks.
            let (low_log, high_log) = (low.ln(), high.ln());
            let (many, few) = ((made.report.tets as f64).ln(), few.max(1.0).ln());
            let share = match expected {
                Some(expected) => (expected.ln() - low_log) / (high_log - low_log),
                None => (many - goal.ln()) / (many - few),
            };
            (low_log + share.clamp(0.15, 0.85) * (high_log - low_log)).exp()
        }
        // Still too many: coarser, faster and faster, as some numbers hardly depend on the sizes.
        (Some(_), None) => (scale * (count / goal).cbrt().max(1.5).powi(2).min(16.0)).min(LARGEST_SCALE),
        _ => {
            let finer = expected.map_or((count / goal).cbrt(), |expected| expected / scale);
            scale * finer.clamp(0.05, 0.9)
        }
    }
}
