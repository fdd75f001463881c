//! The points of TetGen's formats: a `.node` file, or the first section of `.poly` and `.smesh`.

use super::{Fault, Words};
use crate::Point;

/// Points, and the index of the first one, 0 or 1, from which all indices count.
pub(crate) struct Nodes {
    /// The index of the first point.
    pub base: i64,
    /// The points in order.
    pub points: Vec<Point>,
}

/// Parses `count dimension [attributes [marker]]` and the points; attributes and markers are
/// skipped.
pub(crate) fn read(words: &mut Words) -> Result<Nodes, Fault> {
    let count = words.count("points", 4)?;
    if words.next_in_line().is_some_and(|dimension| dimension != b"3") {
        return Err(words.fault("the dimension of the points is not 3"));
    }
    words.rest_of_line();
    let mut nodes = Nodes { base: 1, points: Vec::with_capacity(count) };
    for k in 0..count {
        let number = words.int("the number of a point")?;
        if k == 0 {
            nodes.base = number;
            if !(0..=1).contains(&number) {
                return Err(
                    words.fault(format!("the first point has the number {number}; 0 or 1 is expected"))
                );
            }
        } else if number != nodes.base + k as i64 {
            return Err(words.fault(format!("expected point {}, found {number}", nodes.base + k as i64)));
        }
        nodes.points.push(words.point("a coordinate")?);
        words.rest_of_line();
    }
    Ok(nodes)
}
