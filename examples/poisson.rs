//! Poisson's equation on a ball, with linear elements, assembled and solved by conjugate gradients across 4 ranks.
//!
//! ```sh
//! cargo run --release --example poisson
//! ```
//!
//! The exact solution is known; the error falls by four from level to level, as the square of the element size. Each rank assembles its own
//! tets. What several ranks contribute to a shared vertex is added by [`Sharing::sum`], and each vertex counts in scalar products once, on the
//! rank that owns it.

mod common;

use common::{assemble, gradients, inner, on_boundary};
use tetmill::comm::{CommError, Communicator, thread};
use tetmill::mesh::{Arrays, Sharing};
use tetmill::{Error, Geometry, Mesher};

const RANKS: u32 = 4;
const LEVELS: u32 = 4;

fn exact([x, y, z]: [f64; 3]) -> f64 {
    (2.0 * x).sin() * y.cos() + z * z
}

/// Minus the Laplacian of the exact solution.
fn source([x, y, _]: [f64; 3]) -> f64 {
    5.0 * (2.0 * x).sin() * y.cos() - 2.0
}

fn main() -> Result<(), Error> {
    let ball = Geometry::from_text("algebraic3d solid ball = sphere (0, 0, 0; 1); tlo ball;")?;
    println!("level      tets  iterations  error in the mean square  ratio");
    let mut before = None;
    for level in 0..LEVELS {
        let solved = thread::try_run(RANKS, |comm| -> Result<_, Error> {
            let mesh = Mesher::new().max_size(0.5).levels(level).generate_on(comm, Some(&ball))?;
            let (arrays, sharing) = (mesh.arrays(), mesh.sharing());
            let (solution, iterations) = solve(comm, &arrays, &sharing)?;
            Ok((mesh.check.tets, iterations, error_of(comm, &arrays, &solution)?))
        })?;
        let (tets, iterations, error) = solved.into_iter().next().expect("there is a rank 0");
        let ratio = before.map_or(String::new(), |before: f64| format!("{:.2}", before / error));
        println!("{level:>5}  {tets:>8}  {iterations:>10}  {error:>24.3e}  {ratio:>5}");
        assert!(
            before.is_none_or(|before: f64| before / error > 3.0),
            "the error does not fall as the square"
        );
        before = Some(error);
    }
    Ok(())
}

/// **Collective.** Solves with the exact solution prescribed on the boundary. Returns the values at this rank's vertices and the iterations.
fn solve(comm: &dyn Communicator, mesh: &Arrays, sharing: &Sharing) -> Result<(Vec<f64>, usize), CommError> {
    let (matrix, mut load) = assemble(mesh, source);
    sharing.sum(comm, &mut load)?;
    let mut diagonal = matrix.diagonal();
    sharing.sum(comm, &mut diagonal)?;
    let fixed = on_boundary(comm, mesh, sharing)?;
    // The product with the matrix of the whole mesh, zero where the solution is prescribed.
    let product = |x: &[f64]| -> Result<Vec<f64>, CommError> {
        let mut y = matrix.times(x);
        sharing.sum(comm, &mut y)?;
        y.iter_mut().zip(&fixed).filter(|(_, fixed)| **fixed).for_each(|(y, _)| *y = 0.0);
        Ok(y)
    };

    let mut x: Vec<f64> = mesh
        .points
        .iter()
        .zip(&fixed)
        .map(|(&point, fixed)| if *fixed { exact(point) } else { 0.0 })
        .collect();
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

/// **Collective.** The root of the integral of the squared error, with the middle of each edge's third as a rule of second order.
fn error_of(comm: &dyn Communicator, mesh: &Arrays, solution: &[f64]) -> Result<f64, CommError> {
    // Four points inside, exact for quadratic polynomials (Keast 1986).
    const NEAR: f64 = 0.585_410_196_624_968_5;
    const FAR: f64 = 0.138_196_601_125_010_5;
    let mut sum = 0.0;
    for (index, vertices) in mesh.tets.iter().enumerate() {
        let corners = mesh.corners(index);
        let (_, volume) = gradients(corners);
        for k in 0..4 {
            let weight = |i: usize| if i == k { NEAR } else { FAR };
            let point = [0, 1, 2].map(|axis| (0..4).map(|i| weight(i) * corners[i][axis]).sum());
            let value: f64 = (0..4).map(|i| weight(i) * solution[vertices[i] as usize]).sum();
            sum += volume / 4.0 * (value - exact(point)).powi(2);
        }
    }
    Ok(comm.all_reduce_sum_f64([sum])?[0].sqrt())
}
