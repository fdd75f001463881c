//! Constructive solid geometry: reads a `.geo` file and finds its corners, curves, patches and
//! bodies.
//!
//! A **surface** is the zero set of a smooth function that is negative inside. A **solid** is a
//! Boolean tree over the half-spaces of surfaces. A **body** is a solid that is meshed (a top-level
//! object). The boundaries of the bodies consist of the geometric entities that a mesh is
//! classified on: **patches** of surfaces, **curves** that bound the patches, and **corners** at
//! the ends of curves.
//!
//! The crate contains no mesh and no parallel code.
#![forbid(unsafe_code)]

pub mod features;
mod geometry;
mod interval;
pub mod language;
mod length;
pub mod primitive;
pub mod project;
pub mod solid;
mod surface;

pub use features::{
    Corner, Curve, CurveCopy, FeatureError, Features, Fin, Inconsistency, Master, Masters, Patch,
    PeriodicMatch, Singular,
};
pub use geometry::{
    Aabb, Body, BodyId, BoundaryLabel, BoundaryOverride, CornerId, CurveId, Cutout, Geometry, Identification,
    OutOfRange, PatchId, Seam, SingularPlace, Singularity, Span, SurfaceId, SurfaceInfo, UserPoint,
};
pub use interval::Interval;
pub use project::{ProjectionFailed, Projector};
pub use solid::Solid;
pub use surface::Surface;

/// A point in space.
pub type Point = nalgebra::Point3<f64>;
/// A vector in space.
pub type Vector = nalgebra::Vector3<f64>;

/// Configuration of property tests: a fixed seed, so every run tries the same cases.
#[cfg(test)]
fn seeded() -> proptest::test_runner::Config {
    proptest::test_runner::Config { rng_seed: proptest::test_runner::RngSeed::Fixed(1), ..Default::default() }
}
