//! Sizes that are the same at a place and at its images.

use super::SizeField;
use crate::Point;
use crate::ground::progress::Work;
use csg::{Aabb, Features};
use nalgebra::Isometry3;

/// The least of the sizes that another field gives at a place and at its images under the motions of all identifications, their
/// inverses and, up to three identifications, their products: so the fourth edge of a cell knows what the first wants.
pub struct PeriodicSize<'a> {
    inner: &'a dyn SizeField,
    motions: Vec<Isometry3<f64>>,
    bounds: Aabb,
    grading: f64,
}

/// With more identifications than this, places are moved by one of them at a time: the products would be too many.
const MOST_WITH_PRODUCTS: usize = 3;

impl<'a> PeriodicSize<'a> {
    /// `inner` grows by `grading` per unit of distance outside the bodies.
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
            let image = motion * point;
            let nearest = image.coords.sup(&self.bounds.min.coords).inf(&self.bounds.max.coords);
            // Far outside no field asks for less.
            if self.grading * (image.coords - nearest).norm() >= size {
                return size;
            }
            size.min(self.inner.size_at(&image))
        })
    }
}
