//! User-defined sizes.

use super::background::{Background, BackgroundError};
use crate::Point;
use std::fmt;
use std::sync::Arc;

/// An upper bound of the size (length) as a function of position.
#[derive(Clone)]
pub struct SizeFunction(Arc<dyn Fn(Point) -> f64 + Send + Sync>);

impl SizeFunction {
    /// Wraps a function, which is called from several threads.
    ///
    /// Values that are not positive, including NaN, impose no bound.
    pub fn new(function: impl Fn(Point) -> f64 + Send + Sync + 'static) -> Self {
        Self(Arc::new(function))
    }

    /// Sizes at the points of a tetrahedral mesh, such as the sizes that an error estimate of a
    /// solution asks for: linear in each tet, and outside the mesh those of its nearest point.
    ///
    /// The mesh need not be valid, nor fit the geometry. Points are found by a tree of boxes, in
    /// the time of the logarithm of the number of tets.
    ///
    /// # Errors
    /// No tets, other counts, or values that are impossible.
    pub fn on_mesh(points: &[[f64; 3]], tets: &[[u32; 4]], sizes: &[f64]) -> Result<Self, BackgroundError> {
        let background = Background::new(points, tets, sizes)?;
        Ok(Self::new(move |point| background.at(&point)))
    }

    /// The value at a point.
    pub fn at(&self, point: Point) -> f64 {
        self.0(point)
    }

    /// The minimum of `size` and the bound at a point.
    pub(crate) fn bound(&self, size: f64, point: &Point) -> f64 {
        let own = self.0(*point);
        if own > 0.0 { size.min(own) } else { size }
    }
}

impl fmt::Debug for SizeFunction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("SizeFunction")
    }
}
