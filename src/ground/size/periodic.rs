//! Sizes that are equal at a point and at its periodic copies.

use super::SizeField;
use crate::Point;
use crate::ground::progress::Work;
use csg::{Aabb, Features};
use nalgebra::Isometry3;

/// The minimum of a size field over a point and its periodic copies.
///
/// The copies are made by the motions of all identifications, their inverses and, with up to three
/// identifications, their products. Without products, an edge of a periodic cell and the diagonally
/// opposite one could have different sizes.
pub struct PeriodicSize<'a> {
    inner: &'a dyn SizeField,
    motions: Vec<Isometry3<f64>>,
    bounds: Aabb,
    grading: f64,
}

/// With more identifications, products of motions are not used because there would be too many.
const MOST_WITH_PRODUCTS: usize = 3;

impl<'a> PeriodicSize<'a> {
    /// Wraps `inner`, which must grow by at least `grading` per unit of distance outside the
    /// bounds.
    pub fn new(inner: &'a dyn SizeField, features: &Features, grading: f64) -> Self {
        let steps = features.identified.iter().map(|identified| identified.motion);
        let mut motions = vec![Isometry3::identity()];
        let with_products = features.identified.len() <= MOST_WITH_PRODUCTS;
        for step in steps {
            let known = if with_products { motions.clone() } else { vec![Isometry3::identity()] };
            motions.extend(known.into_iter().flat_map(|motion| [step * motion, step.inverse() * motion]));
        }
        motions.remove(0);
        Self { inner, motions, bounds: features.bounds, grading }
    }
}

impl SizeField for PeriodicSize<'_> {
    fn work(&self) -> &Work<'_> {
        self.inner.work()
    }

    fn size_at(&self, point: &Point) -> f64 {
        let own = self.inner.size_at(point);
        self.motions.iter().fold(own, |size, motion| {
            let copy = motion * point;
            let nearest = copy.coords.sup(&self.bounds.min.coords).inf(&self.bounds.max.coords);
            // Far outside the bounds, the field cannot be below `size`.
            if self.grading * (copy.coords - nearest).norm() >= size {
                return size;
            }
            size.min(self.inner.size_at(&copy))
        })
    }
}
