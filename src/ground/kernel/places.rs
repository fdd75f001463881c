//! Lookup of points by position.

use crate::Point;
use std::collections::HashMap;

/// Points in a grid whose cells are as wide as the distance up to which points are equal.
#[derive(Debug)]
pub struct Places {
    distance: f64,
    cells: HashMap<[i64; 3], Vec<(u32, Point)>>,
}

impl Places {
    /// Stores points with their numbers; points within `distance` (length) are equal.
    pub fn new(points: impl IntoIterator<Item = (u32, Point)>, distance: f64) -> Self {
        let mut places = Self { distance, cells: HashMap::new() };
        for (number, point) in points {
            places.cells.entry(places.cell(&point)).or_default().push((number, point));
        }
        places
    }

    fn cell(&self, point: &Point) -> [i64; 3] {
        [0, 1, 2].map(|axis| (point[axis] / self.distance).floor() as i64)
    }

    /// The number of the nearest point within the distance; the smallest number on ties.
    pub fn find(&self, at: &Point) -> Option<u32> {
        let cell = self.cell(at);
        let cells = (0..27).map(|i| [0, 1, 2].map(|axis| cell[axis] + i / [1, 3, 9][axis] % 3 - 1));
        let near = cells.filter_map(|cell| self.cells.get(&cell)).flatten();
        near.map(|&(number, point)| ((point - at).norm(), number))
            .filter(|(distance, _)| *distance <= self.distance)
            .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
            .map(|(_, number)| number)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_is_found_across_the_border_of_its_cell_and_not_further() {
        let places = Places::new([(7, Point::new(0.999, 1.0, -2.0)), (8, Point::new(5.0, 5.0, 5.0))], 0.01);
        assert_eq!(places.find(&Point::new(1.001, 1.001, -2.003)), Some(7));
        assert_eq!(places.find(&Point::new(1.012, 1.0, -2.0)), None);
    }
}
