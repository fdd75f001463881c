//! Sides of a loop that cross beside their common corner, because its places on both differ by the
//! accuracy of the file.

use super::chain::Chain;
use super::measure::from_segment;
use crate::Point;

/// At most so many segments of each side are tried.
const TRIED: usize = 64;

type Parameters = [f64; 2];

/// Lets two sides of a loop, one after the other, end where they cross; `false` if they do not, or
/// if they are further apart beyond it than `most`. Nodes beyond it are moved between the crossing
/// and the node before it.
pub(super) fn cut(one: &mut Chain, next: &mut Chain, point: impl Fn(Parameters) -> Point, most: f64) -> bool {
    let Some((i, j, at)) = crossing(one, next) else { return false };
    let mut beyond: [Vec<Point>; 2] =
        [&one[i + 1..], &next[..=j]].map(|nodes| nodes.iter().map(|node| point(node.0)).collect());
    beyond.iter_mut().zip([0, j + 1]).for_each(|(line, k)| line.insert(k, point(at)));
    let are_near = |one: &[Point], other: &[Point]| {
        one.iter().all(|p| other.windows(2).any(|w| from_segment(p, [w[0], w[1]]) <= most))
    };
    let [end, start] = &beyond;
    if !are_near(end, start) || !are_near(start, end) {
        return false;
    }
    let between =
        |from: Parameters, to: Parameters, share: f64| [0, 1].map(|k| from[k] + share * (to[k] - from[k]));
    let (last, before, after) = (one.len() - 1, one[i].0, next[j + 1].0);
    for (k, node) in one[i + 1..].iter_mut().enumerate() {
        node.0 = between(before, at, (k + 1) as f64 / (last - i) as f64);
    }
    for (k, node) in next[..=j].iter_mut().enumerate() {
        node.0 = between(at, after, k as f64 / (j + 1) as f64);
    }
    true
}

/// The segments at the end of a side and at the start of the next one that cross, and where.
fn crossing(one: &Chain, next: &Chain) -> Option<(usize, usize, Parameters)> {
    let from = (one.len() - 1).saturating_sub(TRIED);
    (from..one.len() - 1).rev().find_map(|i| {
        let found = |j: usize| Some((i, j, meet([one[i].0, one[i + 1].0], [next[j].0, next[j + 1].0])?));
        (0..(next.len() - 1).min(TRIED)).find_map(found)
    })
}

/// Where two segments cross.
fn meet([a, b]: [Parameters; 2], [c, d]: [Parameters; 2]) -> Option<Parameters> {
    let minus = |p: Parameters, q: Parameters| [p[0] - q[0], p[1] - q[1]];
    let cross = |p: Parameters, q: Parameters| p[0] * q[1] - p[1] * q[0];
    let (along, across, way) = (minus(b, a), minus(d, c), minus(c, a));
    let both = cross(along, across);
    let shares = [cross(way, across) / both, cross(way, along) / both];
    let is_inside = shares.iter().all(|share| (0.0..=1.0).contains(share));
    is_inside.then(|| [0, 1].map(|k| a[k] + shares[0] * along[k]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two sides that meet at the origin: one along x, the other one upwards, whose ends differ.
    fn sides(beyond: f64, from: Parameters) -> [Chain; 2] {
        let one = vec![([-1.0, 0.0], 0), ([0.5 * beyond, 0.0], 1), ([beyond, 0.0], 2)];
        [one, vec![(from, 2), ([0.0, 0.5], 3), ([0.0, 1.0], 4)]]
    }

    fn point(p: Parameters) -> Point {
        Point::new(p[0], p[1], 0.0)
    }

    #[test]
    fn sides_that_cross_beside_their_corner_end_there() {
        let [mut one, mut next] = sides(0.02, [0.0, -0.01]);
        assert!(cut(&mut one, &mut next, point, 0.03));
        assert_eq!((one[2].0, next[0].0), ([0.0; 2], [0.0; 2]));
        // The node beyond the crossing is before it now, the others stay.
        assert_eq!((one[0].0, one[1].0, next[1].0), ([-1.0, 0.0], [-0.5, 0.0], [0.0, 0.5]));
    }

    #[test]
    fn sides_that_are_far_apart_beyond_their_crossing_or_do_not_cross_stay() {
        for (beyond, from) in [(0.2, [0.0, -0.01]), (0.02, [0.0, 0.01])] {
            let [mut one, mut next] = sides(beyond, from);
            assert!(!cut(&mut one, &mut next, point, 0.03));
            assert_eq!([one, next], sides(beyond, from));
        }
    }
}
