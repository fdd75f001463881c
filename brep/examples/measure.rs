//! Prints the volumes and areas of the tessellated parts of BREP and STEP files, whose solids are
//! imprinted on each other. After `--overlap-to-first` solids that overlap are cut.

use brep::{Model, OverlapTo, Settings, Tessellation, Unit, tessellate};

fn main() {
    let mut cuts = false;
    for path in std::env::args().skip(1) {
        if path == "--overlap-to-first" {
            cuts = true;
            continue;
        }
        let text = std::fs::read(&path).expect("a file that can be read");
        let start = std::time::Instant::now();
        let is_step = path.ends_with(".step") || path.ends_with(".stp");
        let read = if is_step { Model::read_step(&text, Unit::OfFile) } else { Model::read(&text) };
        let made = read.and_then(|mut model| {
            if cuts {
                model.cut_overlaps(OverlapTo::First)?;
            }
            model.imprint();
            let tessellation = Tessellation::of(&mut model, &Settings::default())?;
            Ok((model, tessellation))
        });
        match made {
            Err(error) => println!("{path}: {error}"),
            Ok((model, tessellation)) => {
                let volumes: Vec<f64> =
                    (0..model.bodies).map(|b| tessellate::volume(&model, &tessellation, b)).collect();
                let areas: Vec<f64> =
                    (0..model.patches.len()).map(|p| tessellate::area(&tessellation, p)).collect();
                let is_shared = |p: &usize| !model.patches[*p].bodies.contains(&None);
                let interface: f64 = (0..areas.len()).filter(is_shared).map(|p| areas[p]).sum();
                println!(
                    "{path}: {} patches {} triangles {:.2} s gap {:.1e} volumes {volumes:?} interface {interface} areas {areas:?}",
                    model.patches.len(),
                    tessellation.triangles.len(),
                    start.elapsed().as_secs_f64(),
                    tessellation.gap
                );
                model.notes.iter().for_each(|note| println!("  {note}"));
            }
        }
    }
}
