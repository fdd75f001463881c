use tetmill::pipeline::{Model, coarse};
use tetmill::size::{Preset, SizeSettings};
fn main() {
    for f in std::env::args().skip(1) {
        let t = std::time::Instant::now();
        let source = std::fs::read_to_string(&f).unwrap();
        let name = std::path::Path::new(&f).file_stem().unwrap().to_string_lossy().to_string();
        let parsed = match csg::language::parse_geometry(&source, &f) {
            Ok(p) => p,
            Err(e) => {
                println!("{name:18} PARSE {}", e.to_string().lines().next().unwrap());
                continue;
            }
        };
        let model = match Model::new(parsed.geometry) {
            Ok(m) => m,
            Err(e) => {
                println!("{name:18} FEATURES {e}");
                continue;
            }
        };
        let tf = t.elapsed().as_secs_f64();
        let preset: Preset = std::env::var("PRESET").unwrap_or("moderate".into()).parse().unwrap();
        let mut s = SizeSettings::from(preset);
        if let Ok(h) = std::env::var("MAXH") {
            s.maxh = Some(h.parse().unwrap());
        }
        let r = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| coarse::mesh(&model, &mut s)));
        match r {
            Ok(Ok(c)) => {
                let q = &c.report.quality;
                println!(
                    "{name:18} {}c {}k {}p feat {tf:.2}s total {:.2}s tets {} tri {} seg {} steiner {} corr {} illegal {}/{} {q:?}",
                    model.features.corners.len(),
                    model.features.curves.len(),
                    model.features.patches.len(),
                    t.elapsed().as_secs_f64(),
                    c.report.tets,
                    c.report.boundary,
                    c.report.segments,
                    c.report.steiner_points,
                    c.report.size_corrections,
                    c.report.illegal_left,
                    c.report.illegal_repaired
                )
            }
            Ok(Err(e)) => println!("{name:18} ERR {:.2}s {e}", t.elapsed().as_secs_f64()),
            Err(_) => println!("{name:18} PANIC"),
        }
    }
}
