//! Report of a repartition.

use super::{HaloReport, MeshReport, Processes, counted, tets, vertices};
use serde::Serialize;
use std::fmt;
use tetmill::files::Written;
use tetmill::memory::sized;
use tetmill::progress::StageTime;
use tetmill::repartition::{Metrics, Repartitioned};

/// Report of a repartition.
#[derive(Clone, Debug, Serialize)]
pub struct MoveReport {
    /// Version of tetmill.
    pub version: String,
    /// The folder with the files that were read.
    pub input: String,
    /// How tets were assigned to parts.
    pub method: String,
    /// Number of ranks, in-process or MPI.
    pub ranks: u32,
    /// The partition that was read; `moving` counts the tets read by other ranks than they were
    /// moved to.
    pub before: Metrics,
    /// The new one.
    pub after: Metrics,
    /// Tets that moved to another rank.
    pub moved_tets: u64,
    /// Bytes of the messages that moved them.
    pub moved_bytes: u64,
    /// The mesh.
    pub mesh: MeshReport,
    /// The ghosts that were written; null if none were requested.
    pub halo: Option<HaloReport>,
    /// Notes on the files that were read.
    pub notes: Vec<String>,
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

impl MoveReport {
    /// Creates the report; the caller fills in the halo, times and files.
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
            mesh: MeshReport::new(&done.check, Vec::new(), done.checksum.to_string()),
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

    /// Adds the files that were written.
    pub fn add_written(&mut self, written: Written) {
        self.files += written.files;
        self.bytes += written.bytes;
    }
}

fn write_metrics(f: &mut fmt::Formatter<'_>, name: &str, metrics: &Metrics) -> fmt::Result {
    writeln!(
        f,
        "{name:<10} {}, imbalance {:.3}, {} cut, {} shared, neighbours {:.1} in the mean and {} at most",
        counted(metrics.parts.into(), "part", "parts"),
        metrics.imbalance,
        counted(metrics.edge_cut, "face", "faces"),
        vertices(metrics.shared_vertices),
        metrics.mean_neighbours,
        metrics.most_neighbours
    )
}

impl fmt::Display for MoveReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mesh = &self.mesh;
        writeln!(
            f,
            "mesh       {}: {}, {}, {}",
            self.input,
            tets(mesh.tets),
            vertices(mesh.vertices),
            counted(mesh.boundary, "boundary triangle", "boundary triangles")
        )?;
        write_metrics(f, "before", &self.before)?;
        write_metrics(f, "after", &self.after)?;
        writeln!(
            f,
            "moved      {} between {}, {}, by {}",
            tets(self.moved_tets),
            counted(self.ranks.into(), "rank", "ranks"),
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
        write!(f, "written    {}, {}", counted(self.files, "file", "files"), sized(self.bytes))
    }
}
