//! Makes coarse meshes whose snapped lattices are valid. Where a child would be inverted or poor,
//! the sizes are lowered; remaining bad children are repaired by curving edges. Between facets
//! edges are curved first, because smaller tets are as bad at a bend.

use super::coarse_error::CoarseError;
use super::coarse_mesh::CoarseMesh;
use super::error::Error;
use super::model::Model;
use super::retries::{Budget, INVERTED, INVERTED_FACETS, POOR};
use crate::Point;
use crate::ground::comm::Communicator;
use crate::ground::mesh::{GlobalId, Order, QualitySummary, TET_EDGES};
use crate::ground::progress::Work;
use crate::ground::projector::Projector;
use crate::ground::size::Source;
use crate::parallel::distribution::{self, DistMesh};
use crate::parallel::refine::{self, EdgeDisplacements, Least, Trial};

/// Maximum number of subdivisions of an edge in refinement tests. 4 are too few: NETGEN's `matrix`
/// at `very-coarse` then has 712 inverted tets at 4 levels. With 16 the directions at vertices are
/// near their limits.
const TRIED_PIECES: u32 = 16;

/// Fraction of the coarse mesh's smallest dihedral angle, and of its worst mean ratio without
/// snapping, that the worst child must keep.
const KEPT: f64 = 0.6;

/// Fraction of the smallest dihedral angle that children should keep where curved edges suffice ...
const POLISHED: f64 = 0.95;
/// ... unless they have this angle (degrees).
const GOOD_ANGLE: f64 = 20.0;
/// The most subdivisions of an edge in the search for these: the work grows with the cube.
const POLISHED_PIECES: u32 = 8;

/// Mean ratios above this may lose more: curvature alone causes that loss where there are few
/// elements per radius.
const GOOD: f64 = 0.35;

/// Scaled Jacobian that the worst child of second order must have: the threshold of other programs
/// that optimise such meshes (Gmsh's `HighOrderThresholdMin`).
const JACOBIAN: f64 = 0.1;

/// Factor on the sizes around an inverted child.
const LOWERED: f64 = 0.6;

/// Margin above the required quality below which a child is improved again, and surplus that
/// suffices, for curved edges: in mean ratio, and in units of the regular tet's angle.
const BENT: [f64; 2] = [0.01, 0.03];

/// Edges of a coarse mesh or part are curved for at most this many bad tets, because each takes a
/// tenth of a second.
const MOST_BENT: usize = 100;

/// Makes coarse meshes with `make`, which receives the sources where sizes must be lowered, until
/// the lattice of `pieces` subdivisions an edge has neither invalid nor poor children. If some
/// remain, edges of the best mesh are curved. The second value of `make` is passed through. A mesh
/// whose number of tets is of no use is returned as it is, unless one before was of use.
///
/// # Errors
/// The last failure.
pub fn refinable<T>(
    model: &Model,
    (pieces, order): (u32, Order),
    budget: &Budget,
    is_of_use: &dyn Fn(u64) -> bool,
    mut make: impl FnMut(&[Source]) -> Result<(CoarseMesh, T), CoarseError>,
) -> Result<(CoarseMesh, T), Error> {
    let how = (pieces.min(TRIED_PIECES / order.degree()), order);
    let is_faceted = matches!(model, Model::Facets(solid) if solid.exact.is_none());
    let most_rounds = if is_faceted { INVERTED_FACETS } else { INVERTED };
    let mut sources = Vec::new();
    let mut best: Option<(Trial, (CoarseMesh, T))> = None;
    let bent = |(tried, mut made): (Trial, (CoarseMesh, T))| {
        bend(model, &mut made.0, &tried, how)?;
        Ok(made)
    };
    for round in 0.. {
        let mut made = make(&sources)?;
        if !is_of_use(made.0.report.tets) {
            return best.map_or(Ok(made), bent);
        }
        made.0.report.size_corrections += round;
        let mut tried = refinement_test(model, &made.0, how)?;
        if is_faceted && !tried.inverted.is_empty() {
            tried = bend_inverted(model, &mut made.0, tried, how)?;
        }
        for tets in [&tried.inverted, &tried.poor] {
            let mesh = &made.0.mesh;
            let corners = |&tet: &GlobalId| mesh.tets[tet as usize].map(|v| mesh.points[v.index()]);
            sources.extend(lowered(tets.iter().map(corners)));
        }
        if tried.inverted.is_empty() {
            if tried.poor.is_empty() {
                polish(model, &mut made.0, &tried, how)?;
                return Ok(made);
            }
            if best.as_ref().is_none_or(|best| is_better((&tried, &made.0), (&best.0, &best.1.0))) {
                best = Some((tried, made));
            }
        } else if best.is_none() && (round == most_rounds || !budget.has_meshes()) {
            let mut coarse = made.0;
            if !is_faceted {
                bend(model, &mut coarse, &tried, how)?;
            }
            return match tried.error {
                Some(error) if coarse.displacements.is_empty() => Err(error.into()),
                _ => Ok((coarse, made.1)),
            };
        }
        if (round >= POOR || budget.is_spent())
            && let Some(best) = best
        {
            return bent(best);
        }
    }
    unreachable!("the loop ends by itself")
}

/// Whether the first of two tested meshes is better: by the smallest angle of the poor children,
/// then by the angles of the coarse tets.
fn is_better(new: (&Trial, &CoarseMesh), old: (&Trial, &CoarseMesh)) -> bool {
    let by_children = new.0.smallest_dihedral.total_cmp(&old.0.smallest_dihedral);
    by_children.then_with(|| new.1.report.quality.compare_angles(&old.1.report.quality)).is_gt()
}

/// The quality of children, by that of the coarse tets.
struct Bounds {
    /// That is required.
    least: Least,
    /// The smallest dihedral angle (degrees) for which edges are curved, but no sizes lowered.
    wanted: f64,
}

impl Bounds {
    fn of_mesh(coarse: &CoarseMesh) -> Self {
        let quality = &coarse.report.quality;
        Self::new(quality.worst_refined, quality.smallest_dihedral)
    }

    /// By [`QualitySummary::worst_refined`] and [`QualitySummary::smallest_dihedral`].
    fn new(worst_refined: f64, smallest_dihedral: f64) -> Self {
        let least = Least {
            mean_ratio: KEPT * worst_refined.min(GOOD),
            dihedral: KEPT * smallest_dihedral,
            scaled_jacobian: JACOBIAN,
        };
        Self { least, wanted: (POLISHED * smallest_dihedral).min(GOOD_ANGLE) }
    }

    /// The bounds for curved edges: the wanted angle, and the mean ratio of the tested mesh, which
    /// should not be given for angles.
    fn polished(&self, before: &Trial) -> Least {
        Least {
            mean_ratio: self.least.mean_ratio.max(before.mean_ratio),
            dihedral: self.least.dihedral.max(self.wanted),
            ..self.least
        }
    }
}

/// How edges are curved for children of this quality.
fn bent(least: Least, (pieces, order): How) -> refine::mend::Settings {
    let [margin, enough] = BENT;
    refine::mend::Settings { pieces, least, margin, enough, order, ..Default::default() }
}

/// Refinement test of a coarse mesh: finds its bad children.
fn refinement_test(model: &Model, coarse: &CoarseMesh, (pieces, order): How) -> Result<Trial, Error> {
    // Without snapping no child can be inverted.
    let projector = model.projector();
    if pieces * order.degree() == 1 || projector == Projector::Flat {
        return Ok(Trial::default());
    }
    let part = distribution::from_serial(coarse.mesh.clone())?;
    let settings = refine::Settings { order, ..refine::Settings::default() };
    let Bounds { least, wanted } = Bounds::of_mesh(coarse);
    Ok(refine::trial(&part, &projector, pieces, &settings, least, wanted)?)
}

/// The subdivisions of an edge and the order of the elements of a refinement test.
type How = (u32, Order);

/// Curves edges of a coarse mesh with bad children, if that improves the worst of them.
fn bend(model: &Model, coarse: &mut CoarseMesh, before: &Trial, how: How) -> Result<(), Error> {
    if let Some((displacements, after)) = curved(model, coarse, before, how)? {
        let is_better = after.poor.is_empty() || after.smallest_dihedral > before.smallest_dihedral;
        if after.inverted.is_empty() && is_better {
            coarse.displacements = displacements;
        }
    }
    Ok(())
}

/// Curves edges of a coarse mesh without bad children, where angles of children are smaller than
/// wanted. Those of faceted geometries are curved already.
fn polish(model: &Model, coarse: &mut CoarseMesh, before: &Trial, how: How) -> Result<(), Error> {
    if before.improvable.is_empty() || !coarse.displacements.is_empty() {
        return Ok(());
    }
    let (pieces, order) = how;
    let least = Bounds::of_mesh(coarse).polished(before);
    let settings = bent(least, (pieces.min(POLISHED_PIECES), order));
    let part = distribution::from_serial(coarse.mesh.clone())?;
    // The whole mesh: its ids are its indices.
    let suspects: Vec<u32> = before.improvable.iter().take(MOST_BENT).map(|id| *id as u32).collect();
    coarse.displacements = refine::mend_near(&part, &suspects, &model.projector(), &settings)?.displacements;
    Ok(())
}

/// Curves edges of a coarse mesh with inverted children, if none are left then. Returns the
/// refinement test of the mesh, or that with the curved edges if fewer are inverted: sizes need to
/// be lowered only where curved edges do not help.
fn bend_inverted(model: &Model, coarse: &mut CoarseMesh, before: Trial, how: How) -> Result<Trial, Error> {
    Ok(match curved(model, coarse, &before, how)? {
        Some((displacements, after)) if after.inverted.is_empty() => {
            coarse.displacements = displacements;
            after
        }
        Some((_, after)) if after.inverted.len() < before.inverted.len() => after,
        _ => before,
    })
}

/// Searches curved edges for a coarse mesh with few bad children; returns them with the refinement
/// test.
fn curved(
    model: &Model,
    coarse: &CoarseMesh,
    before: &Trial,
    (pieces, order): How,
) -> Result<Option<(EdgeDisplacements, Trial)>, Error> {
    if before.poor.len() + before.inverted.len() > MOST_BENT {
        return Ok(None);
    }
    let (part, projector, least) =
        (distribution::from_serial(coarse.mesh.clone())?, model.projector(), Bounds::of_mesh(coarse).least);
    let displacements = refine::mend(&part, &projector, &bent(least, (pieces, order)))?.displacements;
    let settings = refine::Settings { displacements, order, ..refine::Settings::default() };
    let after = refine::trial(&part, &projector, pieces, &settings, least, 0.0)?;
    Ok(Some((settings.displacements, after)))
}

/// **Collective.** Searches curved edges for distributed parts whose refinement would have bad
/// children. Edges that several parts share stay straight.
///
/// # Errors
/// The same on all ranks: points that cannot be projected, not enough memory.
pub fn displaced(
    comm: &dyn Communicator,
    part: &DistMesh,
    projector: &Projector,
    (pieces, order): How,
    work: &Work,
) -> Result<EdgeDisplacements, Error> {
    let pieces = pieces.min(TRIED_PIECES / order.degree());
    if pieces * order.degree() == 1 || *projector == Projector::Flat {
        return Ok(EdgeDisplacements::default());
    }
    let QualitySummary { worst_refined, smallest_dihedral, tets, .. } =
        QualitySummary::of_tets(&part.points, &part.tets);
    // A part without tets has no worst one.
    let mine = if tets == 0 { [1.0, 180.0] } else { [worst_refined, smallest_dihedral] };
    let [worst_refined, smallest_dihedral] = comm.all_reduce_min_f64(mine)?;
    let bounds = Bounds::new(worst_refined, smallest_dihedral);
    let settings = refine::Settings { order, ..refine::Settings::default() };
    let mend = || {
        let trial = refine::trial(part, projector, pieces, &settings, bounds.least, bounds.wanted)?;
        work.proceed()?;
        let local = |id: &GlobalId| part.tet_ids.binary_search(id).expect("a tet of the part") as u32;
        // The worst come first, if there are too many.
        let bad = trial.inverted.iter().chain(&trial.poor).chain(&trial.improvable).take(MOST_BENT);
        let suspects: Vec<u32> = bad.map(local).collect();
        let settings = bent(bounds.polished(&trial), (pieces, order));
        Ok::<_, Error>(refine::mend_near(part, &suspects, projector, &settings)?.displacements)
    };
    let mine = comm.agree(mend())?;
    let (ids, middles): (Vec<GlobalId>, Vec<[f64; 3]>) = mine.edges().iter().copied().unzip();
    let ids = comm.all_gather(&ids)?.concat();
    Ok(ids.into_iter().zip(comm.all_gather(&middles)?.concat()).collect())
}

/// Sources for smaller tets around those with the given corners: at corners and edge midpoints,
/// because one at the centre would not affect the boundary through the grading.
pub fn lowered(tets: impl Iterator<Item = [Point; 4]>) -> Vec<Source> {
    let sources = |corners: [Point; 4]| {
        let lengths = TET_EDGES.map(|[i, j]| (corners[j] - corners[i]).norm());
        let size = LOWERED * lengths.iter().sum::<f64>() / 6.0;
        let middles = TET_EDGES.map(|[i, j]| nalgebra::center(&corners[i], &corners[j]));
        corners.into_iter().chain(middles).map(move |point| Source { point, size })
    };
    tets.flat_map(sources).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_best_children_decide_which_mesh_is_kept_and_then_the_coarse_angles() {
        let tried = |smallest_dihedral: f64| Trial { smallest_dihedral, ..Trial::default() };
        let coarse = |smallest_dihedral: f64| {
            let mut coarse = CoarseMesh::default();
            coarse.report.quality = QualitySummary { smallest_dihedral, ..QualitySummary::default() };
            coarse
        };
        let (good, bad) = (coarse(20.0), coarse(10.0));
        assert!(is_better((&tried(9.0), &bad), (&tried(8.0), &good)));
        assert!(is_better((&tried(8.0), &good), (&tried(8.0), &bad)));
        assert!(!is_better((&tried(8.0), &bad), (&tried(8.0), &bad)), "the first of equal ones is kept");
    }
}
