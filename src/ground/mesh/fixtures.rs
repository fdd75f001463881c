//! Classified meshes for tests: boxes of Kuhn cubes, of one or more bodies.

use super::{BoundaryTriangle, Class, Mesh, Segment, TET_FACES, VertexId};
use crate::Point;
use csg::{BodyId, CornerId, CurveId, PatchId};
use std::collections::{BTreeMap, BTreeSet};

/// The unit cube of n³ cells, six tets each: one body, 6 patches, 12 curves, 8 corners.
pub(crate) fn lattice_cube(n: usize) -> Mesh {
    lattice_box([n; 3], |_| 0)
}

/// A box of unit cells scaled to the unit cube's width in x; `body_of` returns the body of each
/// cell.
///
/// Patches are the plane faces between the same two regions, curves the edges where the same
/// patches meet.
pub(crate) fn lattice_box(cells: [usize; 3], body_of: impl Fn([usize; 3]) -> u32) -> Mesh {
    let [nx, ny, nz] = cells;
    let vertex = |x: usize, y: usize, z: usize| VertexId::new((z * (ny + 1) + y) * (nx + 1) + x);
    let mut mesh = Mesh::default();
    for z in 0..=nz {
        for y in 0..=ny {
            for x in 0..=nx {
                mesh.points.push(Point::new(x as f64, y as f64, z as f64) / nx as f64);
            }
        }
    }
    for z in 0..nz {
        for y in 0..ny {
            for x in 0..nx {
                for order in [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]] {
                    let mut at = [x, y, z];
                    let mut tet = [vertex(x, y, z); 4];
                    for (v, axis) in tet[1..].iter_mut().zip(order) {
                        at[axis] += 1;
                        *v = vertex(at[0], at[1], at[2]);
                    }
                    if (order[0] + 1) % 3 != order[1] {
                        tet.swap(2, 3);
                    }
                    mesh.tets.push(tet);
                    mesh.bodies.push(BodyId(body_of([x, y, z])));
                }
            }
        }
    }
    find_boundary(&mut mesh);
    mesh
}

/// The id of a key; keys are numbered in order of first use.
fn numbered<K: Ord>(ids: &mut BTreeMap<K, u32>, key: K) -> u32 {
    let next = ids.len() as u32;
    *ids.entry(key).or_insert(next)
}

/// Finds triangles, segments and classes of a mesh with axis-parallel boundaries.
fn find_boundary(mesh: &mut Mesh) {
    let sides = sides_of_faces(mesh);
    let mut patches = BTreeMap::new();
    let mut patches_at_edge: BTreeMap<[VertexId; 2], BTreeSet<u32>> = BTreeMap::new();
    let mut patches_at_vertex: BTreeMap<VertexId, BTreeSet<u32>> = BTreeMap::new();
    for mut outward in sides.values().cloned() {
        // Sorted by body: the inside of an interface is the lower body.
        outward.sort_unstable();
        let (inside, vertices) = outward[0];
        let outside = outward.get(1).map(|(body, _)| *body);
        if outside == Some(inside) {
            continue;
        }
        let [a, b, c] = vertices.map(|v| mesh.points[v.index()]);
        let normal = (b - a).cross(&(c - a));
        let axis = normal.iamax();
        let plane = (axis, a[axis].to_bits(), normal[axis] > 0.0, inside, outside);
        let patch = numbered(&mut patches, plane);
        mesh.triangles.push(BoundaryTriangle { vertices, patch: PatchId(patch) });
        for i in 0..3 {
            let mut edge = [vertices[i], vertices[(i + 1) % 3]];
            edge.sort_unstable();
            patches_at_edge.entry(edge).or_default().insert(patch);
            patches_at_vertex.entry(vertices[i]).or_default().insert(patch);
        }
    }
    let mut curves = BTreeMap::new();
    let mut curves_at_vertex: BTreeMap<VertexId, BTreeSet<u32>> = BTreeMap::new();
    for (edge, patches) in patches_at_edge.into_iter().filter(|(_, patches)| patches.len() > 1) {
        let curve = numbered(&mut curves, patches);
        mesh.segments.push(Segment { vertices: edge, curve: CurveId(curve) });
        edge.iter().for_each(|v| _ = curves_at_vertex.entry(*v).or_default().insert(curve));
    }
    let mut vertex_body = vec![BodyId(0); mesh.points.len()];
    for (tet, body) in mesh.tets.iter().zip(&mesh.bodies) {
        tet.iter().for_each(|v| vertex_body[v.index()] = *body);
    }
    let mut corners = 0..;
    for (v, body) in (0..).map(VertexId).zip(vertex_body) {
        mesh.classes.push(match (curves_at_vertex.get(&v), patches_at_vertex.get(&v)) {
            (Some(curves), _) if curves.len() > 1 => Class::Corner(CornerId(corners.next().unwrap())),
            (Some(curves), _) => Class::Curve(CurveId(*curves.first().unwrap())),
            (None, Some(patches)) => Class::Patch(PatchId(*patches.first().unwrap())),
            (None, None) => Class::Body(body),
        });
    }
}

/// For each face the bodies of its tets, each with the face's vertices oriented outward from the
/// tet.
fn sides_of_faces(mesh: &Mesh) -> BTreeMap<[VertexId; 3], Vec<(BodyId, [VertexId; 3])>> {
    let mut sides: BTreeMap<_, Vec<_>> = BTreeMap::new();
    for (tet, body) in mesh.tets.iter().zip(&mesh.bodies) {
        for face in TET_FACES {
            let outward = face.map(|i| tet[i]);
            let mut key = outward;
            key.sort_unstable();
            sides.entry(key).or_default().push((*body, outward));
        }
    }
    sides
}
