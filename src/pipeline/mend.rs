//! Coarse meshes whose snapped lattices are valid: where a child would be inverted, the sizes are lowered.

use super::coarse::{CoarseError, CoarseMesh};
use super::model::Model;
use crate::dist::{self, DistError};
use crate::geometry::Projector;
use crate::mesh::{GlobalId, Mesh, TET_EDGES};
use crate::refine::{self, RefineError, Trial};
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
const POOR_ROUNDS: u64 = 3;

/// Lattices are tried with as many pieces an edge at most. With 4 the 4 levels of NETGEN's `matrix` at `very-coarse` had 712
/// inverted tets that no trial had shown; with 16 the directions at vertices are near their limits.
const TRIED_PIECES: u32 = 16;

/// The worst child may lose this much of the worst mean ratio that the coarse mesh has without snapping.
const KEPT: f64 = 0.6;

/// Coarse meshes better than this may lose more: curvature alone costs that much where there are few elements to a radius.
const GOOD: f64 = 0.35;

/// Tets around an inverted child are asked to be smaller by this.
const LOWERED: f64 = 0.6;

/// Makes coarse meshes with `make`, which is given the places where sizes must be lowered, until the lattice
/// of `pieces` an edge has no inverted child, and few poor ones.
///
/// # Errors
/// What failed in the end.
pub fn refinable(
    model: &Model,
    pieces: u32,
    mut make: impl FnMut(&[Source]) -> Result<CoarseMesh, CoarseError>,
) -> Result<CoarseMesh, MendError> {
    let mut sources = Vec::new();
    for round in 0.. {
        let mut coarse = make(&sources)?;
        let tried = try_out(model, &coarse, pieces.min(TRIED_PIECES))?;
        let poor: &[GlobalId] = if round < POOR_ROUNDS { &tried.poor } else { &[] };
        if tried.inverted.is_empty() && poor.is_empty() {
            coarse.report.size_corrections += round;
            return Ok(coarse);
        }
        match tried.error {
            Some(error) if round == MOST_ROUNDS => return Err(error.into()),
            _ => [&tried.inverted, poor].map(|tets| sources.extend(lowered(&coarse.mesh, tets))),
        };
    }
    unreachable!("the loop ends by itself")
}

/// What refinement would make of a coarse mesh.
fn try_out(model: &Model, coarse: &CoarseMesh, pieces: u32) -> Result<Trial, MendError> {
    // What is not snapped cannot invert.
    let projector = model.projector();
    if pieces == 1 || projector == Projector::Flat {
        return Ok(Trial::default());
    }
    let part = dist::from_serial(coarse.mesh.clone())?;
    let least = KEPT * coarse.report.quality.worst_refined.min(GOOD);
    Ok(refine::trial(&part, &projector, pieces, least)?)
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
