//! Tests of VTK files: our own are read back exactly, in one part or several; those of others if
//! their pieces match.

use super::*;
use crate::files::plain::PlainPart;
use crate::files::testing::{cube, scattered, together};
use crate::files::vtu::{Boundary, write_with};
use crate::ground::comm::thread;
use crate::ground::mesh::{Label, VertexId};
use std::fs;

/// Names with XML special characters, and several names for one number.
fn names() -> Names {
    let label =
        |number, names: &[&str]| Label { number, names: names.iter().map(|n| n.to_string()).collect() };
    Names {
        bodies: vec![label(1, &["<lower> & \"co\" -->"]), label(4, &[])],
        patches: vec![
            label(1, &["wall"]),
            label(2, &["lid -- top", "wall"]),
            label(7, &["between", "wall", "all"]),
        ],
    }
}

fn write_cube(ranks: u32, boundary: Boundary, stem: &Path) -> Mesh {
    let mesh = cube(4);
    let tet_to_rank = scattered(&mesh, ranks);
    together(ranks, |comm| {
        let part = PlainPart::part(&mesh, &tet_to_rank, ranks, comm.rank());
        write_with(comm, &part, &names(), stem, boundary).unwrap();
    });
    mesh
}

/// Triangles by their vertices, with their boundary numbers.
fn triangles(mesh: &Mesh, names: &Names) -> Vec<([VertexId; 3], u32)> {
    let mut triangles: Vec<_> = mesh
        .triangles
        .iter()
        .map(|triangle| {
            let mut vertices = triangle.vertices;
            vertices.sort_unstable();
            (vertices, names.patches[triangle.patch.index()].number)
        })
        .collect();
    triangles.sort_unstable();
    triangles
}

#[test]
fn the_parts_of_a_mesh_come_back_as_the_mesh() {
    for ranks in [1, 2, 5] {
        for boundary in [Boundary::Beside, Boundary::In] {
            let dir = tempfile::tempdir().unwrap();
            let stem = dir.path().join("a & b");
            let mesh = write_cube(ranks, boundary, &stem);
            let found = read(&stem.with_extension(if ranks == 1 { "vtu" } else { "pvtu" })).unwrap();
            assert_eq!(found.mesh.points, mesh.points);
            assert_eq!((&found.mesh.tets, &found.mesh.bodies), (&mesh.tets, &mesh.bodies));
            assert_eq!(triangles(&found.mesh, &found.names), triangles(&mesh, &names()));
            assert_eq!(found.names, names(), "{ranks} {boundary:?}");
            assert!(found.notes.is_empty(), "{:?}", found.notes);
        }
    }
}

#[test]
fn ghosts_of_parts_are_left_out() {
    let dir = tempfile::tempdir().unwrap();
    let (mesh, stem) = (cube(4), dir.path().join("m"));
    for boundary in [Boundary::Beside, Boundary::In] {
        together(3, |comm| {
            let part = PlainPart::part(&mesh, &scattered(&mesh, 3), 3, comm.rank());
            let ghosts =
                crate::parallel::halo::halo(comm, &part, crate::parallel::halo::By::Vertices).unwrap();
            write_with(
                comm,
                &crate::parallel::halo::WithHalo::new(&part, &ghosts),
                &names(),
                &stem,
                boundary,
            )
            .unwrap();
        });
        let found = read(&stem.with_extension("pvtu")).unwrap();
        assert_eq!((found.mesh.points, found.mesh.tets), (mesh.points.clone(), mesh.tets.clone()));
        assert_eq!(found.mesh.triangles.len(), mesh.triangles.len());
        assert!(found.notes.is_empty(), "{:?}", found.notes);
        fs::remove_file(stem.with_extension("pvtu")).unwrap();
    }
}

/// An index file of two pieces without ids, one tet each; `shift` moves the last vertex of the
/// second.
fn foreign(folder: &Path, shift: f64) -> Result<VolumeMesh, ReadError> {
    for (name, points) in [
        ("a.vtu", "0 0 0 1 0 0 0 1 0 0 0 1".to_string()),
        ("b.vtu", format!("1 1 1 1 0 0 0 1 0 0 0 {}", 1.0 + shift)),
    ] {
        let text = format!(
            "<VTKFile type='UnstructuredGrid'><UnstructuredGrid><Piece NumberOfPoints='4' NumberOfCells='1'>\
             <Points><DataArray type='Float64' NumberOfComponents='3' format='ascii'>{points}</DataArray></Points><Cells>\
             <DataArray type='Int32' Name='connectivity' format='ascii'>0 1 2 3</DataArray>\
             <DataArray type='Int32' Name='offsets' format='ascii'>4</DataArray>\
             <DataArray type='UInt8' Name='types' format='ascii'>10</DataArray></Cells></Piece></UnstructuredGrid></VTKFile>"
        );
        fs::write(folder.join(name), text).unwrap();
    }
    let list = "<VTKFile type='PUnstructuredGrid'><PUnstructuredGrid><Piece Source='a.vtu'/><Piece Source=\"b.vtu\"/>\
                </PUnstructuredGrid></VTKFile>";
    fs::write(folder.join("m.pvtu"), list).unwrap();
    read(&folder.join("m.pvtu"))
}

#[test]
fn pieces_without_ids_are_joined_by_equal_places_or_refused() {
    let dir = tempfile::tempdir().unwrap();
    let found = foreign(dir.path(), 0.0).unwrap();
    assert_eq!((found.mesh.points.len(), found.mesh.tets.len(), found.mesh.triangles.len()), (5, 2, 6));
    assert!(
        found.notes.iter().any(|note| note.contains("3 vertices of several pieces")),
        "{:?}",
        found.notes
    );
    let error = foreign(dir.path(), 1e-9).unwrap_err().to_string();
    assert!(error.contains("m.pvtu") && error.contains("cannot be joined"), "{error}");
    // Two bodies with only an edge in common.
    assert_eq!(foreign(dir.path(), 0.5).unwrap().mesh.points.len(), 6);
}

#[test]
fn broken_lists_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let refused = |text: &str, expected: &str| {
        let path = dir.path().join("m.pvtu");
        fs::write(&path, text).unwrap();
        let error = read(&path).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    };
    refused("<VTKFile type='UnstructuredGrid'>", "PUnstructuredGrid is needed");
    refused("<VTKFile type='PUnstructuredGrid'>", "no piece");
    refused("<VTKFile type='PUnstructuredGrid'><Piece/>", "without a source");
    refused("<VTKFile type='PUnstructuredGrid'><Piece Source='none.vtu'/>", "none.vtu");
}

#[test]
fn dropped_periodic_pairs_are_noted() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("m.vtu");
    let mesh = cube(2);
    write_with(&thread::alone(), &PlainPart::whole(&mesh), &names(), &path, Boundary::Beside).unwrap();
    let mut bytes = fs::read(&path).unwrap();
    // The ids serve as the array of masters: its values do not matter here.
    let place = bytes.windows(21).position(|w| w == b" Name=\"GlobalNodeId\" ").unwrap();
    bytes[place..place + 21].copy_from_slice(b" Name=\"PeriodicId\"   ");
    fs::write(&path, bytes).unwrap();
    let found = read(&path).unwrap();
    assert!(found.notes.iter().any(|note| note.contains("not periodic here")), "{:?}", found.notes);
}
