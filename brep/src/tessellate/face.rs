//! Triangulation of one patch in its parameters.

use super::chain::chain;
use super::frame::{Frame, Node, pole};
use super::{Tessellation, Triangle};
use crate::model::{Model, Patch};
use crate::{BrepError, Point, Vector};
use rayon::prelude::*;
use rustc_hash::{FxHashMap as HashMap, FxHashSet};
use spade::handles::FixedVertexHandle;
use spade::{ConstrainedDelaunayTriangulation, Point2, PositionInTriangulation, Triangulation};

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

/// The most triangles of a patch.
const MOST_TRIANGLES: usize = 400_000;
/// The most triangles in all rounds: 9 to 18 times those of the last one where refinement ends.
const MOST_VISITS: usize = 10 * MOST_TRIANGLES;
/// What is wrong if this is not enough.
const ENDLESS: &str = "the refinement of its triangles does not end";
/// The most rounds of refinement, first of all: more are in vain where sides are too coarse.
const MOST_ROUNDS: usize = 50;
/// The same with finer sides: on the flank of a thread it goes on from triangle to triangle.
const MOST_LATE_ROUNDS: usize = 400;
/// Edges shorter than this (fraction of the diagonal) are not divided for their angle: surfaces may
/// have kinks.
const SHORTEST: f64 = 3e-4;

/// The error of a folded triangle.
const FOLDED: f64 = 2.0;

/// The least distance of a new point from a side, in lengths of the side.
const ENCROACHED: f64 = 0.05;

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
    patch: &'a Patch,
    pub number: usize,
    pub plane: Plane,
    pub frame: Frame,
    /// How often loops use each constraint, by the indices of its ends.
    pub sides: HashMap<[usize; 2], usize>,
    pub tolerances: &'a Tolerances,
    /// Points of new vertices.
    vertices: Vec<Point>,
    /// The nodes that were added for each vertex; one on a seam has several.
    pub known: HashMap<u32, Vec<Node>>,
}

/// A point that is wanted: the error there, the edge that it divides, its place, and the triangle.
type Wanted = (f64, [usize; 2], Point2<f64>, usize);

/// The vertex of a node inside the patch: its index in [`Face::vertices`] is added.
const INNER: u32 = 1 << 31;

/// The corners of a triangle in the plane: indices of its vertices, and nodes.
type Corners = [(usize, Node); 3];

/// Errors in units of what is allowed, which do not change while the vertices stay.
#[derive(Default)]
struct Errors {
    edges: HashMap<[usize; 2], f64>,
    triangles: HashMap<[usize; 3], f64>,
    /// The normals at vertices; zero at poles.
    normals: Vec<Option<Vector>>,
}

/// Fewer errors are measured by one thread: several would take longer.
const AT_ONCE: usize = 64;

fn middle(a: &Node, b: &Node) -> Point2<f64> {
    Point2::new(0.5 * (a.scaled.x + b.scaled.x), 0.5 * (a.scaled.y + b.scaled.y))
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

    fn point(&self, vertex: u32, out: &Tessellation) -> Point {
        if vertex >= INNER { self.vertices[(vertex - INNER) as usize] } else { out.points[vertex as usize] }
    }

    /// The triangles inside the patch, as nodes.
    fn triangles(&self) -> Vec<Corners> {
        let inside = self.inside();
        let of = |face: spade::handles::FaceHandle<
            '_,
            spade::handles::InnerTag,
            Node,
            (),
            spade::CdtEdge<()>,
            (),
        >| { face.vertices().map(|v| (v.index(), *v.data())) };
        let faces = self.plane.inner_faces();
        faces.filter(|face| inside[face.index()] == Some(true)).map(of).collect()
    }

    /// Divides inner edges until the triangles are close to the surface.
    fn refine(&mut self, out: &Tessellation) -> Result<(), Failure> {
        let mut known = Errors::default();
        let mut visits = 0;
        let rounds = if self.tolerances.refuses_folds { MOST_ROUNDS } else { MOST_LATE_ROUNDS };
        for _ in 0..rounds {
            let triangles = self.triangles();
            visits += triangles.len();
            if triangles.is_empty() {
                return Err(Failure::Final(BrepError::face(self.number, "its loops enclose no area", None)));
            }
            if triangles.len() > MOST_TRIANGLES {
                let what = format!("more than {MOST_TRIANGLES} triangles are needed on it");
                return Err(Failure::Final(BrepError::face(self.number, what, None)));
            }
            if visits > MOST_VISITS {
                return Err(Failure::Final(BrepError::face(self.number, ENDLESS, None)));
            }
            let tangled = self.tangled(&triangles);
            self.measure(&triangles, &mut known, out);
            let wanted = self.wanted(&triangles, &known, &tangled);
            if self.insert(wanted, &triangles) == 0 {
                return self.unfolded(&triangles, &known);
            }
        }
        // Triangles beside coarse sides may be folded however small they are.
        Err(self.folded(ENDLESS))
    }

    /// Refuses folded triangles, which only finer sides would unfold.
    fn unfolded(&self, triangles: &[Corners], known: &Errors) -> Result<(), Failure> {
        let is_folded = |triangle: &&Corners| {
            let error = known.triangles.get(&triangle.map(|(i, _)| i));
            error.is_some_and(|error| *error >= FOLDED)
        };
        if !self.tolerances.refuses_folds || !triangles.iter().any(|t| is_folded(&t)) {
            return Ok(());
        }
        Err(self.folded("its triangles are folded beside its curves"))
    }

    /// The failure of triangles that finer sides may unfold.
    fn folded(&self, what: &str) -> Failure {
        let error = BrepError::face(self.number, what, None);
        if self.tolerances.refuses_folds { Failure::Folded(error) } else { Failure::Final(error) }
    }

    /// The corners at both ends of the side of a triangle that is opposite corner `k`.
    fn side(triangle: &Corners, k: usize) -> [(usize, Node); 2] {
        let [a, b] = [triangle[(k + 1) % 3], triangle[(k + 2) % 3]];
        if a.0 < b.0 { [a, b] } else { [b, a] }
    }

    /// Measures the errors that are not known yet, on all threads: first those of edges, then those
    /// of triangles whose edges are fine.
    fn measure(&self, triangles: &[Corners], known: &mut Errors, out: &Tessellation) {
        if self.patch.surface.is_plane() {
            return;
        }
        known.normals.resize(self.plane.num_vertices(), None);
        let mut edges: Vec<[(usize, Node); 2]> = Vec::new();
        let mut nodes: Vec<(usize, Node)> = Vec::new();
        for triangle in triangles {
            for k in 0..3 {
                let [a, b] = Self::side(triangle, k);
                let key = [a.0, b.0];
                if self.sides.contains_key(&key) || known.edges.contains_key(&key) {
                    continue;
                }
                // A placeholder, so that the triangle on the other side does not add it again.
                known.edges.insert(key, f64::NAN);
                edges.push([a, b]);
                for node in [a, b] {
                    if known.normals[node.0].is_none() {
                        known.normals[node.0] = Some(Vector::zeros());
                        nodes.push(node);
                    }
                }
            }
        }
        let normal = |node: &(usize, Node)| {
            let [u, v] = node.1.parameters;
            self.patch.surface.jet(u, v, 1).normal().unwrap_or_else(Vector::zeros)
        };
        let found: Vec<Vector> = nodes.par_iter().with_min_len(AT_ONCE).map(normal).collect();
        for (node, normal) in nodes.iter().zip(found) {
            known.normals[node.0] = Some(normal);
        }
        let normals = &known.normals;
        let error = |ends: &[(usize, Node); 2]| self.edge_error(ends, normals, out);
        let found: Vec<f64> = edges.par_iter().with_min_len(AT_ONCE).map(error).collect();
        for ([a, b], error) in edges.iter().zip(found) {
            known.edges.insert([a.0, b.0], error);
        }
        let is_fine = |triangle: &Corners| {
            let is_fine = |k| {
                let [a, b] = Self::side(triangle, k);
                known.edges.get(&[a.0, b.0]).is_none_or(|error| *error <= 1.0)
            };
            (0..3).all(is_fine) && !known.triangles.contains_key(&triangle.map(|(i, _)| i))
        };
        let new: Vec<&Corners> = triangles.iter().filter(|triangle| is_fine(triangle)).collect();
        let error = |triangle: &&Corners| self.triangle_error(triangle, out);
        let found: Vec<f64> = new.par_iter().with_min_len(AT_ONCE).map(error).collect();
        for (triangle, error) in new.into_iter().zip(found) {
            known.triangles.insert(triangle.map(|(i, _)| i), error);
        }
    }

    /// The points that would lower errors above 1: at most one for each triangle.
    fn wanted(&self, triangles: &[Corners], known: &Errors, tangled: &FxHashSet<[usize; 2]>) -> Vec<Wanted> {
        let mut wanted: Vec<Wanted> = Vec::new();
        for (index, triangle) in triangles.iter().enumerate() {
            let nowhere = Point2::new(0.0, 0.0);
            let mut worst = (0.0, [0; 2], nowhere);
            let mut longest = (0.0, [0; 2], nowhere);
            for k in 0..3 {
                let [(i, a), (j, b)] = Self::side(triangle, k);
                let key = [i, j];
                if self.sides.contains_key(&key) {
                    continue;
                }
                let middle = middle(&a, &b);
                let error = known.edges.get(&key).copied().unwrap_or(0.0);
                let error = if tangled.contains(&key) { error.max(2.0) } else { error };
                let length = a.scaled.distance_2(b.scaled);
                if error > worst.0 {
                    worst = (error, key, middle);
                }
                if length > longest.0 {
                    longest = (length, key, middle);
                }
            }
            if worst.0 <= 1.0 {
                let error = known.triangles.get(&triangle.map(|(i, _)| i)).copied().unwrap_or(0.0);
                if error > 1.0 {
                    if longest.0 > 0.0 {
                        worst = (error, longest.1, longest.2);
                    } else {
                        let [x, y] = [|n: &Node| n.scaled.x, |n: &Node| n.scaled.y]
                            .map(|of| triangle.iter().map(|n| of(&n.1)).sum::<f64>() / 3.0);
                        worst = (error, [usize::MAX, index], Point2::new(x, y));
                    }
                }
            }
            if worst.0 > 1.0 {
                wanted.push((worst.0, worst.1, worst.2, index));
            }
        }
        wanted
    }

    /// Inserts the wanted points, at most one in each triangle, and returns their number.
    fn insert(&mut self, mut wanted: Vec<Wanted>, triangles: &[Corners]) -> usize {
        let before = self.vertices.len();
        wanted.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)).then(a.3.cmp(&b.3)));
        let mut beside: HashMap<[usize; 2], [usize; 2]> = HashMap::default();
        for (index, triangle) in triangles.iter().enumerate() {
            for k in 0..3 {
                let key = sorted(triangle[k].0, triangle[(k + 1) % 3].0);
                beside.entry(key).and_modify(|two| two[1] = index).or_insert([index; 2]);
            }
        }
        let mut is_changed = vec![false; triangles.len()];
        for (_, key, scaled, index) in wanted {
            let both = beside.get(&key).copied().unwrap_or([index; 2]);
            if both.iter().any(|&t| is_changed[t]) {
                continue;
            }
            if both.iter().any(|&t| self.encroaches(scaled, &triangles[t])) {
                continue;
            }
            // Points are sorted by their errors: without a vertex near, each is searched from afar.
            let near = FixedVertexHandle::from_index(triangles[index][0].0);
            let is_vertex =
                || matches!(self.plane.locate_with_hint(scaled, near), PositionInTriangulation::OnVertex(_));
            if !is_finite(&scaled) || is_vertex() {
                continue;
            }
            both.iter().for_each(|&t| is_changed[t] = true);
            let vertex = INNER + self.vertices.len() as u32;
            let parameters = self.frame.parameters(scaled);
            if self.plane.insert_with_hint(Node { scaled, parameters, vertex }, near).is_ok() {
                self.vertices.push(self.patch.surface.point(parameters));
            }
        }
        self.vertices.len() - before
    }

    /// Whether a point is so near to a side of the patch that the triangle between them would be
    /// thin. Sides are not divided, so no number of such points makes the triangles finer there.
    fn encroaches(&self, point: Point2<f64>, triangle: &Corners) -> bool {
        (0..3).any(|k| {
            let ((i, a), (j, b)) = (triangle[k], triangle[(k + 1) % 3]);
            let (x, y) = (b.scaled.x - a.scaled.x, b.scaled.y - a.scaled.y);
            let across = (point.x - a.scaled.x) * y - (point.y - a.scaled.y) * x;
            self.sides.contains_key(&sorted(i, j)) && across.abs() < ENCROACHED * (x * x + y * y)
        })
    }

    /// The error of an edge, in units of what is allowed.
    fn edge_error(
        &self,
        [(i, a), (j, b)]: &[(usize, Node); 2],
        normals: &[Option<Vector>],
        out: &Tessellation,
    ) -> f64 {
        let [p, q] = [a, b].map(|n| self.point(n.vertex, out));
        let on = self.patch.surface.point(self.frame.parameters(middle(a, b)));
        let along = q - p;
        let share = ((on - p).dot(&along) / along.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        let off = (on - p - along * share).norm() / self.tolerances.chord;
        if off > 1.0 || along.norm() < SHORTEST * self.tolerances.diagonal {
            return off;
        }
        let [m, n] = [*i, *j].map(|i| normals[i].unwrap_or_else(Vector::zeros));
        let is_pole = m == Vector::zeros() || n == Vector::zeros();
        let turn = if is_pole { 0.0 } else { m.angle(&n) };
        off.max(turn / self.tolerances.angle)
    }

    /// The error of a triangle whose edges are fine.
    fn triangle_error(&self, triangle: &Corners, out: &Tessellation) -> f64 {
        let corners = self.frame.corners(triangle);
        let mean = |c: usize| corners.iter().map(|p| p[c]).sum::<f64>() / 3.0;
        let jet = self.patch.surface.jet(mean(0), mean(1), 1);
        let [a, b, c] = [0, 1, 2].map(|k| self.point(triangle[k].1.vertex, out));
        let area = (b - a).cross(&(c - a));
        let longest = (b - a).norm().max((c - b).norm()).max((a - c).norm());
        let Some(normal) = area.try_normalize(0.0) else { return 0.0 };
        let off = normal.dot(&(jet.point() - a)).abs() / self.tolerances.chord;
        // The normals of slivers are arbitrary.
        let is_sliver = area.norm() < 1e-2 * longest * self.tolerances.chord.min(longest);
        let own = jet.normal().unwrap_or(normal);
        let is_folded = !is_sliver && longest > SHORTEST * self.tolerances.diagonal && normal.dot(&own) < 0.3;
        off.max(if is_folded { FOLDED } else { 0.0 })
    }

    /// Inner edges whose ends are those of other edges too: different in parameters, equal in
    /// space.
    fn tangled(&self, triangles: &[Corners]) -> FxHashSet<[usize; 2]> {
        // Only edges between vertices on curves or at poles can be: by their vertices in space, the
        // edges in parameters, each with whether it is of a triangle with area.
        let mut uses: Vec<([u32; 2], [usize; 2], bool)> = Vec::new();
        for triangle in triangles {
            let v = [0, 1, 2].map(|k| triangle[k].1.vertex);
            let is_point = v[0] == v[1] || v[1] == v[2] || v[2] == v[0];
            for k in 0..3 {
                let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
                let [v, w] = [a.1.vertex, b.1.vertex];
                if v < INNER || w < INNER {
                    uses.push(([v.min(w), v.max(w)], sorted(a.0, b.0), !is_point));
                }
            }
        }
        uses.sort_unstable();
        let mut tangled = FxHashSet::default();
        for of_ends in uses.chunk_by(|a, b| a.0 == b.0) {
            let [v, w] = of_ends[0].0;
            let count = of_ends.iter().filter(|used| used.2).count();
            let mut edges: Vec<[usize; 2]> = of_ends.iter().map(|used| used.1).collect();
            edges.dedup();
            let on_loops: usize = edges.iter().filter_map(|edge| self.sides.get(edge)).sum();
            let inner = edges.iter().filter(|edge| !self.sides.contains_key(*edge));
            // One triangle on each side of an inner edge, and one inside of a loop.
            let expected = if on_loops > 0 { on_loops } else { 2 };
            let is_wrong = v == w || count > expected || (on_loops > 0 && inner.clone().next().is_some());
            if is_wrong {
                tangled.extend(inner.copied());
            }
        }
        tangled
    }

    fn finish(self, gap: f64) -> Made {
        let of = |triangle: Corners| {
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
