//! Vertex insertion: some tets are removed, and their cavity is filled with tets around a new
//! vertex.
//!
//! The cavity starts with given tets and grows across its worst face while that may help; of all
//! cavities visited, the one whose worst new tet is best is used. (Klingner, Shewchuk 2007,
//! "Aggressive tetrahedral mesh improvement", section 3.2, search a graph of tets instead.) The
//! filling is valid if all faces of the cavity are visible from the new vertex, by exact sign.

use crate::Point;
use crate::ground::mesh::TET_FACES;
use crate::mesher::improve::complex::Complex;
use crate::mesher::improve::objective::Objective;
use crate::mesher::improve::smooth::Smoother;
use crate::mesher::improve::swap::{commit, least_after};

/// The most tets in a cavity: twice an ordinary star. Larger cavities gave no improvement.
const LARGEST_CAVITY: usize = 48;

/// The point is moved after each growth of the cavity by this number of tets.
const TETS_BETWEEN_MOVES: usize = 4;

/// The search ends when this number of further tets gave no better cavity.
const PATIENCE: usize = 16;

/// The growing cavity, and scratch memory.
#[derive(Default)]
pub(super) struct Inserter {
    cavity: Vec<u32>,
    faces: Vec<Face>,
    point: Point,
    /// The least score of the tets of `point` and `faces`.
    worst: f64,
    /// The number of tets added to cavities so far: the work of all searches.
    visited: usize,
}

/// A face of the cavity's surface, oriented so that it forms a positive tet with a point inside.
#[derive(Clone, Copy)]
struct Face {
    vertices: [u32; 3],
    /// The tet beyond and the index of the face there, if the cavity may grow across it.
    beyond: Option<(u32, usize)>,
    score: f64,
}

impl Inserter {
    /// Finds a cavity that contains `seeds` and a position for a new vertex that raises the worst
    /// score.
    ///
    /// `point` is the initial position and must be in the interior of the seeds' union. False if
    /// there is no improvement.
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
            if self.cavity.len() == seeds.len() || self.cavity.len().is_multiple_of(TETS_BETWEEN_MOVES) {
                self.move_point(complex, objective, smoother);
            }
            let worst = worst(self.faces.iter()).map_or(f64::NEG_INFINITY, |f| f.score);
            if worst > self.worst {
                self.worst = worst;
                best = (self.cavity.len(), self.point);
            }
            let open = self.faces.iter().filter(|f| f.beyond.is_some());
            let Some((next, _)) = self::worst(open).and_then(|f| f.beyond) else { break };
            if self.cavity.len() >= LARGEST_CAVITY || self.cavity.len() > best.0 + PATIENCE {
                break;
            }
            self.take(complex, objective, next);
        }
        let cavity: Vec<u32> = self.cavity[..best.0].to_vec();
        self.point = best.1;
        self.begin(complex, objective, &cavity);
        self.worst > least_after(complex.worst_of(&self.cavity)) && self.keeps_fixed_vertices(complex)
    }

    /// The least score of the tets around the new vertex.
    pub fn worst(&self) -> f64 {
        self.worst
    }

    /// The distance from the new vertex to its nearest neighbour, and the mean edge length of the
    /// cavity's surface.
    pub fn shortest_and_usual_edge(&self, complex: &Complex) -> (f64, f64) {
        let at = |v: u32| complex.points[v as usize];
        let distances = self.faces.iter().flat_map(|f| f.vertices).map(|v| (at(v) - self.point).norm());
        let edges =
            self.faces.iter().flat_map(|f| [0, 1, 2].map(|k| (f.vertices[k], f.vertices[(k + 1) % 3])));
        let sum: f64 = edges.map(|(a, b)| (at(a) - at(b)).norm()).sum();
        (distances.fold(f64::INFINITY, f64::min), sum / (3 * self.faces.len()) as f64)
    }

    /// The number of tets added to cavities so far: the work of all searches.
    pub fn visited(&self) -> usize {
        self.visited
    }

    /// The position of the new vertex.
    pub fn point(&self) -> &Point {
        &self.point
    }

    /// Performs the insertion found by [`find`](Self::find), unless a new tet is not positive by
    /// exact sign.
    pub fn commit(&self, complex: &mut Complex) -> bool {
        let vertex = complex.add_vertex(self.point);
        let tet = |f: &Face| ([vertex, f.vertices[0], f.vertices[1], f.vertices[2]], f.score);
        let new: Vec<([u32; 4], f64)> = self.faces.iter().map(tet).collect();
        let done = commit(complex, &self.cavity, &new);
        if !done {
            complex.pop_vertex();
        }
        done
    }

    fn begin(&mut self, complex: &Complex, objective: &Objective, tets: &[u32]) {
        self.cavity.clear();
        self.faces.clear();
        for &tet in tets {
            self.take(complex, objective, tet);
        }
    }

    /// Optimises the point for the current cavity, which may change where it grows.
    fn move_point(&mut self, complex: &Complex, objective: &Objective, smoother: &mut Smoother) {
        let faces = self.faces.iter().map(|f| f.vertices);
        self.point = smoother.best_place(complex, objective, faces, self.point);
        for face in &mut self.faces {
            face.score = objective.score_with_point(&complex.points, &self.point, face.vertices);
        }
    }

    /// Adds a tet to the cavity: shared faces vanish, its other faces become faces of the cavity.
    fn take(&mut self, complex: &Complex, objective: &Objective, tet: u32) {
        self.cavity.push(tet);
        self.visited += 1;
        for (k, corners) in TET_FACES.iter().enumerate() {
            if let Some(old) = self.faces.iter().position(|f| f.beyond == Some((tet, k))) {
                self.faces.swap_remove(old);
                continue;
            }
            // Oriented outward: a point inside followed by the face is a positive tet.
            let vertices = corners.map(|i| complex.tets[tet as usize][i]);
            let score = objective.score_with_point(&complex.points, &self.point, vertices);
            self.faces.push(Face { vertices, beyond: complex.neighbour(tet, k), score });
        }
    }

    /// Whether all vertices that would lose all tets are free.
    fn keeps_fixed_vertices(&self, complex: &Complex) -> bool {
        let kept = |v: u32| complex.free[v as usize] || self.faces.iter().any(|f| f.vertices.contains(&v));
        self.cavity.iter().all(|&t| complex.tets[t as usize].iter().all(|&v| kept(v)))
    }
}

/// The first of the faces with the least score.
fn worst<'a>(faces: impl Iterator<Item = &'a Face>) -> Option<&'a Face> {
    faces.reduce(|worst, f| if f.score < worst.score { f } else { worst })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesher::improve::blocks::whole;
    use crate::mesher::improve::objective::Measure;
    use crate::mesher::improve::samples::{cube, icosahedron};

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
            // From some seeds the first cavity leaves one of the fifteen tets.
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
                assert!(inserter.worst() > complex.worst_of(&inserter.cavity));
                done += usize::from(inserter.commit(&mut complex));
            }
        }
        assert!(done > 0);
        complex.check().unwrap();
    }
}
