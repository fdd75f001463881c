//! What a part of a refined mesh holds, owns and shares, told by arithmetic from its coarse part, however large it would be.

use super::lattice::Lattice;
use crate::dist::{DistMesh, Shared};
use crate::mesh::{GlobalId, Rank};

/// The fine vertices and tets of one part.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Census {
    /// Tets.
    pub tets: u64,
    /// Vertices held.
    pub held: u64,
    /// Vertices held by others too.
    pub shared: u64,
    /// Vertices owned.
    pub owned: u64,
    /// Bytes of the coordinates of all vertices, and of those alone that are kept where not all are.
    pub bytes: [u64; 2],
    /// The other ranks that hold some of its vertices, ascending.
    pub neighbours: Vec<Rank>,
}

impl Census {
    /// The share of its vertices that a part owns.
    pub fn owned_share(&self) -> f64 {
        self.owned as f64 / self.held.max(1) as f64
    }
}

/// *Local.* Counts what this rank's part would have with `n` pieces an edge.
pub fn census(mesh: &DistMesh, n: u32) -> Census {
    let lattice = Lattice::new(n);
    let [on_boundary @ .., inside_tet] = lattice.points_inside().map(u64::from);
    let totals = [mesh.totals.vertices, mesh.totals.edges, mesh.totals.faces];
    let kinds: [(&[GlobalId], &Shared); 3] = [
        (&mesh.vertex_ids, &mesh.shared_vertices),
        (&mesh.edge_ids, &mesh.shared_edges),
        (&mesh.face_ids, &mesh.shared_faces),
    ];
    let mut census =
        Census { tets: mesh.tets.len() as u64 * u64::from(lattice.children()), ..Census::default() };
    let mut first = 0;
    for ((ids, shared), (size, total)) in kinds.into_iter().zip(on_boundary.into_iter().zip(totals)) {
        census.held += ids.len() as u64 * size;
        census.shared += shared.len() as u64 * size;
        census.owned += (ids.len() - shared.len()) as u64 * size;
        for (local, holders) in shared.iter() {
            let first_id = first + ids[local as usize] * size;
            census.owned += owned(holders, mesh.rank, first_id, size);
            census.neighbours.extend(holders.iter().filter(|&&holder| holder != mesh.rank));
        }
        first += total * size;
    }
    let inside = mesh.tets.len() as u64 * inside_tet;
    census.bytes = [census.held + inside, census.held].map(|vertices| 24 * vertices);
    census.held += inside;
    census.owned += inside;
    census.neighbours.sort_unstable();
    census.neighbours.dedup();
    census
}

/// How many of the `size` ids from `first` on `rank` owns: those that leave its place among the holders as their remainder.
fn owned(holders: &[Rank], rank: Rank, first: GlobalId, size: u64) -> u64 {
    let count = holders.len() as u64;
    let place = holders.binary_search(&rank).expect("a rank holds what it shares") as u64;
    let skipped = (place + count - first % count) % count;
    size.saturating_sub(skipped).div_ceil(count)
}
