//! Triangulated surfaces as geometry: patches, curves and corners, projection, and remeshing.
//!
//! CAD programs export solids as triangles (STL), which are accurate enough but mostly slivers.
//! [`FacetModel::new`] receives such **facets** of one or several files and finds
//!
//! * the **bodies** they bound (`regions`): regions with a winding number other than zero; a closed
//!   surface inside another is a void or a body by its orientation, and files that share facets get
//!   interfaces;
//! * **patches**, bounded by sharp edges, by changes of group, and by edges with other than two
//!   facets (`features`); the **curves** between patches, and the **corners** at their ends.
//!
//! [`FacetProjector`] projects points onto them. [`remesh`](remesh()) makes a surface mesh by a
//! size field, by local changes of the facets; [`keep`](keep()) uses the facets unchanged. Both
//! return a [`SurfaceMesh`](crate::mesher::surface::SurfaceMesh) for
//! [`ClosedSurface`](crate::mesher::volume::ClosedSurface).
//!
//! *Not* repaired are gaps, holes, and facets that intersect. They are errors with their positions,
//! here or in the volume mesher.

mod bodies;
mod close_curves;
mod crossing;
mod error;
mod exact;
mod features;
mod join;
mod keep;
mod model;
mod part;
#[cfg(test)]
mod projector_tests;
mod rays;
mod regions;
mod remesh;
#[cfg(test)]
mod remesh_tests;
#[cfg(test)]
mod samples;
mod sharp;
mod sharp_places;
mod size;
mod small;
mod smoothness;
#[cfg(test)]
mod tests;
mod unfold;

pub use crate::ground::projector::FacetProjector;
pub use bodies::FacetBodies;
pub use crossing::Crossing;
pub use error::FacetError;
pub use exact::of_brep;
pub use keep::keep;
pub use model::{BluntEnd, FacetBody, FacetCurve, FacetModel, FacetPatch, Facets, Marks, Merged, Settings};
pub use part::SurfacePart;
#[cfg(test)]
pub use remesh::deviation;
pub use remesh::{Constraints, Piece, RemeshReport, RemeshSettings, remesh};
pub use sharp_places::{SharpPlace, SharpPlaces};
pub use size::{FacetSize, largest_size};
pub use small::{Grouping, Kept, MergedEdge, MergedFace, MergedSmall, MergedTip, NamedFace, Small, merge};
pub use smoothness::FacetSmoothness;
pub use unfold::unfold;
