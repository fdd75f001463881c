//! Regions: sets of tets that are improved together, and their ranks.

use crate::Point;
use crate::ground::comm::{CommError, Communicator};
use crate::ground::kernel::random::mix;
use crate::ground::kernel::simplex::largest_cosine;
use crate::ground::mesh::{GlobalId, Rank, VertexId};
use crate::parallel::distribution::BareMesh;

/// Bad tets count within this many layers of tets from an interface; tets further inside were
/// improved before.
const NEAR: usize = 2;

/// Labels spread by this many layers, so touching regions merge within this many layers of the tet
/// that gives the region its label; the rest is left to the next round.
const REACH: usize = 7;

/// The label of a region: a random number, and the rank that improves the region. The smallest
/// label wins.
type Label = [u64; 2];

/// The label of vertices in no region.
const NONE: Label = [u64::MAX; 2];

/// The assignment of tets to ranks for improvement.
pub(super) struct Regions {
    /// For each tet the rank that improves it: this one for tets in no region.
    pub to: Vec<Rank>,
    /// For each tet, whether it is in a region.
    inside: Vec<bool>,
}

/// The cosine of the smallest dihedral angle of a tet.
pub(super) fn cosine(mesh: &BareMesh, tet: &[VertexId; 4]) -> f64 {
    largest_cosine(&tet.map(|v| Point::from(mesh.points[v.index()])))
}

/// *Local.* The tets near interfaces with a smaller dihedral angle than `angle` (degrees).
pub(super) fn bad_tets(mesh: &BareMesh, angle: f64) -> Vec<u32> {
    let mut near = vec![false; mesh.points.len()];
    mesh.shared.ids.iter().for_each(|&v| near[v as usize] = true);
    for _ in 1..NEAR {
        let before = near.clone();
        for tet in mesh.tets.iter().filter(|tet| tet.iter().any(|v| before[v.index()])) {
            tet.iter().for_each(|v| near[v.index()] = true);
        }
    }
    let most = angle.to_radians().cos();
    let is_bad = |tet: &[VertexId; 4]| tet.iter().any(|v| near[v.index()]) && cosine(mesh, tet) > most;
    (0..).zip(&mesh.tets).filter(|(_, tet)| is_bad(tet)).map(|(tet, _)| tet).collect()
}

/// **Collective.** Regions: the bad tets and those that touch them, without the `fixed` ones.
///
/// Each bad tet has a random label, computed from its id and the `round`; labels spread over
/// vertices, and the smallest wins. With a second layer around the bad tets, regions have 2.4 times
/// as many tets and take twice the time, and the 1st percentile of the angles is at most 0.4°
/// higher (benches/results/measure-2026-11-29.md).
pub(super) fn around(
    comm: &dyn Communicator,
    mesh: &BareMesh,
    (bad, fixed): (&[u32], &[bool]),
    round: u32,
) -> Result<Regions, CommError> {
    let mut labels = vec![NONE; mesh.points.len()];
    for &tet in bad {
        let number = mix(mesh.tet_ids[tet as usize] ^ mix(u64::from(round)));
        for v in mesh.tets[tet as usize] {
            let label = &mut labels[v.index()];
            *label = (*label).min([number, u64::from(mesh.rank)]);
        }
    }
    share(comm, mesh, &mut labels)?;
    let is_near = |tet: &[VertexId; 4]| tet.iter().any(|v| labels[v.index()] != NONE);
    let inside: Vec<bool> = mesh.tets.iter().zip(fixed).map(|(tet, &fixed)| !fixed && is_near(tet)).collect();
    let of_regions: Vec<&[VertexId; 4]> =
        mesh.tets.iter().zip(&inside).filter(|(_, inside)| **inside).map(|(tet, _)| tet).collect();
    for _ in 0..REACH {
        spread(comm, mesh, &of_regions, &mut labels)?;
    }
    let destination = |(tet, &inside): (&[VertexId; 4], &bool)| {
        if inside { least(tet, &labels)[1] as Rank } else { mesh.rank }
    };
    let to = mesh.tets.iter().zip(&inside).map(destination).collect();
    Ok(Regions { to, inside })
}

/// The smallest label of a tet's vertices.
fn least(tet: &[VertexId; 4], labels: &[Label]) -> Label {
    tet.iter().map(|v| labels[v.index()]).min().expect("four vertices")
}

/// **Collective.** Spreads labels by one layer within the given tets.
fn spread(
    comm: &dyn Communicator,
    mesh: &BareMesh,
    tets: &[&[VertexId; 4]],
    labels: &mut [Label],
) -> Result<(), CommError> {
    let before = labels.to_vec();
    for tet in tets {
        let label = least(tet, &before);
        tet.iter().for_each(|v| labels[v.index()] = labels[v.index()].min(label));
    }
    share(comm, mesh, labels)
}

/// **Collective.** Sets the label of each shared vertex to the smallest of all its copies.
fn share(comm: &dyn Communicator, mesh: &BareMesh, labels: &mut [Label]) -> Result<(), CommError> {
    for (v, _, label) in mesh.shared.exchange(comm, |v| labels[v as usize])? {
        labels[v as usize] = labels[v as usize].min(label);
    }
    Ok(())
}

impl Regions {
    /// **Collective.** The tets of regions that this rank will improve: ids, ascending, and current
    /// ranks.
    pub fn tets_to(
        &self,
        comm: &dyn Communicator,
        mesh: &BareMesh,
    ) -> Result<Vec<(GlobalId, Rank)>, CommError> {
        let mut lists = vec![Vec::new(); mesh.ranks as usize];
        for (tet, &to) in self.to.iter().enumerate().filter(|(tet, _)| self.inside[*tet]) {
            lists[to as usize].push(mesh.tet_ids[tet]);
        }
        let lists = (0..).zip(comm.all_to_all(lists)?);
        let mut mine: Vec<(GlobalId, Rank)> =
            lists.flat_map(|(from, ids)| ids.into_iter().map(move |id| (id, from))).collect();
        mine.sort_unstable();
        Ok(mine)
    }
}
