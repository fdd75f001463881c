//! Moves both tets of an interface between bodies into one part, as far as balance allows.
//!
//! A solver that has only one of the two tets at a boundary element cannot compute a jump across
//! the interface, and gets a normal from that one side only. So if a cut runs along an interface,
//! or crosses it, the tets next to it take the part of the other side.

use super::metrics::sum_by_part;
use super::neighbours::{NONE, Neighbours};
use crate::ground::comm::{CommError, Communicator};
use crate::ground::mesh::Rank;
use crate::parallel::distribution::{BareMesh, Side};

/// Propagation steps, one interface each: bodies one tet thick between others need more than one.
const STEPS: usize = 8;

/// **Collective.** Changes the parts of tets at interfaces so that both tets of an interface face
/// are in the lower of their two parts.
///
/// Changes nothing if a part would then have more tets than the mean times `most_imbalance`. The
/// result does not depend on the distribution.
///
/// # Errors
/// [`CommError`] if another rank fails.
pub fn join_interfaces(
    comm: &dyn Communicator,
    mesh: &BareMesh,
    neighbours: &Neighbours,
    part: &mut Vec<Rank>,
    parts: u32,
    most_imbalance: f64,
) -> Result<(), CommError> {
    let across =
        |side: &Side| (side.tet.index(), neighbours.beside[side.tet.index()][usize::from(side.face)]);
    let pairs: Vec<(usize, u32)> =
        mesh.sides.iter().map(across).filter(|(_, other)| *other != NONE).collect();
    if comm.all_reduce_sum_u64([pairs.len() as u64])? == [0] {
        return Ok(());
    }
    let mut joined = part.clone();
    for _ in 0..STEPS {
        let all = neighbours.with_ghosts(comm, &joined)?;
        pairs.iter().for_each(|&(tet, other)| joined[tet] = joined[tet].min(all[other as usize]));
        let changed = joined.iter().zip(&all).any(|(new, old)| new != old);
        if comm.all_reduce_max_u64([u64::from(changed)])? == [0] {
            break;
        }
    }
    let mut mine = vec![0; parts as usize];
    joined.iter().for_each(|&rank| mine[rank as usize] += 1);
    let largest = sum_by_part(comm, &mine)?.into_iter().max().unwrap_or(0) as f64;
    if largest * f64::from(parts) <= most_imbalance * mesh.totals.tets as f64 {
        *part = joined;
    }
    Ok(())
}
