//! Patches, curves and corners of a triangulated surface.
//!
//! A **crease** is a sharp edge (`sharp`), an edge between different regions or groups, or one with
//! other than two facets. Patches are bounded by creases; curves are the chains of creases between
//! corners. Corners are vertices with other than two creases, sharp turns of a chain, vertices at
//! which a patch touches itself, and the tips of cones. A chain that ends inside a patch is removed
//! if it is short (noise); a longer one is a curve with the same patch on both sides.

use super::{Settings, sharp};
use crate::ground::kernel::sets::Sets;
use crate::ground::projector::facets::edges::Edges;
use crate::{Point, Vector};

/// The vertices of a chain of creases; a closed chain ends with its first vertex.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Chain {
    pub vertices: Vec<u32>,
}

/// The patches, curves and corners found.
#[derive(Clone, Debug, Default)]
pub(super) struct Found {
    /// The patch of each triangle.
    pub patch_of: Vec<u32>,
    pub patches: usize,
    pub chains: Vec<Chain>,
    /// The vertices that are corners, ascending.
    pub corners: Vec<u32>,
}

/// The surface and derived data.
pub(super) struct Input<'a> {
    pub points: &'a [Point],
    pub triangles: &'a [[u32; 3]],
    pub edges: &'a Edges,
    pub normals: &'a [Vector],
    /// A key of each triangle: equal if regions and groups are equal.
    pub keys: &'a [u32],
    /// Rounding of the coordinates (length): see
    /// [`rounding`](crate::ground::projector::facets::normals::rounding).
    pub rounding: f64,
    pub diagonal: f64,
}

/// Finds patches, curves and corners.
pub(super) fn find(input: &Input, settings: &Settings) -> Found {
    let angles = sharp::angles(input);
    let mut crease = sharp::sharp(input, &angles, settings.least_angle, settings.feature_angle);
    close_gaps(input, &angles, &mut crease, settings);
    remove_short_ends(input, &mut crease, settings.shortest_end * input.diagonal);
    let (patch_of, patches) = flood(input, &crease);
    let at_vertex = creases_at(input, &crease);
    let corners = corners(input, settings, &crease, &at_vertex, &patch_of);
    let chains = chains(input, &at_vertex, &corners);
    Found { patch_of, patches, chains, corners }
}

/// The creases at each vertex, as (edge, other end), sorted by edge.
struct AtVertex {
    starts: Vec<u32>,
    spokes: Vec<(u32, u32)>,
}

impl AtVertex {
    fn spokes(&self, v: u32) -> &[(u32, u32)] {
        &self.spokes[self.starts[v as usize] as usize..self.starts[v as usize + 1] as usize]
    }
}

fn creases_at(input: &Input, crease: &[bool]) -> AtVertex {
    let mut all = Vec::new();
    for edge in (0..crease.len()).filter(|&e| crease[e]) {
        let [a, b] = input.edges.uses(edge)[0].ends;
        all.push((a, edge as u32, b));
        all.push((b, edge as u32, a));
    }
    all.sort_unstable();
    let mut starts = vec![0; input.points.len() + 1];
    all.iter().for_each(|(v, _, _)| starts[*v as usize + 1] += 1);
    for v in 0..input.points.len() {
        starts[v + 1] += starts[v];
    }
    AtVertex { starts, spokes: all.into_iter().map(|(_, edge, other)| (edge, other)).collect() }
}

/// The most edges by which a chain of creases is extended to reach another crease.
const LONGEST_GAP: usize = 30;

/// Extends chains with a free end, over edges that turn at least half as much, if that leads to
/// another crease.
///
/// This closes gaps of chains where the angle between facets is ambiguous.
fn close_gaps(input: &Input, angles: &[f64], crease: &mut [bool], settings: &Settings) {
    let at = creases_at(input, crease);
    let is_end = |v: &u32| at.spokes(*v).len() == 1;
    let ends: Vec<u32> = (0..input.points.len() as u32).filter(is_end).collect();
    if ends.is_empty() {
        return;
    }
    let all = creases_at(input, &angles.iter().map(|a| *a > 0.5 * settings.least_angle).collect::<Vec<_>>());
    for end in ends {
        let (edge, before) = at.spokes(end)[0];
        let (mut here, mut came, mut path) = (end, before, Vec::new());
        let least = 0.5 * angles[edge as usize].min(settings.feature_angle);
        while path.len() < LONGEST_GAP {
            let straight = input.points[here as usize] - input.points[came as usize];
            let turn = |w: u32| straight.angle(&(input.points[w as usize] - input.points[here as usize]));
            let next = all
                .spokes(here)
                .iter()
                .filter(|(e, w)| {
                    angles[*e as usize] >= least && *w != came && turn(*w) <= settings.corner_angle
                })
                .min_by(|p, q| turn(p.1).total_cmp(&turn(q.1)));
            let Some(&(e, w)) = next else { break };
            path.push(e);
            if crease[e as usize] || !at.spokes(w).is_empty() {
                path.iter().for_each(|&e| crease[e as usize] = true);
                break;
            }
            (came, here) = (here, w);
        }
    }
}

/// Removes chains with a free end that are no longer than `shortest`.
fn remove_short_ends(input: &Input, crease: &mut [bool], shortest: f64) {
    loop {
        let at = creases_at(input, crease);
        let mut removed = false;
        for v in 0..input.points.len() as u32 {
            if at.spokes(v).len() != 1 {
                continue;
            }
            let (mut chain, mut length, mut here, mut from) = (Vec::new(), 0.0, v, u32::MAX);
            while let Some(&(edge, next)) = at.spokes(here).iter().find(|s| s.0 != from) {
                chain.push(edge);
                length += (input.points[next as usize] - input.points[here as usize]).norm();
                (here, from) = (next, edge);
                if at.spokes(here).len() != 2 || length > shortest {
                    break;
                }
            }
            let necessary = chain.iter().any(|&e| input.edges.pair(e as usize).is_none());
            if length <= shortest && !necessary && chain.iter().all(|&e| crease[e as usize]) {
                chain.iter().for_each(|&e| crease[e as usize] = false);
                removed = true;
            }
        }
        if !removed {
            return;
        }
    }
}

/// The patch of each triangle, numbered by first triangles, and the number of patches.
fn flood(input: &Input, crease: &[bool]) -> (Vec<u32>, usize) {
    let mut sets = Sets::new(input.triangles.len());
    for edge in (0..crease.len()).filter(|&e| !crease[e]) {
        if let Some([a, b]) = input.edges.pair(edge) {
            sets.join(a, b);
        }
    }
    let mut number = vec![u32::MAX; input.triangles.len()];
    let mut count = 0;
    let patch_of = (0..input.triangles.len() as u32)
        .map(|t| {
            let set = sets.find(t) as usize;
            if number[set] == u32::MAX {
                number[set] = count;
                count += 1;
            }
            number[set]
        })
        .collect();
    (patch_of, count as usize)
}

fn corners(input: &Input, settings: &Settings, crease: &[bool], at: &AtVertex, patch_of: &[u32]) -> Vec<u32> {
    let fans = fans(input, crease);
    let sharp = tips(input, settings);
    let patches_beside = |edge: u32| {
        let mut patches: Vec<u32> =
            input.edges.uses(edge as usize).iter().map(|u| patch_of[u.triangle as usize]).collect();
        patches.sort_unstable();
        patches
    };
    let is_corner = |&v: &u32| match at.spokes(v) {
        [] => fans[v as usize] > 1 || sharp[v as usize],
        [(e, _), (f, _)] => {
            let uses = input.edges.uses(*e as usize).len() + input.edges.uses(*f as usize).len();
            2 * fans[v as usize] as usize != uses
                || patches_beside(*e) != patches_beside(*f)
                || turn_at(input, at, v) > settings.corner_angle
        }
        _ => true,
    };
    (0..input.points.len() as u32).filter(is_corner).collect()
}

/// The number of fans into which creases divide the triangles at each vertex.
fn fans(input: &Input, crease: &[bool]) -> Vec<u32> {
    let corner = |t: u32, v: u32| {
        let k = input.triangles[t as usize].iter().position(|&w| w == v).unwrap_or(0);
        3 * t + k as u32
    };
    let mut sets = Sets::new(3 * input.triangles.len());
    for edge in (0..crease.len()).filter(|&e| !crease[e]) {
        if let Some([s, t]) = input.edges.pair(edge) {
            let ends = input.edges.uses(edge)[0].ends;
            ends.iter().for_each(|&v| sets.join(corner(s, v), corner(t, v)));
        }
    }
    let mut fans = vec![0; input.points.len()];
    for (t, triangle) in input.triangles.iter().enumerate() {
        for (k, &v) in triangle.iter().enumerate() {
            let own = 3 * t as u32 + k as u32;
            fans[v as usize] += u32::from(sets.find(own) == own);
        }
    }
    fans
}

/// Whether each vertex is like the tip of a cone: its angle defect or excess is more than
/// `tip_angle`.
fn tips(input: &Input, settings: &Settings) -> Vec<bool> {
    let mut angles = vec![0.0; input.points.len()];
    let mut shortest = vec![f64::INFINITY; input.points.len()];
    for triangle in input.triangles {
        for k in 0..3 {
            let [v, a, b] = [0, 1, 2].map(|i| triangle[(k + i) % 3]);
            let [p, q, r] = [v, a, b].map(|v| &input.points[v as usize]);
            angles[v as usize] += (q - p).angle(&(r - p));
            shortest[v as usize] = f64::min(shortest[v as usize], (q - p).norm());
        }
    }
    let tip = |(angle, shortest): (&f64, &f64)| {
        (std::f64::consts::TAU - angle).abs() > settings.tip_angle && *shortest > SHORT_EDGE * input.rounding
    };
    angles.iter().zip(&shortest).map(tip).collect()
}

/// Edges shorter than this many roundings have no reliable direction.
const SHORT_EDGE: f64 = 50.0;

/// The turning angle of a chain at a vertex with two creases, measured with the first vertices on
/// either side that are far enough compared with the rounding.
fn turn_at(input: &Input, at: &AtVertex, v: u32) -> f64 {
    let here = &input.points[v as usize];
    let direction = |k: usize| {
        let (mut edge, mut next) = at.spokes(v)[k];
        while (input.points[next as usize] - here).norm() < SHORT_EDGE * input.rounding {
            match at.spokes(next) {
                [a, b] if next != v => (edge, next) = if a.0 == edge { *b } else { *a },
                _ => break,
            }
        }
        input.points[next as usize] - here
    };
    let (before, after) = (direction(0), direction(1));
    (-before).angle(&after)
}

/// The chains between corners, ordered by first corner, then the closed ones, ordered by lowest
/// vertex.
fn chains(input: &Input, at: &AtVertex, corners: &[u32]) -> Vec<Chain> {
    let mut is_corner = vec![false; input.points.len()];
    corners.iter().for_each(|&v| is_corner[v as usize] = true);
    let mut taken = vec![false; input.edges.len()];
    let mut chains = Vec::new();
    let closed = (0..input.points.len() as u32).filter(|&v| !is_corner[v as usize]);
    for start in corners.iter().copied().chain(closed) {
        for &(mut edge, mut next) in at.spokes(start) {
            if taken[edge as usize] {
                continue;
            }
            let mut vertices = vec![start];
            loop {
                taken[edge as usize] = true;
                vertices.push(next);
                if next == start || is_corner[next as usize] {
                    break;
                }
                let Some(&on) = at.spokes(next).iter().find(|s| s.0 != edge) else { break };
                (edge, next) = on;
            }
            chains.push(Chain { vertices });
        }
    }
    chains
}
