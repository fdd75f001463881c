//! Coarse meshes whose snapped lattices are valid: where a child would be inverted, the sizes are lowered.

use super::coarse::{CoarseError, CoarseMesh};
use super::model::Model;
use crate::dist::{self, DistError};
use crate::geometry::Projector;
use crate::mesh::{GlobalId, Mesh, TET_EDGES};
use crate::refine::{self, RefineError};
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

/// Lattices are tried with as many pieces an edge at most: what inverts, does so by then, but for rare
/// cases that the check of all children finds.
const TRIED_PIECES: u32 = 4;

/// Tets around an inverted child are asked to be smaller by this.
const LOWERED: f64 = 0.6;

/// Makes coarse meshes with `make`, which is given the places where sizes must be lowered, until the lattice
/// of `pieces` an edge has no inverted child.
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
        match inverted(model, &coarse.mesh, pieces.min(TRIED_PIECES))? {
            None => {
                coarse.report.size_corrections += round;
                return Ok(coarse);
            }
            Some((_, error)) if round == MOST_ROUNDS => return Err(error.into()),
            Some((tets, _)) => sources.extend(lowered(&coarse.mesh, &tets)),
        }
    }
    unreachable!("the loop ends by itself")
}

/// The coarse tets with inverted children, and the error that says so.
fn inverted(
    model: &Model,
    mesh: &Mesh,
    pieces: u32,
) -> Result<Option<(Vec<GlobalId>, RefineError)>, MendError> {
    // What is not snapped cannot invert.
    let projector = model.projector();
    if pieces == 1 || projector == Projector::Flat {
        return Ok(None);
    }
    let part = dist::from_serial(mesh.clone())?;
    match refine::refine(part, &projector, pieces, &refine::Settings::default()) {
        Ok(_) => Ok(None),
        Err(RefineError::Inverted { coarse, children, faults }) => {
            Ok(Some((coarse.clone(), RefineError::Inverted { coarse, children, faults })))
        }
        Err(other) => Err(other.into()),
    }
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
