//! The summary of a run, as text and as JSON. JSON keys are stable: they are only added to.

pub mod halo;
pub mod moved;
pub mod processes;
mod summary;

pub use halo::HaloReport;
pub use processes::{Processes, processes};

use serde::Serialize;
use tetmill::check::PartReport;
use tetmill::files::Written;
use tetmill::progress::StageTime;
use tetmill::run::{
    Balance, CoarseReport, Entities, Evened, Level, Metrics, Outcome, PeriodicCheck, Refused, StraightEdge,
};
use tetmill::{Generated, Geometry};

/// Report of a run.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Version of tetmill.
    pub version: String,
    /// The input files.
    pub geometry: String,
    /// The geometry's entities.
    pub entities: Entities,
    /// Number of ranks, in-process or MPI, which is the number of parts.
    pub ranks: u32,
    /// Threads in each process.
    pub threads: usize,
    /// Levels of uniform refinement: log₂ of `pieces`, rounded down.
    pub levels: u32,
    /// Subdivisions of each coarse edge.
    pub pieces: u32,
    /// The order of the elements: 1, or 2 for ten-node tets.
    pub order: u32,
    /// The coarse mesh.
    pub coarse: CoarseReport,
    /// Whether the requested number of coarse tets was reached: `reached`, `least`, `jumped` or
    /// `fewer`; null if none was requested.
    pub wanted: Option<Outcome>,
    /// The fine mesh.
    pub mesh: MeshReport,
    /// The shapes of all tets at each level of refinement, from the coarse mesh to the fine one.
    pub quality_by_level: Vec<LevelReport>,
    /// The partition.
    pub partition: PartitionReport,
    /// Check of the periodic faces; null if there are none.
    pub periodic: Option<PeriodicCheck>,
    /// Surfaces of parts that the mesher refused; null if the parts were refined.
    pub skins: Option<Refused>,
    /// Edge lengths relative to the size field; null if the parts were not meshed separately.
    pub delivered: Option<tetmill::run::DeliveredSizes>,
    /// Improvement of interfaces; null if nothing was done.
    pub across: Option<tetmill::run::InterfaceReport>,
    /// Balancing of the parts; null if nothing was done.
    pub evened: Option<Evened>,
    /// The ghosts that were written; null if none were requested.
    pub halo: Option<HaloReport>,
    /// The stages in order.
    pub stages: Vec<StageTime>,
    /// Seconds from start to end.
    pub seconds: f64,
    /// Peak resident memory of all processes together, bytes; null if the system does not report
    /// it.
    pub peak_memory: Option<u64>,
    /// Time and memory of the processes.
    pub processes: Processes,
    /// Files written.
    pub files: u64,
    /// Bytes written.
    pub bytes: u64,
}
/// Report of the mesh.
#[derive(Clone, Debug, Serialize)]
pub struct MeshReport {
    /// Vertices.
    pub vertices: u64,
    /// Tets.
    pub tets: u64,
    /// Triangles on patches.
    pub boundary: u64,
    /// Volume.
    pub volume: f64,
    /// Volume of each body.
    pub body_volumes: Vec<f64>,
    /// The least mean ratio.
    pub worst_mean_ratio: f64,
    /// The mean of the mean ratios.
    pub mean_mean_ratio: f64,
    /// The smallest dihedral angle, degrees.
    pub smallest_dihedral: f64,
    /// The 1st percentile of each tet's smallest dihedral angle, degrees.
    pub first_percentile_dihedral: f64,
    /// The largest dihedral angle, degrees.
    pub largest_dihedral: f64,
    /// The largest distance of a boundary vertex from its patch; null if none was measured.
    pub furthest_off_surface: Option<f64>,
    /// A lower bound of the scaled Jacobian of all tets; null for order 1.
    pub scaled_jacobian: Option<f64>,
    /// Edges on the boundary that are straight, because the tets beside them would not be valid in
    /// second order otherwise (`--allow-off-surface`): the global ids of their nodes, the places,
    /// and the distances from the surface or curve.
    pub straight_edges: Vec<StraightEdge>,
    /// Identifies the mesh, whatever the number of ranks and threads.
    pub checksum: String,
}

impl MeshReport {
    /// Creates the report from the check of a mesh.
    pub fn new(check: &PartReport, straight_edges: Vec<StraightEdge>, checksum: String) -> Self {
        let shape = check.shape.as_ref();
        Self {
            vertices: check.vertices,
            tets: check.tets,
            boundary: check.boundary,
            volume: check.volume,
            body_volumes: check.body_volumes.clone(),
            worst_mean_ratio: shape.map_or(0.0, |s| s.worst_ratio.value),
            mean_mean_ratio: check.mean_ratio().unwrap_or(0.0),
            smallest_dihedral: shape.map_or(0.0, |s| s.smallest_angle.value),
            first_percentile_dihedral: shape.map_or(0.0, |s| s.smallest_angle_percentile(0.01)),
            largest_dihedral: shape.map_or(0.0, |s| s.largest_angle.value),
            furthest_off_surface: check.furthest.map(|f| f.distance),
            scaled_jacobian: check.scaled_jacobian.map(|least| least.value),
            straight_edges,
            checksum,
        }
    }
}

/// Shapes of all tets of one level of refinement.
#[derive(Clone, Debug, Serialize)]
pub struct LevelReport {
    /// Subdivisions of each coarse edge.
    pub pieces: u32,
    /// Tets.
    pub tets: u64,
    /// The least mean ratio.
    pub worst_mean_ratio: f64,
    /// The 1st percentile of the mean ratios.
    pub first_percentile_mean_ratio: f64,
    /// The mean of the mean ratios.
    pub mean_mean_ratio: f64,
    /// The smallest dihedral angle, degrees.
    pub smallest_dihedral: f64,
    /// The 1st percentile of each tet's smallest dihedral angle, degrees.
    pub first_percentile_dihedral: f64,
    /// The largest dihedral angle, degrees.
    pub largest_dihedral: f64,
    /// The 99th percentile of each tet's largest dihedral angle, degrees.
    pub last_percentile_dihedral: f64,
    /// A lower bound of the scaled Jacobian of all tets; null for order 1, and for a level that is
    /// not valid in second order.
    pub scaled_jacobian: Option<f64>,
}

impl LevelReport {
    /// Creates the report of a level.
    pub fn new(level: &Level) -> Self {
        let shape = &level.shape;
        Self {
            pieces: level.pieces,
            tets: level.tets,
            worst_mean_ratio: shape.worst_ratio.value,
            first_percentile_mean_ratio: shape.ratio_percentile(0.01),
            mean_mean_ratio: shape.mean_ratio(),
            smallest_dihedral: shape.smallest_angle.value,
            first_percentile_dihedral: shape.smallest_angle_percentile(0.01),
            largest_dihedral: shape.largest_angle.value,
            last_percentile_dihedral: shape.largest_angle_percentile(0.99),
            scaled_jacobian: level.scaled_jacobian.map(|least| least.value),
        }
    }
}

/// The partition of the mesh.
#[derive(Clone, Debug, Serialize)]
pub struct PartitionReport {
    /// Name of the method.
    pub method: String,
    /// The number of parts.
    pub parts: u32,
    /// Tets in the largest part over the mean.
    pub imbalance: f64,
    /// Coarse faces between parts.
    pub edge_cut: u64,
    /// Triangles between bodies whose coarse tets are in different parts. Not counted for parts
    /// that were meshed separately.
    pub cut_interfaces: u64,
    /// Coarse tets at periodic faces that are in another part than Elmer needs.
    pub split_periodic: u64,
    /// Connected components of all parts.
    pub pieces: u64,
    /// Fine vertices in more than one part, each counted once.
    pub shared_vertices: u64,
    /// Largest fraction of its vertices that a part owns, relative to the mean of all parts.
    pub owner_imbalance: f64,
}

impl PartitionReport {
    /// Combines the metrics of the coarse partition with the balance of the fine mesh.
    pub fn new(metrics: &Metrics, balance: Balance) -> Self {
        Self {
            method: metrics.method.map_or("planes through the geometry".into(), |method| method.to_string()),
            parts: metrics.parts,
            imbalance: balance.tets,
            edge_cut: metrics.edge_cut as u64,
            cut_interfaces: metrics.cut_interfaces as u64,
            split_periodic: metrics.lost_ties as u64,
            pieces: balance.pieces.unwrap_or(metrics.pieces as u64),
            shared_vertices: balance.shared_vertices,
            owner_imbalance: balance.owned,
        }
    }
}

impl Report {
    /// Creates the report of rank 0, without halo, stages, duration and files.
    ///
    /// # Panics
    /// On other ranks, which have no coarse mesh.
    pub fn new(
        geometry: &Geometry,
        input: &str,
        made: &Generated,
        took: Processes,
        ranks: u32,
        balance: Balance,
    ) -> Self {
        let coarse = made.coarse.as_ref().expect("rank 0 made the coarse mesh");
        Self {
            version: env!("CARGO_PKG_VERSION").into(),
            geometry: input.to_owned(),
            entities: geometry.entities(),
            ranks,
            threads: rayon::current_num_threads(),
            levels: made.pieces.ilog2(),
            pieces: made.pieces,
            order: made.stream().order().degree(),
            coarse: coarse.report.clone(),
            wanted: coarse.outcome,
            mesh: MeshReport::new(&made.check, made.straight.clone(), made.checksum.to_string()),
            quality_by_level: made.levels.iter().map(LevelReport::new).collect(),
            partition: PartitionReport::new(&coarse.partition, balance),
            periodic: made.periodic,
            skins: made.refused.clone(),
            delivered: made.delivered,
            across: made.across,
            evened: made.evened,
            halo: None,
            stages: Vec::new(),
            seconds: 0.0,
            peak_memory: took.memory(),
            processes: took,
            files: 0,
            bytes: 0,
        }
    }

    /// Adds the files that were written.
    pub fn add_written(&mut self, written: Written) {
        self.files += written.files;
        self.bytes += written.bytes;
    }
}

/// A count with blanks between groups of three digits.
fn grouped(count: u64) -> String {
    let digits = count.to_string();
    let first = digits.len() % 3;
    let (head, tail) = digits.split_at(first);
    let mut groups: Vec<&str> = if head.is_empty() { Vec::new() } else { vec![head] };
    groups.extend((0..tail.len() / 3).map(|i| &tail[3 * i..3 * i + 3]));
    groups.join(" ")
}

/// A count with its noun.
pub fn counted(count: u64, one: &str, several: &str) -> String {
    format!("{} {}", grouped(count), if count == 1 { one } else { several })
}

/// A number of tets as text.
fn tets(count: u64) -> String {
    counted(count, "tet", "tets")
}

/// A number of vertices as text.
fn vertices(count: u64) -> String {
    counted(count, "vertex", "vertices")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_grouped_and_nouns_agree_with_them() {
        assert_eq!(grouped(1_234_567), "1 234 567");
        assert_eq!(grouped(12), "12");
        assert_eq!(grouped(123_456), "123 456");
        assert_eq!(counted(1, "body", "bodies"), "1 body");
        assert_eq!(counted(1200, "body", "bodies"), "1 200 bodies");
    }
}
