//! Periodic nodes and ghosts as records of one rank, by tags.

use super::plan::Plan;
use crate::files::WriteError;
use crate::ground::comm::Communicator;
use crate::ground::mesh::{GlobalId, Rank};
use std::collections::BTreeMap;

/// A tet that is a ghost of other parts.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Ghost {
    pub tag: u64,
    /// The number of its own part, from 1.
    pub owner: u32,
    /// The numbers of the parts that have it as a ghost.
    pub parts: Vec<u32>,
}

/// The nodes of each link with their masters, of the nodes of this part that `keep` accepts by
/// local index.
pub(super) fn pairs(plan: &Plan, keep: impl Fn(u32) -> bool) -> Vec<Vec<[u64; 2]>> {
    let of_link = |link: usize| {
        let images = plan.part.images(link).into_iter().filter(|(local, _)| keep(*local));
        images.map(|(local, of)| [plan.part.vertex_id(local) + 1, of + 1]).collect()
    };
    (0..plan.part.links().len()).map(of_link).collect()
}

/// The ghosts of this part.
pub(super) fn ghosts_of_part(plan: &Plan) -> Vec<Ghost> {
    let tets = plan.part.ghosts().map_or(&[][..], |ghosts| &ghosts.tets);
    let ghost = |tag, owner: Rank| Ghost { tag, owner: owner + 1, parts: vec![plan.number()] };
    tets.iter().map(|tet| ghost(tet.id + 1, tet.owner)).collect()
}

/// **Collective.** The tets of this part that are ghosts of others, with all these parts.
pub(super) fn ghosts_elsewhere(comm: &dyn Communicator, plan: &Plan) -> Result<Vec<Ghost>, WriteError> {
    let mut to: BTreeMap<Rank, Vec<GlobalId>> = BTreeMap::new();
    for tet in plan.part.ghosts().iter().flat_map(|ghosts| &ghosts.tets) {
        to.entry(tet.owner).or_default().push(tet.id);
    }
    let received = comm.exchange(to.into_iter().collect())?;
    let mut found: Vec<(GlobalId, Rank)> =
        received.into_iter().flat_map(|(from, ids)| ids.into_iter().map(move |id| (id, from))).collect();
    found.sort_unstable();
    let ghost = |copies: &[(GlobalId, Rank)]| Ghost {
        tag: copies[0].0 + 1,
        owner: plan.number(),
        parts: copies.iter().map(|(_, rank)| rank + 1).collect(),
    };
    Ok(found.chunk_by(|a, b| a.0 == b.0).map(ghost).collect())
}
