//! Linear elements for Poisson's equation, and conjugate gradients across ranks: what the examples
//! share.
#![allow(dead_code)]

use tetmill::comm::{CommError, Communicator};
use tetmill::mesh::{Arrays, Sharing};

/// A square matrix by rows of compressed entries.
pub struct Matrix {
    starts: Vec<usize>,
    columns: Vec<u32>,
    values: Vec<f64>,
}

impl Matrix {
    /// Adds up entries at (row, column).
    pub fn of_entries(rows: usize, mut entries: Vec<(u32, u32, f64)>) -> Self {
        entries.sort_unstable_by_key(|&(row, column, _)| (row, column));
        let mut matrix = Self { starts: vec![0; rows + 1], columns: Vec::new(), values: Vec::new() };
        for of_place in entries.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            matrix.starts[of_place[0].0 as usize + 1] += 1;
            matrix.columns.push(of_place[0].1);
            matrix.values.push(of_place.iter().map(|entry| entry.2).sum());
        }
        for row in 0..rows {
            matrix.starts[row + 1] += matrix.starts[row];
        }
        matrix
    }

    fn row(&self, row: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let range = self.starts[row]..self.starts[row + 1];
        range.map(|k| (self.columns[k] as usize, self.values[k]))
    }

    /// The product with a vector.
    pub fn times(&self, x: &[f64]) -> Vec<f64> {
        (0..x.len()).map(|row| self.row(row).map(|(column, value)| value * x[column]).sum()).collect()
    }

    /// The diagonal.
    pub fn diagonal(&self) -> Vec<f64> {
        let entry =
            |row: usize| self.row(row).find(|(column, _)| *column == row).map_or(0.0, |(_, value)| value);
        (0..self.starts.len() - 1).map(entry).collect()
    }
}

/// The gradients of the four linear shape functions of a tet, and its volume.
pub fn gradients([a, b, c, d]: [[f64; 3]; 4]) -> ([[f64; 3]; 4], f64) {
    let minus = |p: [f64; 3], q: [f64; 3]| [p[0] - q[0], p[1] - q[1], p[2] - q[2]];
    let cross = |u: [f64; 3], v: [f64; 3]| {
        [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
    };
    let [u, v, w] = [minus(b, a), minus(c, a), minus(d, a)];
    let six_volumes = dot(cross(u, v), w);
    let of = |p: [f64; 3], q: [f64; 3]| cross(p, q).map(|x| x / six_volumes);
    let [gb, gc, gd] = [of(v, w), of(w, u), of(u, v)];
    let ga = [0, 1, 2].map(|k| -gb[k] - gc[k] - gd[k]);
    ([ga, gb, gc, gd], six_volumes / 6.0)
}

/// The scalar product of two vectors of space.
pub fn dot(u: [f64; 3], v: [f64; 3]) -> f64 {
    u[0] * v[0] + u[1] * v[1] + u[2] * v[2]
}

/// This rank's contributions to the stiffness matrix of the Laplacian and to the load of a source.
pub fn assemble(mesh: &Arrays, source: impl Fn([f64; 3]) -> f64) -> (Matrix, Vec<f64>) {
    assemble_with(mesh, |_| 1.0, source)
}

/// Like [`assemble`], with a coefficient for each tet.
pub fn assemble_with(
    mesh: &Arrays,
    coefficient: impl Fn(usize) -> f64,
    source: impl Fn([f64; 3]) -> f64,
) -> (Matrix, Vec<f64>) {
    let mut entries = Vec::with_capacity(16 * mesh.tets.len());
    let mut load = vec![0.0; mesh.points.len()];
    for (index, vertices) in mesh.tets.iter().enumerate() {
        let corners = mesh.corners(index);
        let (gradients, volume) = gradients(corners);
        for (i, &row) in vertices.iter().enumerate() {
            for (j, &column) in vertices.iter().enumerate() {
                let value = coefficient(index) * volume * dot(gradients[i], gradients[j]);
                entries.push((row, column, value));
            }
            // The integral of the source's interpolant with the shape function of this corner.
            let values = corners.map(&source);
            load[row as usize] += volume * (values.iter().sum::<f64>() + values[i]) / 20.0;
        }
    }
    (Matrix::of_entries(mesh.points.len(), entries), load)
}

/// **Collective.** The vertices on the outer boundary.
///
/// A rank may have such a vertex without a boundary triangle at it.
pub fn on_boundary(
    comm: &dyn Communicator,
    mesh: &Arrays,
    sharing: &Sharing,
) -> Result<Vec<bool>, CommError> {
    let mut is_on = vec![false; mesh.points.len()];
    for (triangle, bodies) in mesh.triangles.iter().zip(&mesh.triangle_bodies) {
        if bodies.iter().any(Option::is_none) {
            triangle.iter().for_each(|&vertex| is_on[vertex as usize] = true);
        }
    }
    sharing.any(comm, &mut is_on)?;
    Ok(is_on)
}

/// **Collective.** The scalar product over all vertices of the mesh, each counted by its owner.
pub fn inner(comm: &dyn Communicator, sharing: &Sharing, x: &[f64], y: &[f64]) -> Result<f64, CommError> {
    let not_owned: f64 = sharing
        .vertices()
        .iter()
        .filter(|&&vertex| !sharing.is_owned(vertex))
        .map(|&vertex| x[vertex as usize] * y[vertex as usize])
        .sum();
    let all: f64 = x.iter().zip(y).map(|(a, b)| a * b).sum();
    Ok(comm.all_reduce_sum_f64([all - not_owned])?[0])
}

/// **Collective.** Solves a system by conjugate gradients with the diagonal as preconditioner, from
/// a start that has the prescribed values of the `fixed` vertices. The load is summed over the
/// ranks, the matrix is not. Returns the values at this rank's vertices and the number of
/// iterations.
pub fn conjugate_gradients(
    comm: &dyn Communicator,
    sharing: &Sharing,
    matrix: &Matrix,
    load: &[f64],
    fixed: &[bool],
    start: Vec<f64>,
) -> Result<(Vec<f64>, usize), CommError> {
    let mut diagonal = matrix.diagonal();
    sharing.sum(comm, &mut diagonal)?;
    // The product with the matrix of the whole mesh, zero where the solution is prescribed.
    let product = |x: &[f64]| -> Result<Vec<f64>, CommError> {
        let mut y = matrix.times(x);
        sharing.sum(comm, &mut y)?;
        y.iter_mut().zip(fixed).filter(|(_, fixed)| **fixed).for_each(|(y, _)| *y = 0.0);
        Ok(y)
    };

    let mut x = start;
    let ax = product(&x)?;
    let mut r: Vec<f64> = (0..x.len()).map(|v| if fixed[v] { 0.0 } else { load[v] - ax[v] }).collect();
    let precondition = |r: &[f64]| -> Vec<f64> { r.iter().zip(&diagonal).map(|(r, d)| r / d).collect() };
    let mut p = precondition(&r);
    let mut rz = inner(comm, sharing, &r, &p)?;
    let enough = 1e-20 * rz;
    let mut iterations = 0;
    while rz > enough {
        let ap = product(&p)?;
        let step = rz / inner(comm, sharing, &p, &ap)?;
        for v in 0..x.len() {
            x[v] += step * p[v];
            r[v] -= step * ap[v];
        }
        let z = precondition(&r);
        let next = inner(comm, sharing, &r, &z)?;
        p.iter_mut().zip(z).for_each(|(p, z)| *p = z + next / rz * *p);
        rz = next;
        iterations += 1;
    }
    Ok((x, iterations))
}
