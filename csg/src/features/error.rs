//! Errors of the feature search.

use super::Inconsistency;
use super::cut_cusps::Cusp;
use crate::{BodyId, Geometry, OutOfRange, Point, SurfaceId};
use std::fmt;

/// A named object of the file: the name of a solid and the line of the solid or its primitive.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Named {
    /// The name of the solid.
    pub solid: Box<str>,
    /// The line, from 1.
    pub line: u32,
    /// For a surface, its kind, and the column of its primitive, from 1; boxed, as errors are to be
    /// small.
    pub surface: Option<Box<(&'static str, u32)>>,
}

/// Two objects of an error: surfaces of one solid are told apart by their primitives.
#[derive(Clone, Copy, Debug)]
pub struct Pair<'a>(pub &'a Named, pub &'a Named);

impl fmt::Display for Pair<'_> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self(first, second) = self;
        match (first.surface.as_deref(), second.surface.as_deref()) {
            (Some((one, at)), Some((other, beside))) if first.solid == second.solid => {
                let (solid, [line, second_line]) = (&first.solid, [first.line, second.line]);
                write!(
                    f,
                    "solid `{solid:.60}`, its {one} ({line}:{at}) and its {other} ({second_line}:{beside}),"
                )
            }
            _ => write!(f, "{first} and {second}"),
        }
    }
}

impl fmt::Display for Named {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        // Names may be as long as the file.
        write!(f, "solid `{:.60}` (line {})", self.solid, self.line)
    }
}

impl Named {
    /// The solid in which a surface first occurs.
    pub fn surface(geometry: &Geometry, id: SurfaceId) -> Self {
        let info = &geometry.surface_info[id.index()];
        let kind = geometry.surfaces[id.index()].kind();
        let surface = Some(Box::new((kind, info.span.column)));
        Self { solid: info.solid.as_str().into(), line: info.span.line, surface }
    }

    /// The solid of a body.
    pub(super) fn body(geometry: &Geometry, id: crate::BodyId) -> Self {
        let body = &geometry.bodies[id.index()];
        Self { solid: body.name.as_str().into(), line: body.span.line, surface: None }
    }
}

/// Coordinates of a point, for messages.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place(pub Point);

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        // Avoid a minus sign on a value displayed as zero.
        let shown = |x: f64| if x.abs() < 0.5e-6 { 0.0 } else { x };
        write!(f, "({:.6}, {:.6}, {:.6})", shown(self.0.x), shown(self.0.y), shown(self.0.z))
    }
}

/// Why the features of a geometry could not be found.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FeatureError {
    /// There is nothing to mesh.
    #[error("the geometry has no top-level object that is a solid")]
    NoBody,
    /// Bodies without interior: at least one, not necessarily all.
    #[error(
        "{} contains nothing: its parts do not meet; the normal of a plane points out of the solid", .0[0]
    )]
    Empty(Vec<Named>),
    /// A body is unbounded.
    #[error(
        "{0} is not bounded: cut it with planes or other solids; the normal of a plane points out of the solid"
    )]
    Unbounded(Named),
    /// The bodies are too large or too small for double precision.
    #[error("{first}: {range}")]
    OutOfRange {
        /// The first body.
        first: Named,
        /// The length that is out of range.
        range: OutOfRange,
    },
    /// The interiors of two bodies intersect.
    #[error("{first} and {second} overlap near {place}: subtract one from the other")]
    Overlap {
        /// One body.
        first: Named,
        /// The other.
        second: Named,
        /// A point in or close to the overlap.
        place: Place,
    },
    /// Two surfaces are tangent and both are boundaries there, with a wedge of zero angle between
    /// them.
    #[error(
        "surfaces of {} touch at {place} without an angle between them: move one of them or let them overlap",
        Pair(.first, .second)
    )]
    Tangent {
        /// One surface.
        first: Named,
        /// The other.
        second: Named,
        /// Where they touch.
        place: Place,
        /// What [`find_and_cut_cusps`](super::find_and_cut_cusps) needs to know.
        cusp: Box<Cusp>,
    },
    /// A face ends in a cusp that is too sharp for triangles.
    #[error(
        "a face between surfaces of {} ends at {place} in a cusp too sharp for triangles: move one of \
         them or let them overlap", Pair(.first, .second)
    )]
    Cusp {
        /// A surface beside one of the curves of the cusp.
        first: Named,
        /// A surface beside the other curve.
        second: Named,
        /// The tip.
        place: Place,
        /// What [`find_and_cut_cusps`](super::find_and_cut_cusps) needs to know.
        cusp: Box<Cusp>,
    },
    /// A feature curve has a loose end: tracing stopped, or no other curve continues it.
    #[error("the intersection of surfaces of {} could not be followed past {place}", Pair(.first, .second))]
    LooseCurve {
        /// One surface.
        first: Named,
        /// The other.
        second: Named,
        /// The last point.
        place: Place,
    },
    /// Separating two surfaces needs too many cells.
    #[error(
        "surfaces of {} could not be separated near {place}: they are too close or nearly tangent; move one of them",
        Pair(.first, .second)
    )]
    TooIntricate {
        /// One surface.
        first: Named,
        /// The other.
        second: Named,
        /// The center of a cell in which they are not separated.
        place: Place,
    },
    /// A point that must become a mesh vertex is outside all bodies.
    #[error("the point {place} (line {line}) is outside all bodies")]
    PointOutside {
        /// The point.
        place: Place,
        /// The line of the statement.
        line: u32,
    },
    /// A surface that is declared periodic bounds no body.
    #[error("the first surface of {solid} bounds no body and cannot be periodic (line {line})")]
    NoPeriodicFace {
        /// The solid.
        solid: Named,
        /// The line of the statement.
        line: u32,
    },
    /// No rigid motion maps the first of two periodic surfaces to the second.
    #[error(
        "no rigid motion maps the first surface of {first} to that of {second}, so they cannot be periodic \
         (line {line}): name two planes, or two surfaces of the same shape"
    )]
    NoMotion {
        /// One solid.
        first: Named,
        /// The other.
        second: Named,
        /// The line of the statement.
        line: u32,
    },
    /// The patches of two periodic surfaces do not match.
    #[error(
        "the faces on {first} and {second} do not match and cannot be periodic (line {line}): the {what} at {place} \
         has no counterpart on the other face"
    )]
    NotPeriodic {
        /// One solid.
        first: Named,
        /// The other.
        second: Named,
        /// The line of the statement.
        line: u32,
        /// What has no counterpart.
        what: &'static str,
        /// Where it is.
        place: Place,
    },
    /// The features found are inconsistent.
    #[error("the corners, curves and patches found are inconsistent: {0}")]
    Inconsistent(#[from] Inconsistency),
}

impl FeatureError {
    /// Two surfaces are tangent at a point, with a body or the exterior between them.
    pub(super) fn tangent(
        geometry: &Geometry,
        surfaces: [SurfaceId; 2],
        point: Point,
        between: Option<BodyId>,
    ) -> Self {
        let [first, second] = surfaces.map(|s| Named::surface(geometry, s));
        let cusp = Cusp { surfaces, between, point, arc: Vec::new(), reach: f64::INFINITY, along: None };
        Self::Tangent { first, second, place: Place(point), cusp: Box::new(cusp) }
    }

    /// The same error, found on an arc along which the surfaces are tangent.
    pub(super) fn along(mut self, arc: &[Point]) -> Self {
        if let Self::Tangent { cusp, .. } = &mut self {
            cusp.arc = arc.to_vec();
        }
        self
    }
}
