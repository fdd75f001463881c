//! Which tets are improved together, and on which rank.

use crate::Point;
use crate::comm::{CommError, Communicator};
use crate::dist::BareMesh;
use crate::kernel::random::mix;
use crate::kernel::simplex::largest_cosine;
use crate::mesh::{GlobalId, Rank, VertexId};

/// A bad tet counts if it is within so many layers of tets from an interface: what is further inside has been improved before.
const NEAR: usize = 2;

/// Layers of tets around a bad one that are improved with it.
const LAYERS: usize = 2;

/// Regions that touch become one as far as this many layers from the tet that it is named after; what is further off is for the next round.
const REACH: usize = 8;

/// The name of a region: the least wins. A random number, and the rank that the region goes to.
type Label = [u64; 2];

/// No region.
const NONE: Label = [u64::MAX; 2];

/// Where tets go to be improved.
pub(super) struct Regions {
    /// A rank for each tet: this one for those of no region.
    pub to: Vec<Rank>,
    /// Whether the tet is in a region.
    inside: Vec<bool>,
}

/// The smallest dihedral angle of a tet, degrees.
pub(super) fn smallest_angle(mesh: &BareMesh, tet: usize) -> f64 {
    let corners = mesh.tets[tet].map(|v| Point::from(mesh.points[v.index()]));
    largest_cosine(&corners).acos().to_degrees()
}

/// *Local.* The tets near interfaces that have a smaller dihedral angle than `angle`.
pub(super) fn bad_tets(mesh: &BareMesh, angle: f64) -> Vec<u32> {
    let mut near = vec![false; mesh.points.len()];
    mesh.shared.ids.iter().for_each(|&v| near[v as usize] = true);
    for _ in 1..NEAR {
        let before = near.clone();
        for tet in mesh.tets.iter().filter(|tet| tet.iter().any(|v| before[v.index()])) {
            tet.iter().for_each(|v| near[v.index()] = true);
        }
    }
    let is_bad = |&tet: &u32| {
        mesh.tets[tet as usize].iter().any(|v| near[v.index()]) && smallest_angle(mesh, tet as usize) < angle
    };
    (0..mesh.tets.len() as u32).filter(is_bad).collect()
}

/// **Collective.** Regions of [`LAYERS`] layers round the bad tets.
///
/// Each bad tet has a label; labels spread over vertices, and the least holds. They depend on the ids of the tets and the `round`.
pub(super) fn around(
    comm: &dyn Communicator,
    mesh: &BareMesh,
    bad: &[u32],
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
    for _ in 1..LAYERS {
        let all = 0..mesh.tets.len();
        spread(comm, mesh, all, &mut labels)?;
    }
    let inside: Vec<bool> =
        mesh.tets.iter().map(|tet| tet.iter().any(|v| labels[v.index()] != NONE)).collect();
    for _ in LAYERS..REACH {
        let of_regions = (0..mesh.tets.len()).filter(|&tet| inside[tet]);
        spread(comm, mesh, of_regions, &mut labels)?;
    }
    let destination = |(tet, &inside): (&[VertexId; 4], &bool)| {
        if inside { least(tet, &labels)[1] as Rank } else { mesh.rank }
    };
    let to = mesh.tets.iter().zip(&inside).map(destination).collect();
    Ok(Regions { to, inside })
}

/// The least label of a tet's vertices.
fn least(tet: &[VertexId; 4], labels: &[Label]) -> Label {
    tet.iter().map(|v| labels[v.index()]).min().expect("four vertices")
}

/// **Collective.** Each vertex gets the least label within the given tets around it.
fn spread(
    comm: &dyn Communicator,
    mesh: &BareMesh,
    tets: impl Iterator<Item = usize>,
    labels: &mut [Label],
) -> Result<(), CommError> {
    let before = labels.to_vec();
    for tet in tets {
        let tet = &mesh.tets[tet];
        let label = least(tet, &before);
        tet.iter().for_each(|v| labels[v.index()] = labels[v.index()].min(label));
    }
    share(comm, mesh, labels)
}

/// **Collective.** All holders of a vertex take the least label of theirs.
fn share(comm: &dyn Communicator, mesh: &BareMesh, labels: &mut [Label]) -> Result<(), CommError> {
    for (v, _, label) in mesh.shared.exchange(comm, |v| labels[v as usize])? {
        labels[v as usize] = labels[v as usize].min(label);
    }
    Ok(())
}

impl Regions {
    /// **Collective.** The ids of the tets of regions that go to this rank, or stay here, and where they are now; ascending.
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
