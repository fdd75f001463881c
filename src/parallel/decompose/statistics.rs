//! Cut statistics: samples and boundary data from a coarse mesh, by which cutting planes are
//! chosen.

use super::CutError;
use super::cuts::{CutPlane, Cuts, Spot, meeting_point};
use super::periodic::{PeriodicFaces, periodic_faces};
use crate::ground::comm::thread;
use crate::ground::mesh::{Class, Mesh, TET_EDGES};
use crate::mesher::model::CsgModel;
use crate::parallel::distribution::distribute;
use crate::parallel::skin;
use crate::{Point, Vector};

/// A point that represents a share of the fine tets, the same for all samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Its position.
    pub point: Point,
    /// The width of the region that it represents.
    pub width: f64,
    /// A distance below which there is no room for good tets.
    pub near: f64,
}

/// A boundary triangle of the refined coarse mesh.
#[derive(Clone, Copy, Debug)]
struct Face {
    corners: [Point; 3],
    normal: Vector,
    /// The number of fine triangles on it.
    cells: f64,
    /// The length of their edges.
    size: f64,
}

/// A segment of a curve.
#[derive(Clone, Copy, Debug)]
struct Piece {
    ends: [Point; 2],
    size: f64,
}

/// Cut statistics of a geometry.
#[derive(Clone, Debug, Default)]
pub struct CutStatistics {
    /// Samples of the tet density.
    pub samples: Vec<Sample>,
    faces: Vec<Face>,
    curves: Vec<Piece>,
    corners: Vec<(Point, f64)>,
    pub(super) periodic: Vec<PeriodicFaces>,
}

/// The maximum number of subdivisions per edge of the boundary.
const MOST_PIECES: u32 = 4;

/// The approximate number of samples per part.
const SAMPLES: usize = 600;

impl CutStatistics {
    /// Collects the statistics from a coarse mesh whose edges will be split into `pieces`, for
    /// `parts` parts; each tet becomes as many as `expected`. The boundary is refined because
    /// coarse triangles do not resolve how planes meet it.
    ///
    /// # Errors
    /// [`CutError::Distribute`] or [`CutError::Refine`] if the mesh cannot be refined.
    pub fn of(
        mesh: &Mesh,
        whole: &CsgModel,
        expected: &[f64],
        pieces: u32,
        parts: u32,
    ) -> Result<Self, CutError> {
        let periodic = periodic_faces(mesh, &whole.features);
        let mut statistics = Self { periodic, ..Self::default() };
        let samples = (SAMPLES * parts as usize).max(mesh.tets.len()) as f64;
        let share = samples / expected.iter().sum::<f64>();
        let mut before = 0.0;
        for (tet, expected) in mesh.tets.iter().zip(expected) {
            // So many that all tets up to this one have their share.
            let after = before + share * expected;
            let count = (after.floor() - before.floor()) as usize;
            before = after;
            if count == 0 {
                continue;
            }
            let corners = tet.map(|v| mesh.points[v.index()]);
            let edge = TET_EDGES.map(|[a, b]| (corners[b] - corners[a]).norm()).iter().sum::<f64>() / 6.0;
            // C(k + 2, 3) points in a tet with k per edge.
            let points = |k: usize| k * (k + 1) * (k + 2) / 6;
            let k = (1_usize..).find(|&k| points(k) >= count).unwrap_or(1);
            let width = edge / k as f64;
            let near = width.max(CLEAR * edge / f64::from(pieces));
            let spread: Vec<Point> = grid(&corners, k).collect();
            let chosen = (0..count).map(|i| spread[(2 * i + 1) * spread.len() / (2 * count)]);
            statistics.samples.extend(chosen.map(|point| Sample { point, width, near }));
        }
        let comm = thread::alone();
        let given = (mesh.clone(), vec![0; mesh.tets.len()]);
        let coarse = distribute(&comm, Some(given))?;
        let n = pieces.min(MOST_PIECES);
        let skin = skin::skin(&coarse, &whole.projector.clone().into(), n)?.skin;
        // The edge length of the fine mesh relative to this one.
        let finer = f64::from(n) / f64::from(pieces);
        let edge = |a: u32, b: u32| (skin.points[b as usize] - skin.points[a as usize]).norm();
        for [a, b, c] in skin.triangles.iter().map(|t| t.vertices) {
            let corners = [a, b, c].map(|v| skin.points[v as usize]);
            let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
            let size = finer * (edge(a, b) + edge(b, c) + edge(c, a)) / 3.0;
            let (area, normal) = (0.5 * normal.norm(), normal.normalize());
            statistics.faces.push(Face { corners, normal, cells: area / (size * size), size });
        }
        for ([a, b], _) in skin.edges.iter().filter(|(_, class)| matches!(class, Class::Curve(_))) {
            let ends = [*a, *b].map(|v| skin.points[v as usize]);
            statistics.curves.push(Piece { ends, size: finer * edge(*a, *b) });
        }
        let size_near = |point: &Point| {
            let to = |face: &Face| (face.corners[0] - point).norm_squared();
            let nearest = statistics.faces.iter().min_by(|a, b| to(a).total_cmp(&to(b)));
            nearest.map_or(0.0, |face| face.size)
        };
        let corners = whole.features.corners.iter();
        statistics.corners = corners.map(|corner| (corner.point, size_near(&corner.point))).collect();
        Ok(statistics)
    }

    /// The number of periodic coarse triangles in another piece than their copies.
    pub fn separated(&self, cuts: &Cuts) -> usize {
        self.periodic.iter().map(|faces| faces.separated(cuts)).sum()
    }

    /// The statistics inside a piece of space.
    pub(super) fn within(&self, contains: impl Fn(&Point) -> bool) -> Crossed<'_> {
        Crossed {
            faces: self.faces.iter().filter(|face| face.corners.iter().any(&contains)).collect(),
            curves: self.curves.iter().filter(|piece| piece.ends.iter().any(&contains)).collect(),
            corners: self.corners.iter().filter(|corner| contains(&corner.0)).collect(),
        }
    }
}

/// Evenly spread points in a tet, k per edge.
fn grid(corners: &[Point; 4], k: usize) -> impl Iterator<Item = Point> + '_ {
    let at = move |a: usize, b: usize, c: usize| {
        let weight = |i: usize| (i as f64 + 0.25) / k as f64;
        let [u, v, w] = [1, 2, 3].map(|i| corners[i] - corners[0]);
        corners[0] + u * weight(a) + v * weight(b) + w * weight(c)
    };
    (0..k).flat_map(move |a| (0..k - a).flat_map(move |b| (0..k - a - b).map(move |c| at(a, b, c))))
}

/// Whether a plane separates the points.
fn straddles(points: &[Point; 3], plane: &CutPlane) -> bool {
    let [a, b, c] = points.map(|point| plane.value(&point) < 0.0);
    a != b || b != c
}

/// The boundary data in a piece of space, which a plane may cut.
pub(super) struct Crossed<'a> {
    faces: Vec<&'a Face>,
    curves: Vec<&'a Piece>,
    corners: Vec<&'a (Point, f64)>,
}

/// If a curve segment is closer to a plane than this fraction of a fine edge along its whole
/// length, but not in it, their intersection is ill-conditioned.
const NEARLY_IN: f64 = 0.01;

/// Rounding of coordinates: points closer than this (relative) are in the plane.
const ROUNDING: f64 = 1e-15;

/// The distance in fine edges that a plane keeps from entities that it does not cross well.
const CLEAR: f64 = 1.5;

impl Crossed<'_> {
    /// The number of fine triangles and edges that a plane cuts at a small angle or comes too close
    /// to, weighted by `shallow` of the sine of the angle.
    pub(super) fn badly_cut(&self, plane: &CutPlane, shallow: impl Fn(f64) -> f64) -> f64 {
        let near = |points: &[Point], size: f64| {
            let values = points.iter().map(|p| plane.value(p));
            let [low, high] =
                values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)]);
            low < CLEAR * size && high > -CLEAR * size
        };
        let faces = self.faces.iter().filter(|face| near(&face.corners, face.size));
        let faces = faces.map(|face| shallow(plane.normal.cross(&face.normal).norm()) * face.cells);
        let curves = self.curves.iter().filter(|piece| near(&piece.ends, piece.size)).map(|piece| {
            let way = piece.ends[1] - piece.ends[0];
            let off = piece.ends.iter().map(|end| plane.value(end).abs()).fold(0.0, f64::max);
            let largest = piece.ends[0].coords.amax().max(piece.ends[1].coords.amax());
            if off < NEARLY_IN * piece.size && off > ROUNDING * largest {
                return f64::INFINITY;
            }
            shallow(plane.normal.dot(&way).abs() / way.norm()) * way.norm() / piece.size
        });
        faces.sum::<f64>() + curves.sum::<f64>()
    }

    /// The corners.
    pub(super) fn corners(&self) -> impl Iterator<Item = Spot> + '_ {
        self.corners.iter().map(|&&(point, size)| Spot { point, near: CLEAR * size, is_exact: true })
    }

    /// Boundary points where planes that bound a piece meet curves or other planes.
    pub(super) fn meeting_points(&self, before: &[CutPlane], beside: &[CutPlane]) -> Vec<Spot> {
        let mut points = Vec::new();
        for (k, wall) in before.iter().enumerate() {
            for piece in &self.curves {
                let [a, b] = piece.ends.map(|end| wall.value(&end));
                if (a < 0.0) != (b < 0.0) {
                    let point = piece.ends[0] + (piece.ends[1] - piece.ends[0]) * (a / (a - b));
                    points.push(Spot { point, near: CLEAR * piece.size, is_exact: false });
                }
            }
            let across = self.faces.iter().filter(|face| straddles(&face.corners, wall));
            for face in across {
                let plane = CutPlane { point: face.corners[0], normal: face.normal };
                let others = before[k + 1..].iter().chain(beside);
                let met = others.filter(|other| straddles(&face.corners, other));
                let met = met.filter_map(|other| meeting_point([wall, other, &plane]));
                let middle = Point::from(face.corners.iter().map(|c| c.coords).sum::<Vector>() / 3.0);
                let reach = face.corners.iter().map(|c| (c - middle).norm()).fold(0.0, f64::max);
                let on_face = met.filter(|point| (point - middle).norm() <= reach);
                let near = CLEAR * face.size;
                points.extend(on_face.map(|point| Spot { point, near, is_exact: false }));
            }
        }
        points
    }
}
