//! Foundations: exact geometry, ranks, meshes, projection to a geometry, sizes.
//!
//! Dependencies only point down: `kernel` and `comm` use nothing else of the crate, `mesh` is above
//! them, `projector` and `size` above `mesh`.

pub mod comm;
pub mod error;
pub mod kernel;
pub mod memory;
pub mod mesh;
pub mod ordered;
pub mod progress;
pub mod projector;
pub mod size;
