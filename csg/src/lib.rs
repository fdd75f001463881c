//! Constructive solid geometry: from the text of a `.geo` file to corners, curves, patches and bodies.
//!
//! A **surface** is the zero set of a smooth function, negative inside. A **solid** is a Boolean
//! tree over the half-spaces of surfaces. A **body** is a solid that is to be meshed (a top-level
//! object). Where the boundaries of bodies meet surfaces, they leave the geometric entities that a
//! mesh is classified on: **corners**, **curves** between them, **patches** bounded by curves.
//!
//! This crate knows no mesh and no ranks.
#![forbid(unsafe_code)]

pub mod features;
pub mod geometry;
pub mod interval;
pub mod language;
pub mod primitive;
pub mod project;
pub mod solid;
pub mod surface;

pub use features::{
    Corner, Curve, FeatureError, Features, Fin, Identified, Origin, Origins, Patch, Singular,
};
pub use geometry::{
    Aabb, Body, BodyId, BoundaryLabel, BoundaryOverride, CornerId, CurveId, Cutout, Geometry, Identification,
    PatchId, Seam, SingularPlace, Singularity, SurfaceId,
};
pub use interval::Interval;
pub use project::{ProjectionFailed, Projector};
pub use solid::Solid;
pub use surface::Surface;

/// A point in space.
pub type Point = nalgebra::Point3<f64>;
/// A vector in space.
pub type Vector = nalgebra::Vector3<f64>;

/// Property tests that try the same cases on every run.
#[cfg(test)]
fn seeded() -> proptest::test_runner::Config {
    proptest::test_runner::Config { rng_seed: proptest::test_runner::RngSeed::Fixed(1), ..Default::default() }
}
