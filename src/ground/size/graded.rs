//! The field of graded sources, as it is evaluated.

use super::sources::Sources;
use super::{SizeField, Source, SourceTree};
use crate::Point;
use csg::Aabb;

/// How a field of graded sources is evaluated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Evaluation {
    /// By a search at each point, without preparation: for fewer points than some tens for each
    /// source.
    Searched,
    /// By interpolation with twice the error of a fine one, which is enough to compare numbers of
    /// tets: cells are twice as large, so that a quarter of them are built on a surface, from a
    /// quarter of the samples.
    Rough,
    /// By interpolation that is accurate enough for a mesh.
    Fine,
}

impl Evaluation {
    /// The factor of errors, and of the distances of samples.
    pub fn roughness(self) -> f64 {
        match self {
            Self::Searched | Self::Fine => 1.0,
            Self::Rough => 2.0,
        }
    }
}

/// The smallest size that graded sources impose.
#[derive(Clone, Debug)]
pub(crate) enum GradedSize {
    Searched(Sources),
    Interpolated(SourceTree),
}

impl GradedSize {
    /// The field in `bounds` that grows by `grading` per unit of distance from the sources up to
    /// `maximum`.
    pub fn new(bounds: Aabb, grading: f64, maximum: f64, sources: &[Source], evaluation: Evaluation) -> Self {
        if evaluation == Evaluation::Searched {
            return Self::Searched(Sources::new(grading, maximum, sources));
        }
        let roughness = evaluation.roughness();
        Self::Interpolated(SourceTree::with_roughness(bounds, grading, maximum, sources, roughness))
    }
}

impl SizeField for GradedSize {
    fn size_at(&self, point: &Point) -> f64 {
        match self {
            Self::Searched(sources) => sources.size_at(point),
            Self::Interpolated(tree) => tree.size_at(point),
        }
    }
}
