//! Improvement of a tetrahedral mesh inside its boundary.

mod complex;
mod legality;
mod objective;
mod schedule;
mod smooth;
mod swap;

#[cfg(test)]
mod samples;

pub use legality::{GeometrySmoothness, Smoothness};
pub use objective::Measure;
pub use schedule::{Report, Settings, improve, make_refinable};
