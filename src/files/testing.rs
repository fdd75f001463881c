//! Small meshes and a communicator for the tests of the formats.

use crate::Point;
use crate::ground::comm::{Communicator, thread};
use crate::ground::mesh::{BoundaryTriangle, Class, Label, Mesh, Names, Rank, TET_FACES, VertexId};
use csg::{BodyId, CornerId, PatchId};

/// Runs `f` on each rank; returns the results by rank.
pub fn together<R: Send>(ranks: u32, f: impl Fn(&dyn Communicator) -> R + Sync) -> Vec<R> {
    thread::run(ranks, f).unwrap()
}

/// Assigns the layers of [`cube`] to ranks, a slab each.
pub fn slabs(mesh: &Mesh, ranks: u32) -> Vec<Rank> {
    (0..mesh.tets.len()).map(|t| (t * ranks as usize / mesh.tets.len()) as u32).collect()
}

/// Assigns tets to ranks in turn, which makes as many interfaces as possible.
pub fn scattered(mesh: &Mesh, ranks: u32) -> Vec<Rank> {
    (0..mesh.tets.len()).map(|t| (t as u32).wrapping_mul(2_654_435_761) % 97 % ranks).collect()
}

/// Two tets of one body, as in the format's description: A = 0 1 2 3, B = 1 2 3 4 with the common
/// face 1 2 3; patch 0 around A, patch 1 around B.
pub fn two_tets() -> Mesh {
    let points = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.], [1., 1., 1.]];
    let triangles = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 4], [1, 4, 3], [2, 3, 4]];
    Mesh {
        points: points.map(Point::from).to_vec(),
        classes: (0..5).map(|k| Class::Corner(CornerId(k))).collect(),
        tets: [[0, 1, 2, 3], [1, 2, 3, 4]].map(|t| t.map(VertexId)).to_vec(),
        bodies: vec![BodyId(0); 2],
        triangles: (0..6)
            .map(|k| BoundaryTriangle {
                vertices: triangles[k].map(VertexId),
                patch: PatchId(u32::from(k >= 3)),
            })
            .collect(),
        segments: Vec::new(),
    }
}

/// Names for [`two_tets`] and [`cube`].
pub fn names() -> Names {
    let named = |k: u32, name: &str| Label::new(k, name);
    Names {
        bodies: vec![named(1, "lower"), named(2, "upper")],
        patches: vec![named(1, "skin"), named(2, "lid"), named(3, "between")],
    }
}

/// The Kuhn lattice of the cube 0..n: 6n³ tets, body 0 below z = n/2 and body 1 above; patch 0
/// around the lower body, patch 1 around the upper one, patch 2 between them.
pub fn cube(n: u32) -> Mesh {
    let side = n + 1;
    let id = |[x, y, z]: [u32; 3]| VertexId((z * side + y) * side + x);
    let mut mesh = Mesh::default();
    for k in 0..side.pow(3) {
        let p = [k % side, k / side % side, k / side / side];
        let middle = p[2] == n / 2;
        mesh.points.push(Point::from(p.map(|c| f64::from(c) / 3.0)));
        mesh.classes.push(if p.iter().any(|&c| c == 0 || c == n) || middle {
            Class::Patch(PatchId(0))
        } else {
            Class::Body(BodyId(u32::from(p[2] > n / 2)))
        });
    }
    const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];
    for cell in 0..n.pow(3) {
        let corner = [cell % n, cell / n % n, cell / n / n];
        for (k, order) in ORDERS.iter().enumerate() {
            let mut path = [corner; 4];
            for step in 0..3 {
                path[step + 1] = path[step];
                path[step + 1][order[step]] += 1;
            }
            if k >= 3 {
                path.swap(0, 3);
            }
            let upper = corner[2] >= n / 2;
            mesh.tets.push(path.map(id));
            mesh.bodies.push(BodyId(u32::from(upper)));
            for face in TET_FACES.map(|f| f.map(|v| path[v])) {
                let flat = |axis: usize, at: u32| face.iter().all(|p| p[axis] == at);
                let outer = (0..3).any(|axis| flat(axis, 0) || flat(axis, n));
                let between = !upper && flat(2, n / 2);
                if outer || between {
                    let patch = PatchId(if between { 2 } else { u32::from(upper) });
                    mesh.triangles.push(BoundaryTriangle { vertices: face.map(id), patch });
                }
            }
        }
    }
    mesh
}
