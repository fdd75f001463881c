//! Size estimate of a refined part, computed from the coarse part without refining it.

use super::diagonal::Diagonals;
use super::lattice::Lattice;
use crate::ground::mesh::{GlobalId, Order, Rank};
use crate::parallel::distribution::{DistMesh, Shared};

/// Counts of fine vertices and tets of one part.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PredictedCounts {
    /// Tets.
    pub tets: u64,
    /// Local vertices, shared ones included.
    pub held: u64,
    /// Vertices shared with other ranks.
    pub shared: u64,
    /// Vertices owned by this rank.
    pub owned: u64,
    /// Bytes of coordinates and diagonals: with [`Keep::All`](super::Keep::All), and with
    /// [`Keep::Boundary`](super::Keep::Boundary).
    pub bytes: [u64; 2],
    /// The other ranks that share some of its vertices, ascending.
    pub neighbours: Vec<Rank>,
}

impl PredictedCounts {
    /// The fraction of its local vertices that a part owns.
    pub fn owned_share(&self) -> f64 {
        self.owned as f64 / self.held.max(1) as f64
    }
}

/// *Local.* Counts what this rank's part would contain with `n` subdivisions per edge.
///
/// # Panics
/// If no lattice has so many.
pub fn predicted_counts(mesh: &DistMesh, n: u32, order: Order) -> PredictedCounts {
    let [cells, lattice] = [n, n * order.degree()].map(Lattice::new);
    let [on_boundary @ .., inside_tet] = lattice.points_inside().map(u64::from);
    let totals = [mesh.totals.vertices, mesh.totals.edges, mesh.totals.faces];
    let kinds: [(&[GlobalId], &Shared); 3] = [
        (&mesh.vertex_ids, &mesh.shared_vertices),
        (&mesh.edge_ids, &mesh.shared_edges),
        (&mesh.face_ids, &mesh.shared_faces),
    ];
    let mut counts = PredictedCounts {
        tets: mesh.tets.len() as u64 * u64::from(cells.children()),
        ..PredictedCounts::default()
    };
    let mut first = 0;
    for ((ids, shared), (size, total)) in kinds.into_iter().zip(on_boundary.into_iter().zip(totals)) {
        counts.held += ids.len() as u64 * size;
        counts.shared += shared.len() as u64 * size;
        counts.owned += (ids.len() - shared.len()) as u64 * size;
        for (local, holders) in shared.iter() {
            let first_id = first + ids[local as usize] * size;
            counts.owned += owned(holders, mesh.rank, first_id, size);
            counts.neighbours.extend(holders.iter().filter(|&&holder| holder != mesh.rank));
        }
        first += total * size;
    }
    let inside = mesh.tets.len() as u64 * inside_tet;
    let diagonals = (mesh.tets.len() * Diagonals::bytes_of_tet(cells.octahedra())) as u64;
    counts.bytes = [counts.held + inside, counts.held].map(|vertices| 24 * vertices + diagonals);
    counts.held += inside;
    counts.owned += inside;
    counts.neighbours.sort_unstable();
    counts.neighbours.dedup();
    counts
}

/// The number of ids in `first..first + size` that `rank` owns: those congruent to its position
/// among the sharing ranks (see [`owner`](crate::parallel::distribution::owner)).
fn owned(holders: &[Rank], rank: Rank, first: GlobalId, size: u64) -> u64 {
    let count = holders.len() as u64;
    let place =
        holders.binary_search(&rank).expect("a rank is among the holders of its shared entities") as u64;
    let skipped = (place + count - first % count) % count;
    size.saturating_sub(skipped).div_ceil(count)
}
