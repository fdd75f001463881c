//! Parts of a mesh as numpy arrays that take over the memory of the library's vectors.

use crate::mesh::Mesh;
use bytemuck::allocation::cast_vec;
use numpy::{Element, IntoPyArray, PyArray1, PyArray2, PyArrayMethods};
use pyo3::exceptions::PyOverflowError;
use pyo3::prelude::*;
use tetmill::mesh::{Arrays, Label, Names, Sharing};

/// A read-only array of rows.
pub fn rows<T: Element, const N: usize>(py: Python<'_>, rows: Vec<[T; N]>) -> PyResult<Py<PyArray2<T>>> {
    let count = rows.len();
    let array = rows.into_flattened().into_pyarray(py).reshape([count, N])?;
    array.readwrite().make_nonwriteable();
    Ok(array.unbind())
}

/// A read-only array of numbers.
pub fn numbers<T: Element>(py: Python<'_>, numbers: Vec<T>) -> Py<PyArray1<T>> {
    let array = numbers.into_pyarray(py);
    array.readwrite().make_nonwriteable();
    array.unbind()
}

/// Indices as `int32`.
pub fn indices<const N: usize>(py: Python<'_>, indices: Vec<[u32; N]>) -> PyResult<Py<PyArray2<i32>>> {
    let count = indices.len();
    let array = cast_vec::<u32, i32>(indices.into_flattened()).into_pyarray(py).reshape([count, N])?;
    array.readwrite().make_nonwriteable();
    Ok(array.unbind())
}

/// Numbers below 2³¹ as `int32`.
pub fn small(py: Python<'_>, values: Vec<u32>) -> Py<PyArray1<i32>> {
    numbers(py, cast_vec(values))
}

/// Global ids as `int64`.
pub fn ids(py: Python<'_>, ids: Vec<u64>) -> Py<PyArray1<i64>> {
    numbers(py, cast_vec(ids))
}

/// Refuses more vertices than `int32` can number.
pub fn check_count(vertices: u64) -> PyResult<()> {
    if vertices <= i32::MAX as u64 {
        return Ok(());
    }
    Err(PyOverflowError::new_err(format!(
        "a part has {vertices} vertices, more than int32 can number: use more parts, or blocks()"
    )))
}

/// The arrays of one part.
#[pyclass(frozen, get_all, module = "tetmill._native")]
pub struct PartArrays {
    /// The degree of the elements.
    order: u32,
    points: Py<PyArray2<f64>>,
    vertex_ids: Py<PyArray1<i64>>,
    tets: Py<PyArray2<i32>>,
    /// The nodes on the edges of tets of second order: 01 02 03 12 13 23; otherwise no rows.
    tet_edge_nodes: Py<PyArray2<i32>>,
    tet_ids: Py<PyArray1<i64>>,
    /// Numbers of bodies.
    bodies: Py<PyArray1<i32>>,
    faces: Py<PyArray2<i32>>,
    /// The nodes on the edges of faces of second order: 01 12 20; otherwise no rows.
    face_edge_nodes: Py<PyArray2<i32>>,
    /// Boundary numbers.
    face_tags: Py<PyArray1<i32>>,
    /// Patches by index.
    face_patches: Py<PyArray1<i32>>,
    /// Numbers of the bodies behind and in front of each face, 0 for none.
    face_bodies: Py<PyArray2<i32>>,
}

impl PartArrays {
    /// Moves the vectors of a part into arrays.
    pub fn new(py: Python<'_>, arrays: Arrays, names: &Names) -> PyResult<Self> {
        let number = |labels: &[Label], index: usize| labels.get(index).map_or(0, |label| label.number);
        let body = |body: csg::BodyId| number(&names.bodies, body.index());
        let tags = arrays.triangle_patches.iter().map(|patch| number(&names.patches, patch.index()));
        let sides = arrays.triangle_bodies.into_iter().map(|sides| sides.map(|side| side.map_or(0, body)));
        Ok(Self {
            order: arrays.order.degree(),
            points: rows(py, arrays.points)?,
            vertex_ids: ids(py, arrays.vertex_ids),
            tets: indices(py, arrays.tets)?,
            tet_edge_nodes: indices(py, arrays.tet_edge_nodes)?,
            tet_ids: ids(py, arrays.tet_ids),
            face_tags: small(py, tags.collect()),
            face_bodies: indices(py, sides.collect())?,
            bodies: small(py, arrays.tet_bodies.into_iter().map(body).collect()),
            faces: indices(py, arrays.triangles)?,
            face_edge_nodes: indices(py, arrays.triangle_edge_nodes)?,
            face_patches: small(py, arrays.triangle_patches.into_iter().map(|patch| patch.0).collect()),
        })
    }
}

/// The addresses of a part's vectors of points and tets, and of the arrays made of them, for the
/// tests: they are the same.
#[pyfunction]
pub fn test_addresses(py: Python<'_>, mesh: &Mesh) -> PyResult<([usize; 2], [usize; 2])> {
    let made = mesh.made(0);
    let vectors = made.arrays();
    let given = [vectors.points.as_ptr() as usize, vectors.tets.as_ptr() as usize];
    let arrays = PartArrays::new(py, vectors, &made.names)?;
    let (points, tets) = (arrays.points.bind(py).data() as usize, arrays.tets.bind(py).data() as usize);
    Ok((given, [points, tets]))
}

/// The shared vertices of one part.
#[pyclass(frozen, get_all, module = "tetmill._native")]
pub struct PartSharing {
    /// The rank that owns each vertex of the part.
    owners: Py<PyArray1<i32>>,
    /// The shared vertices, ascending.
    vertices: Py<PyArray1<i32>>,
    /// Where the ranks of each shared vertex begin in `ranks`, and the end.
    offsets: Py<PyArray1<i64>>,
    ranks: Py<PyArray1<i32>>,
    /// The ranks that share vertices with this one, and these vertices in an order common to both.
    neighbours: Vec<(u32, Py<PyArray1<i32>>)>,
}

impl PartSharing {
    /// Lists the shared vertices of a part with `count` vertices.
    pub fn new(py: Python<'_>, sharing: &Sharing, rank: u32, count: usize) -> Self {
        let mut owners = vec![rank; count];
        let (mut offsets, mut ranks) = (vec![0], Vec::new());
        for &vertex in sharing.vertices() {
            owners[vertex as usize] = sharing.owner(vertex);
            ranks.extend_from_slice(sharing.holders(vertex));
            offsets.push(ranks.len() as u64);
        }
        let with =
            |neighbour: &tetmill::mesh::Neighbour| (neighbour.rank, small(py, neighbour.vertices.clone()));
        Self {
            owners: small(py, owners),
            vertices: small(py, sharing.vertices().to_vec()),
            offsets: ids(py, offsets),
            ranks: small(py, ranks),
            neighbours: sharing.neighbours().iter().map(with).collect(),
        }
    }
}
