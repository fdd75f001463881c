//! Elmer's mesh format, serial and partitioned: text files with whole-mesh ids from 1.
//!
//! ```text
//! DIR/mesh.names                    names of bodies and boundaries
//! DIR/partitioning.N/part.K.header  counts                      K = 1 … N, rank K−1
//!                        .nodes     id -1 x y z                 of every vertex the part uses
//!                        .elements  id body 504 v v v v         id/OWNER of a halo element
//!                        .boundary  id bc parent parent 303 v v v
//!                        .shared    vertex count part part …    the owner first
//! DIR/partitioning.N/mesh.periodic  pairs of nodes on periodic faces, if any: not Elmer's
//! DIR/mesh.{header,nodes,elements,boundary}                     if there is one part
//! ```
//! The reference is Elmer's own reader, `fem/src/MeshUtils.F90`.

mod faults;
mod faults_curved;
mod faults_faces;
mod faults_halo;
mod faults_nodes;
#[cfg(test)]
mod halo_tests;
mod load;
mod names;
mod parse;
mod periodic;
mod read;
#[cfg(test)]
mod tests;
mod write;

pub use faults::{Fault, FaultKind, Faults, check_elmer, faults};
pub use load::{LoadError, Loaded, load};
pub(crate) use names::names_of;
pub(crate) use periodic::{PairsOfNodes, pairs_of};
pub use read::{BoundaryElement, Element, ElmerMesh, ElmerPart, Header, Layout, Node, Rows, SharedNode};
pub use read::{layouts, only_layout, read, read_layout, stated_elements};
pub use write::write;

/// Elmer's element code of a four-node tet.
const TET: u32 = 504;
/// Elmer's code of the ten-node tet.
const TET_10: u32 = 510;
/// The longest line that Elmer reads in `.elements`, `.boundary` and `.shared`: characters,
/// numbers.
const MAX_LINE: (usize, usize) = (256, 64);
/// The largest id: Elmer's integers have 32 bits.
const MAX_ID: u64 = i32::MAX as u64;
/// Elmer's element code of a three-node triangle.
const TRIANGLE: u32 = 303;
/// Elmer's code of the six-node triangle.
const TRIANGLE_6: u32 = 306;
