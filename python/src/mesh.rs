//! Meshes in memory.

use crate::arrays::{PartArrays, PartSharing, check_count};
use crate::blocks::Blocks;
use crate::error::exception;
use crate::geometry::{Labels, labels};
use crate::ghosts::PartGhosts;
use crate::picture::{View, draw};
use crate::watch::watched;
use crate::write::{Target, by, write};
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;
use std::sync::Arc;
use tetmill::comm::{Communicator, thread};
use tetmill::error::Error;
use tetmill::mesh::{Arrays, TetBlock, VertexId};
use tetmill::progress::{Observer, Progress};
use tetmill::{Generated, Point, check, quality};

/// A mesh with all its parts.
#[pyclass(frozen, module = "tetmill._native")]
pub struct Mesh {
    /// By rank; at least one.
    parts: Vec<Generated>,
    /// JSON.
    report: String,
    notes: Vec<String>,
}

impl Mesh {
    /// A mesh of all ranks of a run.
    pub fn new(parts: Vec<Generated>, report: String, notes: Vec<String>) -> Self {
        Self { parts, report, notes }
    }

    /// The part of a rank that exists.
    pub fn made(&self, rank: usize) -> &Generated {
        &self.parts[rank]
    }

    /// Runs a collective function on all ranks; returns the results by rank, and the notes.
    fn on_ranks<T: Send>(
        &self,
        py: Python<'_>,
        progress: Option<&Py<PyAny>>,
        body: impl Fn(&dyn Communicator, &Generated, &Progress) -> Result<T, Error> + Sync,
    ) -> PyResult<(Vec<T>, Vec<String>)> {
        watched(py, progress, &Arc::default(), |watcher| {
            thread::try_run(self.parts.len() as u32, |comm| {
                let others = watcher.others();
                let observer: &dyn Observer = if comm.rank() == 0 { watcher } else { &others };
                body(comm, &self.parts[comm.rank() as usize], &Progress::new(observer))
            })
        })
    }

    fn part(&self, rank: usize) -> PyResult<&Generated> {
        let count = self.parts.len();
        self.parts.get(rank).ok_or_else(|| PyIndexError::new_err(format!("part {rank} of {count}")))
    }

    /// The points and tets of all parts as one mesh, which has shared vertices several times.
    fn joined(&self) -> tetmill::mesh::Mesh {
        let mut mesh = tetmill::mesh::Mesh::default();
        let mut block = TetBlock::default();
        for stream in self.parts.iter().map(Generated::stream) {
            let first = mesh.points.len() as u32;
            for index in 0..stream.vertex_blocks() {
                mesh.points.extend(stream.vertex_points(index).iter().map(|&point| Point::from(point)));
            }
            for index in 0..stream.tet_blocks() {
                stream.tet_block(index, &mut block);
                mesh.tets.extend(block.tets.iter().map(|tet| tet.map(|vertex| VertexId(first + vertex))));
                mesh.bodies.resize(mesh.tets.len(), block.body.expect("a tet block has a body"));
            }
        }
        mesh
    }
}

#[pymethods]
impl Mesh {
    /// The report of the command line, as JSON.
    fn report(&self) -> &str {
        &self.report
    }

    /// Messages of the run.
    fn notes(&self) -> Vec<String> {
        self.notes.clone()
    }

    fn checksum(&self) -> String {
        self.parts[0].checksum.to_string()
    }

    /// The number of parts.
    fn count(&self) -> usize {
        self.parts.len()
    }

    /// Vertices, tets and faces of the whole mesh; shared ones count once.
    fn totals(&self) -> (u64, u64, u64) {
        let totals = self.parts[0].stream().totals();
        (totals.vertices, totals.tets, totals.boundary)
    }

    /// Vertices, tets and faces of one part.
    fn counts(&self, rank: usize) -> PyResult<(u64, u64, u64)> {
        let counts = self.part(rank)?.stream().counts();
        Ok((counts.vertices, counts.tets, counts.boundary))
    }

    /// Numbers and names of the bodies.
    fn body_labels(&self) -> Labels {
        labels(&self.parts[0].names.bodies)
    }

    /// Numbers and names of the patches.
    fn patch_labels(&self) -> Labels {
        labels(&self.parts[0].names.patches)
    }

    /// The indices of the patches with this name.
    fn patches_named(&self, py: Python<'_>, name: &str) -> PyResult<Vec<u32>> {
        let found = self.parts[0].names.patches_named(name);
        Ok(found.map_err(|error| exception(py, &error.into()))?.iter().map(|patch| patch.0).collect())
    }

    /// The numbers of the bodies with this name.
    fn bodies_named(&self, py: Python<'_>, name: &str) -> PyResult<Vec<u32>> {
        let names = &self.parts[0].names;
        let found = names.bodies_named(name).map_err(|error| exception(py, &error.into()))?;
        Ok(found.iter().map(|body| names.bodies[body.index()].number).collect())
    }

    /// The arrays of one part.
    fn arrays(&self, py: Python<'_>, rank: usize) -> PyResult<PartArrays> {
        let made = self.part(rank)?;
        check_count(made.stream().counts().vertices)?;
        PartArrays::new(py, py.detach(|| Arrays::of(made.stream())), &made.names)
    }

    /// The shared vertices of one part.
    fn sharing(&self, py: Python<'_>, rank: usize) -> PyResult<PartSharing> {
        let made = self.part(rank)?;
        let vertices = made.stream().counts().vertices;
        check_count(vertices)?;
        let sharing = py.detach(|| made.sharing());
        Ok(PartSharing::new(py, &sharing, rank as u32, vertices as usize))
    }

    /// The ghosts of all parts.
    fn ghosts(&self, py: Python<'_>, halo: &str) -> PyResult<Vec<PartGhosts>> {
        let (ghosts, _) = self.on_ranks(py, None, |comm, made, _| made.ghosts(comm, by(halo)))?;
        ghosts.iter().map(|ghosts| PartGhosts::new(py, ghosts, &self.parts[0].names)).collect()
    }

    /// The blocks of one part.
    fn blocks(this: Bound<'_, Self>, rank: usize, size: usize) -> PyResult<Blocks> {
        this.get().part(rank)?;
        Ok(Blocks::new(this.unbind(), rank, size))
    }

    /// The shapes of all tets, as JSON.
    fn quality(&self, py: Python<'_>) -> PyResult<String> {
        let (mut measured, _) = watched(py, None, &Arc::default(), |_| Ok(quality::measure(&self.joined())))?;
        let totals = self.parts[0].stream().totals();
        (measured.vertices, measured.boundary) = (totals.vertices as usize, totals.boundary as usize);
        Ok(serde_json::to_string(&measured).expect("plain data"))
    }

    /// Checks all parts again; returns the number of faults and the texts of the first ones.
    fn check(&self, py: Python<'_>) -> PyResult<(u64, Vec<String>)> {
        let (reports, _) = self.on_ranks(py, None, |comm, made, _| {
            Ok(check::check(comm, made.stream(), None, &check::Settings::default())?)
        })?;
        let report = &reports[0];
        Ok((report.faults, report.described.iter().map(ToString::to_string).collect()))
    }

    /// A picture as PNG.
    fn picture(&self, py: Python<'_>, view: View) -> PyResult<Vec<u8>> {
        let (images, _) = self.on_ranks(py, None, |comm, made, _| draw(comm, made.stream(), &view))?;
        Ok(images.into_iter().flatten().next().expect("rank 0 draws"))
    }

    /// Writes files; returns their number, their bytes, and notes.
    fn write(
        &self,
        py: Python<'_>,
        target: Target,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<(u64, u64, Vec<String>)> {
        let (written, notes) = self.on_ranks(py, progress.as_ref(), |comm, made, progress| {
            write(comm, made.stream(), &made.names, &target, progress)
        })?;
        Ok((written[0].files, written[0].bytes, notes))
    }
}
