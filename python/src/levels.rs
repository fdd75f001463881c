//! The refinement levels of a part, for multigrid.

use crate::arrays::{PartArrays, PartSharing, check_count, ids, indices};
use crate::mesh::Mesh;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use std::sync::Arc;
use tetmill::Hierarchy;
use tetmill::mesh::{Arrays, MeshStream, RefinedMesh, Sharing};

/// One level of a part.
#[pyclass(frozen, module = "tetmill._native")]
pub struct Level {
    mesh: Py<Mesh>,
    hierarchy: Arc<Hierarchy>,
    index: usize,
}

impl Level {
    /// All levels, from the coarsest.
    pub fn all(py: Python<'_>, mesh: &Py<Mesh>, hierarchy: Hierarchy) -> Vec<Self> {
        let hierarchy = Arc::new(hierarchy);
        let level = |index| Self { mesh: mesh.clone_ref(py), hierarchy: Arc::clone(&hierarchy), index };
        (0..hierarchy.levels.len()).map(level).collect()
    }

    fn refined(&self) -> &RefinedMesh {
        &self.hierarchy.levels[self.index]
    }
}

#[pymethods]
impl Level {
    /// Subdivisions of each coarse edge.
    fn pieces(&self) -> u32 {
        self.refined().pieces()
    }

    /// Vertices, tets and faces.
    fn counts(&self) -> (u64, u64, u64) {
        let counts = self.refined().counts();
        (counts.vertices, counts.tets, counts.boundary)
    }

    fn arrays(&self, py: Python<'_>) -> PyResult<PartArrays> {
        check_count(self.refined().counts().vertices)?;
        let arrays = py.detach(|| Arrays::of(self.refined()));
        PartArrays::new(py, arrays, self.mesh.get().names())
    }

    fn sharing(&self, py: Python<'_>) -> PyResult<PartSharing> {
        let level = self.refined();
        let vertices = level.counts().vertices;
        check_count(vertices)?;
        let sharing = py.detach(|| Sharing::of(level));
        Ok(PartSharing::new(py, &sharing, level.rank(), vertices as usize))
    }

    /// The two vertices of the level before between which each vertex is; `None` for the coarsest.
    fn vertex_parents(&self, py: Python<'_>) -> PyResult<Option<Py<PyArray2<i32>>>> {
        if self.index == 0 {
            return Ok(None);
        }
        check_count(self.refined().counts().vertices)?;
        let parents = py.detach(|| self.hierarchy.vertex_parents(self.index));
        indices(py, parents).map(Some)
    }

    /// The tet of the level before that each tet is in; `None` if the levels are not nested, and
    /// for the coarsest.
    fn tet_parents(&self, py: Python<'_>) -> Option<Py<PyArray1<i64>>> {
        if self.index == 0 {
            return None;
        }
        py.detach(|| self.hierarchy.tet_parents(self.index)).map(|parents| ids(py, parents))
    }
}
