//! The order of operations: the worst tets first, and only where something changed.

use crate::ground::kernel::simplex::largest_cosine;
use crate::ground::mesh::QualitySummary;
use crate::ground::mesh::{Mesh, VertexId};
use crate::ground::size::SizeField;
use crate::mesher::half_face::NONE;
use crate::mesher::improve::blocks::{Block, Cut, Finished, Triangles, merge_blocks, remove_unused};
use crate::mesher::improve::collapse::Collapser;
use crate::mesher::improve::complex::Complex;
use crate::mesher::improve::insert::Inserter;
use crate::mesher::improve::legality::{Legality, Smoothness};
use crate::mesher::improve::objective::{Measure, Objective, score_of_ratio};
use crate::mesher::improve::reconnect::Reconnector;
use crate::mesher::improve::repair::{Candidate, candidates, repair};
use crate::mesher::improve::smooth::Smoother;
use crate::mesher::improve::swap::Swapper;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

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
    /// The number of tets per block, the unit of parallel work; see [`improve`].
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
    fn of(self, tets: usize) -> usize {
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
        Self::of(Effort::default())
    }
}

/// Trade-off between time and quality.
///
/// On the surface `cube_100k` (benches/results), a hundred thousand tets on one core, meshing takes
/// 0.14 s and gives a 1st percentile of the smallest dihedral angles of 21°. With improvement the
/// total is 0.19 s and 31° for quick, 0.22 s and 34° for standard, 0.28 s and 36° for careful, 0.49
/// s and 37° for thorough.
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
    /// The settings of an effort.
    pub fn of(effort: Effort) -> Self {
        let (passes, target, reconnection_steps) = match effort {
            Effort::Quick => (1, 0.7, 0),
            Effort::Standard => (3, 0.8, 4_000),
            Effort::Careful => (8, 0.85, 4_000),
            Effort::Thorough => (8, 0.9, 40_000),
        };
        let measure = Measure::default();
        Self {
            measure,
            passes,
            target,
            change_below: 0.6,
            shortest_edge: 0.6,
            insertion_steps: InsertionSteps::default(),
            reconnection_steps,
            least_angle: 0.0,
            block: 1 << 15,
        }
    }
}

/// Statistics of the improvement.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// The quality before.
    pub before: QualitySummary,
    /// The quality after.
    pub after: QualitySummary,
    /// Number of passes.
    pub passes: u32,
    /// Number of vertex moves.
    pub moves: usize,
    /// Edges and faces removed by swaps.
    pub swaps: usize,
    /// Vertices merged into a neighbour.
    pub collapses: usize,
    /// Vertices added, including those of repairs.
    pub insertions: usize,
    /// Tets visited by the searches for insertions.
    pub insertion_steps: usize,
    /// Cavities refilled with other tets of the same vertices.
    pub reconnections: usize,
    /// Illegal tets before; 0 if legality is not considered.
    pub illegal_before: usize,
    /// Illegal tets that remain.
    pub illegal_left: usize,
    /// Legal tets before with a corner that would be inverted by refinement and projection.
    pub folding_before: usize,
    /// Such tets that remain.
    pub folding_left: usize,
    /// Boundary triangles with two edges on one curve: they flatten too, with the tets at them,
    /// which are not counted above. Only the surface mesh can be changed to avoid them.
    pub illegal_triangles: usize,
}

/// The operations with their scratch memory.
#[derive(Default)]
struct Tools {
    swapper: Swapper,
    smoother: Smoother,
    collapser: Collapser,
    inserter: Inserter,
    reconnector: Reconnector,
}

/// Below this mean ratio (slivers of 10° or so) all candidate cavities of a tet are tried for
/// insertion, with edges as short as [`SHORTER`] times the usual limit.
const TERRIBLE: f64 = 0.35;

/// Cosine of 16°: tets with a smaller dihedral angle are treated like those below [`TERRIBLE`]. In
/// one layer of tets between independent triangulations, a few of 10° to 15° have mean ratios
/// above.
const SHARP: f64 = 0.961_261_695_938_318_9;

/// See [`TERRIBLE`].
const SHORTER: f64 = 0.5;

/// The number of tets per block and pass that may be treated in this way, in addition to one of
/// [`TETS_A_RESCUE`]. It limits the time: in surfaces of needles nearly all tets are below
/// [`TERRIBLE`], and each attempt takes a quarter of a millisecond.
const RESCUES: usize = 100;

/// See [`RESCUES`].
const TETS_A_RESCUE: usize = 50;

/// Rounds over the mesh: all tets, then those left at the seams between blocks, then those at the
/// seams of that round, which are few and form one block.
const ROUNDS: usize = 3;

/// The last pass is the first that changes less than this fraction of the tets.
const FEW_CHANGES: f64 = 1e-3;

/// Improves the shapes of the tets of all bodies. Boundary triangles, segments and their vertices
/// do not change.
///
/// The worst measure of the mesh never decreases. Ids of vertices and tets change; remaining
/// vertices keep their order. The result is the same for any number of threads, because work is
/// divided into blocks of [`Settings::block`] tets.
///
/// # Panics
/// If the mesh is invalid: a tet is not positively oriented, a face has three tets (not detected if
/// they are in different blocks), or a boundary triangle is not a face of a tet.
pub fn improve(mesh: &mut Mesh, size: &dyn SizeField, settings: &Settings) -> Report {
    run(mesh, size, None, settings)
}

/// Like [`improve`], but also repairs **illegal** tets, which would flatten when refined and
/// projected, and makes no new ones.
///
/// See the [module](crate::mesher::improve) and [`Smoothness`]. Scores include the penalty of
/// corners and never decrease, but the shape of a tet may, if a corner gains by it.
///
/// # Panics
/// Like [`improve`].
pub fn make_refinable(
    mesh: &mut Mesh,
    size: &dyn SizeField,
    smoothness: &dyn Smoothness,
    settings: &Settings,
) -> Report {
    let legality = Legality::new(mesh, smoothness);
    run(mesh, size, Some(&legality), settings)
}

fn run(mesh: &mut Mesh, size: &dyn SizeField, legality: Option<&Legality>, settings: &Settings) -> Report {
    let mut report = Report { before: QualitySummary::of(mesh), ..Report::default() };
    if let Some(legality) = legality {
        (report.illegal_before, report.folding_before) = count_faults(mesh, legality);
        report.illegal_triangles = legality.illegal_triangles();
    }
    let triangles = Triangles::new(mesh);
    let mut gone = vec![false; mesh.points.len()];
    let mut left = None;
    for round in 0..ROUNDS {
        let block = if round + 1 < ROUNDS { settings.block } else { usize::MAX };
        let cut = Cut::new(mesh, left.as_deref(), round, block);
        let [from, to] = [round, round + 1].map(|round| round as f64 / ROUNDS as f64);
        size.work().substep(from, to, cut.blocks() as u64);
        let worker = || (vec![NONE; mesh.points.len()], Tools::default());
        let blocks: Vec<(Finished, Counts, Vec<u32>)> = (0..cut.blocks())
            .into_par_iter()
            .map_init(worker, |(to_block, tools), block| {
                let mut block = Block::new(mesh, &triangles, &cut, block, to_block);
                let legality = legality.map(|l| l.of_block(&block.vertices, to_block));
                let sharpest = settings.least_angle.to_radians().cos();
                let objective =
                    Objective { measure: settings.measure, legality: legality.as_ref(), sharpest };
                let counts = if size.work().is_cancelled() {
                    Counts::default()
                } else {
                    tools.improve(&mut block.complex, &objective, size, settings)
                };
                size.work().add(1);
                let met = std::mem::take(&mut block.triangles);
                (block.finish(&cut, |score| score < score_of_ratio(settings.target)), counts, met)
            })
            .collect();
        if round == 0 {
            check_triangles(mesh, blocks.iter().flat_map(|b| &b.2));
        }
        blocks.iter().for_each(|b| report.add(&b.1));
        let seeds = merge_blocks(mesh, cut, blocks.into_iter().map(|b| b.0).collect(), &mut gone);
        if seeds.is_empty() {
            break;
        }
        left = Some(seeds);
    }
    if let Some(legality) = legality {
        (report.illegal_left, report.folding_left) = count_faults(mesh, legality);
    }
    remove_unused(mesh, &gone);
    report.after = QualitySummary::of(mesh);
    report
}

/// Asserts that every boundary triangle is a face of a tet.
fn check_triangles<'a>(mesh: &Mesh, met: impl Iterator<Item = &'a u32>) {
    let mut is_face = vec![false; mesh.triangles.len()];
    met.for_each(|&t| is_face[t as usize] = true);
    let lost = is_face.iter().position(|met| !met).map(|t| mesh.triangles[t]);
    assert_eq!(lost, None, "a boundary triangle is not a face of a tet");
}

/// The number of illegal tets, and of legal ones with a corner that is inverted in the limit of
/// refinement.
fn count_faults(mesh: &Mesh, legality: &Legality) -> (usize, usize) {
    let verdict = |tet: &[VertexId; 4]| {
        let (illegal, limits) = legality.evaluate(tet.map(|v| v.0));
        let corners = || tet.map(|v| mesh.points[v.index()]);
        let folds = !illegal && limits.is_some_and(|l| l.least_corner(&corners()) <= 0.0);
        (usize::from(illegal), usize::from(folds))
    };
    mesh.tets.par_iter().map(verdict).reduce(|| (0, 0), |a, b| (a.0 + b.0, a.1 + b.1))
}

/// The tets whose score is below `least` and that changed since the last pass began, the worst
/// first.
fn worst_first(complex: &Complex, least: f64) -> Vec<(f64, u32)> {
    let changed = |t: u32| complex.tets[t as usize].iter().any(|&v| is_fresh(complex, v));
    let mut bad: Vec<(f64, u32)> = complex
        .living()
        .map(|t| (complex.scores[t as usize], t))
        .filter(|&(score, t)| score < least && changed(t))
        .collect();
    bad.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    bad
}

fn is_fresh(complex: &Complex, vertex: u32) -> bool {
    complex.touched[vertex as usize] + 1 >= complex.pass
}

/// See [`SHARP`].
fn is_sharp(complex: &Complex, tet: u32) -> bool {
    largest_cosine(&complex.corners(complex.tets[tet as usize])) > SHARP
}

/// Whether the slot still holds the tet with this score, because ids are reused.
fn is_still(complex: &Complex, score: f64, tet: u32) -> bool {
    complex.is_alive(tet) && complex.scores[tet as usize].to_bits() == score.to_bits()
}

/// Numbers of changes of a block.
#[derive(Default)]
struct Counts {
    passes: u32,
    moves: usize,
    swaps: usize,
    collapses: usize,
    insertions: usize,
    insertion_steps: usize,
    reconnections: usize,
}

impl Counts {
    fn changes(&self) -> usize {
        self.moves + self.swaps + self.collapses + self.insertions + self.reconnections
    }
}

impl Report {
    fn add(&mut self, counts: &Counts) {
        self.passes = self.passes.max(counts.passes);
        self.moves += counts.moves;
        self.swaps += counts.swaps;
        self.collapses += counts.collapses;
        self.insertions += counts.insertions;
        self.insertion_steps += counts.insertion_steps;
        self.reconnections += counts.reconnections;
    }
}

impl Tools {
    /// Improves one block.
    fn improve(
        &mut self,
        complex: &mut Complex,
        objective: &Objective,
        size: &dyn SizeField,
        settings: &Settings,
    ) -> Counts {
        let mut counts = Counts::default();
        let most_steps = settings.insertion_steps.of(complex.tets.len());
        complex.score_all(objective);
        for pass in 1..=settings.passes {
            complex.pass = pass;
            counts.passes = pass;
            let before = counts.changes();
            self.swap(complex, objective, settings, &mut counts);
            if pass == 1 && objective.legality.is_some() {
                // After the swaps, which repair many without a new vertex.
                self.repair(complex, objective, &mut counts);
            }
            self.smooth(complex, objective, settings, &mut counts);
            self.collapse_and_insert(complex, objective, size, (settings, most_steps), &mut counts);
            let changes = counts.changes() - before;
            if pass > 1 && (changes as f64) < FEW_CHANGES * complex.tets.len() as f64 {
                break;
            }
        }
        counts
    }

    /// Performs swaps, the worst tets first.
    fn swap(
        &mut self,
        complex: &mut Complex,
        objective: &Objective,
        settings: &Settings,
        counts: &mut Counts,
    ) {
        for (score, t) in worst_first(complex, score_of_ratio(settings.target)) {
            if is_still(complex, score, t) {
                counts.swaps += usize::from(self.swapper.improve(complex, objective, t));
            }
        }
    }

    /// Moves the vertices of tets below the target.
    fn smooth(
        &mut self,
        complex: &mut Complex,
        objective: &Objective,
        settings: &Settings,
        counts: &mut Counts,
    ) {
        let enough = score_of_ratio(settings.target);
        let mut wanted = vec![false; complex.points.len()];
        for t in complex.living().filter(|&t| complex.scores[t as usize] < enough) {
            complex.tets[t as usize].iter().for_each(|&v| wanted[v as usize] = true);
        }
        for v in 0..complex.points.len() as u32 {
            if wanted[v as usize] && is_fresh(complex, v) {
                counts.moves += usize::from(self.smoother.improve(complex, objective, v, enough));
            }
        }
    }

    fn repair(&mut self, complex: &mut Complex, objective: &Objective, counts: &mut Counts) {
        let repairs = repair(complex, objective, &mut self.swapper, &mut self.inserter, &mut self.smoother);
        counts.swaps += repairs.swaps;
        counts.insertions += repairs.splits;
    }

    /// Collapses, insertions and reconnections, the worst tets first.
    fn collapse_and_insert(
        &mut self,
        complex: &mut Complex,
        objective: &Objective,
        size: &dyn SizeField,
        (settings, most_steps): (&Settings, usize),
        counts: &mut Counts,
    ) {
        let least = score_of_ratio(settings.change_below.min(settings.target));
        let mut steps = settings.reconnection_steps;
        let mut rescues = RESCUES + complex.tets.len() / TETS_A_RESCUE;
        for (score, t) in worst_first(complex, least) {
            if !is_still(complex, score, t) {
                continue;
            }
            if self.collapser.improve(complex, objective, size, t) {
                counts.collapses += 1;
                continue;
            }
            let is_terrible = (score < score_of_ratio(TERRIBLE) || is_sharp(complex, t)) && rescues > 0;
            rescues -= usize::from(is_terrible);
            let visited = self.inserter.visited();
            let may_insert = counts.insertion_steps < most_steps;
            let inserted = may_insert && self.insert(complex, objective, size, settings, t, is_terrible);
            counts.insertion_steps += self.inserter.visited() - visited;
            if inserted {
                counts.insertions += 1;
            } else if self.reconnector.improve(complex, objective, t, &mut steps) {
                counts.reconnections += 1;
            }
        }
    }

    /// Inserts the vertex that raises the worst score around a tet most.
    fn insert(
        &mut self,
        complex: &mut Complex,
        objective: &Objective,
        size: &dyn SizeField,
        settings: &Settings,
        tet: u32,
        is_terrible: bool,
    ) -> bool {
        let (tries, least_edge) = if is_terrible { (usize::MAX, SHORTER) } else { (1, 1.0) };
        let mut best: Option<(f64, Candidate)> = None;
        for candidate in candidates(complex, tet).into_iter().take(tries) {
            if !self.inserter.find(complex, objective, &mut self.smoother, &candidate.seeds, candidate.point)
            {
                continue;
            }
            // The boundary may be finer than the size field, and so must be the tets along it.
            let (shortest, usual) = self.inserter.shortest_and_usual_edge(complex);
            let wanted = size.size_at(self.inserter.point()).min(usual);
            if shortest < least_edge * settings.shortest_edge * wanted {
                continue;
            }
            if tries == 1 {
                return self.inserter.commit(complex);
            }
            if best.as_ref().is_none_or(|b| self.inserter.worst() > b.0) {
                best = Some((self.inserter.worst(), candidate));
            }
        }
        let Some((_, Candidate { seeds, point })) = best else { return false };
        self.inserter.find(complex, objective, &mut self.smoother, &seeds, point)
            && self.inserter.commit(complex)
    }
}
