//! Detection of sharp edges of a triangulated surface.
//!
//! No single angle separates an edge between two planes (15°, say) from the edges of a coarse
//! cylinder (30° each). The difference is in the neighbourhood: facets of a smooth surface turn by
//! about as much at their far sides, at similar distances on both sides of the edge. So an edge
//! below the feature angle is sharp if a walk away from it, on either side, does not soon meet a
//! similar edge.

use super::features::Input;
use crate::{Point, Vector};

/// An edge is similar to another one if its angle is at least this fraction of the other's. Half
/// steps of tessellations at tangent blends have 0.5; facets of a countersink beside its rim (10°
/// and 31° on one known part) have 0.3.
const SIMILAR: f64 = 0.4;

/// "Soon" is at most this many times the distance at which the walk to the other side meets an
/// edge.
const SOON: f64 = 4.0;

/// The most facets crossed in a walk: there are rarely more between two edges of a tessellation.
const MOST_CROSSED: usize = 60;

/// The angle between the facets at each edge (radians); infinite if patches end there in any case.
pub(super) fn angles(input: &Input) -> Vec<f64> {
    let angle = |edge: usize| {
        let [a, b] = input.edges.uses(edge) else { return f64::INFINITY };
        let (s, t) = (a.triangle as usize, b.triangle as usize);
        if input.keys[s] != input.keys[t] {
            return f64::INFINITY;
        }
        let other = if a.along == b.along { -input.normals[t] } else { input.normals[t] };
        input.normals[s].angle(&other)
    };
    (0..input.edges.len()).map(angle).collect()
}

/// Whether each edge is sharp: above `feature`, or above `least` without a similar edge nearby.
pub(super) fn sharp(input: &Input, angles: &[f64], least: f64, feature: f64) -> Vec<bool> {
    let is_sharp = |edge: usize| {
        let angle = angles[edge];
        angle > feature || (angle > least && !has_similar_nearby(input, angles, edge, feature))
    };
    (0..angles.len()).map(is_sharp).collect()
}

/// The result of a walk.
enum Met {
    /// It met an edge similar to the first, at this distance.
    Similar(f64),
    /// It met a sharp edge, at this distance.
    Sharp(f64),
    /// It met neither.
    Nothing,
}

fn has_similar_nearby(input: &Input, angles: &[f64], edge: usize, feature: f64) -> bool {
    let [a, b] = input.edges.uses(edge) else { return false };
    let met = [a.triangle, b.triangle].map(|t| walk(input, angles, edge, t, feature));
    let distance = |m: &Met| match m {
        Met::Similar(d) | Met::Sharp(d) => *d,
        Met::Nothing => f64::INFINITY,
    };
    let nearest = distance(&met[0]).min(distance(&met[1]));
    met.iter().any(|m| matches!(m, Met::Similar(d) if *d <= SOON * nearest))
}

/// Walks across triangles, normal to an edge from its midpoint.
fn walk(input: &Input, angles: &[f64], edge: usize, triangle: u32, feature: f64) -> Met {
    let point = |v: u32| input.points[v as usize];
    let [a, b] = input.edges.uses(edge)[0].ends.map(point);
    let (mut from, mut entry, mut t) = (nalgebra::center(&a, &b), edge, triangle as usize);
    let Some(along) = (b - a).try_normalize(0.0) else { return Met::Nothing };
    let mut direction = input.normals[t].cross(&along);
    let inward = input.triangles[t].iter().map(|&v| point(v) - from).fold(0.0, |most: f64, d| {
        let out = d.dot(&direction);
        if out.abs() > most.abs() { out } else { most }
    });
    if inward < 0.0 {
        direction = -direction;
    }
    let mut distance = 0.0;
    for _ in 0..MOST_CROSSED {
        let Some((exit, through)) = leave(input, t, entry, &from, &direction) else { return Met::Nothing };
        distance += (through - from).norm();
        if angles[exit] > feature {
            return Met::Sharp(distance);
        }
        if angles[exit] >= SIMILAR * angles[edge] {
            return Met::Similar(distance);
        }
        let Some([s, u]) = input.edges.pair(exit) else { return Met::Nothing };
        (t, entry, from) = (if s as usize == t { u } else { s } as usize, exit, through);
        let normal = input.normals[t];
        let turned = direction - normal * normal.dot(&direction);
        let Some(turned) = turned.try_normalize(0.0) else { return Met::Nothing };
        direction = turned;
    }
    Met::Nothing
}

/// The edge through which a walk leaves a triangle, and the point there.
fn leave(input: &Input, t: usize, entry: usize, from: &Point, direction: &Vector) -> Option<(usize, Point)> {
    let v = input.triangles[t].map(|v| input.points[v as usize]);
    let across = input.normals[t].cross(direction);
    (0..3)
        .filter(|&side| input.edges.of_side[t][side] as usize != entry)
        .filter_map(|side| {
            let (p, q) = (v[(side + 1) % 3], v[(side + 2) % 3]);
            let (left, right) = (across.dot(&(p - from)), across.dot(&(q - from)));
            let share = left / (left - right);
            let through = p + (q - p) * share;
            let ahead = direction.dot(&(through - from));
            ((0.0..=1.0).contains(&share) && ahead >= 0.0).then_some((
                ahead,
                input.edges.of_side[t][side] as usize,
                through,
            ))
        })
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, edge, through)| (edge, through))
}
