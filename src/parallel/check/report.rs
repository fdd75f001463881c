//! The results of a check, as plain data that can be merged.

use super::Fault;
use super::angles::DEGREES;
use crate::ground::mesh::GlobalId;
use csg::BodyId;
use serde::{Deserialize, Serialize};

/// JSON has no NaN or infinity: they are written as null, and read as NaN.
pub(super) mod lenient {
    use serde::{Deserialize, Deserializer};

    pub fn number<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
        Ok(Option::deserialize(from)?.unwrap_or(f64::NAN))
    }

    pub fn place<'de, D: Deserializer<'de>>(from: D) -> Result<[f64; 3], D::Error> {
        Ok(<[Option<f64>; 3]>::deserialize(from)?.map(|x| x.unwrap_or(f64::NAN)))
    }

    pub fn numbers<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<f64>, D::Error> {
        Ok(Vec::<Option<f64>>::deserialize(from)?.into_iter().map(|x| x.unwrap_or(f64::NAN)).collect())
    }
}

/// An extreme value, and its tet.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Extreme {
    /// The value.
    #[serde(deserialize_with = "lenient::number")]
    pub value: f64,
    /// The global id of the tet, the lowest on ties.
    pub tet: GlobalId,
    /// Its centroid.
    #[serde(deserialize_with = "lenient::place")]
    pub place: [f64; 3],
}

impl Extreme {
    /// The smaller of two.
    pub(super) fn least(self, other: Self) -> Self {
        let first = self.value < other.value || self.value == other.value && self.tet <= other.tet;
        if first { self } else { other }
    }

    /// The larger of two.
    fn greatest(self, other: Self) -> Self {
        let first = self.value > other.value || self.value == other.value && self.tet <= other.tet;
        if first { self } else { other }
    }
}

/// The dihedral angle of the regular tet, acos(1/3) in degrees: every tet has an angle at most this
/// large and one at least this large.
const REGULAR_ANGLE: f64 = 70.528_779_365_509_31;

/// Bins of the mean ratio from 0 to 1.
pub const RATIO_BINS: usize = 200;

/// Shape statistics of tets.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ShapeReport {
    /// The worst mean ratio.
    pub worst_ratio: Extreme,
    /// The sum of the mean ratios.
    #[serde(deserialize_with = "lenient::number")]
    pub sum_of_ratios: f64,
    /// The smallest dihedral angle, degrees.
    pub smallest_angle: Extreme,
    /// The largest dihedral angle, degrees.
    pub largest_angle: Extreme,
    /// Tets by mean ratio: 0 to 0.005 (and below), 0.005 to 0.01, ….
    pub ratios: Vec<u64>,
    /// Tets by the whole degrees of their smallest dihedral angle.
    pub smallest_angles: Vec<u64>,
    /// Tets by the whole degrees of their largest dihedral angle.
    pub largest_angles: Vec<u64>,
}

impl ShapeReport {
    /// Statistics with these extremes, and no tet counted yet.
    pub fn of(worst_ratio: Extreme, smallest_angle: Extreme, largest_angle: Extreme) -> Self {
        Self {
            worst_ratio,
            sum_of_ratios: 0.0,
            smallest_angle,
            largest_angle,
            ratios: vec![0; RATIO_BINS],
            smallest_angles: vec![0; DEGREES],
            largest_angles: vec![0; DEGREES],
        }
    }

    /// The percentile of the tets' smallest dihedral angles (degrees), linear within a bin of one
    /// degree and never below the smallest.
    pub fn smallest_angle_percentile(&self, fraction: f64) -> f64 {
        percentile(&self.smallest_angles, 1.0, [self.smallest_angle.value, REGULAR_ANGLE], fraction)
    }

    /// The percentile of the tets' largest dihedral angles (degrees), linear within a bin of one
    /// degree and never above the largest.
    pub fn largest_angle_percentile(&self, fraction: f64) -> f64 {
        percentile(&self.largest_angles, 1.0, [REGULAR_ANGLE, self.largest_angle.value], fraction)
    }

    /// The percentile of the mean ratios, linear within a bin of 0.005 and never below the worst.
    pub fn ratio_percentile(&self, fraction: f64) -> f64 {
        percentile(&self.ratios, 1.0 / RATIO_BINS as f64, [self.worst_ratio.value, 1.0], fraction)
    }

    /// The mean of the mean ratios.
    pub fn mean_ratio(&self) -> f64 {
        self.sum_of_ratios / self.ratios.iter().sum::<u64>() as f64
    }

    /// Merges the extremes.
    pub fn take_extremes(&mut self, worst_ratio: Extreme, smallest_angle: Extreme, largest_angle: Extreme) {
        self.worst_ratio = self.worst_ratio.least(worst_ratio);
        self.smallest_angle = self.smallest_angle.least(smallest_angle);
        self.largest_angle = self.largest_angle.greatest(largest_angle);
    }

    fn merge(&mut self, other: &Self) {
        self.take_extremes(other.worst_ratio, other.smallest_angle, other.largest_angle);
        self.sum_of_ratios += other.sum_of_ratios;
        let bins = [
            (&mut self.ratios, &other.ratios),
            (&mut self.smallest_angles, &other.smallest_angles),
            (&mut self.largest_angles, &other.largest_angles),
        ];
        for (mine, others) in bins {
            mine.iter_mut().zip(others).for_each(|(m, o)| *m += o);
        }
    }
}

/// The percentile of values counted in bins of a given width. The bins at the ends are cut by the
/// known range of the values, because the bound of a bin alone may be outside it.
fn percentile(bins: &[u64], width: f64, [least, greatest]: [f64; 2], fraction: f64) -> f64 {
    let wanted = fraction * bins.iter().sum::<u64>() as f64;
    let mut below = 0.0;
    for (bin, &count) in bins.iter().enumerate() {
        if count > 0 && below + count as f64 >= wanted {
            let lower = (bin as f64 * width).max(least);
            let upper = ((bin + 1) as f64 * width).min(greatest).max(lower);
            return lower + (upper - lower) * ((wanted - below) / count as f64);
        }
        below += count as f64;
    }
    greatest
}

/// The boundary vertex furthest from its patch.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct OffSurface {
    /// Its distance (length).
    #[serde(deserialize_with = "lenient::number")]
    pub distance: f64,
    /// Its global id, the lowest on ties.
    pub vertex: GlobalId,
    /// The patch, as an index.
    pub patch: u32,
    /// Its position.
    #[serde(deserialize_with = "lenient::place")]
    pub place: [f64; 3],
}

impl OffSurface {
    /// The one at the larger distance.
    pub fn further(self, other: Self) -> Self {
        let key = |o: &Self| (o.vertex, o.patch);
        let first =
            self.distance > other.distance || self.distance == other.distance && key(&self) <= key(&other);
        if first { self } else { other }
    }
}

/// The results of checking one or several parts.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PartReport {
    /// The number of vertices, counted by their owners.
    pub vertices: u64,
    /// The number of tets.
    pub tets: u64,
    /// The number of boundary triangles, counted with the tet behind them.
    pub boundary: u64,
    /// The sum of the volumes of the tets.
    #[serde(deserialize_with = "lenient::number")]
    pub volume: f64,
    /// The sum of the volumes for each body, by index.
    #[serde(deserialize_with = "lenient::numbers")]
    pub body_volumes: Vec<f64>,
    /// The number of faults. A vertex off its patch counts on each rank that shares it.
    pub faults: u64,
    /// The first faults.
    pub described: Vec<Fault>,
    /// The shapes of the tets; absent if there are none or shapes were not requested.
    pub shape: Option<ShapeReport>,
    /// The smallest scaled Jacobian of the tets; absent for first order.
    #[serde(default)]
    pub scaled_jacobian: Option<Extreme>,
    /// The boundary vertex furthest from its patch; absent without boundary vertices or geometry.
    pub furthest: Option<OffSurface>,
}

/// The one that is there, or that of two which `choose` returns.
fn either<T>(mine: Option<T>, others: Option<T>, choose: fn(T, T) -> T) -> Option<T> {
    match (mine, others) {
        (Some(mine), Some(others)) => Some(choose(mine, others)),
        (mine, others) => mine.or(others),
    }
}

impl PartReport {
    /// Adds to the volume of the mesh, and to that of a body.
    pub(super) fn add_volume(&mut self, body: Option<BodyId>, volume: f64) {
        self.volume += volume;
        if let Some(body) = body {
            if self.body_volumes.len() <= body.index() {
                self.body_volumes.resize(body.index() + 1, 0.0);
            }
            self.body_volumes[body.index()] += volume;
        }
    }

    /// Merges the results of another part, which comes after this one.
    ///
    /// Associative except for the rounding of the sums of volumes and mean ratios.
    #[must_use]
    pub fn merged(mut self, other: Self, described: usize) -> Self {
        self.vertices += other.vertices;
        self.tets += other.tets;
        self.boundary += other.boundary;
        self.volume += other.volume;
        if self.body_volumes.len() < other.body_volumes.len() {
            self.body_volumes.resize(other.body_volumes.len(), 0.0);
        }
        self.body_volumes.iter_mut().zip(&other.body_volumes).for_each(|(m, o)| *m += o);
        self.faults += other.faults;
        self.described.extend(other.described);
        self.described.truncate(described);
        match (&mut self.shape, other.shape) {
            (Some(mine), Some(others)) => mine.merge(&others),
            (mine, others) => *mine = mine.take().or(others),
        }
        self.scaled_jacobian = either(self.scaled_jacobian, other.scaled_jacobian, Extreme::least);
        self.furthest = either(self.furthest, other.furthest, OffSurface::further);
        self
    }

    /// Counts a fault; only the first `described` are stored.
    pub fn add_fault(&mut self, fault: Fault, described: usize) {
        self.faults += 1;
        if self.described.len() < described {
            self.described.push(fault);
        }
    }

    /// The mean of the mean ratios.
    pub fn mean_ratio(&self) -> Option<f64> {
        self.shape.as_ref().map(|shape| shape.sum_of_ratios / self.tets as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn extreme(value: f64) -> Extreme {
        Extreme { value, tet: 0, place: [0.0; 3] }
    }

    /// Statistics of several tets of the same shape.
    fn alike(count: u64, ratio: f64, smallest: f64, largest: f64) -> ShapeReport {
        let mut shape = ShapeReport::of(extreme(ratio), extreme(smallest), extreme(largest));
        shape.ratios[((ratio * RATIO_BINS as f64) as usize).min(RATIO_BINS - 1)] = count;
        shape.smallest_angles[smallest as usize] = count;
        shape.largest_angles[largest as usize] = count;
        shape
    }

    #[test]
    fn percentiles_stay_between_the_extremes() {
        // The values are near the upper, then near the lower bound of their bins; the last is the
        // regular tet.
        for (ratio, smallest, largest) in
            [(0.1049, 23.9, 130.9), (0.1001, 23.1, 130.1), (1.0, REGULAR_ANGLE, REGULAR_ANGLE)]
        {
            let shape = alike(1000, ratio, smallest, largest);
            for fraction in [0.0, 0.01, 0.5, 0.99, 1.0] {
                let found = shape.smallest_angle_percentile(fraction);
                assert!((smallest..=REGULAR_ANGLE).contains(&found), "{fraction} of {smallest}: {found}");
                let found = shape.largest_angle_percentile(fraction);
                assert!((REGULAR_ANGLE..=largest).contains(&found), "{fraction} of {largest}: {found}");
                let found = shape.ratio_percentile(fraction);
                assert!((ratio..=1.0).contains(&found), "{fraction} of {ratio}: {found}");
            }
        }
    }

    #[test]
    fn percentiles_are_linear_within_the_part_of_a_bin_that_is_in_use() {
        let mut shape = alike(50, 0.5, 20.5, 100.0);
        shape.smallest_angles[30] = 50;
        assert_eq!(shape.smallest_angle_percentile(0.25), 20.75);
        assert_eq!(shape.smallest_angle_percentile(0.75), 30.5);
    }
}
