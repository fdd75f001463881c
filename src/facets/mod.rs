//! A triangulated surface as geometry: its patches, curves and corners, projection to them, and a better mesh of it.
//!
//! CAD programs export solids as triangles (STL): exact enough, but slivers throughout. [`FacetModel::new`] takes such **facets**
//! of one or several files and finds
//!
//! * the **bodies** they bound (`regions`): whatever a closed surface winds round, and each hollow or solid inside another by
//!   its orientation; files that share facets get interfaces;
//! * **patches**, parted by sharp edges, by changes of group, and where other than two facets meet (`features`); the
//!   **curves** between patches, and the **corners** at their ends.
//!
//! [`FacetProjector`] finds the nearest point on them. [`remesh`](remesh()) makes a surface mesh by a size field, by local changes of the
//! given triangles; [`keep`] takes the triangles as they are. Both end in a [`SurfaceMesh`](crate::surface::SurfaceMesh) that goes into
//! [`ClosedSurface`](crate::volume::ClosedSurface).
//!
//! What is *not* repaired: gaps, holes, facets that intersect. Those are refused with their place, here or by the volume mesher.

mod close_curves;
mod edges;
mod error;
mod features;
mod join;
mod keep;
mod model;
mod normals;
mod projector;
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
mod size;
mod smoothness;
#[cfg(test)]
mod tests;

pub use error::FacetError;
pub use keep::keep;
pub use model::{FacetBody, FacetCurve, FacetModel, FacetPatch, Facets, Marks, Settings};
pub use projector::FacetProjector;
pub use remesh::{RemeshReport, RemeshSettings, deviation, remesh};
pub use size::FacetSize;
pub use smoothness::FacetSmoothness;
