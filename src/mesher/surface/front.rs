//! The advancing front: new vertices, layer by layer, each placed to form a good triangle with a
//! front edge.
//!
//! The front moves inside a triangulation that is valid at all times (Rebay 1993, "Efficient
//! unstructured mesh generation by means of Delaunay triangulation and Bowyer-Watson algorithm";
//! Frey, Borouchaki, George 1998, "3D Delaunay mesh generation coupled with an advancing-front
//! approach"). It separates triangles that are small enough, **done**, from those that are not, so
//! it cannot collide with itself or fail to close. Differences from Rebay: the front advances in
//! layers (first in, first out) instead of by the largest triangle, points are placed in the
//! tangent plane and projected, and a vertex is inserted by a split and swaps.

use super::sheet::{Kind, Node, Place, Sheet, Stop};
use super::topology::{NONE, last, next};
use crate::Vector;
use crate::ground::kernel::simplex::{area, area_vector};
use std::collections::VecDeque;

/// A triangle is done if its circumradius is below this fraction of the wanted size; the regular
/// triangle has 0.577.
///
/// 0.75 makes 5 % more triangles on a square than regular ones of the wanted size, 0.7 makes 12 %
/// more; with 0.8 large triangles remain that the improvement must split.
const DONE: f64 = 0.75;
/// A triangle with an edge longer than this many times the least size at its corners is not done
/// while it is at more than 45° (cosine [`FOLLOWS`]) to the surface. This matters for sizes without
/// grading, as at the rim of a flat ellipsoid.
const SPAN: f64 = 2.0;
/// See [`SPAN`].
const FOLLOWS: f64 = 0.7;
/// Least distance of a new vertex from others, as a fraction of the wanted size. From 0.75 on the
/// front leaves large triangles, below 0.5 short edges that the improvement must collapse.
const CLOSE: f64 = 0.65;
/// Least distance of a new vertex from a segment, as a fraction of its length: closer vertices
/// would have an obtuse angle.
const CLOSE_TO_SEGMENT: f64 = 0.35;
/// An edge whose length is in this range, in units of the wanted size, is a base even if no
/// adjacent triangle is done.
const RIGHT_LENGTH: [f64; 2] = [0.8, 1.25];
/// The most steps of a walk: a new vertex is about three triangles away from its base.
const STEPS: usize = 100;

/// Cached state of a triangle, valid while it has these corners.
#[derive(Clone, Copy)]
struct Known {
    v: [u32; 3],
    done: bool,
    /// The sides at which no vertex could be placed.
    blocked: [bool; 3],
}

/// Statistics of one run.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Advanced {
    /// Inserted vertices.
    pub inserted: usize,
    /// Rejected positions.
    pub refused: usize,
}

struct Front<'s, 'a> {
    sheet: &'s mut Sheet<'a>,
    known: Vec<Known>,
    queue: VecDeque<(u32, [u32; 3])>,
    counts: Advanced,
    /// The first triangle that [`Front::seed`] has not examined.
    unseen: u32,
}

/// Fills a sheet with vertices at the wanted distances, up to `limit` vertices.
///
/// # Errors
/// [`Stop::Size`] if the size field returns a value that is not positive and finite.
pub(super) fn advance(sheet: &mut Sheet, limit: usize) -> Result<Advanced, Stop> {
    let mut front =
        Front { sheet, known: Vec::new(), queue: VecDeque::new(), counts: Advanced::default(), unseen: 0 };
    let all: Vec<u32> = front.sheet.mesh.living().collect();
    for &t in &all {
        if front.sheet.mesh.at(t).segment != [NONE; 3] {
            front.push(t);
        }
    }
    for &t in &all {
        front.push(t);
    }
    while front.sheet.nodes.len() < limit {
        let Some((t, v)) = front.queue.pop_front() else {
            if front.seed()? {
                continue;
            }
            break;
        };
        if front.sheet.mesh.at(t).v == v {
            front.process(t)?;
        }
    }
    Ok(front.counts)
}

impl Front<'_, '_> {
    fn push(&mut self, t: u32) {
        self.queue.push_back((t, self.sheet.mesh.at(t).v));
    }

    /// The state of a triangle, computed if necessary.
    fn known(&mut self, t: u32) -> &mut Known {
        let fresh = Known { v: [NONE; 3], done: false, blocked: [false; 3] };
        if self.known.len() <= t as usize {
            self.known.resize(self.sheet.mesh.triangles.len(), fresh);
        }
        let v = self.sheet.mesh.at(t).v;
        if self.known[t as usize].v != v {
            let done = self.is_small(t);
            self.known[t as usize] = Known { v, done, ..fresh };
        }
        &mut self.known[t as usize]
    }

    /// Whether a triangle is done: it has the wanted size, and it follows the surface or all its
    /// edges are short.
    fn is_small(&self, t: u32) -> bool {
        let corners = self.sheet.corners(t);
        let [a, b, c] = corners;
        let [la, lb, lc] = [(b, c), (c, a), (a, b)].map(|(p, q)| (q.point - p.point).norm());
        let area = area_vector(&a.point, &b.point, &c.point);
        let radius = la * lb * lc / (2.0 * area.norm());
        if radius.is_nan() || radius > DONE * (a.size + b.size + c.size) / 3.0 {
            return false;
        }
        let least = a.size.min(b.size).min(c.size);
        la.max(lb).max(lc) <= SPAN * least
            || corners
                .iter()
                .all(|n| n.normal == Vector::zeros() || area.dot(&n.normal) >= FOLLOWS * area.norm())
    }

    /// Tries to place a vertex at the shortest active side of a triangle.
    fn process(&mut self, t: u32) -> Result<(), Stop> {
        let Known { v, done, blocked } = *self.known(t);
        if done {
            return Ok(());
        }
        let x = *self.sheet.mesh.at(t);
        let mut base: Option<(f64, usize)> = None;
        for i in 0..3 {
            if blocked[i] {
                continue;
            }
            let length = self.sheet.length(v[next(i)], v[last(i)]);
            let active = x.segment[i] != NONE
                || x.near[i] == NONE
                || self.known(x.near[i]).done
                || (RIGHT_LENGTH[0]..=RIGHT_LENGTH[1]).contains(&length);
            if active && base.is_none_or(|(shortest, _)| length < shortest) {
                base = Some((length, i));
            }
        }
        let Some((_, i)) = base else { return Ok(()) };
        if let Some(node) = self.ideal(t, i)?
            && let Some(place) = self.sheet.walk(t, &node.site, STEPS)
            && self.put(&node, place)
        {
            return Ok(());
        }
        self.counts.refused += 1;
        self.known(t).blocked[i] = true;
        self.push(t);
        Ok(())
    }

    /// The vertex on the surface that forms a triangle of the wanted size with side `i`; `None` if
    /// the triangle's angle opposite to the side is 90° or more.
    fn ideal(&self, t: u32, i: usize) -> Result<Option<Node>, Stop> {
        let v = self.sheet.mesh.at(t).v;
        let [c, a, b] = [i, next(i), last(i)].map(|k| &self.sheet.nodes[v[k] as usize]);
        let along = b.point - a.point;
        let (ca, cb) = (a.point - c.point, b.point - c.point);
        let half = 0.5 * along.norm();
        // Distance of the circumcentre from the side: half its length times the cotangent of the
        // angle at c.
        let cotangent = ca.dot(&cb) / ca.cross(&cb).norm();
        let reach = half * cotangent;
        let normal = a.normal
            + b.normal
            + if a.normal + b.normal == Vector::zeros() { c.normal } else { Vector::zeros() };
        let Some(inward) = normal.cross(&along).try_normalize(0.0) else { return Ok(None) };
        if reach <= 0.0 || reach.is_nan() {
            return Ok(None);
        }
        let middle = nalgebra::center(&a.point, &b.point);
        let base = 0.5 * (a.size + b.size);
        let height = |size: f64| {
            let radius = size / 3.0_f64.sqrt();
            // At least a right angle at the new vertex, at most the circumcentre (Rebay 1993).
            let radius = radius.max(half).min((half * half + reach * reach) / (2.0 * reach));
            radius + (radius * radius - half * half).max(0.0).sqrt()
        };
        let grown = |mut node: Node| {
            let distance = (node.point - middle).norm();
            node.size = node.size.min(base + self.sheet.settings.growth * distance);
            node
        };
        let found = self.sheet.try_project(&(middle + inward * height(base)))?;
        let Some(first) = found.map(grown) else { return Ok(None) };
        let size = 0.5 * (base + first.size);
        if (height(size) - height(base)).abs() <= 0.05 * height(base) {
            return Ok(Some(first));
        }
        let second = self.sheet.try_project(&(middle + inward * height(size)))?;
        Ok(Some(second.map_or(first, grown)))
    }

    /// Inserts a vertex, or moves a close helper to its position; false if it is too close to a
    /// vertex or segment.
    fn put(&mut self, node: &Node, place: Place) -> bool {
        let t = match place {
            Place::Inside(t) | Place::OnSide(t, _) => t,
            Place::OnVertex(_) => return false,
        };
        let x = *self.sheet.mesh.at(t);
        let mut nearest: Option<(f64, u32)> = None;
        for i in 0..3 {
            if x.segment[i] != NONE {
                let [a, b] = [next(i), last(i)].map(|k| self.sheet.nodes[x.v[k] as usize].point);
                let base = (b - a).norm();
                if 2.0 * area(&a, &b, &node.point) < CLOSE_TO_SEGMENT * base * base.min(node.size) {
                    return false;
                }
            }
            let across = self.sheet.mesh.twin(t, i).map(|(u, j)| self.sheet.mesh.at(u).v[j]);
            for v in [Some(x.v[i]), across].into_iter().flatten() {
                let other = &self.sheet.nodes[v as usize];
                let ratio = (other.point - node.point).norm() / node.size.min(other.size);
                if ratio < CLOSE && nearest.is_none_or(|(least, _)| ratio < least) {
                    nearest = Some((ratio, v));
                }
            }
        }
        let v = match nearest {
            None => match self.sheet.insert(*node, place) {
                Some(v) => v,
                None => return false,
            },
            Some((_, v)) if self.sheet.nodes[v as usize].kind == Kind::Helper => {
                if !self.move_helper(v, node) {
                    return false;
                }
                v
            }
            Some(_) => return false,
        };
        self.counts.inserted += 1;
        self.queue_neighbours(v);
        true
    }

    /// Moves a helper to the position of a new vertex, if its triangles stay valid.
    fn move_helper(&mut self, v: u32, node: &Node) -> bool {
        let mut ring = std::mem::take(&mut self.sheet.ring);
        self.sheet.mesh.around(v, &mut ring);
        let fits = self.sheet.star_price(v, node, &ring).is_some();
        if fits {
            self.sheet.nodes[v as usize] = *node;
            for &t in &ring {
                // The corners are unchanged but the shape is not, so the cached state is invalid.
                if let Some(known) = self.known.get_mut(t as usize) {
                    known.v = [NONE; 3];
                }
            }
            self.sheet.legalise(v, &ring);
        }
        self.sheet.ring = ring;
        fits
    }

    /// Queues the triangles around a new vertex, and the neighbours of those that are done.
    fn queue_neighbours(&mut self, v: u32) {
        let mut ring = Vec::new();
        self.sheet.mesh.around(v, &mut ring);
        for &t in &ring {
            if !self.known(t).done {
                self.push(t);
                continue;
            }
            for u in self.sheet.mesh.at(t).near {
                if u != NONE && !self.known(u).done {
                    self.push(u);
                }
            }
        }
    }

    /// Starts a front if there is none, by a vertex at the wanted distance from a corner of a
    /// triangle that is not done; whether there was such a triangle.
    fn seed(&mut self) -> Result<bool, Stop> {
        while (self.unseen as usize) < self.sheet.mesh.triangles.len() {
            let t = self.unseen;
            self.unseen += 1;
            if !self.sheet.mesh.at(t).lives() {
                continue;
            }
            let known = self.known(t);
            if known.done || known.blocked == [true; 3] {
                continue;
            }
            known.blocked = [true; 3];
            let [a, b, _] = self.sheet.corners(t);
            let along = (b.point - a.point).normalize();
            let (size, target) = (a.size, a.point + along * a.size);
            let Some(node) = self.sheet.try_project(&target)? else { continue };
            if let Some(place) = self.sheet.walk(t, &node.site, STEPS) {
                let node = Node { size: node.size.min(size * (1.0 + self.sheet.settings.growth)), ..node };
                if self.put(&node, place) {
                    return Ok(true);
                }
            }
        }
        Ok(false)
    }
}
