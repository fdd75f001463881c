//! Cutting the octahedra of a coarse tet, and the sign of every child.
//!
//! The corners of a row of children are runs of consecutive numbers, so plain loops vectorise.

use super::diagonal;
use super::lattice::{Lattice, OCTAHEDRON, UPRIGHT, UPSIDE_DOWN, corner_place};
use super::rows::Rows;
use super::run::Run;
use super::snap::Coordinates;
use super::tet::BadTet;
use crate::Point;
use crate::ground::kernel::predicates::{Sign, orient3d};
use crate::ground::kernel::vector::{Wide, wide};
use crate::ground::mesh::GlobalId;
use crate::parallel::check::Fault;

/// How octahedra are cut.
pub(super) enum Cut {
    /// All along this diagonal.
    Evenly(u8),
    /// Each along its own best diagonal.
    EachBest,
}

/// The corners of the children of one coarse tet, and scratch space.
pub(super) struct Cutting {
    /// x, y, z of all corners, in lattice order.
    pub axes: [Vec<f64>; 3],
    /// For a row of octahedra and each diagonal: the worst shape, and 1 if all signs are certain,
    /// else 0.
    shapes: [Vec<f64>; 3],
    certain: [Vec<f64>; 3],
    /// Children that are not positive, with their positions.
    pub bad: Vec<(u32, Coordinates)>,
}

impl Cutting {
    pub fn new(lattice: Lattice) -> Self {
        let row = || vec![0.0; lattice.n() as usize];
        Self {
            axes: [Vec::new(), Vec::new(), Vec::new()],
            shapes: [row(), row(), row()],
            certain: [row(), row(), row()],
            bad: Vec::new(),
        }
    }

    /// Cuts the octahedra, checks the children, and notes those that are not positive.
    pub fn cut(&mut self, rows: &Rows, cut: Cut, bytes: &mut [u8]) {
        self.bad.clear();
        wide(CutAll { cutting: self, rows, cut, bytes });
    }

    /// Cuts all octahedra along one diagonal and checks the children.
    #[inline(always)]
    fn cut_evenly(&mut self, rows: &Rows, diagonal: u8, bytes: &mut [u8]) {
        // Four octahedra per byte; bits beyond the last octahedron are never read.
        bytes.fill(diagonal * 0b0101_0101);
        let lattice = rows.lattice();
        for (c, d, cells) in lattice.rows() {
            let around = rows.around(c, d);
            self.check_others(lattice, around, [c, d, cells]);
            let first = lattice.octahedron_child([0, c, d]);
            for (child, corners) in (0..).zip(OCTAHEDRON[usize::from(diagonal)]) {
                self.check_run(around, corners, cells - 1, first + child, 4);
            }
        }
    }

    /// Cuts each octahedron along its own best diagonal and checks the children.
    #[inline(always)]
    fn cut_each_best(&mut self, rows: &Rows, bytes: &mut [u8]) {
        let lattice = rows.lattice();
        for (c, d, cells) in lattice.rows() {
            let around = rows.around(c, d);
            self.check_others(lattice, around, [c, d, cells]);
            let count = cells as usize - 1;
            self.measure_octahedra(around, count);
            let first_child = lattice.octahedron_child([0, c, d]);
            let first = lattice.octahedron_row(c, d);
            for i in 0..count {
                let best = diagonal::best([0, 1, 2].map(|k| self.shapes[k][i]));
                diagonal::set(bytes, first + i as u32, best);
                if self.certain[usize::from(best)][i] > 0.0 {
                    continue;
                }
                for (child, corners) in (0..).zip(OCTAHEDRON[usize::from(best)]) {
                    self.check_one(around, corners, i, first_child + 4 * i as u32 + child);
                }
            }
        }
    }

    /// Checks the upright and upside-down children of a row of cells.
    #[inline(always)]
    fn check_others(&mut self, lattice: Lattice, rows: [usize; 4], [c, d, cells]: [u32; 3]) {
        let first = lattice.child_row(c, d);
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
            self.bad.push((child, middle(&[p, q, r, s])));
        }
    }

    fn point(&self, i: usize) -> Point {
        Point::from([0, 1, 2].map(|axis| self.axes[axis][i]))
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

    /// The fault of the tet with this id and these corners, if it has children that are not
    /// positive.
    pub fn verdict(
        &mut self,
        (tet, corners): (GlobalId, impl FnOnce() -> [Point; 4]),
        lattice: Lattice,
        described: usize,
    ) -> Option<BadTet> {
        if self.bad.is_empty() {
            return None;
        }
        self.bad.sort_unstable_by_key(|(child, _)| *child);
        self.bad.dedup_by_key(|(child, _)| *child);
        let first = tet * u64::from(lattice.children());
        let describe = |&(child, place): &(u32, Coordinates)| Fault::NotPositive {
            tet: first + u64::from(child),
            place,
        };
        let faults = self.bad.iter().take(described).map(describe).collect();
        Some(BadTet { tet, corners: corners(), children: self.bad.len() as u64, faults })
    }
}

/// The centroid of four points.
pub(super) fn middle([p, q, r, s]: &[Point; 4]) -> Coordinates {
    ((p.coords + q.coords + r.coords + s.coords) / 4.0).into()
}

/// Cuts the octahedra with wide registers.
struct CutAll<'a> {
    cutting: &'a mut Cutting,
    rows: &'a Rows,
    cut: Cut,
    bytes: &'a mut [u8],
}

impl Wide for CutAll<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { cutting, rows, cut, bytes } = self;
        match cut {
            Cut::Evenly(diagonal) => cutting.cut_evenly(rows, diagonal, bytes),
            Cut::EachBest => cutting.cut_each_best(rows, bytes),
        }
    }
}
