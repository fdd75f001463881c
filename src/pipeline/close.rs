//! Surfaces that are very close to each other: warnings of gaps that decide the number of tets, and
//! errors for those that need far smaller elements than everything around.

use crate::Point;
use crate::ground::size::{GeometricSamples, NearSurfaces, ShortCurve, SizeField};
use crate::mesher::model::CsgModel;
use crate::mesher::surface::curves::Gap;
use csg::SurfaceId;
use csg::features::{Named, Pair, Place};
use std::fmt;

/// A gap below this fraction of the size around it is told if it lowers the size.
const NARROW: f64 = 0.01;

/// An edge below this fraction of the size beside it is told: the thickness of a plate may be less
/// than a hundredth.
const SHORT: f64 = 0.005;

/// Gaps between edges that need more segments than this are refused: there are some hundred tets
/// for each. Closer edges are probably meant as one.
const MOST_SEGMENTS: f64 = 1000.0;

/// Two surfaces that stay apart only in small elements.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct CloseSurfaces {
    /// One surface.
    pub first: Named,
    /// The other.
    pub second: Named,
    /// Where they are close.
    pub place: Place,
    /// Their distance there (length).
    pub gap: f64,
    /// The element size at which the triangles of both stay apart.
    pub needed: f64,
    /// The size there without the gap.
    pub around: f64,
}

impl CloseSurfaces {
    /// Surfaces that were sampled for the sizes.
    fn of_surfaces(model: &CsgModel, near: &NearSurfaces) -> Self {
        let [first, second] = near.surfaces.map(|surface| Named::surface(&model.geometry, surface));
        let NearSurfaces { at, gap, size: needed, size_alone: around, .. } = *near;
        Self { first, second, place: Place(at), gap, needed, around }
    }

    /// Surfaces with edges that are close to each other.
    ///
    /// # Errors
    /// [`TooClose`] if the gap needs too many segments.
    pub(super) fn of_edges(model: &CsgModel, gap: &Gap, initial: &dyn SizeField) -> Result<Self, TooClose> {
        let [of, beside] = gap.curves.map(|curve| model.features.curve(curve).surfaces);
        let own = |surfaces: [SurfaceId; 2], other: [SurfaceId; 2]| {
            let own = surfaces.into_iter().find(|s| !other.contains(s)).unwrap_or(surfaces[0]);
            Named::surface(&model.geometry, own)
        };
        let [first, second] = [own(of, beside), own(beside, of)];
        let Gap { at, width: gap, needed, segments, .. } = *gap;
        let close = Self { first, second, place: Place(at), gap, needed, around: initial.size_at(&at) };
        if segments > MOST_SEGMENTS { Err(TooClose::new(close)) } else { Ok(close) }
    }

    /// The closest walls that lower the sizes, if they are narrow.
    fn that_decide(model: &CsgModel, samples: &GeometricSamples) -> Option<Self> {
        let decide = samples.near().iter().filter(|near| near.is_resolved);
        decide
            .min_by(|a, b| a.size.total_cmp(&b.size))
            .map(|near| Self::of_surfaces(model, near))
            .filter(Self::is_narrow)
    }

    /// The closest walls without the elements that they need, near one of the `places`.
    pub(super) fn unresolved(model: &CsgModel, samples: &GeometricSamples, places: &[Point]) -> Option<Self> {
        let is_near = |near: &&NearSurfaces| places.iter().any(|p| (p - near.at).norm() < near.size_alone);
        let unresolved = samples.near().iter().filter(|near| !near.is_resolved).filter(is_near);
        unresolved.min_by(|a, b| a.size.total_cmp(&b.size)).map(|near| Self::of_surfaces(model, near))
    }

    /// Whether the gap is narrow compared with the size around it.
    fn is_narrow(&self) -> bool {
        self.gap < NARROW * self.around
    }

    /// A warning of a narrow gap.
    pub(super) fn warning(&self) -> Option<String> {
        self.is_narrow().then(|| self.note())
    }

    /// See [`Self::warning`].
    fn note(&self) -> String {
        let times = self.around / self.gap;
        format!(
            "{self}, {times:.0} times closer than the size there: this gap decides the number of tets; \
             close or widen it if they are too many"
        )
    }
}

impl fmt::Display for CloseSurfaces {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { first, second, place, gap, .. } = self;
        write!(f, "surfaces of {} are only {gap:.3e} apart at {place}", Pair(first, second))
    }
}

/// A warning of the closest walls, or else the shortest edge, if they decide the number of tets.
pub(super) fn warning(model: &CsgModel, samples: &GeometricSamples) -> Option<String> {
    let of_walls = CloseSurfaces::that_decide(model, samples).map(|walls| walls.note());
    of_walls.or_else(|| samples.shortest_curve().and_then(|short| note_of_edge(model, short)))
}

/// A warning of an edge that is very short.
fn note_of_edge(model: &CsgModel, short: &ShortCurve) -> Option<String> {
    let ShortCurve { at, length, size_alone, .. } = *short;
    let surfaces = model.features.curve(short.curve).surfaces;
    let [first, second] = surfaces.map(|surface| Named::surface(&model.geometry, surface));
    let note = || {
        format!(
            "an edge between surfaces of {} is only {length:.3e} long at {}, {:.0} times shorter than the size there: \
             this edge decides the number of tets; make it longer or remove it if they are too many",
            Pair(&first, &second),
            Place(at),
            size_alone / length
        )
    };
    (length < SHORT * size_alone).then(note)
}

/// The error for surfaces that are too close to each other.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{close}: {}", advice(.close))]
pub struct TooClose {
    close: Box<CloseSurfaces>,
}

impl TooClose {
    pub(super) fn new(close: CloseSurfaces) -> Self {
        Self { close: Box::new(close) }
    }
}

fn advice(close: &CloseSurfaces) -> String {
    let CloseSurfaces { gap, needed, around, .. } = *close;
    let kind = |named: &Named| named.surface.as_deref().map(|surface| surface.0);
    let merge = if kind(&close.first) == kind(&close.second) {
        format!(", take both as one (option `merge`, {:.1e})", 1.1 * gap)
    } else {
        String::new()
    };
    format!(
        "to stay apart, they need elements {:.0} times smaller than around; move one of them{merge}, or ask for \
         elements of size {needed:.1e} (option `maxh`)",
        around / needed
    )
}
