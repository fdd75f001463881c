//! Coordinates by the dyadic rule, with projection onto curves and patches.
//!
//! Let n = m·2ᵏ with m odd. If m > 1, points at multiples of 2ᵏ are placed by
//! [`blend`](super::blend). Then, for steps s = 2ᵏ/2, …, 2, 1, each new lattice point is the mean
//! of its two neighbours at distance s along the lattice edge whose midpoint it is; the centre of
//! an octahedron is the mean of its six corners. These are the points of k rounds of 1:8
//! refinement. Edges come first, then faces, then tets. Each depends only on its own coarse entity
//! and that entity's boundary, in the order of global ids, so all ranks that share an entity
//! compute the same bits.
//!
//! **Points on planes and straight curves are not projected.** The mean of two points of a plane is
//! off the plane by at most half an ulp per coordinate more than they are (exact on an
//! axis-parallel plane); projection would round by at least as much. After at most ten levels the
//! error stays within 5 ulp per coordinate, below one in practice: far below 10⁻¹² of the bounding
//! box unless the geometry is some thousand box diagonals away from the origin.

use super::blend::{Blend, barycentric, split};
use super::displacements::EdgeDisplacements;
use super::lattice::Lattice;
use super::numbering::Numbering;
use super::{Keep, RefineError, Settings};
use crate::Point;
use crate::ground::kernel::buckets::{map_each, ranges, tabulate};
use crate::ground::mesh::{Class, EDGE_BETWEEN, EdgeId, TET_FACES, TetId};
use crate::ground::projector::Projector;
use crate::parallel::distribution::DistMesh;
use csg::{CurveId, PatchId, ProjectionFailed};
use rayon::prelude::*;
use std::sync::atomic::AtomicU32;
use std::sync::atomic::Ordering::Relaxed;

/// The coordinates of a point as the fine mesh stores them.
pub type Coordinates = [f64; 3];

/// The geometric entity that the fine vertices interior to a coarse entity are projected to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Place {
    /// None: vertices stay at the mean.
    Free,
    /// A curve that is not straight.
    Curve(CurveId),
    /// A patch that is not plane.
    Patch(PatchId),
}

impl Place {
    fn of(class: Class, projector: &Projector) -> Self {
        match class {
            Class::Curve(curve) if !projector.is_straight_curve(curve) => Self::Curve(curve),
            Class::Patch(patch) if !projector.is_flat_patch(patch) => Self::Patch(patch),
            _ => Self::Free,
        }
    }

    #[inline]
    fn snap(self, projector: &Projector, point: Coordinates) -> Result<Coordinates, ProjectionFailed> {
        let snapped = match self {
            Self::Free => return Ok(point),
            Self::Curve(curve) => projector.project_curve(curve, &Point::from(point))?,
            Self::Patch(patch) => projector.project_patch(patch, &Point::from(point))?,
        };
        Ok(snapped.into())
    }
}

/// Whether the lattice of a tet is affine: no displaced edge, no edge or face on curved geometry.
pub fn is_flat(
    mesh: &DistMesh,
    projector: &Projector,
    displacements: &EdgeDisplacements,
    tet: TetId,
) -> bool {
    let free = |class| Place::of(class, projector) == Place::Free;
    let bent = |edge: &EdgeId| displacements.get(mesh.edge_ids[edge.index()]).is_some();
    (displacements.is_empty() || !mesh.tet_edges[tet.index()].iter().any(bent))
        && mesh.tet_edges[tet.index()].iter().all(|edge| free(mesh.edge_classes[edge.index()]))
        && mesh.tet_faces[tet.index()].iter().all(|face| free(mesh.face_classes[face.index()]))
}

/// Whether an edge may be displaced: inside a body, or on a curved patch of one surface. On one of
/// several, points of the edge might leave the surface that they were projected to.
pub fn may_bend(class: Class, projector: &Projector) -> bool {
    match Place::of(class, projector) {
        Place::Patch(patch) => !projector.is_composite_patch(patch),
        _ => matches!(class, Class::Body(_)),
    }
}

/// Allocates the stored fine vertices and computes those on coarse vertices, edges and faces.
///
/// # Errors
/// [`RefineError::OutOfMemory`]; [`RefineError::Projection`] if some points cannot be projected.
pub fn boundary_first(
    mesh: &DistMesh,
    projector: &Projector,
    numbering: &Numbering,
    settings: &Settings,
) -> Result<Box<[Coordinates]>, RefineError> {
    let [edge_base, face_base, tet_base] = numbering.bases();
    let count = match settings.keep {
        Keep::All => numbering.vertices() as usize,
        Keep::Boundary => tet_base,
    };
    let mut points: Box<[Coordinates]> = bytemuck::allocation::try_zeroed_slice_box(count).map_err(|()| {
        RefineError::OutOfMemory { rank: mesh.rank, bytes: (count * size_of::<Coordinates>()) as u64 }
    })?;
    let (vertices, rest) = points.split_at_mut(edge_base);
    for (coordinates, point) in vertices.iter_mut().zip(&mesh.points) {
        *coordinates = (*point).into();
    }
    let (edges, rest) = rest.split_at_mut(face_base - edge_base);
    let mut failed = fill_edges(mesh, projector, &settings.displacements, vertices, edges);
    if failed.is_empty() {
        let faces = &mut rest[..tet_base - face_base];
        failed = fill_faces(mesh, projector, numbering, &*vertices, &*edges, faces);
    }
    match failed.first() {
        None => Ok(points),
        Some(&first) => Err(RefineError::Projection { count: failed.len(), first }),
    }
}

fn fill_edges(
    mesh: &DistMesh,
    projector: &Projector,
    displacements: &EdgeDisplacements,
    vertices: &[Coordinates],
    edges: &mut [Coordinates],
) -> Vec<ProjectionFailed> {
    if edges.is_empty() {
        return Vec::new();
    }
    let edge_points = edges.len() / mesh.edges.len();
    let fill = |(edge, inside): (usize, &mut [Coordinates])| {
        let ends = mesh.edges[edge].map(|v| vertices[v.index()]);
        let place = Place::of(mesh.edge_classes[edge], projector);
        let bend =
            displacements.get(mesh.edge_ids[edge]).filter(|_| may_bend(mesh.edge_classes[edge], projector));
        fill_edge(ends, inside, bend, |point| place.snap(projector, point)).err()
    };
    edges.par_chunks_mut(edge_points).enumerate().filter_map(fill).collect()
}

/// Computes the points interior to an edge from its ends.
fn fill_edge(
    ends: [Coordinates; 2],
    inside: &mut [Coordinates],
    bend: Option<Coordinates>,
    snap: impl Fn(Coordinates) -> Result<Coordinates, ProjectionFailed>,
) -> Result<(), ProjectionFailed> {
    let n = inside.len() + 1;
    let (m, power) = split(n as u32);
    // The mean of the parabola 4t(1−t) at t − h and t + h is below its value at t by 4h², for every
    // t.
    let bent = |point: Coordinates, factor: f64| match bend {
        Some(bend) => [0, 1, 2].map(|x| point[x] + factor * bend[x]),
        None => point,
    };
    for j in 1..m {
        let t = f64::from(j) / f64::from(m);
        inside[(j * power) as usize - 1] = snap(bent(barycentric(&ends, [m - j, j]), 4.0 * t * (1.0 - t)))?;
    }
    let mut step = power as usize / 2;
    while step > 0 {
        for k in (step..n).step_by(2 * step) {
            let before = if k == step { ends[0] } else { inside[k - step - 1] };
            let after = if k + step == n { ends[1] } else { inside[k + step - 1] };
            let h = step as f64 / n as f64;
            inside[k - 1] = snap(bent(mean(before, after), 4.0 * h * h))?;
        }
        step /= 2;
    }
    Ok(())
}

#[inline]
fn mean(p: Coordinates, q: Coordinates) -> Coordinates {
    [0, 1, 2].map(|x| 0.5 * (p[x] + q[x]))
}

fn fill_faces(
    mesh: &DistMesh,
    projector: &Projector,
    numbering: &Numbering,
    vertices: &[Coordinates],
    edges: &[Coordinates],
    faces: &mut [Coordinates],
) -> Vec<ProjectionFailed> {
    if faces.is_empty() {
        return Vec::new();
    }
    let lattice = numbering.lattice();
    let n = lattice.n() as usize;
    let face_edges = face_edges(mesh);
    let edge_points = lattice.edge_points() as usize;
    let fill = |triangle: &mut Triangle, (face, inside): (usize, &mut [Coordinates])| {
        let [p, q, r] = mesh.faces[face].map(|v| vertices[v.index()]);
        triangle.set(0, 0, p);
        triangle.set(n, 0, q);
        triangle.set(0, n, r);
        let [pq, pr, qr] = face_edges[face].map(|e| &edges[e.index() * edge_points..][..edge_points]);
        for k in 1..n {
            triangle.set(k, 0, pq[k - 1]);
            triangle.set(0, k, pr[k - 1]);
            triangle.set(n - k, k, qr[k - 1]);
        }
        let place = Place::of(mesh.face_classes[face], projector);
        let filled = triangle.fill(|point| place.snap(projector, point));
        for (coordinates, (j, k)) in inside.iter_mut().zip(lattice.face_interior()) {
            *coordinates = triangle.get(j as usize, k as usize);
        }
        filled.err()
    };
    faces
        .par_chunks_mut(lattice.face_points() as usize)
        .enumerate()
        .map_init(|| Triangle::new(n), fill)
        .flatten_iter()
        .collect()
}

/// The edges of each face: first to second, first to third and second to third vertex.
fn face_edges(mesh: &DistMesh) -> Vec<[EdgeId; 3]> {
    let face_to_edges = tabulate(mesh.faces.len(), |_| [const { AtomicU32::new(0) }; 3]);
    map_each(ranges(mesh.tets.len()), |range| {
        for tet in range {
            let vertices = mesh.tets[tet];
            for (corners, face) in TET_FACES.into_iter().zip(mesh.tet_faces[tet]) {
                let [p, q, r] = super::numbering::ascending(corners, |corner| vertices[corner].0);
                let edges = [[p, q], [p, r], [q, r]].map(|[i, j]| mesh.tet_edges[tet][EDGE_BETWEEN[i][j]]);
                // Both tets of a face store the same.
                face_to_edges[face.index()]
                    .iter()
                    .zip(edges)
                    .for_each(|(to, edge)| to.store(edge.0, Relaxed));
            }
        }
    });
    face_to_edges.into_iter().map(|edges| edges.map(|edge| EdgeId(edge.into_inner()))).collect()
}

/// The lattice points of one triangle, by their weights j, k at the second and third corner.
struct Triangle {
    n: usize,
    points: Vec<Coordinates>,
    blend: Blend<3>,
}

impl Triangle {
    fn new(n: usize) -> Self {
        let blend = Blend::new(split(n as u32).0);
        Self { n, points: vec![[0.0; 3]; (n + 1) * (n + 1)], blend }
    }

    #[inline]
    fn get(&self, j: usize, k: usize) -> Coordinates {
        self.points[k * (self.n + 1) + j]
    }

    #[inline]
    fn set(&mut self, j: usize, k: usize, point: Coordinates) {
        self.points[k * (self.n + 1) + j] = point;
    }

    /// Computes the interior points from those on the edges.
    fn fill(
        &mut self,
        snap: impl Fn(Coordinates) -> Result<Coordinates, ProjectionFailed>,
    ) -> Result<(), ProjectionFailed> {
        let n = self.n;
        let (m, power) = split(n as u32);
        let power = power as usize;
        if m > 1 {
            let corners = [self.get(0, 0), self.get(n, 0), self.get(0, n)];
            let points = &self.points;
            self.blend.take(&corners, |[_, j, k]| points[(k as usize * (n + 1) + j as usize) * power]);
            for (j, k) in Lattice::new(m).face_interior() {
                let point = snap(self.blend.point(&corners, [m - j - k, j, k]))?;
                self.set(j as usize * power, k as usize * power, point);
            }
        }
        let mut step = power / 2;
        while step > 0 {
            for k in (step..n).step_by(step) {
                for j in (step..n - k).step_by(step) {
                    // The neighbours differ in the two weights that are odd multiples of the step.
                    let (p, q) = match (j / step % 2, k / step % 2) {
                        (0, 0) => continue,
                        (1, 0) => (self.get(j - step, k), self.get(j + step, k)),
                        (0, _) => (self.get(j, k - step), self.get(j, k + step)),
                        _ => (self.get(j + step, k - step), self.get(j - step, k + step)),
                    };
                    self.set(j, k, snap(mean(p, q))?);
                }
            }
            step /= 2;
        }
        Ok(())
    }
}
