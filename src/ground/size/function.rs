//! User-defined sizes.

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
