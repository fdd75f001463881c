//! Method 3: parts that are meshed inside their refined skins, each on its own rank.
//!
//! A coarse mesh is partitioned. The **skin** of a part is its outer faces, where it ends or another part begins, and its faces on patches;
//! these are refined as in Method 2, by a lattice that is snapped to the geometry, so that both sides of an interface have the same
//! triangles, with the same names, without a message. Then each rank fills its skin with tets by the size field.
//!
//! ```text
//!   coarse part ──► skin ──► refined skin ──► tets by the sizes ──► ids ──► part of the whole
//!                 (no message)                  (no message)      (a scan, an exchange)
//! ```
//!
//! Compare Method 2: there a coarse tet becomes n³ tets that stand as it does; here the inside follows the size field, costs what
//! the volume mesher costs, and depends on the partition. A skin that the mesher refuses is filled by the lattice of Method 2, so that a rank never
//! has to give up.

mod extract;
mod fill;
mod number;
mod sizes;

#[cfg(test)]
mod tests;

pub(crate) use extract::sorted_ends;
pub use extract::{LatticeSkin, Skin, SkinTriangle, skin};
pub use fill::{Filled, fill, fill_or_refine};
pub use number::number;
pub use sizes::{PartSizes, at_vertices, scatter};
