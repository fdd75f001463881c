//! Surface meshing: seconds of each stage, triangles per second, angles.
//!
//! ```sh
//! cargo bench --bench surface                          # own geometries and NETGEN's tutorials, preset moderate, one thread
//! cargo bench --bench surface -- shaft torus           # only names that contain one of the words
//! cargo bench --bench surface -- shaft maxh=0.5        # with a bound on the size
//! ```
//!
//! The tutorials are in `$TETMILL_SHARED/netgen-tutorials`, or in `../shared` beside the
//! repository.

use std::path::{Path, PathBuf};
use std::time::Instant;
use tetmill::internals::surface::curves::mesh_curves;
use tetmill::internals::{CsgModel, GeometricSize, surface};
use tetmill::size::SizeSettings;

fn main() {
    let words: Vec<String> = std::env::args().skip(1).filter(|w| w != "--bench").collect();
    let maxh = words.iter().find_map(|w| w.strip_prefix("maxh=")).map(|h| h.parse().expect("a length"));
    let names: Vec<&String> = words.iter().filter(|w| !w.contains('=')).collect();
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().expect("no pool yet");
    println!(
        "{:22} {:>7} {:>9} {:>9} {:>9} {:>9} {:>9}  min angle  worst ratio",
        "geometry", "patches", "triangles", "read s", "sizes s", "mesh s", "/s"
    );
    for file in files() {
        let name = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        if names.is_empty() || names.iter().any(|word| name.contains(word.as_str())) {
            match row(&file, maxh) {
                Ok(row) => println!("{name:22} {row}"),
                Err(reason) => println!("{name:22} {reason}"),
            }
        }
    }
}

fn files() -> Vec<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared");
    let shared = std::env::var_os("TETMILL_SHARED").map_or(beside, PathBuf::from);
    let mut files = Vec::new();
    for folder in [Path::new(env!("CARGO_MANIFEST_DIR")).join("geometries"), shared.join("netgen-tutorials")]
    {
        let Ok(entries) = std::fs::read_dir(&folder) else {
            println!("skipped: there is no {}", folder.display());
            continue;
        };
        let paths = entries.filter_map(|entry| Some(entry.ok()?.path()));
        let mut found: Vec<PathBuf> = paths.filter(|p| p.extension().is_some_and(|e| e == "geo")).collect();
        found.sort();
        files.extend(found);
    }
    files
}

/// Meshes the surface of one geometry, without the size corrections of the volume mesher.
fn row(file: &Path, maxh: Option<f64>) -> Result<String, String> {
    let seconds = |began: Instant| began.elapsed().as_secs_f64();
    let text = std::fs::read_to_string(file).map_err(|e| e.to_string())?;
    let began = Instant::now();
    let parsed = csg::language::parse_geometry(&text, "").map_err(|_| "not read".to_owned())?;
    let model = CsgModel::new(parsed.geometry).map_err(|e| e.to_string())?;
    let read = seconds(began);
    let settings = SizeSettings { maxh, ..SizeSettings::default() };
    let began = Instant::now();
    let size = GeometricSize::new(&model.geometry, &model.features, &settings);
    let sizes = seconds(began);
    let began = Instant::now();
    let curves = mesh_curves(&model.features, &model.projector, &size).map_err(|e| e.to_string())?;
    let (mesh, report) =
        surface::mesh_patches(&model.geometry, &model.features, curves, &size, &surface::Settings::default())
            .map_err(|e| e.to_string())?;
    let meshed = seconds(began);
    let (count, patches) = (mesh.triangles.len(), model.features.patches.len());
    let rate = count as f64 / meshed;
    let (angle, ratio) = (report.min_angle(), report.worst_quality());
    Ok(format!(
        "{patches:>7} {count:>9} {read:>9.3} {sizes:>9.3} {meshed:>9.3} {rate:>9.0}  {angle:>9.1}  {ratio:>11.3}"
    ))
}
