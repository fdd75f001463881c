//! Repair of inverted children by displacing coarse edges.
//!
//! Next to a curved boundary the fine edges at a coarse vertex approach the tangents of the
//! surface, while interior edges stay straight. If an interior edge makes a smaller angle with the
//! surface than the angle between chord and tangent, the children in that corner invert, whatever
//! the diagonals. Displacing the edge away from the surface makes room. This corresponds to the
//! untangling of curved elements (Toulorge, Geuzaine, Remacle, Lambrechts 2013), but measures the
//! children themselves: the objective sums, over the coarse tets around an edge, the shortfall of
//! the worst child, and is minimised edge by edge. Edges on curved patches may be displaced too,
//! along the patch.
//!
//! All ranks that share an edge must displace it alike. So [`mend()`] runs on the whole coarse mesh
//! before distribution; [`mend_near`] runs on a part and leaves its shared edges straight. Both
//! change only edges near bad tets, which are few in a sound coarse mesh. A coarse mesh
//! with many bad tets (e.g. tets thicker than a shell) needs a smaller mesh size instead.
//!
//! Success is not guaranteed: the remaining bad tets are reported, and
//! [`refine()`](super::refine()) rejects the mesh.

use super::displacements::EdgeDisplacements;
use super::snap::{self, Coordinates};
use super::subset::extract;
use super::tet::BadTet;
use super::trial::{CHUNK, Least, curved, worst_children};
use super::{RefineError, RefinedMesh, Settings as RefineSettings, refine_unchecked};
use crate::ground::mesh::{EdgeId, GlobalId, Order};
use crate::ground::projector::Projector;
use crate::parallel::distribution::DistMesh;
use rayon::prelude::*;
use std::collections::BTreeSet;

/// Parameters of [`mend()`].
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Subdivisions per edge of the refinement to prepare for. Large numbers are halved for the
    /// tests: with 16 the edge directions at vertices are near their limits, and the work grows
    /// with the cube.
    pub pieces: u32,
    /// The maximum number of sweeps over the bad tets.
    pub rounds: u32,
    /// Lower bounds for the quality of children; zeros only require positive volume.
    pub least: Least,
    /// A tet whose worst child exceeds the bound by less than this is treated again in the next
    /// sweep. In mean ratio, or in dihedral angle divided by that of the regular tet.
    pub margin: f64,
    /// The search stops improving a child that exceeds the bound by this; units as `margin`.
    pub enough: f64,
    /// The order of the elements to prepare for.
    pub order: Order,
}

impl Default for Settings {
    fn default() -> Self {
        Self { pieces: 8, rounds: 8, least: Least::VALID, margin: 0.05, enough: 0.2, order: Order::First }
    }
}

/// The result of [`mend()`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mended {
    /// The edge displacements, for [`Settings`](super::Settings::displacements) on all ranks.
    pub displacements: EdgeDisplacements,
    /// Coarse tets with insufficient children in the first refinement test, ascending.
    pub before: Vec<GlobalId>,
    /// Coarse tets with insufficient children in the last refinement test, ascending.
    pub left: Vec<GlobalId>,
}

/// Larger numbers of subdivisions are halved for the refinement tests. On NETGEN's `matrix`,
/// displacements found with 8 subdivisions alone left 5 of 13,736 coarse tets bad with 16.
const FINEST: u32 = 16;

/// With fewer subdivisions the children do not resolve the edge directions at vertices.
const COARSEST: u32 = 5;

/// First and last step of the search, in edge lengths. A displacement of a quarter turns the edge
/// by 45° at its ends; below a hundredth the quality changes by less than the margins.
const STEPS: [f64; 2] = [0.12, 0.01];

/// *Local, on the whole mesh.* Searches edge displacements for which the children of all tets meet
/// the bounds.
///
/// # Errors
/// [`RefineError::Projection`] and [`RefineError::OutOfMemory`], as [`refine()`](super::refine()).
pub fn mend(mesh: &DistMesh, projector: &Projector, settings: &Settings) -> Result<Mended, RefineError> {
    let all = curved(mesh, projector, &EdgeDisplacements::default());
    mend_near(mesh, &all, projector, settings)
}

/// *Local.* [`mend`] of a part of which only the tets with these local indices may have
/// insufficient children. Edges shared with other ranks are not displaced, so the displacements of
/// all ranks together are those for the whole mesh.
///
/// # Errors
/// As [`mend`].
pub fn mend_near(
    mesh: &DistMesh,
    suspects: &[u32],
    projector: &Projector,
    settings: &Settings,
) -> Result<Mended, RefineError> {
    let mut trial = Trial {
        mesh,
        projector,
        settings,
        pieces: settings.pieces,
        displacements: EdgeDisplacements::default(),
    };
    let mut tried: BTreeSet<u32> = suspects.iter().copied().collect();
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
    Ok(Mended { displacements: trial.displacements, before: before.unwrap_or_default(), left })
}

/// The numbers of subdivisions to test for `n`: n, halved while above [`FINEST`], preceded by half
/// of that, which finds displacements cheaply that then need few changes.
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
    displacements: EdgeDisplacements,
}

impl Trial<'_> {
    fn ids(&self, tets: &[u32]) -> Vec<GlobalId> {
        tets.iter().map(|&tet| self.mesh.tet_ids[tet as usize]).collect()
    }

    /// Of the tets given, those with insufficient children; ascending.
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

    /// By how much the worst child of a tet exceeds the bounds.
    fn excess(&self, refined: &RefinedMesh, tet: usize) -> f64 {
        self.settings.least.excess(&worst_children(refined, tet))
    }

    /// Displaces the edges of bad tets in sweeps; returns all tets whose shape may have changed.
    fn work_on(&mut self, mut bad: Vec<u32>) -> Result<BTreeSet<u32>, RefineError> {
        let mut touched = BTreeSet::from_iter(bad.iter().copied());
        // Edges searched with the present displacements around them.
        let mut settled = BTreeSet::new();
        for _ in 0..self.settings.rounds {
            let edges = BTreeSet::from_iter(bad.iter().flat_map(|&tet| self.mesh.tet_edges[tet as usize]));
            let is_due = |edge: &EdgeId| self.may_bend(*edge) && !settled.contains(edge);
            let edges: Vec<EdgeId> = edges.into_iter().filter(is_due).collect();
            if edges.is_empty() {
                break;
            }
            let stars = self.stars(&edges);
            for batch in disjoint(&stars) {
                let found: Vec<Option<Coordinates>> = batch
                    .par_iter()
                    .map(|&at| self.search(edges[at], &stars[at]))
                    .collect::<Result<_, _>>()?;
                for (at, displacement) in batch.into_iter().zip(found) {
                    let (edge, id) = (edges[at], self.mesh.edge_ids[edges[at].index()]);
                    if displacement != self.displacements.get(id) {
                        self.displacements.set(id, displacement);
                        for around in stars[at].iter().flat_map(|&tet| self.mesh.tet_edges[tet as usize]) {
                            settled.remove(&around);
                        }
                    }
                    settled.insert(edge);
                }
            }
            touched.extend(stars.into_iter().flatten());
            bad = self.poor(&Vec::from_iter(touched.iter().copied()))?;
        }
        Ok(touched)
    }

    /// Whether an edge is of this part alone, and neither on a curve nor on a plane.
    fn may_bend(&self, edge: EdgeId) -> bool {
        let is_shared = self.mesh.shared_edges.holders_of(edge.0).is_some();
        !is_shared && snap::may_bend(self.mesh.edge_classes[edge.index()], self.projector)
    }

    /// Of the tets given, those whose worst child does not exceed the bounds by the margin;
    /// ascending.
    fn poor(&self, tets: &[u32]) -> Result<Vec<u32>, RefineError> {
        let (refined, _) = self.refine(extract(self.mesh, tets))?;
        let is_poor = |at: &usize| self.excess(&refined, *at) < self.settings.margin;
        Ok((0..tets.len()).filter(is_poor).map(|at| tets[at]).collect())
    }

    fn refine(&self, part: DistMesh) -> Result<(RefinedMesh, Vec<BadTet>), RefineError> {
        refine_unchecked(part, self.projector, self.pieces, &self.refinement())
    }

    fn refinement(&self) -> RefineSettings {
        RefineSettings {
            described: 0,
            displacements: self.displacements.clone(),
            order: self.settings.order,
            ..RefineSettings::default()
        }
    }

    /// The tets around each of the given edges.
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

    /// The objective of the search: over the tets of a part, the sum of the squared shortfall of
    /// the worst child, plus one for each tet that violates the bounds, and far more for each with
    /// an invalid child, so that none is made for better angles elsewhere. Also by how much the
    /// worst child of the part exceeds the bounds.
    fn badness(&self, part: &DistMesh, refinement: &RefineSettings) -> Result<(f64, f64), RefineError> {
        const INVALID: f64 = 1e3;
        let (refined, _) = refine_unchecked(part.clone(), self.projector, self.pieces, refinement)?;
        let of_tet = |tet| {
            let worst = worst_children(&refined, tet);
            let excess = self.settings.least.excess(&worst);
            let short = f64::max(self.settings.enough - excess, 0.0);
            let penalty = if Least::VALID.excess(&worst) <= 0.0 {
                INVALID
            } else if excess <= 0.0 {
                1.0
            } else {
                0.0
            };
            (penalty + short * short, excess)
        };
        let both = |all: (f64, f64), tet: (f64, f64)| (all.0 + tet.0, all.1.min(tet.1));
        Ok((0..part.tets.len()).map(of_tet).fold((0.0, f64::INFINITY), both))
    }

    /// The displacement of one edge that minimises the objective: a pattern search along the axes
    /// with halving steps. The present one if no tet around the edge is poor (any more).
    fn search(&self, edge: EdgeId, star: &[u32]) -> Result<Option<Coordinates>, RefineError> {
        let part = extract(self.mesh, star);
        let id = self.mesh.edge_ids[edge.index()];
        let [p, q] = self.mesh.edges[edge.index()].map(|v| self.mesh.points[v.index()]);
        let length = (p - q).norm();
        let mut refinement = self.refinement();
        let (badness, excess) = self.badness(&part, &refinement)?;
        let mut best = (badness, self.displacements.get(id));
        if excess >= self.settings.margin {
            return Ok(best.1);
        }
        let mut step = STEPS[0];
        while step > STEPS[1] && best.0 > 0.0 {
            let mut better = best;
            for (axis, sign) in [(0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0), (2, 1.0), (2, -1.0)] {
                let mut displacement: Coordinates = best.1.unwrap_or_default();
                displacement[axis] += sign * step * length;
                refinement.displacements.set(id, Some(displacement));
                let (badness, _) = self.badness(&part, &refinement)?;
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
        Ok(best.1)
    }
}

/// The given sets of tets in groups of sets without a common tet: their numbers, each once.
fn disjoint(sets: &[Vec<u32>]) -> Vec<Vec<usize>> {
    let mut groups = Vec::new();
    let mut left: Vec<usize> = (0..sets.len()).collect();
    while !left.is_empty() {
        let mut used: BTreeSet<u32> = BTreeSet::new();
        let (group, later) = left.into_iter().partition(|&at| {
            let is_free = sets[at].iter().all(|tet| !used.contains(tet));
            if is_free {
                used.extend(&sets[at]);
            }
            is_free
        });
        groups.push(group);
        left = later;
    }
    groups
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_of_disjoint_sets_have_each_set_once() {
        let sets = [vec![1, 2], vec![2, 3], vec![3, 4], vec![5], vec![1, 5]];
        assert_eq!(disjoint(&sets), [vec![0, 2, 3], vec![1, 4]]);
    }
}
