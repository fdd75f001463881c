//! The front in blocks, on all threads.
//!
//! Tets are large until the front has passed, so the cavities of most points would reach from block
//! to block. Therefore **walls** come first: the points near a plane that cuts a block in two. In a
//! wall tets are as small as wanted, so nearly all cavities end there, and the halves on its sides
//! are blocks of their own. They are cut by further walls until they are small (Cignoni, Montani,
//! Scopigno 1998 divide the Delaunay mesh of given points by walls of tets). One thread makes the
//! first wall, two the second and the third, and so on. Few points have to wait for the end: 57 of
//! 297,000 in the shaft.
//!
//! Walls depend on the mesh and the size field only, so the result is the same for any number of
//! threads.

use super::blocks::{Block, Boxes, Cut};
use super::points::{Filler, State, Stopped};
use crate::ground::kernel::random::Random;
use crate::mesher::half_face::NONE;
use crate::{Point, Vector};
use rayon::prelude::*;

/// Expected tets in a block. In smaller blocks more tets are in walls, larger ones keep fewer
/// threads busy.
const PER_BLOCK: f64 = 75_000.0;

/// So many blocks for each thread are filled at a time. More keep threads busier, fewer need less
/// memory: filled blocks are copies of their tets.
const BATCH: usize = 8;

/// Least number of expected tets, as a fraction of those that exist. Blocks are copied for each
/// level of walls, which takes longer than it saves if there are fewer, as beside a lattice.
const LEAST_SHARE: f64 = 0.5;

/// The number of tets is predicted from the sizes in at most twice so many.
const MEASURED: usize = 50_000;

/// The number of points that represent the expected tets.
const SAMPLES: f64 = 20_000.0;

/// Points are in a wall if its plane is nearer than so many wanted sizes. With 2 hardly fewer
/// points have to wait, and walls take longer.
const REACH: f64 = 1.0;

/// The space near a plane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wall {
    axis: usize,
    cut: f64,
}

impl Wall {
    fn new((axis, cut): (usize, f64)) -> Self {
        Self { axis, cut }
    }

    /// Whether a point is in the wall, where this size is wanted.
    pub fn contains(self, point: &Point, size: f64) -> bool {
        (point[self.axis] - self.cut).abs() <= REACH * size
    }
}

/// A filled block.
struct Filled {
    block: Block,
    /// The sizes at its vertices.
    sizes: Vec<f64>,
    /// The states of its tets.
    states: Vec<State>,
    stopped: Option<Stopped>,
}

/// Vertices from which blocks were copied.
struct OldVertices {
    /// The number of blocks at each.
    uses: Vec<u8>,
    /// Lower sizes than in the mesh, block by block.
    sizes: Vec<(u32, f64)>,
}

impl Filler<'_> {
    /// Runs the front and inserts circumcentres, if many points are expected. Afterwards tets are
    /// coarse only if their points have to wait.
    pub(super) fn advance_in_blocks(&mut self) {
        let is_simple = self.mesh.exact.is_empty() && self.mesh.ranks.is_empty();
        let Some(boxes) = is_simple.then(|| self.boxes()).flatten() else { return };
        self.build_wall(Wall::new(boxes.plane(0, 0)));
        for level in 1..boxes.levels() {
            self.fill_blocks(&boxes.at_level(level), |block, index| {
                block.build_wall(Wall::new(boxes.plane(level, index)));
            });
        }
        self.fill_blocks(&boxes, |block, _| block.fill_between_walls());
    }

    /// Boxes for about [`PER_BLOCK`] of the expected tets each, if these are many.
    fn boxes(&self) -> Option<Boxes> {
        let coarse = self.coarse_tets();
        let step = (coarse.len() / MEASURED).max(1);
        let measured: Vec<u32> = coarse.into_iter().step_by(step).collect();
        let expected: Vec<f64> = measured.par_iter().map(|&t| self.sample(t).tets).collect();
        let sum: f64 = expected.iter().sum();
        let total = step as f64 * sum;
        let least = f64::max(2.0 * PER_BLOCK, LEAST_SHARE * self.mesh.len() as f64);
        if total.is_nan() || total < least || total > self.limits.max_tets as f64 {
            return None;
        }
        let mut random = Random::new(1998);
        let (mut points, mut due) = (Vec::new(), 0.0);
        for (t, expected) in measured.into_iter().zip(expected) {
            due += expected * SAMPLES / sum;
            while due >= 1.0 {
                due -= 1.0;
                points.push(self.random_point(t, &mut random));
            }
        }
        Some(Boxes::new(points.into_iter(), (total / PER_BLOCK).log2() as u32, 0.5))
    }

    /// A point in a tet, all with the same probability.
    fn random_point(&self, t: u32, random: &mut Random) -> Point {
        let mut cuts = [(); 3].map(|()| random.unit());
        cuts.sort_unstable_by(f64::total_cmp);
        let weights = [cuts[0], cuts[1] - cuts[0], cuts[2] - cuts[1], 1.0 - cuts[2]];
        let corners = self.mesh.corners(t).into_iter().zip(weights);
        Point::from(corners.map(|(corner, weight)| corner.coords * weight).sum::<Vector>())
    }

    /// Inserts the points of a wall.
    fn build_wall(&mut self, wall: Wall) {
        self.wall = Some(wall);
        let open = self.in_random_rounds(|t| self.is_at(t, wall));
        self.advance(open);
        self.finish();
        self.wall = None;
        // The points behind the wall have not been tried, and those at the seam may be again.
        self.replace_states(State::Rejected, State::Coarse);
        self.waiting.clear();
    }

    /// Inserts all points that do not have to wait.
    fn fill_between_walls(&mut self) {
        let open = self.in_random_rounds(|_| true);
        self.advance(open);
        self.finish();
        self.replace_states(State::Coarse, State::Settled);
        self.replace_states(State::Rejected, State::Settled);
        for t in std::mem::take(&mut self.waiting) {
            if self.mesh.is_alive(t) && self.state(t) == State::Settled {
                self.states[t as usize] = State::Coarse;
            }
        }
    }

    fn replace_states(&mut self, old: State, new: State) {
        self.states.iter_mut().filter(|state| **state == old).for_each(|state| *state = new);
    }

    /// Whether the ideal points of a tet may be in a wall.
    fn is_at(&self, t: u32, wall: Wall) -> bool {
        let corners = self.mesh.tets[t as usize];
        let along = corners.map(|v| self.mesh.point(v)[wall.axis] - wall.cut);
        // Ideal points are at most one size away from their faces.
        let reach = (1.0 + REACH) * corners.map(|v| self.at(v)).into_iter().fold(0.0, f64::max);
        along.iter().any(|&x| x <= reach) && along.iter().any(|&x| x >= -reach)
    }

    /// Does some work in all blocks, on all threads.
    fn fill_blocks(&mut self, boxes: &Boxes, work: impl Fn(&mut Filler, usize) + Sync) {
        if self.stops() {
            return;
        }
        let tets: Vec<u32> = self.mesh.alive().collect();
        let cut = Cut::new(self.mesh, &tets, boxes);
        drop(tets);
        let vertices = self.mesh.points.len();
        let mut old = OldVertices { uses: vec![0; vertices], sizes: Vec::new() };
        let batch = BATCH * rayon::current_num_threads();
        for first in (0..cut.len()).step_by(batch) {
            let one = |numbers: &mut Vec<u32>, index: usize| {
                let block = Block::new(self.mesh, &cut, index, numbers);
                self.fill_block(block, |filler| work(filler, index))
            };
            let indices = first..cut.len().min(first + batch);
            let filled = indices.into_par_iter().map_init(|| vec![NONE; vertices], one).collect();
            self.put_back(filled, &mut old);
            if self.stops() {
                return;
            }
        }
        self.lower_old(old);
    }

    fn fill_block(&self, mut block: Block, work: impl Fn(&mut Filler)) -> Filled {
        let mut filler = self.in_block(&mut block);
        work(&mut filler);
        let Filler { sizes, mut states, stopped, .. } = filler;
        states.resize(block.mesh.tets.len(), State::Coarse);
        Filled { block, sizes, states, stopped }
    }

    /// Puts blocks back, with their states and the sizes at new vertices, unless they have too many
    /// tets. Sizes at old vertices have to wait: they count in the blocks to come.
    fn put_back(&mut self, filled: Vec<Filled>, old: &mut OldVertices) {
        let tets: usize = filled.iter().map(|filled| filled.block.mesh.len()).sum();
        let before: usize = filled.iter().map(|filled| filled.block.tets.len()).sum();
        if self.mesh.len() - before + tets > self.limits.max_tets {
            self.stopped = self.stopped.or(Some(Stopped::TooManyTets));
            return;
        }
        let mut blocks = Vec::with_capacity(filled.len());
        for Filled { block, sizes, states, stopped } in filled {
            self.stopped = self.stopped.or(stopped);
            let (old_sizes, new_sizes) = sizes.split_at(block.vertices.len());
            for (&v, &size) in block.vertices.iter().zip(old_sizes) {
                old.uses[v as usize] = old.uses[v as usize].saturating_add(1);
                if size < self.at(v) {
                    old.sizes.push((v, size));
                }
            }
            self.sizes.extend_from_slice(new_sizes);
            let (old_states, new_states) = states.split_at(block.tets.len());
            for (&t, &state) in block.tets.iter().zip(old_states) {
                self.states[t as usize] = state;
            }
            self.states.extend_from_slice(new_states);
            blocks.push(block);
        }
        self.mesh.absorb(blocks);
    }

    /// Lowers the sizes at old vertices to those that they have in their blocks.
    fn lower_old(&mut self, OldVertices { uses, sizes }: OldVertices) {
        let mut lowered = Vec::new();
        for (v, size) in sizes {
            if size < self.at(v) {
                self.sizes[v as usize] = size;
                // Around the others all tets are in one block, where their states were updated.
                if uses[v as usize] > 1 {
                    lowered.push(v);
                }
            }
        }
        self.lower_from(lowered);
        // Those tets are coarse, and the next front finds them.
        self.lowered.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::super::bound::bound;
    use super::super::cavity::Cavity;
    use super::super::legalize::legalize;
    use super::super::points::Limits;
    use super::super::samples::*;
    use super::super::tetrahedra::MAX_TETS;
    use super::super::{Report, Settings, VolumeMesh, mesh};
    use super::*;
    use crate::ground::size::{SizeField, UniformSize};

    #[test]
    fn blocks_leave_few_coarse_tets_for_the_end() {
        let mut soup = Soup::default();
        soup.brick([0.; 3], [1.; 3], 20, INSIDE);
        let surface = soup.surface().unwrap();
        let (mut mesh, _) = bound(&surface, &surface.points, &mut Report::default()).unwrap();
        legalize(&mut mesh);
        let mut filler = Filler {
            mesh: &mut mesh,
            size: &UniformSize(0.03),
            scale: 1.0,
            sizes: Vec::new(),
            states: Vec::new(),
            cavity: Cavity::default(),
            limits: Limits { growth: 0.3, max_tets: MAX_TETS },
            lowered: Vec::new(),
            waiting: Vec::new(),
            wall: None,
            stopped: None,
        };
        filler.size_vertices();
        filler.set_states();
        filler.advance_in_blocks();
        assert_eq!(filler.mesh.check(), Vec::<String>::new());
        let tets: Vec<u32> = filler.mesh.alive().collect();
        let count = |state: State| tets.iter().filter(|&&t| filler.state(t) == state).count();
        let [fine, coarse, rejected] = [State::Fine, State::Coarse, State::Rejected].map(count);
        assert!(fine > 200_000, "{fine} fine tets");
        assert!(coarse < 1000 && rejected == 0, "{coarse} coarse tets, {rejected} rejected ones");
    }

    /// Sizes that fall toward an edge of the unit cube.
    struct Graded;

    impl SizeField for Graded {
        fn size_at(&self, point: &Point) -> f64 {
            0.005 + 0.06 * point.x.hypot(point.y)
        }
    }

    #[test]
    fn a_graded_mesh_is_the_same_on_any_number_of_threads() {
        let mut soup = Soup::default();
        soup.brick([0.; 3], [1.; 3], 40, INSIDE);
        let surface = soup.surface().unwrap();
        let filled = |threads: usize| -> VolumeMesh {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| mesh(&surface, &Graded, &Settings::default()).unwrap().0)
        };
        let one = filled(1);
        check_fills(&surface, &one);
        assert!(one.tets.len() > 200_000, "{} tets", one.tets.len());
        let three = filled(3);
        assert_eq!((one.points, one.tets, one.bodies), (three.points, three.tets, three.bodies));
    }
}
