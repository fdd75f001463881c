//! Meshes that do not fit the memory, the disk or the numbers of a format.

use crate::ground::memory::sized;
use std::path::PathBuf;

/// The fine mesh does not fit; reported before it is made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RoomError {
    /// More entities than a format can number.
    #[error(
        "{tets} tets with {vertices} vertices are more than {most}, the most that a format numbers: choose another format, or ask for fewer"
    )]
    TooMany {
        /// Tets of the fine mesh.
        tets: u64,
        /// Its vertices.
        vertices: u64,
        /// The largest number that all formats support.
        most: u64,
    },
    /// The requested sizes need more coarse tets than the memory can hold.
    #[error(
        "elements of at most {size:?} make {tets} or more, as a coarse mesh of {}, and this machine has {} free: choose \
         larger sizes, or refine a coarser mesh by levels",
        at_least(*.needed), sized(*.available)
    )]
    Coarse {
        /// The largest size that is allowed (length).
        size: f64,
        /// Least number of tets with this size, as text: it may be beyond all integers.
        tets: String,
        /// Lower estimate of their memory in bytes.
        needed: u64,
        /// Free bytes.
        available: u64,
    },
    /// More coarse tets are expected than the memory can hold.
    #[error(
        "the sizes make about {tets}, as a coarse mesh of {}, and this machine has {} free: choose larger sizes, or \
         refine a coarser mesh by levels",
        at_least(*.needed), sized(*.available)
    )]
    Expected {
        /// The expected number, as text: it may be beyond all integers.
        tets: String,
        /// Estimate of their memory in bytes.
        needed: u64,
        /// Free bytes.
        available: u64,
    },
    /// The disk has too little space.
    #[error(
        "the files take about {} and {} has {} free: write elsewhere, take another format, or ask for fewer tets",
        sized(*.needed), .folder.display(), sized(*.available)
    )]
    Disk {
        /// Estimate of the size of the files in bytes.
        needed: u64,
        /// The output folder.
        folder: PathBuf,
        /// Free bytes there.
        available: u64,
    },
    /// A machine has too little memory for the mesh and its adjacency.
    #[error(
        "the fine mesh with its adjacency takes {} of memory, and this machine has {} left: leave out the adjacency, take \
         fewer levels or tets, or more machines",
        sized(*.needed), sized(*.available)
    )]
    Writers {
        /// Bytes of the mesh, and of its adjacency while it is written, on this machine.
        needed: u64,
        /// Free bytes.
        available: u64,
    },
    /// A machine has too little memory.
    #[error(
        "the fine mesh takes {}, without the vertices inside coarse tets {}, and this machine has {} left: take fewer levels \
         or tets, or more machines",
        sized(*.all), sized(*.least), sized(*.available)
    )]
    Memory {
        /// Bytes of the fine mesh on this machine.
        all: u64,
        /// Bytes of the fine mesh without the vertices inside coarse tets.
        least: u64,
        /// Free bytes.
        available: u64,
    },
}

/// A lower estimate of bytes as text; the largest number stands for all beyond it.
fn at_least(bytes: u64) -> String {
    if bytes == u64::MAX {
        "more bytes than any machine has".into()
    } else {
        format!("{} or more", sized(bytes))
    }
}
