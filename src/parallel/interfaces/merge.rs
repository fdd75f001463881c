//! Merging of boundary vertices that cuts have left too close to others.
//!
//! If a cutting plane passes near a corner, a curve or another plane, its intersection lines with
//! the boundary make short edges and narrow triangles, which cannot be repaired from inside. Once
//! the interface has moved away, these lines serve no purpose. So a vertex on a patch or curve may
//! be merged into a neighbour on the same patch or curve if that raises the smallest angle of its
//! tets and the boundary moves by at most a small tolerance (not at all on planes and straight
//! lines).

use crate::Point;
use crate::ground::kernel::nearest::in_segment;
use crate::ground::kernel::predicates::{Sign, orient3d};
use crate::ground::kernel::simplex::{area_vector, largest_cosine, squared_distance};
use crate::ground::mesh::Class;
use csg::{BodyId, PatchId};
use std::collections::BTreeMap;

/// The maximum distance of a removed vertex from the new boundary, in units of the longest edge
/// there: less than half the chord error of the coarsest preset on a ball.
const OFF: f64 = 0.03;

/// Minimum cosine between the normals of new triangles and the mean normal of the old ones of their
/// patch.
const TURN: f64 = 0.95;

/// The maximum number of passes over the bad tets.
const PASSES: usize = 4;

/// Tets with their boundary, while vertices are merged.
pub(super) struct Merger<'a> {
    points: &'a [Point],
    classes: &'a [Class],
    /// Which vertices may be removed: those without tets elsewhere.
    loose: &'a [bool],
    /// Triangles on patches, oriented outward from the tet behind; `None` if removed.
    shared: &'a [bool],
    /// Tets; `None` if removed.
    pub tets: Vec<Option<([u32; 4], BodyId)>>,
    /// Triangles on patches, oriented outward from the back; `None` if removed.
    pub triangles: Vec<Option<([u32; 3], PatchId)>>,
    /// Edges on curves and patches.
    pub edges: BTreeMap<[u32; 2], Class>,
    /// Removed vertices.
    pub removed: Vec<u32>,
    tets_at: Vec<Vec<u32>>,
    triangles_at: Vec<Vec<u32>>,
}

/// A vertex, the one it is merged into, and the largest cosine of the dihedral angles of its tets
/// afterwards.
type Merge = (u32, u32, f64);

fn ends(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// The list with `new` in place of `old`; `None` if it contains both.
fn replaced<const N: usize>(list: [u32; N], old: u32, new: u32) -> Option<[u32; N]> {
    (!list.contains(&new)).then(|| list.map(|v| if v == old { new } else { v }))
}

/// For each vertex, the entries that contain it.
fn incidence<const N: usize>(vertices: usize, entries: impl Iterator<Item = [u32; N]>) -> Vec<Vec<u32>> {
    let mut at = vec![Vec::new(); vertices];
    for (k, entry) in (0..).zip(entries) {
        entry.iter().for_each(|&v| at[v as usize].push(k));
    }
    at
}

impl<'a> Merger<'a> {
    /// Prepares tets, triangles and edges whose vertices have these `points` and `classes`.
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
            removed: Vec::new(),
            points,
            classes,
            loose,
            shared,
            edges,
        }
    }

    /// Merges vertices of tets that have a smaller dihedral angle than `angle` (degrees), the worst
    /// tets first.
    pub fn run(&mut self, angle: f64) {
        let limit = angle.to_radians().cos();
        for _ in 0..PASSES {
            let before = self.removed.len();
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
            if self.removed.len() == before {
                break;
            }
        }
    }

    /// The largest cosine of a tet's dihedral angles; below -1 if it was removed.
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

    /// The merges of a vertex that raise the smallest angle of its tets.
    fn merges(&self, vertex: u32) -> Vec<Merge> {
        let beside = self.neighbours(vertex);
        let class = self.classes[vertex as usize];
        let is_along = |into: u32| self.edges.get(&ends(vertex, into)) == Some(&class);
        let along: Vec<u32> = beside.iter().copied().filter(|&into| is_along(into)).collect();
        let candidates = match class {
            Class::Patch(_) => beside,
            // Only in the interior of a curve, with a neighbour on both sides.
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

    /// The neighbours of a vertex on the boundary, ascending.
    fn neighbours(&self, vertex: u32) -> Vec<u32> {
        let triangles = self.triangles_at[vertex as usize].iter().filter_map(|&t| self.triangles[t as usize]);
        let mut beside: Vec<u32> = triangles.flat_map(|t| t.0).filter(|&v| v != vertex).collect();
        beside.sort_unstable();
        beside.dedup();
        beside
    }

    /// The largest cosine of the vertex's tets after the merge, if all are positively oriented.
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

    /// Whether the merge keeps the boundary a manifold (the link condition) and creates no edge
    /// between shared vertices that other ranks would have to know.
    fn keeps_edges(&self, vertex: u32, into: u32) -> bool {
        let beside = self.neighbours(vertex);
        let common = beside.iter().filter(|&&v| self.edges.contains_key(&ends(v, into))).count();
        let at_edge = self.triangles_at[vertex as usize]
            .iter()
            .filter(|&&t| self.triangles[t as usize].is_some_and(|t| t.0.contains(&into)));
        let is_local = |v: u32| {
            let known = self.edges.get(&ends(v, into));
            let both = self.shared[v as usize] && self.shared[into as usize];
            !both || known.is_some_and(|known| *known <= self.edges[&ends(v, vertex)])
        };
        common == at_edge.count() && beside.iter().filter(|&&v| v != into).all(|&v| is_local(v))
    }

    /// Whether the new triangles cover the old ones within the tolerances, for each patch
    /// separately.
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

    /// Merges a vertex into another.
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
        self.removed.push(vertex);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::kernel::simplex::volume;
    use crate::ground::mesh::{Mesh, VertexId};
    use crate::parallel::refine::fixtures::{ball, cube};

    /// Runs the merger on a whole mesh; returns the removed vertices and the remaining volume.
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
        assert!(merger.removed.iter().all(|v| !merger.edges.keys().flatten().any(|end| end == v)));
        (merger.removed, left)
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
            let (removed, left) = merged(&mesh, 10.0);
            assert_eq!(removed, [vertex as u32], "{class:?}");
            assert!((left - 1.0).abs() < 1e-12, "{left}");
        }
    }

    #[test]
    fn corners_stay_and_so_does_what_is_bent() {
        assert!(merged(&cube(1, false).mesh, 90.0).0.is_empty());
        assert!(merged(&ball(1.0).mesh, 90.0).0.is_empty());
    }
}
