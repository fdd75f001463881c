//! Meshes in blocks, for those that do not fit the memory as arrays.

use crate::arrays::{ids, indices, rows, small};
use crate::mesh::Mesh;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};
use tetmill::mesh::LocalBlock;

/// A block of tets as a small mesh of its own.
#[pyclass(frozen, get_all, module = "tetmill._native")]
pub struct Block {
    points: Py<PyArray2<f64>>,
    /// The number of each point in the part.
    vertices: Py<PyArray1<i32>>,
    /// By positions in `points`.
    tets: Py<PyArray2<i32>>,
    tet_ids: Py<PyArray1<i64>>,
    /// Numbers of bodies.
    bodies: Py<PyArray1<i32>>,
}

/// The blocks of a part, as an iterator.
#[pyclass(frozen, module = "tetmill._native")]
pub struct Blocks {
    mesh: Py<Mesh>,
    /// The part by its index in the process.
    part: usize,
    /// Tets at which a block ends.
    size: usize,
    /// The next block of the library.
    next: AtomicUsize,
}

/// A block that is being filled.
#[derive(Default)]
struct Filled {
    points: Vec<[f64; 3]>,
    vertices: Vec<u32>,
    tets: Vec<[u32; 4]>,
    ids: Vec<u64>,
    bodies: Vec<u32>,
}

impl Blocks {
    /// The blocks of a part, from the first one.
    pub fn new(mesh: Py<Mesh>, part: usize, size: usize) -> Self {
        Self { mesh, part, size, next: AtomicUsize::new(0) }
    }

    /// Collects blocks of the library until there are enough tets.
    fn fill(&self) -> Filled {
        let made = self.mesh.get().made(self.part);
        let stream = made.stream();
        let (mut filled, mut block, mut points) = (Filled::default(), LocalBlock::default(), Vec::new());
        while filled.tets.len() < self.size {
            let index = self.next.fetch_add(1, Ordering::Relaxed);
            if index >= stream.tet_blocks() {
                break;
            }
            stream.local_block(index, &mut block);
            stream.block_points(&block, &mut points);
            let first = filled.points.len() as u32;
            filled.points.extend_from_slice(&points);
            filled.vertices.extend_from_slice(&block.vertices);
            let tets = &block.tets;
            filled.tets.extend(tets.tets.iter().map(|tet| tet.map(|vertex| first + vertex)));
            filled.ids.extend(tets.first_id..tets.first_id + tets.tets.len() as u64);
            let number = tets.body.and_then(|body| made.names.bodies.get(body.index()));
            filled.bodies.resize(filled.tets.len(), number.map_or(0, |label| label.number));
        }
        filled
    }
}

#[pymethods]
impl Blocks {
    fn __iter__(this: PyRef<'_, Self>) -> PyRef<'_, Self> {
        this
    }

    fn __next__(&self, py: Python<'_>) -> PyResult<Option<Block>> {
        let filled = py.detach(|| self.fill());
        if filled.tets.is_empty() {
            return Ok(None);
        }
        Ok(Some(Block {
            points: rows(py, filled.points)?,
            vertices: small(py, filled.vertices),
            tets: indices(py, filled.tets)?,
            tet_ids: ids(py, filled.ids),
            bodies: small(py, filled.bodies),
        }))
    }
}
