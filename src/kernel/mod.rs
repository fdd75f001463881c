//! Geometry that every stage rests on: exact signs, simplices, shape measures, search, order.

pub mod predicates;
pub mod quality;
pub mod simplex;
