//! Surfaces and meshes in memory.

use super::input::{Fault, coordinate};
use std::collections::BTreeMap;

/// The triangles of one or several closed surfaces.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SurfaceArrays<'a> {
    /// Coordinates. Equal points are merged.
    pub points: &'a [[f64; 3]],
    /// Triangles by point indices, counterclockwise seen from outside.
    pub triangles: &'a [[u32; 3]],
    /// The boundary number of each triangle, positive; if empty, boundaries are found from sharp
    /// edges.
    pub numbers: &'a [u32],
    /// Names of boundary numbers.
    pub names: BTreeMap<u32, String>,
}

/// A tetrahedral mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshArrays<'a> {
    /// Coordinates.
    pub points: &'a [[f64; 3]],
    /// Tets by point indices, all with the same orientation.
    pub tets: &'a [[u32; 4]],
    /// The body number of each tet, positive; empty if there is one body.
    pub bodies: &'a [u32],
    /// Triangles on boundaries and between bodies. Unlisted faces there become boundaries of their
    /// own.
    pub triangles: &'a [[u32; 3]],
    /// The boundary number of each triangle, positive; empty if there is one boundary.
    pub boundaries: &'a [u32],
    /// Names of body numbers.
    pub body_names: BTreeMap<u32, String>,
    /// Names of boundary numbers.
    pub boundary_names: BTreeMap<u32, String>,
}

/// Invalid arrays: the error, with the index.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct ArrayError(String);

impl From<Fault> for ArrayError {
    fn from(fault: Fault) -> Self {
        Self(fault.into_message())
    }
}

/// Refuses coordinates that are not finite, and lists of the wrong length.
pub(super) fn check(
    points: &[[f64; 3]],
    lengths: impl IntoIterator<Item = (&'static str, usize, usize)>,
) -> Result<(), ArrayError> {
    for (k, point) in points.iter().enumerate() {
        let checked = point.iter().try_for_each(|&x| coordinate(x).map(drop));
        checked.map_err(|message| ArrayError(format!("point {k}: {message}")))?;
    }
    for (what, length, expected) in lengths {
        if length != 0 && length != expected {
            return Err(ArrayError(format!("{length} {what} for {expected} elements")));
        }
    }
    Ok(())
}
