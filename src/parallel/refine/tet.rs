//! Inside the coarse tets: coordinates, diagonals, and the sign of every child.
//!
//! One pass over the coarse tets. The lattice points of a tet are gathered into three short arrays
//! (x, y, z), so that plain loops over them vectorise.

use super::blend::{Blend, barycentric, split};
use super::curved;
use super::cut::{Cut, Cutting};
use super::diagonal::{self, Diagonals};
use super::lattice::Lattice;
use super::numbering::Numbering;
use super::rows::Rows;
use super::snap::{Coordinates, is_flat};
use super::{RefineError, Settings};
use crate::Point;
use crate::ground::kernel::buckets::tabulate;
use crate::ground::kernel::vector::{Wide, wide};
use crate::ground::mesh::{GlobalId, Order, TetId};
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
    let (cells, lattice) = (numbering.cells(), numbering.lattice());
    let bytes = mesh.tets.len() * Diagonals::bytes_of_tet(cells.octahedra());
    let mut diagonals = Diagonals::new(mesh.tets.len(), cells.octahedra())
        .ok_or(RefineError::OutOfMemory { rank: mesh.rank, bytes: bytes as u64 })?;
    let bytes_per_tet = diagonals.bytes_per_tet();
    let (before, inside) = points.split_at_mut(numbering.bases()[2]);
    let count = mesh.tets.len();
    let flat = tabulate(count, |tet| is_flat(mesh, projector, &settings.displacements, TetId::new(tet)));
    let insides = match lattice.tet_points() as usize {
        _ if inside.is_empty() => {
            Either::Left((0..count).into_par_iter().map(|_| &mut [] as &mut [Coordinates]))
        }
        size => Either::Right(inside.par_chunks_mut(size)),
    };
    let (rows, cell_rows) = (numbering.rows(), numbering.cell_rows());
    let is_cut = cells.octahedra() > 0;
    type Scratch = (Block, Cutting);
    let fill_one = |scratch: &mut Scratch,
                    ((tet, inside), bytes): ((usize, &mut [Coordinates]), &mut [u8])| {
        let (block, cutting) = scratch;
        if work.is_cancelled() {
            return None;
        }
        work.add_one(tet, count);
        let tet = TetId::new(tet);
        block.gather(mesh, numbering, tet, before);
        let corners = mesh.tets[tet.index()].map(|v| before[v.index()]);
        let flat = flat[tet.index()];
        block.fill_odd_part(rows, &corners, flat);
        wide(Fill { block, rows });
        let is_even = flat || settings.nested;
        let cut =
            if is_even && is_cut { Cut::Evenly(diagonal::best_of_tet(&corners)) } else { Cut::EachBest };
        if settings.order == Order::First {
            std::mem::swap(&mut block.axes, &mut cutting.axes);
            cutting.cut(cell_rows, cut, bytes);
            std::mem::swap(&mut block.axes, &mut cutting.axes);
        } else {
            curved::take_corners(&block.axes, rows, cell_rows, &mut cutting.axes);
            cutting.cut(cell_rows, cut, bytes);
            // Straight tets are proved by the check, with all others.
            if !flat {
                curved::prove(&block.axes, rows, cells, settings.nested, bytes, &mut cutting.bad);
            }
        }
        let kept = inside.iter_mut();
        kept.zip(block.inside(lattice)).for_each(|(kept, point)| *kept = point);
        let corners = || mesh.tets[tet.index()].map(|v| mesh.points[v.index()]);
        cutting.verdict((mesh.tet_ids[tet.index()], corners), cells, settings.described)
    };
    let bad: Vec<BadTet> = insides
        .enumerate()
        .zip(diagonals.bytes_mut().par_chunks_mut(bytes_per_tet))
        .map_init(|| (Block::new(lattice), Cutting::new(cells)), fill_one)
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
        let rows = self.numbering.rows();
        let mut block = Block::new(rows.lattice());
        block.gather(self.mesh, self.numbering, tet, self.points);
        let corners = self.mesh.tets[tet.index()].map(|v| self.points[v.index()]);
        block.fill_odd_part(rows, &corners, flat);
        wide(Fill { block: &mut block, rows });
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
    pub(super) corners: [Point; 4],
    pub(super) children: u64,
    pub(super) faults: Vec<Fault>,
}

/// The error that reports these tets.
pub fn inverted(bad: &[BadTet], described: usize) -> RefineError {
    RefineError::Inverted {
        children: bad.iter().map(|b| b.children).sum(),
        coarse: bad.iter().map(|b| b.tet).collect(),
        corners: bad.iter().map(|b| b.corners).collect(),
        faults: bad.iter().flat_map(|b| b.faults.iter().copied()).take(described).collect(),
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

/// Computes the interior points of a block with wide registers.
struct Fill<'a> {
    block: &'a mut Block,
    rows: &'a Rows,
}

impl Wide for Fill<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.block.fill_inside(self.rows);
    }
}

/// The lattice of one coarse tet: local ids and coordinates of its points.
struct Block {
    ids: Vec<u32>,
    /// x, y, z of all points.
    axes: [Vec<f64>; 3],
    /// Interpolation of the odd part of n.
    blend: Blend<4>,
}

impl Block {
    fn new(lattice: Lattice) -> Self {
        let points = || vec![0.0; lattice.points() as usize];
        Self {
            ids: Vec::new(),
            axes: [points(), points(), points()],
            blend: Blend::new(split(lattice.n()).0),
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
    fn fill_odd_part(&mut self, rows: &Rows, corners: &[Coordinates; 4], flat: bool) {
        let (m, power) = split(rows.lattice().n());
        if m == 1 {
            return;
        }
        let index = |b: u32, c: u32, d: u32| rows.start(c * power, d * power) + (b * power) as usize;
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
    fn fill_inside(&mut self, rows: &Rows) {
        let n = rows.lattice().n();
        let mut step = split(n).1 / 2;
        while step > 0 {
            for d in (step..n).step_by(step as usize) {
                for c in (step..n - d).step_by(step as usize) {
                    for first in [step, 2 * step] {
                        self.fill_row(rows, step, [first, c, d]);
                    }
                }
            }
            step /= 2;
        }
    }

    /// Computes every second point of a row, starting at `b`.
    #[inline(always)]
    fn fill_row(&mut self, rows: &Rows, step: u32, [b, c, d]: [u32; 3]) {
        let odd = |x: u32| (x / step % 2) as usize;
        let parents = PARENTS[odd(b) | odd(c) << 1 | odd(d) << 2];
        let end = rows.lattice().n() - c - d;
        if parents.is_empty() || b >= end {
            return;
        }
        let moved = |x: u32, by: i32| x.wrapping_add_signed(by * step as i32);
        let start = |by: &[i32; 3]| rows.start(moved(c, by[1]), moved(d, by[2])) + moved(b, by[0]) as usize;
        let to = rows.start(c, d) + b as usize;
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
}
