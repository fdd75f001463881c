//! Coarse meshes whose snapped lattices are valid: where a child would be inverted or poor, the sizes are lowered; what then remains is mended by
//! bending edges.

use super::coarse::{CoarseError, CoarseMesh};
use super::model::Model;
use crate::dist::{self, DistError};
use crate::geometry::Projector;
use crate::mesh::{GlobalId, Mesh, TET_EDGES};
use crate::refine::{self, Bends, Least, RefineError, Trial};
use crate::size::Source;

/// Why no coarse mesh was found that can be refined.
#[derive(Debug, thiserror::Error)]
pub enum MendError {
    /// There is no coarse mesh at all.
    #[error(transparent)]
    Coarse(#[from] CoarseError),
    /// The coarse mesh cannot be refined.
    #[error(transparent)]
    Refine(#[from] RefineError),
    /// The coarse mesh is not one.
    #[error(transparent)]
    Dist(#[from] DistError),
}

/// Rounds of lowering sizes before the mender gives up.
const MOST_ROUNDS: u64 = 20;

/// Rounds in which sizes are lowered also where children would only be poor.
const POOR_ROUNDS: u64 = 5;

/// Lattices are tried with as many pieces an edge at most. With 4 the 4 levels of NETGEN's `matrix` at `very-coarse` had 712
/// inverted tets that no trial had shown; with 16 the directions at vertices are near their limits.
const TRIED_PIECES: u32 = 16;

/// What the worst child must keep of the coarse mesh's smallest dihedral angle, and of its worst mean ratio without snapping.
const KEPT: f64 = 0.6;

/// Mean ratios better than this may lose more: curvature alone costs that much where there are few elements to a radius.
const GOOD: f64 = 0.35;

/// Tets around an inverted child are asked to be smaller by this.
const LOWERED: f64 = 0.6;

/// What worst children must have more than what is asked for not to be worked on again, and what is enough, when edges are bent: in
/// mean ratio, and in units of the regular tet's angle.
const BENT: [f64; 2] = [0.01, 0.03];

/// So many tets at most are worth bending edges around: each takes a tenth of a second.
const MOST_BENT: usize = 100;

/// Makes coarse meshes with `make`, which is given the places where sizes must be lowered, until the lattice
/// of `pieces` an edge has no inverted child, and no poor one. Where some stay, the best of the meshes is taken and edges are bent.
/// What `make` says of its mesh is passed on.
///
/// # Errors
/// What failed in the end.
pub fn refinable<T>(
    model: &Model,
    pieces: u32,
    mut make: impl FnMut(&[Source]) -> Result<(CoarseMesh, T), CoarseError>,
) -> Result<(CoarseMesh, T), MendError> {
    let mut sources = Vec::new();
    let mut best: Option<(Trial, (CoarseMesh, T))> = None;
    for round in 0.. {
        let mut made = make(&sources)?;
        made.0.report.size_corrections += round;
        let tried = try_out(model, &made.0, pieces.min(TRIED_PIECES))?;
        for tets in [&tried.inverted, &tried.poor] {
            sources.extend(lowered(&made.0.mesh, tets));
        }
        if tried.inverted.is_empty() {
            if tried.poor.is_empty() {
                return Ok(made);
            }
            if best.as_ref().is_none_or(|(before, _)| tried.smallest_dihedral > before.smallest_dihedral) {
                best = Some((tried, made));
            }
        } else if round == MOST_ROUNDS {
            let mut coarse = made.0;
            bend(model, &mut coarse, &tried, pieces.min(TRIED_PIECES))?;
            return match tried.error {
                Some(error) if coarse.bends.is_empty() => Err(error.into()),
                _ => Ok((coarse, made.1)),
            };
        }
        if round >= POOR_ROUNDS
            && let Some((tried, mut made)) = best
        {
            bend(model, &mut made.0, &tried, pieces.min(TRIED_PIECES))?;
            return Ok(made);
        }
    }
    unreachable!("the loop ends by itself")
}

/// What is wanted of the children of a coarse mesh.
fn least(coarse: &CoarseMesh) -> Least {
    let quality = &coarse.report.quality;
    Least { mean_ratio: KEPT * quality.worst_refined.min(GOOD), dihedral: KEPT * quality.smallest_dihedral }
}

/// What refinement would make of a coarse mesh.
fn try_out(model: &Model, coarse: &CoarseMesh, pieces: u32) -> Result<Trial, MendError> {
    // What is not snapped cannot invert.
    let projector = model.projector();
    if pieces == 1 || projector == Projector::Flat {
        return Ok(Trial::default());
    }
    let part = dist::from_serial(coarse.mesh.clone())?;
    Ok(refine::trial(&part, &projector, pieces, &Bends::default(), least(coarse))?)
}

/// Bends edges of a coarse mesh for which a trial found bad children, if that makes the worst of them better.
fn bend(model: &Model, coarse: &mut CoarseMesh, before: &Trial, pieces: u32) -> Result<(), MendError> {
    if before.poor.len() + before.inverted.len() > MOST_BENT {
        return Ok(());
    }
    let (part, projector, least) =
        (dist::from_serial(coarse.mesh.clone())?, model.projector(), least(coarse));
    let [margin, enough] = BENT;
    let settings = refine::mend::Settings { pieces, least, margin, enough, ..Default::default() };
    let bends = refine::mend(&part, &projector, &settings)?.bends;
    let after = refine::trial(&part, &projector, pieces, &bends, least)?;
    let is_better = after.poor.is_empty() || after.smallest_dihedral > before.smallest_dihedral;
    if after.inverted.is_empty() && is_better {
        coarse.bends = bends;
    }
    Ok(())
}

/// Sources that ask for smaller tets where these are: at their corners and the middles of their edges, as
/// one in the middle would not reach the boundary through the grading.
pub fn lowered(mesh: &Mesh, tets: &[GlobalId]) -> Vec<Source> {
    let sources = |tet: &GlobalId| {
        let corners = mesh.tets[*tet as usize].map(|v| mesh.points[v.index()]);
        let lengths = TET_EDGES.map(|[i, j]| (corners[j] - corners[i]).norm());
        let size = LOWERED * lengths.iter().sum::<f64>() / 6.0;
        let middles = TET_EDGES.map(|[i, j]| nalgebra::center(&corners[i], &corners[j]));
        corners.into_iter().chain(middles).map(move |point| Source { point, size })
    };
    tets.iter().flat_map(sources).collect()
}
