//! Target edge length as a function of position.
//!
//! The size is the minimum of a global bound and of **sources**: points at which the geometry or
//! the user prescribes a size, which grows from there by the **grading** per unit of distance. So
//! the field is Lipschitz continuous, `|size(p) − size(q)| ≤ grading·|p − q|`, except across the
//! surface of a body with a bound of its own.

mod background;
mod function;
mod geometric;
mod graded;
mod lattice;
mod near;
mod periodic;
mod preset;
mod samples;
mod source_tree;
mod sources;
mod watched;

pub use background::BackgroundError;
pub use function::SizeFunction;
pub use geometric::{GeometricSize, SizeSettings};
pub(crate) use graded::{Evaluation, GradedSize};
pub(crate) use near::NearSurfaces;
pub use periodic::PeriodicSize;
pub use preset::{Closeness, Preset};
pub use samples::GeometricSamples;
pub(crate) use samples::ShortCurve;
pub use source_tree::SourceTree;
pub use sources::Source;
pub(crate) use sources::{Sources, thinned};
pub use watched::WatchedSize;

use crate::Point;
use crate::ground::progress::Work;

/// The smallest size that coordinates resolve, as a fraction of the diagonal of a geometry: 45
/// roundings.
pub(crate) const LEAST_SIZE: f64 = 1e-14;

/// The target edge length at any point.
pub trait SizeField: Sync {
    /// The target edge length at `point`, positive.
    ///
    /// For the volume mesher it may be infinite: sizes then grow from the surface. The field may
    /// jump, because the volume mesher limits its growth from the finer side. It is sampled at
    /// points, in the volume at last at the centre of each tet, so a finer region is missed only if
    /// it is smaller than the tets around it.
    fn size_at(&self, point: &Point) -> f64;

    /// The work through which long stages report progress and can be cancelled.
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
