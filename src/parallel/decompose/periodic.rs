//! Which planes keep periodic faces periodic: a cut through a face must also be one through its
//! copy, at the same place.

use super::cuts::{CutPlane, Cuts, Half};
use crate::ground::mesh::{Mesh, VertexId};
use crate::{Point, Vector};
use csg::{Features, PatchId};
use nalgebra::Isometry3;
use std::collections::BTreeSet;

/// The coarse triangles of the faces of one identification, and their copies.
#[derive(Clone, Debug)]
pub(super) struct PeriodicFaces {
    /// From the faces to their copies.
    motion: Isometry3<f64>,
    triangles: Vec<PeriodicTriangle>,
}

#[derive(Clone, Debug)]
struct PeriodicTriangle {
    /// The corners of the triangle and of its copy.
    corners: [[Point; 3]; 2],
    /// Planes closer than this do not leave it alone.
    near: f64,
}

impl PeriodicTriangle {
    /// Its middle and that of its copy.
    fn middles(&self) -> [Point; 2] {
        self.corners.map(|corners| Point::from(corners.iter().map(|p| p.coords).sum::<Vector>() / 3.0))
    }
}

/// A plane is mapped to itself if its normal changes by no more than this, and its place by no more
/// than this fraction of a triangle.
const EQUAL: f64 = 1e-10;

/// Planes keep this fraction of a coarse edge away from periodic faces that they may not cut.
const CLEAR: f64 = 0.25;

/// The periodic faces of a coarse mesh, by identification.
pub(super) fn periodic_faces(mesh: &Mesh, features: &Features) -> Vec<PeriodicFaces> {
    let of = |identified: &csg::PeriodicMatch| {
        let patches: BTreeSet<PatchId> = identified.patches.iter().map(|pair| pair[0]).collect();
        let triangle = |vertices: [VertexId; 3]| {
            let corners = vertices.map(|v| mesh.points[v.index()]);
            let edge = (0..3).map(|k| (corners[(k + 1) % 3] - corners[k]).norm()).fold(0.0, f64::max);
            let copy = corners.map(|p| identified.motion * p);
            PeriodicTriangle { corners: [corners, copy], near: CLEAR * edge }
        };
        let on_it = mesh.triangles.iter().filter(|t| patches.contains(&t.patch));
        PeriodicFaces { motion: identified.motion, triangles: on_it.map(|t| triangle(t.vertices)).collect() }
    };
    features.identified.iter().map(of).collect()
}

impl PeriodicFaces {
    /// The shift from the faces to their copies, unless they are turned.
    fn shift(&self) -> Option<Vector> {
        let is_turned = self.motion.rotation.angle() > EQUAL;
        (!is_turned).then_some(self.motion.translation.vector)
    }

    /// The number of triangles in another piece than their copies.
    pub fn separated(&self, cuts: &Cuts) -> usize {
        let is_apart = |triangle: &&PeriodicTriangle| {
            let [one, copy] = triangle.middles();
            // Where a plane goes through the middle rounding decides.
            let is_between = |plane: &CutPlane| plane.value(&one).abs() <= EQUAL * triangle.near;
            cuts.leaf_of(&one) != cuts.leaf_of(&copy) && !cuts.planes.iter().any(is_between)
        };
        self.triangles.iter().filter(is_apart).count()
    }

    /// The middles of each two triangles with a common edge, and of their copies.
    #[cfg(test)]
    pub fn neighbours(&self) -> Vec<[[Point; 2]; 2]> {
        let common = |a: &PeriodicTriangle, b: &PeriodicTriangle| {
            a.corners[0].iter().filter(|p| b.corners[0].contains(p)).count()
        };
        let beside = |(k, a): (usize, &PeriodicTriangle)| {
            let others = self.triangles[k + 1..].iter().filter(|b| common(a, b) == 2);
            others.map(|b| [a.middles(), b.middles()]).collect::<Vec<_>>()
        };
        self.triangles.iter().enumerate().flat_map(beside).collect()
    }

    /// Whether the motion maps a plane, with its sides, to itself.
    fn keeps(&self, plane: &CutPlane) -> bool {
        let size = self.triangles.first().map_or(1.0, |triangle| triangle.near);
        let (normal, point) = (self.motion * plane.normal, self.motion * plane.point);
        (normal - plane.normal).amax() <= EQUAL && plane.value(&point).abs() <= EQUAL * size
    }
}

/// The periodic faces inside a piece of space.
pub(super) struct PeriodicWithin<'a> {
    all: Vec<Within<'a>>,
    /// Whether faces must stay in one piece with their copies.
    together: bool,
}

struct Within<'a> {
    faces: &'a PeriodicFaces,
    /// The triangles, and their copies, that reach into the piece.
    inside: [Vec<&'a PeriodicTriangle>; 2],
    /// Whether those are the copies of these.
    is_paired: bool,
}

impl<'a> PeriodicWithin<'a> {
    /// The faces in the intersection of half-spaces of planes.
    pub fn new(all: &'a [PeriodicFaces], halves: &[Half], planes: &[CutPlane], together: bool) -> Self {
        let depth =
            |point: &Point| halves.iter().map(|half| half.depth(planes, point)).fold(f64::INFINITY, f64::min);
        let within = |faces: &'a PeriodicFaces| {
            let reach = |side: usize| {
                // Or nearly: a triangle may reach into the piece without a corner there.
                let reaches = |t: &&PeriodicTriangle| {
                    halves.iter().all(|half| t.corners[side].iter().any(|p| half.depth(planes, p) > -t.near))
                };
                faces.triangles.iter().filter(reaches).collect::<Vec<_>>()
            };
            let is_paired = faces.triangles.iter().all(|triangle| {
                let [one, copy] = triangle.middles().map(|middle| depth(&middle));
                // Where a wall goes through the middle rounding decides.
                (one > 0.0) == (copy > 0.0) || one.abs().max(copy.abs()) <= EQUAL * triangle.near
            });
            Within { faces, inside: [0, 1].map(reach), is_paired }
        };
        Self { all: all.iter().map(within).collect(), together }
    }

    /// Whether a cut of the piece by a plane keeps its faces periodic.
    pub fn allows(&self, plane: &CutPlane) -> bool {
        self.all.iter().all(|within| {
            if within.is_paired && within.faces.keeps(plane) {
                return true;
            }
            // The side of each face if the plane leaves it alone.
            let side = |side: usize, t: &PeriodicTriangle| {
                let values = t.corners[side].map(|p| plane.value(&p));
                if values.iter().all(|&v| v > t.near) {
                    Some(true)
                } else {
                    values.iter().all(|&v| v < -t.near).then_some(false)
                }
            };
            let sides = [0, 1].map(|s| within.inside[s].iter().map(|t| side(s, t)).collect::<BTreeSet<_>>());
            let is_cut = sides.iter().any(|sides| sides.contains(&None));
            let are_together = !self.together || sides[0].union(&sides[1]).count() <= 1;
            !is_cut && are_together
        })
    }

    /// Normals of planes that the motions map to themselves, near these directions.
    pub fn normals(&self, near: &[Vector]) -> Vec<Vector> {
        let mut found: Vec<Vector> = Vec::new();
        let shifts: Vec<Vector> = self.all.iter().filter_map(|within| within.faces.shift()).collect();
        for within in &self.all {
            match within.faces.shift() {
                Some(shift) => found.extend(near.iter().filter_map(|v| across(v, &shift))),
                None => found.extend(within.faces.motion.rotation.axis().map(|axis| axis.into_inner())),
            }
        }
        for (k, one) in shifts.iter().enumerate() {
            found.extend(shifts[k + 1..].iter().filter_map(|other| one.cross(other).try_normalize(0.0)));
        }
        let mut distinct: Vec<Vector> = Vec::new();
        for normal in found {
            if distinct.iter().all(|known| known.cross(&normal).norm() > PARALLEL) {
                distinct.push(normal);
            }
        }
        distinct
    }
}

/// Directions with a smaller sine of the angle between them are the same.
const PARALLEL: f64 = 1e-6;

/// The unit vector across `shift` that is nearest to `v`, unless they are nearly parallel.
fn across(v: &Vector, shift: &Vector) -> Option<Vector> {
    const LEAST: f64 = 0.1;
    let along = shift * (v.dot(shift) / shift.norm_squared());
    (v - along).try_normalize(LEAST * v.norm())
}

/// The normals of a grid of planes that contain all shifts but one, or all; none unless there are
/// shifts in several directions.
pub(super) fn grid_normals(all: &[PeriodicFaces]) -> Vec<Vector> {
    let mut shifts: Vec<Vector> = Vec::new();
    for shift in all.iter().filter_map(PeriodicFaces::shift) {
        let is_new = match shifts[..] {
            [] => true,
            [a] => a.cross(&shift).norm() > PARALLEL * a.norm() * shift.norm(),
            [a, b] => a.cross(&b).dot(&shift).abs() > PARALLEL * a.cross(&b).norm() * shift.norm(),
            _ => false,
        };
        if is_new {
            shifts.push(shift);
        }
    }
    let normals = match shifts[..] {
        [a, b] => vec![a.cross(&b), a.cross(&a.cross(&b)), b.cross(&a.cross(&b))],
        [a, b, c] => vec![b.cross(&c), c.cross(&a), a.cross(&b)],
        _ => Vec::new(),
    };
    normals.into_iter().filter_map(|normal| normal.try_normalize(0.0)).collect()
}
