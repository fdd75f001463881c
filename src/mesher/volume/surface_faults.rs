//! Faults of surfaces that should bound bodies, and their messages.

use crate::Point;
use csg::BodyId;
use std::fmt;

/// A fault of a surface that should bound bodies. Positions are in the caller's units.
#[derive(Clone, Debug, PartialEq)]
pub enum SurfaceFault {
    /// There are no triangles.
    Empty,
    /// The number of region pairs differs from the number of triangles.
    RegionCount {
        /// The number of triangles.
        triangles: usize,
        /// The number of region pairs.
        regions: usize,
    },
    /// More points or triangles than local ids can number.
    TooLarge {
        /// The number of points.
        points: usize,
        /// The number of triangles.
        triangles: usize,
    },
    /// A triangle refers to a point that does not exist.
    NoSuchPoint {
        /// The triangle.
        triangle: u32,
        /// The invalid index.
        point: u32,
    },
    /// A coordinate is infinite or not a number.
    NotFinite {
        /// The point.
        point: u32,
    },
    /// Two points have the same coordinates.
    SamePlace {
        /// The points.
        points: [u32; 2],
        /// Their position.
        place: Point,
    },
    /// A point is in no triangle.
    UnusedPoint {
        /// The point.
        point: u32,
        /// Its position.
        place: Point,
    },
    /// The corners of a triangle are exactly collinear.
    Flat {
        /// The triangle.
        triangle: u32,
        /// Its first corner.
        place: Point,
    },
    /// Neither side of a triangle is in a body.
    BoundsNothing {
        /// The triangle.
        triangle: u32,
        /// Its first corner.
        place: Point,
    },
    /// Two triangles have the same corners.
    Twice {
        /// The triangles.
        triangles: [u32; 2],
        /// Their first corner.
        place: Point,
    },
    /// Two triangles at an edge overlap: they are coplanar and on the same side of it.
    Overlap {
        /// The edge.
        edge: [u32; 2],
        /// The triangles.
        triangles: [u32; 2],
        /// The midpoint of the edge.
        place: Point,
    },
    /// Two consecutive triangles around an edge assign different regions to the sector between
    /// them: a gap, or a triangle with wrong orientation.
    NotClosed {
        /// The edge.
        edge: [u32; 2],
        /// The triangles on both sides of the sector; twice the same if the edge has only one.
        triangles: [u32; 2],
        /// The regions that they assign to it.
        regions: [Option<BodyId>; 2],
        /// The midpoint of the edge.
        place: Point,
    },
    /// Two triangles intersect outside a common corner or edge.
    Intersect {
        /// The triangles.
        triangles: [u32; 2],
        /// A point of the intersection.
        place: Point,
    },
}

impl SurfaceFault {
    /// Changes the numbers of points and triangles to those of a surface of which this is a part.
    pub(super) fn renumber(&mut self, points: &[u32], triangles: &[u32]) {
        let point = |number: &mut u32| *number = points[*number as usize];
        let triangle = |number: &mut u32| *number = triangles[*number as usize];
        match self {
            Self::SamePlace { points, .. } => points.iter_mut().for_each(point),
            Self::NotFinite { point: number } | Self::UnusedPoint { point: number, .. } => point(number),
            Self::Flat { triangle: number, .. } | Self::BoundsNothing { triangle: number, .. } => {
                triangle(number);
            }
            Self::Twice { triangles, .. } | Self::Intersect { triangles, .. } => {
                triangles.iter_mut().for_each(triangle);
            }
            Self::Overlap { edge, triangles, .. } | Self::NotClosed { edge, triangles, .. } => {
                edge.iter_mut().for_each(point);
                triangles.iter_mut().for_each(triangle);
            }
            Self::NoSuchPoint { .. } | Self::Empty | Self::RegionCount { .. } | Self::TooLarge { .. } => {}
        }
    }

    /// The position of the fault, if it has one.
    pub fn place(&self) -> Option<Point> {
        match self {
            Self::SamePlace { place, .. }
            | Self::UnusedPoint { place, .. }
            | Self::Flat { place, .. }
            | Self::BoundsNothing { place, .. }
            | Self::Twice { place, .. }
            | Self::Overlap { place, .. }
            | Self::NotClosed { place, .. }
            | Self::Intersect { place, .. } => Some(*place),
            Self::Empty
            | Self::RegionCount { .. }
            | Self::TooLarge { .. }
            | Self::NoSuchPoint { .. }
            | Self::NotFinite { .. } => None,
        }
    }
}

/// All faults of a surface: invalid numbers only, if there are any, else faults of shapes, edges
/// and intersections.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub struct SurfaceFaults(pub Vec<SurfaceFault>);

impl SurfaceFaults {
    /// The pairs of triangles that intersect, overlap or coincide. A finer triangulation of the
    /// same geometry may avoid them.
    pub fn crossings(&self) -> impl Iterator<Item = [u32; 2]> + '_ {
        self.0.iter().filter_map(|fault| match fault {
            SurfaceFault::Intersect { triangles, .. }
            | SurfaceFault::Overlap { triangles, .. }
            | SurfaceFault::Twice { triangles, .. } => Some(*triangles),
            _ => None,
        })
    }
}

impl fmt::Display for SurfaceFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let at = |p: &Point| format!("at ({}, {}, {})", p.x, p.y, p.z);
        let side = |region: &Option<BodyId>| match region {
            Some(body) => format!("body {}", body.0),
            None => "outside".to_owned(),
        };
        match self {
            Self::Empty => write!(f, "the surface has no triangles"),
            Self::RegionCount { triangles, regions } => {
                write!(f, "{triangles} triangles, but {regions} pairs of regions")
            }
            Self::TooLarge { points, triangles } => {
                write!(f, "{points} points and {triangles} triangles are too many for one mesh")
            }
            Self::NoSuchPoint { triangle, point } => {
                write!(f, "triangle {triangle} refers to point {point}, which does not exist")
            }
            Self::NotFinite { point } => write!(f, "a coordinate of point {point} is not a finite number"),
            Self::SamePlace { points: [a, b], place } => {
                write!(f, "points {a} and {b} have the same position, {}", at(place))
            }
            Self::UnusedPoint { point, place } => {
                write!(f, "no triangle uses point {point} {}", at(place))
            }
            Self::Flat { triangle, place } => {
                write!(f, "the corners of triangle {triangle} are collinear, {}", at(place))
            }
            Self::BoundsNothing { triangle, place } => {
                write!(f, "triangle {triangle} has no body on either side, {}", at(place))
            }
            Self::Twice { triangles: [a, b], place } => {
                write!(f, "triangles {a} and {b} have the same corners, {}", at(place))
            }
            Self::Overlap { edge, triangles: [a, b], place } => {
                write!(f, "triangles {a} and {b} overlap at edge {}-{}, {}", edge[0], edge[1], at(place))
            }
            Self::NotClosed { edge, triangles: [a, b], regions, place } => write!(
                f,
                "not closed at edge {}-{}: the region between triangles {a} and {b} is {} by the first and {} by the second, {}",
                edge[0],
                edge[1],
                side(&regions[0]),
                side(&regions[1]),
                at(place)
            ),
            Self::Intersect { triangles: [a, b], place } => {
                write!(f, "triangles {a} and {b} intersect {}", at(place))
            }
        }
    }
}

impl fmt::Display for SurfaceFaults {
    /// Prints the first faults and the number of the others.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const SHOWN: usize = 5;
        for (i, fault) in self.0.iter().take(SHOWN).enumerate() {
            write!(f, "{}{fault}", if i == 0 { "" } else { "; " })?;
        }
        if self.0.len() > SHOWN {
            write!(f, "; and {} more", self.0.len() - SHOWN)?;
        }
        Ok(())
    }
}
