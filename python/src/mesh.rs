//! Meshes in memory.

use crate::arrays::{PartArrays, PartSharing, check_count, small};
use crate::blocks::Blocks;
use crate::error::Failure;
use crate::geometry::{Labels, labels};
use crate::ghosts::PartGhosts;
use crate::levels::Level;
use crate::picture::{View, draw};
use crate::ranks::{Ranks, on_ranks};
use crate::watch::watched;
use crate::write::{Target, by, write};
use numpy::PyArray1;
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use tetmill::check::{self, PartReport};
use tetmill::comm::Communicator;
use tetmill::error::Error;
use tetmill::mesh::{Arrays, BoundaryBlock, MeshStream, Names, TetBlock, VertexId};
use tetmill::progress::Progress;
use tetmill::{Generated, Point, quality};

/// A mesh: the parts of this process, and what is known of the whole.
#[pyclass(frozen, module = "tetmill._native")]
pub struct Mesh {
    /// By rank; none if there are more processes than parts.
    parts: Vec<Generated>,
    ranks: Ranks,
    whole: Whole,
    notes: Vec<String>,
}

/// What all processes know, also those without a part.
#[derive(Serialize, Deserialize)]
struct Whole {
    names: Names,
    /// Vertices, tets and faces; shared ones count once.
    totals: (u64, u64, u64),
    checksum: String,
    /// JSON.
    report: String,
}

impl Whole {
    fn new(made: &Generated, report: String) -> Self {
        let totals = made.stream().totals();
        Self {
            names: made.names.clone(),
            totals: (totals.vertices, totals.tets, totals.boundary),
            checksum: made.checksum.to_string(),
            report,
        }
    }
}

impl Mesh {
    /// **Collective** over the processes. The report is that of process 0.
    pub fn new(
        py: Python<'_>,
        parts: Vec<Generated>,
        ranks: Ranks,
        report: Option<String>,
        notes: Vec<String>,
    ) -> PyResult<Self> {
        let whole = parts.first().zip(report).map(|(made, report)| Whole::new(made, report));
        let whole = py.detach(|| ranks.share(whole)).map_err(|error| raise(py, error))?;
        Ok(Self { parts, ranks, whole, notes })
    }

    /// The numbers and names of bodies and boundaries.
    pub fn names(&self) -> &Names {
        &self.whole.names
    }

    /// A part of this process that exists, by its index.
    pub fn made(&self, index: usize) -> &Generated {
        &self.parts[index]
    }

    /// **Collective** over the processes. Runs a collective function on all ranks; returns the
    /// results of this process by rank, and the notes.
    fn on_ranks<T: Send>(
        &self,
        py: Python<'_>,
        progress: Option<&Py<PyAny>>,
        body: impl Fn(&dyn Communicator, &Generated, &Progress) -> Result<T, Error> + Sync,
    ) -> PyResult<(Vec<T>, Vec<String>)> {
        let first = self.parts.first().map_or(0, |made| made.stream().rank());
        on_ranks(py, &self.ranks, progress, &Arc::default(), |comm, progress| {
            Ok(body(comm, &self.parts[(comm.rank() - first) as usize], progress)?)
        })
    }

    /// **Collective** over the processes. What process 0 has.
    fn share<T: Serialize + DeserializeOwned + Send>(&self, py: Python<'_>, mine: Option<T>) -> PyResult<T> {
        py.detach(|| self.ranks.share(mine)).map_err(|error| raise(py, error))
    }

    fn part(&self, index: usize) -> PyResult<&Generated> {
        let count = self.parts.len();
        self.parts.get(index).ok_or_else(|| PyIndexError::new_err(format!("part {index} of {count}")))
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

/// *Local.* For each vertex of a part, whether it has a face there on one of the patches.
fn on_patches(part: &dyn MeshStream, patches: &[u32]) -> Vec<bool> {
    let mut is_on = vec![false; part.counts().vertices as usize];
    let mut block = BoundaryBlock::default();
    for index in 0..part.boundary_blocks() {
        part.boundary_block(index, &mut block);
        if block.patch.is_some_and(|patch| patches.contains(&patch.0)) {
            let nodes = block.triangles.as_flattened().iter().chain(block.edge_nodes.as_flattened());
            nodes.for_each(|&vertex| is_on[vertex as usize] = true);
        }
    }
    is_on
}

fn raise(py: Python<'_>, error: impl Into<Error>) -> PyErr {
    Failure::from(error.into()).raise(py)
}

#[pymethods]
impl Mesh {
    /// The report of the command line, as JSON.
    fn report(&self) -> &str {
        &self.whole.report
    }

    /// Messages of the run.
    fn notes(&self) -> Vec<String> {
        self.notes.clone()
    }

    fn checksum(&self) -> &str {
        &self.whole.checksum
    }

    /// The number of parts of the whole mesh.
    fn count(&self) -> u32 {
        self.ranks.ranks()
    }

    /// The ranks of the parts of this process.
    fn own(&self) -> Vec<u32> {
        self.parts.iter().map(|made| made.stream().rank()).collect()
    }

    /// Vertices, tets and faces of the whole mesh; shared ones count once.
    fn totals(&self) -> (u64, u64, u64) {
        self.whole.totals
    }

    /// Vertices, tets and faces of one part.
    fn counts(&self, index: usize) -> PyResult<(u64, u64, u64)> {
        let counts = self.part(index)?.stream().counts();
        Ok((counts.vertices, counts.tets, counts.boundary))
    }

    /// Numbers and names of the bodies.
    fn body_labels(&self) -> Labels {
        labels(&self.names().bodies)
    }

    /// Numbers and names of the patches.
    fn patch_labels(&self) -> Labels {
        labels(&self.names().patches)
    }

    /// The indices of the patches with this name.
    fn patches_named(&self, py: Python<'_>, name: &str) -> PyResult<Vec<u32>> {
        let found = self.names().patches_named(name).map_err(|error| raise(py, error))?;
        Ok(found.iter().map(|patch| patch.0).collect())
    }

    /// The numbers of the bodies with this name.
    fn bodies_named(&self, py: Python<'_>, name: &str) -> PyResult<Vec<u32>> {
        let found = self.names().bodies_named(name).map_err(|error| raise(py, error))?;
        Ok(found.iter().map(|body| self.names().bodies[body.index()].number).collect())
    }

    /// The arrays of one part.
    fn arrays(&self, py: Python<'_>, index: usize) -> PyResult<PartArrays> {
        let made = self.part(index)?;
        check_count(made.stream().counts().vertices)?;
        PartArrays::new(py, py.detach(|| Arrays::of(made.stream())), &made.names)
    }

    /// The shared vertices of one part.
    fn sharing(&self, py: Python<'_>, index: usize) -> PyResult<PartSharing> {
        let made = self.part(index)?;
        let vertices = made.stream().counts().vertices;
        check_count(vertices)?;
        let sharing = py.detach(|| made.sharing());
        Ok(PartSharing::new(py, &sharing, made.stream().rank(), vertices as usize))
    }

    /// The ghosts of all parts.
    fn ghosts(&self, py: Python<'_>, halo: &str) -> PyResult<Vec<PartGhosts>> {
        let (ghosts, _) = self.on_ranks(py, None, |comm, made, _| made.ghosts(comm, by(halo)))?;
        ghosts.iter().map(|ghosts| PartGhosts::new(py, ghosts, self.names())).collect()
    }

    /// The refinement levels of one part, from the coarsest; `None` if it was not refined.
    fn levels(this: Bound<'_, Self>, index: usize) -> PyResult<Option<Vec<Level>>> {
        let (py, made) = (this.py(), this.get().part(index)?);
        let hierarchy = py.detach(|| made.hierarchy()).map_err(|error| raise(py, error))?;
        Ok(hierarchy.map(|hierarchy| Level::all(py, &this.unbind(), hierarchy)))
    }

    /// **Collective.** For each part of this process, its vertices on some patches, ascending: also
    /// those that have no face there in the part, but in others.
    fn vertices_on(&self, py: Python<'_>, patches: Vec<u32>) -> PyResult<Vec<Py<PyArray1<i32>>>> {
        let (found, _) = self.on_ranks(py, None, |comm, made, _| {
            let mut is_on = on_patches(made.stream(), &patches);
            made.sharing().any(comm, &mut is_on)?;
            Ok((0..).zip(is_on).filter_map(|(vertex, is_on)| is_on.then_some(vertex)).collect())
        })?;
        Ok(found.into_iter().map(|vertices: Vec<u32>| small(py, vertices)).collect())
    }

    /// The blocks of one part.
    fn blocks(this: Bound<'_, Self>, index: usize, size: usize) -> PyResult<Blocks> {
        this.get().part(index)?;
        Ok(Blocks::new(this.unbind(), index, size))
    }

    /// The shapes of the tets of this process, as JSON.
    fn quality(&self, py: Python<'_>) -> PyResult<String> {
        let (mut measured, _) = watched(py, None, &Arc::default(), |_| Ok(quality::measure(&self.joined())))?;
        // Shared ones once, if all parts are here.
        if self.ranks.processes().is_none() {
            let (vertices, _, boundary) = self.whole.totals;
            (measured.vertices, measured.boundary) = (vertices as usize, boundary as usize);
        }
        Ok(serde_json::to_string(&measured).expect("plain data"))
    }

    /// Checks all parts again; returns the number of faults and the texts of the first ones.
    fn check(&self, py: Python<'_>) -> PyResult<(u64, Vec<String>)> {
        let (reports, _) = self.on_ranks(py, None, |comm, made, _| {
            Ok(check::check(comm, made.stream(), None, &check::Settings::default())?)
        })?;
        let found = |report: &PartReport| {
            (report.faults, report.described.iter().map(ToString::to_string).collect::<Vec<_>>())
        };
        self.share(py, reports.first().map(found))
    }

    /// A picture as PNG.
    fn picture(&self, py: Python<'_>, view: View) -> PyResult<Vec<u8>> {
        let (images, _) = self.on_ranks(py, None, |comm, made, _| draw(comm, made.stream(), &view))?;
        let mut image = images.into_iter().flatten().next().unwrap_or_default();
        if let Some(processes) = self.ranks.processes() {
            let sent = py.detach(|| processes.broadcast_bytes(0, &mut image));
            sent.map_err(|error| raise(py, error))?;
        }
        Ok(image)
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
        let (files, bytes) = self.share(py, written.first().map(|written| (written.files, written.bytes)))?;
        Ok((files, bytes, notes))
    }
}
