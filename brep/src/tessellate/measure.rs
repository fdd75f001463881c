//! Areas, volumes and closedness of tessellations.

use super::Tessellation;
use crate::{BrepError, Model, Point};
use std::collections::BTreeMap;

/// The distance of a point from a segment.
pub(super) fn from_segment(point: &Point, [a, b]: [Point; 2]) -> f64 {
    let (along, to) = (b - a, point - a);
    let share = (to.dot(&along) / along.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    (to - along * share).norm()
}

/// The area of a patch's triangles (length squared).
pub fn area(tessellation: &Tessellation, patch: usize) -> f64 {
    let own = tessellation.triangles.iter().filter(|t| t.patch as usize == patch);
    own.map(|t| {
        let [a, b, c] = t.vertices.map(|v| tessellation.points[v as usize]);
        0.5 * (b - a).cross(&(c - a)).norm()
    })
    .sum()
}

/// The volume that the triangles around a body enclose; negative if the body is inside out.
pub fn volume(model: &Model, tessellation: &Tessellation, body: usize) -> f64 {
    let origin = tessellation.points.first().copied().unwrap_or_else(Point::origin);
    let of = |t: &super::Triangle| {
        let [behind, front] = model.patches[t.patch as usize].bodies;
        let sign = f64::from(i8::from(behind == Some(body)) - i8::from(front == Some(body)));
        sign * enclosed(&[t.vertices.map(|v| tessellation.points[v as usize])], origin)
    };
    tessellation.triangles.iter().map(of).sum()
}

/// The volume of the tets between triangles and a point; that within the triangles if they are
/// closed.
pub(super) fn enclosed(triangles: &[[Point; 3]], from: Point) -> f64 {
    let of = |t: &[Point; 3]| {
        let [a, b, c] = t.map(|p| p - from);
        a.dot(&b.cross(&c)) / 6.0
    };
    triangles.iter().map(of).sum()
}

/// Checks that the triangles around each body are closed and oriented alike.
///
/// # Errors
/// [`BrepError::Solid`] with the first edge that is not used as often in both directions.
pub fn check(model: &Model, tessellation: &Tessellation) -> Result<(), BrepError> {
    // For each body and edge: uses along it less those against it.
    let mut uses: BTreeMap<(usize, [u32; 2]), i32> = BTreeMap::new();
    for t in &tessellation.triangles {
        let [behind, front] = model.patches[t.patch as usize].bodies;
        for (body, sign) in [(behind, 1), (front, -1)] {
            let Some(body) = body else { continue };
            for k in 0..3 {
                let (a, b) = (t.vertices[k], t.vertices[(k + 1) % 3]);
                let along = if a < b { sign } else { -sign };
                *uses.entry((body, [a.min(b), a.max(b)])).or_default() += along;
            }
        }
    }
    match uses.into_iter().find(|(_, count)| *count != 0) {
        None => Ok(()),
        Some(((body, [a, b]), _)) => {
            let [a, b] = [a, b].map(|v| tessellation.points[v as usize]);
            let what = "its faces do not enclose it, or not all are oriented alike";
            Err(BrepError::solid(body, what, Some(nalgebra::center(&a, &b))))
        }
    }
}
