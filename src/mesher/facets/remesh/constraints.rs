//! What remeshing leaves as it is.

use super::sheet::NONE;
use csg::CurveId;
use std::collections::HashSet;

/// The curves and edges that remeshing of a part of a surface must respect; nothing by default.
#[derive(Clone, Debug, Default)]
pub struct Constraints {
    /// For each curve of the model, what it is; empty if all are curves of the geometry that may
    /// change.
    pub pieces: Vec<Piece>,
    /// Edges that no triangle may get, lower vertex first: other elements have them.
    pub taken: HashSet<[u32; 2]>,
}

/// A curve of a model that is a part of a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Piece {
    /// The curve of the geometry it is a piece of; `None` for a line across a patch.
    pub of: Option<CurveId>,
    /// Whether that is straight.
    pub is_straight: bool,
    /// Whether its edges must stay.
    pub is_fixed: bool,
}

impl Constraints {
    /// Whether the edges of a curve must stay; false for no curve.
    pub(super) fn is_fixed(&self, curve: u32) -> bool {
        curve != NONE && self.pieces.get(curve as usize).is_some_and(|piece| piece.is_fixed)
    }

    /// Whether two curves are pieces of one curve of the geometry.
    pub(super) fn are_of_one_curve(&self, a: u32, b: u32) -> bool {
        let of = |c: u32| self.pieces.get(c as usize).and_then(|piece| piece.of);
        a == b || (of(a).is_some() && of(a) == of(b))
    }

    /// Whether other elements have an edge.
    pub(super) fn is_taken(&self, a: u32, b: u32) -> bool {
        !self.taken.is_empty() && self.taken.contains(&[a.min(b), a.max(b)])
    }
}
