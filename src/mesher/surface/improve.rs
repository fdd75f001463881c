//! Improvement of triangles by swaps, moves, collapses and splits, each only if it lowers the
//! price.

use super::Settings;
use super::sheet::{DEGENERATE_PRICE, GAIN, Kind, NORMAL_PRICE, Node, Place, Sheet, Stop};
use super::topology::{NONE, last, next};
use crate::ground::kernel::predicates::Sign;
use crate::ground::ordered::over_vertices;
use crate::{Point, Vector};

/// Edges shorter than this, in units of the wanted size, are collapsed.
const SHORT: f64 = 0.6;
/// Edges longer than this are split. With 0.6 and 1.5 halves of split edges are not collapsed, and
/// collapses make no edges that are split again.
const LONG: f64 = 1.5;
/// Price up to which a collapse or split may leave a triangle even if it is not an improvement
/// (quality 0.5).
const ACCEPTABLE: f64 = 2.0;
/// Vertices with at most this many neighbours are collapsed if that makes nothing worse.
const FEW: usize = 4;

/// Additional rounds while triangles are folded. One is nearly always enough if the segments allow
/// unfolding.
const MORE_ROUNDS: usize = 4;

/// Numbers of changes.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Improved {
    pub swaps: usize,
    pub moves: usize,
    pub collapses: usize,
    pub splits: usize,
}

/// Improves a sheet in `settings.rounds` rounds, more if triangles are folded.
///
/// # Errors
/// [`Stop::Size`] if the size field returns a value that is not positive and finite.
pub(super) fn improve(sheet: &mut Sheet, settings: &Settings) -> Result<Improved, Stop> {
    let mut done = Improved { swaps: sheet.legalise_all(), ..Improved::default() };
    for round in 0..settings.rounds + MORE_ROUNDS {
        if round >= settings.rounds && !sheet.mesh.living().any(|t| sheet.price_at(t) > NORMAL_PRICE) {
            break;
        }
        if round >= settings.rounds {
            done.swaps += sheet.unfold();
            done.swaps += sheet.legalise_all();
        }
        if round + 1 != settings.rounds {
            done.collapses += collapse_all(sheet);
            done.splits += split_all(sheet)?;
            done.swaps += sheet.legalise_all();
        }
        // Vertices move little in response to others: two passes, the second only for those still
        // active.
        let mut moving = Moving { active: vec![true; sheet.nodes.len()], sheet };
        for _ in 0..2 {
            done.moves += smooth_all(&mut moving);
        }
        done.swaps += sheet.legalise_all();
    }
    Ok(done)
}

/// Whether a vertex may be moved or removed.
fn is_free(node: &Node) -> bool {
    matches!(node.kind, Kind::Free | Kind::Helper)
}

/// A sheet whose vertices are moved.
struct Moving<'s, 'a> {
    sheet: &'s mut Sheet<'a>,
    /// Whether each vertex, or one of its neighbours, has moved since it was tried.
    active: Vec<bool>,
}

/// Moves each active free vertex to improve its triangles; returns the number of moves.
fn smooth_all(moving: &mut Moving) -> usize {
    let is_free = |&v: &u32| is_free(&moving.sheet.nodes[v as usize]);
    let free: Vec<u32> = (0..moving.sheet.nodes.len() as u32).filter(is_free).collect();
    let neighbours = |moving: &Moving, v: u32, near: &mut Vec<u32>| {
        let mut ring = Vec::new();
        moving.sheet.mesh.around(v, &mut ring);
        near.extend(ring.into_iter().flat_map(|t| moving.sheet.mesh.at(t).v));
    };
    let decide = |moving: &Moving, v: u32| {
        let mut ring = Vec::new();
        if moving.active[v as usize] {
            moving.sheet.mesh.around(v, &mut ring);
        }
        let moved = if ring.is_empty() { None } else { smoothed(moving.sheet, v, &ring) };
        moved.map(|moved| (moved, ring))
    };
    let mut moves = 0;
    over_vertices(moving, &free, neighbours, decide, |Moving { sheet, active }, v, found| {
        active[v as usize] = false;
        if let Some((moved, ring)) = found {
            moves += 1;
            sheet.nodes[v as usize] = moved;
            ring.into_iter().flat_map(|t| sheet.mesh.at(t).v).for_each(|w| active[w as usize] = true);
        }
    });
    moves
}

/// A vertex moved towards the position at which its triangles would be regular and of the wanted
/// size, if that lowers the sum of their squared prices.
fn smoothed(sheet: &Sheet, v: u32, ring: &[u32]) -> Option<Node> {
    let node = sheet.nodes[v as usize];
    let (worst, sum) = sheet.star_price(v, &node, ring)?;
    let target = ideal_place(sheet, v, ring);
    [1.0, 0.5, 0.2].into_iter().find_map(|step| {
        let place = node.point + (target - node.point) * step;
        // Positions without a unique projection are skipped.
        let moved = sheet.node(sheet.surface.project(&place).ok()?, node.size, node.kind);
        let (new_worst, new_sum) = sheet.star_price(v, &moved, ring)?;
        (new_sum < sum * (1.0 - GAIN) && new_worst <= worst.max(ACCEPTABLE)).then_some(moved)
    })
}

/// The mean of the apices of regular triangles on the edges around a vertex, with the wanted size
/// as far as the edge lengths allow.
fn ideal_place(sheet: &Sheet, v: u32, ring: &[u32]) -> Point {
    let node = &sheet.nodes[v as usize];
    let mut sum = Vector::zeros();
    for &t in ring {
        let x = sheet.mesh.at(t);
        let k = x.corner(v);
        let (a, b) = (&sheet.nodes[x.v[next(k)] as usize], &sheet.nodes[x.v[last(k)] as usize]);
        let along = b.point - a.point;
        let length = along.norm();
        let wanted = 0.25 * (a.size + b.size) + 0.5 * node.size;
        let side = wanted.clamp(0.7 * length, 1.4 * length);
        let height = (side * side - 0.25 * length * length).sqrt();
        let inward = (node.normal.cross(&along)).try_normalize(0.0).unwrap_or_default();
        sum += nalgebra::center(&a.point, &b.point) - node.point + inward * height;
    }
    node.point + sum / ring.len() as f64
}

/// Collapses short edges and vertices with few neighbours; returns the number of collapses.
fn collapse_all(sheet: &mut Sheet) -> usize {
    let mut collapses = 0;
    let mut ring = Vec::new();
    for v in 0..sheet.nodes.len() as u32 {
        if !is_free(&sheet.nodes[v as usize]) {
            continue;
        }
        sheet.mesh.around(v, &mut ring);
        if ring.is_empty() {
            continue;
        }
        let worst = ring.iter().map(|&t| sheet.price_at(t)).fold(0.0, f64::max);
        let ends: Vec<u32> = ring
            .iter()
            .map(|&t| {
                let x = sheet.mesh.at(t);
                x.v[next(x.corner(v))]
            })
            .collect();
        let shortest = ends.iter().map(|&w| sheet.length(v, w)).fold(f64::INFINITY, f64::min);
        let allowed = if shortest < SHORT {
            worst.max(ACCEPTABLE)
        } else if ring.len() <= FEW {
            worst
        } else if worst > ACCEPTABLE {
            worst * (1.0 - GAIN)
        } else {
            continue;
        };
        // A long edge is better than a folded triangle.
        let longest = if worst > NORMAL_PRICE { f64::INFINITY } else { LONG };
        let best = (0..ends.len())
            .filter_map(|k| collapsed_price(sheet, v, ends[k], &ring, longest).map(|price| (price, k)))
            .min_by(|p, q| p.0.total_cmp(&q.0));
        if let Some((price, k)) = best
            && price <= allowed
        {
            let (t, i) = sheet.mesh.find(v, ends[k], &mut ring).expect("a neighbour");
            sheet.mesh.collapse(t, i, &mut ring);
            collapses += 1;
        }
    }
    collapses
}

/// The largest price of the triangles that a collapse of `v` into `w` changes; `None` if one is
/// inverted in the chart or has an edge longer than `longest`.
fn collapsed_price(sheet: &Sheet, v: u32, w: u32, ring: &[u32], longest: f64) -> Option<f64> {
    // The two triangles that vanish pass the segments on their sides at w to their neighbours.
    let mut inherited = [(NONE, NONE); 2];
    let mut found = 0;
    for &t in ring {
        let x = sheet.mesh.at(t);
        if x.v.contains(&w) {
            let (at_v, at_w) = (x.corner(v), x.corner(w));
            // The third corner, and the segment between it and w, opposite v.
            inherited[found.min(1)] = (x.v[3 - at_v - at_w], x.segment[at_v]);
            found += 1;
        }
    }
    if found != 2 {
        return None;
    }
    let segment = |p: u32| inherited.iter().find(|(q, _)| *q == p).map_or(NONE, |(_, s)| *s);
    let mut worst = 0.0_f64;
    for &t in ring {
        let x = sheet.mesh.at(t);
        if x.v.contains(&w) {
            continue;
        }
        let k = x.corner(v);
        let (p, q) = (x.v[next(k)], x.v[last(k)]);
        if !sheet.fits(w, p, q) || sheet.length(w, p).max(sheet.length(w, q)) > longest {
            return None;
        }
        worst = worst.max(sheet.price_of([w, p, q], [x.segment[k], segment(q), segment(p)]));
    }
    Some(worst)
}

/// Splits edges that are too long; returns the number of splits.
fn split_all(sheet: &mut Sheet) -> Result<usize, Stop> {
    let mut splits = 0;
    let count = sheet.mesh.triangles.len() as u32;
    for t in 0..count {
        let x = *sheet.mesh.at(t);
        if !x.lives() {
            continue;
        }
        let longest = (0..3)
            .filter(|&i| x.segment[i] == NONE && x.near[i] != NONE)
            .map(|i| (sheet.length(x.v[next(i)], x.v[last(i)]), i))
            .max_by(|p, q| p.0.total_cmp(&q.0));
        if let Some((length, i)) = longest
            && length > LONG
            && split(sheet, t, i, ACCEPTABLE)?
        {
            splits += 1;
        }
    }
    Ok(splits)
}

/// Splits a side at its middle if the four new triangles are no worse than `allowed` or the worse
/// of the two old ones.
pub(super) fn split(sheet: &mut Sheet, t: u32, i: usize, allowed: f64) -> Result<bool, Stop> {
    let x = *sheet.mesh.at(t);
    let Some((u, j)) = sheet.mesh.twin(t, i) else { return Ok(false) };
    let [p, a, b, d] = [x.v[i], x.v[next(i)], x.v[last(i)], sheet.mesh.at(u).v[j]];
    let [na, nb] = [a, b].map(|v| &sheet.nodes[v as usize]);
    let size = 0.5 * (na.size + nb.size);
    let before = sheet.price_at(t).max(sheet.price_at(u));
    // The projection of the chord's midpoint; if it does not fit, the midpoint of the edge in the
    // chart.
    let places = [Some(nalgebra::center(&na.point, &nb.point)), sheet.chart.middle(&na.site, &nb.site)];
    for place in places.into_iter().flatten() {
        let Some(mut node) = sheet.try_project(&place)? else { continue };
        node.size = node.size.min(size * (1.0 + sheet.settings.growth));
        if fan_price(sheet, [p, a, d, b], &node).is_some_and(|worst| worst <= before.max(allowed)) {
            let v = sheet.nodes.len() as u32;
            sheet.nodes.push(node);
            sheet.mesh.add_vertex();
            sheet.insert_vertex(v, Place::OnSide(t, i));
            return Ok(true);
        }
    }
    Ok(false)
}

/// The largest price of the triangles between the edges of a quadrilateral and a vertex; `None` if
/// one is inverted in the chart.
fn fan_price(sheet: &Sheet, quadrilateral: [u32; 4], node: &Node) -> Option<f64> {
    let mut worst = 0.0_f64;
    for k in 0..4 {
        let [from, to] = [k, (k + 1) % 4].map(|k| &sheet.nodes[quadrilateral[k] as usize]);
        if sheet.chart.orient(&from.site, &to.site, &node.site) != Sign::Positive {
            return None;
        }
        worst = worst.max(sheet.price([from, to, node]));
    }
    Some(worst)
}

/// Splits triangles with two sides on one smooth curve, which would flatten in refinement; returns
/// how many there were and how many are left.
///
/// Swaps have already removed most of them, because the price penalises them.
pub(super) fn repair_flattening(sheet: &mut Sheet) -> Result<(usize, usize), Stop> {
    let count = sheet.mesh.triangles.len() as u32;
    let (mut found, mut left) = (0, 0);
    for t in 0..count {
        let x = *sheet.mesh.at(t);
        if !x.lives() || x.segment == [NONE; 3] || sheet.flattenings(x.v, x.segment) == 0 {
            continue;
        }
        found += 1;
        let inner = (0..3).find(|&i| x.segment[i] == NONE && x.near[i] != NONE);
        let repaired = match inner {
            Some(i) => split(sheet, t, i, DEGENERATE_PRICE)? || split_inside(sheet, t)?,
            None => split_inside(sheet, t)?,
        };
        left += usize::from(!repaired);
        if repaired {
            let v = sheet.nodes.len() as u32 - 1;
            let mut ring = Vec::new();
            sheet.mesh.around(v, &mut ring);
            if let Some(moved) = smoothed(sheet, v, &ring) {
                sheet.nodes[v as usize] = moved;
            }
        }
    }
    Ok((found, left))
}

/// Splits a triangle at its centroid, without swaps; false if the triangles would be inverted in
/// the chart.
fn split_inside(sheet: &mut Sheet, t: u32) -> Result<bool, Stop> {
    let corners = sheet.corners(t);
    let middle = Point::from(corners.iter().map(|n| n.point.coords).sum::<Vector>() / 3.0);
    let size = corners.iter().map(|n| n.size).fold(f64::INFINITY, f64::min);
    let Some(mut node) = sheet.try_project(&middle)? else { return Ok(false) };
    node.size = node.size.min(size);
    let [a, b, c] = sheet.corners(t);
    let fits = [(a, b), (b, c), (c, a)]
        .iter()
        .all(|(p, q)| sheet.chart.orient(&p.site, &q.site, &node.site) == Sign::Positive);
    if fits {
        let v = sheet.nodes.len() as u32;
        sheet.nodes.push(node);
        sheet.mesh.add_vertex();
        sheet.mesh.split_triangle(t, v);
    }
    Ok(fits)
}
