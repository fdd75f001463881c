//! Bending coarse edges where snapped children would invert.
//!
//! Beside a curved boundary the fine edges at a coarse vertex turn into the tangents of the surface, while interior
//! edges stay straight: where an interior edge leaves the surface at less than the angle between chord and
//! tangent, the corner between them turns over, and no diagonal helps. Bending that edge away gives it room. This is
//! what untangling does to curved coarse elements (Toulorge, Geuzaine, Remacle, Lambrechts 2013), here with the
//! children themselves as the measure: for each coarse tet around the edge how far its worst child falls short of
//! good enough, searched for its minimum edge by edge. Edges on curved patches may bend too, along the patch.
//!
//! It runs on the whole coarse mesh before it is distributed, since all holders of an edge must bend it alike; and
//! only near bad tets, which are few in a sound coarse mesh. A coarse mesh that is wrong in many
//! places, with tets thicker than a shell say, wants a smaller mesh size instead.
//!
//! There is no guarantee: what is left is reported, and [`refine()`](super::refine()) refuses it.

use super::bend::Bends;
use super::snap::{self, Coordinates};
use super::tet::BadTet;
use super::trial::{CHUNK, Least, curved, worst_children};
use super::{RefineError, RefinedMesh, Settings as RefineSettings, refine_unchecked};
use crate::dist::DistMesh;
use crate::geometry::Projector;
use crate::mesh::{EdgeId, GlobalId, TetId};
use rayon::prelude::*;
use std::collections::BTreeSet;

/// How to mend.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Pieces of an edge that are wanted. A large number is halved for the trial: with 16 pieces the directions at
    /// vertices are near their limits, and work grows with the cube.
    pub pieces: u32,
    /// Rounds over the bad tets.
    pub rounds: u32,
    /// What children must be better than. With zeros: positive.
    pub least: Least,
    /// A tet whose worst child is not better by so much is worked on again in the next round. In mean ratio, or in angle: in units of the
    /// regular tet's.
    pub margin: f64,
    /// A bend need not make the worst child better by more than this, likewise.
    pub enough: f64,
}

impl Default for Settings {
    fn default() -> Self {
        let least = Least { mean_ratio: 0.0, dihedral: 0.0 };
        Self { pieces: 8, rounds: 8, least, margin: 0.05, enough: 0.2 }
    }
}

/// What mending came to.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mended {
    /// The edges to be bent, for [`Settings::bends`](super::Settings::bends) on all ranks.
    pub bends: Bends,
    /// Coarse tets with children that were not good enough in the first, coarser trial, ascending.
    pub before: Vec<GlobalId>,
    /// Those that have some in the last trial, ascending.
    pub left: Vec<GlobalId>,
}

/// More pieces than these are not tried if half of them will do. On NETGEN's `matrix`, bends found with 8 pieces
/// alone left 5 of 13,736 coarse tets bad with 16.
const FINEST: u32 = 16;

/// With fewer pieces than these the children say little of the directions at vertices.
const COARSEST: u32 = 5;

/// First and last step of the search, in lengths of the edge. A bend of a quarter turns the edge by 45° at its ends; below
/// a hundredth the children change less than by what counts as enough.
const STEPS: [f64; 2] = [0.12, 0.01];

/// *Local, on the whole mesh.* Finds bends of edges with which the children of all tets are good enough, or of as many as it can.
///
/// # Errors
/// Vertices that cannot be snapped, and memory, as [`refine()`](super::refine()).
pub fn mend(mesh: &DistMesh, projector: &Projector, settings: &Settings) -> Result<Mended, RefineError> {
    let mut trial = Trial { mesh, projector, settings, pieces: settings.pieces, bends: Bends::default() };
    let mut tried: BTreeSet<u32> = curved(mesh, projector, &Bends::default()).into_iter().collect();
    let mut before: Option<Vec<GlobalId>> = None;
    let mut left = Vec::new();
    for pieces in ladder(settings.pieces) {
        trial.pieces = pieces;
        let bad = trial.bad(&tried)?;
        before.get_or_insert_with(|| trial.ids(&bad));
        tried.extend(trial.work_on(bad)?);
        left = trial.bad(&tried)?;
    }
    let left = trial.ids(&left);
    Ok(Mended { bends: trial.bends, before: before.unwrap_or_default(), left })
}

/// The numbers of pieces to be tried for `n`: n, halved while it is large, and half of that, with which bends
/// are found cheaply that then need little change.
fn ladder(n: u32) -> Vec<u32> {
    let halved = |n: u32| (n.is_multiple_of(2)).then_some(n / 2);
    let mut top = n;
    while let Some(half) = halved(top).filter(|_| top > FINEST) {
        top = half;
    }
    let below = halved(top).filter(|&half| half >= COARSEST);
    below.into_iter().chain([top]).collect()
}

struct Trial<'a> {
    mesh: &'a DistMesh,
    projector: &'a Projector,
    settings: &'a Settings,
    pieces: u32,
    bends: Bends,
}

impl Trial<'_> {
    fn ids(&self, tets: &[u32]) -> Vec<GlobalId> {
        tets.iter().map(|&tet| self.mesh.tet_ids[tet as usize]).collect()
    }

    /// Those of some tets, ascending, that have children which are not good enough.
    fn bad(&self, tets: &BTreeSet<u32>) -> Result<Vec<u32>, RefineError> {
        let mut bad = Vec::new();
        for chunk in Vec::from_iter(tets.iter().copied()).chunks(CHUNK) {
            let (refined, inverted) = self.refine(extract(self.mesh, chunk))?;
            let is_inverted = |id| inverted.binary_search_by_key(&id, |bad| bad.tet).is_ok();
            let is_bad = |at: &usize| {
                is_inverted(self.mesh.tet_ids[chunk[*at] as usize]) || self.excess(&refined, *at) <= 0.0
            };
            let found: Vec<usize> = (0..chunk.len()).into_par_iter().filter(is_bad).collect();
            bad.extend(found.into_iter().map(|at| chunk[at]));
        }
        Ok(bad)
    }

    /// By how much the worst child of a tet is better than it must be.
    fn excess(&self, refined: &RefinedMesh, tet: usize) -> f64 {
        self.settings.least.excess(&worst_children(refined, tet))
    }

    /// Bends the edges of bad tets, round by round; returns all tets whose shape that changes.
    fn work_on(&mut self, mut bad: Vec<u32>) -> Result<BTreeSet<u32>, RefineError> {
        let mut touched = BTreeSet::from_iter(bad.iter().copied());
        for _ in 0..self.settings.rounds {
            if bad.is_empty() {
                break;
            }
            let edges = BTreeSet::from_iter(bad.iter().flat_map(|&tet| self.mesh.tet_edges[tet as usize]));
            let may_bend =
                |edge: &EdgeId| snap::may_bend(self.mesh.edge_classes[edge.index()], self.projector);
            let edges: Vec<EdgeId> = edges.into_iter().filter(may_bend).collect();
            let stars = self.stars(&edges);
            let mut changed = false;
            for (edge, star) in edges.into_iter().zip(&stars) {
                changed |= self.bend(edge, star)?;
                touched.extend(star);
            }
            if !changed {
                break;
            }
            bad = self.poor(&Vec::from_iter(touched.iter().copied()))?;
        }
        Ok(touched)
    }

    /// Those of some tets, ascending, whose worst child is not clearly good enough.
    fn poor(&self, tets: &[u32]) -> Result<Vec<u32>, RefineError> {
        let (refined, _) = self.refine(extract(self.mesh, tets))?;
        let is_poor = |at: &usize| self.excess(&refined, *at) < self.settings.margin;
        Ok((0..tets.len()).filter(is_poor).map(|at| tets[at]).collect())
    }

    fn refine(&self, part: DistMesh) -> Result<(RefinedMesh, Vec<BadTet>), RefineError> {
        let settings =
            RefineSettings { described: 0, bends: self.bends.clone(), ..RefineSettings::default() };
        refine_unchecked(part, self.projector, self.pieces, &settings)
    }

    /// The tets around each of some edges.
    fn stars(&self, edges: &[EdgeId]) -> Vec<Vec<u32>> {
        let mut stars = vec![Vec::new(); edges.len()];
        for (tet, of_tet) in (0..).zip(&self.mesh.tet_edges) {
            for edge in of_tet {
                if let Ok(at) = edges.binary_search(edge) {
                    stars[at].push(tet);
                }
            }
        }
        stars
    }

    /// How bad the children of the tets of a part are: for each tet the square by which its worst child falls short of
    /// what is enough, and one more if that is not good enough at all.
    fn badness(&self, part: &DistMesh) -> Result<f64, RefineError> {
        let (refined, _) = self.refine(part.clone())?;
        let of_tet = |tet| {
            let excess = self.excess(&refined, tet);
            let short = f64::max(self.settings.enough - excess, 0.0);
            if excess > 0.0 { short * short } else { 1.0 + short * short }
        };
        Ok((0..part.tets.len()).map(of_tet).sum())
    }

    /// Bends an edge so that the children around it become as good as they can: a search along the axes with steps
    /// that halve. Returns whether the edge is bent otherwise now.
    fn bend(&mut self, edge: EdgeId, star: &[u32]) -> Result<bool, RefineError> {
        let part = extract(self.mesh, star);
        let id = self.mesh.edge_ids[edge.index()];
        let [p, q] = self.mesh.edges[edge.index()].map(|v| self.mesh.points[v.index()]);
        let length = (p - q).norm();
        let before = self.bends.get(id);
        let mut best = (self.badness(&part)?, before);
        let mut step = STEPS[0];
        while step > STEPS[1] && best.0 > 0.0 {
            let mut better = best;
            for (axis, sign) in [(0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0), (2, 1.0), (2, -1.0)] {
                let mut displacement: Coordinates = best.1.unwrap_or_default();
                displacement[axis] += sign * step * length;
                self.bends.set(id, Some(displacement));
                let badness = self.badness(&part)?;
                if badness < better.0 {
                    better = (badness, Some(displacement));
                }
            }
            if better.0 < best.0 {
                best = better;
            } else {
                step /= 2.0;
            }
        }
        let changed = best.1 != before;
        self.bends.set(id, best.1);
        Ok(changed)
    }
}

/// Some tets of a mesh, ascending, as a part of their own without boundary and neighbours.
pub(super) fn extract(mesh: &DistMesh, tets: &[u32]) -> DistMesh {
    let vertices = used(tets, |tet| mesh.tets[tet].map(|v| v.0));
    let edges = used(tets, |tet| mesh.tet_edges[tet].map(|e| e.0));
    let faces = used(tets, |tet| mesh.tet_faces[tet].map(|f| f.0));
    let vertex = |v: crate::mesh::VertexId| crate::mesh::VertexId(renumber(&vertices, v.0));
    let tet_ids = tets.iter().map(|&t| TetId(t));
    DistMesh {
        rank: mesh.rank,
        ranks: mesh.ranks,
        totals: mesh.totals,
        points: pick(&mesh.points, &vertices),
        vertex_ids: pick(&mesh.vertex_ids, &vertices),
        vertex_classes: pick(&mesh.vertex_classes, &vertices),
        edges: edges.iter().map(|&e| mesh.edges[e as usize].map(vertex)).collect(),
        edge_ids: pick(&mesh.edge_ids, &edges),
        edge_classes: pick(&mesh.edge_classes, &edges),
        faces: faces.iter().map(|&f| mesh.faces[f as usize].map(vertex)).collect(),
        face_ids: pick(&mesh.face_ids, &faces),
        face_classes: pick(&mesh.face_classes, &faces),
        tets: tet_ids.clone().map(|t| mesh.tets[t.index()].map(vertex)).collect(),
        tet_ids: pick(&mesh.tet_ids, tets),
        tet_bodies: pick(&mesh.tet_bodies, tets),
        tet_edges: tet_ids
            .clone()
            .map(|t| mesh.tet_edges[t.index()].map(|e| EdgeId(renumber(&edges, e.0))))
            .collect(),
        tet_faces: tet_ids
            .map(|t| mesh.tet_faces[t.index()].map(|f| crate::mesh::FaceId(renumber(&faces, f.0))))
            .collect(),
        ..DistMesh::default()
    }
}

/// The entities that some tets use, ascending.
fn used<const N: usize>(tets: &[u32], of: impl Fn(usize) -> [u32; N]) -> Vec<u32> {
    let mut used: Vec<u32> = tets.iter().flat_map(|&tet| of(tet as usize)).collect();
    used.sort_unstable();
    used.dedup();
    used
}

fn renumber(used: &[u32], id: u32) -> u32 {
    used.binary_search(&id).expect("an entity of the extracted tets") as u32
}

fn pick<T: Clone>(all: &[T], ids: &[u32]) -> Vec<T> {
    ids.iter().map(|&id| all[id as usize].clone()).collect()
}
