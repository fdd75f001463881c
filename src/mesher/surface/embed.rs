//! The first triangulation of a sheet: all boundary vertices and segments, and nothing outside.

use super::chart::Site;
use super::plane;
use super::sheet::{Kind, Node, Place, Sheet};
use super::topology::{NONE, Topology, last, next};
use crate::ground::kernel::predicates::Sign;
use crate::{Point, Vector};
use std::collections::VecDeque;

/// A segment that is too long for its surroundings, in local numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Conflict {
    /// The first segment crosses the second.
    Crossing(u32, u32),
    /// A segment passes through a vertex.
    Through(u32, u32),
    /// A segment spans half a turn or more.
    TooLong(u32),
}

/// Why the first triangulation failed, in local numbers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Fault {
    /// A vertex of the initial triangulation coincides with a boundary vertex or segment: try
    /// another one.
    StartInTheWay,
    /// Two vertices have the same site.
    Coincident(u32, u32),
    /// Segments are too long: all that were found, at least one.
    Coarse(Vec<Conflict>),
    /// The side of this segment that is used as outside is inside.
    BothSides(u32),
    /// The inside, as given by segments and seeds, is not bounded.
    Open,
    /// Coordinates are too large or not finite.
    NotNumbers,
}

/// The most initial triangulations tried. One suffices unless a boundary vertex coincides exactly
/// with one of its few vertices.
const STARTS: u32 = 4;

/// Triangulates the sheet whose nodes are the boundary vertices.
///
/// `uses` lists segments with the direction in which the inside is on their left; a seed is a site
/// inside. Boundary vertices that are outside remain without triangles.
///
/// # Errors
/// The [`Fault`], with all segments that are too long if there are any.
pub(super) fn embed(sheet: &mut Sheet, uses: &[(u32, bool)], seeds: &[Site]) -> Result<(), Fault> {
    let fixed = sheet.nodes.len();
    for attempt in 0..STARTS {
        sheet.nodes.truncate(fixed);
        let done =
            if sheet.chart.is_flat() { triangulate_flat(sheet) } else { triangulate_round(sheet, attempt) };
        let done = done.and_then(|()| check_order(sheet)).and_then(|()| carve(sheet, uses, seeds));
        if done != Err(Fault::StartInTheWay) {
            return done;
        }
    }
    Err(Fault::StartInTheWay)
}

/// The constrained Delaunay triangulation of a flat sheet.
fn triangulate_flat(sheet: &mut Sheet) -> Result<(), Fault> {
    let points: Vec<_> = sheet.nodes.iter().map(|n| [n.site[0], n.site[1]]).collect();
    let edges: Vec<_> = sheet.pieces.iter().map(|p| p.ends).collect();
    let triangles = plane::triangulate(&points, &edges).ok_or(Fault::NotNumbers)?;
    sheet.mesh = Topology::from_triangles(points.len(), &triangles).ok_or(Fault::NotNumbers)?;
    // Vertices and segments that spade could not insert are examined again here, for the reason.
    for v in 0..points.len() as u32 {
        if !sheet.mesh.is_used(v) {
            let site = sheet.nodes[v as usize].site;
            return match sheet.locate(NONE, &site) {
                Some(Place::OnVertex(w)) => Err(Fault::Coincident(v, w)),
                _ => Err(Fault::Open),
            };
        }
    }
    recover_all(sheet)
}

/// Inserts all boundary vertices into a triangulation of the whole sheet, then all segments.
fn triangulate_round(sheet: &mut Sheet, attempt: u32) -> Result<(), Fault> {
    let fixed = sheet.nodes.len() as u32;
    let apex = (0..fixed).find(|&v| sheet.chart.is_pole(&sheet.nodes[v as usize].site));
    let heights = sheet
        .nodes
        .iter()
        .filter(|n| !sheet.chart.is_pole(&n.site))
        .fold([0.0_f64, 0.0], |[lo, hi], n| [lo.min(n.site[1]), hi.max(n.site[1])]);
    let start = sheet.chart.start(heights, attempt);
    // Initial vertices are numbered after the boundary vertices, but the apex replaces its pole.
    let number = |k: u32| match apex {
        Some(apex) if sheet.nodes[apex as usize].site == start.sites[k as usize] => apex,
        _ => fixed + k,
    };
    let triangles: Vec<_> = start.triangles.iter().map(|t| t.map(number)).collect();
    for site in &start.sites {
        let node = helper(sheet, site)?;
        sheet.nodes.push(node);
    }
    sheet.mesh = Topology::from_triangles(sheet.nodes.len(), &triangles).expect("the start is a surface");
    let mut near = NONE;
    for v in 0..fixed {
        let node = sheet.nodes[v as usize];
        if Some(v) == apex {
            continue;
        }
        let place = sheet.locate(near, &node.site).ok_or(Fault::StartInTheWay)?;
        if let Place::OnVertex(w) = place {
            return Err(if w < fixed { Fault::Coincident(v, w) } else { Fault::StartInTheWay });
        }
        sheet.insert_vertex(v, place);
        sheet.mesh.around(v, &mut sheet.ring);
        near = sheet.ring[0];
    }
    recover_all(sheet)
}

/// A vertex of the initial triangulation.
fn helper(sheet: &Sheet, site: &Site) -> Result<Node, Fault> {
    let Some(near) = sheet.chart.point(site).filter(|_| sheet.chart.is_closed()) else {
        let (point, normal) = (Point::origin(), Vector::zeros());
        return Ok(Node { point, normal, site: *site, size: 1.0, kind: Kind::Outside });
    };
    // The projected point defines the site, which differs from the initial one by rounding only.
    let mut node = sheet.project(&near).map_err(|_| Fault::StartInTheWay)?;
    node.kind = Kind::Helper;
    Ok(node)
}

/// Makes each segment an edge; continues after failures, to report all.
fn recover_all(sheet: &mut Sheet) -> Result<(), Fault> {
    let mut conflicts = Vec::new();
    for s in 0..sheet.pieces.len() as u32 {
        // Search around an ordinary vertex, because poles have many triangles.
        let [mut a, mut b] = sheet.pieces[s as usize].ends;
        if sheet.chart.is_pole(&sheet.nodes[a as usize].site) {
            [a, b] = [b, a];
        }
        let mut ring = std::mem::take(&mut sheet.ring);
        let mut found = sheet.mesh.find(a, b, &mut ring);
        if found.is_none() {
            // On the hull of a flat sheet only the opposite direction may exist.
            found = sheet.mesh.find(b, a, &mut ring);
        }
        sheet.ring = ring;
        let recovered = found.map_or_else(|| recover(sheet, s, a, b), Ok);
        match recovered.map(|(t, i)| (t, i, sheet.mesh.at(t).segment[i])) {
            Ok((t, i, NONE)) => sheet.mesh.set_segment(t, i, s),
            Ok((_, _, there)) => conflicts.push(Conflict::Crossing(s, there)),
            Err(Obstacle::Start) => return Err(Fault::StartInTheWay),
            Err(Obstacle::Conflict(conflict)) => conflicts.push(conflict),
        }
    }
    if conflicts.is_empty() { Ok(()) } else { Err(Fault::Coarse(conflicts)) }
}

/// What prevents a segment from being an edge.
enum Obstacle {
    /// A vertex of the initial triangulation.
    Start,
    Conflict(Conflict),
}

impl From<Conflict> for Obstacle {
    fn from(conflict: Conflict) -> Self {
        Self::Conflict(conflict)
    }
}

/// Makes segment `s` from `a` to `b` an edge by swapping the edges that cross it (Sloan 1993, "A
/// fast algorithm for generating constrained Delaunay triangulations"); returns its side.
fn recover(sheet: &mut Sheet, s: u32, a: u32, b: u32) -> Result<(u32, usize), Obstacle> {
    let mut crossing = crossed_edges(sheet, s, a, b)?;
    let site = |sheet: &Sheet, v: u32| sheet.nodes[v as usize].site;
    let (from, to) = (site(sheet, a), site(sheet, b));
    // Each round over the queue swaps at least one edge for one with fewer crossings; this
    // quadratic bound is far above need.
    let mut budget = 16 + 4 * crossing.len() * crossing.len();
    let mut ring = Vec::new();
    while let Some([x, y]) = crossing.pop_front() {
        if budget == 0 {
            return Err(Conflict::TooLong(s).into());
        }
        budget -= 1;
        let (t, i) = sheet.mesh.find(x, y, &mut ring).ok_or(Conflict::TooLong(s))?;
        let (u, j) = sheet.mesh.twin(t, i).ok_or(Conflict::TooLong(s))?;
        let (p, d) = (sheet.mesh.at(t).v[i], sheet.mesh.at(u).v[j]);
        if !sheet.fits(p, x, d) || !sheet.fits(p, d, y) {
            crossing.push_back([x, y]);
            continue;
        }
        sheet.mesh.flip(t, i);
        if [p, d].iter().any(|v| [a, b].contains(v)) {
            continue;
        }
        let side = |v: u32| sheet.chart.orient(&from, &to, &site(sheet, v));
        if side(p) != side(d) {
            crossing.push_back([p, d]);
        }
    }
    sheet.mesh.find(a, b, &mut ring).ok_or(Conflict::TooLong(s).into())
}

/// The edges that segment `s` from `a` to `b` crosses, in order, each from its right to its left
/// end.
fn crossed_edges(sheet: &Sheet, s: u32, a: u32, b: u32) -> Result<VecDeque<[u32; 2]>, Obstacle> {
    let site = |v: u32| &sheet.nodes[v as usize].site;
    let side = |v: u32| sheet.chart.orient(site(a), site(b), site(v));
    let through = |v: u32| {
        let start = matches!(sheet.nodes[v as usize].kind, Kind::Helper | Kind::Outside);
        if start { Obstacle::Start } else { Conflict::Through(s, v).into() }
    };
    let mut ring = Vec::new();
    sheet.mesh.around(a, &mut ring);
    let mut entry = None;
    for &t in &ring {
        let x = sheet.mesh.at(t);
        let k = x.corner(a);
        let (right, left) = (x.v[next(k)], x.v[last(k)]);
        for v in [right, left] {
            if side(v) == Sign::Zero && sheet.chart.ahead(site(a), site(b), site(v)) {
                return Err(through(v));
            }
        }
        let turn = |p: u32, q: u32| sheet.chart.orient(site(a), site(p), site(q));
        if turn(right, b) == Sign::Positive && turn(b, left) == Sign::Positive {
            entry = Some((t, k));
        }
    }
    let (mut t, mut i) = entry.ok_or(Conflict::TooLong(s))?;
    let mut crossed = VecDeque::new();
    // A segment cannot cross more triangles than there are.
    for _ in 0..sheet.mesh.triangles.len() {
        let x = sheet.mesh.at(t);
        if x.segment[i] != NONE {
            return Err(Conflict::Crossing(s, x.segment[i]).into());
        }
        crossed.push_back([x.v[next(i)], x.v[last(i)]]);
        let (u, j) = sheet.mesh.twin(t, i).ok_or(Conflict::TooLong(s))?;
        let apex = sheet.mesh.at(u).v[j];
        if apex == b {
            return Ok(crossed);
        }
        // In u, corner j+1 is on the left of the segment and j+2 on the right.
        (t, i) = match side(apex) {
            Sign::Zero => return Err(through(apex)),
            Sign::Positive => (u, next(j)),
            Sign::Negative => (u, last(j)),
        };
    }
    Err(Conflict::TooLong(s).into())
}

/// Checks that segments leave their vertices in the order of their curves.
///
/// If two curves leave a corner at a small angle and one has fewer segments, its chord may be on
/// the wrong side of the other curve: nothing crosses, but the region between the curves is
/// inverted.
fn check_order(sheet: &Sheet) -> Result<(), Fault> {
    /// Below this sine the order of two directions is decided by rounding, or the surfaces are
    /// tangent.
    const LEAST_SINE: f64 = 1e-6;
    let mut ends: Vec<(u32, u32, usize)> = Vec::with_capacity(2 * sheet.pieces.len());
    for (s, piece) in (0..).zip(&sheet.pieces) {
        ends.extend((0..2).map(|k| (piece.ends[k], s, k)));
    }
    ends.sort_unstable();
    // A curve without a tangent has the direction of its chord, which gives no order.
    let own_direction = |&(v, s, k): &(u32, u32, usize)| {
        let piece = &sheet.pieces[s as usize];
        let other = piece.ends[1 - k];
        let chord = sheet.nodes[other as usize].point - sheet.nodes[v as usize].point;
        let direction = piece.tangents[k];
        (chord.try_normalize(0.0) != Some(direction)).then_some((s, other, direction))
    };
    let mut conflicts = Vec::new();
    for at in ends.chunk_by(|x, y| x.0 == y.0) {
        let v = at[0].0;
        let here: Vec<_> = at.iter().filter_map(own_direction).collect();
        for (i, &(s, p, to_p)) in here.iter().enumerate() {
            for &(t, q, to_q) in &here[i + 1..] {
                let sine = to_p.cross(&to_q).dot(&sheet.nodes[v as usize].normal);
                let is_turned = if sine > 0.0 { sheet.fits(v, q, p) } else { sheet.fits(v, p, q) };
                if p != q && to_p.dot(&to_q) > 0.0 && sine.abs() > LEAST_SINE && is_turned {
                    conflicts.push(Conflict::Crossing(s, t));
                }
            }
        }
    }
    if conflicts.is_empty() { Ok(()) } else { Err(Fault::Coarse(conflicts)) }
}

/// Keeps the triangles inside: those on the left of a used segment or at a seed, and all connected
/// to them without crossing a segment.
fn carve(sheet: &mut Sheet, uses: &[(u32, bool)], seeds: &[Site]) -> Result<(), Fault> {
    let mut inside = vec![false; sheet.mesh.triangles.len()];
    let mut stack = Vec::new();
    let mut lefts = vec![[NONE; 2]; sheet.pieces.len()];
    for t in sheet.mesh.living() {
        for (i, &s) in sheet.mesh.at(t).segment.iter().enumerate() {
            if s != NONE {
                let forward = sheet.mesh.at(t).v[next(i)] == sheet.pieces[s as usize].ends[0];
                lefts[s as usize][usize::from(!forward)] = t;
            }
        }
    }
    let mut used = vec![[false; 2]; sheet.pieces.len()];
    for &(s, forward) in uses {
        used[s as usize][usize::from(!forward)] = true;
        match lefts[s as usize][usize::from(!forward)] {
            NONE => return Err(Fault::Open),
            t => stack.push(t),
        }
    }
    for seed in seeds {
        match sheet.locate(NONE, seed) {
            Some(Place::Inside(t) | Place::OnSide(t, _)) => stack.push(t),
            Some(Place::OnVertex(v)) => {
                sheet.mesh.around(v, &mut sheet.ring);
                stack.push(sheet.ring[0]);
            }
            None => return Err(Fault::Open),
        }
    }
    while let Some(t) = stack.pop() {
        if std::mem::replace(&mut inside[t as usize], true) {
            continue;
        }
        let x = sheet.mesh.at(t);
        if x.v.iter().any(|&v| sheet.nodes[v as usize].kind == Kind::Outside) {
            return Err(Fault::Open);
        }
        for i in 0..3 {
            match (x.segment[i], x.near[i]) {
                (NONE, NONE) => return Err(Fault::Open),
                (NONE, u) => stack.push(u),
                _ => {}
            }
        }
    }
    // Both sides may be inside only if both are used.
    for &(s, forward) in uses {
        let other = lefts[s as usize][usize::from(forward)];
        if other != NONE && inside[other as usize] && !used[s as usize][usize::from(forward)] {
            return Err(Fault::BothSides(s));
        }
    }
    keep(sheet, &inside);
    Ok(())
}

/// Removes the triangles outside, and initial vertices without triangles.
fn keep(sheet: &mut Sheet, inside: &[bool]) {
    let mut used: Vec<bool> = sheet.nodes.iter().map(|n| n.kind == Kind::Fixed).collect();
    for t in sheet.mesh.living().filter(|&t| inside[t as usize]) {
        for v in sheet.mesh.at(t).v {
            used[v as usize] = true;
        }
    }
    let mut old_to_new = vec![NONE; sheet.nodes.len()];
    let mut count = 0;
    for (v, _) in used.iter().enumerate().filter(|&(_, &u)| u) {
        old_to_new[v] = count;
        count += 1;
    }
    let mut k = 0;
    sheet.nodes.retain(|_| {
        k += 1;
        used[k - 1]
    });
    sheet.mesh.retain(inside, &old_to_new, count as usize);
}
