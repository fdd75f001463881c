//! Moves tets between ranks to balance the work: tets near one corner take ten times as long as
//! others.
//!
//! ```sh
//! cargo run --release --example migration
//! ```

use tetmill::comm::thread;
use tetmill::repartition::{Method, MoveSettings, Neighbours, migrate_bare, repartition_weighted};
use tetmill::{Error, Geometry, Mesher};

fn main() -> Result<(), Error> {
    let block = Geometry::from_text("algebraic3d solid block = orthobrick (0, 0, 0; 1, 1, 1); tlo block;")?;
    let shares = thread::try_run(4, |comm| -> Result<_, Error> {
        let mesh = Mesher::new().max_size(0.2).levels(1).generate_on(comm, Some(&block))?;
        let mesh = mesh.stored(comm)?;
        let work = |&[x, y, z]: &[f64; 3]| if x * x + y * y + z * z < 0.36 { 10 } else { 1 };
        let weights: Vec<u32> = mesh.tets.iter().map(|tet| work(&mesh.points[tet[0].index()])).collect();
        let before: u64 = weights.iter().map(|&w| u64::from(w)).sum();

        let neighbours = Neighbours::find(comm, &mesh)?;
        let to = repartition_weighted(comm, &mesh, &neighbours, &weights, comm.size(), Method::default())?;
        let (mesh, _) = migrate_bare(comm, mesh, &to, &MoveSettings::default())?;
        let after = mesh.tets.iter().map(|tet| u64::from(work(&mesh.points[tet[0].index()]))).sum::<u64>();
        Ok((before, after, mesh.tets.len()))
    })?;
    let mean = shares.iter().map(|share| share.1).sum::<u64>() as f64 / shares.len() as f64;
    for (rank, (before, after, tets)) in shares.iter().enumerate() {
        println!("rank {rank}: work {before} before, {after} after, in {tets} tets");
        assert!((*after as f64) < 1.1 * mean, "the work is shared unevenly");
    }
    Ok(())
}
