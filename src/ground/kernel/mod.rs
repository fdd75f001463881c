//! Geometric kernel: exact predicates, simplices, shape measures, search, orderings.

pub(crate) mod buckets;
pub(crate) mod fixed;
pub(crate) mod hash;
pub mod hilbert;
mod integers;
pub mod jacobian;
pub(crate) mod nearest;
pub(crate) mod places;
pub mod predicates;
pub mod quality;
pub mod random;
pub(crate) mod sets;
pub mod simplex;
pub mod sphere;
pub(crate) mod tree;
pub(crate) mod vector;
