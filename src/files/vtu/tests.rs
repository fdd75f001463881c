//! Tests of VTU files, with a minimal parser of the frame; ParaView reads the same files.

use super::*;
use crate::files::plain::PlainPart;
use crate::files::testing::{cube, names, scattered, slabs, together, two_tets};
use crate::ground::mesh::{Mesh, Rank};
use std::collections::BTreeMap;

fn write_parts(mesh: &Mesh, tet_to_rank: &[Rank], ranks: u32, stem: &Path) -> Written {
    let results = together(ranks, |comm| {
        write(comm, &PlainPart::part(mesh, tet_to_rank, ranks, comm.rank()), &names(), stem)
    });
    results.into_iter().map(Result::unwrap).last().unwrap()
}

/// The value of an attribute in a tag.
fn attribute<'a>(tag: &'a str, name: &str) -> &'a str {
    let start =
        tag.find(&format!(" {name}=\"")).unwrap_or_else(|| panic!("{name} in {tag}")) + name.len() + 3;
    tag[start..].split('"').next().unwrap()
}

/// The arrays of a `.vtu` file as numbers, with a check of every offset and length.
fn arrays(path: &Path) -> BTreeMap<String, Vec<f64>> {
    let bytes = fs::read(path).unwrap();
    let marker = b"<AppendedData encoding=\"raw\">\n_";
    let data = bytes.windows(marker.len()).position(|w| w == marker).unwrap() + marker.len();
    let head = std::str::from_utf8(&bytes[..data]).unwrap();
    let mut arrays = BTreeMap::new();
    let mut end = 0;
    let is_raw = |tag: &&str| tag.starts_with("DataArray") && tag.contains("appended");
    for tag in head.split('<').filter(is_raw) {
        let offset: usize = attribute(tag, "offset").parse().unwrap();
        assert_eq!(offset, end, "arrays stand behind each other: {tag}");
        let len = u64::from_le_bytes(bytes[data + offset..][..8].try_into().unwrap()) as usize;
        let values = &bytes[data + offset + 8..][..len];
        end = offset + 8 + len;
        let numbers: Vec<f64> = match attribute(tag, "type") {
            "UInt8" => values.iter().map(|&b| f64::from(b)).collect(),
            "Int32" => values.as_chunks().0.iter().map(|&b| f64::from(i32::from_le_bytes(b))).collect(),
            "Int64" => values.as_chunks().0.iter().map(|&b| i64::from_le_bytes(b) as f64).collect(),
            "Float64" => values.as_chunks().0.iter().map(|&b| f64::from_le_bytes(b)).collect(),
            other => panic!("{other}"),
        };
        let name = attribute(tag, "Name").to_string();
        // Points and cells may both have an array of this name.
        let name = if arrays.contains_key(&name) { format!("{name} of cells") } else { name };
        arrays.insert(name, numbers);
    }
    assert_eq!(&bytes[data + end..], b"\n </AppendedData>\n</VTKFile>\n");
    let piece = head.split('<').find(|tag| tag.starts_with("Piece")).unwrap();
    let count = |name: &str| attribute(piece, name).parse::<usize>().unwrap();
    assert_eq!(arrays["Points"].len(), 3 * count("NumberOfPoints"));
    assert_eq!(arrays["types"].len(), count("NumberOfCells"));
    arrays
}

#[test]
#[cfg(target_endian = "little")]
fn two_tets_are_written_to_the_letter() {
    let dir = tempfile::tempdir().unwrap();
    let written = write_parts(&two_tets(), &[0, 0], 1, &dir.path().join("m.vtu"));
    let bytes = fs::read(dir.path().join("m.vtu")).unwrap();
    let head = "<?xml version=\"1.0\"?>\n\
        <VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n \
        <UnstructuredGrid>\n  <!-- <FieldData>\n   \
        <DataArray type=\"Int32\" Name=\"Body lower\" NumberOfTuples=\"1\" format=\"ascii\">1</DataArray>\n   \
        <DataArray type=\"Int32\" Name=\"Body upper\" NumberOfTuples=\"1\" format=\"ascii\">2</DataArray>\n  \
        </FieldData> -->\n  <Piece NumberOfPoints=\"5\" NumberOfCells=\"2\">\n   \
        <Points>\n    \
        <DataArray type=\"Float64\" Name=\"Points\" NumberOfComponents=\"3\" format=\"appended\" offset=\"0\"/>\n   \
        </Points>\n   <Cells>\n    \
        <DataArray type=\"Int32\" Name=\"connectivity\" format=\"appended\" offset=\"128\"/>\n    \
        <DataArray type=\"Int32\" Name=\"offsets\" format=\"appended\" offset=\"168\"/>\n    \
        <DataArray type=\"UInt8\" Name=\"types\" format=\"appended\" offset=\"184\"/>\n   \
        </Cells>\n   <PointData GlobalIds=\"GlobalNodeId\">\n    \
        <DataArray type=\"Int64\" Name=\"GlobalNodeId\" format=\"appended\" offset=\"194\"/>\n   \
        </PointData>\n   <CellData Scalars=\"material\" GlobalIds=\"GlobalElementId\">\n    \
        <DataArray type=\"Int32\" Name=\"material\" format=\"appended\" offset=\"242\"/>\n    \
        <DataArray type=\"Int64\" Name=\"GlobalElementId\" format=\"appended\" offset=\"258\"/>\n    \
        <DataArray type=\"Int32\" Name=\"BodyId\" format=\"appended\" offset=\"282\"/>\n    \
        <DataArray type=\"Int32\" Name=\"PartitionId\" format=\"appended\" offset=\"298\"/>\n   \
        </CellData>\n  </Piece>\n </UnstructuredGrid>\n <AppendedData encoding=\"raw\">\n_";
    assert_eq!(String::from_utf8_lossy(&bytes[..head.len()]), head);
    assert_eq!(bytes.len(), head.len() + 298 + 16 + "\n </AppendedData>\n</VTKFile>\n".len());
    let tets = arrays(&dir.path().join("m.vtu"));
    assert_eq!(tets["Points"][3..9], [1., 0., 0., 0., 1., 0.]);
    assert_eq!(tets["connectivity"], [0., 1., 2., 3., 1., 2., 3., 4.]);
    assert_eq!(tets["offsets"], [4., 8.]);
    assert_eq!(tets["types"], [10., 10.]);
    assert_eq!(tets["GlobalNodeId"], [0., 1., 2., 3., 4.]);
    assert_eq!(tets["GlobalElementId"], [0., 1.]);
    assert_eq!([&tets["BodyId"], &tets["material"], &tets["PartitionId"]], [&vec![1., 1.]; 3]);
    let triangles = arrays(&dir.path().join("m.boundary.vtu"));
    assert_eq!(triangles["connectivity"][..6], [0., 2., 1., 0., 1., 3.]);
    assert_eq!(triangles["offsets"], [3., 6., 9., 12., 15., 18.]);
    assert_eq!(triangles["types"], [5.; 6]);
    assert_eq!(triangles["BoundaryId"], [1., 1., 1., 2., 2., 2.]);
    let length = fs::metadata(dir.path().join("m.boundary.vtu")).unwrap().len();
    assert_eq!(written, Written { files: 2, bytes: bytes.len() as u64 + length });
}

#[test]
#[cfg(target_endian = "little")]
fn the_pieces_of_a_cube_make_the_cube() {
    let mesh = cube(4);
    for (ranks, tet_to_rank) in [(2, slabs(&mesh, 2)), (3, scattered(&mesh, 3))] {
        let dir = tempfile::tempdir().unwrap();
        write_parts(&mesh, &tet_to_rank, ranks, &dir.path().join("a&b"));
        let (mut tet_ids, mut vertex_ids, mut areas) = (Vec::new(), Vec::new(), [0; 4]);
        for part in 1..=ranks {
            let tets = arrays(&dir.path().join(format!("a&b.parts/part.{part}.vtu")));
            for (k, &tet) in tets["GlobalElementId"].iter().enumerate() {
                let vertices = mesh.tets[tet as usize].map(|v| f64::from(v.0));
                let found = &tets["connectivity"][4 * k..4 * k + 4];
                assert!(found.iter().map(|&v| tets["GlobalNodeId"][v as usize]).eq(vertices));
                assert_eq!(tets["BodyId"][k], f64::from(mesh.bodies[tet as usize].0 + 1));
                tet_ids.push(tet as usize);
            }
            for (k, &vertex) in tets["GlobalNodeId"].iter().enumerate() {
                assert_eq!(tets["Points"][3 * k..][..3], mesh.points[vertex as usize].coords.as_slice()[..]);
                if tets["vtkGhostType"][k] == 0.0 {
                    vertex_ids.push(vertex as usize);
                }
            }
            let triangles = arrays(&dir.path().join(format!("a&b.parts/boundary.{part}.vtu")));
            for (number, _) in
                triangles["BoundaryId"].iter().zip(&triangles["vtkGhostType"]).filter(|(_, g)| **g == 0.)
            {
                areas[*number as usize] += 1;
            }
        }
        tet_ids.sort_unstable();
        vertex_ids.sort_unstable();
        assert!(tet_ids.into_iter().eq(0..384), "each tet stands in one piece");
        assert!(vertex_ids.into_iter().eq(0..125), "each vertex has one copy that is no ghost");
        assert_eq!(areas, [0, 96, 96, 32], "each triangle has one copy that is no ghost");
        let list = fs::read_to_string(dir.path().join("a&b.pvtu")).unwrap();
        assert!(list.contains(&format!("<Piece Source=\"a&amp;b.parts/part.{ranks}.vtu\"/>")), "{list}");
        assert!(list.contains("<PDataArray type=\"UInt8\" Name=\"vtkGhostType\"/>"), "{list}");
    }
}

#[test]
fn ghosts_are_marked_and_name_their_owner() {
    let dir = tempfile::tempdir().unwrap();
    let mesh = two_tets();
    together(2, |comm| {
        let part = PlainPart::part(&mesh, &[0, 1], 2, comm.rank());
        let ghosts = crate::parallel::halo::halo(comm, &part, crate::parallel::halo::By::Faces).unwrap();
        write(comm, &crate::parallel::halo::WithHalo::new(&part, &ghosts), &names(), &dir.path().join("m"))
            .unwrap();
    });
    // Vertices 1 and 3 belong to rank 1, vertex 2 to rank 0.
    for (part, ids, copies) in
        [(1, [0., 1., 2., 3., 4.], [0., 1., 0., 1., 1.]), (2, [1., 2., 3., 4., 0.], [0., 1., 0., 0., 1.])]
    {
        let tets = arrays(&dir.path().join(format!("m.parts/part.{part}.vtu")));
        assert_eq!(tets["GlobalNodeId"], ids);
        assert_eq!(tets["vtkGhostType"], copies);
        assert_eq!(tets["vtkGhostType of cells"], [0., 1.]);
        let (own, other) = (f64::from(part), f64::from(3 - part));
        assert_eq!(tets["PartitionId"], [own, other]);
        assert_eq!(tets["GlobalElementId"], [own - 1., other - 1.]);
        let by_id = |tet: usize| {
            let mut corners = tets["connectivity"][4 * tet..][..4].to_vec();
            corners.iter_mut().for_each(|v| *v = ids[*v as usize]);
            corners
        };
        for tet in [0, 1] {
            let expected = mesh.tets[tets["GlobalElementId"][tet] as usize].map(|v| f64::from(v.0));
            assert_eq!(by_id(tet), expected);
        }
        let triangles = arrays(&dir.path().join(format!("m.parts/boundary.{part}.vtu")));
        assert_eq!(triangles["PartitionId"], [own; 3]);
    }
    let list = fs::read_to_string(dir.path().join("m.pvtu")).unwrap();
    assert!(list.contains("GhostLevel=\"1\""), "{list}");
}

#[test]
#[cfg(target_endian = "little")]
fn triangles_follow_the_tets_in_one_file_on_request() {
    let dir = tempfile::tempdir().unwrap();
    let mesh = two_tets();
    write_with(
        &crate::ground::comm::thread::alone(),
        &PlainPart::whole(&mesh),
        &names(),
        &dir.path().join("m.vtu"),
        Boundary::In,
    )
    .unwrap();
    let cells = arrays(&dir.path().join("m.vtu"));
    assert_eq!(cells["connectivity"][..14], [0., 1., 2., 3., 1., 2., 3., 4., 0., 2., 1., 0., 1., 3.]);
    assert_eq!(cells["offsets"], [4., 8., 11., 14., 17., 20., 23., 26.]);
    assert_eq!(cells["types"], [10., 10., 5., 5., 5., 5., 5., 5.]);
    assert_eq!(cells["BodyId"], [1., 1., 0., 0., 0., 0., 0., 0.]);
    assert_eq!(cells["BoundaryId"], [0., 0., 1., 1., 1., 2., 2., 2.]);
    assert_eq!(cells["PartitionId"], [1.; 8]);
    assert_eq!(cells["GlobalElementId"], [0., 1., -1., -1., -1., -1., -1., -1.]);
    assert!(!dir.path().join("m.boundary.vtu").exists());
    let text = fs::read(dir.path().join("m.vtu")).unwrap();
    let text = String::from_utf8_lossy(&text);
    assert!(
        text.contains("\n  <FieldData>\n") && text.contains("Name=\"Boundary lid\""),
        "fields are no comment"
    );
}

#[test]
#[cfg(target_endian = "little")]
fn copies_of_triangles_in_mixed_files_are_marked() {
    let dir = tempfile::tempdir().unwrap();
    let mesh = cube(4);
    together(3, |comm| {
        let part = PlainPart::part(&mesh, &scattered(&mesh, 3), 3, comm.rank());
        write_with(comm, &part, &names(), &dir.path().join("m"), Boundary::In).unwrap();
    });
    let mut counts = [0; 4];
    for part in 1..=3 {
        let cells = arrays(&dir.path().join(format!("m.parts/part.{part}.vtu")));
        for (number, copy) in cells["BoundaryId"].iter().zip(&cells["vtkGhostType of cells"]) {
            counts[*number as usize] += usize::from(*copy == 0.0);
        }
        assert!(
            cells["BodyId"].iter().zip(&cells["types"]).all(|(body, kind)| (*body > 0.0) == (*kind == 10.0))
        );
    }
    assert_eq!(counts, [384, 96, 96, 32]);
    assert!(!dir.path().join("m.boundary.pvtu").exists());
}

#[test]
fn the_main_name_of_each_number_comes_first() {
    let label =
        |number, names: &[&str]| Label { number, names: names.iter().map(|n| n.to_string()).collect() };
    let list =
        [label(1, &["wall"]), label(2, &["inlet", "wall"]), label(3, &["a", "inlet", "all"]), label(2, &[])];
    let fields = numbers_by_name("Boundary", &list);
    let names: Vec<&str> = fields.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["Boundary a", "Boundary inlet", "Boundary all", "Boundary wall"]);
    assert_eq!(fields[3].1, [1, 2]);
    let contrary = [label(1, &["a", "b"]), label(2, &["b", "a"])];
    assert_eq!(numbers_by_name("Body", &contrary).len(), 2);
}

#[test]
#[cfg(target_endian = "little")]
fn fields_follow_the_arrays_of_the_mesh() {
    let mesh = cube(4);
    for ranks in [1, 3] {
        let dir = tempfile::tempdir().unwrap();
        let stem = dir.path().join("m.vtu");
        together(ranks, |comm| {
            let part = PlainPart::part(&mesh, &scattered(&mesh, ranks), ranks, comm.rank());
            let arrays = crate::ground::mesh::Arrays::of(&part);
            let heights: Vec<f64> = arrays.points.iter().map(|p| p[2]).collect();
            let centers: Vec<f64> = (0..arrays.tets.len())
                .flat_map(|t| {
                    let corners = arrays.corners(t);
                    [0, 1, 2].map(|axis| corners.iter().map(|c| c[axis]).sum::<f64>() / 4.0)
                })
                .collect();
            let fields = [
                Field { name: "a<b", on: On::Points, values: &heights, components: 1 },
                Field { name: "center", on: On::Cells, values: &centers, components: 3 },
            ];
            write_fields(comm, &part, &names(), &stem, &fields).unwrap();
        });
        let pieces = |kind: &str| -> Vec<_> {
            let of_rank = |rank: u32| match ranks {
                1 => format!("m{kind}.vtu"),
                _ => piece_path("m", if kind.is_empty() { "part" } else { "boundary" }, rank + 1),
            };
            (0..ranks).map(|rank| arrays(&dir.path().join(of_rank(rank)))).collect()
        };
        for piece in pieces("") {
            assert_eq!(
                piece["a&lt;b"],
                piece["Points"].iter().skip(2).step_by(3).copied().collect::<Vec<_>>()
            );
            let corner = |tet: usize, k: usize, axis: usize| {
                piece["Points"][3 * piece["connectivity"][4 * tet + k] as usize + axis]
            };
            assert_eq!(piece["center"].len(), 3 * piece["types"].len());
            for (k, &value) in piece["center"].iter().enumerate() {
                assert_eq!(value, (0..4).map(|c| corner(k / 3, c, k % 3)).sum::<f64>() / 4.0);
            }
        }
        for piece in pieces(".boundary") {
            assert_eq!(
                piece["a&lt;b"],
                piece["Points"].iter().skip(2).step_by(3).copied().collect::<Vec<_>>()
            );
            assert!(!piece.contains_key("center"));
        }
        if ranks > 1 {
            let list = fs::read_to_string(dir.path().join("m.pvtu")).unwrap();
            let declared = "<PDataArray type=\"Float64\" Name=\"center\" NumberOfComponents=\"3\"/>";
            assert!(list.contains(declared) && list.contains("Name=\"a&lt;b\"/>"), "{list}");
        }
    }
}

#[test]
fn fields_that_do_not_fit_are_refused_on_all_ranks() {
    let mesh = two_tets();
    let dir = tempfile::tempdir().unwrap();
    let refusal = |fields: &(dyn Fn(u32) -> Vec<Field<'static>> + Sync)| {
        let errors = together(2, |comm| {
            let part = PlainPart::part(&mesh, &[0, 1], 2, comm.rank());
            write_fields(comm, &part, &names(), &dir.path().join("m"), &fields(comm.rank())).unwrap_err()
        });
        let kinds = errors.iter().map(crate::ground::error::HasKind::kind);
        assert!(kinds.into_iter().all(|kind| kind == crate::ground::error::ErrorKind::Input));
        errors.iter().find(|error| matches!(error, WriteError::Field(_))).unwrap().to_string()
    };
    let field = |name, values| Field { name, on: On::Points, values, components: 1 };
    const FOUR: &[f64] = &[0.0; 4];
    let length = refusal(&|rank| vec![field("u", &FOUR[..if rank == 0 { 4 } else { 3 }])]);
    assert!(
        length.starts_with("the field `u` has 3 values, but rank 1 has 4 vertices, which take 4:"),
        "{length}"
    );
    let cells = refusal(&|_| vec![Field { name: "q", on: On::Cells, values: FOUR, components: 3 }]);
    assert!(cells.contains("has 1 tets, which take 3"), "{cells}");
    assert!(refusal(&|_| vec![field(" ", FOUR)]).contains("cannot name a field"));
    assert!(refusal(&|_| vec![field("a\nb", FOUR)]).contains("cannot name a field"));
    assert!(refusal(&|_| vec![field("BodyId", FOUR)]).contains("gives to an array of the mesh"));
    assert!(
        refusal(&|_| vec![field("u", FOUR), field("u", FOUR)])
            .contains("two fields on vertices have the name `u`")
    );
    assert!(refusal(&|_| vec![Field { components: 0, ..field("u", &[]) }]).contains("a scalar has 1"));
    let differ = refusal(&|rank| vec![field(if rank == 0 { "u" } else { "v" }, FOUR)]);
    assert!(differ.starts_with("rank 1 passes other fields than rank 0"), "{differ}");
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 0);
}

#[test]
fn endings_of_other_formats_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let write_to = |name: &str| {
        let (comm, mesh) = (crate::ground::comm::thread::alone(), two_tets());
        write(&comm, &PlainPart::whole(&mesh), &names(), &dir.path().join(name))
    };
    for name in ["a.vtk", "a.VTK", "a.b.msh"] {
        let error = write_to(name).unwrap_err().to_string();
        assert!(error.starts_with("VTU files end in .vtu or .pvtu, but the path is "), "{error}");
    }
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 0);
    for (name, file) in [("a", "a.vtu"), ("b.pvtu", "b.vtu"), ("run.0001", "run.0001.vtu")] {
        write_to(name).unwrap();
        assert!(dir.path().join(file).exists(), "{name}");
    }
}
