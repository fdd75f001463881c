//! Tests of VTK files: our own are read back exactly, in one part or several; those of others if
//! their pieces match.

use super::samples::{ALL_STORED, Stored, vtu};
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
            let parts = if ranks == 1 { Vec::new() } else { scattered(&mesh, ranks) };
            assert_eq!(found.parts, parts);
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
        assert_eq!(found.parts, scattered(&mesh, 3), "of the part, not of its ghosts");
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
    let list = |pieces: &str| {
        let grid = format!("<PUnstructuredGrid>{pieces}</PUnstructuredGrid>");
        format!("<VTKFile type='PUnstructuredGrid'>\n{grid}\n</VTKFile>\n")
    };
    refused("<VTKFile type='UnstructuredGrid'>", "PUnstructuredGrid is needed");
    refused(&list(""), "no piece");
    refused(&list("<Piece/>"), "m.pvtu:2: a piece without a source");
    refused(&list("<Piece Source='none.vtu'/>"), "none.vtu");
    refused(&list("</Piece>"), "m.pvtu:2: expected `</PUnstructuredGrid>`, found `</Piece>`");
    refused(
        "<VTKFile type='PUnstructuredGrid'>\n<Piece Source='a.vtu'/></VTKFile>",
        "m.pvtu:2: `<Piece>` is in",
    );
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

/// Reads a file of this content.
fn read_as(content: &[u8]) -> Result<VolumeMesh, String> {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("m.vtu");
    fs::write(&path, content).unwrap();
    read(&path).map_err(|error| error.to_string().replace(&format!("{}/", dir.path().display()), ""))
}

#[track_caller]
fn refused(content: impl AsRef<[u8]>, line: usize, reason: &str) {
    let said = read_as(content.as_ref()).expect_err("it is refused");
    assert!(said.starts_with(&format!("m.vtu:{line}: ")) && said.contains(reason), "{line} {reason}: {said}");
}

/// A file of ours, with raw data, and those of other programs.
fn whole_files() -> Vec<Vec<u8>> {
    let dir = tempfile::tempdir().unwrap();
    let stem = dir.path().join("m");
    write_cube(1, Boundary::In, &stem);
    let mut files: Vec<_> = ALL_STORED.into_iter().map(vtu).collect();
    files.push(fs::read(stem.with_extension("vtu")).unwrap());
    files
}

#[test]
fn a_file_cut_off_anywhere_is_refused() {
    for file in whole_files() {
        read_as(&file).unwrap();
        let whole = file.trim_ascii_end().len();
        // Every place near the end, where only closing tags are missing, and many before.
        let near = whole.saturating_sub(400);
        let far = (1..near).step_by((near / 200).max(1));
        for end in far.chain(near..whole) {
            let said = read_as(&file[..end]).expect_err("it is cut off");
            assert!(said.starts_with("m.vtu:"), "cut at {end} of {whole}: {said}");
        }
        read_as(&file[..whole]).unwrap();
    }
}

#[test]
fn a_list_of_pieces_cut_off_anywhere_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let stem = dir.path().join("m");
    write_cube(2, Boundary::Beside, &stem);
    let path = stem.with_extension("pvtu");
    let file = fs::read(&path).unwrap();
    for end in 1..file.trim_ascii_end().len() {
        fs::write(&path, &file[..end]).unwrap();
        let said = read(&path).expect_err("it is cut off").to_string();
        assert!(said.contains("m.pvtu:"), "cut at {end}: {said}");
    }
}

#[test]
fn tags_out_of_place_are_refused_with_their_line() {
    let text = String::from_utf8(vtu(Stored::Text)).unwrap();
    let twice = |tag: &str| text.replacen(tag, &format!("{tag}{tag}"), 1);
    refused(text.replacen("</Points>", "", 1), 9, "`<Cells>` is in `<Points>`; it belongs in `<Piece>`");
    refused(text.replacen("</Points>", "</Cells>", 1), 8, "expected `</Points>`, found `</Cells>`");
    refused(twice("</Points>"), 8, "expected `</Piece>`, found `</Points>`");
    refused(twice("</VTKFile>\n"), 24, "`</VTKFile>` closes nothing");
    refused(text.replacen("</Piece>\n", "", 1), 21, "expected `</Piece>`, found `</UnstructuredGrid>`");
    refused(text.clone() + "<VTKFile/>", 24, "goes on after its last element");
    refused(text.clone() + "more", 24, "expected `<`, found `more`");
    let outside = text.replace("<UnstructuredGrid>", "").replace("</UnstructuredGrid>", "");
    refused(outside, 5, "`<Piece>` is in `<VTKFile>`; it belongs in `<UnstructuredGrid>`");
    refused("<vtk/>", 1, "another format");
    let quoted = text.replace("Name=\"offsets\"", "Name=\"offsets\" note='a > b'");
    assert_eq!(read_as(quoted.as_bytes()).unwrap().mesh.tets.len(), 2);
}

#[test]
fn counts_that_contradict_the_data_are_refused_with_their_line() {
    let text = String::from_utf8(vtu(Stored::Text)).unwrap();
    let with = |from: &str, to: &str| {
        assert!(text.contains(from), "{from}");
        text.replacen(from, to, 1)
    };
    refused(with("OfPoints=\"5\"", "OfPoints=\"6\""), 6, "it has 15 numbers, and 6 points need 18");
    refused(with("OfPoints=\"5\" ", ""), 5, "`Piece` has no attribute NumberOfPoints");
    refused(with("OfCells='8'", "OfCells='-8'"), 5, "NumberOfCells is no whole number: `-8`");
    refused(with("OfCells='8'", "OfCells='7'"), 12, "`offsets`: it has 8 numbers, and 7 cells need 7");
    refused(with("22  26", "22"), 12, "`offsets`: it has 7 numbers, and 8 cells need 8");
    refused(with("22  26", "22  25"), 9, "`connectivity`: it has 26 numbers, and offsets up to 25 need 25");
    refused(with("3  6  9", "3  9  6"), 12, "the offset 6 of cell 2 is wrong");
    refused(with("10  10", "10"), 15, "`types`: it has 7 numbers, and 8 cells need 8");
    refused(with("7  7\n", "7  7  7\n"), 18, "`medit:ref`: it has 9 numbers, and 8 cells need 8");
    let ghosts = with("medit:ref", "vtkGhostType").replacen("7  7\n", "7\n", 1);
    refused(ghosts, 18, "`vtkGhostType`: it has 7 numbers");
    let ids = with("medit:ref", "GlobalElementId").replacen("7  7\n", "7\n", 1);
    refused(ids, 18, "`GlobalElementId`: it has 7 numbers");
}

#[test]
fn data_of_other_lengths_than_announced_is_refused_with_its_line() {
    let inline = String::from_utf8(vtu(Stored::Inline)).unwrap();
    let longer = inline.replacen("\n</DataArray>", "AAAA\n</DataArray>", 1);
    refused(longer, 6, "3 bytes longer than its header says");
    refused(inline.replacen("\n</DataArray>", "\u{0}\n</DataArray>", 1), 6, "is not base64");
    refused(inline.replacen("\"Int64\"", "\"Int32\"", 1), 12, "it has 16 numbers, and 8 cells need 8");
    let zlib = String::from_utf8(vtu(Stored::Zlib)).unwrap();
    // The size of the last block, 8 bytes, becomes 9.
    let place = zlib.find("format=\"binary\">\n ").unwrap() + 18;
    let mut bytes = zlib.into_bytes();
    assert_eq!(&bytes[place..place + 12], b"CAAAABAAAAAI");
    bytes[place + 11] = b'J';
    refused(bytes, 6, "not what its header says");
}
