//! The method `surface`: each rank meshes its part inside the part's refined surface.
//!
//! A coarse mesh is partitioned. The **skin** of a part is its surface (where the body ends or
//! another part begins) and its faces on patches. It is refined as in the method `refine`, by a
//! lattice that is projected to the geometry. So both sides of an interface have the same
//! triangles, with the same vertex names, without messages. Then each rank fills its skin with tets
//! by the size field.
//!
//! ```text
//!     coarse part ──► skin ──► refined skin ──► tets by the sizes ──► ids ──► part of the whole
//!                     (no message)                 (no message)      (a scan, an exchange)
//! ```
//!
//! Compared with the method `refine`, which makes n³ children of a coarse tet, the interior follows
//! the size field, takes the time of volume meshing, and depends on the partition. A skin that the
//! volume mesher rejects is filled with the lattice of `refine` instead, so no rank fails for this
//! reason.

mod delivered;
mod extract;
mod fill;
mod free;
mod number;
mod remesh;
mod rim;
mod sizes;

#[cfg(test)]
mod remesh_tests;
#[cfg(test)]
mod tests;

pub use delivered::{DeliveredSizes, delivered};
pub(crate) use extract::sorted_ends;
pub use extract::{LatticeSkin, Skin, SkinTriangle, skin};
#[cfg(test)]
pub use fill::fill_or_refine;
pub use fill::{FillError, Filled, Improvement, fill, remesh_and_fill};
pub use number::number;
pub use remesh::{FreeFaces, boundary};
pub use sizes::{PartSizes, at_vertices, expected_tets, expected_tets_by_part, scatter};
