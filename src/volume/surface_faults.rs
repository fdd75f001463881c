//! What can be wrong with a surface that is to bound bodies, and how it is told.

use crate::Point;
use csg::BodyId;
use std::fmt;

/// What is wrong with a surface that was to bound bodies.
#[derive(Clone, Debug, PartialEq)]
pub enum SurfaceFault {
    /// There are no triangles.
    Empty,
    /// As many pairs of regions as triangles are needed.
    RegionCount {
        /// The number of triangles.
        triangles: usize,
        /// The number of pairs of regions.
        regions: usize,
    },
    /// More points or triangles than local ids.
    TooLarge {
        /// The number of points.
        points: usize,
        /// The number of triangles.
        triangles: usize,
    },
    /// A triangle names a point that does not exist.
    NoSuchPoint {
        /// The triangle.
        triangle: u32,
        /// The index it names.
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
        /// Where.
        place: Point,
    },
    /// No triangle uses a point.
    UnusedPoint {
        /// The point.
        point: u32,
        /// Where.
        place: Point,
    },
    /// A triangle's corners lie on one line, exactly.
    Flat {
        /// The triangle.
        triangle: u32,
        /// Where: its first corner.
        place: Point,
    },
    /// Neither side of a triangle is in a body.
    BoundsNothing {
        /// The triangle.
        triangle: u32,
        /// Where: its first corner.
        place: Point,
    },
    /// Two triangles have the same corners.
    Twice {
        /// The triangles.
        triangles: [u32; 2],
        /// Where: their first corner.
        place: Point,
    },
    /// Two triangles at one edge overlap: they lie in one plane on the same side of it.
    Overlap {
        /// The edge.
        edge: [u32; 2],
        /// The triangles.
        triangles: [u32; 2],
        /// Where: the middle of the edge.
        place: Point,
    },
    /// Between two consecutive triangles round an edge the regions differ: a gap, or a triangle turned over.
    NotClosed {
        /// The edge.
        edge: [u32; 2],
        /// The triangles on both sides of the sector, the same one twice if it is alone.
        triangles: [u32; 2],
        /// The regions that they name for it.
        regions: [Option<BodyId>; 2],
        /// Where: the middle of the edge.
        place: Point,
    },
    /// Two triangles meet elsewhere than in a common corner or edge.
    Intersect {
        /// The triangles.
        triangles: [u32; 2],
        /// Where: a point of both.
        place: Point,
    },
}

impl SurfaceFault {
    /// Where it is, if it is somewhere.
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

/// All faults of a surface: those of its numbers alone if there are any, else those of shapes, edges and intersections.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub struct SurfaceFaults(pub Vec<SurfaceFault>);

impl SurfaceFaults {
    /// The pairs of triangles that intersect, overlap or are the same (two sides of a thin lens): what a finer triangulation of the same
    /// geometry may mend.
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
                write!(f, "{points} points and {triangles} triangles are too many for one part")
            }
            Self::NoSuchPoint { triangle, point } => {
                write!(f, "triangle {triangle} names point {point}, which does not exist")
            }
            Self::NotFinite { point } => write!(f, "a coordinate of point {point} is not a finite number"),
            Self::SamePlace { points: [a, b], place } => {
                write!(f, "points {a} and {b} are in the same place, {}", at(place))
            }
            Self::UnusedPoint { point, place } => {
                write!(f, "no triangle uses point {point} {}", at(place))
            }
            Self::Flat { triangle, place } => {
                write!(f, "the corners of triangle {triangle} lie on one line, {}", at(place))
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
                "not closed at edge {}-{}: between triangles {a} and {b} one says {}, the other {}, {}",
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
    /// The first faults and the number of the others.
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
