//! The stages in order: the one place that knows all of them.

pub mod coarse;
pub mod generate;
pub mod mend;
pub mod names;
pub mod target;

pub use coarse::{CoarseError, CoarseMesh, CoarseReport, Model};
pub use generate::{GenerateSettings, Generated, Wanted, generate};
pub use names::names;
