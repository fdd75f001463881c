//! Predicts the number of coarse tets from the size field, before anything is meshed.

use super::room_error::RoomError;
use crate::Point;
use crate::ground::kernel::random::Random;
use crate::ground::memory;
use crate::ground::size::SizeField;
use csg::Aabb;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// Cells longer than this multiple of the size at their centre are halved.
const LONGEST: f64 = 2.0;

/// Maximum number of cells. The prediction takes 20 ms with them, and they resolve meshes of a
/// million tets.
const MOST_CELLS: f64 = 30_000.0;

/// In larger meshes there is a cell for each so many tets, which takes 1 % of the time of meshing:
/// small sizes along a curve are found only by cells as small as they are.
const TETS_OF_CELL: f64 = 100.0;

/// Maximum number of cells of the largest meshes. Cells with most tets are resolved first.
const LIMIT: usize = 2_000_000;

/// No machine lacks the memory for this many tets, and they take a second.
pub(super) const FEW: f64 = 1e5;

/// The mean volume of tets of size 1, that of the regular tet.
const VOLUME: f64 = 0.1178;

/// Part of a box.
struct Cell {
    min: Point,
    max: Point,
    size: f64,
    tets: f64,
}

impl Cell {
    fn new(min: Point, max: Point, size: &dyn SizeField) -> Self {
        let size = size.size_at(&nalgebra::center(&min, &max));
        // Infinite without bound: no tets.
        let tets = (max - min).map(|width| width / size).product() / VOLUME;
        Self { min, max, size, tets }
    }

    fn is_small(&self) -> bool {
        (self.max - self.min).max() <= LONGEST * self.size
    }

    fn halves(&self, size: &dyn SizeField) -> [Self; 2] {
        let axis = (self.max - self.min).imax();
        let middle = 0.5 * (self.min[axis] + self.max[axis]);
        let (mut low, mut high) = (self.max, self.min);
        (low[axis], high[axis]) = (middle, middle);
        [Self::new(self.min, low, size), Self::new(high, self.max, size)]
    }
}

/// In order of the number of tets.
impl Ord for Cell {
    fn cmp(&self, other: &Self) -> Ordering {
        self.tets.total_cmp(&other.tets)
    }
}

impl PartialOrd for Cell {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Cell {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Cell {}

/// The expected number of tets inside bodies in a box, as ∫ dV/h³ over them; 0 if `few` tets or
/// less would fill the box. `inside` returns whether a point is in a body.
///
/// Bodies thinner than the size have more tets: their surface decides.
pub(super) fn tets<F: Fn(&Point) -> bool>(
    bounds: &Aabb,
    size: &dyn SizeField,
    few: f64,
    inside: impl FnOnce() -> F,
) -> f64 {
    let whole = Cell::new(bounds.min, bounds.max, size);
    let mut sum = whole.tets;
    let (mut open, mut done) = (BinaryHeap::from([whole]), Vec::new());
    while open.len() + done.len() < LIMIT.min((sum / TETS_OF_CELL).max(MOST_CELLS) as usize)
        && let Some(cell) = open.pop()
    {
        if cell.is_small() {
            done.push(cell);
        } else {
            let halves = cell.halves(size);
            sum += halves[0].tets + halves[1].tets - cell.tets;
            open.extend(halves);
        }
    }
    done.extend(open.into_vec());
    let in_box: f64 = done.iter().map(|cell| cell.tets).sum();
    if in_box <= few {
        return 0.0;
    }
    // Points at random, because a lattice may miss all walls that are parallel to it.
    let (mut random, inside) = (Random::new(1), inside());
    let mut is_filled = |cell: &&Cell| {
        let point = cell.min + (cell.max - cell.min).map(|width| width * random.unit());
        inside(&point)
    };
    done.iter().filter(|cell| is_filled(cell)).map(|cell| cell.tets).sum()
}

/// *Local.* Refuses an expected number of coarse tets that do not fit the memory.
///
/// # Errors
/// If they do not fit; the error has the numbers.
pub(super) fn refuse_expected(tets: f64, memory: Option<u64>) -> Result<(), RoomError> {
    /// Memory of a coarse tet while it is made, with some room for the error of the expectation.
    const BYTES: f64 = 250.0;
    let needed = BYTES * tets;
    match memory.or_else(memory::available_bytes) {
        Some(available) if needed > available as f64 => {
            let tets = format!("{} tets", rounded(tets));
            Err(RoomError::Expected { tets, needed: needed as u64, available })
        }
        _ => Ok(()),
    }
}

/// An expected number as text, with two digits.
pub(super) fn rounded(count: f64) -> String {
    match count {
        f64::INFINITY => "countless".into(),
        1e6..1e9 => format!("{} million", two_digits(count / 1e6)),
        1e9..1e12 => format!("{} billion", two_digits(count / 1e9)),
        1e4..1e6 => format!("{} 000", two_digits(count / 1e3)),
        _ => format!("{count:.1e}"),
    }
}

fn two_digits(number: f64) -> String {
    match number {
        ..9.95 => format!("{number:.1}"),
        ..99.5 => format!("{number:.0}"),
        _ => format!("{:.0}", 10.0 * (number / 10.0).round()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::size::{Source, SourceTree, UniformSize};

    fn cube() -> Aabb {
        Aabb { min: Point::origin(), max: Point::new(1.0, 1.0, 1.0) }
    }

    #[test]
    fn a_uniform_size_fills_the_volume() {
        let ball = |p: &Point| (p - Point::new(0.5, 0.5, 0.5)).norm() < 0.5;
        for h in [0.04, 0.01, 1e-5] {
            let found = tets(&cube(), &UniformSize(h), 0.0, || ball);
            let exact = std::f64::consts::PI / (6.0 * VOLUME * h.powi(3));
            assert!((found / exact - 1.0).abs() < 0.05, "{h}: {found}, {exact}");
        }
        assert_eq!(tets(&cube(), &UniformSize(0.1), 1e5, || -> fn(&Point) -> bool { panic!("few") }), 0.0);
    }

    /// ∫ 4πr² dr/(s + g·r)³ ≈ 4π/g³·(ln(g·R/s) − 3/2) in a ball of radius R.
    #[test]
    fn a_small_size_at_a_point_needs_tets_in_proportion_to_its_logarithm() {
        let center = Point::new(0.5, 0.5, 0.5);
        let ball = |p: &Point| (p - center).norm() < 0.5;
        for size in [1e-3, 1e-6, 1e-9] {
            let tree = SourceTree::new(cube(), 0.1, 1.0, &[Source { point: center, size }]);
            struct Field(SourceTree);
            impl SizeField for Field {
                fn size_at(&self, point: &Point) -> f64 {
                    self.0.size_at(point)
                }
            }
            let found = tets(&cube(), &Field(tree), 0.0, || ball);
            let exact = 4.0 * std::f64::consts::PI / 1e-3 * ((0.05 / size).ln() - 1.5) / VOLUME;
            assert!((found / exact - 1.0).abs() < 0.15, "{size}: {found}, {exact}");
        }
    }
}
