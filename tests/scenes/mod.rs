//! Random scenes of 2 to 12 primitives, judged by an evaluator of their text that shares nothing with the program.
//!
//! `cargo bench --bench scenes` runs a thousand of them and lists what was not meshed and why.

pub mod judge;
pub mod random;
pub mod run;
pub mod scene;
pub mod shape;
