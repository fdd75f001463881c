//! Random scenes of 2 to 12 primitives, checked by an independent evaluator of their text.
//!
//! `cargo bench --bench scenes` runs a thousand of them and lists those not meshed, with the
//! reasons.

pub mod judge;
pub mod random;
pub mod run;
pub mod scene;
pub mod shape;
