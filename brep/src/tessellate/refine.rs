//! Refinement of the triangles of a patch until they are close to its surface.
//!
//! Each round inserts points in the triangles that are too far from the surface, the worst first.
//! Only triangles that are new, or that wanted a point and got none, are looked at in the next
//! round.

use super::Tessellation;
use super::face::{Corners, Face, Failure, INNER, Placed, is_finite, sorted};
use super::frame::Node;
use super::measure::from_segment;
use crate::{BrepError, Vector};
use rayon::prelude::*;
use rustc_hash::{FxHashMap as HashMap, FxHashSet as HashSet};
use spade::handles::FixedVertexHandle;
use spade::{Point2, PositionInTriangulation, Triangulation};

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
/// The least error of an edge that is tangled.
const TANGLED: f64 = 2.0;

/// The least distance of a new point from a side, in lengths of the side.
const ENCROACHED: f64 = 0.05;

/// Fewer errors are measured by one thread: several would take longer.
const AT_ONCE: usize = 64;

/// A point that would lower an error.
struct Wanted {
    error: f64,
    /// The edge that it divides.
    edge: [usize; 2],
    place: Point2<f64>,
    /// The triangles beside the edge, that which wants the point first.
    triangles: [usize; 2],
    /// A vertex of the triangle.
    near: usize,
}

/// Errors in units of what is allowed, which do not change while the vertices stay.
#[derive(Default)]
struct Errors {
    edges: HashMap<[usize; 2], f64>,
    triangles: HashMap<[usize; 3], f64>,
    /// The normals at vertices; zero at poles.
    normals: Vec<Option<Vector>>,
}

impl Errors {
    fn of_triangle(&self, triangle: &Corners) -> f64 {
        self.triangles.get(&triangle.map(|(i, _)| i)).copied().unwrap_or(0.0)
    }
}

fn middle(a: &Node, b: &Node) -> Point2<f64> {
    Point2::new(0.5 * (a.scaled.x + b.scaled.x), 0.5 * (a.scaled.y + b.scaled.y))
}

/// Whether a triangle has a vertex on a curve.
fn is_at_curve(triangle: &Placed) -> bool {
    triangle.corners.iter().any(|(_, node)| node.vertex < INNER)
}

/// The corners at both ends of the side of a triangle that is opposite corner `k`.
fn side(triangle: &Corners, k: usize) -> [(usize, Node); 2] {
    let [a, b] = [triangle[(k + 1) % 3], triangle[(k + 2) % 3]];
    if a.0 < b.0 { [a, b] } else { [b, a] }
}

impl Face<'_> {
    /// Divides inner edges until the triangles are close to the surface.
    pub fn refine(&mut self, out: &Tessellation) -> Result<(), Failure> {
        let mut active = self.triangles();
        let mut at_curves: Vec<Placed> = active.iter().filter(|t| is_at_curve(t)).copied().collect();
        let mut count = active.len();
        if count == 0 {
            return Err(Failure::Final(BrepError::face(self.number, "its loops enclose no area", None)));
        }
        let mut known = Errors::default();
        let mut visits = 0;
        let rounds = if self.tolerances.refuses_folds { MOST_ROUNDS } else { MOST_LATE_ROUNDS };
        for _ in 0..rounds {
            visits += count;
            if count > MOST_TRIANGLES {
                let what = format!("more than {MOST_TRIANGLES} triangles are needed on it");
                return Err(Failure::Final(BrepError::face(self.number, what, None)));
            }
            if visits > MOST_VISITS {
                return Err(Failure::Final(BrepError::face(self.number, ENDLESS, None)));
            }
            let tangled = self.tangled(&at_curves);
            let has_tangled =
                |t: &&Placed| (0..3).any(|k| tangled.contains(&side(&t.corners, k).map(|end| end.0)));
            active.extend(at_curves.iter().filter(has_tangled));
            active.sort_unstable_by_key(|t| t.face.index());
            active.dedup_by_key(|t| t.face.index());
            self.measure(&active, &mut known, out);
            let wanted = self.wanted(&mut active, &known, &tangled);
            let first = self.plane.num_vertices();
            self.insert(wanted);
            if self.plane.num_vertices() == first {
                return self.unfolded(&known);
            }
            // A point inside of a triangle or of an edge makes two more of them.
            count += 2 * (self.plane.num_vertices() - first);
            let new = self.around_vertices_from(first);
            active.retain(|triangle| self.is_left(triangle));
            at_curves.retain(|triangle| self.is_left(triangle));
            at_curves.extend(new.iter().filter(|triangle| is_at_curve(triangle)));
            active.extend(new);
        }
        // Triangles beside coarse sides may be folded however small they are.
        Err(self.folded(ENDLESS))
    }

    /// The triangles around all vertices from this one on.
    fn around_vertices_from(&self, first: usize) -> Vec<Placed> {
        let mut around = Vec::new();
        for index in first..self.plane.num_vertices() {
            let vertex = self.plane.vertex(FixedVertexHandle::from_index(index));
            for triangle in vertex.out_edges().filter_map(|edge| edge.face().as_inner()).map(Placed::of) {
                // Each once, from the last of its vertices.
                if triangle.corners.iter().all(|corner| corner.0 <= index) {
                    around.push(triangle);
                }
            }
        }
        around
    }

    /// Whether a triangle was not changed by new points.
    fn is_left(&self, triangle: &Placed) -> bool {
        let mut now = self.plane.face(triangle.face).vertices().into_iter().map(|vertex| vertex.index());
        now.all(|vertex| triangle.corners.iter().any(|corner| corner.0 == vertex))
    }

    /// Refuses folded triangles, which only finer sides would unfold.
    fn unfolded(&self, known: &Errors) -> Result<(), Failure> {
        let is_folded = |triangle: &Placed| known.of_triangle(&triangle.corners) >= FOLDED;
        if !self.tolerances.refuses_folds || !self.triangles().iter().any(is_folded) {
            return Ok(());
        }
        Err(self.folded("its triangles are folded beside its curves"))
    }

    /// The failure of triangles that finer sides may unfold.
    fn folded(&self, what: &str) -> Failure {
        let error = BrepError::face(self.number, what, None);
        if self.tolerances.refuses_folds { Failure::Folded(error) } else { Failure::Final(error) }
    }

    /// Measures the errors that are not known yet, on all threads: first those of edges, then those
    /// of triangles whose edges are fine.
    fn measure(&self, triangles: &[Placed], known: &mut Errors, out: &Tessellation) {
        if self.patch.surface.is_plane() {
            return;
        }
        known.normals.resize(self.plane.num_vertices(), None);
        let mut edges: Vec<[(usize, Node); 2]> = Vec::new();
        let mut nodes: Vec<(usize, Node)> = Vec::new();
        for Placed { corners: triangle, .. } in triangles {
            for k in 0..3 {
                let [a, b] = side(triangle, k);
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
                let [a, b] = side(triangle, k);
                known.edges.get(&[a.0, b.0]).is_none_or(|error| *error <= 1.0)
            };
            (0..3).all(is_fine) && !known.triangles.contains_key(&triangle.map(|(i, _)| i))
        };
        let corners = triangles.iter().map(|triangle| &triangle.corners);
        let new: Vec<&Corners> = corners.filter(|triangle| is_fine(triangle)).collect();
        let error = |triangle: &&Corners| self.triangle_error(triangle, out);
        let found: Vec<f64> = new.par_iter().with_min_len(AT_ONCE).map(error).collect();
        for (triangle, error) in new.into_iter().zip(found) {
            known.triangles.insert(triangle.map(|(i, _)| i), error);
        }
    }

    /// The points that would lower errors above 1. Triangles that want none are taken out.
    fn wanted(&self, active: &mut Vec<Placed>, known: &Errors, tangled: &HashSet<[usize; 2]>) -> Vec<Wanted> {
        let mut wanted = Vec::new();
        active.retain(|triangle| {
            let point = self.wanted_in(triangle, known, tangled);
            let is_one = point.is_some();
            if let Some(mut point) = point {
                let beyond = self.beyond(triangle, point.edge);
                point.triangles[1] = beyond.unwrap_or(*triangle).face.index();
                let both = std::iter::once(triangle).chain(&beyond);
                if !both.into_iter().any(|t| self.encroaches(point.place, &t.corners)) {
                    wanted.push(point);
                }
            }
            is_one
        });
        wanted
    }

    /// The point that would lower the error of a triangle most, if that is above 1.
    fn wanted_in(&self, triangle: &Placed, known: &Errors, tangled: &HashSet<[usize; 2]>) -> Option<Wanted> {
        let corners = &triangle.corners;
        let nowhere = Point2::new(0.0, 0.0);
        let mut worst = (0.0, [0; 2], nowhere);
        let mut longest = worst;
        for k in 0..3 {
            let [(i, a), (j, b)] = side(corners, k);
            let key = [i, j];
            if self.sides.contains_key(&key) {
                continue;
            }
            let error = known.edges.get(&key).copied().unwrap_or(0.0);
            let error = if tangled.contains(&key) { error.max(TANGLED) } else { error };
            if error > worst.0 {
                worst = (error, key, middle(&a, &b));
            }
            let length = a.scaled.distance_2(b.scaled);
            if length > longest.0 {
                longest = (length, key, middle(&a, &b));
            }
        }
        if worst.0 <= 1.0 {
            let error = known.of_triangle(corners);
            if error > 1.0 {
                if longest.0 > 0.0 {
                    worst = (error, longest.1, longest.2);
                } else {
                    let [x, y] = [|n: &Node| n.scaled.x, |n: &Node| n.scaled.y]
                        .map(|of| corners.iter().map(|n| of(&n.1)).sum::<f64>() / 3.0);
                    worst = (error, [usize::MAX, triangle.face.index()], Point2::new(x, y));
                }
            }
        }
        let (error, edge, place) = worst;
        (error > 1.0).then(|| Wanted {
            error,
            edge,
            place,
            triangles: [triangle.face.index(); 2],
            near: corners[0].0,
        })
    }

    /// The triangle on the other side of an edge of this one.
    fn beyond(&self, triangle: &Placed, edge: [usize; 2]) -> Option<Placed> {
        let mut around = self.plane.face(triangle.face).adjacent_edges().into_iter();
        let shared = around.find(|own| sorted(own.from().index(), own.to().index()) == edge)?;
        shared.rev().face().as_inner().map(Placed::of)
    }

    /// Inserts the wanted points, at most one in each triangle.
    fn insert(&mut self, mut wanted: Vec<Wanted>) {
        let order = |a: &Wanted, b: &Wanted| {
            b.error.total_cmp(&a.error).then(a.edge.cmp(&b.edge)).then(a.triangles[0].cmp(&b.triangles[0]))
        };
        wanted.sort_unstable_by(order);
        let mut changed = HashSet::default();
        for Wanted { place, triangles, near, .. } in wanted {
            if !is_finite(&place) || triangles.iter().any(|triangle| changed.contains(triangle)) {
                continue;
            }
            // Points are sorted by their errors: without a vertex near, each is searched from afar.
            let near = FixedVertexHandle::from_index(near);
            if matches!(self.plane.locate_with_hint(place, near), PositionInTriangulation::OnVertex(_)) {
                continue;
            }
            changed.extend(triangles);
            let vertex = INNER + self.vertices.len() as u32;
            let parameters = self.frame.parameters(place);
            if self.plane.insert_with_hint(Node { scaled: place, parameters, vertex }, near).is_ok() {
                self.vertices.push(self.patch.surface.point(parameters));
            }
        }
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
        let off = from_segment(&on, [p, q]) / self.tolerances.chord;
        if off > 1.0 || (q - p).norm() < SHORTEST * self.tolerances.diagonal {
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
    fn tangled(&self, triangles: &[Placed]) -> HashSet<[usize; 2]> {
        // By their vertices in space, edges in parameters, and whether their triangle has an area.
        let mut uses: Vec<([u32; 2], [usize; 2], bool)> = Vec::new();
        for Placed { corners: triangle, .. } in triangles {
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
        let mut tangled = HashSet::default();
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
}
