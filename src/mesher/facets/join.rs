//! Joins several triangulated surfaces: equal points and equal triangles are merged.

use super::{FacetError, Facets};
use crate::Point;
use crate::ground::kernel::tree::bounds;
use std::cmp::Ordering;

/// The use of a triangle by one surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Layer {
    /// The surface.
    pub file: u32,
    /// The group of the triangle in it.
    pub group: u32,
    /// Whether its orientation is that of the joined triangle.
    pub even: bool,
}

/// All surfaces joined.
#[derive(Clone, Debug, Default)]
pub(super) struct Joined {
    pub points: Vec<Point>,
    pub triangles: Vec<[u32; 3]>,
    /// The surfaces that contain each triangle, in their order.
    pub layers: Vec<Vec<Layer>>,
}

/// Joins surfaces. Triangles with two equal corners and unused points are dropped; the other sides
/// of such triangles become one edge.
///
/// # Errors
/// [`FacetError::NotFinite`], [`FacetError::NoSuchPoint`] and [`FacetError::TooLarge`] for invalid
/// numbers, [`FacetError::Empty`] if no triangle is left, [`FacetError::OutOfRange`].
pub(super) fn join(files: &[Facets]) -> Result<Joined, FacetError> {
    check_numbers(files)?;
    let points: Vec<Point> = files.iter().flat_map(|f| &f.points).map(|p| p.map(|x| x + 0.0)).collect();
    let first = first_equal(&points);
    let mut all: Vec<([u32; 3], Layer)> = Vec::new();
    let mut offset = 0;
    for (file, facets) in files.iter().enumerate() {
        for (t, corners) in facets.triangles.iter().enumerate() {
            let triangle = corners.map(|v| first[offset + v as usize]);
            let [a, b, c] = triangle;
            if a != b && b != c && c != a {
                let group = facets.groups.get(t).copied().unwrap_or(0);
                all.push((triangle, Layer { file: file as u32, group, even: true }));
            }
        }
        offset += facets.points.len();
    }
    if all.is_empty() {
        return Err(FacetError::Empty);
    }
    bounds(&points).refuse_out_of_range()?;
    Ok(merge_equal(points, &all))
}

/// For each point, the first one at the same position.
fn first_equal(points: &[Point]) -> Vec<u32> {
    let mut order: Vec<u32> = (0..points.len() as u32).collect();
    let compare = |a: &u32, b: &u32| {
        let (p, q) = (&points[*a as usize], &points[*b as usize]);
        p.x.total_cmp(&q.x).then(p.y.total_cmp(&q.y)).then(p.z.total_cmp(&q.z))
    };
    order.sort_by(|a, b| compare(a, b).then(a.cmp(b)));
    let mut first = vec![0; points.len()];
    for equal in order.chunk_by(|a, b| compare(a, b) == Ordering::Equal) {
        equal.iter().for_each(|&v| first[v as usize] = equal[0]);
    }
    first
}

/// Merges triangles with the same corners and numbers the points that are used.
fn merge_equal(points: Vec<Point>, all: &[([u32; 3], Layer)]) -> Joined {
    let key = |t: &u32| {
        let mut key = all[*t as usize].0;
        key.sort_unstable();
        key
    };
    let mut order: Vec<u32> = (0..all.len() as u32).collect();
    order.sort_by_cached_key(|t| (key(t), *t));
    let mut layers_of: Vec<Vec<Layer>> = vec![Vec::new(); all.len()];
    for equal in order.chunk_by(|a, b| key(a) == key(b)) {
        let reference = all[equal[0] as usize].0;
        for &t in equal {
            let (triangle, layer) = all[t as usize];
            layers_of[equal[0] as usize].push(Layer { even: is_rotation(reference, triangle), ..layer });
        }
    }
    let mut new = vec![u32::MAX; points.len()];
    let mut joined = Joined::default();
    for (&(triangle, _), layers) in all.iter().zip(layers_of) {
        if layers.is_empty() {
            continue;
        }
        let corners = triangle.map(|v| {
            if new[v as usize] == u32::MAX {
                new[v as usize] = joined.points.len() as u32;
                joined.points.push(points[v as usize]);
            }
            new[v as usize]
        });
        joined.triangles.push(corners);
        joined.layers.push(layers);
    }
    joined
}

/// Whether two permutations of the same corners have the same orientation.
fn is_rotation(a: [u32; 3], b: [u32; 3]) -> bool {
    a == b || a == [b[1], b[2], b[0]] || a == [b[2], b[0], b[1]]
}

fn check_numbers(files: &[Facets]) -> Result<(), FacetError> {
    let (mut points, mut triangles) = (0, 0);
    for (file, facets) in files.iter().enumerate() {
        points += facets.points.len();
        triangles += facets.triangles.len();
        if let Some(point) = facets.points.iter().position(|p| !p.iter().all(|x| x.is_finite())) {
            return Err(FacetError::NotFinite { file, point });
        }
        let beyond = |t: &[u32; 3]| t.iter().any(|&v| v as usize >= facets.points.len());
        if let Some(triangle) = facets.triangles.iter().position(beyond) {
            let point = facets.triangles[triangle].into_iter().max().unwrap_or(0);
            return Err(FacetError::NoSuchPoint { file, triangle, point });
        }
    }
    // Edges and sides of triangles also have 32-bit numbers.
    if points.max(3 * triangles) >= u32::MAX as usize {
        return Err(FacetError::TooLarge { points, triangles });
    }
    Ok(())
}
