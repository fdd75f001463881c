//! Merges points with equal coordinates.

use crate::Point;
use crate::ground::kernel::random::mix;

/// Numbers points in order of first appearance: an open-addressing hash table of indices.
#[derive(Default)]
pub(super) struct Merger {
    points: Vec<Point>,
    /// Index of a point, or [`FREE`]; the length is a power of two, and at most half are used.
    slots: Vec<u32>,
}

const FREE: u32 = u32::MAX;

impl Merger {
    /// Returns the number of this point; `None` if there are too many points.
    pub fn number(&mut self, point: Point) -> Option<u32> {
        if 2 * (self.points.len() + 1) > self.slots.len() {
            self.grow();
        }
        let mask = self.slots.len() - 1;
        let mut slot = hash(&point) & mask;
        loop {
            match self.slots[slot] {
                FREE => break,
                index if self.points[index as usize] == point => return Some(index),
                _ => slot = (slot + 1) & mask,
            }
        }
        let index = u32::try_from(self.points.len()).ok().filter(|&index| index != FREE)?;
        self.slots[slot] = index;
        self.points.push(point);
        Some(index)
    }

    /// The points in order of their numbers.
    pub fn into_points(self) -> Vec<Point> {
        self.points
    }

    fn grow(&mut self) {
        const LEAST: usize = 1 << 10;
        let size = (2 * self.slots.len()).max(LEAST);
        self.slots = vec![FREE; size];
        for (index, point) in (0..).zip(&self.points) {
            let mut slot = hash(point) & (size - 1);
            while self.slots[slot] != FREE {
                slot = (slot + 1) & (size - 1);
            }
            self.slots[slot] = index;
        }
    }
}

/// Hashes a point; coordinates must not be −0, which equals 0 but has other bits.
fn hash(p: &Point) -> usize {
    let [x, y, z] = [p.x, p.y, p.z].map(f64::to_bits);
    mix(x ^ mix(y ^ mix(z))) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_place_has_one_number_in_order_of_appearance() {
        let mut merger = Merger::default();
        let place = |k: u32| Point::new(f64::from(k % 1000), 0.5, -1.0);
        for k in 0..5000 {
            assert_eq!(merger.number(place(k)), Some(k % 1000));
        }
        assert_eq!(merger.into_points(), (0..1000).map(place).collect::<Vec<_>>());
    }
}
