//! The edges or faces of all tets: numbered, with their tets.

use super::NONE;
use super::lists::{Entries, Lists, Rows};
use crate::files::number::Numbering;
use crate::ground::comm::{CommError, Communicator};
use crate::ground::mesh::stream::MeshStream;
use bytemuck::Pod;

/// The tets of a part, with the rows of all parts.
pub(super) struct Tets<'a> {
    pub part: &'a dyn MeshStream,
    pub numbering: &'a Numbering,
    pub rows: Rows,
}

/// The edges (V = 2, K = 6) or faces (V = 3, K = 4) of the mesh.
#[derive(Debug)]
pub(super) struct Sides<const V: usize, const K: usize> {
    /// The numbers that each rank has.
    pub owned: Rows,
    /// The ascending vertices of this rank's edges or faces, in lexicographic order.
    pub rows: Vec<[u64; V]>,
    /// The tets of each of them.
    pub tets: Lists,
    /// The edges or faces of each tet of the part.
    pub of_tet: Vec<[u64; K]>,
}

impl<const V: usize, const K: usize> Sides<V, K> {
    /// This rank's edges or faces with their numbers.
    pub fn rows_with_numbers(&self) -> impl Iterator<Item = (u64, [u64; V])> {
        self.owned.own().zip(self.rows.iter().copied())
    }
}

/// **Collective.** Numbers the edges or faces of all tets. `columns` has the corners of each of the
/// K of a tet; E is V + 1.
pub(super) fn number<const V: usize, const E: usize, const K: usize>(
    comm: &dyn Communicator,
    tets: &Tets,
    vertices: &Rows,
    columns: &[[usize; V]; K],
) -> Result<Sides<V, K>, CommError>
where
    [u64; E]: Pod,
{
    let count = tets.part.counts().tets as usize;
    // Ascending vertices, then K × tet + column.
    let mut entries = Entries::<E>::new(comm, vertices, K * count);
    tets.for_each(|_, tet, corners| {
        for (place, column) in (K as u64 * tet..).zip(columns) {
            let mut side = column.map(|corner| corners[corner]);
            side.sort_unstable();
            let mut entry = [place; E];
            entry[..V].copy_from_slice(&side);
            entries.push(entry);
        }
    });
    let entries = entries.sorted(comm)?;
    let same = |a: &[u64; E], b: &[u64; E]| a[..V] == b[..V];
    let mut rows = Vec::with_capacity(entries.chunk_by(same).count());
    let mut counts = Vec::with_capacity(rows.capacity());
    for of_side in entries.chunk_by(same) {
        let mut side = [0; V];
        side.copy_from_slice(&of_side[0][..V]);
        rows.push(side);
        counts.push(of_side.len() as u64);
    }
    let owned = Rows::of(comm, rows.len() as u64)?;
    let numbers = owned.own().zip(entries.chunk_by(same));
    let places = numbers.flat_map(|(side, of_side)| of_side.iter().map(move |entry| [entry[V], side]));
    let of_tet = columns_of_tets(comm, tets, places)?;
    let values = entries.iter().map(|entry| entry[V] / K as u64).collect();
    drop(entries);
    Ok(Sides { owned, rows, tets: Lists::new(comm, counts, values)?, of_tet })
}

/// **Collective.** Sends numbers to the tets that have them; `places` are pairs of K × tet + column
/// and number.
fn columns_of_tets<const K: usize>(
    comm: &dyn Communicator,
    tets: &Tets,
    places: impl Iterator<Item = [u64; 2]>,
) -> Result<Vec<[u64; K]>, CommError> {
    let own = tets.rows.own();
    let mut of_tet = vec![[NONE; K]; (own.end - own.start) as usize];
    let mut put = |[place, number]: [u64; 2]| {
        of_tet[(place / K as u64 - own.start) as usize][(place % K as u64) as usize] = number;
    };
    let mut to_each: Vec<Vec<[u64; 2]>> = vec![Vec::new(); comm.size() as usize];
    for [place, number] in places {
        let tet = place / K as u64;
        if own.contains(&tet) {
            put([place, number]);
        } else {
            to_each[tets.rows.rank_of(tet) as usize].push([place, number]);
        }
    }
    comm.all_to_all(to_each)?.into_iter().flatten().for_each(put);
    Ok(of_tet)
}
