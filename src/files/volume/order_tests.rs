//! Second-order meshes: the corners are kept, with a note.

use super::*;
use crate::files::testing::two_tets;
use crate::ground::mesh::{TET_EDGES, VertexId};
use std::fs;

/// Two tets with ten nodes and their triangles with six, from 0. The order of mid-edge nodes
/// differs between formats but does not matter here.
struct SecondOrder {
    points: Vec<[f64; 3]>,
    tets: Vec<Vec<u32>>,
    triangles: Vec<Vec<u32>>,
}

fn second_order() -> SecondOrder {
    let mesh = two_tets();
    let mut points: Vec<[f64; 3]> = mesh.points.iter().map(|p| [p.x, p.y, p.z]).collect();
    let mut edges: Vec<[VertexId; 2]> = Vec::new();
    let mut middle = |a: VertexId, b: VertexId| {
        let edge = [a.min(b), a.max(b)];
        let place = edges.iter().position(|e| *e == edge).unwrap_or_else(|| {
            let [p, q] = edge.map(|v| mesh.points[v.index()]);
            points.push(nalgebra::center(&p, &q).into());
            edges.push(edge);
            edges.len() - 1
        });
        mesh.points.len() as u32 + place as u32
    };
    let mut nodes = |corners: &[VertexId], edges: &[[usize; 2]]| {
        let mut nodes: Vec<u32> = corners.iter().map(|v| v.0).collect();
        nodes.extend(edges.iter().map(|[a, b]| middle(corners[*a], corners[*b])));
        nodes
    };
    let tets = mesh.tets.iter().map(|t| nodes(t, &TET_EDGES)).collect();
    let triangles = mesh.triangles.iter().map(|t| nodes(&t.vertices, &[[0, 1], [1, 2], [2, 0]])).collect();
    SecondOrder { points, tets, triangles }
}

/// One line for each element: `before` of its index, its nodes from `base`, `after`.
fn lines(elements: &[Vec<u32>], base: u32, before: impl Fn(usize) -> String, after: &str) -> String {
    let mut text = String::new();
    for (k, nodes) in elements.iter().enumerate() {
        text += &before(k);
        nodes.iter().for_each(|v| text += &format!(" {}", v + base));
        text += &format!("{after}\n");
    }
    text
}

fn points(of: &SecondOrder, before: impl Fn(usize) -> String, after: &str) -> String {
    let line = |(k, [x, y, z]): (usize, &[f64; 3])| format!("{}{x} {y} {z}{after}\n", before(k));
    of.points.iter().enumerate().map(line).collect()
}

fn none(_: usize) -> String {
    String::new()
}

/// Reads the first of these files and expects the two tets with body 7 and boundary 5.
#[track_caller]
fn reads_corners(files: &[(&str, String)]) {
    let dir = tempfile::tempdir().unwrap();
    for (name, content) in files {
        fs::write(dir.path().join(name), content).unwrap();
    }
    let first = if files[0].0.starts_with("mesh.") { dir.path().into() } else { dir.path().join(files[0].0) };
    let found = read(&first).unwrap();
    let names: Vec<&str> = files.iter().map(|(name, _)| *name).collect();
    assert_eq!((&found.mesh.points, &found.mesh.tets), (&two_tets().points, &two_tets().tets), "{names:?}");
    assert_eq!(found.mesh.triangles.len(), 6, "{names:?}");
    let numbers = |labels: &[crate::ground::mesh::Label]| labels.iter().map(|l| l.number).collect::<Vec<_>>();
    assert_eq!(
        (numbers(&found.names.bodies), numbers(&found.names.patches)),
        (vec![7], vec![5]),
        "{names:?}"
    );
    let note = "the mesh is of higher order: only the corners of 8 elements are kept";
    assert!(found.notes.iter().any(|n| n.starts_with(note)), "{names:?}: {:?}", found.notes);
}

#[test]
fn gmsh_medit_and_netgen_meshes_of_second_order_keep_their_corners() {
    let mesh = second_order();
    let count = mesh.points.len();
    let id = |k: usize| format!("{} ", k + 1);
    let head = format!("$Nodes\n{count}\n{}$EndNodes\n$Elements\n8\n", points(&mesh, id, ""));
    let elements = lines(&mesh.triangles, 1, |k| format!("{} 9 2 5 1", k + 1), "")
        + &lines(&mesh.tets, 1, |k| format!("{} 11 2 7 1", k + 7), "");
    reads_corners(&[(
        "m.msh",
        format!("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n{head}{elements}$EndElements\n"),
    )]);

    let entities = "$Entities\n0 0 1 1\n1 0 0 0 1 1 1 1 5 0\n1 0 0 0 1 1 1 1 7 0\n$EndEntities\n";
    let ids: String = (1..=count).map(|k| format!("{k}\n")).collect();
    let nodes =
        format!("$Nodes\n1 {count} 1 {count}\n3 1 0 {count}\n{ids}{}$EndNodes\n", points(&mesh, none, ""));
    let elements = format!(
        "$Elements\n2 8 1 8\n2 1 9 6\n{}3 1 11 2\n{}$EndElements\n",
        lines(&mesh.triangles, 1, |k| format!("{}", k + 1), ""),
        lines(&mesh.tets, 1, |k| format!("{}", k + 7), "")
    );
    reads_corners(&[("m.msh", format!("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n{entities}{nodes}{elements}"))]);

    let vertices = format!("Vertices\n{count}\n{}", points(&mesh, none, " 0"));
    let triangles = format!("TrianglesP2\n6\n{}", lines(&mesh.triangles, 1, none, " 5"));
    let medit = format!(
        "MeshVersionFormatted 2\nDimension 3\n{vertices}{triangles}TetrahedraP2\n2\n{}End\n",
        lines(&mesh.tets, 1, none, " 7")
    );
    reads_corners(&[("m.mesh", medit.clone())]);
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("m.mesh");
    fs::write(&path, medit.replace("TrianglesP2", "TetrahedraP2Ordering\n1\n2 0 0 0\nTrianglesP2")).unwrap();
    let said = read(&path).unwrap_err().to_string();
    assert!(said.contains("`TetrahedraP2Ordering` is not read"), "{said}");

    let surface = lines(&mesh.triangles, 1, |_| "1 5 1 0 6".into(), "");
    let volume = lines(&mesh.tets, 1, |_| "7 10".into(), "");
    reads_corners(&[(
        "m.vol",
        format!(
            "mesh3d\ndimension\n3\nsurfaceelements\n6\n{surface}volumeelements\n2\n{volume}points\n{count}\n{}endmesh\n",
            points(&mesh, none, "")
        ),
    )]);
}

#[test]
fn vtu_and_elmer_meshes_of_second_order_keep_their_corners() {
    let mesh = second_order();
    let array = |kind: &str, name: &str, text: String| {
        format!("<DataArray type=\"{kind}\" Name=\"{name}\" format=\"ascii\">{text}</DataArray>")
    };
    let cells = lines(&mesh.triangles, 0, none, "") + &lines(&mesh.tets, 0, none, "");
    let vtu = format!(
        "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid><Piece NumberOfPoints=\"{}\" NumberOfCells=\"8\">\
        <Points>{}</Points><Cells>{}{}{}</Cells><CellData>{}</CellData></Piece></UnstructuredGrid></VTKFile>",
        mesh.points.len(),
        array("Float64", "Points", points(&mesh, none, "")),
        array("Int32", "connectivity", cells),
        array("Int32", "offsets", "6 12 18 24 30 36 46 56".into()),
        array("UInt8", "types", "22 22 22 22 22 22 24 24".into()),
        array("Int32", "medit:ref", "5 5 5 5 5 5 7 7".into()),
    );
    reads_corners(&[("m.vtu", vtu)]);

    let id = |k: usize| format!("{} -1 ", k + 1);
    reads_corners(&[
        ("mesh.header", format!("{} 2 6\n2\n510 2\n306 6\n", mesh.points.len())),
        ("mesh.nodes", points(&mesh, id, "")),
        ("mesh.elements", lines(&mesh.tets, 1, |k| format!("{} 7 510", k + 1), "")),
        ("mesh.boundary", lines(&mesh.triangles, 1, |k| format!("{} 5 {} 0 306", k + 1, 1 + k / 3), "")),
    ]);
}

#[test]
fn tetgens_faces_of_second_order_keep_their_corners_and_markers() {
    let mesh = second_order();
    let node = format!("{} 3 0 0\n{}", mesh.points.len(), points(&mesh, |k| format!("{k} "), ""));
    let ele = format!("2 10 1\n{}", lines(&mesh.tets, 0, |k| k.to_string(), " 7"));
    // Without and with the tets on both sides (-nn).
    for more in ["", " 1 -1"] {
        let face =
            format!("6 1\n{}# end\n", lines(&mesh.triangles, 0, |k| k.to_string(), &format!(" 5{more}")));
        reads_corners(&[("m.1.ele", ele.clone()), ("m.1.node", node.clone()), ("m.1.face", face)]);
    }
    // First-order faces beside such tets: the marker follows three nodes.
    let three: Vec<Vec<u32>> = mesh.triangles.iter().map(|t| t[..3].to_vec()).collect();
    let dir = tempfile::tempdir().unwrap();
    for (name, content) in [
        ("m.ele", &ele),
        ("m.node", &node),
        ("m.face", &format!("6 1\n{}", lines(&three, 0, |k| k.to_string(), " 5 1 -1"))),
    ] {
        fs::write(dir.path().join(name), content).unwrap();
    }
    let found = read(&dir.path().join("m.ele")).unwrap();
    assert_eq!(found.names.patches, [crate::ground::mesh::Label::unnamed(5)]);
}
