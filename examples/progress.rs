//! Shows how far a run is, and cancels it when it takes too long.
//!
//! ```sh
//! cargo run --release --example progress
//! ```

use std::sync::atomic::{AtomicBool, Ordering};
use tetmill::progress::{Observer, Stage};
use tetmill::{Error, Geometry, Mesher};

/// Prints every quarter of each stage, and cancels the run in the middle of a given stage, if any.
struct Printer {
    cancel_in: Option<Stage>,
    cancelled: AtomicBool,
}

impl Observer for Printer {
    fn begin(&self, stage: Stage) {
        println!("{stage} ...");
    }

    fn advance(&self, stage: Stage, fraction: f64) {
        if ((fraction * 1000.0).round() as u64).is_multiple_of(250) {
            println!("{stage}: {:.0} %", 100.0 * fraction);
        }
        if self.cancel_in == Some(stage) && fraction > 0.3 {
            self.cancelled.store(true, Ordering::Relaxed);
        }
    }

    fn end(&self, stage: Stage, seconds: f64) {
        println!("{stage} took {seconds:.2} s");
    }

    fn note(&self, text: &str) {
        println!("{text}");
    }

    fn is_cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }
}

fn main() -> Result<(), Error> {
    let ball = Geometry::from_text("algebraic3d solid ball = sphere (0, 0, 0; 1); tlo ball;")?;
    let mesher = Mesher::new().levels(3);
    for cancel_in in [None, Some(Stage::Mesh), Some(Stage::Refine)] {
        let printer = Printer { cancel_in, cancelled: AtomicBool::new(false) };
        match mesher.clone().observer(&printer).generate(&ball) {
            Ok(mesh) if cancel_in.is_none() => println!("{} tets\n", mesh.check.tets),
            Err(Error::Cancelled(_)) if cancel_in.is_some() => println!("cancelled\n"),
            other => panic!("not what was asked for: {:?}", other.map(|mesh| mesh.check.tets)),
        }
    }
    Ok(())
}
