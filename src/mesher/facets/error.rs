//! Errors of facet models.

use crate::Point;
use csg::OutOfRange;

/// Why facets bound no bodies.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FacetError {
    /// There are no triangles.
    #[error("there are no triangles, or all have two equal corners")]
    Empty,
    /// More points or triangles than local ids can number.
    #[error("{points} points and {triangles} triangles are more than 32-bit ids can number")]
    TooLarge {
        /// The number of points.
        points: usize,
        /// The number of triangles.
        triangles: usize,
    },
    /// A coordinate is infinite or not a number.
    #[error("a coordinate of point {point} of surface {file} is not a finite number")]
    NotFinite {
        /// The surface, from 0.
        file: usize,
        /// The point, from 0.
        point: usize,
    },
    /// The surfaces are too large or too small for double precision.
    #[error(transparent)]
    OutOfRange(#[from] OutOfRange),
    /// A triangle refers to a point that does not exist.
    #[error("triangle {triangle} of surface {file} refers to point {point}, which does not exist")]
    NoSuchPoint {
        /// The surface, from 0.
        file: usize,
        /// The triangle, from 0.
        triangle: usize,
        /// The invalid index.
        point: u32,
    },
    /// Edges have only one triangle.
    #[error(
        "the surface is not closed: {count} edges belong to one triangle only, the first of them at ({}, {}, {}); \
         close the gap, or merge vertices that are meant to be one",
        places[0].x, places[0].y, places[0].z
    )]
    Open {
        /// The number of such edges.
        count: usize,
        /// The midpoints of the first of them.
        places: Vec<Point>,
    },
    /// Two triangles at a common edge overlap.
    #[error(
        "two triangles{} overlap at their common edge, at ({}, {}, {}): surfaces that touch must have the same triangles there",
        of_surfaces(*.files), place.x, place.y, place.z
    )]
    Overlap {
        /// The midpoint of the edge.
        place: Point,
        /// The surfaces of the two triangles, from 0.
        files: [usize; 2],
    },
    /// Triangles cannot be oriented consistently.
    #[error(
        "the surface is not orientable: triangles that meet at ({}, {}, {}) cannot be oriented consistently",
        .0.x, .0.y, .0.z
    )]
    NotOrientable(Point),
    /// No ray from a triangle or point is free of degenerate intersections.
    #[error(
        "the regions around the triangle or point at ({}, {}, {}) cannot be determined: surfaces touch there without having \
         the same triangles, or have no area",
        .0.x, .0.y, .0.z
    )]
    NoRay(Point),
    /// The triangles bound no space.
    #[error("the triangles bound no space")]
    NoBody,
}

fn of_surfaces([a, b]: [usize; 2]) -> String {
    if a == b { String::new() } else { format!(" of surfaces {a} and {b} (from 0)") }
}
