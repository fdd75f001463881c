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
use crate::improve::swap::{LEAST_GAIN, commit};
use crate::mesh::TET_FACES;

/// Tets in a hole at most: twice an ordinary star. Larger holes were not seen to win.
const LARGEST_HOLE: usize = 48;

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
    /// Finds a hole that contains `seeds`, and a place in it for a vertex, near `point` at first, so that the
    /// worst score rises. `point` must lie in the seeds, in the interior of their union. False if there is none.
    pub fn find(
        &mut self,
        complex: &Complex,
        objective: &Objective,
        smoother: &mut Smoother,
        seeds: &[u32],
        point: Point,
    ) -> bool {
        self.point = point;
        self.grow(complex, objective, seeds);
        if self.worst == f64::NEG_INFINITY {
            return false;
        }
        // Once more from the place that suits this hole: it may want another hole.
        self.point = smoother.best_place(complex, objective, self.faces.iter().map(|f| f.vertices), point);
        self.grow(complex, objective, seeds);
        if self.worst <= complex.worst_of(&self.hole) + LEAST_GAIN {
            return false;
        }
        self.keeps_fixed_vertices(complex)
    }

    /// The least score among the tets round the new vertex.
    pub fn worst(&self) -> f64 {
        self.worst
    }

    /// The distance from the new vertex to the nearest of its neighbours.
    pub fn shortest_edge(&self, complex: &Complex) -> f64 {
        let distance = |v: &u32| (complex.points[*v as usize] - self.point).norm();
        self.faces.iter().flat_map(|f| &f.vertices).map(distance).fold(f64::INFINITY, f64::min)
    }

    /// The place of the new vertex.
    pub fn point(&self) -> &Point {
        &self.point
    }

    /// Makes the insertion that was found, unless a new tet would not be exactly positive.
    pub fn commit(&self, complex: &mut Complex) -> bool {
        let vertex = complex.add_vertex(self.point, complex.bodies[self.hole[0] as usize]);
        let tet = |f: &Face| ([vertex, f.vertices[0], f.vertices[1], f.vertices[2]], f.score);
        let new: Vec<([u32; 4], f64)> = self.faces.iter().map(tet).collect();
        let done = commit(complex, &self.hole, &new);
        if !done {
            complex.withdraw_vertex();
        }
        done
    }

    /// Grows the hole from the seeds and cuts it back to the best one seen.
    fn grow(&mut self, complex: &Complex, objective: &Objective, seeds: &[u32]) {
        self.hole.clear();
        self.faces.clear();
        for &tet in seeds {
            self.take(complex, objective, tet);
        }
        let mut best = (f64::NEG_INFINITY, self.hole.len());
        loop {
            let worst = self.worst_face();
            if worst.1 > best.0 {
                best = (worst.1, self.hole.len());
            }
            let Some((next, _)) = self.faces[worst.0].beyond else { break };
            if self.hole.len() == LARGEST_HOLE {
                break;
            }
            self.take(complex, objective, next);
        }
        if best.1 < self.hole.len() {
            self.faces.clear();
            let tets: Vec<u32> = self.hole.drain(..).take(best.1).collect();
            for tet in tets {
                self.take(complex, objective, tet);
            }
        }
        self.worst = best.0;
    }

    fn worst_face(&self) -> (usize, f64) {
        let mut worst = (0, f64::INFINITY);
        for (k, face) in self.faces.iter().enumerate() {
            if face.score < worst.1 {
                worst = (k, face.score);
            }
        }
        worst
    }

    /// Adds a tet to the hole: faces that it shares with the hole vanish, its others become the hole's.
    fn take(&mut self, complex: &Complex, objective: &Objective, tet: u32) {
        self.hole.push(tet);
        for (k, corners) in TET_FACES.iter().enumerate() {
            if let Some(old) = self.faces.iter().position(|f| f.beyond == Some((tet, k))) {
                self.faces.swap_remove(old);
                continue;
            }
            // Outward of the tet, so that the tet of the reversed face and a point inside is positive.
            let [a, b, c] = corners.map(|i| complex.tets[tet as usize][i]);
            let vertices = [a, c, b];
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
