//! Closes gaps between triangles whose corners were rounded differently.
//!
//! Only vertices at **open edges** (edges of one triangle) are merged, and a group of close
//! vertices only if no triangle has an edge inside the group: such a short edge is part of the
//! shape, not a gap. The distance grows until no edge is open; the smallest distance with the
//! fewest open edges is used.

use crate::Point;
use rayon::prelude::*;

/// Distances to try, as fractions of the bounding-box diagonal. Single precision rounds by 6·10⁻⁸,
/// six printed digits by 5·10⁻⁷ of the largest coordinate; gaps above 10⁻⁵ are not due to rounding.
const DISTANCES: [f64; 3] = [2e-7, 2e-6, 1e-5];

/// The result of [`close`].
pub(super) struct Closed {
    /// Number of merged points.
    pub points: usize,
    /// The distance within which points were merged.
    pub distance: f64,
    /// Open edges before.
    pub open_before: usize,
    /// Open edges after.
    pub open_after: usize,
}

/// Merges vertices of triangles where that closes gaps. The points stay; some may become unused.
pub(super) fn close(points: &[Point], triangles: &mut Vec<[u32; 3]>) -> Option<Closed> {
    let open = open_edges(triangles);
    if open.is_empty() {
        return None;
    }
    let mut rim: Vec<u32> = open.iter().flatten().copied().collect();
    rim.sort_unstable();
    rim.dedup();
    let (low, high) = points.iter().fold((points[0], points[0]), |(l, h), p| (l.inf(p), h.sup(p)));
    let diagonal = (high - low).norm();

    let mut best: Option<(Closed, Vec<[u32; 3]>)> = None;
    for distance in DISTANCES.map(|d| d * diagonal) {
        let (to_merged, merged) = groups(points, triangles, &rim, distance);
        if merged == 0 {
            continue;
        }
        let moved: Vec<[u32; 3]> = triangles.iter().map(|t| t.map(|v| to_merged[v as usize])).collect();
        let open_after = open_edges(&moved).len();
        if open_after < best.as_ref().map_or(open.len(), |(closed, _)| closed.open_after) {
            best = Some((Closed { points: merged, distance, open_before: open.len(), open_after }, moved));
        }
        if open_after == 0 {
            break;
        }
    }
    let (closed, moved) = best?;
    *triangles = moved;
    Some(closed)
}

/// Edges with only one triangle.
fn open_edges(triangles: &[[u32; 3]]) -> Vec<[u32; 2]> {
    let mut edges: Vec<u64> = triangles
        .par_iter()
        .flat_map_iter(|&[a, b, c]| [[a, b], [b, c], [c, a]])
        .filter(|[p, q]| p != q)
        .map(|[p, q]| u64::from(p.min(q)) << 32 | u64::from(p.max(q)))
        .collect();
    edges.par_sort_unstable();
    edges
        .chunk_by(|a, b| a == b)
        .filter(|same| same.len() == 1)
        .map(|same| [(same[0] >> 32) as u32, same[0] as u32])
        .collect()
}

/// Returns the merged index of each point, and the number of points merged into others.
fn groups(points: &[Point], triangles: &[[u32; 3]], rim: &[u32], distance: f64) -> (Vec<u32>, usize) {
    let mut root: Vec<u32> = (0..points.len() as u32).collect();
    for [p, q] in close_pairs(points, rim, distance) {
        let (p, q) = (find(&mut root, p), find(&mut root, q));
        root[p.max(q) as usize] = p.min(q);
    }
    for &v in rim {
        let to = find(&mut root, v);
        root[v as usize] = to;
    }
    let mut kept_apart = vec![false; points.len()];
    for &[a, b, c] in triangles {
        for [p, q] in [[a, b], [b, c], [c, a]] {
            if p != q && root[p as usize] == root[q as usize] {
                kept_apart[root[p as usize] as usize] = true;
            }
        }
    }
    let mut merged = 0;
    for &v in rim {
        // The root of a group is its lowest vertex, which comes first.
        if kept_apart[root[v as usize] as usize] {
            root[v as usize] = v;
        } else {
            merged += usize::from(root[v as usize] != v);
        }
    }
    (root, merged)
}

fn find(root: &mut [u32], mut v: u32) -> u32 {
    while root[v as usize] != v {
        root[v as usize] = root[root[v as usize] as usize];
        v = root[v as usize];
    }
    v
}

/// Pairs of vertices within a distance, found with a grid of that width.
fn close_pairs(points: &[Point], rim: &[u32], distance: f64) -> Vec<[u32; 2]> {
    if distance <= 0.0 {
        return Vec::new();
    }
    let cell = |v: u32| points[v as usize].coords.map(|x| (x / distance).floor() as i64);
    let mut cells: Vec<([i64; 3], u32)> = rim.iter().map(|&v| (cell(v).into(), v)).collect();
    cells.sort_unstable();
    let mut pairs = Vec::new();
    for &([x, y, z], v) in &cells {
        for dx in -1..=1 {
            for dy in -1..=1 {
                // Cells that differ in z only are contiguous.
                let column = |dz: i64| [x.saturating_add(dx), y.saturating_add(dy), z.saturating_add(dz)];
                let first = cells.partition_point(|(other, _)| *other < column(-1));
                let row = cells[first..].iter().take_while(|(other, _)| *other <= column(1));
                let near = row.map(|(_, w)| *w).filter(|&w| w > v);
                let near = near.filter(|&w| (points[w as usize] - points[v as usize]).norm() <= distance);
                pairs.extend(near.map(|w| [v, w]));
            }
        }
    }
    pairs
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A regular tet whose faces are shifted apart by `gap`, and its faces.
    fn exploded(gap: f64) -> (Vec<Point>, Vec<[u32; 3]>) {
        let corners = [[1., 1., 1.], [-1., 1., -1.], [1., -1., -1.], [-1., -1., 1.]].map(Point::from);
        let mut points = Vec::new();
        let mut triangles = Vec::new();
        for (k, face) in (0..).zip(crate::ground::mesh::TET_FACES) {
            let shift = crate::Vector::new(gap * f64::from(k), 0.0, 0.0);
            triangles.push([0, 1, 2].map(|i| points.len() as u32 + i));
            points.extend(face.map(|v| corners[v] + shift));
        }
        (points, triangles)
    }

    #[test]
    fn faces_that_were_rounded_apart_are_joined() {
        let (points, mut triangles) = exploded(1e-7);
        let closed = close(&points, &mut triangles).expect("gaps");
        assert_eq!((closed.points, closed.open_before, closed.open_after), (8, 12, 0));
        assert!(open_edges(&triangles).is_empty());
    }

    #[test]
    fn faces_that_are_truly_apart_stay_so() {
        let (points, mut triangles) = exploded(1e-3);
        let before = triangles.clone();
        assert!(close(&points, &mut triangles).is_none());
        assert_eq!(triangles, before);
    }

    #[test]
    fn a_tiny_open_triangle_does_not_collapse() {
        let (mut points, mut triangles) = exploded(0.0);
        points.extend([[5.0, 5.0, 5.0], [5.0 + 1e-6, 5.0, 5.0], [5.0, 5.0 + 1e-6, 5.0]].map(Point::from));
        triangles.push([12, 13, 14]);
        let before = triangles[4];
        close(&points, &mut triangles);
        assert_eq!(triangles[4], before);
    }
}
