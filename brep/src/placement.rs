//! Similarity transforms, by which shapes of a file are placed.

use crate::{Point, Vector};
use nalgebra::Matrix3;

/// A similarity transform: a rotation, a uniform scale, perhaps a reflection, then a shift.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// The linear part.
    pub linear: Matrix3<f64>,
    /// The image of the origin.
    pub shift: Vector,
}

impl Placement {
    /// The transform that moves nothing.
    pub const IDENTITY: Self = Self {
        linear: Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
        shift: Vector::new(0.0, 0.0, 0.0),
    };

    /// This transform after `first`.
    pub fn after(&self, first: &Self) -> Self {
        if *self == Self::IDENTITY {
            return *first;
        }
        Self { linear: self.linear * first.linear, shift: self.linear * first.shift + self.shift }
    }

    /// The inverse; `None` if the linear part is singular.
    pub fn inverse(&self) -> Option<Self> {
        let linear = self.linear.try_inverse()?;
        Some(Self { linear, shift: -(linear * self.shift) })
    }

    /// The image of a point.
    pub fn point(&self, point: &Point) -> Point {
        Point::from(self.linear * point.coords + self.shift)
    }

    /// The image of a vector.
    pub fn vector(&self, vector: &Vector) -> Vector {
        self.linear * vector
    }

    /// The factor on lengths.
    pub fn scale(&self) -> f64 {
        self.linear.determinant().abs().cbrt()
    }

    /// Whether it is a reflection.
    pub fn is_mirrored(&self) -> bool {
        self.linear.determinant() < 0.0
    }

    /// Whether angles are kept, up to a relative error of 10⁻⁶.
    pub fn is_similarity(&self) -> bool {
        let scale = self.scale();
        let gram = self.linear.transpose() * self.linear - Matrix3::identity() * (scale * scale);
        scale > 0.0 && scale.is_finite() && gram.amax() <= 1e-6 * scale * scale
    }

    /// The bits of all numbers, by which equal placements are recognised; −0 counts as 0.
    pub fn bits(&self) -> [u64; 12] {
        let mut bits = [0; 12];
        for (bit, x) in bits.iter_mut().zip(self.linear.iter().chain(self.shift.iter())) {
            *bit = (x + 0.0).to_bits();
        }
        bits
    }
}
