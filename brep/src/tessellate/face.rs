//! Triangulation of one patch in its parameters.

use super::chain::chain;
use super::frame::{Frame, Node, pole};
use super::{Tessellation, Triangle};
use crate::model::{Model, Patch};
use crate::{BrepError, Point};
use rustc_hash::FxHashMap as HashMap;
use spade::handles::{FaceHandle, FixedFaceHandle, InnerTag};
use spade::{CdtEdge, ConstrainedDelaunayTriangulation, Point2, Triangulation};

/// The tolerances of a tessellation.
pub(super) struct Tolerances {
    /// The largest distance between a surface and its triangles.
    pub chord: f64,
    /// The largest angle between normals.
    pub angle: f64,
    /// The diagonal of the box of the model.
    pub diagonal: f64,
    /// Whether patches with folded triangles fail, so that their curves are divided more finely.
    pub refuses_folds: bool,
    /// Whether sides of a loop that cross beside their common corner end there.
    pub cuts_sides: bool,
}

/// Why a patch has no triangles.
pub(super) enum Failure {
    /// Its loops cross, perhaps because its curves are divided too coarsely.
    Crossing(BrepError),
    /// Its triangles are folded, perhaps because its curves are divided too coarsely.
    Folded(BrepError),
    Final(BrepError),
}

pub(super) type Plane = ConstrainedDelaunayTriangulation<Node>;

/// The triangles of a patch.
pub(super) struct Made {
    /// The vertices inside of the patch.
    points: Vec<Point>,
    /// A vertex that is not on a curve is its index in `points` plus [`INNER`].
    triangles: Vec<Triangle>,
    /// The largest distance between a side and its curve (length).
    gap: f64,
}

impl Made {
    /// No triangles yet.
    pub fn empty(gap: f64) -> Self {
        Self { points: Vec::new(), triangles: Vec::new(), gap }
    }

    /// Adds a vertex inside of the patch, and returns its number for triangles.
    pub fn add_point(&mut self, point: Point) -> u32 {
        self.points.push(point);
        INNER + self.points.len() as u32 - 1
    }

    pub fn add(&mut self, triangle: Triangle) {
        self.triangles.push(triangle);
    }

    /// Appends the vertices and triangles to those of other patches.
    pub fn append_to(self, out: &mut Tessellation) {
        let first = out.points.len() as u32;
        let id = |vertex: u32| if vertex >= INNER { first + vertex - INNER } else { vertex };
        out.points.extend(self.points);
        let numbered = |t: Triangle| Triangle { vertices: t.vertices.map(id), ..t };
        out.triangles.extend(self.triangles.into_iter().map(numbered));
        out.gaps.push(self.gap);
        out.gap = out.gap.max(self.gap);
    }
}

/// Triangulates a patch; `out` has the vertices on curves.
pub(super) fn triangulate(
    model: &Model,
    number: usize,
    out: &Tessellation,
    tolerances: &Tolerances,
) -> Result<Made, Failure> {
    let patch = &model.patches[number];
    let (mut chains, mut gap) = (Vec::new(), 0.0_f64);
    for fins in &patch.loops {
        let (sides, off) = chain(model, number, fins, out, tolerances).map_err(Failure::Final)?;
        chains.push(sides);
        gap = gap.max(off);
    }
    let pole = pole(patch, tolerances.diagonal);
    let frame = Frame::of(&patch.surface, &chains, pole, tolerances);
    let mut face = Face {
        patch,
        number,
        plane: Plane::new(),
        frame,
        sides: HashMap::default(),
        tolerances,
        vertices: Vec::new(),
        known: HashMap::default(),
    };
    let turn = face.frame.turn(&chains);
    for chain in &chains {
        face.add_chain(chain, turn, out)?;
    }
    face.refine(out)?;
    Ok(face.finish(gap))
}

pub(super) struct Face<'a> {
    pub patch: &'a Patch,
    pub number: usize,
    pub plane: Plane,
    pub frame: Frame,
    /// How often loops use each constraint, by the indices of its ends.
    pub sides: HashMap<[usize; 2], usize>,
    pub tolerances: &'a Tolerances,
    /// Points of new vertices.
    pub vertices: Vec<Point>,
    /// The nodes that were added for each vertex; one on a seam has several.
    pub known: HashMap<u32, Vec<Node>>,
}

/// The vertex of a node inside the patch: its index in [`Face::vertices`] is added.
pub(super) const INNER: u32 = 1 << 31;

/// The corners of a triangle in the plane: indices of its vertices, and nodes.
pub(super) type Corners = [(usize, Node); 3];

/// A triangle of the plane.
#[derive(Clone, Copy)]
pub(super) struct Placed {
    pub face: FixedFaceHandle<InnerTag>,
    pub corners: Corners,
}

impl Placed {
    pub fn of(face: FaceHandle<'_, InnerTag, Node, (), CdtEdge<()>, ()>) -> Self {
        Self { face: face.fix(), corners: face.vertices().map(|vertex| (vertex.index(), *vertex.data())) }
    }
}

pub(super) fn is_finite(p: &Point2<f64>) -> bool {
    p.x.is_finite() && p.y.is_finite()
}

pub(super) fn sorted(a: usize, b: usize) -> [usize; 2] {
    [a.min(b), a.max(b)]
}

impl Face<'_> {
    /// Whether each inner face of the triangulation is in the patch: it is if a way from outside
    /// crosses loops an odd number of times.
    fn inside(&self) -> Vec<Option<bool>> {
        let mut inside = vec![None; self.plane.num_all_faces()];
        let outer = self.plane.outer_face();
        inside[outer.index()] = Some(false);
        let mut stack = Vec::new();
        let cross =
            |edge: [usize; 2], from: bool| from ^ (self.sides.get(&edge).copied().unwrap_or(0) % 2 == 1);
        for edge in self.plane.convex_hull() {
            let key = sorted(edge.from().index(), edge.to().index());
            for face in [edge.face(), edge.rev().face()] {
                if let Some(face) = face.as_inner()
                    && inside[face.index()].is_none()
                {
                    inside[face.index()] = Some(cross(key, false));
                    stack.push(face);
                }
            }
        }
        while let Some(face) = stack.pop() {
            let own = inside[face.index()].unwrap_or(false);
            for edge in face.adjacent_edges() {
                if let Some(other) = edge.rev().face().as_inner()
                    && inside[other.index()].is_none()
                {
                    let key = sorted(edge.from().index(), edge.to().index());
                    inside[other.index()] = Some(cross(key, own));
                    stack.push(other);
                }
            }
        }
        inside
    }

    pub fn point(&self, vertex: u32, out: &Tessellation) -> Point {
        if vertex >= INNER { self.vertices[(vertex - INNER) as usize] } else { out.points[vertex as usize] }
    }

    /// The triangles inside the patch.
    pub fn triangles(&self) -> Vec<Placed> {
        let inside = self.inside();
        let faces = self.plane.inner_faces();
        faces.filter(|face| inside[face.index()] == Some(true)).map(Placed::of).collect()
    }

    fn finish(self, gap: f64) -> Made {
        let of = |Placed { corners: triangle, .. }: Placed| {
            let vertices = triangle.map(|(_, node)| node.vertex);
            let [a, b, c] = vertices;
            let parameters = self.frame.corners(&triangle);
            (a != b && b != c && c != a).then_some(Triangle {
                vertices,
                patch: self.number as u32,
                parameters,
            })
        };
        let triangles = self.triangles().into_iter().filter_map(of).collect();
        Made { points: self.vertices, triangles, gap }
    }
}
