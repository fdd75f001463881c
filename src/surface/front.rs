//! The advancing front: new vertices, layer by layer, each where it makes a good triangle with an edge of the front.
//!
//! The front runs inside a triangulation that is valid at every moment (Rebay 1993, "Efficient unstructured mesh generation
//! by means of Delaunay triangulation and Bowyer-Watson algorithm"; Frey, Borouchaki, George 1998, "3D Delaunay mesh
//! generation coupled with an advancing-front approach"): between triangles that are small enough, **done**, and those that
//! are not. So it can neither collide with itself nor fail to close. Where we depart from Rebay: fronts advance in
//! layers (first in, first out) instead of by the largest triangle, points are placed in the tangent plane of the
//! surface and projected, and a vertex is inserted by a split and swaps.

use super::sheet::{Kind, Node, Place, Sheet, Stop};
use super::topology::{NONE, last, next};
use crate::Vector;
use crate::kernel::simplex::{area, area_vector};
use std::collections::VecDeque;

/// A triangle is done if its circumradius is below this fraction of the wanted size; the regular triangle of that size has
/// 0.577. On a square, 0.7 makes 12 % more triangles than regular ones of the wanted size would be, 0.75 makes 5 % more; with
/// 0.8 holes stay open, which the improvement has to split.
const DONE: f64 = 0.75;
/// A triangle with an edge this many times the least size wanted at its corners is not done as long as it is at more than 45°
/// (cosine [`FOLLOWS`]) to the surface. Sizes that are not graded, as at the rim of a flat ellipsoid, ask for that.
const SPAN: f64 = 2.0;
/// See [`SPAN`].
const FOLLOWS: f64 = 0.7;
/// No new vertex comes nearer to another than this fraction of the wanted size. From 0.75 on the front leaves holes, below
/// 0.5 it leaves edges that the improvement has to collapse.
const CLOSE: f64 = 0.65;
/// No new vertex comes nearer to a segment than this fraction of its length: it would see it under an obtuse angle.
const CLOSE_TO_SEGMENT: f64 = 0.35;
/// An edge of a length between these, in units of the wanted size, is a base also where no triangle beside it is done.
const RIGHT_LENGTH: [f64; 2] = [0.8, 1.25];
/// A new vertex is at most about three triangles away from its base.
const STEPS: usize = 100;

/// What is known of a triangle, as long as it has these corners.
#[derive(Clone, Copy)]
struct Known {
    v: [u32; 3],
    done: bool,
    /// The sides from which no vertex could be placed.
    blocked: [bool; 3],
}

/// Counts of one run.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Advanced {
    /// Vertices inserted.
    pub inserted: usize,
    /// Places refused.
    pub refused: usize,
}

struct Front<'s, 'a> {
    sheet: &'s mut Sheet<'a>,
    known: Vec<Known>,
    queue: VecDeque<(u32, [u32; 3])>,
    counts: Advanced,
    /// The first triangle that [`Front::seed`] has not looked at.
    unseen: u32,
}

/// Fills a sheet with vertices of the wanted spacing, up to `limit` of them.
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
            front.work(t)?;
        }
    }
    Ok(front.counts)
}

impl Front<'_, '_> {
    fn push(&mut self, t: u32) {
        self.queue.push_back((t, self.sheet.mesh.at(t).v));
    }

    /// What is known of a triangle, found out if necessary.
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

    /// Whether a triangle has the wanted size, or is so small that it need not follow the surface better.
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

    /// Tries to place a vertex from one side of a triangle.
    fn work(&mut self, t: u32) -> Result<(), Stop> {
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

    /// The vertex that makes a triangle of the wanted size with a side, on the surface; none if the triangle's own third
    /// corner sees the side under more than a right angle.
    fn ideal(&self, t: u32, i: usize) -> Result<Option<Node>, Stop> {
        let v = self.sheet.mesh.at(t).v;
        let [c, a, b] = [i, next(i), last(i)].map(|k| &self.sheet.nodes[v[k] as usize]);
        let along = b.point - a.point;
        let (ca, cb) = (a.point - c.point, b.point - c.point);
        let half = 0.5 * along.norm();
        // The distance of the circumcentre from the side: half its length times the cotangent of the angle at c.
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
            // At least a right angle at the new vertex, at most the circumcentre's place (Rebay 1993).
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

    /// Inserts a vertex, or moves a helper that is in its way there, unless it is too near to something.
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
                if !self.adopt(v, node) {
                    return false;
                }
                v
            }
            Some(_) => return false,
        };
        self.counts.inserted += 1;
        self.announce(v);
        true
    }

    /// Moves a helper to where the front wants a vertex, if its triangles allow.
    fn adopt(&mut self, v: u32, node: &Node) -> bool {
        let mut ring = std::mem::take(&mut self.sheet.ring);
        self.sheet.mesh.around(v, &mut ring);
        let fits = self.sheet.star_price(v, node, &ring).is_some();
        if fits {
            self.sheet.nodes[v as usize] = *node;
            for &t in &ring {
                // The corners are the same, the shape is not.
                if let Some(known) = self.known.get_mut(t as usize) {
                    known.v = [NONE; 3];
                }
            }
            self.sheet.legalise(v, &ring);
        }
        self.sheet.ring = ring;
        fits
    }

    /// Queues the triangles around a new vertex, and those beside the ones that are done.
    fn announce(&mut self, v: u32) {
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

    /// Begins a front where there is none: a vertex at the wanted distance from one of a triangle that is not done.
    /// Returns whether there was such a triangle.
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
