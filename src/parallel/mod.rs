//! Distributed meshes: partition, distribution, refinement, migration, halos and checks.

pub mod check;
pub mod decompose;
pub mod distribution;
pub mod halo;
pub mod interfaces;
pub mod migrate;
pub mod partition;
pub mod refine;
pub mod repartition;
pub mod skin;
