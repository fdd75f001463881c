//! Method 1: the geometry itself is cut by planes into one piece for each part, and each piece is meshed on its own rank.
//!
//! ```text
//!   geometry ──► planes ──► pieces ──► surface mesh of all ──► skins of the parts ──► tets ──► ids
//!             (by a coarse mesh)    (cut faces are interfaces)   (to the ranks)    (no message)
//! ```
//!
//! The thesis' first method (section 4.1), whose cuts made slices too thin to mesh beyond 16 ranks. Here planes are chosen by what they
//! would cut (`plan`), and the pieces are bodies of a geometry like any other, so that a surface mesh of all has both sides of
//! each cut alike. What lies on the geometry keeps the names and numbers it has there (`cut`); a cut is no boundary of the result.

pub mod cut;
mod evidence;
mod plan;
mod scan;
mod skins;
mod text;

#[cfg(test)]
mod tests;

pub use cut::{CutError, CutModel};
pub use evidence::{Evidence, Sample};
pub use plan::{Candidates, CutPlane, Cuts, Half, Settings, TooManyParts, plan};
pub use skins::{LooseEdge, pack, skins, unpack};
pub use text::geo_text;
