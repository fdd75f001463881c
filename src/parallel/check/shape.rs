//! Volume, mean ratio and dihedral angles of many tets at a time.
//!
//! Tets are processed in batches, coordinate by coordinate, so that the loops over a batch
//! vectorise. All operations are basic IEEE arithmetic, so the results are the same on all
//! machines.

use super::angles;
use super::report::RATIO_BINS;
use crate::Point;
use crate::ground::kernel::predicates::{Sign, orient3d, volume6_and_error};
use crate::ground::kernel::vector::{Wide, wide};

/// Tets in a batch: enough to fill vector registers, few enough for the first-level cache.
pub const BATCH: usize = 64;

/// Corner coordinates of a batch of tets.
#[derive(Clone, Debug)]
pub struct Batch {
    count: usize,
    /// By corner, then by axis.
    corners: [[[f64; BATCH]; 3]; 4],
    ids: [u64; BATCH],
}

/// The shapes of a batch of tets; entries beyond the length of the batch are undefined.
#[derive(Clone, Debug)]
pub struct Shapes {
    /// Six times the volumes.
    pub volume6: [f64; BATCH],
    /// Error bounds of `volume6`.
    pub error: [f64; BATCH],
    /// Mean ratios: 1 for the regular tet, negative for an inverted one.
    pub mean_ratio: [f64; BATCH],
    /// Cosine of the smallest dihedral angle.
    pub smallest: [f64; BATCH],
    /// Cosine of the largest dihedral angle.
    pub largest: [f64; BATCH],
    /// The bin of the mean ratio, and the cells of both cosines in the [table](super::angles).
    pub bins: [[u64; BATCH]; 3],
}

/// What the volumes of some tets say of all of them.
#[derive(Clone, Copy, Debug)]
pub struct Volumes {
    /// The sum of six times the volumes.
    pub sum6: f64,
    /// Whether all tets are positive beyond the rounding error bound.
    pub all_positive: bool,
}

/// What the shapes of some tets say of all of them.
#[derive(Clone, Copy, Debug)]
pub struct Measures {
    /// The worst shapes.
    pub extremes: Extremes,
    /// The sum of the mean ratios.
    pub sum_of_ratios: f64,
}

/// The worst shapes of some tets.
#[derive(Clone, Copy, Debug)]
pub struct Extremes {
    /// The smallest mean ratio.
    pub mean_ratio: f64,
    /// The largest cosine: that of the smallest angle.
    pub smallest: f64,
    /// The smallest cosine: that of the largest angle.
    pub largest: f64,
    /// The smallest scaled Jacobian of tets of second order; 1 for first order.
    pub scaled_jacobian: f64,
}

impl Extremes {
    /// The neutral element: no tet is better.
    pub const NONE: Self = Self { mean_ratio: 1.0, smallest: -1.0, largest: 1.0, scaled_jacobian: 1.0 };

    /// The extremes of the union of two sets of tets.
    pub fn with(self, other: Self) -> Self {
        Self {
            mean_ratio: self.mean_ratio.min(other.mean_ratio),
            smallest: self.smallest.max(other.smallest),
            largest: self.largest.min(other.largest),
            scaled_jacobian: self.scaled_jacobian.min(other.scaled_jacobian),
        }
    }
}

impl Default for Shapes {
    fn default() -> Self {
        let zero = [0.0; BATCH];
        let bins = [[0; BATCH]; 3];
        Self { volume6: zero, error: zero, mean_ratio: zero, smallest: zero, largest: zero, bins }
    }
}

impl Default for Batch {
    fn default() -> Self {
        Self { count: 0, corners: [[[0.0; BATCH]; 3]; 4], ids: [0; BATCH] }
    }
}

impl Batch {
    /// The number of tets.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether the batch is empty.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Whether the batch is full.
    pub fn is_full(&self) -> bool {
        self.count == BATCH
    }

    /// Empties the batch.
    pub fn clear(&mut self) {
        self.count = 0;
    }

    /// Adds a tet.
    ///
    /// # Panics
    /// If the batch is full.
    #[inline]
    pub fn push(&mut self, id: u64, corners: [[f64; 3]; 4]) {
        let lane = self.count;
        self.ids[lane] = id;
        for (axes, corner) in self.corners.iter_mut().zip(corners) {
            for (axis, coordinate) in axes.iter_mut().zip(corner) {
                axis[lane] = coordinate;
            }
        }
        self.count += 1;
    }

    /// The id of a tet.
    pub fn id(&self, lane: usize) -> u64 {
        self.ids[lane]
    }

    /// The corners of a tet.
    pub fn tet(&self, lane: usize) -> [Point; 4] {
        [0, 1, 2, 3].map(|k| Point::from([0, 1, 2].map(|x| self.corners[k][x][lane])))
    }

    /// The centroid of a tet.
    pub fn centroid(&self, lane: usize) -> [f64; 3] {
        let [p, q, r, s] = self.tet(lane).map(|p| p.coords);
        ((p + q + r + s) / 4.0).into()
    }

    #[inline(always)]
    fn edge(&self, from: usize, to: usize, lane: usize) -> [f64; 3] {
        // Written out: closures in `map` are not always inlined, and this is the innermost loop.
        let (p, q) = (&self.corners[from], &self.corners[to]);
        [q[0][lane] - p[0][lane], q[1][lane] - p[1][lane], q[2][lane] - p[2][lane]]
    }

    /// Computes volumes and their error bounds.
    pub fn volumes(&self, shapes: &mut Shapes) -> Volumes {
        wide(FindVolumes(self, shapes))
    }

    /// Whether a tet is positively oriented, exactly; after [`volumes`](Self::volumes).
    #[inline]
    pub fn is_positive(&self, shapes: &Shapes, lane: usize) -> bool {
        if shapes.volume6[lane] > shapes.error[lane] {
            return true;
        }
        let [p, q, r, s] = self.tet(lane);
        orient3d(&p, &q, &r, &s) == Sign::Positive
    }

    /// Computes mean ratios and dihedral angles; call [`volumes`](Self::volumes) first.
    pub fn shapes(&self, shapes: &mut Shapes) -> Measures {
        wide(Measure(self, shapes))
    }

    #[inline(always)]
    fn measure(&self, shapes: &mut Shapes) {
        for lane in 0..BATCH {
            let length = |p, q| square(self.edge(p, q, lane));
            let squares =
                length(0, 1) + length(0, 2) + length(0, 3) + length(1, 2) + length(1, 3) + length(2, 3);
            let half = 0.5 * shapes.volume6[lane];
            // 12 (6V/2)^⅔ / Σl² = 12 ((6V/2)² / (Σl²)³)^⅓; the argument of the root is
            // dimensionless.
            shapes.mean_ratio[lane] = half * half / (squares * squares * squares);
        }
        for lane in 0..BATCH {
            shapes.mean_ratio[lane] =
                (12.0 * cube_root(shapes.mean_ratio[lane])).copysign(shapes.volume6[lane]);
        }
        for lane in 0..BATCH {
            (shapes.smallest[lane], shapes.largest[lane]) = self.extreme_cosines(lane);
        }
    }

    /// The cosines of the smallest and largest dihedral angle.
    #[inline(always)]
    fn extreme_cosines(&self, lane: usize) -> (f64, f64) {
        let [u, v, w] = [self.edge(0, 1, lane), self.edge(0, 2, lane), self.edge(0, 3, lane)];
        let opposite = [self.edge(1, 2, lane), self.edge(1, 3, lane)];
        // Outward normals, each of the face opposite its corner.
        let normals = [cross(opposite[0], opposite[1]), cross(w, v), cross(u, w), cross(v, u)];
        // Divisions and roots take long. Squares of cosines with the sign of the cosine are in the
        // same order, so only the extremes need a root; two inverses take one division.
        let squares = [square(normals[0]), square(normals[1]), square(normals[2]), square(normals[3])];
        let (first, last) = (1.0 / (squares[0] * squares[1]), 1.0 / (squares[2] * squares[3]));
        let inverse = [first * squares[1], first * squares[0], last * squares[3], last * squares[2]];
        let signed = |p: usize, q: usize| {
            let product = -dot(normals[p], normals[q]);
            product * product.abs() * (inverse[p] * inverse[q])
        };
        let [a, b, c] = [signed(0, 1), signed(0, 2), signed(0, 3)];
        let [d, e, f] = [signed(1, 2), signed(1, 3), signed(2, 3)];
        let more = |p: f64, q: f64| if q > p { q } else { p };
        let less = |p: f64, q: f64| if q < p { q } else { p };
        let most = more(more(more(a, b), more(c, d)), more(e, f));
        let least = less(less(less(a, b), less(c, d)), less(e, f));
        (most.abs().sqrt().copysign(most), least.abs().sqrt().copysign(least))
    }
}

struct FindVolumes<'a>(&'a Batch, &'a mut Shapes);

impl Wide for FindVolumes<'_> {
    type Output = Volumes;

    #[inline(always)]
    fn run(self) -> Volumes {
        let Self(batch, shapes) = self;
        for lane in 0..BATCH {
            let edges = [batch.edge(0, 1, lane), batch.edge(0, 2, lane), batch.edge(0, 3, lane)];
            (shapes.volume6[lane], shapes.error[lane]) = volume6_and_error(edges);
        }
        // The unused lanes count as positive and add nothing.
        shapes.volume6[batch.count..].fill(0.0);
        shapes.error[batch.count..].fill(-1.0);
        let mut all_positive = true;
        for lane in 0..BATCH {
            all_positive &= shapes.volume6[lane] > shapes.error[lane];
        }
        Volumes { sum6: sum(&shapes.volume6), all_positive }
    }
}

struct Measure<'a>(&'a Batch, &'a mut Shapes);

impl Wide for Measure<'_> {
    type Output = Measures;

    #[inline(always)]
    fn run(self) -> Measures {
        let Self(batch, shapes) = self;
        batch.measure(shapes);
        shapes.mean_ratio[batch.count..].fill(0.0);
        let sum_of_ratios = sum(&shapes.mean_ratio);
        let [ratios, smallest, largest] = &mut shapes.bins;
        for lane in 0..BATCH {
            ratios[lane] = bin(shapes.mean_ratio[lane]);
            smallest[lane] = angles::cell(shapes.smallest[lane]);
            largest[lane] = angles::cell(shapes.largest[lane]);
        }
        // Fill the unused lanes with copies of the first tet, which do not change the extremes.
        for lane in batch.count..BATCH {
            shapes.mean_ratio[lane] = shapes.mean_ratio[0];
            shapes.smallest[lane] = shapes.smallest[0];
            shapes.largest[lane] = shapes.largest[0];
        }
        let extremes = Extremes {
            mean_ratio: least(&shapes.mean_ratio, 1.0),
            smallest: -least(&shapes.smallest, -1.0),
            largest: least(&shapes.largest, 1.0),
            scaled_jacobian: 1.0,
        };
        Measures { extremes, sum_of_ratios }
    }
}

/// The bin of a mean ratio.
#[inline(always)]
fn bin(ratio: f64) -> u64 {
    angles::whole(ratio * RATIO_BINS as f64, (RATIO_BINS - 1) as f64)
}

/// The sum of some numbers.
#[inline(always)]
fn sum(numbers: &[f64; BATCH]) -> f64 {
    let mut sums = [0.0; 8];
    for chunk in numbers.as_chunks::<8>().0 {
        for lane in 0..8 {
            sums[lane] += chunk[lane];
        }
    }
    sums.into_iter().sum()
}

/// The minimum of some numbers, each multiplied by a sign.
#[inline(always)]
fn least(numbers: &[f64; BATCH], sign: f64) -> f64 {
    let mut least = [f64::INFINITY; 8];
    for chunk in numbers.as_chunks::<8>().0 {
        for lane in 0..8 {
            let number = sign * chunk[lane];
            least[lane] = if number < least[lane] { number } else { least[lane] };
        }
    }
    least.into_iter().fold(f64::INFINITY, f64::min)
}

#[inline(always)]
fn dot(p: [f64; 3], q: [f64; 3]) -> f64 {
    p[0] * q[0] + p[1] * q[1] + p[2] * q[2]
}

#[inline(always)]
fn square(p: [f64; 3]) -> f64 {
    dot(p, p)
}

#[inline(always)]
fn cross(p: [f64; 3], q: [f64; 3]) -> [f64; 3] {
    [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]]
}

/// The cube root of a nonnegative number, with relative error below 10⁻¹⁵ (zero below 10⁻²⁹⁰).
///
/// Avoids divisions by computing the inverse root y. The first guess, from a third of the exponent
/// bits, is within 5 %. Multiplying by (1 − r)^(−1/3) with r = 1 − xy³, expanded up to r³, turns an
/// error e into O(e⁴). A final Newton step for the root itself removes the rounding errors.
#[inline(always)]
fn cube_root(x: f64) -> f64 {
    /// Four thirds of the exponent bias, minus a correction that halves the worst error.
    const BIAS: u64 = 0x553E_F0FF_289D_D796;
    /// 2³²/3: the lower half of the bits does not matter for the first guess.
    const THIRD: u64 = 0x5555_5556;
    let mut inverse = f64::from_bits(BIAS.wrapping_sub((x.to_bits() >> 32).wrapping_mul(THIRD)));
    for _ in 0..2 {
        let r = 1.0 - x * (inverse * inverse * inverse);
        inverse += inverse * r * (1.0 / 3.0 + r * (2.0 / 9.0 + r * (14.0 / 81.0)));
    }
    let slope = inverse * inverse;
    let root = x * slope;
    let root = root - (root * root * root - x) * (1.0 / 3.0) * slope;
    // Below this the cubes of the iteration underflow.
    if x > 1e-290 { root } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::kernel::quality::mean_ratio;
    use crate::ground::kernel::simplex::{dihedral_angles, volume6};
    use proptest::prelude::*;

    #[test]
    fn cube_roots_are_those_of_the_standard_library() {
        for k in 1..4000 {
            let x = 1.01_f64.powi(k - 4000);
            assert!((cube_root(x) / x.cbrt() - 1.0).abs() < 1e-15, "{x}");
        }
        assert_eq!(cube_root(0.0), 0.0);
    }

    proptest! {
        #[test]
        fn a_batch_measures_what_the_kernel_measures(p in prop::array::uniform4(prop::array::uniform3(-1.0..1.0))) {
            let points = p.map(Point::from);
            let [a, b, c, d] = &points;
            prop_assume!(volume6(a, b, c, d).abs() > 1e-3);
            let (mut batch, mut shapes) = (Batch::default(), Shapes::default());
            batch.push(7, p);
            batch.volumes(&mut shapes);
            batch.shapes(&mut shapes);
            prop_assert!((shapes.volume6[0] - volume6(a, b, c, d)).abs() < 1e-14);
            prop_assert!((shapes.mean_ratio[0] - mean_ratio(a, b, c, d)).abs() < 1e-13);
            let positive = volume6(a, b, c, d) > 0.0;
            prop_assert_eq!(batch.is_positive(&shapes, 0), positive);
            if positive {
                let angles = dihedral_angles(&points);
                let smallest = angles.iter().copied().fold(180.0, f64::min);
                let largest = angles.iter().copied().fold(0.0, f64::max);
                prop_assert!((shapes.smallest[0].acos().to_degrees() - smallest).abs() < 1e-6);
                prop_assert!((shapes.largest[0].acos().to_degrees() - largest).abs() < 1e-6);
            }
        }
    }
}
