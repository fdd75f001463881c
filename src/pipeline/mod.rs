//! The stages in order: the one place that knows all of them.

pub mod coarse;
pub mod names;
pub mod target;

pub use coarse::{CoarseError, CoarseMesh, CoarseReport, Model};
pub use names::names;
