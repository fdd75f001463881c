//! Periodic faces of meshes: which vertex is the image of which.
//!
//! Images are made, not found: an image's segments and triangles are those of its **origin** moved
//! ([`curves`](crate::surface::curves), [`mesh_patches`](crate::surface::mesh_patches)), sizes are the same at a place and its images
//! ([`PeriodicSize`]), and the volume mesher keeps the surface. What remains is to note the pairs, once, on the coarse mesh
//! ([`PeriodicMap::of`]): of vertices, edges and faces, with the order of their corners. In the lattice of refinement a fine
//! vertex is its coarse entity and a place in it, so its partner follows by arithmetic ([`Pairs::fine`]), on every rank, at every
//! level, without a message. Coordinates too: projection to an image is that to its origin, moved.
//!
//! Coordinates of images are those of the origins moved to within rounding, [`check()`] says how far off; not bit by bit, as
//! means are taken on the image, and a vertex with several periods is moved by several motions.

mod check;
mod map;
mod pairs;
pub mod places;
mod size;
#[cfg(test)]
mod tests;
mod ties;

pub use check::{Checked, check};
pub use map::{MapError, PeriodicMap, same_place};
pub use pairs::{Pair, Pairs};
pub use size::PeriodicSize;
pub use ties::ties;

use csg::{Features, PatchId};
use nalgebra::Isometry3;

/// A patch that is the image of another.
#[derive(Clone, Debug, PartialEq)]
pub struct Link {
    /// The number of the identification that says so, from 1.
    pub identification: u32,
    /// The patch.
    pub of: PatchId,
    /// Its image.
    pub image: PatchId,
    /// The motion to the image.
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
