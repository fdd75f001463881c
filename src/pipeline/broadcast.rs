//! What rank 0 knows, for all ranks. All functions are collective.

use super::error::Error;
use super::model::Model;
use crate::ground::comm::Communicator;
use crate::ground::mesh::periodic::PeriodicMap;
use crate::ground::mesh::{GlobalId, Names};
use crate::ground::projector::Projector;
use crate::parallel::refine::EdgeDisplacements;

/// **Collective.** Broadcasts the periodic entities of the coarse mesh from rank 0.
pub(super) fn periodic(comm: &dyn Communicator, map: Option<&PeriodicMap>) -> Result<PeriodicMap, Error> {
    let mut numbers = map.map(PeriodicMap::encode).unwrap_or_default();
    comm.broadcast(0, &mut numbers)?;
    Ok(PeriodicMap::decode(&numbers))
}

/// **Collective.** Broadcasts the subdivisions of coarse edges from rank 0.
pub(super) fn pieces(comm: &dyn Communicator, pieces: Option<u32>) -> Result<u32, Error> {
    let mut pieces = vec![pieces.unwrap_or(1)];
    comm.broadcast(0, &mut pieces)?;
    Ok(pieces[0])
}

/// **Collective.** Broadcasts the edge displacements from rank 0.
pub(super) fn displacements(
    comm: &dyn Communicator,
    displacements: Option<&EdgeDisplacements>,
) -> Result<EdgeDisplacements, Error> {
    let (mut ids, mut middles): (Vec<GlobalId>, Vec<[f64; 3]>) =
        displacements.map(|displacements| displacements.edges().iter().copied().unzip()).unwrap_or_default();
    comm.broadcast(0, &mut ids)?;
    comm.broadcast(0, &mut middles)?;
    Ok(ids.into_iter().zip(middles).collect())
}

/// **Collective.** Broadcasts the singular entities of rank 0's geometry.
pub(super) fn singular(comm: &dyn Communicator, model: Option<&Model>) -> Result<csg::Singular, Error> {
    let csg::Singular { mut patches, mut curves, mut corners } = match model {
        Some(Model::Csg(model)) => model.features.singular(&model.geometry),
        _ => csg::Singular::default(),
    };
    factors(comm, &mut patches, |id| id.0, csg::PatchId)?;
    factors(comm, &mut curves, |id| id.0, csg::CurveId)?;
    factors(comm, &mut corners, |id| id.0, csg::CornerId)?;
    Ok(csg::Singular { patches, curves, corners })
}

/// **Collective.** Replaces the factors of entities by those of rank 0.
fn factors<Id>(
    comm: &dyn Communicator,
    factors: &mut Vec<(Id, i32)>,
    number: impl Fn(&Id) -> u32,
    id: impl Fn(u32) -> Id,
) -> Result<(), Error> {
    let mut numbers: Vec<[i64; 2]> =
        factors.iter().map(|(id, factor)| [number(id).into(), (*factor).into()]).collect();
    comm.broadcast(0, &mut numbers)?;
    *factors = numbers.iter().map(|&[number, factor]| (id(number as u32), factor as i32)).collect();
    Ok(())
}

/// **Collective.** Broadcasts the names and the surfaces from rank 0.
pub(super) fn geometry(comm: &dyn Communicator, model: Option<&Model>) -> Result<(Names, Projector), Error> {
    let mut bytes = model.map(|m| m.projector().encode()).unwrap_or_default();
    comm.broadcast_bytes(0, &mut bytes)?;
    let names = model.map(Model::names).unwrap_or_default();
    let mut text = serde_json::to_vec(&names).expect("plain data");
    comm.broadcast_bytes(0, &mut text)?;
    let names = serde_json::from_slice(&text).expect("JSON from rank 0");
    let projector = Projector::decode(&bytes).expect("a projector encoded by rank 0");
    Ok((names, projector))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::comm::thread;

    #[test]
    fn edges_that_rank_0_bends_are_bent_alike_on_all_ranks() {
        let bent: EdgeDisplacements =
            [(7, [0.5, 0.0, -1.25]), (1 << 40, [0.1, 0.2, 0.3])].into_iter().collect();
        let received =
            thread::run(3, |comm| displacements(comm, (comm.rank() == 0).then_some(&bent)).unwrap());
        assert_eq!(received.unwrap(), vec![bent; 3]);
    }
}
