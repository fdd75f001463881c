//! Boolean trees over half-spaces.

use crate::SurfaceId;

/// A set of points of space.
#[derive(Clone, Debug, PartialEq)]
pub enum Solid {
    /// One side of a surface: where its function is negative, or where it is positive.
    Half {
        /// The surface that bounds it.
        surface: SurfaceId,
        /// Whether the side is the one where the function is positive.
        positive: bool,
    },
    /// The intersection of its members (everything if there are none).
    And(Vec<Solid>),
    /// The union of its members (nothing if there are none).
    Or(Vec<Solid>),
    /// The complement.
    Not(Box<Solid>),
}
