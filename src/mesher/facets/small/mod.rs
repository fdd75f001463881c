//! Virtual merging of short edges and narrow faces of CAD models.
//!
//! An edge or face far smaller than the elements forces small elements and poor angles. Faces are
//! therefore **grouped** into composite patches, and edges into composite curves (virtual topology:
//! Sheffer 2001; mesh constraint topology: Foucault, Cuillière, François, Léon, Maranzana 2008).
//! Only the constraints of the mesh change: the geometry, and what vertices are projected to,
//! remain those of the file.
//!
//! A **narrow** face joins a large neighbour, its **main** face, if
//!
//! * both have the same bodies on their sides and no different names in the file,
//! * the main face is far wider, and
//! * it makes no sharp wedge with the faces on the other side of the narrow one, as both faces of a
//!   thin sheet would.
//!
//! Before that, a narrow face along several others is divided where these change (`strips`), and a
//! narrow part of a face is cut off as a face of its own: a **spur** that ends in a short edge
//! (`spurs`), and a **tip** (`tips`). Ends of fillets that run out
//! to a point are **blunt** for that: they have no sizes by curvature (`blunt`).
//!
//! Curves inside a composite patch are dropped. Then corners with two curves left are dropped if
//! one of the curves is short, or if they do not bend there.
//!
//! What has no mesh without some faces or edges is merged again, all but these (`kept`).
//!
//! *Not* merged are short edges between corners at which three or more curves remain: the corner
//! that would be left is off the faces that it had not touched.

mod blunt;
mod chains;
mod faces;
mod group;
mod kept;
mod layout;
mod merge;
mod report;
mod spurs;
mod strips;
#[cfg(test)]
mod tests;
mod tips;

pub use group::{Grouping, Small};
pub use kept::Kept;
pub(super) use layout::Layout;
pub use merge::merge;
pub use report::{MergedEdge, MergedFace, MergedSmall, MergedTip, NamedFace};
