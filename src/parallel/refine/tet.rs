//! Inside the coarse tets: coordinates, diagonals, and the sign of every child.
//!
//! One pass over the coarse tets. The lattice points of a tet are gathered into three short arrays
//! (x, y, z). In these the corners of a row of children are runs of consecutive numbers, so plain
//! loops vectorise.

use super::blend::{Blend, barycentric, split};
use super::diagonal::{self, Diagonals};
use super::lattice::{Lattice, OCTAHEDRON, UPRIGHT, UPSIDE_DOWN, corner_place};
use super::numbering::Numbering;
use super::run::Run;
use super::snap::{Coordinates, is_flat};
use super::{RefineError, Settings};
use crate::Point;
use crate::ground::kernel::predicates::{Sign, orient3d};
use crate::ground::kernel::vector::{Wide, wide};
use crate::ground::mesh::{GlobalId, TetId};
use crate::ground::progress::Work;
use crate::ground::projector::Projector;
use crate::parallel::check::Fault;
use crate::parallel::distribution::DistMesh;
use rayon::iter::Either;
use rayon::prelude::*;

/// The results of refining the coarse tets.
#[derive(Clone)]
pub struct Inside {
    /// The stored fine vertices.
    pub points: Box<[Coordinates]>,
    /// The diagonals of the octahedra.
    pub diagonals: Diagonals,
    /// For each coarse tet, whether its lattice is affine.
    pub flat: Vec<bool>,
}

/// Computes the points inside the tets (storing those that are kept), chooses the diagonals, and
/// checks every child. Also returns the coarse tets that have children which are not positive.
///
/// # Errors
/// [`RefineError::OutOfMemory`] if the diagonals do not fit.
pub fn fill(
    mesh: &DistMesh,
    projector: &Projector,
    numbering: &Numbering,
    mut points: Box<[Coordinates]>,
    settings: &Settings,
    work: &Work,
) -> Result<(Inside, Vec<BadTet>), RefineError> {
    let lattice = numbering.lattice();
    let bytes = mesh.tets.len() * Diagonals::bytes_of_tet(lattice.octahedra());
    let mut diagonals = Diagonals::new(mesh.tets.len(), lattice.octahedra())
        .ok_or(RefineError::OutOfMemory { rank: mesh.rank, bytes: bytes as u64 })?;
    let bytes_per_tet = diagonals.bytes_per_tet();
    let (before, inside) = points.split_at_mut(numbering.bases()[2]);
    let flat: Vec<bool> = (0..mesh.tets.len())
        .map(|tet| is_flat(mesh, projector, &settings.displacements, TetId::new(tet)))
        .collect();
    let insides = match lattice.tet_points() as usize {
        _ if inside.is_empty() => {
            Either::Left((0..mesh.tets.len()).into_par_iter().map(|_| &mut [] as &mut [Coordinates]))
        }
        size => Either::Right(inside.par_chunks_mut(size)),
    };
    let plan = Plan::new(lattice);
    let is_cut = lattice.octahedra() > 0;
    let fill_one = |block: &mut Block, ((tet, inside), bytes): ((usize, &mut [Coordinates]), &mut [u8])| {
        let tet = TetId::new(tet);
        if work.is_cancelled() {
            return None;
        }
        work.add(1);
        block.gather(mesh, numbering, tet, before);
        let corners = mesh.tets[tet.index()].map(|v| before[v.index()]);
        let flat = flat[tet.index()];
        block.fill_odd_part(&plan, &corners, flat);
        block.bad.clear();
        let is_even = flat || settings.nested;
        let cut =
            if is_even && is_cut { Cut::Evenly(diagonal::best_of_tet(&corners)) } else { Cut::EachBest };
        wide(FillAndCut { block, plan: &plan, cut, bytes });
        let kept = inside.iter_mut();
        kept.zip(block.inside(lattice)).for_each(|(kept, point)| *kept = point);
        block.verdict(mesh.tet_ids[tet.index()], lattice, settings.described)
    };
    let bad: Vec<BadTet> = insides
        .enumerate()
        .zip(diagonals.bytes_mut().par_chunks_mut(bytes_per_tet))
        .map_init(|| Block::new(lattice), fill_one)
        .flatten_iter()
        .collect();
    Ok((Inside { points, diagonals, flat }, bad))
}

/// Recomputes the lattice points of a coarse tet from its boundary, bitwise as [`fill`].
pub struct Lattices<'a> {
    /// The part.
    pub mesh: &'a DistMesh,
    /// Its numbering.
    pub numbering: &'a Numbering,
    /// The fine vertices, at least those on coarse vertices, edges and faces.
    pub points: &'a [Coordinates],
}

impl Lattices<'_> {
    fn block(&self, tet: TetId, flat: bool) -> Block {
        let lattice = self.numbering.lattice();
        let (mut block, plan) = (Block::new(lattice), Plan::new(lattice));
        block.gather(self.mesh, self.numbering, tet, self.points);
        let corners = self.mesh.tets[tet.index()].map(|v| self.points[v.index()]);
        block.fill_odd_part(&plan, &corners, flat);
        wide(Fill { block: &mut block, plan: &plan });
        block
    }

    /// Replaces `points` by all lattice points, in lattice order.
    pub fn all(&self, tet: TetId, flat: bool, points: &mut Vec<Coordinates>) {
        let block = self.block(tet, flat);
        points.clear();
        points.extend((0..block.ids.len()).map(|i| block.coordinates(i)));
    }

    /// The points interior to the tet, in id order.
    pub fn inside(&self, tet: TetId, flat: bool) -> Vec<Coordinates> {
        self.block(tet, flat).inside(self.numbering.lattice()).collect()
    }
}

/// A coarse tet with children that are not positive.
pub struct BadTet {
    /// Its global id.
    pub tet: GlobalId,
    children: u64,
    faults: Vec<Fault>,
}

/// The error that reports these tets.
pub fn inverted(bad: &[BadTet], described: usize) -> RefineError {
    RefineError::Inverted {
        children: bad.iter().map(|b| b.children).sum(),
        coarse: bad.iter().map(|b| b.tet).collect(),
        faults: bad.iter().flat_map(|b| b.faults.iter().copied()).take(described).collect(),
    }
}

/// The starts of the rows of points, computed once.
struct Plan {
    lattice: Lattice,
    /// By c + (n + 1)·d.
    rows: Vec<u32>,
}

impl Plan {
    fn new(lattice: Lattice) -> Self {
        let n = lattice.n();
        let row = |d, c| if c + d <= n { lattice.row(c, d) } else { 0 };
        Self { lattice, rows: (0..=n).flat_map(|d| (0..=n).map(move |c| row(d, c))).collect() }
    }

    #[inline]
    fn row(&self, c: u32, d: u32) -> usize {
        self.rows[(c + (self.lattice.n() + 1) * d) as usize] as usize
    }

    /// The starts of the four rows of points around a row of cells, numbered as in
    /// [`corner_place`]; 0 outside the tet.
    fn around(&self, c: u32, d: u32) -> [usize; 4] {
        let inside = c + d + 2 <= self.lattice.n();
        [
            self.row(c, d),
            self.row(c + 1, d),
            self.row(c, d + 1),
            if inside { self.row(c + 1, d + 1) } else { 0 },
        ]
    }
}

/// Parents of a new lattice point, indexed by the parity bits of (b, c, d)/s: offsets of the points
/// whose mean it is.
///
/// If two of the four weights (a, b, c, d) are odd, it is the midpoint of a lattice edge; if all
/// four are, the centre of an octahedron.
const PARENTS: [&[[i32; 3]]; 8] = [
    &[],
    &[[-1, 0, 0], [1, 0, 0]],
    &[[0, -1, 0], [0, 1, 0]],
    &[[-1, 1, 0], [1, -1, 0]],
    &[[0, 0, -1], [0, 0, 1]],
    &[[-1, 0, 1], [1, 0, -1]],
    &[[0, -1, 1], [0, 1, -1]],
    &[[1, -1, -1], [-1, 1, 1], [-1, 1, -1], [1, -1, 1], [-1, -1, 1], [1, 1, -1]],
];

/// How octahedra are cut.
enum Cut {
    /// All along this diagonal.
    Evenly(u8),
    /// Each along its own best diagonal.
    EachBest,
}

/// Computes the interior points of a block with wide registers.
struct Fill<'a> {
    block: &'a mut Block,
    plan: &'a Plan,
}

impl Wide for Fill<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.block.fill_inside(self.plan);
    }
}

/// Computes the interior points of a block and cuts its octahedra, with wide registers.
struct FillAndCut<'a> {
    block: &'a mut Block,
    plan: &'a Plan,
    cut: Cut,
    bytes: &'a mut [u8],
}

impl Wide for FillAndCut<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { block, plan, cut, bytes } = self;
        block.fill_inside(plan);
        match cut {
            Cut::Evenly(diagonal) => block.cut_evenly(plan, diagonal, bytes),
            Cut::EachBest => block.cut_each_best(plan, bytes),
        }
    }
}

/// The lattice of one coarse tet: local ids and coordinates of its points, and scratch space.
struct Block {
    ids: Vec<u32>,
    /// x, y, z of all points.
    axes: [Vec<f64>; 3],
    /// Interpolation of the odd part of n.
    blend: Blend<4>,
    /// For a row of octahedra and each diagonal: the worst shape, and 1 if all signs are certain,
    /// else 0.
    shapes: [Vec<f64>; 3],
    certain: [Vec<f64>; 3],
    /// Children that are not positive, with the indices of their corners.
    bad: Vec<(u32, [usize; 4])>,
}

impl Block {
    fn new(lattice: Lattice) -> Self {
        let points = || vec![0.0; lattice.points() as usize];
        let row = || vec![0.0; lattice.n() as usize];
        Self {
            ids: Vec::new(),
            axes: [points(), points(), points()],
            blend: Blend::new(split(lattice.n()).0),
            shapes: [row(), row(), row()],
            certain: [row(), row(), row()],
            bad: Vec::new(),
        }
    }

    /// Loads the points on the boundary of the tet.
    fn gather(&mut self, mesh: &DistMesh, numbering: &Numbering, tet: TetId, before: &[Coordinates]) {
        numbering.lattice_ids(mesh, tet, &mut self.ids);
        let [x, y, z] = &mut self.axes;
        for (i, &id) in self.ids.iter().enumerate() {
            // Interior points have higher ids; they are not computed yet.
            if let Some(point) = before.get(id as usize) {
                (x[i], y[i], z[i]) = (point[0], point[1], point[2]);
            }
        }
    }

    /// Computes the interior points of the odd part of n, from which the dyadic rule starts.
    fn fill_odd_part(&mut self, plan: &Plan, corners: &[Coordinates; 4], flat: bool) {
        let (m, power) = split(plan.lattice.n());
        if m == 1 {
            return;
        }
        let index = |b: u32, c: u32, d: u32| plan.row(c * power, d * power) + (b * power) as usize;
        if !flat {
            let [x, y, z] = &self.axes;
            self.blend.take(corners, |[_, b, c, d]| {
                let i = index(b, c, d);
                [x[i], y[i], z[i]]
            });
        }
        for d in 1..m {
            for c in 1..m - d {
                for b in 1..(m - d).saturating_sub(c) {
                    let weights = [m - b - c - d, b, c, d];
                    let [x, y, z] =
                        if flat { barycentric(corners, weights) } else { self.blend.point(corners, weights) };
                    let i = index(b, c, d);
                    (self.axes[0][i], self.axes[1][i], self.axes[2][i]) = (x, y, z);
                }
            }
        }
    }

    /// Applies the dyadic rule to the interior points.
    #[inline(always)]
    fn fill_inside(&mut self, plan: &Plan) {
        let n = plan.lattice.n();
        let mut step = split(n).1 / 2;
        while step > 0 {
            for d in (step..n).step_by(step as usize) {
                for c in (step..n - d).step_by(step as usize) {
                    for first in [step, 2 * step] {
                        self.fill_row(plan, step, [first, c, d]);
                    }
                }
            }
            step /= 2;
        }
    }

    /// Computes every second point of a row, starting at `b`.
    #[inline(always)]
    fn fill_row(&mut self, plan: &Plan, step: u32, [b, c, d]: [u32; 3]) {
        let odd = |x: u32| (x / step % 2) as usize;
        let parents = PARENTS[odd(b) | odd(c) << 1 | odd(d) << 2];
        let end = plan.lattice.n() - c - d;
        if parents.is_empty() || b >= end {
            return;
        }
        let moved = |x: u32, by: i32| x.wrapping_add_signed(by * step as i32);
        let start = |by: &[i32; 3]| plan.row(moved(c, by[1]), moved(d, by[2])) + moved(b, by[0]) as usize;
        let to = plan.row(c, d) + b as usize;
        let along = (0..(end - b) as usize).step_by(2 * step as usize);
        if let [p, q] = parents {
            let [p, q] = [start(p), start(q)];
            for axis in &mut self.axes {
                along.clone().for_each(|i| axis[to + i] = 0.5 * (axis[p + i] + axis[q + i]));
            }
        } else {
            let from = [0, 1, 2, 3, 4, 5].map(|k| start(&parents[k]));
            for axis in &mut self.axes {
                for i in along.clone() {
                    let [p, q, r] = [0, 2, 4].map(|k| axis[from[k] + i] + axis[from[k + 1] + i]);
                    axis[to + i] = (p + q + r) / 6.0;
                }
            }
        }
    }

    /// The interior points of the tet, in id order.
    fn inside(&self, lattice: Lattice) -> impl Iterator<Item = Coordinates> {
        let row = |(first, count)| (first as usize..(first + count) as usize).map(|i| self.coordinates(i));
        lattice.interior_rows().flat_map(row)
    }

    #[inline]
    fn coordinates(&self, i: usize) -> Coordinates {
        [self.axes[0][i], self.axes[1][i], self.axes[2][i]]
    }

    /// Cuts all octahedra along one diagonal and checks the children.
    #[inline(always)]
    fn cut_evenly(&mut self, plan: &Plan, diagonal: u8, bytes: &mut [u8]) {
        // Four octahedra per byte; bits beyond the last octahedron are never read.
        bytes.fill(diagonal * 0b0101_0101);
        for (c, d, cells) in plan.lattice.rows() {
            let rows = plan.around(c, d);
            self.check_others(plan, rows, [c, d, cells]);
            let first = plan.lattice.octahedron_child([0, c, d]);
            for (child, corners) in (0..).zip(OCTAHEDRON[usize::from(diagonal)]) {
                self.check_run(rows, corners, cells - 1, first + child, 4);
            }
        }
    }

    /// Cuts each octahedron along its own best diagonal and checks the children.
    #[inline(always)]
    fn cut_each_best(&mut self, plan: &Plan, bytes: &mut [u8]) {
        for (c, d, cells) in plan.lattice.rows() {
            let rows = plan.around(c, d);
            self.check_others(plan, rows, [c, d, cells]);
            let count = cells as usize - 1;
            self.measure_octahedra(rows, count);
            let first_child = plan.lattice.octahedron_child([0, c, d]);
            let first = plan.lattice.octahedron_row(c, d);
            for i in 0..count {
                let best = diagonal::best([0, 1, 2].map(|k| self.shapes[k][i]));
                diagonal::set(bytes, first + i as u32, best);
                if self.certain[usize::from(best)][i] > 0.0 {
                    continue;
                }
                for (child, corners) in (0..).zip(OCTAHEDRON[usize::from(best)]) {
                    self.check_one(rows, corners, i, first_child + 4 * i as u32 + child);
                }
            }
        }
    }

    /// Checks the upright and upside-down children of a row of cells.
    #[inline(always)]
    fn check_others(&mut self, plan: &Plan, rows: [usize; 4], [c, d, cells]: [u32; 3]) {
        let first = plan.lattice.child_row(c, d);
        self.check_run(rows, UPRIGHT, cells, first, 1);
        let first = first + cells + 4 * (cells - 1);
        self.check_run(rows, UPSIDE_DOWN, cells.saturating_sub(2), first, 1);
    }

    /// Checks the children with these corner codes in the first `count` cells of a row; their
    /// indices start at `first` with step `stride`.
    #[inline(always)]
    fn check_run(&mut self, rows: [usize; 4], corners: [u8; 4], count: u32, first: u32, stride: u32) {
        if count == 0 || self.run(rows, corners, count as usize).all_positive() {
            return;
        }
        for i in 0..count {
            self.check_one(rows, corners, i as usize, first + stride * i);
        }
    }

    /// Checks one child by exact sign.
    #[cold]
    fn check_one(&mut self, rows: [usize; 4], corners: [u8; 4], cell: usize, child: u32) {
        let at = corners.map(|code| {
            let (row, shift) = corner_place(code);
            rows[row] + cell + shift
        });
        let [p, q, r, s] = at.map(|i| self.point(i));
        if orient3d(&p, &q, &r, &s) != Sign::Positive {
            self.bad.push((child, at));
        }
    }

    fn point(&self, i: usize) -> Point {
        Point::from(self.coordinates(i))
    }

    /// The corners of the children with these corner codes in the first `count` cells of a row.
    #[inline(always)]
    fn run(&self, rows: [usize; 4], corners: [u8; 4], count: usize) -> Run<'_> {
        let starts = corners.map(|code| {
            let (row, shift) = corner_place(code);
            rows[row] + shift
        });
        Run { axes: [0, 1, 2].map(|x| starts.map(|start| &self.axes[x][start..][..count])), count }
    }

    /// For each octahedron and diagonal, the worst shape and whether all signs are certain.
    #[inline(always)]
    fn measure_octahedra(&mut self, rows: [usize; 4], count: usize) {
        if count == 0 {
            return;
        }
        let mut shapes = std::mem::take(&mut self.shapes);
        let mut certain = std::mem::take(&mut self.certain);
        for (diagonal, children) in OCTAHEDRON.into_iter().enumerate() {
            let (shape, sure) = (&mut shapes[diagonal][..count], &mut certain[diagonal][..count]);
            shape.fill(f64::INFINITY);
            sure.fill(1.0);
            for corners in children {
                self.run(rows, corners, count).measure(shape, sure);
            }
        }
        (self.shapes, self.certain) = (shapes, certain);
    }

    /// The fault of the tet, if it has children that are not positive.
    fn verdict(&mut self, tet: GlobalId, lattice: Lattice, described: usize) -> Option<BadTet> {
        if self.bad.is_empty() {
            return None;
        }
        self.bad.sort_unstable();
        let first = tet * u64::from(lattice.children());
        let describe = |&(child, at): &(u32, [usize; 4])| {
            let [p, q, r, s] = at.map(|i| self.point(i).coords);
            Fault::NotPositive { tet: first + u64::from(child), place: ((p + q + r + s) / 4.0).into() }
        };
        let faults = self.bad.iter().take(described).map(describe).collect();
        Some(BadTet { tet, children: self.bad.len() as u64, faults })
    }
}
