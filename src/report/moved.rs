//! The summary of a repartition.

use super::{HaloReport, MeshReport, Processes, grouped};
use crate::io::Written;
use crate::memory::sized;
use crate::pipeline::Repartitioned;
use crate::progress::Stage;
use crate::repartition::Metrics;
use serde::Serialize;
use std::fmt;

/// What a repartition did.
#[derive(Clone, Debug, Serialize)]
pub struct MoveReport {
    /// Version of tetmill.
    pub version: String,
    /// The folder with the files that were read.
    pub input: String,
    /// How tets were given to parts.
    pub method: String,
    /// In-process ranks or MPI's.
    pub ranks: u32,
    /// The partition that was read; `moving` counts tets that other ranks read than have them now.
    pub before: Metrics,
    /// The new one.
    pub after: Metrics,
    /// Tets that went from one rank to another.
    pub moved_tets: u64,
    /// Bytes that they and what they need took.
    pub moved_bytes: u64,
    /// The mesh.
    pub mesh: MeshReport,
    /// The ghosts that were written; null where none were asked for.
    pub halo: Option<HaloReport>,
    /// What users should know of the files.
    pub notes: Vec<String>,
    /// The stages in order.
    pub stages: Vec<Stage>,
    /// Seconds from start to end.
    pub seconds: f64,
    /// Peak resident memory of all processes together, bytes; null where the system does not tell.
    pub peak_memory: Option<u64>,
    /// What each process took.
    pub processes: Processes,
    /// Files written.
    pub files: u64,
    /// Bytes written.
    pub bytes: u64,
}

impl MoveReport {
    /// Of a repartition on so many ranks; what comes after it (writing, times) is left empty.
    pub fn new(done: &Repartitioned, method: String, ranks: u32, processes: Processes) -> Self {
        Self {
            version: env!("CARGO_PKG_VERSION").into(),
            input: done.folder.display().to_string(),
            method,
            ranks,
            before: done.before,
            after: done.after,
            moved_tets: done.moved.tets,
            moved_bytes: done.moved.bytes,
            mesh: MeshReport::new(&done.check, done.checksum.to_string()),
            halo: None,
            notes: done.notes.clone(),
            stages: Vec::new(),
            seconds: 0.0,
            peak_memory: processes.memory(),
            processes,
            files: 0,
            bytes: 0,
        }
    }

    /// Adds what was written.
    pub fn add_written(&mut self, written: Written) {
        self.files += written.files;
        self.bytes += written.bytes;
    }
}

fn write_metrics(f: &mut fmt::Formatter<'_>, name: &str, metrics: &Metrics) -> fmt::Result {
    writeln!(
        f,
        "{name:<10} {} parts, imbalance {:.3}, {} faces cut, {} vertices shared, neighbours {:.1} in the mean and {} at most",
        metrics.parts,
        metrics.imbalance,
        grouped(metrics.edge_cut),
        grouped(metrics.shared_vertices),
        metrics.mean_neighbours,
        metrics.most_neighbours
    )
}

impl fmt::Display for MoveReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mesh = &self.mesh;
        writeln!(
            f,
            "mesh       {}: {} tets, {} vertices, {} boundary triangles",
            self.input,
            grouped(mesh.tets),
            grouped(mesh.vertices),
            grouped(mesh.boundary)
        )?;
        write_metrics(f, "before", &self.before)?;
        write_metrics(f, "after", &self.after)?;
        writeln!(
            f,
            "moved      {} tets between {} ranks, {}, by {}",
            grouped(self.moved_tets),
            self.ranks,
            sized(self.moved_bytes),
            self.method
        )?;
        writeln!(
            f,
            "checked    every tet positive; volume {}; the mesh is the same after the move",
            mesh.volume
        )?;
        if let Some(halo) = &self.halo {
            write!(f, "{halo}")?;
        }
        for note in &self.notes {
            writeln!(f, "note       {note}")?;
        }
        let stages: Vec<String> =
            self.stages.iter().map(|s| format!("{} {:.2}", s.name, s.seconds)).collect();
        writeln!(f, "seconds    {:.2} in all: {}", self.seconds, stages.join(", "))?;
        write!(f, "{}", self.processes)?;
        write!(f, "written    {} files, {}", self.files, sized(self.bytes))
    }
}
