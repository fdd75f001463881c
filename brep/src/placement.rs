//! Similarity transforms, by which shapes of a file are placed.

use crate::{Point, Vector};
use nalgebra::Matrix3;
use std::collections::HashMap;

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

impl Placement {
    /// Whether two placements are equal up to rounding.
    pub(crate) fn is_close(&self, other: &Self) -> bool {
        let size = 1.0 + self.shift.amax().max(other.shift.amax());
        (self.linear - other.linear).amax() <= CLOSE && (self.shift - other.shift).amax() <= CLOSE * size
    }
}

/// Placements that differ by at most this, relative to their shifts, are equal.
const CLOSE: f64 = 1e-9;

/// Placements, of which those that are equal up to rounding are one.
#[derive(Default)]
pub(crate) struct Placements {
    /// By a weighted sum of their numbers, in cells far wider than rounding.
    cells: HashMap<i64, Vec<Placement>>,
}

impl Placements {
    /// The weights of the sum.
    const WEIGHTS: [f64; 12] = [1.0, 0.71, 0.37, 0.83, 0.59, 0.13, 0.91, 0.47, 0.29, 0.67, 0.19, 0.53];
    /// The width of a cell, relative to the shifts.
    const WIDTH: f64 = 1e-6;
    /// Placements that are compared in each cell: hostile files could put all into one.
    const MOST: usize = 64;

    /// The first placement that was equal to this one.
    pub fn only(&mut self, placement: Placement) -> Placement {
        let numbers = placement.linear.iter().chain(placement.shift.iter());
        let sum: f64 = numbers.zip(Self::WEIGHTS).map(|(x, weight)| x * weight).sum();
        // Cells have one width for all shifts of about one size; no round number divides sizes.
        let size = ((1.0 + placement.shift.amax()).log2() + 0.2345).floor().exp2();
        let cell = (sum / (Self::WIDTH * size)).floor() as i64;
        let near = [cell, cell.saturating_sub(1), cell.saturating_add(1)];
        let known =
            near.iter().filter_map(|cell| self.cells.get(cell)).flat_map(|all| all.iter().take(Self::MOST));
        if let Some(known) = known.into_iter().find(|known| known.is_close(&placement)) {
            return *known;
        }
        self.cells.entry(cell).or_default().push(placement);
        placement
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn placements_equal_up_to_rounding_are_one_and_others_are_not() {
        let mut placements = Placements::default();
        let at = |x: f64| Placement { shift: Vector::new(x, -0.5 * x, 1.0), ..Placement::IDENTITY };
        for k in 0..2000 {
            let x = 0.25 * f64::from(k);
            let first = at(x);
            assert_eq!(placements.only(first), first, "{x}");
            for off in [-1.0, 1.0] {
                assert_eq!(placements.only(at(x + off * 1e-13 * (1.0 + x))), first, "{x}");
            }
        }
    }
}
