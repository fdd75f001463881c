//! Poisson's equation on a ball with linear elements, solved by conjugate gradients across 4 ranks.
//!
//! ```sh
//! cargo run --release --example poisson
//! ```
//!
//! The exact solution is known: the error decreases as the square of the element size, by four from
//! level to level. Each rank assembles its own tets. [`Sharing::sum`] adds the contributions of
//! several ranks to a shared vertex. In scalar products each vertex is counted once, by its owner.

mod common;

use common::{assemble, conjugate_gradients, gradients, on_boundary};
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

/// **Collective.** Solves with the exact solution prescribed on the boundary.
///
/// Returns the values at the vertices of this rank and the number of iterations.
fn solve(comm: &dyn Communicator, mesh: &Arrays, sharing: &Sharing) -> Result<(Vec<f64>, usize), CommError> {
    let (matrix, mut load) = assemble(mesh, source);
    sharing.sum(comm, &mut load)?;
    let fixed = on_boundary(comm, mesh, sharing)?;
    let prescribed = |vertex: usize| if fixed[vertex] { exact(mesh.points[vertex]) } else { 0.0 };
    let start = (0..mesh.points.len()).map(prescribed).collect();
    conjugate_gradients(comm, sharing, &matrix, &load, &fixed, start)
}

/// **Collective.** The L² norm of the error, by a quadrature rule of second order.
fn error_of(comm: &dyn Communicator, mesh: &Arrays, solution: &[f64]) -> Result<f64, CommError> {
    // Four points in each tet, exact for quadratic polynomials (Keast 1986).
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
