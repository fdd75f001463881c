//! The native half of the Python package `tetmill`: geometries, runs, and meshes as numpy arrays.
//!
//! The functions here take checked arguments of plain types. Names, defaults, documentation and
//! most messages about wrong arguments are in the Python half, `python/tetmill`.
//!
//! No function holds the interpreter's lock while the library works. A size function of the user
//! takes it for each call, in one of the library's threads; if another function waited for these
//! threads with the lock held, both would wait forever.
#![forbid(unsafe_code)]

mod arrays;
mod blocks;
mod command;
mod error;
mod geometry;
mod ghosts;
mod levels;
mod mesh;
mod options;
mod picture;
mod ranks;
mod size;
mod watch;
mod write;

use pyo3::prelude::*;

/// The native half of the package `tetmill`.
#[pymodule]
mod _native {
    #[pymodule_export]
    use crate::arrays::{PartArrays, PartSharing, test_addresses};
    #[pymodule_export]
    use crate::blocks::{Block, Blocks};
    #[pymodule_export]
    use crate::command::{run_command, set_threads};
    #[pymodule_export]
    use crate::geometry::{Geometry, generate};
    #[pymodule_export]
    use crate::ghosts::PartGhosts;
    #[pymodule_export]
    use crate::levels::Level;
    #[pymodule_export]
    use crate::mesh::Mesh;
    #[pymodule_export]
    use crate::ranks::test_processes;
    #[pymodule_export]
    use crate::size::{Background, Grid};

    use super::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
