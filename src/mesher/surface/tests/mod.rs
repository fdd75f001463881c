//! Tests of surface meshes: small geometries built by hand, random ones, and NETGEN's tutorials.

mod by_hand;
mod random;
mod tutorials;
mod written;

use super::*;
use crate::ground::mesh::{BoundaryTriangle, VertexId};
use crate::ground::size::SizeField;
use crate::{Point, Vector};
use csg::primitive::{Cylinder, Plane};
use csg::{
    Aabb, BodyId, Corner, CornerId, Curve, CurveId, Features, Fin, Geometry, Patch, PatchId, Projector,
    Surface, SurfaceId,
};
use std::f64::consts::TAU;

/// A geometry built by hand, with its curves divided into segments.
struct Made {
    geometry: Geometry,
    features: Features,
    curves: SurfaceMesh,
}

impl Made {
    fn new(surfaces: Vec<Surface>) -> Self {
        let bounds = Aabb { min: Point::new(-5., -5., -5.), max: Point::new(5., 5., 5.) };
        Self {
            geometry: Geometry { surfaces, ..Geometry::default() },
            features: Features {
                corners: Vec::new(),
                curves: Vec::new(),
                patches: Vec::new(),
                bounds,
                identified: Vec::new(),
            },
            curves: SurfaceMesh::default(),
        }
    }

    fn corner(&mut self, point: Point, surfaces: &[u32]) -> CornerId {
        let id = CornerId::new(self.features.corners.len());
        self.features
            .corners
            .push(Corner { point, surfaces: surfaces.iter().map(|&s| SurfaceId(s)).collect() });
        self.curves.points.push(point);
        self.curves.classes.push(Class::Corner(id));
        id
    }

    /// A closed curve of `n` segments; `at` maps turns to points.
    fn ring(&mut self, surfaces: [u32; 2], n: usize, at: impl Fn(f64) -> Point) -> CurveId {
        let id = CurveId::new(self.features.curves.len());
        let points: Vec<Point> = (0..n).map(|k| at(k as f64 / n as f64)).collect();
        let first = self.curves.points.len();
        for k in 0..n {
            let vertices = [VertexId::new(first + k), VertexId::new(first + (k + 1) % n)];
            self.curves.segments.push(Segment { vertices, curve: id });
            self.curves.classes.push(Class::Curve(id));
        }
        let mut trace: Vec<Point> = (0..=64).map(|k| at(f64::from(k) / 64.0)).collect();
        trace[64] = trace[0];
        self.curves.points.extend(points);
        self.features.curves.push(Curve {
            surfaces: surfaces.map(SurfaceId),
            ends: None,
            trace,
            fins: Vec::new(),
        });
        id
    }

    /// A curve between two corners, in `n` segments; corners are the first vertices.
    fn arc(
        &mut self,
        surfaces: [u32; 2],
        ends: [CornerId; 2],
        n: usize,
        at: impl Fn(f64) -> Point,
    ) -> CurveId {
        let id = CurveId::new(self.features.curves.len());
        let mut vertices = vec![VertexId(ends[0].0)];
        for k in 1..n {
            vertices.push(VertexId::new(self.curves.points.len()));
            self.curves.points.push(at(k as f64 / n as f64));
            self.curves.classes.push(Class::Curve(id));
        }
        vertices.push(VertexId(ends[1].0));
        for w in vertices.windows(2) {
            self.curves.segments.push(Segment { vertices: [w[0], w[1]], curve: id });
        }
        let trace = (0..=64).map(|k| at(f64::from(k) / 64.0)).collect();
        self.features.curves.push(Curve {
            surfaces: surfaces.map(SurfaceId),
            ends: Some(ends),
            trace,
            fins: Vec::new(),
        });
        id
    }

    fn patch(&mut self, surface: u32, flipped: bool, boundary: &[(CurveId, bool)], seeds: &[Point]) {
        let id = PatchId::new(self.features.patches.len());
        for &(curve, forward) in boundary {
            self.features.curves[curve.index()].fins.push(Fin { patch: id, forward });
        }
        self.features.patches.push(Patch {
            surface: SurfaceId(surface),
            flipped,
            inside: Some(BodyId(0)),
            outside: None,
            cutout: None,
            boundary: boundary.to_vec(),
            corners: Vec::new(),
            seeds: seeds.to_vec(),
            bc: 1,
            name: None,
        });
    }

    /// Meshes the geometry and checks the result.
    fn mesh(&self, size: &dyn SizeField) -> (SurfaceMesh, Report) {
        let settings = Settings::default();
        let (mesh, report) =
            mesh_patches(&self.geometry, &self.features, self.curves.clone(), size, &settings)
                .expect("a mesh");
        let projector = Projector::new(&self.geometry, &self.features);
        assert_eq!(mesh.check(&self.features, &projector), []);
        assert_eq!(mesh.points[..self.curves.points.len()], self.curves.points[..]);
        assert_eq!(report.flattening_left(), 0);
        (mesh, report)
    }
}

fn euler(mesh: &SurfaceMesh) -> i64 {
    let mut used: Vec<VertexId> = mesh.triangles.iter().flat_map(|t| t.vertices).collect();
    used.sort_unstable();
    used.dedup();
    let mut edges: Vec<[VertexId; 2]> = mesh
        .triangles
        .iter()
        .flat_map(|t| {
            let [a, b, c] = t.vertices;
            [[a, b], [b, c], [c, a]].map(|[a, b]| [a.min(b), a.max(b)])
        })
        .collect();
    edges.sort_unstable();
    edges.dedup();
    used.len() as i64 - edges.len() as i64 + mesh.triangles.len() as i64
}

fn area(mesh: &SurfaceMesh) -> f64 {
    let of = |t: &BoundaryTriangle| {
        let [a, b, c] = t.vertices.map(|v| mesh.points[v.index()]);
        crate::ground::kernel::simplex::area(&a, &b, &c)
    };
    mesh.triangles.iter().map(of).sum()
}

fn circle(center: Point, radius: f64, height: f64) -> impl Fn(f64) -> Point {
    move |t| {
        let (s, c) = (TAU * t).sin_cos();
        center + Vector::new(radius * c, radius * s, height)
    }
}

fn plane(z: f64, up: f64) -> Surface {
    Surface::Plane(Plane { point: Point::new(0.0, 0.0, z), normal: Vector::new(0.0, 0.0, up) })
}

fn z_cylinder(radius: f64) -> Surface {
    Surface::Cylinder(Cylinder { point: Point::origin(), axis: Vector::z(), radius })
}
