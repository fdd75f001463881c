//! Insertion: some tets are taken out, and their hole is filled with tets round a new vertex.
//!
//! The hole begins with given tets and grows across its worst face as long as that may help; of
//! all holes on the way the one with the best worst tet is taken (after Klingner, Shewchuk 2007, "Aggressive
//! tetrahedral mesh improvement", section 3.2, who search a graph of tets for it). It is a valid filling:
//! the vertex lies inside the hole, and if all faces of the hole look at it exactly, it sees the
//! whole hole.

use crate::Point;
use crate::improve::complex::Complex;
use crate::improve::objective::Objective;
use crate::improve::smooth::Smoother;
use crate::improve::swap::{commit, least_after};
use crate::mesh::TET_FACES;

/// Tets in a hole at most: twice an ordinary star. Larger holes were not seen to win.
const LARGEST_HOLE: usize = 48;

/// The point is moved whenever the hole has grown by so many tets.
const TETS_BETWEEN_MOVES: usize = 4;

/// Growing ends when so many tets more did not give a better hole.
const PATIENCE: usize = 16;

/// The hole that is being grown and the best one seen; kept to spare allocations.
#[derive(Default)]
pub(super) struct Inserter {
    hole: Vec<u32>,
    faces: Vec<Face>,
    point: Point,
    /// The least score of the tets between `point` and `faces`.
    worst: f64,
}

/// A face of the hole, from inside.
#[derive(Clone, Copy)]
struct Face {
    vertices: [u32; 3],
    /// The tet beyond and the number of the face there, if the hole may grow there.
    beyond: Option<(u32, usize)>,
    score: f64,
}

impl Inserter {
    /// Finds a hole that contains `seeds`, and a place in it for a vertex, `point` at first, so that the
    /// worst score rises. `point` must lie in the interior of the seeds' union. False if there is none.
    pub fn find(
        &mut self,
        complex: &Complex,
        objective: &Objective,
        smoother: &mut Smoother,
        seeds: &[u32],
        point: Point,
    ) -> bool {
        self.point = point;
        self.begin(complex, objective, seeds);
        self.worst = f64::NEG_INFINITY;
        let mut best = (0, point);
        loop {
            if self.hole.len() == seeds.len() || self.hole.len().is_multiple_of(TETS_BETWEEN_MOVES) {
                self.move_point(complex, objective, smoother);
            }
            let worst = worst(self.faces.iter()).map_or(f64::NEG_INFINITY, |f| f.score);
            if worst > self.worst {
                self.worst = worst;
                best = (self.hole.len(), self.point);
            }
            let open = self.faces.iter().filter(|f| f.beyond.is_some());
            let Some((next, _)) = self::worst(open).and_then(|f| f.beyond) else { break };
            if self.hole.len() >= LARGEST_HOLE || self.hole.len() > best.0 + PATIENCE {
                break;
            }
            self.take(complex, objective, next);
        }
        let hole: Vec<u32> = self.hole[..best.0].to_vec();
        self.point = best.1;
        self.begin(complex, objective, &hole);
        self.worst > least_after(complex.worst_of(&self.hole)) && self.keeps_fixed_vertices(complex)
    }

    /// The least score among the tets round the new vertex.
    pub fn worst(&self) -> f64 {
        self.worst
    }

    /// The distance from the new vertex to the nearest of its neighbours, and the mean length of the hole's edges.
    pub fn shortest_and_usual_edge(&self, complex: &Complex) -> (f64, f64) {
        let at = |v: u32| complex.points[v as usize];
        let distances = self.faces.iter().flat_map(|f| f.vertices).map(|v| (at(v) - self.point).norm());
        let edges =
            self.faces.iter().flat_map(|f| [0, 1, 2].map(|k| (f.vertices[k], f.vertices[(k + 1) % 3])));
        let sum: f64 = edges.map(|(a, b)| (at(a) - at(b)).norm()).sum();
        (distances.fold(f64::INFINITY, f64::min), sum / (3 * self.faces.len()) as f64)
    }

    /// The place of the new vertex.
    pub fn point(&self) -> &Point {
        &self.point
    }

    /// Makes the insertion that was found, unless a new tet would not be exactly positive.
    pub fn commit(&self, complex: &mut Complex) -> bool {
        let vertex = complex.add_vertex(self.point);
        let tet = |f: &Face| ([vertex, f.vertices[0], f.vertices[1], f.vertices[2]], f.score);
        let new: Vec<([u32; 4], f64)> = self.faces.iter().map(tet).collect();
        let done = commit(complex, &self.hole, &new);
        if !done {
            complex.withdraw_vertex();
        }
        done
    }

    fn begin(&mut self, complex: &Complex, objective: &Objective, tets: &[u32]) {
        self.hole.clear();
        self.faces.clear();
        for &tet in tets {
            self.take(complex, objective, tet);
        }
    }

    /// Moves the point to where it suits the present hole: with it, the hole may want to grow elsewhere.
    fn move_point(&mut self, complex: &Complex, objective: &Objective, smoother: &mut Smoother) {
        let faces = self.faces.iter().map(|f| f.vertices);
        self.point = smoother.best_place(complex, objective, faces, self.point);
        for face in &mut self.faces {
            face.score = objective.score_with_point(&complex.points, &self.point, face.vertices);
        }
    }

    /// Adds a tet to the hole: faces that it shares with the hole vanish, its others become the hole's.
    fn take(&mut self, complex: &Complex, objective: &Objective, tet: u32) {
        self.hole.push(tet);
        for (k, corners) in TET_FACES.iter().enumerate() {
            if let Some(old) = self.faces.iter().position(|f| f.beyond == Some((tet, k))) {
                self.faces.swap_remove(old);
                continue;
            }
            // Outward of the hole: a point inside and then the face make a positive tet.
            let vertices = corners.map(|i| complex.tets[tet as usize][i]);
            let score = objective.score_with_point(&complex.points, &self.point, vertices);
            self.faces.push(Face { vertices, beyond: complex.neighbour(tet, k), score });
        }
    }

    /// Whether each vertex that would lose all its tets may go.
    fn keeps_fixed_vertices(&self, complex: &Complex) -> bool {
        let kept = |v: u32| complex.free[v as usize] || self.faces.iter().any(|f| f.vertices.contains(&v));
        self.hole.iter().all(|&t| complex.tets[t as usize].iter().all(|&v| kept(v)))
    }
}

/// The first of the faces with the least score.
fn worst<'a>(faces: impl Iterator<Item = &'a Face>) -> Option<&'a Face> {
    faces.reduce(|worst, f| if f.score < worst.score { f } else { worst })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::improve::blocks::whole;
    use crate::improve::objective::Measure;
    use crate::improve::samples::{cube, icosahedron};

    const SHAPES: Objective = Objective { measure: Measure::MeanRatio, legality: None, sharpest: 1.0 };

    fn middle(complex: &Complex, tet: u32) -> Point {
        let sum: crate::Vector = complex.corners(complex.tets[tet as usize]).iter().map(|p| p.coords).sum();
        Point::from(sum / 4.0)
    }

    #[test]
    fn an_icosahedron_gets_a_vertex_inside() {
        for tet in 0..15 {
            let mut complex = whole(&icosahedron());
            complex.score_all(&SHAPES);
            let (mut inserter, mut smoother) = (Inserter::default(), Smoother::default());
            let start = middle(&complex, tet);
            assert!(inserter.find(&complex, &SHAPES, &mut smoother, &[tet], start), "from tet {tet}");
            assert!(inserter.commit(&mut complex));
            complex.check().unwrap();
            // From some tets the first vertex leaves one of the fifteen tets standing.
            assert!([20, 21].contains(&complex.living().count()), "from tet {tet}");
        }
    }

    #[test]
    fn insertions_raise_the_worst_and_keep_the_complex_valid() {
        let mut complex = whole(&cube(4, 1));
        complex.score_all(&SHAPES);
        let (mut inserter, mut smoother) = (Inserter::default(), Smoother::default());
        let mut done = 0;
        for tet in 0..complex.tets.len() as u32 {
            if !complex.is_alive(tet) {
                continue;
            }
            let start = middle(&complex, tet);
            if inserter.find(&complex, &SHAPES, &mut smoother, &[tet], start) {
                assert!(inserter.worst() > complex.worst_of(&inserter.hole));
                done += usize::from(inserter.commit(&mut complex));
            }
        }
        assert!(done > 0);
        complex.check().unwrap();
    }
}
