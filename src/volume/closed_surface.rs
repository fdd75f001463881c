//! The input of the volume mesher: a triangulation that bounds bodies.

use super::sectors::{self, EdgeFault};
use crate::Point;
use crate::kernel::predicates::{Sign, orient2d};
use csg::BodyId;
use std::fmt;

/// Triangles that bound bodies without gap: checked when made.
///
/// Each triangle has a **region** on either side: a body, or `None` for what is outside of all. Going round
/// any edge, the region in front of one triangle is the region behind the next. That allows several bodies with
/// interfaces, holes, voids, surfaces that touch themselves along edges or at vertices, and triangles with one
/// body on both sides (a crack). Not checked here: whether triangles intersect; the
/// mesher finds out and says where.
#[derive(Clone, Debug, Default)]
pub struct ClosedSurface {
    pub(crate) points: Vec<Point>,
    pub(crate) triangles: Vec<[u32; 3]>,
    pub(crate) regions: Vec<[Option<BodyId>; 2]>,
    pub(crate) kept_points: Vec<Point>,
}

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
}

/// All faults of a surface, the gravest kind alone: indices before shapes before edges.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub struct SurfaceFaults(pub Vec<SurfaceFault>);

impl ClosedSurface {
    /// Takes a surface if it bounds bodies without gap.
    ///
    /// `regions[i]` are the regions behind and in front of triangle i, its normal by the right-hand
    /// rule pointing from the first to the second; `None` is outside of all bodies.
    ///
    /// # Errors
    /// All faults found, each with its place.
    pub fn new(
        points: Vec<Point>,
        triangles: Vec<[u32; 3]>,
        regions: Vec<[Option<BodyId>; 2]>,
    ) -> Result<Self, SurfaceFaults> {
        let surface = Self { points, triangles, regions, kept_points: Vec::new() };
        for find in [Self::index_faults, Self::shape_faults, Self::edge_faults] {
            let faults = find(&surface);
            if !faults.is_empty() {
                return Err(SurfaceFaults(faults));
            }
        }
        Ok(surface)
    }

    /// Also asks for vertices at these points, which must lie strictly inside bodies.
    #[must_use]
    pub fn with_kept_points(mut self, points: Vec<Point>) -> Self {
        self.kept_points = points;
        self
    }

    /// The points of the triangles.
    pub fn points(&self) -> &[Point] {
        &self.points
    }

    /// The triangles.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The regions behind and in front of each triangle.
    pub fn regions(&self) -> &[[Option<BodyId>; 2]] {
        &self.regions
    }

    /// Points inside bodies that are to be vertices.
    pub fn kept_points(&self) -> &[Point] {
        &self.kept_points
    }

    fn first_corner(&self, triangle: usize) -> Point {
        self.points[self.triangles[triangle][0] as usize]
    }

    fn index_faults(&self) -> Vec<SurfaceFault> {
        let (points, triangles) = (self.points.len(), self.triangles.len());
        if triangles == 0 {
            return vec![SurfaceFault::Empty];
        }
        if triangles != self.regions.len() {
            return vec![SurfaceFault::RegionCount { triangles, regions: self.regions.len() }];
        }
        // Half-faces are 32 bits, and a boundary point comes with about six tets.
        if points.max(triangles) > super::tetrahedra::MAX_TETS / 8 {
            return vec![SurfaceFault::TooLarge { points, triangles }];
        }
        let mut faults = Vec::new();
        let mut used = vec![false; points];
        for (t, triangle) in self.triangles.iter().enumerate() {
            for &point in triangle {
                match used.get_mut(point as usize) {
                    Some(used) => *used = true,
                    None => faults.push(SurfaceFault::NoSuchPoint { triangle: t as u32, point }),
                }
            }
        }
        for (i, p) in self.points.iter().enumerate() {
            let point = i as u32;
            if !p.iter().all(|x| x.is_finite()) {
                faults.push(SurfaceFault::NotFinite { point });
            } else if !used[i] {
                faults.push(SurfaceFault::UnusedPoint { point, place: *p });
            }
        }
        faults
    }

    fn shape_faults(&self) -> Vec<SurfaceFault> {
        let mut faults = Vec::new();
        // Zero is neither above nor below its negative: adding it makes one of both.
        let key = |&i: &u32| self.points[i as usize].coords.add_scalar(0.0).data.0[0];
        let mut order: Vec<u32> = (0..self.points.len() as u32).collect();
        order.sort_unstable_by(|a, b| key(a).partial_cmp(&key(b)).expect("finite").then(a.cmp(b)));
        for pair in order.windows(2) {
            let place = self.points[pair[0] as usize];
            if place == self.points[pair[1] as usize] {
                faults.push(SurfaceFault::SamePlace { points: [pair[0], pair[1]], place });
            }
        }
        for (t, triangle) in self.triangles.iter().enumerate() {
            let place = self.first_corner(t);
            if is_flat(triangle.map(|v| &self.points[v as usize])) {
                faults.push(SurfaceFault::Flat { triangle: t as u32, place });
            } else if self.regions[t] == [None, None] {
                faults.push(SurfaceFault::BoundsNothing { triangle: t as u32, place });
            }
        }
        faults
    }

    fn edge_faults(&self) -> Vec<SurfaceFault> {
        let mut faults = Vec::new();
        let mut order: Vec<u32> = (0..self.triangles.len() as u32).collect();
        let key = |&t: &u32| super::tetrahedra::sorted(self.triangles[t as usize]);
        order.sort_unstable_by_key(|t| (key(t), *t));
        for pair in order.windows(2) {
            if key(&pair[0]) == key(&pair[1]) {
                let place = self.first_corner(pair[0] as usize);
                faults.push(SurfaceFault::Twice { triangles: [pair[0], pair[1]], place });
            }
        }
        if !faults.is_empty() {
            return faults;
        }
        for (edge, fault) in sectors::edge_faults(&self.points, &self.triangles, &self.regions) {
            let [a, b] = edge.map(|v| &self.points[v as usize]);
            let place = nalgebra::center(a, b);
            faults.push(match fault {
                EdgeFault::Overlap(triangles) => SurfaceFault::Overlap { edge, triangles, place },
                EdgeFault::Open(triangles, regions) => {
                    SurfaceFault::NotClosed { edge, triangles, regions, place }
                }
            });
        }
        faults
    }
}

/// Whether three points lie on one line: then their shadows do on all coordinate planes.
fn is_flat([a, b, c]: [&Point; 3]) -> bool {
    [[0, 1], [1, 2], [2, 0]].iter().all(|&[i, j]| {
        let shadow = |p: &Point| [p[i], p[j]];
        orient2d(shadow(a), shadow(b), shadow(c)) == Sign::Zero
    })
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

#[cfg(test)]
mod tests {
    use super::super::samples::{INSIDE, Soup};
    use super::*;

    fn cube() -> Soup {
        let mut soup = Soup::default();
        soup.brick([0.; 3], [1.; 3], 1, INSIDE);
        soup
    }

    /// The faults of a cube after a change; their sentences name no place outside of it.
    fn faults(change: impl FnOnce(&mut Soup)) -> Vec<SurfaceFault> {
        let mut soup = cube();
        change(&mut soup);
        let faults = soup.surface().unwrap_err();
        assert!(!faults.to_string().is_empty());
        faults.0
    }

    #[test]
    fn a_cube_is_closed_and_a_box_of_two_bodies_with_a_crack_is_too() {
        assert!(cube().surface().is_ok());
        let mut cracked = cube();
        let corners = [[0.2, 0.2, 0.5], [0.8, 0.2, 0.5], [0.8, 0.8, 0.5], [0.2, 0.8, 0.5]];
        cracked.quad(corners.map(Point::from), [INSIDE[0]; 2]);
        assert!(cracked.surface().is_ok());
    }

    #[test]
    fn wrong_indices_and_numbers_are_found() {
        assert_eq!(ClosedSurface::new(vec![], vec![], vec![]).unwrap_err().0, [SurfaceFault::Empty]);
        assert_eq!(
            faults(|c| c.regions.truncate(11)),
            [SurfaceFault::RegionCount { triangles: 12, regions: 11 }]
        );
        assert_eq!(
            faults(|c| c.triangles[3] = [0, 1, 99]),
            [SurfaceFault::NoSuchPoint { triangle: 3, point: 99 }]
        );
        assert_eq!(faults(|c| c.points[2].y = f64::NAN), [SurfaceFault::NotFinite { point: 2 }]);
        let place = Point::new(9., 9., 9.);
        assert_eq!(faults(|c| c.points.push(place)), [SurfaceFault::UnusedPoint { point: 8, place }]);
    }

    #[test]
    fn wrong_shapes_are_found() {
        let found = faults(|c| {
            // A corner once more, with the other zero.
            c.points.push(c.points[0].map(|x| if x == 0.0 { -0.0 } else { x }));
            let twin = c.triangles.iter_mut().find(|t| t[0] == 0).unwrap();
            twin[0] = 8;
        });
        assert!(matches!(found[..], [SurfaceFault::SamePlace { points: [0, 8], .. }]), "{found:?}");
        let found = faults(|c| c.triangles[5][1] = c.triangles[5][0]);
        assert!(matches!(found[..], [SurfaceFault::Flat { triangle: 5, .. }]), "{found:?}");
        let found = faults(|c| c.regions[7] = [None, None]);
        assert!(matches!(found[..], [SurfaceFault::BoundsNothing { triangle: 7, .. }]), "{found:?}");
        let found = faults(|c| {
            c.triangles.push(c.triangles[4]);
            c.regions.push(c.regions[4]);
        });
        assert!(matches!(found[..], [SurfaceFault::Twice { triangles: [4, 12], .. }]), "{found:?}");
    }

    #[test]
    fn gaps_and_turned_triangles_are_found_at_their_edges() {
        let found = faults(|c| {
            c.triangles.remove(6);
            c.regions.remove(6);
        });
        assert_eq!(found.len(), 3);
        assert!(found.iter().all(|f| matches!(f, SurfaceFault::NotClosed { .. })), "{found:?}");
        let found = faults(|c| c.triangles[6].swap(0, 1));
        assert_eq!(found.len(), 3);
        // A flap that lies on a side of the cube.
        let found = faults(|c| {
            let [a, b, _] = c.triangles[0].map(|v| c.points[v as usize]);
            let [_, _, inner] = c.triangles[0].map(|v| c.points[v as usize]);
            let middle = nalgebra::center(&nalgebra::center(&a, &b), &inner);
            c.add([a, b, middle], INSIDE);
        });
        assert!(found.iter().any(|f| matches!(f, SurfaceFault::Overlap { .. })), "{found:?}");
    }

    #[test]
    fn four_triangles_at_an_edge_are_ordered_round_it() {
        for regions in [INSIDE, [Some(BodyId(7)), None]] {
            let mut soup = cube();
            soup.brick([1., 1., 0.], [2., 2., 1.], 1, regions);
            assert!(soup.surface().is_ok());
        }
        // The second cube inside out: its sector and the first one's surroundings disagree.
        let mut soup = cube();
        soup.brick([1., 1., 0.], [2., 2., 1.], 1, [None, Some(BodyId(1))]);
        assert!(soup.surface().is_err());
    }
}
