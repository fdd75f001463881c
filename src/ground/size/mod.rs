//! Target edge length anywhere.
//!
//! The wanted size is the smallest of a global bound and of **sources**: places where geometry or user
//! ask for a size, from where it may grow by the **grading** per unit of distance. The field is therefore
//! Lipschitz: `|size(p) − size(q)| ≤ grading·|p − q|`, except across a body's own bound.

mod function;
mod geometric;
mod periodic;
mod preset;
mod source_tree;
mod sources;
mod watched;

pub use function::SizeFunction;
pub use geometric::{GeometricSamples, GeometricSize, SizeSettings};
pub use periodic::PeriodicSize;
pub use preset::{Closeness, Preset};
pub use source_tree::SourceTree;
pub use sources::Source;
pub(crate) use sources::thinned;
pub use watched::WatchedSize;

use crate::Point;
use crate::ground::progress::Work;

/// Gives the target edge length at any point.
pub trait SizeField: Sync {
    /// The wanted edge length at `point`, positive. The volume mesher also takes infinity: let sizes grow from the surface.
    ///
    /// The field may jump: the volume mesher limits its growth from the finer side. It is asked at points only, in the volume last of all in the
    /// middle of each tet, so that a finer place is overlooked only if it is smaller than the tets around it.
    fn size_at(&self, point: &Point) -> f64;

    /// The work that meshing by this field belongs to: stages that take long report how far they are, and ask whether to go on.
    fn work(&self) -> &Work<'_> {
        Work::unwatched()
    }
}

/// The same size everywhere.
#[derive(Clone, Copy, Debug)]
pub struct UniformSize(pub f64);

impl SizeField for UniformSize {
    fn size_at(&self, _: &Point) -> f64 {
        self.0
    }
}
