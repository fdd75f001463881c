//! Settings of the improvement and its trade-off between time and quality.

use crate::mesher::improve::objective::Measure;

/// Settings of the improvement.
#[derive(Clone, Debug)]
pub struct Settings {
    /// The shape measure.
    pub measure: Measure,
    /// The most passes over the mesh.
    pub passes: u32,
    /// Tets with a measure below this are swapped and smoothed.
    pub target: f64,
    /// Tets that stay below this, and below the target, are also treated by collapses, insertions
    /// and reconnections.
    pub change_below: f64,
    /// The shortest edge made by an insertion, in units of the wanted size or the usual edge length
    /// there, whichever is less.
    pub shortest_edge: f64,
    /// The most tets that the searches for insertions visit in a block.
    pub insertion_steps: InsertionSteps,
    /// The most partial fillings visited by reconnections, per pass over a block.
    pub reconnection_steps: usize,
    /// Dihedral angle in degrees that no change may undercut, if no tet is below it at first.
    /// Without it the smallest angle may decrease, although the worst measure increases.
    pub least_angle: f64,
    /// The number of tets per block, the unit of parallel work; see [`improve`](super::improve).
    pub block: usize,
}

/// A number of steps in proportion to the tets of a block.
///
/// If triangles are much larger than a body is thick, all its tets are bad, few insertions help,
/// and each tet is tried in every pass. Without the limit, a heat exchanger with one layer of such
/// tets visited 124 tets for each of its own, in 11 s; good meshes visit fewer than 0.5
/// (`benches/results/coarser-2026-11-23.md`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InsertionSteps {
    /// Steps for any block: about half a second.
    pub of_block: usize,
    /// Further steps for each tet.
    pub of_tet: usize,
}

impl InsertionSteps {
    /// The steps for a block of this number of tets.
    pub(super) fn of(self, tets: usize) -> usize {
        self.of_block + self.of_tet * tets
    }
}

impl Default for InsertionSteps {
    fn default() -> Self {
        Self { of_block: 50_000, of_tet: 1 }
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self::of(Effort::default(), Measure::default())
    }
}

/// Trade-off between time and quality.
///
/// On the surface `cube_100k` (benches/results), a hundred thousand tets on one core, meshing takes
/// 0.16 s and gives a 1st percentile of the smallest dihedral angles of 21°. With improvement by
/// the mean ratio the total is 0.20 s and 32° for quick, 0.24 s and 36° for standard, 0.36 s and
/// 38° for careful, 0.5 s and 38° for thorough.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Effort {
    /// One pass over bad tets only: removes slivers.
    Quick,
    /// All tets except good ones.
    #[default]
    Standard,
    /// Like standard with more passes: for coarse meshes, in which each tet has many descendants.
    Careful,
    /// Nearly all tets, until little changes.
    Thorough,
}

impl Effort {
    /// All efforts in ascending order, with their names.
    pub const ALL: [(Self, &str); 4] = [
        (Self::Quick, "quick"),
        (Self::Standard, "standard"),
        (Self::Careful, "careful"),
        (Self::Thorough, "thorough"),
    ];
}

impl std::str::FromStr for Effort {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        let found = Self::ALL.iter().find(|(_, n)| *n == name).map(|(effort, _)| *effort);
        found.ok_or_else(|| format!("unknown effort `{name}`; use {}", Self::ALL.map(|(_, n)| n).join(", ")))
    }
}

impl Settings {
    /// The settings of an effort and a measure: [`Measure::Refined`] for meshes that will be
    /// refined, [`Measure::MeanRatio`] for others.
    ///
    /// Meshes that are not refined get better angles by their own mean ratio, in the same time
    /// (benches/results/measure-2026-11-29.md). Its targets are lower, because a sliver's mean
    /// ratio is 6/7 of its other measure.
    pub fn of(effort: Effort, measure: Measure) -> Self {
        let (passes, reconnection_steps) = match effort {
            Effort::Quick => (1, 0),
            Effort::Standard => (3, 4_000),
            Effort::Careful => (8, 4_000),
            Effort::Thorough => (8, 40_000),
        };
        let (target, change_below) = match (measure, effort) {
            (Measure::Refined, Effort::Quick) => (0.7, 0.6),
            (Measure::Refined, Effort::Standard) => (0.8, 0.6),
            (Measure::Refined, Effort::Careful) => (0.85, 0.6),
            (Measure::Refined, Effort::Thorough) => (0.9, 0.6),
            (Measure::MeanRatio, Effort::Quick) => (0.65, 0.5),
            (Measure::MeanRatio, Effort::Standard) => (0.72, 0.5),
            (Measure::MeanRatio, Effort::Careful) => (0.78, 0.5),
            (Measure::MeanRatio, Effort::Thorough) => (0.8, 0.6),
        };
        Self {
            measure,
            passes,
            target,
            change_below,
            shortest_edge: 0.6,
            insertion_steps: InsertionSteps::default(),
            reconnection_steps,
            least_angle: 0.0,
            block: 1 << 15,
        }
    }
}
