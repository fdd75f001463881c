//! Projection to the exact faces and edges of a boundary representation.

use crate::ground::kernel::nearest::{at, in_segment, in_triangle};
use crate::ground::kernel::tree::{Tree, bounds};
use crate::{Point, Vector};
use brep::{Curve, On, Surface, Tessellation, project_to_curve, project_to_surface};
use csg::{CurveId, PatchId, ProjectionFailed};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Faces and edges, each with triangles or segments from which searches for nearest points start.
///
/// The start is the nearest point of the triangles of the trimmed face, so a projection finds the
/// nearest point of the face and not of another part of its surface. The result depends only on the
/// point and the entity, bit by bit, on all ranks and threads. Beyond its edges a face continues
/// along its surface: the chord of an edge that bends into its face is outside of the face.
///
/// A patch may have several faces, and a curve several edges: a point is then projected to the
/// nearest of them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BrepProjector {
    source: Source,
    faces: Vec<Triangles>,
    edges: Vec<Segments>,
    /// Whether each patch is plane, and each curve straight.
    is_flat: Vec<bool>,
    is_straight: Vec<bool>,
}

/// The data of a projector, which is also what ranks exchange.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Source {
    points: Vec<[f64; 3]>,
    faces: Vec<Face>,
    edges: Vec<Edge>,
    /// The faces of each patch.
    patches: Vec<Vec<u32>>,
    /// The edges of each curve.
    curves: Vec<Vec<u32>>,
    tolerance: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Face {
    surface: Surface,
    /// Whether its normal is that of the surface reversed.
    is_reversed: bool,
    /// Vertices and parameters of its triangles.
    triangles: Vec<([u32; 3], [[f64; 2]; 3])>,
    /// Points of the face are at most this far from its triangles (length).
    sag: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Edge {
    curve: Curve<3>,
    /// Vertices with their parameters.
    line: Vec<(u32, f64)>,
    /// Whether elements are too large to follow it.
    is_short: bool,
}

/// The triangles of a face.
#[derive(Clone, Debug, Default, PartialEq)]
struct Triangles {
    tree: Tree,
    corners: Vec<[Point; 3]>,
}

/// The segments of an edge.
#[derive(Clone, Debug, Default, PartialEq)]
struct Segments {
    tree: Tree,
    points: Vec<Point>,
}

/// The tolerance as a fraction of the diagonal of the box, as for analytic surfaces ...
const ON_SURFACE: f64 = 1e-12;
/// ... and relative to the largest coordinate: four units in the last place.
const COORDINATE_ROUNDING: f64 = 4.0 * f64::EPSILON;
/// Edges are sampled where they leave their faces; between samples they may be further away.
const GAP_ROOM: f64 = 1.5;
/// The same for the distance of faces from their triangles.
const SAG_ROOM: f64 = 1.5;
/// Composite patches are flat and curves straight up to this fraction of the tolerance.
const ON_PLANE: f64 = 0.25;

impl BrepProjector {
    /// The faces of a model with its tessellation, grouped by patch, and its edges by curve.
    ///
    /// `is_reversed` says which faces have normals against those of their surfaces, and `is_short`
    /// which edges elements are too large to follow.
    pub fn new(
        model: &brep::Model,
        tessellation: &Tessellation,
        is_reversed: &[bool],
        patches: &[Vec<usize>],
        curves: &[Vec<(usize, bool)>],
        is_short: &[bool],
    ) -> Self {
        let mut faces: Vec<Face> = model
            .patches
            .iter()
            .zip(is_reversed)
            .map(|(patch, &is_reversed)| Face {
                surface: patch.surface.clone(),
                is_reversed,
                triangles: Vec::new(),
                sag: 0.0,
            })
            .collect();
        for t in &tessellation.triangles {
            faces[t.patch as usize].triangles.push((t.vertices, t.parameters));
        }
        // Only composite patches choose between faces.
        for &face in patches.iter().filter(|faces| faces.len() > 1).flatten() {
            faces[face].sag = SAG_ROOM * sag(model, tessellation, face, &faces[face]);
        }
        let mut edges = Vec::new();
        let mut number = |&(edge, _): &(usize, bool)| {
            edges.push(Edge {
                curve: model.curves[edge].curve.clone(),
                line: tessellation.lines[edge].clone(),
                is_short: is_short[edge],
            });
            edges.len() as u32 - 1
        };
        let curves = curves.iter().map(|chain| chain.iter().map(&mut number).collect()).collect();
        let all = bounds(&tessellation.points);
        let largest = all.min.coords.amax().max(all.max.coords.amax());
        let rounding = f64::max(ON_SURFACE * all.diagonal(), COORDINATE_ROUNDING * largest);
        Self::of(Source {
            points: tessellation.points.iter().map(|&p| p.into()).collect(),
            faces,
            edges,
            patches: patches.iter().map(|faces| faces.iter().map(|&face| face as u32).collect()).collect(),
            curves,
            tolerance: rounding.max(GAP_ROOM * tessellation.gap),
        })
    }

    fn of(source: Source) -> Self {
        let point = |v: u32| Point::from(source.points[v as usize]);
        let triangles = |face: &Face| {
            let corners: Vec<[Point; 3]> = face.triangles.iter().map(|t| t.0.map(point)).collect();
            Triangles { tree: Tree::new(&corners.iter().map(bounds).collect::<Vec<_>>()), corners }
        };
        let segments = |edge: &Edge| {
            let points: Vec<Point> = edge.line.iter().map(|&(v, _)| point(v)).collect();
            Segments { tree: Tree::new(&points.windows(2).map(bounds).collect::<Vec<_>>()), points }
        };
        let faces: Vec<Triangles> = source.faces.par_iter().map(triangles).collect();
        let edges: Vec<Segments> = source.edges.par_iter().map(segments).collect();
        let is_flat = |members: &Vec<u32>| {
            let main = &source.faces[members[0] as usize].surface;
            let on_main = |p: &Point| {
                (project_to_surface(main, p, [0.0; 2]).point - p).norm() <= ON_PLANE * source.tolerance
            };
            let is_on = |&face: &u32| {
                source.faces[face as usize].surface.is_plane()
                    && faces[face as usize].corners.iter().flatten().all(on_main)
            };
            main.is_plane() && members[1..].iter().all(is_on)
        };
        let is_line = |&edge: &u32| matches!(source.edges[edge as usize].curve, Curve::Line { .. });
        let is_straight = |members: &Vec<u32>| {
            let ends: Vec<Point> = members
                .iter()
                .flat_map(|&edge| {
                    let points = &edges[edge as usize].points;
                    [points[0], points[points.len() - 1]]
                })
                .collect();
            let far = |p: &&Point| (*p - ends[0]).norm();
            let last = ends.iter().max_by(|p, q| far(p).total_cmp(&far(q))).expect("a curve has edges");
            let is_on = |p: &Point| in_segment(p, &ends[0], last).1.sqrt() <= ON_PLANE * source.tolerance;
            members.iter().all(is_line) && (members.len() == 1 || ends.iter().all(is_on))
        };
        let is_flat = source.patches.iter().map(is_flat).collect();
        let is_straight = source.curves.iter().map(is_straight).collect();
        Self { source, faces, edges, is_flat, is_straight }
    }

    /// The maximum distance of a projected point from its face or, on an edge, from the faces
    /// beside it (length).
    pub fn tolerance(&self) -> f64 {
        self.source.tolerance
    }

    /// The point of the triangles of a face nearest to a point, and its parameters.
    fn nearest(&self, face: u32, point: &Point) -> (Point, [f64; 2]) {
        let Triangles { tree, corners } = &self.faces[face as usize];
        let squared = |i: u32| {
            let triangle = &corners[i as usize];
            (at(triangle, in_triangle(point, triangle)) - point).norm_squared()
        };
        let (nearest, _) = tree.nearest(point, squared).expect("a face has triangles");
        let weights = in_triangle(point, &corners[nearest as usize]);
        let parameters = &self.source.faces[face as usize].triangles[nearest as usize].1;
        let start = [0, 1].map(|i| (0..3).map(|k| weights[k] * parameters[k][i]).sum());
        (at(&corners[nearest as usize], weights), start)
    }

    /// The foot on a face.
    fn foot_on_face(&self, face: u32, point: &Point) -> brep::SurfaceFoot {
        let (_, start) = self.nearest(face, point);
        project_to_surface(&self.source.faces[face as usize].surface, point, start)
    }

    /// The foot on a patch.
    fn foot(&self, patch: PatchId, point: &Point) -> brep::SurfaceFoot {
        let members = &self.source.patches[patch.index()];
        if let [face] = members[..] {
            return self.foot_on_face(face, point);
        }
        // The nearest foot that is on its face, or else the foot from the nearest triangle.
        let mut best: Option<(f64, brep::SurfaceFoot)> = None;
        let mut nearest: Option<(f64, brep::SurfaceFoot)> = None;
        for &face in members {
            let (near, start) = self.nearest(face, point);
            let foot = project_to_surface(&self.source.faces[face as usize].surface, point, start);
            let distance = (near - point).norm();
            if nearest.is_none_or(|(least, _)| distance < least) {
                nearest = Some((distance, foot));
            }
            let room = self.source.faces[face as usize].sag + self.source.tolerance;
            let is_on = foot.is_converged && (self.nearest(face, &foot.point).0 - foot.point).norm() <= room;
            let distance = (foot.point - point).norm();
            if is_on && best.is_none_or(|(least, _)| distance < least) {
                best = Some((distance, foot));
            }
        }
        best.or(nearest).expect("a patch has faces").1
    }

    /// The point of the surface of `patch` nearest to `point`, near the face.
    ///
    /// # Errors
    /// [`ProjectionFailed`] if the search does not converge.
    pub fn project_patch(&self, patch: PatchId, point: &Point) -> Result<Point, ProjectionFailed> {
        let foot = self.foot(patch, point);
        if foot.is_converged { Ok(foot.point) } else { Err(ProjectionFailed(*point)) }
    }

    /// Whether a point of the surface of a patch is within its bounds, up to the distance of the
    /// facets from the surface.
    pub fn is_within(&self, patch: PatchId, point: &Point) -> bool {
        self.source.patches[patch.index()].iter().any(|&face| {
            let (near, parameters) = self.nearest(face, point);
            let surface = &self.source.faces[face as usize].surface;
            // The surface is as far from its facets at the same parameters.
            let sag = (surface.point(parameters) - near).norm();
            (near - point).norm() <= SAG_ROOM * sag + self.source.tolerance
        })
    }

    /// The parameter of the nearest point of the segments of an edge.
    fn start_on_edge(&self, edge: u32, point: &Point) -> f64 {
        let Segments { tree, points } = &self.edges[edge as usize];
        let on = |i: u32| in_segment(point, &points[i as usize], &points[i as usize + 1]);
        let (nearest, _) = tree.nearest(point, |i| on(i).1).expect("an edge has segments");
        let line = &self.source.edges[edge as usize].line;
        let (low, high) = (line[nearest as usize].1, line[nearest as usize + 1].1);
        low + on(nearest).0 * (high - low)
    }

    fn foot_on_edge(&self, number: u32, point: &Point) -> brep::CurveFoot {
        let edge = &self.source.edges[number as usize];
        let [first, last] = [edge.line[0], edge.line[edge.line.len() - 1]];
        let range = [first.1, last.1];
        let start = self.start_on_edge(number, point);
        if let (Some(period), true) = (edge.curve.period(), first.0 == last.0) {
            // A whole period: its end is no end.
            return project_to_curve(&edge.curve, [range[0] - period, range[1] + period], point, start);
        }
        let mut foot = project_to_curve(&edge.curve, range, point, start);
        let points = &self.edges[number as usize].points;
        for (end, corner) in range.into_iter().zip([points[0], points[points.len() - 1]]) {
            if foot.parameter == end {
                // Where the corner is off the end of the curve, the edge goes straight on to it.
                let on_curve = foot.point;
                foot.point = on_curve + (corner - on_curve) * in_segment(point, &on_curve, &corner).0;
            }
        }
        foot
    }

    /// The nearest foot on edges; `None` if there are none.
    fn nearest_foot(&self, edges: impl Iterator<Item = u32>, point: &Point) -> Option<brep::CurveFoot> {
        let distance = |foot: &brep::CurveFoot| (foot.point - point).norm();
        edges.map(|edge| self.foot_on_edge(edge, point)).min_by(|a, b| distance(a).total_cmp(&distance(b)))
    }

    fn foot_on_curve(&self, curve: CurveId, point: &Point) -> brep::CurveFoot {
        let edges = self.source.curves[curve.index()].iter().copied();
        self.nearest_foot(edges, point).expect("a curve has edges")
    }

    /// The point of `curve` nearest to `point`.
    ///
    /// # Errors
    /// [`ProjectionFailed`] if the search does not converge.
    pub fn project_curve(&self, curve: CurveId, point: &Point) -> Result<Point, ProjectionFailed> {
        let foot = self.foot_on_curve(curve, point);
        if foot.is_converged { Ok(foot.point) } else { Err(ProjectionFailed(*point)) }
    }

    /// The distance of `point` from the surface of `patch`.
    pub fn patch_distance(&self, patch: PatchId, point: &Point) -> f64 {
        (self.foot(patch, point).point - point).norm()
    }

    /// The unit normal of a patch near a point, away from the body behind it; `None` at poles.
    ///
    /// It is that of the main face of a composite patch: elements are too large to follow the
    /// others.
    pub fn normal(&self, patch: PatchId, near: &Point) -> Option<Vector> {
        let face = self.source.patches[patch.index()][0];
        let foot = self.foot_on_face(face, near);
        let sign = if self.source.faces[face as usize].is_reversed { -1.0 } else { 1.0 };
        (foot.normal != Vector::zeros()).then(|| foot.normal * sign)
    }

    /// The unit tangent of a curve near a point, in one of its two directions: that of its long
    /// edges.
    pub fn tangent(&self, curve: CurveId, near: &Point) -> Option<Vector> {
        let edges = self.source.curves[curve.index()].iter().copied();
        let long = edges.clone().filter(|&edge| !self.source.edges[edge as usize].is_short);
        let foot = self.nearest_foot(long, near).or_else(|| self.nearest_foot(edges, near))?;
        Some(foot.tangent).filter(|t| *t != Vector::zeros())
    }

    /// The name of the kind of the surface of a patch: that of its main face.
    pub fn kind(&self, patch: PatchId) -> &'static str {
        self.source.faces[self.source.patches[patch.index()][0] as usize].surface.kind()
    }

    /// Whether a patch has several faces.
    pub fn is_composite_patch(&self, patch: PatchId) -> bool {
        self.source.patches[patch.index()].len() > 1
    }

    /// Whether a patch is plane.
    pub fn is_flat_patch(&self, patch: PatchId) -> bool {
        self.is_flat[patch.index()]
    }

    /// Whether a curve is straight.
    pub fn is_straight_curve(&self, curve: CurveId) -> bool {
        self.is_straight[curve.index()]
    }

    /// Encodes the projector for other ranks, as JSON.
    pub fn encode(&self) -> Vec<u8> {
        serde_json::to_vec(&self.source).expect("plain data")
    }

    /// The inverse of [`encode`](Self::encode); `None` if the bytes are invalid.
    pub fn decode(bytes: &[u8]) -> Option<Self> {
        let source: Source = serde_json::from_slice(bytes).ok()?;
        let exists = |v: u32| (v as usize) < source.points.len();
        let face = |f: &Face| {
            f.surface.is_sound()
                && !f.triangles.is_empty()
                && f.triangles.iter().all(|t| t.0.into_iter().all(exists))
        };
        let edge = |e: &Edge| e.curve.is_sound() && e.line.len() >= 2 && e.line.iter().all(|on| exists(on.0));
        let members = |all: &[Vec<u32>], count: usize| {
            all.iter().all(|of| !of.is_empty() && of.iter().all(|&i| (i as usize) < count))
        };
        let is_sound = source.faces.iter().all(face)
            && source.edges.iter().all(edge)
            && members(&source.patches, source.faces.len())
            && members(&source.curves, source.edges.len());
        is_sound.then(|| Self::of(source))
    }
}

/// The largest distance of a face from its triangles that is found at their middles and between the
/// vertices of its edges.
fn sag(model: &brep::Model, tessellation: &Tessellation, number: usize, face: &Face) -> f64 {
    let of_triangle = |(vertices, parameters): &([u32; 3], [[f64; 2]; 3])| {
        let corners = vertices.map(|v| tessellation.points[v as usize]);
        let third = 1.0 / 3.0;
        let middles = [[third, third, third], [0.5, 0.5, 0.0], [0.0, 0.5, 0.5], [0.5, 0.0, 0.5]];
        let off = |weights: [f64; 3]| {
            let [u, v] = [0, 1].map(|i| (0..3).map(|k| weights[k] * parameters[k][i]).sum());
            (face.surface.point([u, v]) - at(&corners, weights)).norm()
        };
        middles.into_iter().map(off).fold(0.0, f64::max)
    };
    let fins = model.patches[number].loops.iter().flatten();
    let edges = fins.filter_map(|fin| if let On::Curve(edge) = fin.on { Some(edge) } else { None });
    let of_edge = |edge: usize| {
        let off = |w: &[(u32, f64)]| {
            let [p, q] = [w[0], w[1]].map(|(v, _)| tessellation.points[v as usize]);
            let middle = Point::from(model.curves[edge].curve.point(0.5 * (w[0].1 + w[1].1)));
            in_segment(&middle, &p, &q).1.sqrt()
        };
        tessellation.lines[edge].windows(2).map(off).fold(0.0, f64::max)
    };
    let on_triangles = if face.surface.is_plane() {
        0.0
    } else {
        face.triangles.iter().map(of_triangle).fold(0.0, f64::max)
    };
    edges.map(of_edge).fold(on_triangles, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use brep::{Model, Settings, Unit};

    #[test]
    fn an_edge_goes_straight_on_to_a_corner_off_its_end() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/geometries/step/tiny_chamfer.step");
        let mut model = Model::read_step(&std::fs::read(path).unwrap(), Unit::OfFile).unwrap();
        let edge = 0;
        let [point, tangent, ..] = model.curves[edge].curve.jet(model.curves[edge].range[1]);
        let (end, away) = (Point::from(point), tangent.normalize() * 3e-5);
        model.corners[model.curves[edge].ends[1]].point = end + away;
        let tessellation = Tessellation::of(&mut model, &Settings::default()).unwrap();
        let patches: Vec<Vec<usize>> = (0..model.patches.len()).map(|face| vec![face]).collect();
        let curves: Vec<Vec<(usize, bool)>> =
            (0..model.curves.len()).map(|edge| vec![(edge, true)]).collect();
        let (is_reversed, is_short) = (vec![false; patches.len()], vec![false; curves.len()]);
        let projector = BrepProjector::new(&model, &tessellation, &is_reversed, &patches, &curves, &is_short);
        for share in [0.25, 0.75, 1.0] {
            let place = end + away * share;
            let found = projector.project_curve(CurveId(edge as u32), &place).unwrap();
            assert!((found - place).norm() <= 1e-12, "{share}: {found}");
        }
    }
}
