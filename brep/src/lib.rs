//! Boundary representations of CAD programs: reads STEP files and the BREP text of OpenCASCADE,
//! evaluates and projects to their curves and surfaces, and tessellates their faces.
//!
//! A [`Model`] is read by [`Model::read_step`] or [`Model::read`]. It has **bodies** (solids),
//! **patches** (faces) that bound them, **curves** (edges) that bound the patches, and **corners**
//! (vertices) at the ends of curves. A face that two solids share is one patch, with a body on each
//! side. [`Model::imprint`] makes such patches where solids touch in parts of faces.
//!
//! [`Tessellation::of`] divides each curve once and triangulates each patch in its parameters, so
//! that the triangles of neighbouring patches fit.
//!
//! *Not* here: repair of gaps between faces, and shapes without solids.
#![forbid(unsafe_code)]

pub mod bspline;
mod build;
mod chart;
mod curve;
mod error;
mod imprint;
mod join;
mod keep;
mod model;
mod nearest;
mod overlaps;
mod pieces;
mod placement;
mod project;
mod read;
mod shapes;
mod step;
mod straight;
mod surface;
pub mod tessellate;
#[cfg(test)]
mod tests;

pub use curve::Curve;
pub use error::BrepError;
pub use model::{Corner, EdgeCurve, Fin, Model, On, Patch};
pub use nearest::{nearest_on_curve, nearest_on_surface};
pub use overlaps::OverlapTo;
pub use pieces::{Cut, Piece};
pub use placement::Placement;
pub use project::{CurveFoot, SurfaceFoot, project_to_curve, project_to_surface};
pub use step::Unit;
pub use surface::{Jet, Profile, Surface};
pub use tessellate::{Settings, Tessellation, Triangle};

/// A point in space.
pub type Point = nalgebra::Point3<f64>;
/// A vector in space.
pub type Vector = nalgebra::Vector3<f64>;
