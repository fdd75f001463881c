//! Insertion of many points that are known beforehand, on all threads.
//!
//! The points are inserted in random rounds along the Hilbert curve: so cavities are smaller and
//! the work is a sixth less than in one pass along the curve.
//!
//! Many points are inserted in blocks (`blocks`). A point whose cavity reaches a side of its block
//! has to wait, and tets are large before most points are there. So one thread inserts a few points
//! everywhere, then the points near the sides of the blocks are inserted, in other blocks and the
//! last of them by one thread, and then all others, of which hardly any has to wait. On 10⁶ points
//! in 32 blocks an eighth is near sides. Without this order two fifths wait.

use super::blocks::{Block, Boxes, Cut};
use super::cavity::{Walk, walk};
use super::points::{Filler, Placed, Stopped};
use super::tetrahedra::Tetrahedra;
use crate::Point;
use crate::ground::kernel::hilbert::random_rounds;
use crate::mesher::half_face::NONE;
use rayon::prelude::*;

/// A point that may be inserted.
#[derive(Clone, Copy)]
pub(super) struct Candidate {
    pub point: Point,
    /// The wanted size there.
    pub size: f64,
    /// A vertex of the tet that contains the point.
    pub vertex: u32,
}

/// Points in a block. In smaller blocks more points are near sides, larger ones keep fewer threads
/// busy.
const PER_BLOCK: usize = 30_000;

/// Fewer points are inserted by one thread.
const LEAST: usize = 2 * PER_BLOCK;

/// If there are fewer points than one for so many tets, only tets near them are in blocks.
const LOCAL: usize = 20;

/// Boxes are made for one of so many points.
const SAMPLED: usize = 8;

/// One of so many points is inserted before all others.
const SPARSE: usize = 32;

/// Points are near a side of their box if it is nearer than so many wanted sizes: nearly all
/// cavities of the others end before the side.
const BAND: f64 = 1.0;

/// The parts of the points below the planes, in each round of blocks for the points near sides.
/// They are chosen so that the new sides are elsewhere.
const PARTS: [f64; 3] = [0.4, 0.6, 0.45];

/// A filled block.
struct Filled {
    block: Block,
    /// The sizes at the vertices of the block.
    sizes: Vec<f64>,
    /// The points that wait, with vertices of the whole mesh.
    waiting: Vec<Candidate>,
    stopped: Option<Stopped>,
}

impl Filler<'_> {
    /// Inserts points with the filter of the front.
    pub(super) fn add_candidates(&mut self, candidates: Vec<Candidate>) {
        let points: Vec<Point> = candidates.iter().map(|c| c.point).collect();
        let order = random_rounds(&points);
        drop(points);
        let sorted: Vec<Candidate> = order.into_iter().map(|i| candidates[i as usize]).collect();
        drop(candidates);
        let is_simple = self.mesh.exact.is_empty() && self.mesh.ranks.is_empty();
        if sorted.len() < LEAST || !is_simple {
            self.add_one_by_one(&sorted);
            return;
        }
        let (first, others) = sorted.split_at(sorted.len() / SPARSE);
        self.add_one_by_one(first);
        let boxes = boxes_around(others, 0.5);
        let (near, inner): (Vec<Candidate>, Vec<Candidate>) =
            others.iter().partition(|c| boxes.is_near_side(&c.point, BAND * c.size));
        let mut waiting = near;
        for part in PARTS {
            if waiting.len() < LEAST {
                break;
            }
            waiting = self.add_in_blocks(&waiting, &boxes_around(&waiting, part));
        }
        self.add_one_by_one(&waiting);
        let waiting = if inner.len() < LEAST { inner } else { self.add_in_blocks(&inner, &boxes) };
        self.add_one_by_one(&waiting);
    }

    /// Inserts points in their order; returns those that wait.
    fn add_one_by_one(&mut self, candidates: &[Candidate]) -> Vec<Candidate> {
        let mut waiting = Vec::new();
        let mut last = None;
        for &candidate in candidates {
            if self.stops() {
                break;
            }
            let Candidate { point, size, vertex } = candidate;
            // The last point is a few steps away, unless the boundary is between.
            let starts = last.into_iter().chain([self.mesh.at_vertex[vertex as usize]]);
            let mut placed = Placed::Rejected;
            for start in starts {
                match walk(self.mesh, start, &point) {
                    Walk::Inside(seed) => {
                        let size = self.grown_size(seed, &point, size);
                        placed = self.insert(seed, point, size);
                        break;
                    }
                    Walk::Blocked(face) if self.mesh.is_seam(face) => placed = Placed::Waits,
                    Walk::Blocked(_) => {}
                }
            }
            match placed {
                Placed::Inserted => last = self.cavity.filled.first().copied(),
                Placed::Waits => waiting.push(candidate),
                Placed::Rejected => {}
            }
        }
        waiting
    }

    /// Inserts points in blocks, on all threads; returns those that wait.
    fn add_in_blocks(&mut self, candidates: &[Candidate], boxes: &Boxes) -> Vec<Candidate> {
        let found = self.locate(candidates);
        let tets: Vec<u32> = if LOCAL * candidates.len() < self.mesh.len() {
            tets_near(self.mesh, &found)
        } else {
            self.mesh.alive().collect()
        };
        let cut = Cut::new(self.mesh, &tets, boxes);
        let mut of_block: Vec<Vec<(u32, Candidate)>> = vec![Vec::new(); cut.len()];
        for (&t, &candidate) in found.iter().zip(candidates) {
            if t != NONE
                && let Some([block, slot]) = cut.place(t)
            {
                of_block[block as usize].push((slot, candidate));
            }
        }
        let numbers = || vec![NONE; self.mesh.points.len()];
        let one = |numbers: &mut Vec<u32>, (block, offered)| {
            self.add_in_block(Block::new(self.mesh, &cut, block, numbers), offered)
        };
        let filled: Vec<Filled> = of_block.into_par_iter().enumerate().map_init(numbers, one).collect();
        drop(cut);
        self.absorb(filled)
    }

    /// The tet around each point, or [`NONE`].
    fn locate(&self, candidates: &[Candidate]) -> Vec<u32> {
        /// Points per parallel task.
        const CHUNK: usize = 1024;
        let in_chunk = |chunk: &[Candidate]| {
            let mut last = None;
            let find = |Candidate { point, vertex, .. }: &Candidate| {
                let starts = last.into_iter().chain([self.mesh.at_vertex[*vertex as usize]]);
                let found = starts.map(|start| walk(self.mesh, start, point)).find_map(|walk| match walk {
                    Walk::Inside(t) => Some(t),
                    Walk::Blocked(_) => None,
                });
                last = found.or(last);
                found.unwrap_or(NONE)
            };
            chunk.iter().map(find).collect::<Vec<u32>>()
        };
        candidates.par_chunks(CHUNK).flat_map_iter(in_chunk).collect()
    }

    /// Inserts points in a block. They come with the numbers of the tets around them in the block.
    fn add_in_block(&self, mut block: Block, offered: Vec<(u32, Candidate)>) -> Filled {
        let here = |(slot, candidate): (u32, Candidate)| Candidate {
            vertex: block.mesh.tets[slot as usize][0],
            ..candidate
        };
        let candidates: Vec<Candidate> = offered.into_iter().map(here).collect();
        let mut filler = self.in_block(&mut block);
        let mut waiting = filler.add_one_by_one(&candidates);
        let (sizes, stopped) = (filler.sizes, filler.stopped);
        waiting.iter_mut().for_each(|c| c.vertex = block.vertices[c.vertex as usize]);
        Filled { block, sizes, waiting, stopped }
    }

    /// Puts filled blocks back; returns the points that wait.
    fn absorb(&mut self, filled: Vec<Filled>) -> Vec<Candidate> {
        let mut waiting = Vec::new();
        let mut blocks = Vec::with_capacity(filled.len());
        for filled in filled {
            self.stopped = self.stopped.or(filled.stopped);
            self.sizes.extend_from_slice(&filled.sizes[filled.block.vertices.len()..]);
            waiting.extend(filled.waiting);
            blocks.push(filled.block);
        }
        self.mesh.absorb(blocks);
        waiting
    }
}

/// Boxes for blocks of [`PER_BLOCK`] points.
fn boxes_around(candidates: &[Candidate], part: f64) -> Boxes {
    let levels = candidates.len().div_ceil(PER_BLOCK).ilog2();
    Boxes::new(candidates.iter().step_by(SAMPLED).map(|c| c.point), levels, part)
}

/// The tets within two rings of vertices around some tets, ascending; [`NONE`] is skipped.
fn tets_near(mesh: &Tetrahedra, tets: &[u32]) -> Vec<u32> {
    let mut tets: Vec<u32> = tets.iter().copied().filter(|&t| t != NONE).collect();
    for _ in 0..2 {
        let mut near = vec![false; mesh.points.len()];
        for &t in &tets {
            mesh.tets[t as usize].iter().for_each(|&v| near[v as usize] = true);
        }
        let is_near = |t: &u32| mesh.is_alive(*t) && mesh.tets[*t as usize].iter().any(|&v| near[v as usize]);
        tets = (0..mesh.tets.len() as u32).into_par_iter().filter(is_near).collect();
    }
    tets
}

#[cfg(test)]
mod tests {
    use super::super::samples::*;
    use super::super::{Settings, VolumeMesh, mesh};
    use super::*;
    use crate::ground::size::UniformSize;

    #[test]
    fn many_points_give_the_same_mesh_on_any_number_of_threads() {
        let mut soup = Soup::default();
        soup.brick([0.; 3], [1.; 3], 12, INSIDE);
        let surface = soup.surface().unwrap();
        let filled = |threads: usize| -> VolumeMesh {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| mesh(&surface, &UniformSize(0.024), &Settings::default()).unwrap().0)
        };
        let one = filled(1);
        assert!(one.points.len() > LEAST + 5_000, "{} points are inserted by one thread", one.points.len());
        check_fills(&surface, &one);
        // The lattice has a point for each half of its cubes: none is lost at the seams.
        let side = 0.024 * 1.122_462_048_309_373;
        let wanted = 2.0 * (0.9_f64 / side).powi(3);
        let inside = one.points.iter().filter(|p| p.iter().all(|&x| x > 0.05 && x < 0.95)).count();
        assert!((inside as f64 / wanted - 1.0).abs() < 0.01, "{inside} of {wanted}");
        let three = filled(3);
        assert_eq!((one.points, one.tets, one.bodies), (three.points, three.tets, three.bodies));
    }
}
