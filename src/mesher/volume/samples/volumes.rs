//! Exact volumes, so that volumes can be compared by equality.

use super::{BodyId, Point};
use std::collections::BTreeMap;

/// Tolerance for underflow: products of coordinates of 10⁻¹⁰⁰ and less underflow, each with an
/// error up to 10⁻³²³.
const UNDERFLOW: f64 = 1e-300;

/// An exact sum, as an expansion of non-overlapping floating-point numbers in ascending order
/// (Shewchuk 1997, section 2.4).
#[derive(Clone, Debug, Default)]
pub struct ExactSum(Vec<f64>);

impl ExactSum {
    /// Adds a number.
    pub fn add(&mut self, mut x: f64) {
        let mut kept = 0;
        for k in 0..self.0.len() {
            let (sum, error) = two_sum(x, self.0[k]);
            if error != 0.0 {
                self.0[kept] = error;
                kept += 1;
            }
            x = sum;
        }
        self.0.truncate(kept);
        if x != 0.0 {
            self.0.push(x);
        }
    }

    /// Adds a product of three numbers.
    fn add_product(&mut self, x: f64, y: f64, z: f64) {
        let (high, low) = two_product(x, y);
        for part in [high, low] {
            let (high, low) = two_product(part, z);
            self.add(high);
            self.add(low);
        }
    }

    /// Adds six times the signed volume of the tet of the origin and a triangle.
    ///
    /// The volume of a tet is the sum over its outward faces, so faces between two tets cancel.
    pub fn add_cone(&mut self, sign: f64, [a, b, c]: [&Point; 3]) {
        for k in 0..3 {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            self.add_product(sign * a[k], b[i], c[j]);
            self.add_product(-sign * a[k], b[j], c[i]);
        }
    }

    /// The sum, rounded.
    pub fn value(&self) -> f64 {
        self.0.iter().sum()
    }

    /// Whether the sums are equal up to [`UNDERFLOW`].
    pub fn equals(&self, other: &Self) -> bool {
        let mut difference = self.clone();
        other.0.iter().for_each(|x| difference.add(-x));
        difference.value().abs() <= UNDERFLOW
    }
}

/// The rounded sum and its rounding error (Knuth).
fn two_sum(x: f64, y: f64) -> (f64, f64) {
    let sum = x + y;
    let from_y = sum - x;
    (sum, (x - (sum - from_y)) + (y - from_y))
}

/// The rounded product and its rounding error.
fn two_product(x: f64, y: f64) -> (f64, f64) {
    let product = x * y;
    (product, x.mul_add(y, -product))
}

/// Six times the volume of each body, by its tets.
pub fn volumes_by_tets<'a>(
    points: &[Point],
    tets: impl Iterator<Item = (&'a [u32; 4], BodyId)>,
) -> BTreeMap<BodyId, ExactSum> {
    let mut volumes = BTreeMap::<BodyId, ExactSum>::new();
    for (tet, body) in tets {
        let [a, b, c, d] = tet.map(|v| &points[v as usize]);
        let volume = volumes.entry(body).or_default();
        [[b, c, d], [a, d, c], [a, b, d], [a, c, b]].into_iter().for_each(|face| volume.add_cone(1.0, face));
    }
    volumes
}

/// Six times the volume of each body, by its boundary triangles.
pub fn volumes_by_surface(
    points: &[Point],
    triangles: &[[u32; 3]],
    regions: &[[Option<BodyId>; 2]],
) -> BTreeMap<BodyId, ExactSum> {
    let mut volumes = BTreeMap::<BodyId, ExactSum>::new();
    for (triangle, [behind, front]) in triangles.iter().zip(regions) {
        let corners = triangle.map(|v| &points[v as usize]);
        for (region, sign) in [(behind, 1.0), (front, -1.0)] {
            if let Some(body) = region {
                volumes.entry(*body).or_default().add_cone(sign, corners);
            }
        }
    }
    volumes
}

/// Asserts that both have the same bodies with exactly the same volumes.
pub fn assert_same_volumes(what: &str, one: &BTreeMap<BodyId, ExactSum>, other: &BTreeMap<BodyId, ExactSum>) {
    assert!(one.keys().eq(other.keys()), "{what}: bodies {:?} and {:?}", one.keys(), other.keys());
    for (body, volume) in one {
        let [v, w] = [volume, &other[body]].map(|sum| sum.value() / 6.0);
        assert!(volume.equals(&other[body]), "{what}: body {body:?} has volumes {v} and {w}");
    }
}
