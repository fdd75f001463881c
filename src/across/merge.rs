//! Vertices of the geometry's boundary that cuts have left too near to others: merged into these.
//!
//! Where a plane passes near a corner, a curve or another plane, the lines that it leaves on the boundary make short edges and narrow triangles, which
//! nothing inside can mend. When the interface has moved on, nobody needs those lines. So a vertex inside a patch or a curve may be merged into a
//! neighbour on the same patch or curve: if the smallest angle of the tets around it rises by that, and the boundary there stays where it is but for
//! a little (planes and straight lines exactly).

use crate::Point;
use crate::kernel::nearest::in_segment;
use crate::kernel::predicates::{Sign, orient3d};
use crate::kernel::simplex::{area_vector, largest_cosine, squared_distance};
use crate::mesh::Class;
use csg::{BodyId, PatchId};
use std::collections::BTreeMap;

/// How far a vertex may lie off what takes its place, in units of the longest edge there: less than half the chord error of the coarsest preset on a ball.
const OFF: f64 = 0.03;

/// New triangles may be turned against the old ones of their patch round the vertex by an angle with this cosine.
const TURN: f64 = 0.95;

/// Rounds over all bad tets at most.
const PASSES: usize = 4;

/// Tets with their boundary, while vertices are merged.
pub(super) struct Merger<'a> {
    points: &'a [Point],
    classes: &'a [Class],
    /// Which vertices may vanish: they have no tets elsewhere.
    loose: &'a [bool],
    /// Which vertices other ranks may have too.
    shared: &'a [bool],
    /// Tets; none where one vanished.
    pub tets: Vec<Option<([u32; 4], BodyId)>>,
    /// Triangles on patches, as seen from behind; none where one vanished.
    pub triangles: Vec<Option<([u32; 3], PatchId)>>,
    /// Edges on curves and patches.
    pub edges: BTreeMap<[u32; 2], Class>,
    /// Vertices that vanished.
    pub gone: Vec<u32>,
    tets_at: Vec<Vec<u32>>,
    triangles_at: Vec<Vec<u32>>,
}

/// A vertex, that into which it is merged, and the largest cosine of an angle of the tets there then.
type Merge = (u32, u32, f64);

fn ends(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// The list with one vertex in place of another; `None` if it has both.
fn replaced<const N: usize>(list: [u32; N], old: u32, new: u32) -> Option<[u32; N]> {
    (!list.contains(&new)).then(|| list.map(|v| if v == old { new } else { v }))
}

/// Which entries of a list have each vertex.
fn incidence<const N: usize>(vertices: usize, entries: impl Iterator<Item = [u32; N]>) -> Vec<Vec<u32>> {
    let mut at = vec![Vec::new(); vertices];
    for (k, entry) in (0..).zip(entries) {
        entry.iter().for_each(|&v| at[v as usize].push(k));
    }
    at
}

impl<'a> Merger<'a> {
    /// Of tets, triangles and edges whose vertices lie at `points` and in `classes`.
    pub fn new(
        (points, classes): (&'a [Point], &'a [Class]),
        loose: &'a [bool],
        shared: &'a [bool],
        tets: Vec<([u32; 4], BodyId)>,
        triangles: Vec<([u32; 3], PatchId)>,
        edges: BTreeMap<[u32; 2], Class>,
    ) -> Self {
        Self {
            tets_at: incidence(points.len(), tets.iter().map(|tet| tet.0)),
            triangles_at: incidence(points.len(), triangles.iter().map(|triangle| triangle.0)),
            tets: tets.into_iter().map(Some).collect(),
            triangles: triangles.into_iter().map(Some).collect(),
            gone: Vec::new(),
            points,
            classes,
            loose,
            shared,
            edges,
        }
    }

    /// Merges vertices at tets that have a smaller dihedral angle than `angle`, the worst first.
    pub fn run(&mut self, angle: f64) {
        let limit = angle.to_radians().cos();
        for _ in 0..PASSES {
            let before = self.gone.len();
            let mut bad: Vec<(f64, u32)> = (0..self.tets.len() as u32)
                .map(|t| (self.cosine(t), t))
                .filter(|bad| bad.0 > limit)
                .collect();
            bad.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
            for (cosine, t) in bad {
                if self.cosine(t).to_bits() == cosine.to_bits()
                    && let Some((vertex, into, _)) = self.best_at(t)
                {
                    self.merge(vertex, into);
                }
            }
            if self.gone.len() == before {
                break;
            }
        }
    }

    /// The largest cosine of a tet's angles; less than any if it vanished.
    fn cosine(&self, tet: u32) -> f64 {
        self.tets[tet as usize].map_or(-2.0, |(tet, _)| largest_cosine(&self.corners(tet)))
    }

    fn corners<const N: usize>(&self, entry: [u32; N]) -> [Point; N] {
        entry.map(|v| self.points[v as usize])
    }

    /// The best merge of a vertex of a tet.
    fn best_at(&self, tet: u32) -> Option<Merge> {
        let (tet, _) = self.tets[tet as usize]?;
        let loose = tet.into_iter().filter(|&v| self.loose[v as usize]);
        let merges = loose.flat_map(|vertex| self.merges(vertex));
        merges.min_by(|a, b| a.2.total_cmp(&b.2))
    }

    /// The merges of a vertex that make the tets around it better.
    fn merges(&self, vertex: u32) -> Vec<Merge> {
        let beside = self.neighbours(vertex);
        let class = self.classes[vertex as usize];
        let is_along = |into: u32| self.edges.get(&ends(vertex, into)) == Some(&class);
        let along: Vec<u32> = beside.iter().copied().filter(|&into| is_along(into)).collect();
        let candidates = match class {
            Class::Patch(_) => beside,
            // Inside a curve that goes on on both sides.
            Class::Curve(_) if along.len() == 2 => along.clone(),
            _ => Vec::new(),
        };
        let now = self.tets_at[vertex as usize].iter().map(|&t| self.cosine(t)).fold(-1.0, f64::max);
        let merge = |into: u32| {
            let end = along.iter().copied().find(|&end| matches!(class, Class::Curve(_)) && end != into);
            let fits = end.is_none_or(|end| self.stays_on_line(vertex, [into, end]));
            let fits = fits && self.keeps_edges(vertex, into) && self.stays_on_patches(vertex, into);
            let then = if fits { self.merged(vertex, into)? } else { return None };
            (then < now).then_some((vertex, into, then))
        };
        candidates.into_iter().filter_map(merge).collect()
    }

    /// The vertices that a vertex has edges to on the boundary, ascending.
    fn neighbours(&self, vertex: u32) -> Vec<u32> {
        let triangles = self.triangles_at[vertex as usize].iter().filter_map(|&t| self.triangles[t as usize]);
        let mut beside: Vec<u32> = triangles.flat_map(|t| t.0).filter(|&v| v != vertex).collect();
        beside.sort_unstable();
        beside.dedup();
        beside
    }

    /// The largest cosine of the tets round the vertex after the merge, if all stand positively.
    fn merged(&self, vertex: u32, into: u32) -> Option<f64> {
        let mut largest = None;
        for &t in &self.tets_at[vertex as usize] {
            let Some((tet, _)) = self.tets[t as usize] else { continue };
            let Some(tet) = replaced(tet, vertex, into) else { continue };
            let p = self.corners(tet);
            if orient3d(&p[0], &p[1], &p[2], &p[3]) != Sign::Positive {
                return None;
            }
            largest = Some(f64::max(largest.unwrap_or(-1.0), largest_cosine(&p)));
        }
        largest
    }

    fn stays_on_line(&self, vertex: u32, line: [u32; 2]) -> bool {
        let [p, a, b] = self.corners([vertex, line[0], line[1]]);
        in_segment(&p, &a, &b).1 <= (OFF * (b - a).norm()).powi(2)
    }

    /// Whether edges of the boundary stay edges of as many triangles, and no other rank has to hear of new ones.
    fn keeps_edges(&self, vertex: u32, into: u32) -> bool {
        let beside = self.neighbours(vertex);
        let common = beside.iter().filter(|&&v| self.edges.contains_key(&ends(v, into))).count();
        let at_edge = self.triangles_at[vertex as usize]
            .iter()
            .filter(|&&t| self.triangles[t as usize].is_some_and(|t| t.0.contains(&into)));
        let is_silent = |v: u32| {
            let known = self.edges.get(&ends(v, into));
            let both = self.shared[v as usize] && self.shared[into as usize];
            !both || known.is_some_and(|known| *known <= self.edges[&ends(v, vertex)])
        };
        common == at_edge.count() && beside.iter().filter(|&&v| v != into).all(|&v| is_silent(v))
    }

    /// Whether the new triangles lie where the old ones did, each patch for itself.
    fn stays_on_patches(&self, vertex: u32, into: u32) -> bool {
        let mut at: Vec<([u32; 3], PatchId)> =
            self.triangles_at[vertex as usize].iter().filter_map(|&t| self.triangles[t as usize]).collect();
        at.sort_unstable_by_key(|t| t.1);
        at.chunk_by(|a, b| a.1 == b.1).all(|of_patch| {
            let normal = |t: [u32; 3]| {
                let [a, b, c] = self.corners(t);
                area_vector(&a, &b, &c)
            };
            let old: crate::Vector = of_patch.iter().map(|t| normal(t.0)).sum();
            let new: Vec<[u32; 3]> = of_patch.iter().filter_map(|t| replaced(t.0, vertex, into)).collect();
            let turned = |&t: &[u32; 3]| normal(t).dot(&old) < TURN * normal(t).norm() * old.norm();
            let point = &self.points[vertex as usize];
            let (mut off, mut longest) = (f64::INFINITY, 0.0_f64);
            for &t in &new {
                let [a, b, c] = &self.corners(t);
                off = off.min(squared_distance(point, [a, b, c]));
                longest = longest.max((b - a).norm()).max((c - b).norm()).max((a - c).norm());
            }
            !new.is_empty() && !new.iter().any(turned) && off <= (OFF * longest).powi(2)
        })
    }

    /// Does it.
    fn merge(&mut self, vertex: u32, into: u32) {
        for v in self.neighbours(vertex) {
            let class = self.edges.remove(&ends(v, vertex)).expect("an edge of a triangle on a patch");
            if v != into {
                let known = self.edges.entry(ends(v, into)).or_insert(class);
                *known = (*known).min(class);
            }
        }
        for t in std::mem::take(&mut self.tets_at[vertex as usize]) {
            let slot = &mut self.tets[t as usize];
            let Some((tet, body)) = *slot else { continue };
            *slot = replaced(tet, vertex, into).map(|tet| (tet, body));
            if slot.is_some() {
                self.tets_at[into as usize].push(t);
            }
        }
        for t in std::mem::take(&mut self.triangles_at[vertex as usize]) {
            let slot = &mut self.triangles[t as usize];
            let Some((triangle, patch)) = *slot else { continue };
            *slot = replaced(triangle, vertex, into).map(|triangle| (triangle, patch));
            if slot.is_some() {
                self.triangles_at[into as usize].push(t);
            }
        }
        self.gone.push(vertex);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::simplex::volume;
    use crate::mesh::{Mesh, VertexId};
    use crate::refine::fixtures::{ball, cube};

    /// Merges what may be merged in a mesh with nothing around it: the vertices that vanish, and the volume that is left.
    fn merged(mesh: &Mesh, angle: f64) -> (Vec<u32>, f64) {
        let loose = vec![true; mesh.points.len()];
        let shared = vec![false; mesh.points.len()];
        let ids = |vertices: &[VertexId; 4]| vertices.map(|v| v.0);
        let mut edges = BTreeMap::new();
        for t in &mesh.triangles {
            let [a, b, c] = t.vertices.map(|v| v.0);
            for [a, b] in [[a, b], [b, c], [c, a]] {
                edges.insert(ends(a, b), Class::Patch(t.patch));
            }
        }
        let curves = mesh.segments.iter().map(|s| (s.vertices.map(|v| v.0), Class::Curve(s.curve)));
        edges.extend(curves.map(|([a, b], class)| (ends(a, b), class)));
        let tets = mesh.tets.iter().map(ids).zip(mesh.bodies.iter().copied()).collect();
        let triangles = mesh.triangles.iter().map(|t| (t.vertices.map(|v| v.0), t.patch)).collect();
        let mut merger = Merger::new((&mesh.points, &mesh.classes), &loose, &shared, tets, triangles, edges);
        merger.run(angle);
        let corners = merger.tets.iter().flatten().map(|(tet, _)| tet.map(|v| mesh.points[v as usize]));
        let left = corners.map(|[a, b, c, d]| volume(&a, &b, &c, &d)).sum();
        let sides =
            merger.triangles.iter().flatten().flat_map(|([a, b, c], _)| [[*a, *b], [*b, *c], [*c, *a]]);
        assert!(sides.into_iter().all(|[a, b]| merger.edges.contains_key(&ends(a, b))));
        assert!(merger.gone.iter().all(|v| !merger.edges.keys().flatten().any(|end| end == v)));
        (merger.gone, left)
    }

    #[test]
    fn a_vertex_that_lies_too_near_to_another_in_its_plane_or_line_vanishes() {
        let fixture = cube(3, false);
        for on_curve in [false, true] {
            let mut mesh = fixture.mesh.clone();
            let is_there = |class: &Class| match class {
                Class::Patch(_) => !on_curve,
                Class::Curve(_) => on_curve,
                _ => false,
            };
            let vertex = mesh.classes.iter().position(is_there).expect("a vertex on a face and on an edge");
            let class = mesh.classes[vertex];
            let beside = (mesh.segments.iter().map(|s| (s.vertices.to_vec(), Class::Curve(s.curve))))
                .chain(mesh.triangles.iter().map(|t| (t.vertices.to_vec(), Class::Patch(t.patch))))
                .find(|(vertices, on)| *on == class && vertices.contains(&VertexId(vertex as u32)));
            let other = beside.expect("it has neighbours").0.into_iter().find(|v| v.index() != vertex);
            let to = mesh.points[other.expect("another").index()];
            mesh.points[vertex] =
                nalgebra::center(&to, &nalgebra::center(&to, &nalgebra::center(&to, &mesh.points[vertex])));
            let (gone, left) = merged(&mesh, 10.0);
            assert_eq!(gone, [vertex as u32], "{class:?}");
            assert!((left - 1.0).abs() < 1e-12, "{left}");
        }
    }

    #[test]
    fn corners_stay_and_so_does_what_is_bent() {
        assert!(merged(&cube(1, false).mesh, 90.0).0.is_empty());
        assert!(merged(&ball(1.0).mesh, 90.0).0.is_empty());
    }
}
