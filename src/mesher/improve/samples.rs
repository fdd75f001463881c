//! Meshes for tests of the improvement.

use crate::ground::kernel::quality::mean_ratio;
use crate::ground::kernel::random::Random;
use crate::ground::mesh::{BoundaryTriangle, Class, Mesh, Segment, TET_FACES, VertexId};
use crate::mesher::improve::Smoothness;
use crate::{Point, Vector};
use csg::{BodyId, CurveId, PatchId};
use std::collections::BTreeMap;

/// The Kuhn lattice of n³ cubes in [−1, 1]³, all vertices classified on the body.
fn lattice(n: usize) -> Mesh {
    let id = |i: usize, j: usize, k: usize| VertexId::new((i * (n + 1) + j) * (n + 1) + k);
    let at = |i: usize| 2.0 * i as f64 / n as f64 - 1.0;
    let mut mesh = Mesh::default();
    for i in 0..=n {
        for j in 0..=n {
            for k in 0..=n {
                mesh.points.push(Point::new(at(i), at(j), at(k)));
                mesh.classes.push(Class::Body(BodyId(0)));
            }
        }
    }
    let cells = (0..n).flat_map(|i| (0..n).flat_map(move |j| (0..n).map(move |k| [i, j, k])));
    for cell in cells {
        for order in [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]] {
            let mut at = cell;
            let mut path = [VertexId(0); 4];
            path[0] = id(at[0], at[1], at[2]);
            for (step, axis) in order.into_iter().enumerate() {
                at[axis] += 1;
                path[step + 1] = id(at[0], at[1], at[2]);
            }
            let even = (order[1] + 3 - order[0]) % 3 == 1;
            let [a, b, c, d] = path;
            mesh.tets.push(if even { [a, b, c, d] } else { [a, b, d, c] });
            mesh.bodies.push(BodyId(0));
        }
    }
    mesh
}

/// The faces with one tet, and those between two bodies from the lower body's side, each with the
/// body outside.
fn boundary_faces(mesh: &Mesh) -> Vec<([VertexId; 3], Option<BodyId>)> {
    let mut faces: BTreeMap<[VertexId; 3], Vec<([VertexId; 3], BodyId)>> = BTreeMap::new();
    for (tet, &body) in mesh.tets.iter().zip(&mesh.bodies) {
        for face in TET_FACES {
            let vertices = face.map(|k| tet[k]);
            let mut key = vertices;
            key.sort_unstable();
            faces.entry(key).or_default().push((vertices, body));
        }
    }
    let outer = |sides: &Vec<([VertexId; 3], BodyId)>| match sides[..] {
        [one] => Some((one.0, None)),
        [a, b] if a.1 < b.1 => Some((a.0, Some(b.1))),
        [a, b] if b.1 < a.1 => Some((b.0, Some(a.1))),
        _ => None,
    };
    faces.values().filter_map(outer).collect()
}

/// Adds a triangle for each boundary face, on the patch returned by `patch`, and classifies its
/// vertices.
fn classify(mesh: &mut Mesh, patch: impl Fn([Point; 3], Option<BodyId>) -> PatchId) {
    for (vertices, outside) in boundary_faces(mesh) {
        let patch = patch(vertices.map(|v| mesh.points[v.index()]), outside);
        for v in vertices {
            mesh.classes[v.index()] = Class::Patch(patch);
        }
        mesh.triangles.push(BoundaryTriangle { vertices, patch });
    }
}

/// Moves each interior vertex by up to `amount` cells, unless a tet would not be positive.
pub(super) fn perturb(mesh: &mut Mesh, cell: f64, amount: f64, seed: u64) {
    let mut tets_of = vec![Vec::new(); mesh.points.len()];
    for (t, tet) in mesh.tets.iter().enumerate() {
        for v in tet {
            tets_of[v.index()].push(t);
        }
    }
    let mut random = Random::new(seed);
    for (v, tets) in tets_of.iter().enumerate() {
        let by = Vector::from_fn(|_, _| 2.0 * random.unit() - 1.0) * (amount * cell);
        if !matches!(mesh.classes[v], Class::Body(_)) {
            continue;
        }
        let from = mesh.points[v];
        mesh.points[v] += by;
        let positive = |t: &usize| {
            let [a, b, c, d] = mesh.tets[*t].map(|w| mesh.points[w.index()]);
            crate::ground::kernel::simplex::volume6(&a, &b, &c, &d) > 1e-4 * cell.powi(3)
        };
        if !tets.iter().all(positive) {
            mesh.points[v] = from;
        }
    }
}

/// A cube of n³ cells with perturbed vertices, one patch per side.
pub(super) fn cube(n: usize, seed: u64) -> Mesh {
    let mut mesh = lattice(n);
    classify(&mut mesh, |p, _| cube_side(&p));
    perturb(&mut mesh, 2.0 / n as f64, 0.45, seed);
    mesh
}

fn cube_side(p: &[Point; 3]) -> PatchId {
    let side = |axis: usize, at: f64| p.iter().all(|q| q[axis] == at);
    let k = (0..6).find(|&k| side(k / 2, if k % 2 == 0 { -1.0 } else { 1.0 }));
    PatchId::new(k.expect("the triangle lies on a side of the cube"))
}

/// Two bodies, one above the other, with patch 6 between them.
pub(super) fn two_boxes(n: usize, seed: u64) -> Mesh {
    let mut mesh = lattice(n);
    for (tet, body) in mesh.tets.iter().zip(&mut mesh.bodies) {
        let middle: f64 = tet.iter().map(|v| mesh.points[v.index()].z).sum();
        *body = BodyId(u32::from(middle > 0.0));
    }
    for (tet, body) in mesh.tets.iter().zip(&mesh.bodies) {
        for v in tet {
            mesh.classes[v.index()] = Class::Body(*body);
        }
    }
    classify(&mut mesh, |p, outside| if outside.is_some() { PatchId(6) } else { cube_side(&p) });
    perturb(&mut mesh, 2.0 / n as f64, 0.45, seed);
    mesh
}

/// A ball: the lattice of a cube whose cubic shells are mapped to spheres, with one boundary patch.
///
/// At the cube's edges and corners many tets have two or three faces on the sphere.
pub(super) fn ball(n: usize) -> Mesh {
    let mut mesh = lattice(n);
    classify(&mut mesh, |_, _| PatchId(0));
    for p in &mut mesh.points {
        let shell = p.coords.amax();
        if shell > 0.0 {
            p.coords *= shell / p.coords.norm();
        }
    }
    mesh
}

/// A half ball above z = 0, whose rim is one closed curve.
pub(super) fn half_ball(n: usize) -> Mesh {
    let mut mesh = ball(n);
    mesh.triangles.clear();
    mesh.classes.fill(Class::Body(BodyId(0)));
    let below = |t: &[VertexId; 4]| t.iter().any(|v| mesh.points[v.index()].z < -1e-9);
    mesh.tets = mesh.tets.iter().copied().filter(|t| !below(t)).collect();
    mesh.bodies.truncate(mesh.tets.len());
    let flat = |p: [Point; 3]| p.iter().all(|q| q.z.abs() < 1e-9);
    classify(&mut mesh, |p, _| PatchId(u32::from(flat(p))));
    let mut sides: BTreeMap<[VertexId; 2], Vec<(PatchId, [VertexId; 2])>> = BTreeMap::new();
    for triangle in &mesh.triangles {
        for k in 0..3 {
            let edge = [triangle.vertices[k], triangle.vertices[(k + 1) % 3]];
            let mut key = edge;
            key.sort_unstable();
            sides.entry(key).or_default().push((triangle.patch, edge));
        }
    }
    for patches in sides.values().filter(|s| s[0].0 != s[1].0) {
        let edge = if patches[0].0 == PatchId(1) { patches[0].1 } else { patches[1].1 };
        mesh.segments.push(Segment { vertices: edge, curve: CurveId(0) });
        for v in edge {
            mesh.classes[v.index()] = Class::Curve(CurveId(0));
        }
    }
    mesh
}

/// Patch 0 is the unit sphere, patch 1 the plane z = 0, curve 0 their intersection.
pub(super) struct UnitSphere;

impl Smoothness for UnitSphere {
    fn normal(&self, patch: PatchId, at: &Point) -> Option<Vector> {
        if patch == PatchId(0) { at.coords.try_normalize(0.0) } else { Some(Vector::z()) }
    }

    fn tangent(&self, _: CurveId, at: &Point) -> Option<Vector> {
        Vector::z().cross(&at.coords).try_normalize(0.0)
    }
}

/// An edge along z of length 2·`half`, vertices 0 above and 1 below, with `n` tets around it over
/// the unit circle.
///
/// All outer faces are boundary triangles.
pub(super) fn fan(n: usize, half: f64) -> Mesh {
    let mut mesh = Mesh::default();
    mesh.points.extend([Point::new(0., 0., half), Point::new(0., 0., -half)]);
    for k in 0..n {
        let (y, x) = (k as f64 * std::f64::consts::TAU / n as f64).sin_cos();
        mesh.points.push(Point::new(x, y, 0.0));
        mesh.tets.push([1, 0, 2 + k, 2 + (k + 1) % n].map(VertexId::new));
    }
    mesh.bodies = vec![BodyId(0); n];
    mesh.classes = vec![Class::Body(BodyId(0)); n + 2];
    classify(&mut mesh, |_, _| PatchId(0));
    mesh
}

/// A regular icosahedron without interior vertices: fifteen tets from one of its twelve vertices.
pub(super) fn icosahedron() -> Mesh {
    let mut mesh = Mesh::default();
    let (one, golden) = (1.0, 0.5 + 1.25_f64.sqrt());
    for [s, t] in [[1., 1.], [1., -1.], [-1., 1.], [-1., -1.]] {
        mesh.points.push(Point::new(0.0, s * one, t * golden));
        mesh.points.push(Point::new(s * one, t * golden, 0.0));
        mesh.points.push(Point::new(t * golden, 0.0, s * one));
    }
    let near = |a: usize, b: usize| ((mesh.points[a] - mesh.points[b]).norm() - 2.0).abs() < 1e-9;
    for a in 1..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(a, c) && ![a, b, c].iter().all(|&v| near(0, v)) {
                    let p = [a, b, c].map(|v| mesh.points[v]);
                    let outward =
                        crate::ground::kernel::simplex::volume6(&Point::origin(), &p[0], &p[1], &p[2]) > 0.0;
                    let tet = if outward { [0, a, b, c] } else { [0, a, c, b] };
                    mesh.tets.push(tet.map(VertexId::new));
                }
            }
        }
    }
    mesh.tets.retain(|t| {
        let [a, b, c, d] = t.map(|v| mesh.points[v.index()]);
        crate::ground::kernel::simplex::volume6(&a, &b, &c, &d) > 1e-9
    });
    mesh.bodies = vec![BodyId(0); mesh.tets.len()];
    mesh.classes = vec![Class::Body(BodyId(0)); 12];
    classify(&mut mesh, |_, _| PatchId(0));
    mesh
}

/// Patch 0 is a sphere around the origin; the others are the sides of a cube.
pub(super) struct HollowCube;

impl Smoothness for HollowCube {
    fn normal(&self, patch: PatchId, at: &Point) -> Option<Vector> {
        match patch.0 {
            0 => at.coords.try_normalize(0.0),
            k => Some([Vector::x(), Vector::y(), Vector::z()][(k as usize - 1) / 2]),
        }
    }

    fn tangent(&self, _: CurveId, _: &Point) -> Option<Vector> {
        None
    }
}

/// A cube with a spherical void: radius 1/2 on patch 0, the sides on patches 1 to 6. `n` is a
/// multiple of 4.
pub(super) fn hollow_cube(n: usize) -> Mesh {
    let mut mesh = lattice(n);
    let inside = |t: &[VertexId; 4]| {
        let middle: Vector = t.iter().map(|v| mesh.points[v.index()].coords).sum();
        middle.amax() < 4.0 * 0.5
    };
    mesh.tets = mesh.tets.iter().copied().filter(|t| !inside(t)).collect();
    mesh.bodies.truncate(mesh.tets.len());
    let on_ball = |p: &[Point; 3]| p.iter().all(|q| q.coords.amax() < 0.75);
    classify(&mut mesh, |p, _| if on_ball(&p) { PatchId(0) } else { PatchId(1 + cube_side(&p).0) });
    for p in &mut mesh.points {
        let shell = p.coords.amax().clamp(0.5, 1.0);
        let round = p.coords * (shell / p.coords.norm().max(0.1));
        let outward = 2.0 * shell - 1.0;
        p.coords = p.coords * outward + round * (1.0 - outward);
    }
    mesh
}

/// Each tet split into eight at its edge midpoints; those on patch 0 are projected to the sphere of
/// this radius.
pub(super) fn refined_on_sphere(mesh: &Mesh, radius: f64) -> Mesh {
    let mut fine = Mesh { points: mesh.points.clone(), bodies: vec![], ..Mesh::default() };
    let mut middles: BTreeMap<[VertexId; 2], VertexId> = BTreeMap::new();
    let mut middle = |points: &mut Vec<Point>, a: VertexId, b: VertexId, round: bool| {
        *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
            let p = nalgebra::center(&points[a.index()], &points[b.index()]);
            points.push(if round { p * (radius / p.coords.norm()) } else { p });
            VertexId::new(points.len() - 1)
        })
    };
    for round in [true, false] {
        for t in mesh.triangles.iter().filter(|t| (t.patch == PatchId(0)) == round) {
            let [a, b, c] = t.vertices;
            let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(a, b)| middle(&mut fine.points, a, b, round));
            for vertices in [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]] {
                fine.triangles.push(BoundaryTriangle { vertices, patch: t.patch });
            }
        }
    }
    for &[a, b, c, d] in &mesh.tets {
        let pairs = [(a, b), (a, c), (a, d), (b, c), (b, d), (c, d)];
        let [ab, ac, ad, bc, bd, cd] = pairs.map(|(a, b)| middle(&mut fine.points, a, b, false));
        fine.tets.extend([[a, ab, ac, ad], [ab, b, bc, bd], [ac, bc, c, cd], [ad, bd, cd, d]]);
        let rings = [(ab, cd, [ac, bc, bd, ad]), (ac, bd, [ad, cd, bc, ab]), (ad, bc, [ab, bd, cd, ac])];
        let four = rings.map(|(p, q, r)| [0, 1, 2, 3].map(|k| [p, q, r[(k + 1) % 4], r[k]]));
        let worst = |tets: &[[VertexId; 4]; 4]| {
            let corners = tets.iter().map(|t| t.map(|v| fine.points[v.index()]));
            corners.map(|[a, b, c, d]| mean_ratio(&a, &b, &c, &d)).fold(f64::INFINITY, f64::min)
        };
        let best = four.iter().max_by(|a, b| worst(a).total_cmp(&worst(b)));
        fine.tets.extend(best.into_iter().flatten());
    }
    fine.bodies = vec![BodyId(0); fine.tets.len()];
    fine
}
