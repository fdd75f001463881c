//! What is tried when: worst first, and only where something changed.

use crate::improve::collapse::Collapser;
use crate::improve::complex::Complex;
use crate::improve::insert::Inserter;
use crate::improve::legality::{Legality, Smoothness};
use crate::improve::objective::{Measure, Objective};
use crate::improve::repair::repair;
use crate::improve::smooth::Smoother;
use crate::improve::swap::Swapper;
use crate::kernel::quality::QualitySummary;
use crate::mesh::Mesh;
use crate::size::SizeField;
use serde::{Deserialize, Serialize};

/// How much is done, and by what measure.
#[derive(Clone, Debug)]
pub struct Settings {
    /// How shapes are measured.
    pub measure: Measure,
    /// Passes over the mesh at most.
    pub passes: u32,
    /// Tets with a measure below this are swapped and their vertices moved.
    pub target: f64,
    /// Tets that stay below this are also tried to be removed by collapses and insertions.
    pub change_below: f64,
    /// An insertion makes no edge shorter than this, in units of the wanted size or the usual edge there.
    pub shortest_edge: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { measure: Measure::default(), passes: 8, target: 0.85, change_below: 0.6, shortest_edge: 0.6 }
    }
}

/// What was done.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// The shapes before.
    pub before: QualitySummary,
    /// The shapes after.
    pub after: QualitySummary,
    /// Passes made.
    pub passes: u32,
    /// Times a vertex was moved.
    pub moves: usize,
    /// Edges and faces removed by swaps.
    pub swaps: usize,
    /// Vertices merged into a neighbour.
    pub collapses: usize,
    /// Vertices added, those of repairs included.
    pub insertions: usize,
    /// Illegal tets before; 0 if legality was not asked for.
    pub illegal_before: usize,
    /// Illegal tets that are left.
    pub illegal_left: usize,
    /// Tets with a corner that would turn over, though they are legal, when refined and snapped; before.
    pub folding_before: usize,
    /// Such tets that are left.
    pub folding_left: usize,
    /// Boundary triangles with two edges on one curve: they flatten too, and with them the tets behind them, which
    /// are not counted above. Only the surface mesh can mend them.
    pub illegal_triangles: usize,
}

/// The tools, each with its own scratch space.
#[derive(Default)]
struct Tools {
    swapper: Swapper,
    smoother: Smoother,
    collapser: Collapser,
    inserter: Inserter,
}

/// A pass that changes less than this part of the tets is the last.
const FEW_CHANGES: f64 = 1e-3;

/// Improves the shapes of the tets of all bodies. Boundary triangles, segments and their vertices stay as they are.
///
/// By the measure, the worst tet of the mesh never gets worse. Ids of vertices and tets change; surviving vertices keep
/// their order. The same mesh gives the same result.
///
/// # Panics
/// If the mesh is broken: a tet is not positively oriented, a face has three tets, a boundary triangle is no tet's face.
pub fn improve(mesh: &mut Mesh, size: &dyn SizeField, settings: &Settings) -> Report {
    run(mesh, size, None, settings)
}

/// Like [`improve`], but first of all mends the **illegal** tets, those which would flatten when refined and
/// snapped (see the [module](crate::improve) and [`Smoothness`]), and makes no new ones. Scores, the corners' losses included, never
/// fall, but the straight shape of a tet may, where a corner gains by it.
///
/// # Panics
/// As [`improve`].
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
    let mut complex = Complex::new(mesh);
    let objective = Objective { measure: settings.measure, legality };
    complex.score_all(&objective);
    if let Some(legality) = legality {
        report.illegal_before = illegal(&complex).count();
        report.illegal_triangles = legality.illegal_triangles();
        report.folding_before = folding(&complex, legality);
    }
    let mut tools = Tools::default();
    for pass in 1..=settings.passes {
        complex.pass = pass;
        report.passes = pass;
        let before = report.changes();
        tools.smooth_and_swap(&mut complex, &objective, settings, &mut report);
        if pass == 1 && legality.is_some() {
            // After the swaps, which mend many without a new vertex.
            tools.repair(&mut complex, &objective, &mut report);
        }
        tools.collapse_and_insert(&mut complex, &objective, size, settings, &mut report);
        let changes = report.changes() - before;
        if pass > 1 && (changes as f64) < FEW_CHANGES * complex.tets.len() as f64 {
            break;
        }
    }
    if let Some(legality) = legality {
        report.illegal_left = illegal(&complex).count();
        report.folding_left = folding(&complex, legality);
    }
    complex.store(mesh);
    report.after = QualitySummary::of(mesh);
    report
}

/// The tets that are illegal by their score.
fn illegal(complex: &Complex) -> impl Iterator<Item = u32> + '_ {
    complex.living().filter(|&t| complex.scores[t as usize] <= 0.0)
}

/// How many legal tets have a corner that turns over in the limit of refinement.
fn folding(complex: &Complex, legality: &Legality) -> usize {
    let turns = |t: u32| {
        let tet = complex.tets[t as usize];
        legality.judge(tet).1.is_some_and(|l| l.least_corner(&complex.corners(tet)) <= 0.0)
    };
    complex.living().filter(|&t| complex.scores[t as usize] > 0.0 && turns(t)).count()
}

/// The tets whose score is below `least` and that saw a change since the last pass began, the worst first.
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

/// Whether the slot holds the tet that had this score: ids are used again.
fn is_still(complex: &Complex, score: f64, tet: u32) -> bool {
    complex.is_alive(tet) && complex.scores[tet as usize].to_bits() == score.to_bits()
}

impl Report {
    fn changes(&self) -> usize {
        self.moves + self.swaps + self.collapses + self.insertions
    }
}

impl Tools {
    /// Moves all vertices, then swaps, the worst tets first.
    fn smooth_and_swap(
        &mut self,
        complex: &mut Complex,
        objective: &Objective,
        settings: &Settings,
        report: &mut Report,
    ) {
        for v in 0..complex.points.len() as u32 {
            if is_fresh(complex, v) {
                report.moves += usize::from(self.smoother.improve(complex, objective, v, settings.target));
            }
        }
        for (score, t) in worst_first(complex, settings.target) {
            if is_still(complex, score, t) {
                report.swaps += usize::from(self.swapper.improve(complex, objective, t));
            }
        }
    }

    fn repair(&mut self, complex: &mut Complex, objective: &Objective, report: &mut Report) {
        let repairs = repair(complex, objective, &mut self.swapper, &mut self.inserter, &mut self.smoother);
        report.swaps += repairs.swaps;
        report.insertions += repairs.splits;
    }

    /// Merges vertices and adds some, the worst tets first.
    fn collapse_and_insert(
        &mut self,
        complex: &mut Complex,
        objective: &Objective,
        size: &dyn SizeField,
        settings: &Settings,
        report: &mut Report,
    ) {
        for (score, t) in worst_first(complex, settings.change_below) {
            if !is_still(complex, score, t) {
                continue;
            }
            if self.collapser.improve(complex, objective, size, t) {
                report.collapses += 1;
            } else if self.insert(complex, objective, size, settings, t) {
                report.insertions += 1;
            }
        }
    }

    fn insert(
        &mut self,
        complex: &mut Complex,
        objective: &Objective,
        size: &dyn SizeField,
        settings: &Settings,
        tet: u32,
    ) -> bool {
        let p = complex.corners(complex.tets[tet as usize]);
        let middle = crate::Point::from((p[0].coords + p[1].coords + p[2].coords + p[3].coords) * 0.25);
        if !self.inserter.find(complex, objective, &mut self.smoother, &[tet], middle) {
            return false;
        }
        // The boundary may be finer than the size field, and what lies along it must be so too.
        let (shortest, usual) = self.inserter.shortest_and_usual_edge(complex);
        let wanted = size.size_at(self.inserter.point()).min(usual);
        shortest >= settings.shortest_edge * wanted && self.inserter.commit(complex)
    }
}
