//! Triangulation of one patch in its parameters.

use super::{Tessellation, Triangle};
use crate::model::{EdgeCurve, Fin, Model, On, Patch};
use crate::project::project_to_surface;
use crate::{BrepError, Point, Surface, Vector};
use spade::handles::FixedVertexHandle;
use spade::{ConstrainedDelaunayTriangulation, HasPosition, Point2, Triangulation};
use std::collections::{BTreeMap, BTreeSet};

/// The tolerances of a tessellation.
pub(super) struct Tolerances {
    /// The largest distance between a surface and its triangles.
    pub chord: f64,
    /// The largest angle between normals.
    pub angle: f64,
    /// The diagonal of the box of the model.
    pub diagonal: f64,
}

/// Why a patch has no triangles.
pub(super) enum Failure {
    /// Its loops cross, perhaps because its curves are divided too coarsely.
    Crossing(BrepError),
    Final(BrepError),
}

/// A vertex of the triangulation in parameters.
#[derive(Clone, Copy, Debug)]
struct Node {
    /// The parameters in units of length.
    scaled: Point2<f64>,
    parameters: [f64; 2],
    /// The vertex of the tessellation.
    vertex: u32,
}

impl HasPosition for Node {
    type Scalar = f64;

    fn position(&self) -> Point2<f64> {
        self.scaled
    }
}

type Plane = ConstrainedDelaunayTriangulation<Node>;

/// The most triangles of a patch.
const MOST_TRIANGLES: usize = 400_000;
/// The most rounds of refinement.
const MOST_ROUNDS: usize = 200;
/// Points on a side without length.
const AT_POLE: usize = 24;
/// Edges shorter than this (fraction of the diagonal) are not divided for their angle: surfaces may
/// have kinks.
const SHORTEST: f64 = 3e-4;

/// The least distance of a new point from a side, in lengths of the side.
const ENCROACHED: f64 = 0.05;

/// Triangulates a patch and appends its vertices and triangles.
pub(super) fn triangulate(
    model: &Model,
    number: usize,
    out: &mut Tessellation,
    tolerances: &Tolerances,
) -> Result<(), Failure> {
    let patch = &model.patches[number];
    let mut chains = Vec::new();
    for fins in &patch.loops {
        chains.push(chain(model, number, fins, out, tolerances).map_err(Failure::Final)?);
    }
    let pole = pole(patch, tolerances.diagonal);
    let frame = Frame::of(&patch.surface, &chains, pole, tolerances.diagonal);
    let mut face = Face {
        patch,
        number,
        plane: Plane::new(),
        frame,
        sides: BTreeMap::new(),
        tolerances,
        vertices: Vec::new(),
    };
    let turn = face.frame.turn(&chains);
    for chain in &chains {
        face.add_chain(chain, turn, out)?;
    }
    face.refine(out)?;
    face.finish(out)
}

/// A loop as parameters and vertices.
type Chain = Vec<([f64; 2], u32)>;

/// A loop side by side. Each side ends before the first point of the next.
type Sides = Vec<Chain>;

/// The points of a loop, each once.
fn chain(
    model: &Model,
    number: usize,
    fins: &[Fin],
    out: &mut Tessellation,
    tolerances: &Tolerances,
) -> Result<Sides, BrepError> {
    let patch = &model.patches[number];
    let mut sides: Vec<Chain> = Vec::new();
    for fin in fins {
        let mut side: Chain = match fin.on {
            On::Corner(corner) => at_pole(fin, corner as u32),
            On::Curve(curve) => on_curve(model, number, fin, curve, out, tolerances)?,
        };
        if !fin.is_forward {
            side.reverse();
        }
        sides.push(side);
    }
    let mut out_sides = Sides::new();
    for k in 0..sides.len() {
        let side = &sides[k];
        let next = &sides[(k + 1) % sides.len()][0];
        let (end, vertex) = side[side.len() - 1];
        out_sides.push(side[..side.len() - 1].to_vec());
        // Ends that differ in parameters but not in space are joined by a side without length.
        let middle = [0, 1].map(|i| 0.5 * (end[i] + next.0[i]));
        let [from, half, to] = [end, middle, next.0].map(|p| patch.surface.point(p));
        let gap = (half - from).norm().max((to - from).norm());
        let corner = out.points[vertex as usize];
        let tolerance = model.corners[vertex as usize].tolerance;
        let most = (10.0 * tolerance).max(1e-5 * tolerances.diagonal);
        if gap > most {
            let what = format!("its edges do not join in the parameters of its surface: the gap is {gap:.3e}");
            return Err(BrepError::face(number, what, Some(corner)));
        }
        let rate = patch.surface.jet(end[0], end[1], 1);
        let is_pole = [rate.d[1][0], rate.d[0][1]].iter().any(|d| d.norm() < 1e-7 * tolerances.diagonal);
        if is_pole && (end[0] - next.0[0]).hypot(end[1] - next.0[1]) > 1e-6 {
            let at = |share: f64| ([0, 1].map(|j| end[j] + share * (next.0[j] - end[j])), vertex);
            out_sides.push((0..AT_POLE).map(|i| at(i as f64 / AT_POLE as f64)).collect());
        }
    }
    Ok(out_sides)
}

fn at_pole(fin: &Fin, vertex: u32) -> Chain {
    let [low, high] = fin.range;
    let at = |k: usize| low + (high - low) * (k as f64 / AT_POLE as f64);
    let curve = fin.curve.as_ref().expect("a side without length has parameters");
    (0..=AT_POLE).map(|k| (curve.point(at(k)).into(), vertex)).collect()
}

fn on_curve(
    model: &Model,
    number: usize,
    fin: &Fin,
    curve: usize,
    out: &mut Tessellation,
    tolerances: &Tolerances,
) -> Result<Chain, BrepError> {
    let surface = &model.patches[number].surface;
    let edge = &model.curves[curve];
    let most = (20.0 * edge.tolerance).max(1e-5 * tolerances.diagonal);
    let line = out.lines[curve].clone();
    let mut side = Chain::new();
    for (vertex, t) in line {
        let on = Point::from(edge.curve.point(t));
        let mut parameters: [f64; 2] = match &fin.curve {
            None => project_to_surface(surface, &on, [0.0; 2]).parameters,
            Some(curve) => curve.point(fin.parameter(t, edge.range)).into(),
        };
        let mut gap = (surface.point(parameters) - on).norm();
        if gap > most {
            // The two curves may be parametrised differently.
            let foot = project_to_surface(surface, &on, parameters);
            (parameters, gap) = (foot.parameters, (foot.point - on).norm());
        }
        if gap > most {
            let what = format!("edge {} is {gap:.3e} away from it", curve + 1);
            return Err(BrepError::face(number, what, Some(on)));
        }
        out.gap = out.gap.max(gap).max((surface.point(parameters) - out.points[vertex as usize]).norm());
        side.push((parameters, vertex));
    }
    if fin.curve.is_some() {
        let line = &out.lines[curve];
        let between = |w: &[(u32, f64)]| {
            let [a, b] = [w[0].1, w[1].1];
            (1..SAMPLES).map(move |k| a + (b - a) * f64::from(k) / f64::from(SAMPLES))
        };
        let gaps = line.windows(2).flat_map(between).map(|t| gap_at(surface, fin, edge, t));
        out.gap = gaps.fold(out.gap, f64::max);
    }
    Ok(side)
}

/// Steps between the vertices of a curve at which its distance from a patch is measured.
const SAMPLES: u32 = 6;

/// The distance of a point of a curve from a patch beside it.
fn gap_at(surface: &Surface, fin: &Fin, edge: &EdgeCurve, t: f64) -> f64 {
    let on = Point::from(edge.curve.point(t));
    let start = fin.curve.as_ref().map_or([0.0; 2], |c| c.point(fin.parameter(t, edge.range)).into());
    (project_to_surface(surface, &on, start).point - on).norm()
}

/// Parameters in units of length.
///
/// At a **pole** the derivative in one direction vanishes, and a side of the patch is one point.
/// Lengths in that direction are then taken at each value of the other parameter, as in the
/// sinusoidal projection of a globe: the side becomes one point here too.
struct Frame<'a> {
    surface: &'a Surface,
    origin: [f64; 2],
    scale: [f64; 2],
    /// The direction whose derivative vanishes at a pole.
    pole: Option<usize>,
    /// Parameters in that direction at which lengths are taken.
    samples: [f64; 4],
    /// Shorter derivatives are those of a pole.
    least: f64,
}

impl<'a> Frame<'a> {
    /// Scales parameters by the mean length of the derivatives.
    fn of(surface: &'a Surface, chains: &[Sides], pole: Option<usize>, diagonal: f64) -> Self {
        let all = || chains.iter().flatten().flatten().map(|node| node.0);
        let bound = |i: usize, start: f64, pick: fn(f64, f64) -> f64| all().map(|p| p[i]).fold(start, pick);
        let low = [0, 1].map(|i| bound(i, f64::INFINITY, f64::min));
        let high = [0, 1].map(|i| bound(i, f64::NEG_INFINITY, f64::max));
        let at = |i: usize, share: f64| low[i] + (high[i] - low[i]) * share;
        let mut sums = [0.0; 2];
        for k in 0..25 {
            let [u, v] = [at(0, 0.1 + 0.2 * f64::from(k % 5)), at(1, 0.1 + 0.2 * f64::from(k / 5))];
            let jet = surface.jet(u, v, 1);
            sums[0] += jet.d[1][0].norm();
            sums[1] += jet.d[0][1].norm();
        }
        let scale = sums.map(|sum| if sum > 0.0 { sum / 25.0 } else { 1.0 });
        let mut origin = low;
        let mut samples = [0.0; 4];
        if let Some(i) = pole {
            origin[i] = at(i, 0.5);
            samples = [0.125, 0.375, 0.625, 0.875].map(|share| at(i, share));
        }
        Self { surface, origin, scale, pole, samples, least: AT_REST * diagonal }
    }

    /// The length of the derivative in the direction of a pole, at a value of the other parameter.
    fn rate(&self, i: usize, other: f64) -> f64 {
        let length = |&s: &f64| {
            let [u, v] = if i == 0 { [s, other] } else { [other, s] };
            let d = self.surface.jet(u, v, 1).d;
            if i == 0 { d[1][0].norm() } else { d[0][1].norm() }
        };
        let mean = self.samples.iter().map(length).sum::<f64>() / 4.0;
        if mean < self.least { 0.0 } else { mean }
    }

    fn scaled(&self, p: [f64; 2]) -> Point2<f64> {
        let mut scale = self.scale;
        if let Some(i) = self.pole {
            scale[i] = self.rate(i, p[1 - i]);
        }
        // Differences below the range of the predicates are zero.
        let [x, y] = [0, 1].map(|i| (p[i] - self.origin[i]) * scale[i]);
        let flushed = |x: f64| if x.abs() < 1e-30 { 0.0 } else { x };
        Point2::new(flushed(x), flushed(y))
    }

    /// The inverse of [`scaled`](Self::scaled).
    fn parameters(&self, p: Point2<f64>) -> [f64; 2] {
        let p = [p.x, p.y];
        let mut out = [0, 1].map(|i| self.origin[i] + p[i] / self.scale[i]);
        if let Some(i) = self.pole {
            let rate = self.rate(i, out[1 - i]);
            out[i] = if rate > 0.0 { self.origin[i] + p[i] / rate } else { self.origin[i] };
        }
        out
    }

    /// The parameters of the corners of a triangle. A corner at a pole has any parameter in the
    /// direction of the pole: that between the other two suits the triangle.
    fn corners(&self, triangle: &[(usize, Node); 3]) -> [[f64; 2]; 3] {
        let mut out = triangle.map(|(_, node)| node.parameters);
        if let Some(i) = self.pole {
            for k in 0..3 {
                if self.rate(i, out[k][1 - i]) == 0.0 {
                    out[k][i] = 0.5 * (out[(k + 1) % 3][i] + out[(k + 2) % 3][i]);
                }
            }
        }
        out
    }
}

/// Derivatives shorter than this (fraction of the diagonal of the model) are those of a pole.
const AT_REST: f64 = 1e-7;

/// The direction whose derivative vanishes at a side without length.
fn pole(patch: &Patch, diagonal: f64) -> Option<usize> {
    let fins = patch.loops.iter().flatten().filter(|fin| matches!(fin.on, On::Corner(_)));
    fins.filter_map(|fin| fin.curve.as_ref().map(|curve| curve.point(fin.range[0]))).find_map(|p| {
        let d = patch.surface.jet(p[0], p[1], 1).d;
        [d[1][0], d[0][1]].iter().position(|d| d.norm() < AT_REST * diagonal)
    })
}

impl Frame<'_> {
    /// 1 if the patch is to the left of its loops, else −1.
    fn turn(&self, chains: &[Sides]) -> f64 {
        let double_area = |sides: &Sides| -> f64 {
            let points: Vec<Point2<f64>> = sides.iter().flatten().map(|node| self.scaled(node.0)).collect();
            let next = points.iter().cycle().skip(1);
            points.iter().zip(next).map(|(p, q)| p.x * q.y - p.y * q.x).sum()
        };
        chains.iter().map(double_area).sum::<f64>().signum()
    }
}

/// Sides are curved outward by this fraction of their length. Otherwise rounding makes straight ones
/// concave, and triangles without height remain between their points.
const BULGE: f64 = 1e-6;

struct Face<'a> {
    patch: &'a Patch,
    number: usize,
    plane: Plane,
    frame: Frame<'a>,
    /// How often loops use each constraint, by the indices of its ends.
    sides: BTreeMap<[usize; 2], usize>,
    tolerances: &'a Tolerances,
    /// Points of new vertices.
    vertices: Vec<Point>,
}

/// A point that is wanted: the error there, the edge that it divides, its place, and the triangle.
type Wanted = (f64, [usize; 2], Point2<f64>, usize);

/// The vertex of a node inside the patch: its index in [`Face::vertices`] is added.
const INNER: u32 = 1 << 31;

fn sorted(a: usize, b: usize) -> [usize; 2] {
    [a.min(b), a.max(b)]
}

impl Face<'_> {
    fn crossing(&self, vertex: u32, out: &Tessellation) -> Failure {
        let place = out.points.get(vertex as usize).copied();
        let what = "its loops cross or touch in the parameters of its surface";
        Failure::Crossing(BrepError::face(self.number, what, place))
    }

    fn add_chain(&mut self, sides: &Sides, turn: f64, out: &Tessellation) -> Result<(), Failure> {
        let mut handles: Vec<FixedVertexHandle> = Vec::new();
        let mut nodes = Vec::new();
        for (k, side) in sides.iter().enumerate() {
            let end = self.frame.scaled(sides[(k + 1) % sides.len()][0].0);
            let start = self.frame.scaled(side[0].0);
            let (x, y) = (turn * (end.x - start.x), turn * (end.y - start.y));
            let squared = (x * x + y * y).max(f64::MIN_POSITIVE);
            for &(parameters, vertex) in side {
                let p = self.frame.scaled(parameters);
                let share = turn * ((p.x - start.x) * x + (p.y - start.y) * y) / squared;
                let out = BULGE * 4.0 * (share * (1.0 - share)).max(0.0);
                nodes.push(Node { scaled: Point2::new(p.x + out * y, p.y - out * x), parameters, vertex });
            }
        }
        for node in nodes.iter().copied() {
            let vertex = node.vertex;
            let count = self.plane.num_vertices();
            let before = self.plane.locate_vertex(node.scaled).map(|old| old.data().vertex);
            let handle = self.plane.insert(node).map_err(|_| self.crossing(vertex, out))?;
            if self.plane.num_vertices() == count && before != Some(vertex) {
                return Err(self.crossing(vertex, out));
            }
            handles.push(handle);
        }
        for k in 0..handles.len() {
            let (a, b) = (handles[k], handles[(k + 1) % handles.len()]);
            if a == b {
                continue;
            }
            if !self.plane.can_add_constraint(a, b) {
                return Err(self.crossing(nodes[k].vertex, out));
            }
            self.plane.add_constraint(a, b);
            if self.plane.get_edge_from_neighbors(a, b).is_none_or(|edge| !edge.is_constraint_edge()) {
                return Err(self.crossing(nodes[k].vertex, out));
            }
            *self.sides.entry(sorted(a.index(), b.index())).or_default() += 1;
        }
        Ok(())
    }

    /// Whether each inner face of the triangulation is in the patch: it is if a way from outside
    /// crosses loops an odd number of times.
    fn inside(&self) -> Vec<Option<bool>> {
        let mut inside = vec![None; self.plane.num_all_faces()];
        let outer = self.plane.outer_face();
        inside[outer.index()] = Some(false);
        let mut stack = Vec::new();
        let cross = |edge: [usize; 2], from: bool| {
            from ^ (self.sides.get(&edge).copied().unwrap_or(0) % 2 == 1)
        };
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
    fn triangles(&self) -> Vec<[(usize, Node); 3]> {
        let inside = self.inside();
        let of = |face: spade::handles::FaceHandle<'_, spade::handles::InnerTag, Node, (), spade::CdtEdge<()>, ()>| {
            face.vertices().map(|v| (v.index(), *v.data()))
        };
        let faces = self.plane.inner_faces();
        faces.filter(|face| inside[face.index()] == Some(true)).map(of).collect()
    }

    /// Divides inner edges until the triangles are close to the surface.
    fn refine(&mut self, out: &Tessellation) -> Result<(), Failure> {
        // Errors of edges and triangles, which do not change while their ends stay.
        let mut known: BTreeMap<[usize; 2], f64> = BTreeMap::new();
        let mut normals: Vec<Option<Vector>> = Vec::new();
        for _ in 0..MOST_ROUNDS {
            let triangles = self.triangles();
            if triangles.is_empty() {
                return Err(Failure::Final(BrepError::face(self.number, "its loops enclose no area", None)));
            }
            if triangles.len() > MOST_TRIANGLES {
                let what = format!("more than {MOST_TRIANGLES} triangles are needed on it");
                return Err(Failure::Final(BrepError::face(self.number, what, None)));
            }
            let mut wanted: Vec<Wanted> = Vec::new();
            let tangled = self.tangled(&triangles);
            for (index, triangle) in triangles.iter().enumerate() {
                let nowhere = Point2::new(0.0, 0.0);
                let mut worst = (0.0, [0; 2], nowhere);
                let mut longest = (0.0, [0; 2], nowhere);
                for k in 0..3 {
                    let ((i, a), (j, b)) = (triangle[(k + 1) % 3], triangle[(k + 2) % 3]);
                    let key = sorted(i, j);
                    if self.sides.contains_key(&key) {
                        continue;
                    }
                    let [p, q] = [a.scaled, b.scaled];
                    let middle = Point2::new(0.5 * (p.x + q.x), 0.5 * (p.y + q.y));
                    let error = match known.get(&key) {
                        Some(&error) => error,
                        None => {
                            let error = self.edge_error((i, &a), (j, &b), middle, &mut normals, out);
                            known.insert(key, error);
                            error
                        }
                    };
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
                    let error = self.triangle_error(triangle, out);
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
            if self.insert(wanted, &triangles) == 0 {
                return Ok(());
            }
        }
        Err(Failure::Final(BrepError::face(self.number, "the refinement of its triangles does not end", None)))
    }

    /// Inserts the wanted points, at most one in each triangle, and returns their number.
    fn insert(
        &mut self,
        mut wanted: Vec<Wanted>,
        triangles: &[[(usize, Node); 3]],
    ) -> usize {
        let before = self.vertices.len();
        wanted.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)).then(a.3.cmp(&b.3)));
        let mut beside: BTreeMap<[usize; 2], [usize; 2]> = BTreeMap::new();
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
            if self.plane.locate_vertex(scaled).is_some() {
                continue;
            }
            both.iter().for_each(|&t| is_changed[t] = true);
            let vertex = INNER + self.vertices.len() as u32;
            let parameters = self.frame.parameters(scaled);
            if self.plane.insert(Node { scaled, parameters, vertex }).is_ok() {
                self.vertices.push(self.patch.surface.point(parameters));
            }
        }
        self.vertices.len() - before
    }

    /// Whether a point is so near to a side of the patch that the triangle between them would be
    /// thin. Sides are not divided, so no number of such points makes the triangles finer there.
    fn encroaches(&self, point: Point2<f64>, triangle: &[(usize, Node); 3]) -> bool {
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
        (i, a): (usize, &Node),
        (j, b): (usize, &Node),
        middle: Point2<f64>,
        normals: &mut Vec<Option<Vector>>,
        out: &Tessellation,
    ) -> f64 {
        if self.patch.surface.is_plane() {
            return 0.0;
        }
        let [p, q] = [a, b].map(|n| self.point(n.vertex, out));
        let on = self.patch.surface.point(self.frame.parameters(middle));
        let along = q - p;
        let share = ((on - p).dot(&along) / along.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        let off = (on - p - along * share).norm() / self.tolerances.chord;
        if off > 1.0 || along.norm() < SHORTEST * self.tolerances.diagonal {
            return off;
        }
        normals.resize(normals.len().max(i.max(j) + 1), None);
        let [m, n] = [(i, a), (j, b)].map(|(i, node)| {
            *normals[i].get_or_insert_with(|| {
                let [u, v] = node.parameters;
                self.patch.surface.jet(u, v, 1).normal().try_normalize(0.0).unwrap_or_else(Vector::zeros)
            })
        });
        let is_pole = m == Vector::zeros() || n == Vector::zeros();
        let turn = if is_pole { 0.0 } else { m.angle(&n) };
        off.max(turn / self.tolerances.angle)
    }

    /// The error of a triangle whose edges are fine.
    fn triangle_error(&self, triangle: &[(usize, Node); 3], out: &Tessellation) -> f64 {
        if self.patch.surface.is_plane() {
            return 0.0;
        }
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
        let own = jet.normal().try_normalize(0.0).unwrap_or(normal);
        let is_folded = !is_sliver && longest > SHORTEST * self.tolerances.diagonal && normal.dot(&own) < 0.3;
        off.max(if is_folded { 2.0 } else { 0.0 })
    }

    /// Inner edges whose ends are those of other edges too: different in parameters, equal in space.
    fn tangled(&self, triangles: &[[(usize, Node); 3]]) -> BTreeSet<[usize; 2]> {
        // Only edges between vertices on curves or at poles can be.
        let mut uses: BTreeMap<[u32; 2], (usize, BTreeSet<[usize; 2]>)> = BTreeMap::new();
        for triangle in triangles {
            let v = [0, 1, 2].map(|k| triangle[k].1.vertex);
            let is_point = v[0] == v[1] || v[1] == v[2] || v[2] == v[0];
            for k in 0..3 {
                let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
                let on_curve = |vertex: u32| vertex < INNER;
                if !(on_curve(a.1.vertex) || on_curve(b.1.vertex)) {
                    continue;
                }
                let key = [a.1.vertex.min(b.1.vertex), a.1.vertex.max(b.1.vertex)];
                let entry = uses.entry(key).or_default();
                entry.0 += usize::from(!is_point);
                entry.1.insert(sorted(a.0, b.0));
            }
        }
        let mut tangled = BTreeSet::new();
        for ([v, w], (count, edges)) in uses {
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

    /// Appends the vertices and triangles.
    fn finish(self, out: &mut Tessellation) -> Result<(), Failure> {
        let first = out.points.len() as u32;
        let triangles = self.triangles();
        let id = |vertex: u32| if vertex >= INNER { first + vertex - INNER } else { vertex };
        out.points.extend(&self.vertices);
        for triangle in triangles {
            let vertices = triangle.map(|(_, node)| id(node.vertex));
            let [a, b, c] = vertices;
            if a != b && b != c && c != a {
                let parameters = self.frame.corners(&triangle);
                out.triangles.push(Triangle { vertices, patch: self.number as u32, parameters });
            }
        }
        Ok(())
    }
}
