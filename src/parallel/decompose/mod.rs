//! The method `decompose`: planes cut the geometry into one piece per part, and each rank meshes
//! its piece.
//!
//! ```text
//!     geometry ──► planes ──► pieces ──► surface mesh of all ──► skins of the parts ──► tets ──► ids
//!        (by a coarse mesh)          (cut faces are interfaces)     (to the ranks)   (no message)
//! ```
//!
//! This is the thesis' first method (section 4.1), whose cuts made slices too thin to mesh beyond
//! 16 ranks. Here planes are chosen by a cost of what they cut (`plan`). The pieces are bodies of
//! an ordinary geometry, so the surface mesh of all pieces conforms on both sides of each cut.
//! Entities on the original geometry keep their names and numbers (`cut`); a cut is not a boundary
//! of the result.

pub mod cut;
mod cuts;
mod grid;
mod periodic;
mod plan;
mod scan;
mod skins;
mod statistics;
mod text;

#[cfg(test)]
mod tests;

pub use cut::{CutError, CutModel};
pub use cuts::{CutPlane, Cuts};
pub use plan::{Candidates, PlanSettings, TooManyParts, plan};
pub use skins::{LooseEdge, pack, skins, unpack};
pub use statistics::CutStatistics;
pub use text::geo_text;
