//! Triangulates plane facets of any outline by constrained Delaunay triangulation.
//!
//! The plane is the coordinate plane to which the facet is least inclined. Dropping a coordinate
//! involves no rounding, so orientations in the plane are exact for the points as read.

use super::polygon::PolygonFault;
use crate::Point;
use crate::ground::kernel::predicates::{Sign, orient2d};
use crate::mesher::surface::plane;
use nalgebra::Vector3;

/// A coordinate plane, seen from the side to which the facet's normal points.
pub(super) struct Plane {
    right: usize,
    up: usize,
}

impl Plane {
    /// The plane for the largest of these loops; `None` if all are collinear.
    pub fn of(points: &[Point], loops: &[&[u32]]) -> Option<Self> {
        let normals = loops.iter().map(|corners| area_vector(points, corners));
        let normal = normals.reduce(|a, b| if b.norm() > a.norm() { b } else { a })?;
        let axis = normal.iamax();
        let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
        if normal[axis] > 0.0 {
            Some(Self { right: next, up: last })
        } else if normal[axis] < 0.0 {
            Some(Self { right: last, up: next })
        } else {
            None
        }
    }

    /// The coordinates of a point in the plane.
    pub fn project(&self, p: &Point) -> [f64; 2] {
        [p[self.right], p[self.up]]
    }
}

/// Twice the area of a closed polygon times its normal (Newell's formula about the first corner).
fn area_vector(points: &[Point], corners: &[u32]) -> Vector3<f64> {
    let Some((&first, rest)) = corners.split_first() else { return Vector3::zeros() };
    let at = |v: u32| points[v as usize] - points[first as usize];
    rest.windows(2).map(|pair| at(pair[0]).cross(&at(pair[1]))).sum()
}

/// The rule for the inside of a facet.
pub(super) enum Fill<'a> {
    /// Points enclosed by an odd number of loops.
    Parity,
    /// Points that cannot be reached from outside or from these points without crossing an edge
    /// (TetGen).
    Enclosed(&'a [Point]),
}

/// An edge by its ascending ends, and how often loops traverse it.
type Edge = ([u32; 2], usize);

/// Triangulates a facet, oriented like its largest loop. `loops` are closed polygons, edges (two
/// points) and single points; all become vertices and edges.
pub(super) fn triangulate(
    points: &[Point],
    loops: &[Vec<u32>],
    fill: &Fill,
) -> Result<Vec<[u32; 3]>, PolygonFault> {
    let slices: Vec<&[u32]> = loops.iter().map(Vec::as_slice).collect();
    let plane = Plane::of(points, &slices).ok_or(PolygonFault::Flat)?;
    let mut vertices: Vec<u32> = loops.concat();
    vertices.sort_unstable();
    vertices.dedup();
    let at: Vec<[f64; 2]> = vertices.iter().map(|&v| plane.project(&points[v as usize])).collect();
    let place = |v: u32| vertices.binary_search(&v).expect("a vertex of a loop") as u32;
    let edges = edges_of(loops.iter().map(|corners| corners.iter().map(|&v| place(v)).collect()));

    let (triangles, edges) = constrained(&at, edges)?;
    let sides = Sides::of(&triangles);
    let inside = match fill {
        Fill::Parity => by_parity(&triangles, &sides, &edges),
        Fill::Enclosed(holes) => {
            let holes: Vec<[f64; 2]> = holes.iter().map(|p| plane.project(p)).collect();
            enclosed(&at, &triangles, &sides, &edges, &holes)
        }
    };
    let kept = triangles.iter().zip(inside).filter(|(_, inside)| *inside);
    Ok(kept.map(|(t, _)| t.map(|v| vertices[v as usize])).collect())
}

/// The distinct edges of the loops, ascending.
fn edges_of(loops: impl Iterator<Item = Vec<u32>>) -> Vec<Edge> {
    let mut edges = Vec::new();
    for corners in loops {
        // A loop of two is one edge, not an edge and its reverse.
        let count = if corners.len() == 2 { 1 } else { corners.len() };
        for k in 0..count {
            let [a, b] = [corners[k], corners[(k + 1) % corners.len()]];
            if a != b {
                edges.push(([a.min(b), a.max(b)], 1));
            }
        }
    }
    gathered(edges)
}

fn gathered(mut edges: Vec<Edge>) -> Vec<Edge> {
    edges.sort_unstable();
    edges.dedup_by(|next, first| {
        let same = next.0 == first.0;
        first.1 += if same { next.1 } else { 0 };
        same
    });
    edges
}

/// Triangulates with all edges as constraints; edges that contain other points are split there.
fn constrained(at: &[[f64; 2]], edges: Vec<Edge>) -> Result<(Vec<[u32; 3]>, Vec<Edge>), PolygonFault> {
    let attempt = |edges: &[Edge]| {
        let ends: Vec<[u32; 2]> = edges.iter().map(|(edge, _)| *edge).collect();
        let triangles = plane::triangulate(at, &ends).ok_or(PolygonFault::TooLarge)?;
        let sides = Sides::of(&triangles);
        let complete = edges.iter().all(|(edge, _)| sides.has(*edge));
        Ok(complete.then_some(triangles))
    };
    if let Some(triangles) = attempt(&edges)? {
        return Ok((triangles, edges));
    }
    let edges = gathered(edges.iter().flat_map(|edge| cut_at_points(at, edge)).collect());
    match attempt(&edges)? {
        Some(triangles) => Ok((triangles, edges)),
        None => Err(PolygonFault::Crossing),
    }
}

/// Splits an edge at the points that lie exactly on it.
fn cut_at_points(at: &[[f64; 2]], &([a, b], count): &Edge) -> Vec<Edge> {
    let (from, to) = (at[a as usize], at[b as usize]);
    let axis = usize::from((to[1] - from[1]).abs() > (to[0] - from[0]).abs());
    let (low, high) = (from[axis].min(to[axis]), from[axis].max(to[axis]));
    let on_edge = |&v: &u32| {
        let p = at[v as usize];
        v != a && v != b && p[axis] > low && p[axis] < high && orient2d(from, to, p) == Sign::Zero
    };
    let mut stops: Vec<u32> = (0..at.len() as u32).filter(on_edge).chain([a, b]).collect();
    stops.sort_by(|&p, &q| at[p as usize][axis].total_cmp(&at[q as usize][axis]));
    stops.windows(2).map(|pair| ([pair[0].min(pair[1]), pair[0].max(pair[1])], count)).collect()
}

/// The triangles at each edge, sorted by edge.
struct Sides(Vec<([u32; 2], u32)>);

impl Sides {
    fn of(triangles: &[[u32; 3]]) -> Self {
        let mut sides = Vec::with_capacity(3 * triangles.len());
        for (t, &[a, b, c]) in (0..).zip(triangles) {
            sides.extend([[a, b], [b, c], [c, a]].map(|[p, q]| ([p.min(q), p.max(q)], t)));
        }
        sides.sort_unstable();
        Self(sides)
    }

    fn at(&self, edge: [u32; 2]) -> impl Iterator<Item = u32> + '_ {
        let first = self.0.partition_point(|(other, _)| *other < edge);
        self.0[first..].iter().take_while(move |(other, _)| *other == edge).map(|(_, t)| *t)
    }

    fn has(&self, edge: [u32; 2]) -> bool {
        self.at(edge).next().is_some()
    }

    /// The edges of the hull with their triangles.
    fn hull(&self) -> impl Iterator<Item = ([u32; 2], u32)> + '_ {
        self.0.chunk_by(|a, b| a.0 == b.0).filter(|chunk| chunk.len() == 1).map(|chunk| chunk[0])
    }
}

fn crossings(edges: &[Edge], edge: [u32; 2]) -> usize {
    edges.binary_search_by_key(&edge, |(edge, _)| *edge).map_or(0, |k| edges[k].1)
}

/// Propagates a state over the triangles from the hull inward. `cross` maps the state on one side
/// of an edge, and how often loops traverse the edge, to the state on the other side, or `None` to
/// stop there.
fn spread(
    triangles: &[[u32; 3]],
    sides: &Sides,
    edges: &[Edge],
    mut open: Vec<(u32, bool)>,
    cross: impl Fn(bool, usize) -> Option<bool>,
) -> Vec<Option<bool>> {
    let mut state = vec![None; triangles.len()];
    for (edge, t) in sides.hull() {
        // Outside the hull the state is `false`.
        open.extend(cross(false, crossings(edges, edge)).map(|inside| (t, inside)));
    }
    while let Some((t, inside)) = open.pop() {
        if state[t as usize].replace(inside).is_some() {
            continue;
        }
        let [a, b, c] = triangles[t as usize];
        for [p, q] in [[a, b], [b, c], [c, a]] {
            let edge = [p.min(q), p.max(q)];
            let Some(beyond) = cross(inside, crossings(edges, edge)) else { continue };
            open.extend(sides.at(edge).filter(|&n| state[n as usize].is_none()).map(|n| (n, beyond)));
        }
    }
    state
}

fn by_parity(triangles: &[[u32; 3]], sides: &Sides, edges: &[Edge]) -> Vec<bool> {
    let state = spread(triangles, sides, edges, Vec::new(), |inside, times| Some(inside ^ (times % 2 == 1)));
    state.into_iter().map(|inside| inside == Some(true)).collect()
}

fn enclosed(
    at: &[[f64; 2]],
    triangles: &[[u32; 3]],
    sides: &Sides,
    edges: &[Edge],
    holes: &[[f64; 2]],
) -> Vec<bool> {
    let contains = |t: &[u32; 3], p: [f64; 2]| {
        let [a, b, c] = t.map(|v| at[v as usize]);
        [[a, b], [b, c], [c, a]].iter().all(|&[u, v]| orient2d(u, v, p) != Sign::Negative)
    };
    let in_holes = holes.iter().filter_map(|p| triangles.iter().position(|t| contains(t, *p)));
    let open = in_holes.map(|t| (t as u32, false)).collect();
    let state = spread(triangles, sides, edges, open, |_, times| (times == 0).then_some(false));
    state.into_iter().map(|reached| reached.is_none()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::kernel::simplex::{area, area_vector};

    fn grid(places: &[[f64; 2]]) -> Vec<Point> {
        // An inclined plane, so that no coordinate is constant.
        places.iter().map(|[x, y]| Point::new(x + 3.0, *y, x + 2.0 * y)).collect()
    }

    fn total(points: &[Point], triangles: &[[u32; 3]]) -> f64 {
        let [p, q, r] = [Point::new(0., 0., 0.), Point::new(1., 0., 1.), Point::new(0., 1., 2.)];
        let unit = 2.0 * area(&p, &q, &r);
        triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|v| points[v as usize]);
                area(&a, &b, &c)
            })
            .sum::<f64>()
            / unit
    }

    const SQUARE_IN_SQUARE: [[f64; 2]; 8] =
        [[0., 0.], [4., 0.], [4., 4.], [0., 4.], [1., 1.], [1., 3.], [3., 3.], [3., 1.]];

    #[test]
    fn an_l_keeps_its_notch_and_its_side() {
        let points = grid(&[[0., 0.], [2., 0.], [2., 1.], [1., 1.], [1., 2.], [0., 2.]]);
        for corners in [vec![0, 1, 2, 3, 4, 5], vec![5, 4, 3, 2, 1, 0]] {
            let found = triangulate(&points, std::slice::from_ref(&corners), &Fill::Parity).unwrap();
            assert_eq!(found.len(), 4);
            assert!((total(&points, &found) - 3.0).abs() < 1e-12);
            let side = super::area_vector(&points, &corners);
            for t in &found {
                let [a, b, c] = t.map(|v| points[v as usize]);
                assert!(area_vector(&a, &b, &c).dot(&side) > 0.0);
            }
        }
    }

    #[test]
    fn a_bridge_to_a_hole_leaves_the_hole_open() {
        let points = grid(&SQUARE_IN_SQUARE);
        let found = triangulate(&points, &[vec![0, 1, 2, 3, 0, 4, 5, 6, 7, 4]], &Fill::Parity).unwrap();
        assert!((total(&points, &found) - 12.0).abs() < 1e-12);
    }

    #[test]
    fn a_facet_has_the_holes_that_points_mark_and_no_others() {
        let points = grid(&SQUARE_IN_SQUARE);
        let loops = [vec![0, 1, 2, 3], vec![4, 5, 6, 7]];
        let hole = grid(&[[2.0, 2.0]]);
        for (holes, expected) in [(&hole[..], 12.0), (&[], 16.0)] {
            let found = triangulate(&points, &loops, &Fill::Enclosed(holes)).unwrap();
            assert!((total(&points, &found) - expected).abs() < 1e-12);
        }
    }

    #[test]
    fn edges_and_points_inside_a_facet_are_kept() {
        let points = grid(&[[0., 0.], [4., 0.], [4., 4.], [0., 4.], [1., 2.], [3., 2.], [2., 1.]]);
        let loops = [vec![0, 1, 2, 3], vec![4, 5], vec![6]];
        let found = triangulate(&points, &loops, &Fill::Enclosed(&[])).unwrap();
        assert!((total(&points, &found) - 16.0).abs() < 1e-12);
        assert!(Sides::of(&found).has([4, 5]));
        assert!(found.iter().flatten().any(|&v| v == 6));
    }

    #[test]
    fn an_edge_over_a_point_is_cut_there() {
        let points = grid(&[[0., 0.], [2., 0.], [4., 0.], [4., 4.], [0., 4.], [2., 4.]]);
        let loops = [vec![0, 2, 3, 4], vec![1, 5]];
        let found = triangulate(&points, &loops, &Fill::Enclosed(&[])).unwrap();
        assert_eq!(found.len(), 4);
        assert!((total(&points, &found) - 16.0).abs() < 1e-12);
    }

    #[test]
    fn crossing_edges_and_corners_on_a_line_are_refused() {
        let bow = grid(&[[0., 0.], [1., 1.], [1., 0.], [0., 3.]]);
        let found = triangulate(&bow, &[vec![0, 1, 2, 3]], &Fill::Parity);
        assert_eq!(found, Err(PolygonFault::Crossing));
        let line = grid(&[[0., 0.], [1., 0.], [2., 0.], [3., 0.]]);
        assert_eq!(triangulate(&line, &[vec![0, 1, 2, 3]], &Fill::Parity), Err(PolygonFault::Flat));
    }
}
