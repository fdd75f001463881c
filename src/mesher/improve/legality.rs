//! Legality of tets: detection of tets that flatten when they are refined and their new vertices
//! are projected.
//!
//! Refined edges on a patch tend to the patch's tangent plane at a boundary vertex, and those on a
//! curve to its tangent. So a tet becomes flat at a vertex, whatever its present shape, if
//!
//! * all three of its edges at the vertex are on one patch, or on patches that are tangent there:
//!   the corner tends to three coplanar directions. (This includes tets with two faces on one
//!   patch: at both ends of their common edge three edges are on the patch.)
//! * two of the edges are on one curve, or on curves tangent there: the angle between them tends to
//!   180°.
//!
//! Such a tet is **illegal**. Planes and straight lines are no exception: a tet with three coplanar
//! or two collinear edges has no volume. The apex of a cone is an exception, because it has no
//! tangent plane ([`Smoothness::normal`] returns `None`). A tet with all four vertices on one patch
//! is legal if enough of its edges are inside.
//!
//! With fewer edges on the boundary a corner may still be inverted, for example at a concave
//! surface steeper than the tet's interior edge: the module `limits` measures the remaining part of
//! each corner.
//!
//! Compare NETGEN's illegal tets and Zienkiewicz's rule for curved quadratic elements, which
//! exclude the same tets for the same reason.

use crate::ground::kernel::simplex::ascending;
use crate::ground::mesh::{Mesh, TET_EDGES, VertexId};
use crate::mesher::half_face::NONE;
use crate::mesher::improve::limits::{HARM, TetLimits};
use crate::{Point, Vector};
use csg::{CurveId, Features, Geometry, PatchId, Surface};
use std::ops::Range;

/// Tangent directions of patches and curves.
pub trait Smoothness: Sync {
    /// The unit normal of a patch at a point on it, of either sign; `None` if it has no tangent
    /// plane there.
    fn normal(&self, patch: PatchId, at: &Point) -> Option<Vector>;
    /// The unit tangent of a curve at a point on it, of either sign; `None` if it has none there.
    fn tangent(&self, curve: CurveId, at: &Point) -> Option<Vector>;
    /// Strength of the penalty for tets with corners that shrink when refined.
    fn harm(&self) -> f64 {
        HARM
    }
}

/// The smoothness of the patches and curves of a geometry.
#[derive(Clone, Copy)]
pub struct GeometrySmoothness<'a> {
    /// The surfaces.
    pub geometry: &'a Geometry,
    /// The patches and curves on them.
    pub features: &'a Features,
}

/// Largest distance from the apex of a cone that counts as the apex, in units of the cone's radius:
/// vertices on the apex are off by rounding (10⁻¹²), others by a mesh size (10⁻⁴ and more).
const APEX_RADIUS: f64 = 1e-7;

/// Sine of the angle of two surfaces below which they count as tangent along their curve: then
/// their cross product gives no direction, and the trace is used. Rounding gives 10⁻⁸; transversal
/// intersections start near 10⁻².
const TANGENT_SURFACES: f64 = 1e-4;

/// Sine (of 5°) below which planes and lines count as tangent. Tangent blends have rounding errors
/// only (10⁻⁸); a corner of 175° can be meshed, but no tet should bridge it.
const TANGENT_SINE: f64 = 0.087;

/// Sine (of half a degree) below which the turn of a refined edge is neglected.
const STRAIGHT_SINE: f64 = 0.0087;

impl Smoothness for GeometrySmoothness<'_> {
    fn normal(&self, patch: PatchId, at: &Point) -> Option<Vector> {
        surface_normal(&self.geometry.surfaces[self.features.patch(patch).surface.index()], at)
    }

    fn tangent(&self, curve: CurveId, at: &Point) -> Option<Vector> {
        let curve = self.features.curve(curve);
        let surfaces = curve.surfaces.map(|s| &self.geometry.surfaces[s.index()]);
        if let Some(tangent) = tangent_of_normals(surfaces, at) {
            return Some(tangent);
        }
        let distance = |p: &Point| (p - at).norm_squared();
        let k = (0..curve.trace.len())
            .min_by(|&i, &j| distance(&curve.trace[i]).total_cmp(&distance(&curve.trace[j])))?;
        let (before, after) = (k.saturating_sub(1), (k + 1).min(curve.trace.len() - 1));
        (curve.trace[after] - curve.trace[before]).try_normalize(0.0)
    }
}

/// The unit normal of a surface at a point on it; `None` at an apex.
pub fn surface_normal(surface: &Surface, at: &Point) -> Option<Vector> {
    let apex = match surface {
        Surface::Cone(c) => Some((c.point - c.axis * (c.radius / c.slope), c.radius)),
        Surface::EllipticCone(c) => Some((c.point - c.axis / c.rate, c.radii[0].min(c.radii[1]))),
        Surface::Nappe(c) => Some((c.apex(), c.radius)),
        _ => None,
    };
    if apex.is_some_and(|(apex, radius)| (at - apex).norm() <= APEX_RADIUS * radius) {
        return None;
    }
    surface.gradient(at).try_normalize(0.0)
}

/// The unit tangent of the curve in which two surfaces meet, at a point on it; `None` if they are
/// tangent there.
pub fn tangent_of_normals(surfaces: [&Surface; 2], at: &Point) -> Option<Vector> {
    let [n, m] = surfaces.map(|surface| surface_normal(surface, at));
    let direction = n?.cross(&m?);
    if direction.norm() > TANGENT_SURFACES { direction.try_normalize(0.0) } else { None }
}

/// A boundary edge at one of its ends.
#[derive(Clone)]
struct Spoke {
    /// The tangent planes at the vertex that contain the edge, as bits.
    planes: u64,
    /// The tangent lines at the vertex that contain the edge, as bits.
    lines: u64,
    /// The limit direction of the refined edge at the vertex, with the edge's length; `None` if it
    /// is the present direction.
    limit: Option<Vector>,
}

/// The boundary edges of a mesh with their tangent planes and lines. It stays valid, because
/// improvement keeps the boundary.
pub(super) struct Legality {
    /// The spokes of vertex v are `spokes[starts[v]..starts[v + 1]]`.
    starts: Vec<u32>,
    /// The other end of each spoke, stored separately because most searches need only the ends.
    ends: Vec<u32>,
    spokes: Vec<Spoke>,
    /// The boundary triangles with two edges on one curve or on tangent curves, sorted.
    flattening: Vec<[u32; 3]>,
    /// See [`Smoothness::harm`].
    harm: f64,
}

/// A boundary edge from the first to the second vertex, and one entity that contains it.
type Incidence = (VertexId, VertexId, Option<PatchId>, Option<CurveId>);

fn incidences(mesh: &Mesh) -> Vec<Incidence> {
    let mut incidences = Vec::with_capacity(6 * mesh.triangles.len() + 2 * mesh.segments.len());
    for triangle in &mesh.triangles {
        let v = triangle.vertices;
        for [i, j] in [[0, 1], [1, 0], [1, 2], [2, 1], [2, 0], [0, 2]] {
            incidences.push((v[i], v[j], Some(triangle.patch), None));
        }
    }
    for segment in &mesh.segments {
        let [a, b] = segment.vertices;
        incidences.push((a, b, None, Some(segment.curve)));
        incidences.push((b, a, None, Some(segment.curve)));
    }
    incidences.sort_unstable();
    incidences.dedup();
    incidences
}

/// The direction of each of some patches or curves, once.
fn each<T: PartialEq + Copy>(
    all: impl Iterator<Item = T>,
    direction: impl Fn(T) -> Option<Vector>,
) -> Vec<(T, Option<Vector>)> {
    let mut found: Vec<(T, Option<Vector>)> = Vec::new();
    for one in all {
        if !found.iter().any(|(known, _)| *known == one) {
            found.push((one, direction(one)));
        }
    }
    found
}

/// One of the directions of [`each`].
fn of<T: PartialEq>(found: &[(T, Option<Vector>)], one: T) -> Option<Vector> {
    found.iter().find(|(known, _)| *known == one).and_then(|(_, direction)| *direction)
}

impl Legality {
    /// Collects the boundary edges of a mesh.
    pub fn new(mesh: &Mesh, smoothness: &dyn Smoothness) -> Self {
        let mut legality = Self {
            starts: vec![0; mesh.points.len() + 1],
            ends: Vec::new(),
            spokes: Vec::new(),
            flattening: Vec::new(),
            harm: smoothness.harm(),
        };
        for at_vertex in incidences(mesh).chunk_by(|a, b| a.0 == b.0) {
            legality.add_vertex(mesh, smoothness, at_vertex);
        }
        for v in 0..mesh.points.len() {
            legality.starts[v + 1] = legality.starts[v + 1].max(legality.starts[v]);
        }
        let triangles = mesh.triangles.iter().map(|t| ascending(t.vertices.map(|v| v.0)));
        let mut flattening: Vec<[u32; 3]> = triangles.filter(|&t| legality.flattens(t)).collect();
        flattening.sort_unstable();
        flattening.dedup();
        legality.flattening = flattening;
        legality
    }

    /// Adds the spokes of one vertex; vertices must come in ascending order.
    fn add_vertex(&mut self, mesh: &Mesh, smoothness: &dyn Smoothness, at_vertex: &[Incidence]) {
        let vertex = at_vertex[0].0.index();
        let at = &mesh.points[vertex];
        let mut planes = Directions::default();
        let mut lines = Directions::default();
        // Projections are slow, and a vertex has many edges on few patches.
        let normals = each(at_vertex.iter().filter_map(|i| i.2), |patch| smoothness.normal(patch, at));
        let tangents = each(at_vertex.iter().filter_map(|i| i.3), |curve| smoothness.tangent(curve, at));
        for (_, _, patch, curve) in at_vertex {
            planes.add(patch.and_then(|p| of(&normals, p)));
            lines.add(curve.and_then(|c| of(&tangents, c)));
        }
        for edge in at_vertex.chunk_by(|a, b| a.1 == b.1) {
            let along = mesh.points[edge[0].1.index()] - at;
            let mut spoke = Spoke { planes: 0, lines: 0, limit: None };
            for (_, _, patch, curve) in edge {
                let normal = patch.and_then(|p| of(&normals, p));
                spoke.planes |= planes.bits(normal);
                let tangent = curve.and_then(|c| of(&tangents, c));
                spoke.lines |= lines.bits(tangent);
                spoke.planes |= planes.bits_orthogonal(tangent);
                // The curve's entry comes first (`None` sorts before patches) and has priority.
                let in_plane = normal.map(|n| along - n * n.dot(&along));
                let limit = tangent.map(|t| t * t.dot(&along)).or(in_plane);
                spoke.limit = spoke.limit.or(limit.and_then(|l| l.try_normalize(0.0)));
            }
            let length = along.norm();
            let bends = |limit: &Vector| limit.cross(&along).norm() > STRAIGHT_SINE * length;
            spoke.limit = spoke.limit.filter(bends).map(|limit| limit * length);
            self.spokes.push(spoke);
            self.ends.push(edge[0].1.0);
        }
        self.starts[vertex + 1] = self.spokes.len() as u32;
    }

    /// The restriction to some vertices, renumbered by their positions in `vertices`.
    ///
    /// `to_block` has one entry per vertex; all are [`NONE`], before and after.
    pub fn of_block(&self, vertices: &[u32], to_block: &mut [u32]) -> Self {
        (0..).zip(vertices).for_each(|(new, &v)| to_block[v as usize] = new);
        let (harm, starts) = (self.harm, vec![0]);
        let mut block = Self { starts, ends: Vec::new(), spokes: Vec::new(), flattening: Vec::new(), harm };
        for &v in vertices {
            for k in self.spokes(v) {
                let end = to_block[self.ends[k] as usize];
                if end != NONE {
                    block.ends.push(end);
                    block.spokes.push(self.spokes[k].clone());
                }
            }
            block.starts.push(block.ends.len() as u32);
        }
        let renumbered = self.flattening.iter().map(|t| ascending(t.map(|v| to_block[v as usize])));
        block.flattening = renumbered.filter(|t| t[2] != NONE).collect();
        block.flattening.sort_unstable();
        vertices.iter().for_each(|&v| to_block[v as usize] = NONE);
        block
    }

    /// The range of a vertex's spokes; empty for an interior or added vertex.
    fn spokes(&self, vertex: u32) -> Range<usize> {
        match self.starts.get(vertex as usize + 1) {
            Some(&end) => self.starts[vertex as usize] as usize..end as usize,
            None => 0..0,
        }
    }

    fn spoke(&self, from: u32, to: u32) -> Option<&Spoke> {
        let range = self.spokes(from);
        let k = self.ends[range.clone()].iter().position(|&end| end == to)?;
        Some(&self.spokes[range.start + k])
    }

    /// The number of boundary triangles that flatten at a vertex when refined: changes of tets
    /// cannot repair them or the tets at them.
    pub fn illegal_triangles(&self) -> usize {
        self.flattening.len()
    }

    /// Whether a tet is illegal, other than because of an illegal boundary triangle; and the limits
    /// of its edges, `None` if all stay straight.
    ///
    /// Vertices that are not in the mesh count as interior.
    pub fn evaluate(&self, tet: [u32; 4]) -> (bool, Option<TetLimits>) {
        // Most tets have no boundary edge, which needs two vertices on the boundary.
        if tet.iter().filter(|&&v| self.spokes(v).is_empty()).count() > 2 {
            return (false, None);
        }
        let mut spokes = [[None; 3]; 4];
        for [i, j] in TET_EDGES {
            // At corner i, the vertex j = i + 1 + m (mod 4) has index m.
            spokes[i][j - i - 1] = self.spoke(tet[i], tet[j]);
            if spokes[i][j - i - 1].is_some() {
                spokes[j][3 + i - j] = self.spoke(tet[j], tet[i]);
            }
        }
        let illegal = (0..4).any(|k| {
            let planes = spokes[k].map(|s| s.map_or(0, |s| s.planes));
            let lines = spokes[k].map(|s| s.map_or(0, |s| s.lines));
            let vertex = |m: usize| tet[(k + 1 + m) % 4];
            let collinear = |m: usize, n: usize| {
                lines[m] & lines[n] != 0 && !self.is_flattening([tet[k], vertex(m), vertex(n)])
            };
            planes[0] & planes[1] & planes[2] != 0 || collinear(0, 1) || collinear(1, 2) || collinear(0, 2)
        });
        (illegal, TetLimits::new(spokes.map(|corner| corner.map(|s| s.and_then(|s| s.limit))), self.harm))
    }

    /// Whether two edges of a triangle are on curves that are tangent at their common vertex, so
    /// that it flattens there, with all tets at it.
    fn flattens(&self, triangle: [u32; 3]) -> bool {
        (0..3).any(|k| {
            let lines = |m: usize| self.spoke(triangle[k], triangle[(k + m) % 3]).map_or(0, |s| s.lines);
            lines(1) & lines(2) != 0
        })
    }

    fn is_flattening(&self, triangle: [u32; 3]) -> bool {
        self.flattening.binary_search(&ascending(triangle)).is_ok()
    }
}

/// The distinct directions at a vertex, up to sign; parallel ones are merged. Directions beyond 64,
/// the number of bits, are ignored; real geometries have far fewer.
#[derive(Default)]
struct Directions(Vec<Vector>);

impl Directions {
    fn add(&mut self, direction: Option<Vector>) {
        if let Some(d) = direction
            && self.0.len() < 64
            && self.bits(direction) == 0
        {
            self.0.push(d);
        }
    }

    fn bits(&self, direction: Option<Vector>) -> u64 {
        self.matching(direction, |d, e| d.cross(e).norm() < TANGENT_SINE)
    }

    fn bits_orthogonal(&self, direction: Option<Vector>) -> u64 {
        self.matching(direction, |d, e| d.dot(e).abs() < TANGENT_SINE)
    }

    fn matching(&self, direction: Option<Vector>, test: impl Fn(&Vector, &Vector) -> bool) -> u64 {
        let Some(d) = direction else { return 0 };
        self.0.iter().enumerate().filter(|(_, e)| test(&d, e)).map(|(k, _)| 1 << k).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::mesh::{Mesh, TET_FACES};
    use crate::mesher::improve::samples::{UnitSphere, ball, half_ball};

    /// Patch k has the k-th normal everywhere; curves have no tangent.
    struct Planes([Vector; 4]);

    impl Smoothness for Planes {
        fn normal(&self, patch: PatchId, _: &Point) -> Option<Vector> {
            Some(self.0[patch.index()])
        }
        fn tangent(&self, _: CurveId, _: &Point) -> Option<Vector> {
            None
        }
    }

    /// One tet whose faces are on patches 0 to 3, each opposite to the vertex of the same number.
    fn one_tet() -> Mesh {
        let mut mesh = crate::mesher::improve::samples::fan(3, 1.0);
        let tet = mesh.tets[0];
        mesh.tets.truncate(1);
        mesh.triangles = (0..4)
            .map(|k| crate::ground::mesh::BoundaryTriangle {
                vertices: TET_FACES[k].map(|i| tet[i]),
                patch: PatchId(k as u32),
            })
            .collect();
        mesh
    }

    #[test]
    fn two_faces_on_tangent_patches_are_illegal() {
        let mesh = one_tet();
        let tet = mesh.tets[0].map(|v| v.0);
        let (x, y, z) = (Vector::x(), Vector::y(), Vector::z());
        let other = Vector::new(0.6, 0.0, 0.8);
        assert!(!Legality::new(&mesh, &Planes([x, y, z, other])).evaluate(tet).0);
        assert!(Legality::new(&mesh, &Planes([x, y, z, z])).evaluate(tet).0, "tangent");
        assert!(Legality::new(&mesh, &Planes([x, y, z, -z])).evaluate(tet).0, "of either sign");
        let nearly = Vector::new(0.02, 0.0, 1.0).normalize();
        assert!(Legality::new(&mesh, &Planes([x, y, z, nearly])).evaluate(tet).0, "nearly tangent");
    }

    #[test]
    fn the_apex_of_a_cone_has_no_tangent_plane() {
        let cone =
            csg::primitive::Cone { point: Point::origin(), axis: Vector::z(), radius: 1.0, slope: -0.5 };
        assert_eq!(surface_normal(&Surface::Cone(cone), &Point::new(0.0, 0.0, 2.0)), None);
    }

    #[test]
    fn the_tets_along_the_edges_of_a_cube_made_round_are_illegal() {
        let mesh = ball(4);
        let legality = Legality::new(&mesh, &UnitSphere);
        let on_sphere = |t: &[VertexId; 4]| {
            let key = |f: [usize; 3]| ascending(f.map(|k| t[k].0));
            let faces: Vec<_> = mesh.triangles.iter().map(|t| ascending(t.vertices.map(|v| v.0))).collect();
            TET_FACES.iter().filter(|f| faces.contains(&key(**f))).count()
        };
        let mut illegal = 0;
        for tet in &mesh.tets {
            let verdict = legality.evaluate(tet.map(|v| v.0)).0;
            illegal += usize::from(verdict);
            assert!(verdict || on_sphere(tet) < 2, "{tet:?} has two faces on the sphere");
        }
        assert!(illegal > 0);
        assert_eq!(legality.illegal_triangles(), 0, "a sphere has no curves");
    }

    #[test]
    fn triangles_with_two_edges_on_a_rim_are_counted() {
        let mesh = half_ball(4);
        let legality = Legality::new(&mesh, &UnitSphere);
        let triangles = mesh.triangles.iter().filter(|t| {
            let on = |a: VertexId, b: VertexId| {
                mesh.segments.iter().any(|s| s.vertices == [a, b] || s.vertices == [b, a])
            };
            let [a, b, c] = t.vertices;
            usize::from(on(a, b)) + usize::from(on(b, c)) + usize::from(on(c, a)) > 1
        });
        assert_eq!(legality.illegal_triangles(), triangles.count());
    }
}
