//! Surfaces of geometries, of parts, and with needle triangles: all are filled, and kept exactly.

use crate::folders::own;
use crate::samples::{Soup, check_fills, graded_ball, needle_cone, needle_tube, skin_of};
use csg::BodyId;
use csg::language::parse_geometry;
use std::time::Instant;
use tetmill::Point;
use tetmill::internals::distribution::from_serial;
use tetmill::internals::partition::partition;
use tetmill::internals::refine::refine;
use tetmill::internals::volume::{ClosedSurface, Settings};
use tetmill::internals::{Budget, Model};
use tetmill::internals::{UniformSize, partition as parts, refine, volume};
use tetmill::mesh::{Mesh, MeshStream, TetBlock};
use tetmill::progress::Work;
use tetmill::size::{Preset, SizeSettings};

fn model(name: &str) -> Model {
    let path = own(name);
    let source = std::fs::read_to_string(&path).unwrap();
    Model::from_csg(parse_geometry(&source, &path.to_string_lossy()).unwrap().geometry).unwrap()
}

fn coarse(model: &Model, preset: Preset) -> Mesh {
    model
        .coarse_mesh(&mut SizeSettings::from(preset).into(), &Budget::default(), Work::unwatched())
        .unwrap()
        .mesh
}

/// Meshes a surface with sizes from its triangles and checks the result.
///
/// Returns a row of a table: triangles, Steiner points, tets, seconds.
fn filled(what: &str, surface: &ClosedSurface) -> String {
    let start = Instant::now();
    let (mesh, report) = volume::mesh(surface, &UniformSize(f64::INFINITY), &Settings::default())
        .unwrap_or_else(|error| panic!("{what}: {error}"));
    let seconds = start.elapsed().as_secs_f64();
    check_fills(surface, &mesh);
    let (triangles, tets) = (surface.triangles().len(), mesh.tets.len());
    let (edges, faces) = (report.missing_edges, report.missing_faces);
    format!(
        "| {what} | {triangles} | {edges} + {faces} | {} | {tets} | {seconds:.2} |",
        report.steiner_inside
    )
}

/// The surface around and between the bodies of some tets.
fn surface_of(points: &[Point], tets: &[([u32; 4], Option<BodyId>)]) -> ClosedSurface {
    skin_of(points, tets, 1).surface().unwrap()
}

fn surface_of_geometry(name: &str, preset: Preset) -> ClosedSurface {
    let mesh = coarse(&model(name), preset);
    let tets: Vec<_> =
        mesh.tets.iter().zip(&mesh.bodies).map(|(t, body)| (t.map(|v| v.0), Some(*body))).collect();
    surface_of(&mesh.points, &tets)
}

const NAMES: [&str; 13] = [
    "bearing",
    "bracket",
    "crankshaft",
    "dome",
    "fibres",
    "flange",
    "funnel",
    "heat_sink",
    "layers",
    "lens",
    "nozzle",
    "ring_segment",
    "tee",
];

#[test]
fn surfaces_of_geometries_are_filled() {
    for (preset, label) in Preset::ALL {
        let small = match preset {
            Preset::VeryCoarse | Preset::Coarse => &NAMES[..],
            Preset::Moderate => &NAMES[3..7],
            Preset::Fine => &NAMES[9..10],
            Preset::VeryFine => &NAMES[3..4],
        };
        for name in small {
            filled(&format!("{name} {label}"), &surface_of_geometry(name, preset));
        }
    }
}

#[test]
#[ignore = "a minute: its table is in benches/results/hard-inputs-2026-11-21.md"]
fn surfaces_of_all_geometries_are_filled_at_all_presets() {
    for (preset, label) in Preset::ALL {
        for name in NAMES {
            println!("{}", filled(&format!("{name} {label}"), &surface_of_geometry(name, preset)));
        }
    }
}

/// The surfaces of the parts of a mesh with `pieces` subdivisions an edge, with new vertices on the
/// geometry.
fn surfaces_of_parts(name: &str, preset: Preset, ranks: u32, pieces: u32) -> Vec<ClosedSurface> {
    let model = model(name);
    let part = from_serial(coarse(&model, preset)).unwrap();
    let fine = refine(part, &model.projector(), pieces, &refine::Settings::default()).unwrap();
    let coarse = fine.coarse();
    let as_mesh = Mesh { points: coarse.points.clone(), tets: coarse.tets.clone(), ..Mesh::default() };
    let (rank_of, _) = partition(&as_mesh, ranks, &parts::Settings::default()).unwrap();
    let mut tets = vec![Vec::new(); ranks as usize];
    let mut block = TetBlock::default();
    for (index, &rank) in rank_of.iter().enumerate() {
        fine.tet_block(index, &mut block);
        tets[rank as usize].extend(block.tets.iter().map(|&tet| (tet, block.body)));
    }
    let points: Vec<Point> = fine.points().iter().map(|&p| p.into()).collect();
    tets.iter().map(|tets| surface_of(&points, tets)).collect()
}

/// Number of edges with more than two triangles.
fn edges_of_many(surface: &ClosedSurface) -> usize {
    let edge = |t: &[u32; 3], k: usize| [t[k].min(t[(k + 1) % 3]), t[k].max(t[(k + 1) % 3])];
    let mut edges: Vec<[u32; 2]> =
        surface.triangles().iter().flat_map(|t| [0, 1, 2].map(|k| edge(t, k))).collect();
    edges.sort_unstable();
    edges.chunk_by(|a, b| a == b).filter(|same| same.len() > 2).count()
}

#[test]
fn skins_of_refined_parts_are_filled_also_where_they_touch_themselves() {
    let mut touching = 0;
    for (name, preset, ranks, pieces) in [
        ("bracket", Preset::Coarse, 16, 2),
        ("flange", Preset::VeryCoarse, 4, 4),
        ("fibres", Preset::VeryCoarse, 16, 2),
        ("nozzle", Preset::Moderate, 16, 4),
    ] {
        for (rank, surface) in surfaces_of_parts(name, preset, ranks, pieces).iter().enumerate() {
            touching += usize::from(edges_of_many(surface) > 0);
            filled(&format!("{name}, part {rank} of {ranks}, {pieces} pieces"), surface);
        }
    }
    assert!(touching > 5, "{touching} skins meet themselves in edges or have bodies that meet there");
}

#[test]
#[ignore = "a minute: its table is in benches/results/hard-inputs-2026-11-21.md"]
fn skins_of_all_refined_parts_are_filled() {
    for name in NAMES {
        // The coarse mesh of the tee would have inverted children; `generate` makes it finer there.
        let coarse = if name == "tee" { Preset::Moderate } else { Preset::Coarse };
        for (preset, ranks, pieces) in [(Preset::Moderate, 4, 2), (coarse, 16, 2), (coarse, 16, 4)] {
            for (rank, surface) in surfaces_of_parts(name, preset, ranks, pieces).iter().enumerate() {
                println!("{}", filled(&format!("{name}, part {rank} of {ranks}, {pieces} pieces"), surface));
            }
        }
    }
}

/// Needle triangles of aspect ratio 10⁴: the side of a tube, and a cone whose triangles all meet at
/// the apex.
fn needles() -> Vec<(String, Soup)> {
    let mut soups = Vec::new();
    for sides in [5, 24, 100] {
        for wall in [0.5, 1e-3] {
            soups.push((format!("tube of {sides} sides, wall {wall}"), needle_tube(sides, 1e4, wall)));
        }
        soups.push((format!("cone of {sides} sides"), needle_cone(sides, 1e4)));
    }
    soups
}

/// A torus inverted at a point near it. Triangles stay similar; edge lengths vary as
/// (farthest/nearest)².
fn inverted_torus(around: [usize; 2], near: f64) -> Soup {
    let mut soup = Soup::default();
    soup.torus([1.0, 0.4], around, crate::samples::INSIDE);
    let center = Point::new(1.4 + near, 1e-3, 2e-3);
    soup.map(|p| Point::from((p - center) / (p - center).norm_squared()));
    soup.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    soup
}

/// Ratio of the longest edge to the shortest.
fn spread(surface: &ClosedSurface) -> f64 {
    let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
    for t in surface.triangles() {
        for k in 0..3 {
            let [a, b] = [t[k], t[(k + 1) % 3]].map(|v| surface.points()[v as usize]);
            let length = (b - a).norm();
            (least, most) = (least.min(length), most.max(length));
        }
    }
    most / least
}

#[test]
fn a_surface_with_edges_over_four_orders_of_magnitude_is_filled() {
    for soup in [graded_ball(70, 40, 1e-4), inverted_torus([80, 40], 0.03)] {
        let surface = soup.surface().unwrap();
        assert!(spread(&surface) > 3e3, "{}", spread(&surface));
        filled("graded", &surface);
    }
}

#[test]
#[ignore = "10 s: its table is in benches/results/hard-inputs-2026-11-21.md"]
fn surfaces_of_a_hundred_thousand_triangles_over_four_orders_of_magnitude_are_filled() {
    for (what, soup) in
        [("graded ball", graded_ball(170, 300, 1e-4)), ("inverted torus", inverted_torus([330, 160], 0.02))]
    {
        let surface = soup.surface().unwrap();
        let spread = spread(&surface);
        println!("{}", filled(&format!("{what}, edges 1 to {spread:.0}"), &surface));
    }
    for (what, soup) in needles() {
        println!("{}", filled(&what, &soup.surface().unwrap()));
    }
}
