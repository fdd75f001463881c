//! The input of the volume mesher: a triangulation that bounds bodies, validated on construction.

use super::constraints::edges;
use super::sectors::{self, EdgeFault};
use super::surface_faults::{SurfaceFault, SurfaceFaults};
use super::{finish, intersect};
use crate::Point;
use crate::ground::kernel::predicates::{Sign, orient2d};
use crate::ground::kernel::simplex::ascending;
use csg::BodyId;
use std::collections::BTreeSet;

/// A triangulation that bounds bodies without gaps, checked on construction.
///
/// Each triangle has a **region** on either side: a body, or `None` outside all bodies. Around
/// every edge, the region in front of one triangle equals the region behind the next. This allows
/// several bodies with interfaces, holes, voids, surfaces that touch themselves along edges or at
/// vertices, and triangles with one body on both sides (cracks). Triangles intersect only in common
/// corners and edges, by exact predicates; those of [bodies that touch](ClosedSurface::of_touching)
/// may intersect elsewhere.
#[derive(Clone, Debug, Default)]
pub struct ClosedSurface {
    pub(crate) points: Vec<Point>,
    pub(crate) triangles: Vec<[u32; 3]>,
    pub(crate) regions: Vec<[Option<BodyId>; 2]>,
    pub(crate) kept_points: Vec<Point>,
    pub(crate) kept_edges: Vec<[u32; 2]>,
    /// Whether each body is filled by itself.
    pub(super) is_apart: bool,
}

impl ClosedSurface {
    /// Makes a closed surface after checking that it bounds bodies without gaps.
    ///
    /// `regions[i]` are the regions behind and in front of triangle i; its normal by the right-hand
    /// rule points from the first to the second. `None` is outside all bodies.
    ///
    /// # Errors
    /// All faults found, with their coordinates. Wrong indices and counts are reported alone,
    /// because the geometric checks need valid indices.
    pub fn new(
        points: Vec<Point>,
        triangles: Vec<[u32; 3]>,
        regions: Vec<[Option<BodyId>; 2]>,
    ) -> Result<Self, SurfaceFaults> {
        let surface = Self { points, triangles, regions, ..Self::default() };
        for find in [Self::index_faults, Self::form_faults] {
            let faults = find(&surface);
            if !faults.is_empty() {
                return Err(SurfaceFaults(faults));
            }
        }
        Ok(surface)
    }

    /// Adds points that become vertices of the mesh; they must lie strictly inside bodies that
    /// touch no others.
    #[must_use]
    pub fn with_kept_points(mut self, points: Vec<Point>) -> Self {
        self.kept_points = points;
        self
    }

    /// Adds edges that become edges of the mesh; they must lie inside bodies that touch no others.
    ///
    /// Indices count the points of the surface first, then those of
    /// [`ClosedSurface::with_kept_points`]. One or both ends may be on the surface, and edges may
    /// share ends; elsewhere they must not meet the surface or each other.
    ///
    /// Kept edges are not subdivided to the wanted size. An edge that cannot be recovered otherwise
    /// is split, and [`Report`](super::Report) counts it.
    #[must_use]
    pub fn with_kept_edges(mut self, edges: Vec<[u32; 2]>) -> Self {
        self.kept_edges = edges;
        self
    }

    /// The points of the triangles.
    pub fn points(&self) -> &[Point] {
        &self.points
    }

    /// The triangles, as indices of points.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The regions behind and in front of each triangle.
    pub fn regions(&self) -> &[[Option<BodyId>; 2]] {
        &self.regions
    }

    /// Points inside bodies that become vertices.
    pub fn kept_points(&self) -> &[Point] {
        &self.kept_points
    }

    /// Edges inside bodies that become edges of the mesh.
    pub fn kept_edges(&self) -> &[[u32; 2]] {
        &self.kept_edges
    }

    fn first_corner(&self, triangle: usize) -> Point {
        self.points[self.triangles[triangle][0] as usize]
    }

    pub(super) fn index_faults(&self) -> Vec<SurfaceFault> {
        let (points, triangles) = (self.points.len(), self.triangles.len());
        if triangles == 0 {
            return vec![SurfaceFault::Empty];
        }
        if triangles != self.regions.len() {
            return vec![SurfaceFault::RegionCount { triangles, regions: self.regions.len() }];
        }
        // Half-face numbers have 32 bits, and there are about six tets per boundary point.
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

    /// Degenerate and duplicate triangles, open edges and intersections.
    ///
    /// Degenerate and duplicate triangles are left out of the edge checks, so that a flat triangle
    /// is not also reported as a hole.
    pub(super) fn form_faults(&self) -> Vec<SurfaceFault> {
        let scale = finish::scale_of(&self.points);
        let points: Vec<Point> = self.points.iter().map(|p| p * scale).collect();
        let (mut faults, first_at) = self.double_points();
        let mut triangles: Vec<[u32; 3]> =
            self.triangles.iter().map(|t| t.map(|v| first_at[v as usize])).collect();
        let mut left_out = LeftOut::default();
        for (t, &triangle) in triangles.iter().enumerate() {
            let (place, t) = (self.first_corner(t), t as u32);
            if is_flat(triangle.map(|v| &points[v as usize])) {
                faults.push(SurfaceFault::Flat { triangle: t, place });
                left_out.add(t, triangle);
            } else if self.regions[t as usize] == [None, None] {
                faults.push(SurfaceFault::BoundsNothing { triangle: t, place });
                left_out.add(t, triangle);
            }
        }
        for [first, again] in doubles(&triangles) {
            if !left_out.triangles.contains(&first) && !left_out.triangles.contains(&again) {
                let place = self.first_corner(first as usize);
                faults.push(SurfaceFault::Twice { triangles: [first, again], place });
                left_out.triangles.insert(again);
            }
        }
        let is_kept = |t: &u32| !left_out.triangles.contains(t);
        let kept: Vec<u32> = (0..triangles.len() as u32).filter(is_kept).collect();
        triangles = kept.iter().map(|&t| triangles[t as usize]).collect();
        let regions: Vec<_> = kept.iter().map(|&t| self.regions[t as usize]).collect();
        let numbers = |pair: [u32; 2]| pair.map(|t| kept[t as usize]);
        for (edge, fault) in sectors::edge_faults(&points, &triangles, &regions) {
            let [a, b] = edge.map(|v| &self.points[v as usize]);
            let place = nalgebra::center(a, b);
            match fault {
                EdgeFault::Overlap(pair) => {
                    faults.push(SurfaceFault::Overlap { edge, triangles: numbers(pair), place });
                }
                EdgeFault::Open(pair, regions) if !left_out.edges.contains(&edge) => {
                    faults.push(SurfaceFault::NotClosed { edge, triangles: numbers(pair), regions, place });
                }
                EdgeFault::Open(..) => {}
            }
        }
        for (pair, place) in intersect::intersections(&points, &triangles) {
            faults.push(SurfaceFault::Intersect { triangles: numbers(pair), place: place / scale });
        }
        faults
    }

    /// Points that coincide with others, and for each point the first one at its position.
    fn double_points(&self) -> (Vec<SurfaceFault>, Vec<u32>) {
        // Adding 0.0 turns -0.0 into 0.0, so both compare equal.
        let key = |&i: &u32| self.points[i as usize].coords.add_scalar(0.0).data.0[0];
        let mut order: Vec<u32> = (0..self.points.len() as u32).collect();
        order.sort_unstable_by(|a, b| key(a).partial_cmp(&key(b)).expect("finite").then(a.cmp(b)));
        let mut first_at: Vec<u32> = (0..self.points.len() as u32).collect();
        let mut faults = Vec::new();
        for pair in order.windows(2) {
            let place = self.points[pair[0] as usize];
            if place == self.points[pair[1] as usize] {
                faults.push(SurfaceFault::SamePlace { points: [pair[0], pair[1]], place });
                first_at[pair[1] as usize] = first_at[pair[0] as usize];
            }
        }
        (faults, first_at)
    }
}

/// Triangles left out of further checks, and the edges of those that leave a hole.
#[derive(Default)]
struct LeftOut {
    triangles: BTreeSet<u32>,
    edges: BTreeSet<[u32; 2]>,
}

impl LeftOut {
    fn add(&mut self, number: u32, triangle: [u32; 3]) {
        self.triangles.insert(number);
        self.edges.extend(edges(triangle));
    }
}

/// Pairs of triangles with the same corners: the first one with each of the others.
pub(super) fn doubles(triangles: &[[u32; 3]]) -> Vec<[u32; 2]> {
    let mut order: Vec<([u32; 3], u32)> = triangles.iter().map(|&t| ascending(t)).zip(0..).collect();
    order.sort_unstable();
    let mut pairs: Vec<[u32; 2]> = order
        .chunk_by(|a, b| a.0 == b.0)
        .flat_map(|c| c[1..].iter().map(|again| [c[0].1, again.1]))
        .collect();
    pairs.sort_unstable();
    pairs
}

/// Whether three points are collinear: exactly if their projections on all coordinate planes are.
fn is_flat([a, b, c]: [&Point; 3]) -> bool {
    [[0, 1], [1, 2], [2, 0]].iter().all(|&[i, j]| {
        let project = |p: &Point| [p[i], p[j]];
        orient2d(project(a), project(b), project(c)) == Sign::Zero
    })
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

    /// The faults of a cube after a change; checks that their message is not empty.
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
            // The first corner once more, with the other sign of zero.
            c.points.push(c.points[0].map(|x| if x == 0.0 { -0.0 } else { x }));
            let twin = c.triangles.iter_mut().find(|t| t[0] == 0).unwrap();
            twin[0] = 8;
        });
        assert!(matches!(found[..], [SurfaceFault::SamePlace { points: [0, 8], .. }]), "{found:?}");
        // Two edges have lost a triangle; edges of the flat triangle itself are not reported.
        let found = faults(|c| c.triangles[5][1] = c.triangles[5][0]);
        assert!(matches!(found[0], SurfaceFault::Flat { triangle: 5, .. }), "{found:?}");
        assert!(matches!(found[1..], [SurfaceFault::NotClosed { .. }, SurfaceFault::NotClosed { .. }]));
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
        // A flap on a side of the cube.
        let found = faults(|c| {
            let [a, b, _] = c.triangles[0].map(|v| c.points[v as usize]);
            let [_, _, inner] = c.triangles[0].map(|v| c.points[v as usize]);
            let middle = nalgebra::center(&nalgebra::center(&a, &b), &inner);
            c.add([a, b, middle], INSIDE);
        });
        assert!(found.iter().any(|f| matches!(f, SurfaceFault::Overlap { .. })), "{found:?}");
    }

    #[test]
    fn four_triangles_at_an_edge_are_ordered_around_it() {
        for regions in [INSIDE, [Some(BodyId(7)), None]] {
            let mut soup = cube();
            soup.brick([1., 1., 0.], [2., 2., 1.], 1, regions);
            assert!(soup.surface().is_ok());
        }
        // The second cube is inside out, so its sector contradicts the region around the first.
        let mut soup = cube();
        soup.brick([1., 1., 0.], [2., 2., 1.], 1, [None, Some(BodyId(1))]);
        assert!(soup.surface().is_err());
    }
}
