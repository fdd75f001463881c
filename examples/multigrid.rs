//! A V-cycle on the levels of a refinement, all of them on the geometry, across 4 ranks.
//!
//! ```sh
//! cargo run --release --example multigrid
//! ```
//!
//! Each vertex of a level has two parents on the coarser level, so interpolation of linear elements
//! is the mean of two values and needs no messages. The number of cycles does not grow with the
//! level.

mod common;

use common::{Matrix, assemble, inner, on_boundary};
use tetmill::comm::{CommError, Communicator, thread};
use tetmill::mesh::{Arrays, Sharing};
use tetmill::{Error, Geometry, Mesher};

const RANKS: u32 = 4;
const SMOOTHINGS: usize = 3;

/// One level on one rank.
struct Level {
    matrix: Matrix,
    diagonal: Vec<f64>,
    fixed: Vec<bool>,
    sharing: Sharing,
    /// The parents of the vertices on the level before; none on the coarsest.
    parents: Vec<[u32; 2]>,
}

fn main() -> Result<(), Error> {
    let part = Geometry::from_text(
        "algebraic3d solid part = sphere (0, 0, 0; 1) and not cylinder (0, 0, -2; 0, 0, 2; 0.4); tlo part;",
    )?;
    println!("level  vertices  cycles");
    for finest in 1..=3 {
        let solved = thread::try_run(RANKS, |comm| -> Result<_, Error> {
            let mesh = Mesher::new().max_size(0.5).levels(finest).generate_on(comm, Some(&part))?;
            let vertices = mesh.stream().totals().vertices;
            let hierarchy = mesh.hierarchy()?.expect("the method `refine` has levels");
            let mut levels = Vec::new();
            let mut load = Vec::new();
            for (k, level) in hierarchy.levels.iter().enumerate() {
                let (arrays, sharing) = (Arrays::of(&**level), Sharing::of(&**level));
                let (matrix, of_level) = assemble(&arrays, |_| 1.0);
                let mut diagonal = matrix.diagonal();
                sharing.sum(comm, &mut diagonal)?;
                let fixed = on_boundary(comm, &arrays, &sharing)?;
                let parents = if k == 0 { Vec::new() } else { hierarchy.vertex_parents(k) };
                load = of_level;
                levels.push(Level { matrix, diagonal, fixed, sharing, parents });
            }
            Ok((vertices, solve(comm, &levels, load)?))
        })?;
        let (vertices, cycles) = solved.into_iter().next().expect("there is a rank 0");
        println!("{finest:>5}  {vertices:>8}  {cycles:>6}");
        assert!(cycles < 25, "the cycles grow with the level");
    }
    Ok(())
}

/// **Collective.** Cycles until the residual is a billionth of the first one.
fn solve(comm: &dyn Communicator, levels: &[Level], mut load: Vec<f64>) -> Result<usize, CommError> {
    let finest = levels.last().expect("there is a level");
    finest.sharing.sum(comm, &mut load)?;
    finest.free(&mut load);
    let norm = |r: &[f64]| inner(comm, &finest.sharing, r, r);
    let enough = 1e-18 * norm(&load)?;
    let mut x = vec![0.0; load.len()];
    for cycle in 1.. {
        let r = finest.residual(comm, &load, &x)?;
        let correction = cycle_on(comm, levels, r)?;
        x.iter_mut().zip(correction).for_each(|(x, c)| *x += c);
        if norm(&finest.residual(comm, &load, &x)?)? < enough || cycle == 100 {
            return Ok(cycle);
        }
    }
    unreachable!("the loop ends")
}

/// **Collective.** The correction by one V-cycle; all copies of a vertex must have the same
/// residual.
fn cycle_on(comm: &dyn Communicator, levels: &[Level], residual: Vec<f64>) -> Result<Vec<f64>, CommError> {
    let (level, coarser) = levels.split_last().expect("there is a level");
    let mut x = vec![0.0; residual.len()];
    if coarser.is_empty() {
        // The coarsest level is small: smoothing alone solves it well enough.
        level.smooth(comm, &residual, &mut x, 200)?;
        return Ok(x);
    }
    level.smooth(comm, &residual, &mut x, SMOOTHINGS)?;
    let r = level.residual(comm, &residual, &x)?;
    let below = coarser.last().expect("there is a coarser level");
    let mut restricted = vec![0.0; below.fixed.len()];
    for (vertex, &[p, q]) in level.parents.iter().enumerate() {
        // The owner alone hands down what all holders have.
        if level.sharing.is_owned(vertex as u32) {
            restricted[p as usize] += 0.5 * r[vertex];
            restricted[q as usize] += 0.5 * r[vertex];
        }
    }
    below.sharing.sum(comm, &mut restricted)?;
    below.free(&mut restricted);
    let correction = cycle_on(comm, coarser, restricted)?;
    for (x, &[p, q]) in x.iter_mut().zip(&level.parents) {
        *x += 0.5 * (correction[p as usize] + correction[q as usize]);
    }
    level.free(&mut x);
    level.smooth(comm, &residual, &mut x, SMOOTHINGS)?;
    Ok(x)
}

impl Level {
    /// Sets values to zero where the solution is prescribed.
    fn free(&self, values: &mut [f64]) {
        values.iter_mut().zip(&self.fixed).filter(|(_, fixed)| **fixed).for_each(|(value, _)| *value = 0.0);
    }

    /// **Collective.** What is left of a load.
    fn residual(&self, comm: &dyn Communicator, load: &[f64], x: &[f64]) -> Result<Vec<f64>, CommError> {
        let mut ax = self.matrix.times(x);
        self.sharing.sum(comm, &mut ax)?;
        let mut r: Vec<f64> = load.iter().zip(ax).map(|(load, ax)| load - ax).collect();
        self.free(&mut r);
        Ok(r)
    }

    /// **Collective.** Damped Jacobi steps.
    fn smooth(
        &self,
        comm: &dyn Communicator,
        load: &[f64],
        x: &mut [f64],
        steps: usize,
    ) -> Result<(), CommError> {
        for _ in 0..steps {
            let r = self.residual(comm, load, x)?;
            for (v, x) in x.iter_mut().enumerate() {
                *x += 0.6 * r[v] / self.diagonal[v];
            }
        }
        Ok(())
    }
}
