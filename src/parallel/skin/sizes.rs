//! The size field inside a part: prescribed at the vertices of its coarse tets, linear between
//! them.

use crate::ground::comm::{CommError, Communicator};
use crate::ground::kernel::simplex::{squared_distance, volume6};
use crate::ground::kernel::tree::{Tree, bounds};
use crate::ground::mesh::topology::MatchedFaces;
use crate::ground::mesh::{Mesh, Rank, TET_EDGES, TET_FACES, VertexId};
use crate::ground::size::SizeField;
use crate::parallel::distribution::DistMesh;
use crate::{Point, Vector};
use csg::Aabb;
use std::sync::atomic::{AtomicU32, Ordering};

/// A size field that is linear on the coarse tets of a part.
pub struct PartSizes {
    points: Vec<Point>,
    coarse: Vec<[VertexId; 4]>,
    /// By vertex.
    sizes: Vec<f64>,
    /// By tet.
    weights: Vec<Weights>,
    tets: Tree,
    /// The tet in which each thread found its last point.
    last: [Hint; HINTS],
}

/// Threads with the same remainder share a hint.
const HINTS: usize = 16;

/// A tet to look at first, in a cache line of its own.
#[derive(Default)]
#[repr(align(64))]
struct Hint(AtomicU32);

/// A point is clearly inside a tet, and in no other one, if all its barycentric coordinates are
/// above this.
const CLEAR: f64 = 1e-9;

/// Barycentric coordinates in a tet as functions of the point: gradients of the coordinates of the
/// last three corners, and the first corner, where these are zero.
#[derive(Clone, Copy)]
struct Weights {
    first: Point,
    others: [Vector; 3],
}

impl Weights {
    fn of(corners: &[Point; 4]) -> Self {
        let [u, v, w] = [1, 2, 3].map(|k| corners[k] - corners[0]);
        let volume = u.dot(&v.cross(&w));
        Self { first: corners[0], others: [v.cross(&w), w.cross(&u), u.cross(&v)].map(|n| n / volume) }
    }

    fn at(&self, point: &Point) -> [f64; 4] {
        let way = point - self.first;
        let [b, c, d] = self.others.map(|n| n.dot(&way));
        [1.0 - (b + c + d), b, c, d]
    }
}

impl PartSizes {
    /// A size field from the coarse tets and the sizes at their vertices.
    pub fn new(points: Vec<Point>, coarse: Vec<[VertexId; 4]>, sizes: Vec<f64>) -> Self {
        let corners = |tet: &[VertexId; 4]| tet.map(|v| points[v.index()]);
        let boxes: Vec<Aabb> = coarse.iter().map(|tet| bounds(&corners(tet))).collect();
        let weights = coarse.iter().map(|tet| Weights::of(&corners(tet))).collect();
        Self { weights, tets: Tree::new(&boxes), points, coarse, sizes, last: Default::default() }
    }

    /// Multiplies all sizes by a factor.
    pub fn scale(&mut self, factor: f64) {
        self.sizes.iter_mut().for_each(|size| *size *= factor);
    }

    /// The number of tets of these sizes that the part will have.
    pub fn expected_tets(&self) -> f64 {
        expected_tets_of(&self.points, &self.coarse, &self.sizes).sum()
    }

    /// The coarse tet that contains a point, or the nearest one (near a curved boundary the refined
    /// skin is outside the coarse tets). `None` if there are no tets.
    pub fn tet_at(&self, point: &Point) -> Option<u32> {
        let is_inside = |tet: u32, least: f64| {
            self.weights
                .get(tet as usize)
                .is_some_and(|weights| weights.at(point).iter().all(|&w| w >= least))
        };
        // Most points are near the one before.
        let last = &self.last[rayon::current_thread_index().unwrap_or(0) % HINTS].0;
        let hint = last.load(Ordering::Relaxed);
        if is_inside(hint, CLEAR) {
            return Some(hint);
        }
        let found = self.tets.find(point, |tet| is_inside(tet, 0.0));
        found.inspect(|&tet| last.store(tet, Ordering::Relaxed));
        let nearest = || Some(self.tets.nearest(point, |tet| self.squared_distance(point, tet))?.0);
        found.or_else(nearest)
    }

    fn squared_distance(&self, point: &Point, tet: u32) -> f64 {
        let corners = self.coarse[tet as usize].map(|v| self.points[v.index()]);
        let to_face = |face: [usize; 3]| squared_distance(point, face.map(|k| &corners[k]));
        TET_FACES.map(to_face).into_iter().fold(f64::INFINITY, f64::min)
    }
}

impl SizeField for PartSizes {
    fn size_at(&self, point: &Point) -> f64 {
        // Any size will do in a part without tets.
        let Some(tet) = self.tet_at(point) else { return f64::INFINITY };
        let weights = self.weights[tet as usize].at(point).map(|w| w.max(0.0));
        let sizes = self.coarse[tet as usize].map(|v| self.sizes[v.index()]);
        let sum: f64 = weights.iter().sum();
        weights.iter().zip(sizes).map(|(w, s)| w * s).sum::<f64>() / sum
    }
}

/// The sizes at the vertices of a coarse mesh for meshing it `pieces` times as finely: `field`
/// times a constant such that it matches the mesh on (geometric) average, or the mean length of the
/// edges at the vertex if there is no field.
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

/// The numbers of tets of the given sizes that each tet will become; `sizes` are those at vertices.
pub fn expected_tets(mesh: &Mesh, sizes: &[f64]) -> Vec<f64> {
    expected_tets_of(&mesh.points, &mesh.tets, sizes).collect()
}

fn expected_tets_of<'a>(
    points: &'a [Point],
    tets: &'a [[VertexId; 4]],
    sizes: &'a [f64],
) -> impl Iterator<Item = f64> + 'a {
    /// Regular tets of edge length 1 in a unit of volume.
    const DENSITY: f64 = 6.0 * std::f64::consts::SQRT_2;
    tets.iter().map(move |tet| {
        let [a, b, c, d] = tet.map(|v| points[v.index()]);
        // Sizes are linear in a tet. The mean of their power -3 is that of the geometric mean to a
        // few percent; the mean of the powers at the corners is 1.6 times it where sizes double.
        let density = tet.iter().map(|v| sizes[v.index()]).product::<f64>().powf(-0.75);
        DENSITY * density * volume6(&a, &b, &c, &d).abs() / 6.0
    })
}

/// A part has this many tets more for each triangle that its skin has more than the sizes require,
/// and as many fewer for each missing one. Fitted to 336 parts of six geometries: the largest is
/// then 1.02 to 1.11 times what was expected in the mean, instead of 1.05 to 1.49
/// (benches/results/measure-2026-11-29.md).
const TETS_A_TRIANGLE: f64 = 1.9;

/// The least part of its expected tets that a coarse tet counts for.
const LEAST: f64 = 0.2;

/// The numbers of tets that each tet will become if it is in this part, and its `faces` on skins
/// are split into `pieces`² triangles each, whatever the sizes there: those on interfaces, and
/// those on patches unless they are `remeshed`.
pub fn expected_tets_by_part(
    mesh: &Mesh,
    sizes: &[f64],
    (faces, pieces): (&MatchedFaces, u32),
    remeshed: bool,
    part: &[Rank],
) -> Vec<f64> {
    /// The area of an equilateral triangle of edge length 1.
    const AREA: f64 = 0.433_012_701_892_219_3;
    let mut more = vec![0.0; mesh.tets.len()];
    let triangles = f64::from(pieces).powi(2);
    for (face, tets) in faces.listed.faces.iter().zip(&faces.tets) {
        let [first, second] = tets.map(|tet| tet as usize);
        let is_kept = if second == u32::MAX as usize {
            !remeshed
        } else {
            part[first] != part[second] || (!remeshed && mesh.bodies[first] != mesh.bodies[second])
        };
        if !is_kept {
            continue;
        }
        let [a, b, c] = face.map(|v| mesh.points[v.index()]);
        let size = face.iter().map(|v| sizes[v.index()]).product::<f64>().cbrt();
        let required = 0.5 * (b - a).cross(&(c - a)).norm() / (AREA * size * size);
        for tet in tets.iter().filter(|tet| (**tet as usize) < part.len()) {
            more[*tet as usize] += TETS_A_TRIANGLE * (triangles - required);
        }
    }
    let expected = expected_tets_of(&mesh.points, &mesh.tets, sizes);
    expected.zip(more).map(|(expected, more)| (expected + more).max(LEAST * expected)).collect()
}

/// **Collective.** Sends each rank the values of rank 0 for the vertices of its part.
///
/// # Errors
/// [`CommError`] if another rank fails.
pub fn scatter(comm: &dyn Communicator, mesh: &DistMesh, all: Option<&[f64]>) -> Result<Vec<f64>, CommError> {
    let requested = comm.gather(0, &mesh.vertex_ids)?;
    let of = |ids: &Vec<u64>, all: &[f64]| ids.iter().map(|&id| all[id as usize]).collect();
    comm.scatter(0, all.map(|all| requested.iter().map(|ids| of(ids, all)).collect()))
}
