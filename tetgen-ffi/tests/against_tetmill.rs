//! tetmill's tets beside TetGen's inside the same surfaces: what must agree agrees, and ours are no worse.

mod samples;

use csg::BodyId;
use csg::language::parse_geometry;
use samples::hard::{graded_ball, notched_block, spiked_ball, staircase, twist_limit, twisted_prisms};
use samples::soup::Soup;
use std::collections::BTreeSet;
use tetgen_ffi::{available, tetrahedralize};
use tetmill::kernel::quality::QualitySummary;
use tetmill::kernel::simplex::volume;
use tetmill::mesh::{Mesh, TET_FACES, VertexId};
use tetmill::pipeline::Model;
use tetmill::size::{Preset, SizeSettings, UniformSize};
use tetmill::volume::{Settings, mesh};
use tetmill::{Point, kernel::random::Random};
use thiserror as _;

/// tetmill's coarse mesh of one of our own geometries.
fn ours(name: &str, preset: Preset) -> Mesh {
    let path = format!("{}/../geometries/{name}.geo", env!("CARGO_MANIFEST_DIR"));
    let source = std::fs::read_to_string(&path).unwrap();
    let model = Model::from_csg(parse_geometry(&source, &path).unwrap().geometry).unwrap();
    model.coarse_mesh(&mut SizeSettings::from(preset).into()).unwrap().mesh
}

/// TetGen's mesh inside our surface; the boundary kept (`Y`), its best quality (`q1.4`). Its vertices are numbered as in
/// `points`, those of the surface first.
fn theirs(points: &[Point], triangles: &[[u32; 3]]) -> Result<Mesh, tetgen_ffi::Error> {
    let used: BTreeSet<u32> = triangles.iter().flatten().copied().collect();
    assert!(used.iter().copied().eq(0..used.len() as u32), "the surface's points come first");
    let points: Vec<[f64; 3]> = points[..used.len()].iter().map(|&p| p.into()).collect();
    let made = tetrahedralize(&points, triangles, "pYq1.4")?;
    Ok(Mesh {
        points: made.points.into_iter().map(Into::into).collect(),
        tets: made.tets.into_iter().map(|t| t.map(VertexId)).collect(),
        ..Mesh::default()
    })
}

/// The faces that have a tet on one side only.
fn outer_faces(mesh: &Mesh) -> BTreeSet<[u32; 3]> {
    let mut faces = BTreeSet::new();
    for tet in &mesh.tets {
        for face in TET_FACES {
            let mut face = face.map(|i| tet[i].0);
            face.sort_unstable();
            if !faces.insert(face) {
                faces.remove(&face);
            }
        }
    }
    faces
}

/// Both fill the same volume, up to rounding, and have the same outer triangles.
fn check_same(name: &str, ours: &Mesh, theirs: &Mesh) {
    let [a, b] = [ours, theirs].map(total_volume);
    assert!((a - b).abs() <= 1e-12 * a, "{name}: {a} and {b}");
    assert!(outer_faces(ours) == outer_faces(theirs), "{name}: other outer triangles");
}

fn total_volume(mesh: &Mesh) -> f64 {
    let of = |tet: &[VertexId; 4]| {
        let [a, b, c, d] = tet.map(|v| mesh.points[v.index()]);
        volume(&a, &b, &c, &d)
    };
    mesh.tets.iter().map(of).sum()
}

#[test]
fn both_fill_the_same_volume_and_our_angles_are_better() {
    if !available() {
        eprintln!("SKIPPED: TetGen is not available");
        return;
    }
    for preset in [Preset::Moderate, Preset::Coarse] {
        for name in ["crankshaft", "bracket", "fibres", "flange", "tee", "dome", "bearing", "layers"] {
            let ours = ours(name, preset);
            let triangles: Vec<[u32; 3]> = ours.triangles.iter().map(|t| t.vertices.map(|v| v.0)).collect();
            let theirs = theirs(&ours.points, &triangles).unwrap();
            check_same(name, &ours, &theirs);
            let [a, b] = [&ours, &theirs].map(QualitySummary::of);
            // Coarser surfaces have bad angles of their own, and there ours are not yet better everywhere.
            if preset == Preset::Moderate {
                assert!(a.smallest_dihedral >= b.smallest_dihedral, "{name}: {a:?}\nTetGen {b:?}");
                assert!(a.worst_mean_ratio >= b.worst_mean_ratio, "{name}: {a:?}\nTetGen {b:?}");
                assert!(a.average_mean_ratio >= b.average_mean_ratio, "{name}: {a:?}\nTetGen {b:?}");
            }
            eprintln!(
                "{name}: {} tets, smallest dihedral angle {:.1}°; TetGen {} tets, {:.1}°",
                a.tets, a.smallest_dihedral, b.tets, b.smallest_dihedral
            );
        }
    }
}

#[test]
fn both_fill_the_same_hard_surfaces() {
    if !available() {
        eprintln!("SKIPPED: TetGen is not available");
        return;
    }
    let random = &mut Random::new(31);
    let mut surfaces: Vec<(String, Soup)> = Vec::new();
    for (sides, part) in [(3, 0.3), (3, 0.9), (4, 0.8), (6, 0.5), (9, 0.9)] {
        let soup = twisted_prisms(sides, -part * twist_limit(sides), 1.0, 1);
        surfaces.push((format!("prism of {sides} sides, {part} of the limit"), soup));
    }
    for n in 1..=3 {
        surfaces.push((format!("block of {n} notches"), notched_block(n, 0.1)));
    }
    for (levels, reach) in [(1, 2.0), (1, 10.0), (2, 3.0), (2, 10.0), (3, 2.0)] {
        let soup = spiked_ball(levels, reach, 10 << (2 * levels), false, random);
        surfaces.push((format!("ball of {levels} levels, spikes to {reach}"), soup));
    }
    // Without voids, which TetGen would have to be told of.
    for n in 2..=3 {
        let soup = staircase(n, 0.1, random, |r| (r.bits() % 3 > 0).then_some(BodyId(0)));
        surfaces.push((format!("staircase of {n} steps"), soup));
    }
    surfaces.push(("graded ball".to_owned(), graded_ball(30, 20, 1e-2)));
    let mut compared = 0;
    for (name, soup) in surfaces {
        let surface = soup.surface().unwrap();
        let settings = Settings { fill: false, ..Settings::default() };
        let (filled, report) = mesh(&surface, &UniformSize(1.0), &settings).unwrap();
        let ours = Mesh {
            points: filled.points,
            tets: filled.tets.iter().map(|t| t.map(VertexId)).collect(),
            ..Mesh::default()
        };
        match theirs(surface.points(), surface.triangles()) {
            Ok(theirs) => {
                check_same(&name, &ours, &theirs);
                compared += 1;
                eprintln!("{name}: the same, {report:?}");
            }
            Err(error) => eprintln!("{name}: TetGen has no mesh to compare with: {error}"),
        }
    }
    assert!(compared >= 14, "only {compared} surfaces could be compared");
}
