//! Which edges of a triangulated surface are sharp.
//!
//! No one angle tells the edge between two planes, 15° say, from the facets of a coarse cylinder, 30° each. What tells them apart
//! is what lies beside: facets of a smooth surface turn again by about as much at their far sides, which are about as far
//! away on one side of the edge as on the other. So an edge below the feature angle is sharp if a walk away from it, to
//! either side, does not soon meet another edge like it.

use super::features::Input;
use crate::{Point, Vector};

/// At an edge like another, facets turn by at least this part of its angle. Half steps of tessellations at tangent blends make
/// 0.5; facets of a countersink beside its rim (10° and 31° in the part we know) make 0.3.
const LIKE: f64 = 0.4;

/// "Soon" is at most this many times the distance of what the walk to the other side meets.
const SOON: f64 = 4.0;

/// Facets crossed in a walk at most: there are rarely more between two edges of a tessellation.
const MOST_CROSSED: usize = 60;

/// The angle by which facets turn at each edge, radians; infinite where patches end anyway.
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

/// Whether each edge is sharp: above `feature`, or above `least` without one like it beside.
pub(super) fn sharp(input: &Input, angles: &[f64], least: f64, feature: f64) -> Vec<bool> {
    let is_sharp = |edge: usize| {
        let angle = angles[edge];
        angle > feature || (angle > least && !is_one_of_many(input, angles, edge, feature))
    };
    (0..angles.len()).map(is_sharp).collect()
}

/// What a walk met.
enum Met {
    /// An edge like the one it left.
    Like(f64),
    /// A sharp edge.
    Wall(f64),
    /// Nothing.
    Nothing,
}

fn is_one_of_many(input: &Input, angles: &[f64], edge: usize, feature: f64) -> bool {
    let [a, b] = input.edges.uses(edge) else { return false };
    let met = [a.triangle, b.triangle].map(|t| walk(input, angles, edge, t, feature));
    let distance = |m: &Met| match m {
        Met::Like(d) | Met::Wall(d) => *d,
        Met::Nothing => f64::INFINITY,
    };
    let nearest = distance(&met[0]).min(distance(&met[1]));
    met.iter().any(|m| matches!(m, Met::Like(d) if *d <= SOON * nearest))
}

/// Walks over triangles straight away from the middle of an edge.
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
            return Met::Wall(distance);
        }
        if angles[exit] >= LIKE * angles[edge] {
            return Met::Like(distance);
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

/// The edge through which a walk leaves a triangle, and where.
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
