//! Files of other programs, read through the library.

use crate::folders::shared;
use std::path::Path;
use std::process::Command;
use tetmill::files::{surface, volume};
use tetmill::internals::simplex::volume as tet_volume;
use tetmill::mesh::Label;

/// Number of edges that do not have exactly two triangles in opposite directions.
fn loose_edges(triangles: &[[u32; 3]]) -> usize {
    let mut edges: Vec<[u32; 2]> = triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).collect();
    edges.sort_unstable();
    let has = |edge: [u32; 2]| edges.binary_search(&edge).is_ok();
    edges.iter().filter(|[a, b]| !has([*b, *a])).count() + edges.windows(2).filter(|w| w[0] == w[1]).count()
}

#[test]
fn the_tutorials_stl_files_are_closed_surfaces() {
    let Some(folder) = shared("netgen-tutorials") else { return };
    // Vertices and triangles by Euler: V − E + F = 2 − 2g, with 3F = 2E.
    for (name, genus) in [("hinge.stl", 0), ("part1.stl", 0)] {
        let found = surface::read(&folder.join(name)).unwrap();
        let (v, f) = (found.points.len() as i64, found.triangles.len() as i64);
        eprintln!(
            "{name}: {v} points, {f} triangles, {} loose edges, {:?}",
            loose_edges(&found.triangles),
            found.notes
        );
        assert!(f > 100, "{name}: {f} triangles");
        assert_eq!(loose_edges(&found.triangles), 0, "{name}");
        assert!(v - f / 2 <= 2 - 2 * genus, "{name}: {v} vertices, {f} triangles");
    }
}

#[test]
fn the_ply_surfaces_have_the_counts_of_their_headers() {
    let Some(folder) = shared("surfaces") else { return };
    for (name, vertices, faces) in [
        ("cube_100k.ply", 5_687, 11_370),
        ("cube_1M.ply", 26_433, 52_862),
        ("shaft_100k.ply", 11_557, 23_110),
        ("shaft_1M.ply", 55_171, 110_338),
    ] {
        let found = surface::read(&folder.join(name)).unwrap();
        assert_eq!((found.points.len(), found.triangles.len()), (vertices, faces), "{name}");
        assert_eq!(loose_edges(&found.triangles), 0, "{name}");
        assert!(found.notes.is_empty(), "{name}: {:?}", found.notes);
    }
}

/// A cube with a smaller one inside as a second region, in TetGen's format.
fn nested_cubes() -> String {
    let mut text = String::from("16 3 0 0\n");
    for (k, (low, high)) in [(0, (0, 4)), (8, (1, 3))] {
        for v in 0..8 {
            let [x, y, z] = [v & 1, v >> 1 & 1, v >> 2].map(|bit| if bit == 1 { high } else { low });
            text += &format!("{} {x} {y} {z}\n", k + v);
        }
    }
    text += "12 1\n";
    let sides = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    for (first, marker) in [(0, 10), (8, 20)] {
        for side in sides {
            let [a, b, c, d] = side.map(|v| v + first);
            text += &format!("1 0 {marker}\n4 {a} {b} {c} {d}\n");
        }
    }
    text + "0\n2\n1 0.5 0.5 0.5 3 0\n2 2 2 2 4 0\n"
}

#[test]
fn tetgens_own_files_are_read() {
    let dir = tempfile::tempdir().unwrap();
    let poly = dir.path().join("box.poly");
    std::fs::write(&poly, nested_cubes()).unwrap();
    let read = surface::read(&poly).unwrap();
    assert_eq!((read.points.len(), read.triangles.len(), read.regions.len()), (16, 24, 2));
    assert_eq!(read.groups, ["marker 10", "marker 20"]);
    let Ok(output) = Command::new("tetgen").args(["-pq1.4a0.5AQ"]).arg(&poly).output() else {
        eprintln!("SKIPPED: there is no tetgen");
        return;
    };
    assert!(output.status.success(), "{output:?}");
    let found = volume::read(&dir.path().join("box.1.ele")).unwrap();
    let mut numbers: Vec<u32> = found.names.bodies.iter().map(|label| label.number).collect();
    numbers.sort_unstable();
    assert_eq!(numbers, [3, 4]);
    let mut volumes = [0.0; 2];
    for (tet, body) in found.mesh.tets.iter().zip(&found.mesh.bodies) {
        let [a, b, c, d] = tet.map(|v| found.mesh.points[v.index()]);
        volumes[body.index()] += tet_volume(&a, &b, &c, &d);
    }
    let of =
        |number: u32| volumes[found.names.bodies.iter().position(|label| label.number == number).unwrap()];
    assert!((of(3) - 56.0).abs() < 1e-10 && (of(4) - 8.0).abs() < 1e-10, "{volumes:?}");
    assert!(found.inverted.is_empty());
    let patch_numbers: Vec<u32> = found.names.patches.iter().map(|label| label.number).collect();
    assert_eq!(patch_numbers, [10, 20]);
    eprintln!("tetgen: {} tets, {:?}", found.mesh.tets.len(), found.notes);
}

/// Runs a Python program; the test is skipped with a message if the module is missing.
fn python(module: &str, program: &str, folder: &Path) -> bool {
    let has_module = Command::new("python3")
        .args(["-c", &format!("import {module}")])
        .output()
        .is_ok_and(|o| o.status.success());
    if !has_module {
        eprintln!("SKIPPED: there is no Python module {module}");
        return false;
    }
    let output = Command::new("python3").args(["-c", program]).current_dir(folder).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    true
}

#[test]
fn gmshs_own_files_are_read() {
    let program = "
import gmsh
gmsh.initialize()
gmsh.option.setNumber('General.Terminal', 0)
a = gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
b = gmsh.model.occ.addBox(1, 0, 0, 1, 1, 1)
gmsh.model.occ.fragment([(3, a)], [(3, b)])
gmsh.model.occ.synchronize()
volumes = [tag for _, tag in gmsh.model.getEntities(3)]
surfaces = [tag for _, tag in gmsh.model.getEntities(2)]
for k, tag in enumerate(volumes):
    gmsh.model.addPhysicalGroup(3, [tag], 11 + k, 'body %d' % k)
gmsh.model.addPhysicalGroup(2, surfaces, 5, 'all sides')
gmsh.option.setNumber('Mesh.MeshSizeMax', 0.3)
gmsh.model.mesh.generate(3)
for version in (2.2, 4.1):
    for binary in (0, 1):
        gmsh.option.setNumber('Mesh.MshFileVersion', version)
        gmsh.option.setNumber('Mesh.Binary', binary)
        gmsh.write('m-%s-%d.msh' % (version, binary))
gmsh.write('m.mesh')
gmsh.model.mesh.setOrder(2)
gmsh.option.setNumber('Mesh.Binary', 1)
gmsh.write('second.msh')
";
    let dir = tempfile::tempdir().unwrap();
    if !python("gmsh", program, dir.path()) {
        return;
    }
    let mut tets = Vec::new();
    for name in ["m-2.2-0.msh", "m-2.2-1.msh", "m-4.1-0.msh", "m-4.1-1.msh", "m.mesh", "second.msh"] {
        let found = volume::read(&dir.path().join(name)).unwrap();
        let volume: f64 = found
            .mesh
            .tets
            .iter()
            .map(|t| {
                let [a, b, c, d] = t.map(|v| found.mesh.points[v.index()]);
                tet_volume(&a, &b, &c, &d)
            })
            .sum();
        assert!((volume - 2.0).abs() < 1e-9, "{name}: {volume}");
        assert!(found.inverted.is_empty(), "{name}");
        assert_eq!(found.names.bodies.len(), 2, "{name}: {:?}", found.names);
        if name != "m.mesh" {
            assert_eq!(found.names.bodies[0], Label::new(11, "body 0"), "{name}");
            assert!(found.names.patches.iter().all(|p| *p == Label::new(5, "all sides")), "{name}");
        }
        tets.push(found.mesh.tets.len());
    }
    assert!(tets.iter().all(|count| *count == tets[0] && *count > 100), "{tets:?}");
}

#[test]
fn meshios_vtu_files_are_read() {
    let program = "
import meshio
points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]]
cells = [('triangle', [[0, 2, 1]]), ('tetra', [[0, 1, 2, 3], [1, 2, 3, 4]])]
mesh = meshio.Mesh(points, cells, cell_data={'medit:ref': [[5], [7, 8]]})
mesh.write('zlib.vtu', compression='zlib')
mesh.write('plain.vtu', compression=None)
mesh.write('text.vtu', binary=False)
";
    let dir = tempfile::tempdir().unwrap();
    if !python("meshio", program, dir.path()) {
        return;
    }
    for name in ["zlib.vtu", "plain.vtu", "text.vtu"] {
        let found = volume::read(&dir.path().join(name)).unwrap();
        assert_eq!((found.mesh.points.len(), found.mesh.tets.len()), (5, 2), "{name}");
        assert_eq!(found.names.bodies.iter().map(|b| b.number).collect::<Vec<_>>(), [7, 8], "{name}");
        assert!(found.names.patches.iter().any(|p| p.number == 5), "{name}");
    }
}
