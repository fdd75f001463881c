//! Ghosts: the tets of other parts beside a part.

use crate::arrays::{ids, indices, rows, small};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use tetmill::mesh::{Ghosts, Names};

/// The ghosts of one part.
#[pyclass(frozen, get_all, module = "tetmill._native")]
pub struct PartGhosts {
    /// The coordinates of the vertices that only ghost tets have.
    points: Py<PyArray2<f64>>,
    vertex_ids: Py<PyArray1<i64>>,
    /// Vertices by local index: those of the part, then those of `points`.
    tets: Py<PyArray2<i32>>,
    tet_ids: Py<PyArray1<i64>>,
    /// The rank of each ghost tet.
    owners: Py<PyArray1<i32>>,
    /// Numbers of bodies.
    bodies: Py<PyArray1<i32>>,
}

impl PartGhosts {
    /// Copies ghosts into arrays.
    pub fn new(py: Python<'_>, ghosts: &Ghosts, names: &Names) -> PyResult<Self> {
        let (vertices, tets) = (&ghosts.vertices, &ghosts.tets);
        let number = |body: csg::BodyId| names.bodies.get(body.index()).map_or(0, |label| label.number);
        Ok(Self {
            points: rows(py, vertices.iter().map(|vertex| vertex.point).collect())?,
            vertex_ids: ids(py, vertices.iter().map(|vertex| vertex.id).collect()),
            tets: indices(py, tets.iter().map(|tet| tet.vertices).collect())?,
            tet_ids: ids(py, tets.iter().map(|tet| tet.id).collect()),
            owners: small(py, tets.iter().map(|tet| tet.owner).collect()),
            bodies: small(py, tets.iter().map(|tet| number(tet.body)).collect()),
        })
    }
}
