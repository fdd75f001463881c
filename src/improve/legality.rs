//! Which tets flatten when they are refined and their new vertices move to the true surface.
//!
//! Fine edges at a boundary vertex that lie on a patch tend to the patch's tangent plane there, and those on
//! a curve to its tangent. So a tet becomes flat at a vertex, whatever its shape is now, if
//!
//! * all three edges it has there lie on one patch, or on patches that are tangent there: the corner tends
//!   to three directions in one plane. (Two faces on one patch are a case of it: at both ends of the
//!   edge between them three edges lie on the patch.)
//! * two of the edges lie on one curve, or on curves tangent there: the angle between them tends to 180°.
//!
//! Such a tet is **illegal**. Planes and straight lines need no exception: a tet with three edges in one
//! plane, or two on one line, would have no volume to begin with. The apex of a cone is an exception,
//! as no tangent plane is there: [`Smoothness::normal`] says so. A tet whose four vertices
//! lie on one patch is legal as long as enough of its edges run inside.
//!
//! Where fewer edges lie on the boundary a corner of a tet may still turn over, for instance over a hollow surface
//! that is steeper than the tet's edge inside. [`TetLimits`] holds the directions that all edges tend to,
//! and measures what is left of each corner.
//!
//! Compare NETGEN's illegal tets and Zienkiewicz's rule for curved quadratic elements, which
//! forbid the same for the same reason.

use crate::mesh::{Mesh, TET_FACES, VertexId};
use crate::{Point, Vector};
use csg::{CurveId, Features, Geometry, PatchId, Surface};

/// Tells where patches and curves are smooth, and how they run.
pub trait Smoothness: Sync {
    /// The unit normal of a patch at a point on it, of either sign; `None` where it has no tangent plane.
    fn normal(&self, patch: PatchId, at: &Point) -> Option<Vector>;
    /// The unit tangent of a curve at a point on it, of either sign; `None` where it has none.
    fn tangent(&self, curve: CurveId, at: &Point) -> Option<Vector>;
}

/// The smoothness of the patches and curves of a geometry.
#[derive(Clone, Copy)]
pub struct GeometrySmoothness<'a> {
    /// The surfaces.
    pub geometry: &'a Geometry,
    /// The patches and curves on them.
    pub features: &'a Features,
}

/// Nearer than this to the apex of a cone, in units of its stated radius, it is the apex: mesh vertices there
/// are the apex within rounding (10⁻¹²), and others are away by a mesh size (10⁻⁴ and more).
const APEX_RADIUS: f64 = 1e-7;

/// Surfaces whose normals at a curve have a sine below this are tangent along it: their cross product then says
/// nothing of the curve's direction, and its trace is used. Rounding leaves 10⁻⁸; real cuts begin near 10⁻².
const TANGENT_SURFACES: f64 = 1e-4;

/// Planes and lines at less than this angle (as a sine; 5°) count as tangent. Tangent blends come with
/// rounding errors only (10⁻⁸); a corner of 175° can be meshed, but no tet should bridge it.
const TANGENT_SINE: f64 = 0.087;

/// Edges that turn by less than this (as a sine; half a degree) when refined count as straight: the measure would
/// change by less than that.
const STRAIGHT_SINE: f64 = 0.0087;

impl Smoothness for GeometrySmoothness<'_> {
    fn normal(&self, patch: PatchId, at: &Point) -> Option<Vector> {
        self.surface_normal(&self.geometry.surfaces[self.features.patch(patch).surface.index()], at)
    }

    fn tangent(&self, curve: CurveId, at: &Point) -> Option<Vector> {
        let curve = self.features.curve(curve);
        let [n, m] = curve.surfaces.map(|s| self.surface_normal(&self.geometry.surfaces[s.index()], at));
        if let (Some(n), Some(m)) = (n, m) {
            let direction = n.cross(&m);
            if direction.norm() > TANGENT_SURFACES {
                return direction.try_normalize(0.0);
            }
        }
        let distance = |p: &Point| (p - at).norm_squared();
        let k = (0..curve.trace.len())
            .min_by(|&i, &j| distance(&curve.trace[i]).total_cmp(&distance(&curve.trace[j])))?;
        let (before, after) = (k.saturating_sub(1), (k + 1).min(curve.trace.len() - 1));
        (curve.trace[after] - curve.trace[before]).try_normalize(0.0)
    }
}

impl GeometrySmoothness<'_> {
    fn surface_normal(&self, surface: &Surface, at: &Point) -> Option<Vector> {
        let apex = match surface {
            Surface::Cone(c) => Some((c.point - c.axis * (c.radius / c.slope), c.radius)),
            Surface::EllipticCone(c) => Some((c.point - c.axis / c.rate, c.radii[0].min(c.radii[1]))),
            _ => None,
        };
        if apex.is_some_and(|(apex, radius)| (at - apex).norm() <= APEX_RADIUS * radius) {
            return None;
        }
        surface.gradient(at).try_normalize(0.0)
    }
}

/// A boundary edge, seen from one of its ends.
struct Spoke {
    to: u32,
    /// The tangent planes at the vertex that the edge lies in, as bits.
    planes: u64,
    /// The tangent lines likewise.
    lines: u64,
    /// The direction in which the refined edge will leave the vertex, if not as it does now.
    limit: Option<Vector>,
}

/// The boundary edges of a mesh and what they are tangent to at their ends. Improvement keeps the boundary, so it stays true.
pub(super) struct Legality {
    /// The spokes of vertex v are `spokes[starts[v]..starts[v + 1]]`.
    starts: Vec<u32>,
    spokes: Vec<Spoke>,
    /// The boundary triangles with two edges on one curve, sorted.
    hopeless: Vec<[u32; 3]>,
}

impl Legality {
    /// Collects the boundary edges.
    pub fn new(mesh: &Mesh, smoothness: &dyn Smoothness) -> Self {
        // (vertex, other end, patch or none, curve or none)
        let mut incidences: Vec<(VertexId, VertexId, Option<PatchId>, Option<CurveId>)> = Vec::new();
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
        let mut legality =
            Self { starts: vec![0; mesh.points.len() + 1], spokes: Vec::new(), hopeless: Vec::new() };
        for at_vertex in incidences.chunk_by(|a, b| a.0 == b.0) {
            let vertex = at_vertex[0].0.index();
            let at = &mesh.points[vertex];
            let mut planes = Directions::default();
            let mut lines = Directions::default();
            for (_, _, patch, curve) in at_vertex {
                planes.add(patch.and_then(|p| smoothness.normal(p, at)));
                lines.add(curve.and_then(|c| smoothness.tangent(c, at)));
            }
            for edge in at_vertex.chunk_by(|a, b| a.1 == b.1) {
                let along = mesh.points[edge[0].1.index()] - at;
                let mut spoke = Spoke { to: edge[0].1.0, planes: 0, lines: 0, limit: None };
                for (_, _, patch, curve) in edge {
                    let normal = patch.and_then(|p| smoothness.normal(p, at));
                    spoke.planes |= planes.bits(normal);
                    let tangent = curve.and_then(|c| smoothness.tangent(c, at));
                    spoke.lines |= lines.bits(tangent);
                    spoke.planes |= planes.bits_orthogonal(tangent);
                    // A curve comes after the patches (`None` is less), and knows better.
                    let in_plane = normal.map(|n| along - n * n.dot(&along));
                    let limit = tangent.map(|t| t * t.dot(&along)).or(in_plane);
                    spoke.limit = limit.and_then(|l| l.try_normalize(0.0)).or(spoke.limit);
                }
                spoke.limit = spoke.limit.filter(|l| l.cross(&along).norm() > STRAIGHT_SINE * along.norm());
                legality.spokes.push(spoke);
            }
            legality.starts[vertex + 1] = legality.spokes.len() as u32;
        }
        for v in 0..mesh.points.len() {
            legality.starts[v + 1] = legality.starts[v + 1].max(legality.starts[v]);
        }
        let triangles = mesh.triangles.iter().map(|t| sorted(t.vertices.map(|v| v.0)));
        let mut hopeless: Vec<[u32; 3]> = triangles.filter(|&t| legality.is_illegal_triangle(t)).collect();
        hopeless.sort_unstable();
        hopeless.dedup();
        legality.hopeless = hopeless;
        legality
    }

    fn spokes(&self, vertex: u32) -> &[Spoke] {
        // A vertex beyond the table was added inside a body.
        match self.starts.get(vertex as usize + 1) {
            Some(&end) => &self.spokes[self.starts[vertex as usize] as usize..end as usize],
            None => &[],
        }
    }

    fn spoke(&self, from: u32, to: u32) -> Option<&Spoke> {
        self.spokes(from).iter().find(|s| s.to == to)
    }

    fn tangents(&self, from: u32, to: u32) -> (u64, u64) {
        self.spoke(from, to).map_or((0, 0), |s| (s.planes, s.lines))
    }

    /// Where the edges of a tet tend to; `None` if all of them stay straight. A vertex that is not in
    /// the mesh yet counts as one inside.
    pub fn limits(&self, tet: [u32; 4]) -> Option<TetLimits> {
        if tet.iter().filter(|&&v| self.spokes(v).is_empty()).count() > 2 {
            return None;
        }
        let mut limits = TetLimits([[None; 3]; 4]);
        for (k, corner) in limits.0.iter_mut().enumerate() {
            for (m, limit) in corner.iter_mut().enumerate() {
                *limit = self.spoke(tet[k], tet[(k + 1 + m) % 4]).and_then(|s| s.limit);
            }
        }
        limits.0.iter().flatten().any(Option::is_some).then_some(limits)
    }

    /// The boundary triangles that flatten at a vertex when refined: no change inside can mend them or the tets behind them.
    pub fn illegal_triangles(&self) -> usize {
        self.hopeless.len()
    }

    /// Whether the tet flattens when refined, and not by an illegal boundary triangle alone.
    pub fn is_illegal(&self, tet: [u32; 4]) -> bool {
        // Three vertices on the boundary are the least that either rule needs.
        if tet.iter().filter(|&&v| self.spokes(v).is_empty()).count() > 1 {
            return false;
        }
        (0..4).any(|k| {
            let others = [tet[(k + 1) % 4], tet[(k + 2) % 4], tet[(k + 3) % 4]];
            let [a, b, c] = others.map(|to| self.tangents(tet[k], to).0);
            a & b & c != 0
        }) || TET_FACES.iter().any(|face| self.is_illegal_triangle(face.map(|k| tet[k])))
    }

    /// Whether two of the triangle's edges lie on curves tangent at their common vertex, so that all tets with it
    /// are illegal; not for a boundary triangle, which is no fault of a tet.
    pub fn is_illegal_triangle(&self, triangle: [u32; 3]) -> bool {
        let flattens = (0..3).any(|k| {
            let [a, b] = [1, 2].map(|m| self.tangents(triangle[k], triangle[(k + m) % 3]).1);
            a & b != 0
        });
        flattens && self.hopeless.binary_search(&sorted(triangle)).is_err()
    }
}

fn sorted(mut key: [u32; 3]) -> [u32; 3] {
    key.sort_unstable();
    key
}

/// The directions in which the edges of a tet leave its corner k, to the vertices k+1, k+2, k+3 (mod 4), when it has
/// been refined and snapped for ever; `None` for as they do now.
#[derive(Clone, Debug)]
pub(super) struct TetLimits([[Option<Vector>; 3]; 4]);

/// What must be left of a corner for it to count as unharmed.
const UNHARMED: f64 = 0.5;

/// How much less a tet is worth as its worst corner shrinks below [`UNHARMED`]: at zero a fifth.
const HARM: f64 = 8.0;

impl TetLimits {
    /// The least part of a corner that is left in the limit, where a corner is measured by the volume that
    /// its three unit vectors span: 1 if nothing bends, 0 or less if a corner flattens or turns over.
    pub fn least_corner(&self, p: &[Point; 4]) -> f64 {
        let mut least = 1.0_f64;
        for (k, corner) in self.0.iter().enumerate() {
            if corner.iter().all(Option::is_none) {
                continue;
            }
            let now = [1, 2, 3].map(|m| (p[(k + m) % 4] - p[k]).normalize());
            let then = [0, 1, 2].map(|m| corner[m].unwrap_or(now[m]));
            let span = |d: &[Vector; 3]| d[0].cross(&d[1]).dot(&d[2]);
            least = least.min(span(&then) / span(&now));
        }
        least
    }

    /// What the shape of the tet is to be multiplied with: 1 if no corner suffers much, never 0.
    pub fn factor(&self, p: &[Point; 4]) -> f64 {
        1.0 / (1.0 + HARM * (UNHARMED - self.least_corner(p)).max(0.0))
    }
}

/// The different directions at one vertex, up to sign; parallel ones are one. At most 64: more tangent planes
/// than bits do not meet at a vertex of any solid we know; those beyond would only go unnoticed.
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
    use crate::improve::samples::{UnitSphere, ball, half_ball};
    use crate::mesh::Mesh;

    /// Corners of three orthogonal edges on a patch each, or on curves: patch k has the normal k says.
    struct Planes([Vector; 4]);

    impl Smoothness for Planes {
        fn normal(&self, patch: PatchId, _: &Point) -> Option<Vector> {
            Some(self.0[patch.index()])
        }
        fn tangent(&self, _: CurveId, _: &Point) -> Option<Vector> {
            None
        }
    }

    /// One tet, its four faces on patches 0 to 3, opposite the vertex of the same number.
    fn one_tet() -> Mesh {
        let mut mesh = crate::improve::samples::fan(3, 1.0);
        let tet = mesh.tets[0];
        mesh.tets.truncate(1);
        mesh.triangles = (0..4)
            .map(|k| crate::mesh::BoundaryTriangle {
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
        assert!(!Legality::new(&mesh, &Planes([x, y, z, other])).is_illegal(tet));
        assert!(Legality::new(&mesh, &Planes([x, y, z, z])).is_illegal(tet), "tangent");
        assert!(Legality::new(&mesh, &Planes([x, y, z, -z])).is_illegal(tet), "of either sign");
        let nearly = Vector::new(0.02, 0.0, 1.0).normalize();
        assert!(Legality::new(&mesh, &Planes([x, y, z, nearly])).is_illegal(tet), "nearly tangent");
    }

    #[test]
    fn the_apex_of_a_cone_has_no_tangent_plane() {
        let cone =
            csg::primitive::Cone { point: Point::origin(), axis: Vector::z(), radius: 1.0, slope: -0.5 };
        let geometry = Geometry { surfaces: vec![Surface::Cone(cone)], ..Geometry::default() };
        let bounds = csg::Aabb { min: Point::origin(), max: Point::origin() };
        let features = Features { corners: vec![], curves: vec![], patches: vec![], bounds };
        let smoothness = GeometrySmoothness { geometry: &geometry, features: &features };
        assert_eq!(smoothness.surface_normal(&geometry.surfaces[0], &Point::new(0.0, 0.0, 2.0)), None);
    }

    #[test]
    fn the_tets_along_the_edges_of_a_cube_made_round_are_illegal() {
        let mesh = ball(4);
        let legality = Legality::new(&mesh, &UnitSphere);
        let on_sphere = |t: &[VertexId; 4]| {
            let key = |f: [usize; 3]| sorted(f.map(|k| t[k].0));
            let faces: Vec<_> = mesh.triangles.iter().map(|t| sorted(t.vertices.map(|v| v.0))).collect();
            TET_FACES.iter().filter(|f| faces.contains(&key(**f))).count()
        };
        let mut illegal = 0;
        for tet in &mesh.tets {
            let verdict = legality.is_illegal(tet.map(|v| v.0));
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
