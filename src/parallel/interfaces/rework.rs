//! Improvement of the regions that a rank has received.

use super::Settings;
use super::merge::Merger;
use super::renumber::{keep, places_without};
use crate::Vector;
use crate::ground::kernel::sets::Sets;
use crate::ground::kernel::simplex::{from_lowest, largest_cosine};
use crate::ground::mesh::topology::{self, Faces};
use crate::ground::mesh::{BoundaryTriangle, Class, GlobalId, Mesh, Rank, Segment};
use crate::ground::mesh::{TET_EDGES, TET_FACES, TetId, VertexId, sorted_face};
use crate::mesher::improve::{self, Smoothness};
use crate::parallel::distribution::{BareMesh, ClassifiedEdge, Side};
use crate::parallel::skin::{self, PartSizes};
use csg::{BodyId, PatchId};
use rayon::prelude::*;
use std::collections::{BTreeMap, HashMap};

/// The result of reworking the tets of a rank's regions.
#[derive(Default)]
pub(super) struct Reworked {
    /// The tets removed from the part, ascending.
    pub replaced_tets: Vec<u32>,
    /// The tets that replace them, by vertex of the part; added vertices are numbered after the
    /// part's.
    pub tets: Vec<[VertexId; 4]>,
    /// The bodies of `tets`.
    pub bodies: Vec<BodyId>,
    /// The destination ranks of `tets`.
    pub to: Vec<Rank>,
    /// The faces of `tets` on patches; tets by index here.
    pub sides: Vec<Side>,
    /// Moved vertices of the part, with new coordinates and classes.
    pub moved: Vec<(u32, [f64; 3], Class)>,
    /// Vertices of the part that no longer have tets, ascending.
    pub removed: Vec<u32>,
    /// New vertices.
    pub added: Vec<([f64; 3], Class)>,
    /// Edges on curves and patches that replace those of removed vertices.
    pub edges: Vec<ClassifiedEdge>,
    /// The number of removed triangles on patches.
    pub removed_triangles: u64,
    /// The number of boundary vertices merged into others.
    pub merged: u64,
}

/// Tolerance of computed angles, degrees.
const ROUNDING: f64 = 1e-9;

/// One partial filling per this many tets is examined in reconnections. A fixed number in the
/// thousands per region, as in large blocks, takes two thirds of the time at thin walls and
/// improves 1st percentiles by less than 0.1°.
const TETS_A_STEP: usize = 5;

/// Rounds in which tets take the rank of most of their neighbours.
const VOTES: usize = 2;

/// The number of times merging and improving are repeated.
const TURNS: usize = 3;

/// *Local.* Improves the tets with these ids, which came from these ranks, without changing their
/// outer surface. Each connected set is a region, and the smallest angle of a region does not
/// decrease.
///
/// # Panics
/// If this rank does not have the tets.
pub(super) fn rework(
    part: &BareMesh,
    given: &[(GlobalId, Rank)],
    settings: &Settings,
    smoothness: Option<&dyn Smoothness>,
) -> Reworked {
    let place = |id: &GlobalId| part.tet_ids.binary_search(id).expect("the tets are on this rank") as u32;
    let replaced_tets: Vec<(u32, Rank)> = given.iter().map(|(id, from)| (place(id), *from)).collect();
    let mut regions = regions(part, &replaced_tets);
    regions.par_iter_mut().for_each(|region| region.rework(settings, smoothness));
    let mut reworked = Reworked::default();
    regions.into_iter().for_each(|region| region.finish(part.points.len(), &mut reworked));
    reworked.replaced_tets.sort_unstable();
    reworked.removed.sort_unstable();
    reworked
}

/// A connected set of tets as a mesh of its own. Vertices on its surface and on the boundary come
/// first, then interior ones, which may move.
#[derive(Clone, Default)]
struct Region {
    /// The tets in the part.
    replaced_tets: Vec<u32>,
    /// The rank that each tet of the mesh came from; after reworking, its destination.
    ranks: Vec<Rank>,
    mesh: Mesh,
    /// The indices in the part of the surface and boundary vertices.
    outer: Vec<u32>,
    /// For each of `outer`, whether it may be merged into another: it is on a patch or curve and
    /// all its tets are in the region.
    loose: Vec<bool>,
    /// For each of `outer`, whether it is shared with other ranks.
    shared: Vec<bool>,
    /// Edges on curves and patches.
    edges: BTreeMap<[u32; 2], Class>,
    /// The indices in the part of the interior vertices before reworking.
    inside: Vec<u32>,
    /// Vertices of the part that were merged into others.
    removed: Vec<u32>,
    /// The number of removed triangles on patches.
    removed_triangles: u64,
}

/// The class of vertices that must not move. Only that distinction matters here.
const FIXED: Class = Class::Corner(csg::CornerId(0));

/// No vertex, no region.
const NONE: u32 = u32::MAX;

/// The region of each vertex of the given tets, connected by shared vertices, and the number of
/// regions.
fn components(part: &BareMesh, replaced_tets: &[(u32, Rank)]) -> (Vec<u32>, usize) {
    let (mut sets, mut is_touched) = (Sets::new(part.points.len()), vec![false; part.points.len()]);
    for &(tet, _) in replaced_tets {
        let corners = part.tets[tet as usize];
        for v in corners {
            is_touched[v.index()] = true;
            sets.join(corners[0].0, v.0);
        }
    }
    let (mut region, mut count) = (vec![NONE; part.points.len()], 0);
    for v in (0..part.points.len()).filter(|&v| is_touched[v]) {
        // The smallest vertex of a region represents it and comes first.
        let first = sets.find(v as u32) as usize;
        if first == v {
            region[v] = count;
            count += 1;
        } else {
            region[v] = region[first];
        }
    }
    (region, count as usize)
}

/// Extracts the regions of the given tets from a part.
fn regions(part: &BareMesh, replaced_tets: &[(u32, Rank)]) -> Vec<Region> {
    let (region_of, count) = components(part, replaced_tets);
    let mut is_taken = vec![false; part.tets.len()];
    replaced_tets.iter().for_each(|&(tet, _)| is_taken[tet as usize] = true);
    let mut is_shared = vec![false; part.points.len()];
    part.shared.ids.iter().for_each(|&v| is_shared[v as usize] = true);
    let mut is_free: Vec<bool> = is_shared.iter().map(|shared| !shared).collect();
    let rest = part.tets.iter().zip(&is_taken).filter(|(_, replaced_tets)| !**replaced_tets);
    rest.flat_map(|(tet, _)| tet).for_each(|v| is_free[v.index()] = false);

    let mut regions: Vec<Region> = std::iter::repeat_with(Region::default).take(count).collect();
    let mut place = vec![VertexId(NONE); part.points.len()];
    let is_inside = |v: usize| is_free[v] && matches!(part.vertex_classes[v], Class::Body(_));
    let of_regions = || (0..part.points.len()).filter(|&v| region_of[v] != NONE);
    for v in of_regions().filter(|&v| !is_inside(v)).chain(of_regions().filter(|&v| is_inside(v))) {
        let region = &mut regions[region_of[v] as usize];
        place[v] = VertexId::new(region.mesh.points.len());
        region.mesh.points.push(part.points[v].into());
        region.mesh.classes.push(if is_free[v] { part.vertex_classes[v] } else { FIXED });
        if is_inside(v) {
            region.inside.push(v as u32);
        } else {
            region.outer.push(v as u32);
            region.loose.push(is_free[v]);
            region.shared.push(is_shared[v]);
        }
    }
    let region_at = |v: VertexId| region_of[v.index()] as usize;
    let placed = |v: VertexId| place[v.index()];
    for &(tet, from) in replaced_tets {
        let corners = part.tets[tet as usize];
        let region = &mut regions[region_at(corners[0])];
        region.replaced_tets.push(tet);
        region.ranks.push(from);
        region.mesh.tets.push(corners.map(placed));
        region.mesh.bodies.push(part.tet_bodies[tet as usize]);
    }
    for side in part.sides.iter().filter(|side| is_taken[side.tet.index()]) {
        let corners = TET_FACES[usize::from(side.face)].map(|k| part.tets[side.tet.index()][k]);
        let [a, b, c] = corners.map(placed);
        let vertices = if side.behind { [a, b, c] } else { [a, c, b] };
        regions[region_at(corners[0])].mesh.triangles.push(BoundaryTriangle { vertices, patch: side.patch });
    }
    for edge in &part.edges {
        let [first, second] = edge.vertices.map(|v| region_of[v.index()]);
        if first != NONE && first == second {
            let [a, b] = edge.vertices.map(|v| placed(v).0);
            regions[first as usize].edges.insert([a.min(b), a.max(b)], edge.class);
        }
    }
    for region in &mut regions {
        // Triangles between two tets occur twice.
        region.mesh.triangles.sort_unstable_by_key(|t| sorted_face(t.vertices));
        region.mesh.triangles.dedup_by_key(|t| sorted_face(t.vertices));
    }
    regions
}

impl Region {
    /// Improves the region and determines the destination of each tet. Merging ends before a turn
    /// after which refinement would flatten or invert more than before.
    fn rework(&mut self, settings: &Settings, smoothness: Option<&dyn Smoothness>) {
        let corners = |tet: &[VertexId; 4]| tet.map(|v| self.mesh.points[v.index()]);
        let sharpest = self.mesh.tets.iter().map(|tet| largest_cosine(&corners(tet))).fold(-1.0, f64::max);
        let least_angle = sharpest.acos().to_degrees() - ROUNDING;
        let reconnection_steps = self.mesh.tets.len() / TETS_A_STEP;
        let how = improve::Settings { least_angle, reconnection_steps, ..settings.improve.clone() };
        let before =
            PartSizes::new(self.mesh.points.clone(), self.mesh.tets.clone(), usual_lengths(&self.mesh));
        let mut faults = self.improve(&before, &how, smoothness);
        let turns = settings.merge_angle.into_iter().flat_map(|angle| [angle; TURNS]);
        for angle in turns {
            let unmerged = smoothness.map(|_| self.clone());
            if !self.merge(angle) {
                break;
            }
            let after = self.improve(&before, &how, smoothness);
            if let Some(unmerged) = unmerged.filter(|_| after > faults) {
                *self = unmerged;
                break;
            }
            faults = after;
        }
        self.ranks = destinations(&self.mesh, &before, &self.ranks);
    }

    /// Improves the tets; returns the number of triangles and tets that refinement would flatten or
    /// invert.
    fn improve(
        &mut self,
        sizes: &PartSizes,
        how: &improve::Settings,
        smoothness: Option<&dyn Smoothness>,
    ) -> usize {
        let segment = |(ends, class): (&[u32; 2], &Class)| Segment::of_class(ends.map(VertexId), *class);
        self.mesh.segments = self.edges.iter().filter_map(segment).collect();
        let report = improve::improve_for(&mut self.mesh, sizes, smoothness, how);
        report.illegal_triangles + report.illegal_left + report.folding_left
    }

    /// Merges boundary vertices; returns whether any were merged.
    fn merge(&mut self, angle: f64) -> bool {
        let count = self.mesh.points.len();
        let outer = |list: &[bool]| -> Vec<bool> {
            list.iter().copied().chain(std::iter::repeat(false)).take(count).collect()
        };
        let (loose, shared) = (outer(&self.loose), outer(&self.shared));
        let tets = self.mesh.tets.iter().map(|tet| tet.map(|v| v.0)).zip(self.mesh.bodies.iter().copied());
        let triangles = self.mesh.triangles.iter().map(|t| (t.vertices.map(|v| v.0), t.patch)).collect();
        let at = (&self.mesh.points[..], &self.mesh.classes[..]);
        let mut merger =
            Merger::new(at, &loose, &shared, tets.collect(), triangles, std::mem::take(&mut self.edges));
        merger.run(angle);
        let Merger { tets, triangles, edges, mut removed, .. } = merger;
        removed.sort_unstable();
        let places = places_without(count, &removed);
        let placed = |v: u32| places[v as usize];
        self.removed.extend(removed.iter().map(|&v| self.outer[v as usize]));
        keep(&mut self.mesh.points, &places);
        keep(&mut self.mesh.classes, &places);
        keep(&mut self.outer, &places);
        keep(&mut self.loose, &places);
        keep(&mut self.shared, &places);
        let alive = || tets.iter().flatten();
        self.mesh.tets = alive().map(|(tet, _)| tet.map(|v| VertexId(placed(v)))).collect();
        self.mesh.bodies = alive().map(|(_, body)| *body).collect();
        let triangle = |&(vertices, patch): &([u32; 3], PatchId)| BoundaryTriangle {
            vertices: vertices.map(|v| VertexId(placed(v))),
            patch,
        };
        self.removed_triangles += triangles.iter().filter(|t| t.is_none()).count() as u64;
        self.mesh.triangles = triangles.iter().flatten().map(triangle).collect();
        // The new positions keep the order of vertices.
        self.edges = edges.into_iter().map(|(ends, class)| (ends.map(placed), class)).collect();
        !removed.is_empty()
    }

    /// Appends the region to the result; the part has `vertices` vertices.
    fn finish(self, vertices: usize, reworked: &mut Reworked) {
        let on_surface = self.outer.len();
        let mut names: Vec<VertexId> = self.outer.into_iter().map(VertexId).collect();
        let mut before = self.inside.into_iter();
        for (point, &class) in self.mesh.points[on_surface..].iter().zip(&self.mesh.classes[on_surface..]) {
            let point = [point.x, point.y, point.z];
            if let Some(v) = before.next() {
                reworked.moved.push((v, point, class));
                names.push(VertexId(v));
            } else {
                names.push(VertexId::new(vertices + reworked.added.len()));
                reworked.added.push((point, class));
            }
        }
        if !self.removed.is_empty() {
            let named = |ends: &[u32; 2]| ends.map(|v| names[v as usize]);
            reworked
                .edges
                .extend(self.edges.iter().map(|(ends, class)| ClassifiedEdge::new(named(ends), *class)));
        }
        reworked.merged += self.removed.len() as u64;
        reworked.removed.extend(self.removed);
        reworked.removed.extend(before);
        let first = reworked.tets.len() as u32;
        let in_all = |side: Side| Side { tet: TetId(first + side.tet.0), ..side };
        reworked.sides.extend(sides(&self.mesh, on_surface).into_iter().map(in_all));
        reworked.removed_triangles += self.removed_triangles;
        reworked.replaced_tets.extend(self.replaced_tets);
        reworked.tets.extend(self.mesh.tets.iter().map(|tet| tet.map(|v| names[v.index()])));
        reworked.bodies.extend(self.mesh.bodies);
        reworked.to.extend(self.ranks);
    }
}

/// The destination of each tet of a reworked region: the rank that had the position of its centroid
/// before, then the rank of most of its neighbours, so that no tet is isolated among those of
/// another rank.
fn destinations(mesh: &Mesh, before: &PartSizes, ranks: &[Rank]) -> Vec<Rank> {
    if ranks.iter().all(|rank| *rank == ranks[0]) {
        return vec![ranks[0]; mesh.tets.len()];
    }
    let destination = |tet: &[VertexId; 4]| {
        let centre = tet.iter().map(|v| mesh.points[v.index()].coords).sum::<Vector>() / 4.0;
        ranks[before.tet_at(&centre.into()).expect("a region has tets") as usize]
    };
    let mut destinations: Vec<Rank> = mesh.tets.iter().map(destination).collect();
    let Faces { faces, tet_faces } = topology::faces(mesh.points.len(), &mesh.tets);
    let tets_at = topology::face_tets(faces.len(), &tet_faces).expect("two tets at a face");
    for _ in 0..VOTES {
        for tet in 0..destinations.len() {
            let beside = tet_faces[tet].iter().flat_map(|face| tets_at[face.index()]);
            // Neighbours outside the region stay on their rank, so they count for the rank that the
            // tet has.
            let of = |other: u32| destinations[if other == NONE { tet } else { other as usize }];
            let votes: Vec<Rank> = beside.filter(|&other| other as usize != tet).map(of).collect();
            let most = votes.iter().find(|rank| votes.iter().filter(|other| other == rank).count() > 2);
            destinations[tet] = most.copied().unwrap_or(destinations[tet]);
        }
    }
    destinations
}

/// The faces of tets on patches, ascending; only the first `on_surface` vertices are on such faces.
fn sides(mesh: &Mesh, on_surface: usize) -> Vec<Side> {
    let known: HashMap<[VertexId; 3], &BoundaryTriangle> =
        mesh.triangles.iter().map(|t| (sorted_face(t.vertices), t)).collect();
    let mut sides = Vec::with_capacity(known.len());
    for (tet, corners) in (0..).map(TetId).zip(&mesh.tets) {
        if corners.iter().filter(|v| v.index() < on_surface).count() < 3 {
            continue;
        }
        for (face, outward) in (0..).zip(TET_FACES.map(|face| face.map(|k| corners[k]))) {
            let Some(triangle) = known.get(&sorted_face(outward)) else { continue };
            let behind = from_lowest(outward) == from_lowest(triangle.vertices);
            sides.push(Side { tet, face, patch: triangle.patch, behind });
        }
    }
    sides
}

/// At each vertex the usual edge length: the largest of its mean edge length and those of its
/// neighbours, because some edges near a bad interface are short.
fn usual_lengths(mesh: &Mesh) -> Vec<f64> {
    let means = skin::at_vertices(mesh, None, 1);
    let mut lengths = means.clone();
    for tet in &mesh.tets {
        for [a, b] in TET_EDGES.map(|edge| edge.map(|k| tet[k].index())) {
            lengths[a] = lengths[a].max(means[b]);
            lengths[b] = lengths[b].max(means[a]);
        }
    }
    lengths
}
