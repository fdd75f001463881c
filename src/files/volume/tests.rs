use super::samples::*;
use super::*;
use crate::Point;
use crate::files::plain::PlainPart;
use crate::files::testing::{names, scattered, two_tets};
use crate::files::{elmer, serial};
use crate::ground::comm::thread;
use crate::ground::kernel::predicates::{Sign, orient3d};
use crate::ground::mesh::fixtures::{lattice_box, lattice_cube};
use crate::ground::mesh::{Class, Label, VertexId};
use proptest::prelude::*;
use std::fs;

/// Reads the first of these files after writing all of them.
fn read_all(files: &[(&str, &[u8])]) -> Result<VolumeMesh, String> {
    let dir = tempfile::tempdir().unwrap();
    for (name, content) in files {
        fs::write(dir.path().join(name), content).unwrap();
    }
    let folder = format!("{}/", dir.path().display());
    read(&dir.path().join(files[0].0)).map_err(|error| error.to_string().replace(&folder, ""))
}

fn read_as(name: &str, content: impl AsRef<[u8]>) -> Result<VolumeMesh, String> {
    read_all(&[(name, content.as_ref())])
}

#[track_caller]
fn refused(name: &str, content: impl AsRef<[u8]>, place: &str, reason: &str) {
    let said = read_as(name, content).expect_err("it is refused");
    // A place ending in a star is a prefix.
    let start = place.strip_suffix('*').map_or(format!("{name}{place}: "), |place| format!("{name}{place}"));
    assert!(said.starts_with(&start), "no `{start}` in: {said}");
    assert!(said.contains(reason), "no `{reason}` in: {said}");
}

/// Reads a file that must contain [`two_tets`] with body 7 and boundary 5 on all six triangles.
#[track_caller]
fn reads_two_tets(name: &str, content: impl AsRef<[u8]>) -> VolumeMesh {
    let found = read_as(name, content).unwrap();
    assert_eq!(found.mesh.points, two_tets().points);
    assert_eq!(found.mesh.tets, two_tets().tets);
    assert_eq!(found.mesh.triangles.len(), 6);
    assert_eq!(found.names.bodies.iter().map(|label| label.number).collect::<Vec<_>>(), [7]);
    assert_eq!(found.names.patches.iter().map(|label| label.number).collect::<Vec<_>>(), [5]);
    assert!(found.inverted.is_empty());
    found
}

/// Two bodies adjacent in x, with the interface between them.
fn two_bodies() -> (Mesh, Names) {
    let mesh = lattice_box([2, 2, 2], |cell| u32::from(cell[0] > 0));
    let patches = mesh.triangles.iter().map(|t| t.patch.0).max().unwrap() + 1;
    let patches = (1..=patches).map(|k| Label::new(k, format!("side_{k}"))).collect();
    (mesh, Names { bodies: vec![Label::new(1, "left"), Label::new(2, "right")], patches })
}

/// Expects the same vertices, tets, bodies and triangles in the same order.
#[track_caller]
fn assert_same(found: &Mesh, expected: &Mesh) {
    assert_eq!(found.points, expected.points);
    assert_eq!(found.tets, expected.tets);
    assert_eq!(found.bodies, expected.bodies);
    assert_eq!(found.triangles, expected.triangles);
}

fn written(mesh: &Mesh, names: &Names, name: &str) -> VolumeMesh {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join(name);
    serial::write(&PlainPart::whole(mesh), names, &path).unwrap();
    read(&path).unwrap()
}

#[test]
fn what_our_writers_write_reads_back_the_same() {
    let (mut mesh, names) = two_bodies();
    // Elements in the order of text files.
    mesh.triangles.sort_by_key(|triangle| triangle.patch);
    for name in ["m.msh", "m.mesh", "m.vol"] {
        let found = written(&mesh, &names, name);
        assert_same(&found.mesh, &mesh);
        assert_eq!(found.mesh.segments.len(), mesh.segments.len(), "{name}");
        let is_on = |class: &Class| match class {
            Class::Corner(_) => 0,
            Class::Curve(_) => 1,
            Class::Patch(_) => 2,
            Class::Body(_) => 3,
        };
        for (found, expected) in found.mesh.classes.iter().zip(&mesh.classes) {
            assert_eq!(is_on(found), is_on(expected), "{name}");
        }
        if name != "m.mesh" {
            assert_eq!(found.names, names, "{name}");
        }
        assert_eq!(found.turned, if name == "m.vol" { mesh.tets.len() } else { 0 });
        assert!(found.inverted.is_empty());
    }
    let found = written(&mesh, &names, "m.vtu");
    assert_same(&found.mesh, &mesh);
    assert_eq!(found.names, names);
    assert!(found.notes.is_empty(), "{:?}", found.notes);
}

#[test]
fn an_elmer_mesh_reads_back_whole_and_in_parts() {
    let (mesh, names) = two_bodies();
    for parts in [1, 3] {
        let dir = tempfile::tempdir().unwrap();
        let ranks = scattered(&mesh, parts);
        thread::run(parts, |comm| {
            let part = PlainPart::part(&mesh, &ranks, parts, comm.rank());
            elmer::write(comm, &part, &names, dir.path()).unwrap();
        })
        .unwrap();
        let found = read(dir.path()).unwrap();
        assert_eq!(found.names, names);
        // Elmer's numbering differs, so compare coordinates.
        let places = |mesh: &Mesh| {
            let place = |v: &VertexId| mesh.points[v.index()].coords.map(f64::to_bits);
            let mut tets: Vec<_> = mesh
                .tets
                .iter()
                .zip(&mesh.bodies)
                .map(|(t, b)| (t.map(|v| <[u64; 3]>::from(place(&v))), *b))
                .collect();
            let mut triangles: Vec<_> = mesh
                .triangles
                .iter()
                .map(|t| (t.vertices.map(|v| <[u64; 3]>::from(place(&v))), t.patch))
                .collect();
            tets.iter_mut().for_each(|(t, _)| t.sort_unstable());
            triangles.iter_mut().for_each(|(t, _)| t.sort_unstable());
            tets.sort_unstable();
            triangles.sort_unstable();
            (tets, triangles)
        };
        assert_eq!(places(&found.mesh), places(&mesh), "{parts} parts");
        assert!(found.inverted.is_empty() && found.notes.is_empty(), "{:?}", found.notes);
    }
}

#[test]
fn classes_are_found_where_patches_meet() {
    let cube = lattice_cube(3);
    let names = Names {
        bodies: vec![Label::new(1, "b")],
        patches: (1..=6).map(|k| Label::new(k, format!("s{k}"))).collect(),
    };
    let found = written(&cube, &names, "m.msh").mesh;
    let count = |wanted: fn(&Class) -> bool| found.classes.iter().filter(|class| wanted(class)).count();
    assert_eq!(count(|c| matches!(c, Class::Corner(_))), 8);
    assert_eq!(count(|c| matches!(c, Class::Curve(_))), 12 * 2);
    assert_eq!(count(|c| matches!(c, Class::Patch(_))), 6 * 4);
    assert_eq!(count(|c| matches!(c, Class::Body(_))), 8);
    let curves: std::collections::BTreeSet<_> = found.segments.iter().map(|s| s.curve).collect();
    assert_eq!(curves.len(), 12);
}

#[test]
fn gmsh_2_is_read_as_text_with_any_ids() {
    let found = reads_two_tets("m.msh", MSH22);
    assert_eq!(found.names.bodies[0].name().unwrap(), "body a");
    assert_eq!(found.names.patches[0].name().unwrap(), "skin");
    // The edge between the first two vertices is a curve of the file.
    assert_eq!(found.mesh.segments.len(), 1);
    assert_eq!(found.notes, Vec::<String>::new());
}

#[test]
fn gmsh_2_is_read_in_both_orders_of_bytes() {
    for big in [false, true] {
        let mut file = b"$MeshFormat\n2.2 1 8\n".to_vec();
        let int =
            |file: &mut Vec<u8>, n: i32| file.extend(if big { n.to_be_bytes() } else { n.to_le_bytes() });
        int(&mut file, 1);
        file.extend(b"\n$EndMeshFormat\n$Nodes\n5\n");
        for (k, p) in (1..).zip(two_tets().points) {
            int(&mut file, k);
            p.iter().for_each(|x| file.extend(if big { x.to_be_bytes() } else { x.to_le_bytes() }));
        }
        file.extend(b"\n$EndNodes\n$Elements\n8\n");
        [2, 6, 2].into_iter().for_each(|n| int(&mut file, n));
        for triangle in two_tets().triangles {
            [1, 5, 1].into_iter().for_each(|n| int(&mut file, n));
            triangle.vertices.iter().for_each(|v| int(&mut file, v.0 as i32 + 1));
        }
        [4, 2, 2].into_iter().for_each(|n| int(&mut file, n));
        for tet in two_tets().tets {
            [1, 7, 1].into_iter().for_each(|n| int(&mut file, n));
            tet.iter().for_each(|v| int(&mut file, v.0 as i32 + 1));
        }
        file.extend(b"\n$EndElements\n");
        reads_two_tets("m.msh", &file);
        file.truncate(file.len() - 40);
        let said = read_as("m.msh", &file).unwrap_err();
        assert!(said.contains("cut off") || said.contains("file ends"), "{said}");
    }
}

#[test]
fn gmsh_4_is_read_as_text() {
    let found = reads_two_tets("m.msh", MSH41);
    assert_eq!(found.names.bodies[0].name().unwrap(), "body");
}

#[test]
fn gmsh_4_is_read_in_binary() {
    reads_two_tets("m.msh", msh41_binary());
}

#[test]
fn triangles_between_partitions_of_gmsh_are_left_out() {
    // Both tets are parts of volume 1; their common face is an entity whose parent is that volume.
    let text = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Entities\n0 0 0 1\n1 0 0 0 1 1 1 1 7 0\n$EndEntities\n\
        $PartitionedEntities\n2 0\n0 0 1 2\n9 3 1 2 1 2 0 0 0 1 1 1 0 0\n\
        5 3 1 1 1 0 0 0 1 1 1 1 7 0\n6 3 1 1 2 0 0 0 1 1 1 1 7 0\n$EndPartitionedEntities\n\
        $Nodes\n1 5 1 5\n3 5 0 5\n1\n2\n3\n4\n5\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 1\n$EndNodes\n\
        $Elements\n3 3 1 3\n2 9 2 1\n1 2 3 4\n3 5 4 1\n2 1 2 3 4\n3 6 4 1\n3 2 3 4 5\n$EndElements\n";
    let found = read_as("m.msh", text).unwrap();
    assert_eq!(found.names.bodies, [Label::unnamed(7)]);
    assert_eq!(found.mesh.triangles.len(), 6);
    assert_eq!(found.notes[0], "1 triangles between partitions left out");
}

#[test]
fn negative_netgen_tets_are_reversed_with_a_note() {
    let found = reads_two_tets("m.vol", VOL);
    assert_eq!(found.notes, ["all 2 tets stored in negative orientation turned round"]);
    assert_eq!(found.names.bodies[0].name().unwrap(), "points");
    assert_eq!(found.names.patches[0].name().unwrap(), "skin of it");
    assert_eq!(found.mesh.segments.len(), 1);
}

#[test]
fn a_compressed_netgen_mesh_is_read() {
    use std::io::Write;
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    encoder.write_all(VOL.as_bytes()).unwrap();
    let content = encoder.finish().unwrap();
    reads_two_tets("m.vol.gz", &content);
    assert!(read_as("m.vol.gz", &content[..content.len() / 2]).unwrap_err().starts_with("cannot read"));
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    encoder.write_all(&vec![b'\n'; 1 << 22]).unwrap();
    refused("m.vol.gz", encoder.finish().unwrap(), "", "more than 256 times its size");
}

#[test]
fn medit_is_read_as_text_and_in_four_binary_versions() {
    reads_two_tets("m.mesh", MEDIT);
    reads_two_tets("m.mesh", MEDIT.replace("End\n", ""));
    for version in 1..=4 {
        for big in [false, true] {
            reads_two_tets("m.meshb", meshb(version, big));
        }
    }
}

#[test]
fn tetgen_files_are_read_together() {
    let files = [("m.1.ele", ELE.as_bytes()), ("m.1.node", NODE.as_bytes()), ("m.1.face", FACE.as_bytes())];
    for first in 0..3 {
        let mut files = files;
        files.swap(0, first);
        let found = read_all(&files).unwrap();
        assert_same(&found.mesh, &Mesh { triangles: found.mesh.triangles.clone(), ..two_tets() });
        assert_eq!(found.mesh.triangles.len(), 6);
        assert_eq!(found.names.patches, [Label::unnamed(5)]);
        assert_eq!(found.names.bodies, [Label::unnamed(7)]);
    }
    let found = read_all(&files[..2]).unwrap();
    assert!(found.notes[0].ends_with("m.1.face: no boundary numbers"), "{:?}", found.notes);
    assert_eq!(found.names.patches, [Label::unnamed(1)]);
    assert!(read_all(&files[..1]).unwrap_err().contains("m.1.node"));
    let error =
        read_all(&[("m.ele", b"2 4 0\n1 0 1 2 3\n2 1 2 3 5\n"), ("m.node", NODE.as_bytes())]).unwrap_err();
    assert!(error.starts_with("m.ele:3: there is no vertex 5"), "{error}");
}

#[test]
fn vtu_is_read_however_its_arrays_are_stored() {
    for stored in ALL_STORED {
        eprintln!("{stored:?}");
        reads_two_tets("m.vtu", vtu(stored));
    }
}

#[test]
fn broken_vtu_files_are_refused() {
    let file = String::from_utf8(vtu(Stored::Inline)).unwrap();
    refused("m.vtu", file.replace("UnstructuredGrid\"", "PolyData\""), ":3", "type PolyData");
    refused(
        "m.vtu",
        file.replace("byte_order", "compressor=\"vtkLZ4DataCompressor\" byte_order"),
        ":3",
        "LZ4",
    );
    refused("m.vtu", file.replace("Name=\"offsets\"", "Name=\"o\""), "", "no array offsets in Cells");
    refused("m.vtu", file.replace("</Piece>", "</Piece>\n<Piece/>"), ":22", "several pieces");
    refused("m.vtu", "<VTKFile/>", "", "no piece");
    let raw = vtu(Stored::AppendedRaw);
    refused("m.vtu", &raw[..raw.len() - 100], ":*", "cut off");
    let text = String::from_utf8(vtu(Stored::Text)).unwrap();
    refused("m.vtu", text.replace("10  10", "12  12"), ":12", "cell 6 is a hexahedron");
    refused("m.vtu", text.replace("22  26", "22  99"), ":9", "offsets up to 99 need 99");
}

#[test]
fn broken_files_are_refused_with_their_place() {
    refused("m.msh", MSH22.replace("9 4 2 7 1 10 20 30 40", "9 4 2 7 1 10 20 30 99"), ":30", "no node 99");
    refused("m.msh", MSH22.replace("9 4 2 7 1 10 20 30 40", "9 5 2 7 1 1 2 3 4 5 6 7 8"), ":30", "no node 1");
    refused("m.msh", MSH22.replace("2.2 0", "1.0 0"), ":2", "version 1.0 is not read");
    refused("m.msh", MSH22.replace("\n5\n10", "\n500000\n10"), ":10", "500000 nodes are announced");
    refused("m.msh", &MSH22[..MSH22.len() - 30], ":31", "4 tags are announced");
    refused("m.msh", MSH22.replace("20 1 0 0", "10 1 0 0"), "", "node 10 is there twice");
    refused("m.msh", "hello", ":1", "expected `$MeshFormat`");
    refused(
        "m.vol",
        VOL.replace("7 4 3 2 4 5", "7 4 3 2 4 6"),
        "",
        "tetrahedron 2 names vertex 6, and the file has 5",
    );
    refused(
        "m.vol",
        VOL.replace("7 4 3 2 4 5", "7 5 3 2 4 5 1"),
        ":19",
        "volume element that is not a tetrahedron",
    );
    refused("m.vol", &VOL[..VOL.len() - 200], "*", "");
    refused("m.vol", "mesh\n", ":1", "expected `mesh3d`");
    refused("m.mesh", MEDIT.replace("2 3 4 5 7", "2 3 4 4 7"), "", "tetrahedron 2 has the same vertex twice");
    refused("m.mesh", MEDIT.replace("2 3 4 5 7", "2 3 4 0 7"), ":30", "no vertex 0");
    refused("m.mesh", MEDIT.replace("Dimension\n3", "Dimension 2"), ":3", "dimension 2");
    refused(
        "m.mesh",
        MEDIT.replace("Tetrahedra\n2\n", "Hexahedra\n1\n1 2 3 4 5 5 5 5 "),
        ":29",
        "hexahedron",
    );
    refused(
        "m.mesh",
        MEDIT
            .replace("1 2 3 4 7\n2 3 4 5 7", "1 2 3 4 7 1 2 3 5 7 1 2 3 4 7")
            .replace("Tetrahedra\n2", "Tetrahedra\n3"),
        "",
        "the tetrahedra 1 and 3 have the same four vertices",
    );
    let crowded = MEDIT.replace("5\n0 0 0 1", "6\n0 0 0 1").replace("Corners", "2 2 2 1\nCorners");
    let crowded = crowded.replace("Tetrahedra\n2", "Tetrahedra\n3\n2 3 4 6 7");
    refused("m.mesh", crowded, "", "more than two tetrahedra have the same face");
    refused("m.mesh", "MFEM mesh v1.0\n", ":1", "MFEM");
    refused("m.mesh", MEDIT.split("Triangles").next().unwrap(), "", "no tetrahedra");
    let mut cyclic = meshb(2, false);
    cyclic[12..16].copy_from_slice(&8_u32.to_le_bytes());
    refused("m.meshb", cyclic, ", byte 12", "invalid position of the next block: byte 8");
    refused("m.meshb", &meshb(3, false)[..100], ", byte *", "");
    refused("m.meshb", b"abcdefgh", ", byte 0", "not a binary Medit mesh");
    let said = read_as("m.cgns", "x").unwrap_err();
    assert!(said.contains(".meshb") && said.contains("Elmer"), "{said}");
}

#[test]
fn a_tet_twice_is_refused_with_the_numbers_of_both() {
    // Alone, and in a mesh.
    let alone = MSH22.replace("10 4 4 7 1 1 1 20 30 40 41", "10 4 2 7 1 20 10 30 40");
    refused("m.msh", alone, "", "the tetrahedra 9 and 10 have the same four vertices, the first of them at");
    let third = "$Elements\n11\n99 4 2 7 1 20 30 40 41\n";
    refused("m.msh", MSH22.replace("$Elements\n10\n", third), "", "the tetrahedra 99 and 10 have");
    let text = MSH41.replace("8 2 3 4 5\n", "8 4 3 2 1\n");
    refused("m.msh", text, "", "the tetrahedra 7 and 8 have");
    let ele = ("m.ele", &b"2 4 0\n5 0 1 2 3\n6 3 2 1 0\n"[..]);
    let said = read_all(&[ele, ("m.node", NODE.as_bytes())]).unwrap_err();
    assert!(said.contains("the tetrahedra 5 and 6 have"), "{said}");
    let found = crate::error::Error::from(read(Path::new("none.msh")).unwrap_err());
    assert_eq!(crate::ground::error::HasKind::kind(&found), crate::ground::error::ErrorKind::Input);
}

#[test]
fn coordinates_without_a_mesh_are_refused_with_their_line() {
    for number in ["1e999", "-1e999", "1e61"] {
        refused("m.msh", MSH22.replace("20 1 0 0", &format!("20 {number} 0 0")), ":12", "a");
        refused("m.msh", MSH41.replace("\n1 0 0 0.5", &format!("\n{number} 0 0 0.5")), ":22", "a");
        refused("m.vol", VOL.replace("\n1 0 0\n0 1", &format!("\n{number} 0 0\n0 1")), ":26", "a");
        refused("m.mesh", MEDIT.replace("1 0 0 1", &format!("{number} 0 0 1")), ":9", "a");
        let node = NODE.replace("1 1 0 0", &format!("1 {number} 0 0"));
        refused("m.node", node, ":3", "a");
        let text = String::from_utf8(vtu(Stored::Text)).unwrap();
        refused("m.vtu", text.replacen(" 1.0", &format!(" {number}"), 1), ":6", "the array `Points`");
    }
    for version in [1, 2] {
        let mut file = meshb(version, false);
        let one = if version == 1 { 1_f32.to_le_bytes().to_vec() } else { 1_f64.to_le_bytes().to_vec() };
        let at = file.windows(one.len()).position(|w| w == one).unwrap();
        // The largest exponent: infinity.
        let end = at + one.len();
        file[end - 2..end].copy_from_slice(if version == 1 { &[0x80, 0x7f] } else { &[0xf0, 0x7f] });
        refused("m.meshb", file, &format!(", byte {at}"), "not a finite number");
    }
}

#[test]
fn elmer_coordinates_without_a_mesh_are_refused_with_their_line() {
    let (mesh, names) = two_bodies();
    let dir = tempfile::tempdir().unwrap();
    elmer::write(&thread::alone(), &PlainPart::whole(&mesh), &names, dir.path()).unwrap();
    let path = dir.path().join("mesh.nodes");
    let text = fs::read_to_string(&path).unwrap();
    let mut lines: Vec<String> = text.lines().map(String::from).collect();
    for number in ["1e999", "nan", "1e61"] {
        lines[4] = format!("5 -1 {number} 0 0");
        fs::write(&path, lines.join("\n")).unwrap();
        let said = read(dir.path()).unwrap_err().to_string();
        assert!(said.contains("nodes:5: a coordinate is"), "{said}");
    }
}

#[test]
fn endings_in_upper_case_are_those_of_their_formats() {
    reads_two_tets("M.MSH", MSH22);
    reads_two_tets("M.Mesh", MEDIT);
    reads_two_tets("M.VTU", vtu(Stored::Inline));
    let upper = [("M.ELE", ELE.as_bytes()), ("M.NODE", NODE.as_bytes()), ("M.FACE", FACE.as_bytes())];
    assert_eq!(read_all(&upper).unwrap().names.patches, [Label::unnamed(5)]);
    let (mesh, names) = two_bodies();
    for name in ["M.MSH", "M.MESH", "M.VOL", "M.VTU"] {
        assert_eq!(written(&mesh, &names, name).mesh.tets.len(), mesh.tets.len(), "{name}");
    }
    assert_eq!(written(&mesh, &names, "M.VTU").names, names);
}

#[test]
fn numbers_at_the_end_of_their_range_do_not_overflow() {
    let most = i64::MAX;
    let segment = VOL
        .replace("edgesegmentsgi2\n1\n1 0 1 2 -1 -1 1 2 3 0 3 1.5", "edgesegmentsgi3\n1\n1 2 0 0 0 0 1e30");
    read_as("m.vol", segment).unwrap();
    read_as("m.mesh", MEDIT.replace("1 3 2 5\n", &format!("1 3 2 {most}\n"))).unwrap();
    read_as("m.mesh", MEDIT.replace("1 3 2 5\n1 2 4 5\n", &format!("1 3 2 {most}\n1 3 2 5\n"))).unwrap();
}

#[test]
fn tets_in_arbitrary_vertex_order_are_reversed_and_inverted_ones_kept() {
    let mesh = lattice_cube(3);
    let text = |mesh: &Mesh| {
        let mut text = format!("MeshVersionFormatted 2\nDimension 3\nVertices {}\n", mesh.points.len());
        mesh.points.iter().for_each(|p| text += &format!("{} {} {} 0\n", p.x, p.y, p.z));
        text += &format!("Tetrahedra {}\n", mesh.tets.len());
        mesh.tets.iter().for_each(|t| {
            text += &format!("{} {} {} {} 1\n", t[0].0 + 1, t[1].0 + 1, t[2].0 + 1, t[3].0 + 1)
        });
        text
    };
    let mut careless = mesh.clone();
    careless.tets.iter_mut().step_by(3).for_each(|t| t.swap(1, 2));
    let found = read_as("m.mesh", text(&careless)).unwrap();
    assert_eq!((found.turned, found.inverted.len()), (mesh.tets.len() / 3, 0));
    assert!(found.notes.iter().any(|note| note.starts_with("54 tets stored in negative orientation")));

    // An inner vertex moved beyond the opposite faces of some of its tets.
    let mut folded = mesh.clone();
    let inner = folded.classes.iter().position(|class| matches!(class, Class::Body(_))).unwrap();
    folded.points[inner] += crate::Vector::new(0.9, 0.1, 0.2);
    let is_bad = |t: &[VertexId; 4]| {
        let [a, b, c, d] = t.map(|v| &folded.points[v.index()]);
        orient3d(a, b, c, d) != Sign::Positive
    };
    let expected = folded.tets.iter().filter(|t| is_bad(t)).count();
    assert!(expected > 0);
    for swap in [false, true] {
        let mut folded = folded.clone();
        if swap {
            folded.tets.iter_mut().for_each(|t| t.swap(0, 1));
        }
        let found = read_as("m.mesh", text(&folded)).unwrap();
        assert_eq!(found.inverted.len(), expected);
        assert_eq!(found.turned, if swap { mesh.tets.len() } else { 0 });
    }
}

#[test]
fn missing_data_is_completed_with_notes() {
    // No triangles, two bodies, one of them without number; unused vertices; edges inside.
    let text = "MeshVersionFormatted 2\nDimension 3\nVertices 7\n9 9 9 0\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\n1 1 1 0\n8 8 8 0\n\
        Edges 1\n1 2 3\nTriangles 3\n3 4 5 4\n2 3 4 6\n2 3 6 6\nTetrahedra 2\n2 3 4 5 3\n3 4 5 6 0\nEnd\n";
    let found = read_as("m.mesh", text).unwrap();
    assert_eq!(found.mesh.points.len(), 5);
    assert_eq!(found.names.bodies, [Label::unnamed(4), Label::unnamed(3)]);
    let numbers: Vec<u32> =
        found.mesh.triangles.iter().map(|t| found.names.patches[t.patch.index()].number).collect();
    assert_eq!(numbers, [4, 6, 7, 7, 7, 7, 7]);
    assert_eq!(
        found.notes,
        [
            "2 vertices that no tet uses left out, with 1 triangle or edge on them",
            "1 triangle that are not faces of tets left out",
            "5 faces on the outside without triangle in the file are a boundary of their own",
        ]
    );
    // The mesh can be written and partitioned: every triangle has its tets behind and in front of
    // it.
    let part = PlainPart::whole(&found.mesh);
    let dir = tempfile::tempdir().unwrap();
    elmer::write(&thread::alone(), &part, &found.names, dir.path()).unwrap();
    for (layout, faults) in elmer::check_elmer(dir.path()).unwrap() {
        assert!(faults.is_empty(), "{layout:?}\n{faults}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig {
        rng_seed: proptest::test_runner::RngSeed::Fixed(1),
        failure_persistence: None,
        cases: 500,
        ..Default::default()
    })]

    #[test]
    fn damaged_files_never_panic(
        sample in 0..15_usize,
        cut in 0.0..1.0,
        changes in prop::collection::vec((0.0..1.0, any::<u8>()), 0..6),
        digits in any::<bool>(),
    ) {
        let (name, mut content) = samples().swap_remove(sample);
        for (place, byte) in changes {
            let place = (place * content.len() as f64) as usize;
            content[place] = if digits { b'0' + byte % 10 } else { byte };
        }
        if cut > 0.5 {
            content.truncate((2.0 * (cut - 0.5) * content.len() as f64) as usize);
        }
        match read_as(name, &content) {
            Ok(found) => {
                let mesh = &found.mesh;
                prop_assert_eq!((mesh.classes.len(), mesh.bodies.len()), (mesh.points.len(), mesh.tets.len()));
                prop_assert!(mesh.points.iter().all(|p: &Point| p.iter().all(|x| x.is_finite())));
                if found.inverted.is_empty() {
                    let part = PlainPart::whole(mesh);
                    prop_assert_eq!(crate::ground::mesh::stream::MeshStream::counts(&part).tets, mesh.tets.len() as u64);
                }
            }
            Err(said) => prop_assert!(said.len() > 10),
        }
    }

    #[test]
    fn random_bytes_never_panic(
        ending in prop::sample::select(vec!["msh", "vol", "vol.gz", "mesh", "meshb", "vtu", "node"]),
        content in prop::collection::vec(any::<u8>(), 1..300),
    ) {
        let _ = read_as(&format!("m.{ending}"), content);
    }
}

#[test]
fn names_of_two_tets_survive_gmsh() {
    let found = written(&two_tets(), &names(), "m.msh");
    assert_eq!(found.names.bodies, [Label::new(1, "lower")]);
    assert_eq!(found.names.patches, [Label::new(1, "skin"), Label::new(2, "lid")]);
}
