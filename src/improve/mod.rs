//! Improvement of a tetrahedral mesh inside its boundary.

mod collapse;
mod complex;
mod insert;
mod legality;
mod objective;
mod repair;
mod schedule;
mod smooth;
mod swap;

#[cfg(test)]
mod samples;

pub use legality::{GeometrySmoothness, Smoothness};
pub use objective::Measure;
pub use schedule::{Report, Settings, improve, make_refinable};

#[cfg(test)]
mod tests;
