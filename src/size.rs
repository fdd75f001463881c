//! Target edge length anywhere.

use crate::Point;

/// Gives the target edge length at any point.
pub trait SizeField: Sync {
    /// The wanted edge length at `point`, positive and finite.
    fn size_at(&self, point: &Point) -> f64;
}

/// The same size everywhere.
#[derive(Clone, Copy, Debug)]
pub struct UniformSize(pub f64);

impl SizeField for UniformSize {
    fn size_at(&self, _: &Point) -> f64 {
        self.0
    }
}
