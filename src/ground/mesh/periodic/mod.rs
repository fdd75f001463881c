//! Periodic faces of meshes: which vertex is a periodic copy of which.
//!
//! Copies are constructed, not searched for: the segments and triangles of a copy are those of its
//! **master**, moved ([`curves`](crate::mesher::surface::curves),
//! [`mesh_patches`](crate::mesher::surface::mesh_patches)), sizes are equal at a point and its
//! copies ([`PeriodicSize`]), and the volume mesher keeps the surface. It remains to record the
//! pairs of vertices, edges and faces, with the order of their corners, once, on the coarse mesh
//! ([`PeriodicMap::of`]). A fine vertex is given by its coarse entity and a position in it, so its
//! partner is computed on every rank and level without messages ([`Pairs::fine`]). Coordinates need
//! no messages either: the projection onto a copy is that onto its master, moved.
//!
//! Coordinates of copies equal those of the moved masters up to rounding, as [`check()`] measures;
//! not bitwise, because means are computed on the copy, and a vertex with several periods is moved
//! by several motions.

mod faces;
mod map;
mod pairs;

pub(crate) use faces::{PeriodicFace, PeriodicFaces, is_linked};
pub use map::{MapError, PeriodicMap, same_place};
pub use pairs::{Pair, Pairs};

use csg::{Features, PatchId};
use nalgebra::Isometry3;

/// A patch that is a periodic copy of another.
#[derive(Clone, Debug, PartialEq)]
pub struct Link {
    /// The number of its identification, from 1.
    pub identification: u32,
    /// The original patch.
    pub of: PatchId,
    /// Its copy.
    pub image: PatchId,
    /// The motion from the patch to its copy.
    pub motion: Isometry3<f64>,
}

/// The links of a geometry.
pub fn links(features: &Features) -> Vec<Link> {
    let mut links = Vec::new();
    for (identification, identified) in (1..).zip(&features.identified) {
        let link =
            |&[of, image]: &[PatchId; 2]| Link { identification, of, image, motion: identified.motion };
        links.extend(identified.patches.iter().map(link));
    }
    links
}
