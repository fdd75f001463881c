//! Validation of a surface mesh.

use super::SurfaceMesh;
use crate::Point;
use crate::ground::kernel::simplex::area_vector;
use crate::ground::mesh::{Class, VertexId};
use csg::{CurveId, Features, PatchId, Projector};

/// A fault of a surface mesh.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SurfaceFault {
    /// A segment is not used by a patch's triangles as its curve requires.
    #[error("segment {segment} of curve {}, from vertex {} to {}, is in {found} triangles of patch {}, not in {expected}",
        .curve.0, .edge[0].0, .edge[1].0, .patch.0)]
    SegmentUse {
        /// The patch.
        patch: PatchId,
        /// The curve.
        curve: CurveId,
        /// Index of the segment.
        segment: usize,
        /// The directed edge.
        edge: [VertexId; 2],
        /// The number of triangles that contain it.
        found: usize,
        /// The number required.
        expected: usize,
    },
    /// An edge that is not a segment is not in exactly two triangles of its patch, once in each
    /// direction.
    #[error("not closed: the edge from vertex {} to {} is in {forward} triangles of patch {} and its reverse in {backward}",
        .edge[0].0, .edge[1].0, .patch.0)]
    OpenEdge {
        /// The patch.
        patch: PatchId,
        /// The directed edge.
        edge: [VertexId; 2],
        /// Triangles that contain it in this direction.
        forward: usize,
        /// Triangles that contain it in the opposite direction.
        backward: usize,
    },
    /// A triangle is at 90° or more to the patch's normal at one of its vertices, or degenerate.
    #[error("triangle {triangle} of patch {} is at {degrees}° to the patch's normal", .patch.0)]
    Folded {
        /// Index of the triangle.
        triangle: usize,
        /// The patch.
        patch: PatchId,
        /// The angle between the normals.
        degrees: f64,
    },
    /// A vertex does not lie on the entity that it is classified on.
    #[error("vertex {} is at distance {distance} from {class:?}, on which it is classified", .vertex.0)]
    OffSurface {
        /// The vertex.
        vertex: VertexId,
        /// The entity.
        class: Class,
        /// The distance.
        distance: f64,
    },
    /// A vertex on a patch is in no triangle.
    #[error("vertex {} is in no triangle", .0.0)]
    Unused(VertexId),
    /// A triangle of a patch has a vertex classified on another patch.
    #[error("triangle {triangle} of patch {} has vertex {}, which is on another patch", .patch.0, .vertex.0)]
    Foreign {
        /// Index of the triangle.
        triangle: usize,
        /// Its patch.
        patch: PatchId,
        /// The vertex.
        vertex: VertexId,
    },
}

impl SurfaceMesh {
    /// All faults of a finished surface mesh.
    pub fn check(&self, features: &Features, projector: &Projector) -> Vec<SurfaceFault> {
        let mut faults = Vec::new();
        self.check_places(projector, &mut faults);
        self.check_triangles(projector, features, &mut faults);
        self.check_edges(features, &mut faults);
        faults
    }

    /// Checks that vertices lie on the entities they are classified on.
    fn check_places(&self, projector: &Projector, faults: &mut Vec<SurfaceFault>) {
        for (v, (point, &class)) in self.points.iter().zip(&self.classes).enumerate() {
            let distance = match class {
                Class::Curve(c) => projector.curve_distance(c, point),
                Class::Patch(p) => projector.patch_distance(p, point),
                Class::Corner(_) | Class::Body(_) => continue,
            };
            if distance.is_nan() || distance > projector.tolerance() {
                faults.push(SurfaceFault::OffSurface { vertex: VertexId::new(v), class, distance });
            }
        }
    }

    /// Checks the orientation of triangles and the classes of their vertices.
    fn check_triangles(&self, projector: &Projector, features: &Features, faults: &mut Vec<SurfaceFault>) {
        let mut used = vec![false; self.points.len()];
        for (triangle, t) in self.triangles.iter().enumerate() {
            let p: [&Point; 3] = t.vertices.map(|v| &self.points[v.index()]);
            let area = area_vector(p[0], p[1], p[2]);
            let sign = if features.patch(t.patch).flipped { -1.0 } else { 1.0 };
            for (v, p) in t.vertices.into_iter().zip(p) {
                used[v.index()] = true;
                if matches!(self.classes[v.index()], Class::Patch(q) if q != t.patch) {
                    faults.push(SurfaceFault::Foreign { triangle, patch: t.patch, vertex: v });
                }
                let surface = projector.patch_surface(t.patch);
                let normal = surface.normal(p) * sign;
                // The apex of a cone has no normal: the curvature there is NaN or unbounded.
                let smooth = surface.curvature(p) * projector.tolerance() < 1.0;
                if smooth && (area.dot(&normal) <= 0.0 || area == crate::Vector::zeros()) {
                    let degrees = area.angle(&normal).to_degrees();
                    faults.push(SurfaceFault::Folded { triangle, patch: t.patch, degrees });
                }
            }
        }
        for (v, class) in self.classes.iter().enumerate() {
            if matches!(class, Class::Patch(_)) && !used[v] {
                faults.push(SurfaceFault::Unused(VertexId::new(v)));
            }
        }
    }

    /// Checks that segments are used as the features require, and that all other edges are closed
    /// within their patch.
    fn check_edges(&self, features: &Features, faults: &mut Vec<SurfaceFault>) {
        let mut edges: Vec<(PatchId, [VertexId; 2])> = self
            .triangles
            .iter()
            .flat_map(|t| {
                let [a, b, c] = t.vertices;
                [[a, b], [b, c], [c, a]].map(|e| (t.patch, e))
            })
            .collect();
        edges.sort_unstable();
        let count = |patch: PatchId, edge: [VertexId; 2]| {
            let from = edges.partition_point(|e| *e < (patch, edge));
            edges[from..].iter().take_while(|e| **e == (patch, edge)).count()
        };
        let mut on_curves = Vec::new();
        for (segment, s) in self.segments.iter().enumerate() {
            let [a, b] = s.vertices;
            for (patch, _) in uses_of(features, s.curve) {
                on_curves.extend([(patch, [a, b]), (patch, [b, a])]);
                for (forward, edge) in [(true, [a, b]), (false, [b, a])] {
                    let expected = uses_of(features, s.curve).filter(|&u| u == (patch, forward)).count();
                    let found = count(patch, edge);
                    if found != expected {
                        let curve = s.curve;
                        faults.push(SurfaceFault::SegmentUse {
                            patch,
                            curve,
                            segment,
                            edge,
                            found,
                            expected,
                        });
                    }
                }
            }
        }
        on_curves.sort_unstable();
        let mut at = 0;
        while at < edges.len() {
            let (patch, [a, b]) = edges[at];
            let forward = count(patch, [a, b]);
            at += forward;
            let backward = count(patch, [b, a]);
            if (forward, backward) != (1, 1) && on_curves.binary_search(&(patch, [a, b])).is_err() {
                faults.push(SurfaceFault::OpenEdge { patch, edge: [a, b], forward, backward });
            }
        }
    }
}

/// The patches that have a curve on their boundary, each with the curve's direction.
fn uses_of(features: &Features, curve: CurveId) -> impl Iterator<Item = (PatchId, bool)> + '_ {
    features.curve(curve).fins.iter().map(|fin| (fin.patch, fin.forward))
}
