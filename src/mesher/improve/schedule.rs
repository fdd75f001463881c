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
use crate::mesher::improve::objective::{Objective, score_of_ratio};
use crate::mesher::improve::reconnect::Reconnector;
use crate::mesher::improve::repair::{Candidate, candidates, repair};
use crate::mesher::improve::settings::Settings;
use crate::mesher::improve::smooth::Smoother;
use crate::mesher::improve::swap::Swapper;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

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

/// See [`TERRIBLE`].
const SHORTER: f64 = 0.5;

/// The number of tets per block and pass that may be treated in this way, in addition to one of
/// [`TETS_A_RESCUE`]. It limits the time: in surfaces of needles nearly all tets are below
/// [`TERRIBLE`], and each attempt takes a quarter of a millisecond.
const RESCUES: usize = 100;

/// See [`RESCUES`].
const TETS_A_RESCUE: usize = 50;

/// Cosine of 16°: tets with a smaller dihedral angle at last get the same treatment as those below
/// [`TERRIBLE`]. In one layer of tets between independent triangulations, a few of 10° to 15° have
/// mean ratios above it.
const SHARP: f64 = 0.961_261_695_938_318_9;

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

/// [`make_refinable`] if the smoothness of the geometry is given, because the mesh will be refined;
/// otherwise [`improve`].
///
/// # Panics
/// Like [`improve`].
pub fn improve_for(
    mesh: &mut Mesh,
    size: &dyn SizeField,
    smoothness: Option<&dyn Smoothness>,
    settings: &Settings,
) -> Report {
    match smoothness {
        Some(smoothness) => make_refinable(mesh, size, smoothness, settings),
        None => improve(mesh, size, settings),
    }
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
                    let Block { complex, vertices, .. } = &mut block;
                    tools.improve(complex, &objective, size, settings, &|v| cut.is_on_seam(vertices, v))
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

/// A tet with a small dihedral angle.
struct Sharp {
    /// The cosine of the angle.
    cosine: f64,
    score: f64,
    tet: u32,
}

/// The tets below the target that are sharper than [`SHARP`], the sharpest first.
fn sharpest_first(complex: &Complex, settings: &Settings) -> Vec<Sharp> {
    let least = score_of_ratio(settings.change_below.min(settings.target));
    let measured = |tet: u32| {
        let cosine = largest_cosine(&complex.corners(complex.tets[tet as usize]));
        Sharp { cosine, score: complex.scores[tet as usize], tet }
    };
    let low = complex.living().filter(|&t| complex.scores[t as usize] < least);
    let mut sharp: Vec<Sharp> = low.map(measured).filter(|sharp| sharp.cosine > SHARP).collect();
    sharp.sort_unstable_by(|a, b| b.cosine.total_cmp(&a.cosine).then(a.tet.cmp(&b.tet)));
    sharp
}

/// See [`RESCUES`].
fn most_rescues(complex: &Complex) -> usize {
    RESCUES + complex.tets.len() / TETS_A_RESCUE
}

fn is_fresh(complex: &Complex, vertex: u32) -> bool {
    complex.touched[vertex as usize] + 1 >= complex.pass
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
    /// Improves one block; `is_on_seam` returns whether a vertex has tets in other blocks.
    fn improve(
        &mut self,
        complex: &mut Complex,
        objective: &Objective,
        size: &dyn SizeField,
        settings: &Settings,
        is_on_seam: &dyn Fn(u32) -> bool,
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
        // Those on a seam are left to the next round, whose other operations may do without a
        // vertex.
        let mut sharp = sharpest_first(complex, settings);
        sharp.retain(|sharp| !complex.tets[sharp.tet as usize].iter().any(|&v| is_on_seam(v)));
        self.blunt(complex, objective, size, (settings, most_steps), sharp, &mut counts);
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
        let mut rescues = most_rescues(complex);
        for (score, t) in worst_first(complex, least) {
            if !is_still(complex, score, t) {
                continue;
            }
            if self.collapser.improve(complex, objective, size, t) {
                counts.collapses += 1;
                continue;
            }
            let is_terrible = score < score_of_ratio(TERRIBLE) && rescues > 0;
            rescues -= usize::from(is_terrible);
            let may_insert = counts.insertion_steps < most_steps;
            if may_insert && self.insert(complex, objective, size, (settings, is_terrible), t, counts) {
                continue;
            }
            if self.reconnector.improve(complex, objective, t, &mut steps) {
                counts.reconnections += 1;
            }
        }
    }

    /// Insertions at sharp tets. They make no sharper ones, which the scores alone would allow.
    fn blunt(
        &mut self,
        complex: &mut Complex,
        objective: &Objective,
        size: &dyn SizeField,
        (settings, most_steps): (&Settings, usize),
        mut sharp: Vec<Sharp>,
        counts: &mut Counts,
    ) {
        sharp.truncate(most_rescues(complex));
        for Sharp { cosine, score, tet: t } in sharp {
            if is_still(complex, score, t) && counts.insertion_steps < most_steps {
                let strict = Objective { sharpest: cosine.min(objective.sharpest), ..*objective };
                self.insert(complex, &strict, size, (settings, true), t, counts);
            }
        }
    }

    /// Inserts the vertex that raises the worst score around a tet most, and counts it.
    fn insert(
        &mut self,
        complex: &mut Complex,
        objective: &Objective,
        size: &dyn SizeField,
        (settings, is_terrible): (&Settings, bool),
        tet: u32,
        counts: &mut Counts,
    ) -> bool {
        let visited = self.inserter.visited();
        let inserted = self.try_insert(complex, objective, size, (settings, is_terrible), tet);
        counts.insertion_steps += self.inserter.visited() - visited;
        counts.insertions += usize::from(inserted);
        inserted
    }

    fn try_insert(
        &mut self,
        complex: &mut Complex,
        objective: &Objective,
        size: &dyn SizeField,
        (settings, is_terrible): (&Settings, bool),
        tet: u32,
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
