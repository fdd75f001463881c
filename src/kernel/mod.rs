//! Geometry that every stage rests on: exact signs, simplices, shape measures, search, order.

pub(crate) mod fixed;
pub(crate) mod hash;
pub mod hilbert;
mod integers;
pub(crate) mod nearest;
pub mod predicates;
pub mod quality;
pub mod random;
pub mod simplex;
pub mod sphere;
pub(crate) mod tree;
pub(crate) mod vector;
