//! tetmill: from solid geometry to very large, partitioned tetrahedral meshes, in parallel.
#![forbid(unsafe_code)]

pub mod across;
pub mod check;
pub mod comm;
pub mod decompose;
pub mod dist;
pub mod error;
pub mod facets;
pub mod geometry;
pub mod halo;
pub mod improve;
pub mod inspect;
pub mod io;
pub mod kernel;
pub mod memory;
pub mod mesh;
pub mod migrate;
pub mod partition;
pub mod periodic;
pub mod picture;
pub mod pipeline;
pub mod progress;
pub mod quality;
pub mod refine;
pub mod repartition;
pub mod report;
pub mod size;
pub mod skin;
pub mod surface;
pub mod volume;

pub use csg::{Point, Vector};
