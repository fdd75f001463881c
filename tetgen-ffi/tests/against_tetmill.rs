//! tetmill's tets beside TetGen's inside the same surfaces: what must agree agrees, and ours are no worse.

use csg::language::parse_geometry;
use std::collections::BTreeSet;
use tetgen_ffi::{available, tetrahedralize};
use tetmill::kernel::quality::QualitySummary;
use tetmill::kernel::simplex::volume;
use tetmill::mesh::{Mesh, VertexId};
use tetmill::pipeline::Model;
use tetmill::size::{Preset, SizeSettings};
use thiserror as _;

/// tetmill's coarse mesh of one of our own geometries.
fn ours(name: &str) -> Mesh {
    let path = format!("{}/../geometries/{name}.geo", env!("CARGO_MANIFEST_DIR"));
    let source = std::fs::read_to_string(&path).unwrap();
    let model = Model::from_csg(parse_geometry(&source, &path).unwrap().geometry).unwrap();
    model.coarse_mesh(&mut SizeSettings::from(Preset::Moderate).into()).unwrap().mesh
}

/// TetGen's mesh inside our surface; the boundary kept (`Y`), its best quality (`q1.4`).
fn theirs(mesh: &Mesh) -> Mesh {
    let used: BTreeSet<VertexId> = mesh.triangles.iter().flat_map(|t| t.vertices).collect();
    let old: Vec<VertexId> = used.into_iter().collect();
    let new = |v: VertexId| old.binary_search(&v).unwrap() as u32;
    let points: Vec<[f64; 3]> = old.iter().map(|v| mesh.points[v.index()].into()).collect();
    let facets: Vec<[u32; 3]> = mesh.triangles.iter().map(|t| t.vertices.map(new)).collect();
    let made = tetrahedralize(&points, &facets, "pYq1.4").unwrap();
    Mesh {
        points: made.points.into_iter().map(Into::into).collect(),
        tets: made.tets.into_iter().map(|t| t.map(VertexId)).collect(),
        ..Mesh::default()
    }
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
    for name in ["crankshaft", "bracket", "fibres", "flange", "tee", "dome", "bearing", "layers"] {
        let ours = ours(name);
        let theirs = theirs(&ours);
        let [a, b] = [&ours, &theirs].map(total_volume);
        assert!((a - b).abs() < 1e-10 * a, "{name}: {a} and {b}");
        let [a, b] = [&ours, &theirs].map(QualitySummary::of);
        assert!(a.smallest_dihedral >= b.smallest_dihedral, "{name}: {a:?}\nTetGen {b:?}");
        assert!(a.worst_mean_ratio >= b.worst_mean_ratio, "{name}: {a:?}\nTetGen {b:?}");
        eprintln!(
            "{name}: {} tets, smallest dihedral angle {:.1}°; TetGen {} tets, {:.1}°",
            a.tets, a.smallest_dihedral, b.tets, b.smallest_dihedral
        );
    }
}
