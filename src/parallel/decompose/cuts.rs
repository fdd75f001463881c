//! Cutting planes, and the pieces of space between them.

use super::CutStatistics;
use super::statistics::Sample;
use crate::{Point, Vector};
use csg::Aabb;
use nalgebra::Matrix3;

/// An oriented cutting plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CutPlane {
    /// A point on it.
    pub point: Point,
    /// Its unit normal.
    pub normal: Vector,
}

impl CutPlane {
    /// The signed distance of a point.
    pub fn value(&self, point: &Point) -> f64 {
        self.normal.dot(&(point - self.point))
    }

    /// Whether a point is on the side of the normal.
    pub(super) fn is_positive(&self, point: &Point) -> bool {
        self.value(point) > 0.0
    }

    /// The samples behind it and in front of it.
    pub(super) fn split<'a>(&self, samples: &[&'a Sample]) -> [Vec<&'a Sample>; 2] {
        let (positive, negative) = samples.iter().partition(|sample| self.is_positive(&sample.point));
        [negative, positive]
    }

    /// Whether its distance from a box is at most `room`.
    pub(super) fn comes_near(&self, bounds: &Aabb, room: f64) -> bool {
        let half = 0.5 * (bounds.max - bounds.min);
        let reach = half.dot(&self.normal.abs());
        self.value(&nalgebra::center(&bounds.min, &bounds.max)).abs() <= reach + room
    }
}

/// A point that planes keep away from.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spot {
    pub point: Point,
    /// Closer than this there is no room for good tets.
    pub near: f64,
    /// Whether its coordinates are exact, so that a plane may go through it.
    pub is_exact: bool,
}

/// A half-space of a cutting plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Half {
    /// The plane, by index in [`Cuts::planes`].
    pub plane: usize,
    /// Whether it is the side of the normal.
    pub positive: bool,
}

/// A partition of space into convex pieces, one for each part.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cuts {
    /// The planes.
    pub planes: Vec<CutPlane>,
    /// The pieces, as intersections of half-spaces.
    pub leaves: Vec<Vec<Half>>,
}

impl Half {
    /// The depth of a point inside the half-space, negative outside.
    pub(super) fn depth(self, planes: &[CutPlane], point: &Point) -> f64 {
        let value = planes[self.plane].value(point);
        if self.positive { value } else { -value }
    }

    /// Whether a point belongs to it; points on the plane belong to the side opposite the normal.
    pub(super) fn contains(self, planes: &[CutPlane], point: &Point) -> bool {
        planes[self.plane].is_positive(point) == self.positive
    }
}

impl Cuts {
    /// The piece that contains a point.
    pub fn leaf_of(&self, point: &Point) -> usize {
        let contains = |leaf: &Vec<Half>| leaf.iter().all(|half| half.contains(&self.planes, point));
        self.leaves.iter().position(contains).expect("the pieces fill space")
    }

    /// The pieces whose half-spaces each have one of the points inside or within `room`.
    pub fn leaves_near(&self, points: &[Point], room: f64) -> impl Iterator<Item = usize> {
        let reaches = move |half: &Half| points.iter().any(|point| half.depth(&self.planes, point) > -room);
        (0..self.leaves.len()).filter(move |&leaf| self.leaves[leaf].iter().all(reaches))
    }

    /// The pieces made by successive planes: each plane cuts all pieces that have samples on both
    /// sides of it.
    pub fn by_planes(planes: &[CutPlane], statistics: &CutStatistics) -> Self {
        let mut leaves = vec![(Vec::new(), statistics.samples.iter().collect::<Vec<&Sample>>())];
        for (plane, cut) in planes.iter().enumerate() {
            leaves = leaves
                .into_iter()
                .flat_map(|(halves, samples)| {
                    let [negative, positive] = cut.split(&samples);
                    if positive.is_empty() || negative.is_empty() {
                        return vec![(halves, samples)];
                    }
                    vec![
                        (with_half(&halves, plane, false), negative),
                        (with_half(&halves, plane, true), positive),
                    ]
                })
                .collect();
        }
        Self { planes: planes.to_vec(), leaves: leaves.into_iter().map(|leaf| leaf.0).collect() }
    }
}

/// The half-spaces of a piece and one more.
pub(super) fn with_half(halves: &[Half], plane: usize, positive: bool) -> Vec<Half> {
    [halves, &[Half { plane, positive }]].concat()
}

/// The intersection of three planes, `None` if it is nearly degenerate.
pub(super) fn meeting_point(planes: [&CutPlane; 3]) -> Option<Point> {
    let rows = planes.map(|plane| plane.normal.transpose());
    let offsets = planes.map(|plane| plane.normal.dot(&plane.point.coords));
    let inverse = Matrix3::from_rows(&rows).try_inverse()?;
    Some(Point::from(inverse * Vector::from(offsets)))
}
