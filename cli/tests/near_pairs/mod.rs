//! Pairs of surfaces with a very small gap, step, overlap or angle between them.

pub mod pair;
pub mod run;
