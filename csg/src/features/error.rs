//! Why features could not be found.

use super::Inconsistency;
use crate::{Geometry, Point, SurfaceId};
use std::fmt;

/// Something of the file: the name of a solid and the line where it, or its primitive, stands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Named {
    /// The name of the solid.
    pub solid: String,
    /// The line, from 1.
    pub line: u32,
}

impl fmt::Display for Named {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "solid `{}` (line {})", self.solid, self.line)
    }
}

impl Named {
    /// The solid in which a surface first occurs.
    pub fn surface(geometry: &Geometry, id: SurfaceId) -> Self {
        let info = &geometry.surface_info[id.index()];
        Self { solid: info.solid.clone(), line: info.span.line }
    }

    /// The solid of a body.
    pub(super) fn body(geometry: &Geometry, id: crate::BodyId) -> Self {
        let body = &geometry.bodies[id.index()];
        Self { solid: body.name.clone(), line: body.span.line }
    }
}

/// A point, for messages.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place(pub Point);

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        // Without the sign of what is shown as zero.
        let shown = |x: f64| if x.abs() < 0.5e-6 { 0.0 } else { x };
        write!(f, "({:.6}, {:.6}, {:.6})", shown(self.0.x), shown(self.0.y), shown(self.0.z))
    }
}

/// Why the features could not be found.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FeatureError {
    /// Nothing is to be meshed.
    #[error("the geometry has no top-level object that is a solid")]
    NoBody,
    /// Bodies have no inside: those that are known, one at least.
    #[error("{} contains nothing: its parts do not meet", .0[0])]
    Empty(Vec<Named>),
    /// A body goes on without end.
    #[error("{0} is not bounded: cut it with planes or other solids")]
    Unbounded(Named),
    /// Two bodies share more than boundary.
    #[error("{first} and {second} overlap near {place}: subtract one from the other")]
    Overlap {
        /// One body.
        first: Named,
        /// The other.
        second: Named,
        /// A place in or beside the overlap.
        place: Place,
    },
    /// Two surfaces touch and both are boundaries there: the bodies have a wedge of no angle.
    #[error(
        "surfaces of {first} and {second} touch at {place} without crossing: move one of them or let them overlap"
    )]
    Tangent {
        /// One surface.
        first: Named,
        /// The other.
        second: Named,
        /// Where they touch.
        place: Place,
    },
    /// A corner, the tip of a cone or an edge touches the inside of a face: the bodies are not manifolds there.
    #[error(
        "a corner or an edge of {first} touches a face of {second} at {place}: move one of them or let them overlap"
    )]
    Touch {
        /// What touches.
        first: Named,
        /// What is touched.
        second: Named,
        /// Where.
        place: Place,
    },
    /// A face ends in a cusp that is too sharp for triangles.
    #[error(
        "a face between surfaces of {first} and {second} ends at {place} in a cusp too sharp for triangles: move one of \
         them or let them overlap"
    )]
    Cusp {
        /// A surface beside one of the curves of the cusp.
        first: Named,
        /// One beside the other.
        second: Named,
        /// The tip.
        place: Place,
    },
    /// A curve ends where nothing ends it.
    #[error("the intersection of surfaces of {first} and {second} could not be followed past {place}")]
    LooseCurve {
        /// One surface.
        first: Named,
        /// The other.
        second: Named,
        /// The last point.
        place: Place,
    },
    /// The cells that are needed to tell surfaces apart are too many.
    #[error("the surfaces of {first} and {second} are too intricate near {place} to be told apart")]
    TooIntricate {
        /// One surface.
        first: Named,
        /// The other.
        second: Named,
        /// A place where they are not told apart.
        place: Place,
    },
    /// A point that is to be a mesh vertex is in no body.
    #[error("the point {place} (line {line}) is outside all bodies")]
    PointOutside {
        /// The point.
        place: Place,
        /// Its line in the file.
        line: u32,
    },
    /// A surface that is to be periodic bounds no body.
    #[error("the first surface of {solid} bounds no body and cannot be periodic (line {line})")]
    NoPeriodicFace {
        /// The solid.
        solid: Named,
        /// The line of the statement.
        line: u32,
    },
    /// Two surfaces that are to be periodic are not the same, moved.
    #[error(
        "the first surfaces of {first} and {second} are not the same, moved, and cannot be periodic (line {line}): \
         name two planes, or two surfaces of the same shape"
    )]
    NoMotion {
        /// One solid.
        first: Named,
        /// The other.
        second: Named,
        /// The line of the statement.
        line: u32,
    },
    /// Two faces that are to be periodic do not match.
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
        /// What has none.
        what: &'static str,
        /// Where it is.
        place: Place,
    },
    /// What was found does not fit together.
    #[error("the corners, curves and patches found do not fit together: {0}")]
    Inconsistent(#[from] Inconsistency),
}
