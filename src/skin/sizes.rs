//! Sizes inside a part: those wanted at the vertices of its coarse tets, linear between them.

use crate::Point;
use crate::comm::{CommError, Communicator};
use crate::dist::DistMesh;
use crate::kernel::simplex::{squared_distance, volume6};
use crate::kernel::tree::Tree;
use crate::mesh::{Mesh, TET_EDGES, TET_FACES, VertexId};
use crate::size::SizeField;
use csg::Aabb;

/// The sizes of a part, in the coarse mesh that it was.
pub struct PartSizes<'a> {
    mesh: &'a DistMesh,
    /// By vertex.
    sizes: Vec<f64>,
    tets: Tree,
}

impl<'a> PartSizes<'a> {
    /// From the size wanted at each vertex of the part.
    pub fn new(mesh: &'a DistMesh, sizes: Vec<f64>) -> Self {
        let bounds = |tet: &[VertexId; 4]| {
            let [p, rest @ ..] = tet.map(|v| mesh.points[v.index()]);
            let grow = |b: Aabb, p: Point| Aabb { min: b.min.inf(&p), max: b.max.sup(&p) };
            rest.into_iter().fold(Aabb { min: p, max: p }, grow)
        };
        let boxes: Vec<Aabb> = mesh.tets.iter().map(bounds).collect();
        Self { mesh, sizes, tets: Tree::new(&boxes) }
    }

    fn corners(&self, tet: usize) -> [Point; 4] {
        self.mesh.tets[tet].map(|v| self.mesh.points[v.index()])
    }
}

impl SizeField for PartSizes<'_> {
    fn size_at(&self, point: &Point) -> f64 {
        let distance = |tet: u32| squared_distance_to_tet(point, &self.corners(tet as usize));
        // A part without tets has no place to ask about.
        let Some((tet, _)) = self.tets.nearest(point, distance) else { return f64::INFINITY };
        let weights = weights(point, &self.corners(tet as usize)).map(|w| w.max(0.0));
        let sizes = self.mesh.tets[tet as usize].map(|v| self.sizes[v.index()]);
        let sum: f64 = weights.iter().sum();
        weights.iter().zip(sizes).map(|(w, s)| w * s).sum::<f64>() / sum
    }
}

/// Barycentric coordinates times six volumes.
fn weights(point: &Point, corners: &[Point; 4]) -> [f64; 4] {
    [0, 1, 2, 3].map(|k| {
        let mut p = *corners;
        p[k] = *point;
        volume6(&p[0], &p[1], &p[2], &p[3])
    })
}

fn squared_distance_to_tet(point: &Point, corners: &[Point; 4]) -> f64 {
    if weights(point, corners).iter().all(|&w| w >= 0.0) {
        return 0.0;
    }
    let to_face = |face: [usize; 3]| squared_distance(point, face.map(|k| &corners[k]));
    TET_FACES.map(to_face).into_iter().fold(f64::INFINITY, f64::min)
}

/// The size to be wanted at each vertex of a coarse mesh that is to be meshed `pieces` times as finely: `field`, by one factor for all such that
/// it fits the mesh in the mean; without a field the mean length of the edges there.
pub fn at_vertices(mesh: &Mesh, field: Option<&dyn SizeField>, pieces: u32) -> Vec<f64> {
    let mut sums = vec![(0.0, 0_u32); mesh.points.len()];
    for tet in &mesh.tets {
        for [a, b] in TET_EDGES.map(|edge| edge.map(|k| tet[k].index())) {
            let length = (mesh.points[b] - mesh.points[a]).norm();
            for v in [a, b] {
                sums[v] = (sums[v].0 + length, sums[v].1 + 1);
            }
        }
    }
    let lengths = sums.into_iter().map(|(sum, count)| sum / f64::from(count) / f64::from(pieces));
    let Some(field) = field else { return lengths.collect() };
    let wanted: Vec<f64> = mesh.points.iter().map(|p| field.size_at(p)).collect();
    let logarithms: f64 = lengths.zip(&wanted).map(|(length, wanted)| (length / wanted).ln()).sum();
    let factor = (logarithms / wanted.len() as f64).exp();
    wanted.into_iter().map(|wanted| factor * wanted).collect()
}

/// **Collective.** Gives each rank what rank 0 has for the vertices of its part.
///
/// # Errors
/// What the ranks cannot say.
pub fn scatter(comm: &dyn Communicator, mesh: &DistMesh, all: Option<&[f64]>) -> Result<Vec<f64>, CommError> {
    let asked = comm.gather(0, &mesh.vertex_ids)?;
    let of = |ids: &Vec<u64>, all: &[f64]| ids.iter().map(|&id| all[id as usize]).collect();
    comm.scatter(0, all.map(|all| asked.iter().map(|ids| of(ids, all)).collect()))
}
