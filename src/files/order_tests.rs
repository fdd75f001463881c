//! Meshes of second order in every format: the places of nodes in the lines of elements, and
//! reading back. The edges are straight, so each node is known by its place in the middle of an
//! edge.

use super::serial::{self, Format};
use super::testing::together;
use super::volume;
use super::{elmer, mfem, vtu};
use crate::ground::comm::{Communicator, thread};
use crate::ground::mesh::stream::MeshStream;
use crate::ground::mesh::{Label, Names, Order};
use crate::parallel::check::check_part;
use crate::parallel::distribution::distribute;
use crate::parallel::refine::fixtures::{ball, cube, whole};
use crate::parallel::refine::{RefinedMesh, Settings, refine};
use std::fs;
use std::path::Path;

type Point = [f64; 3];

/// Pairs of corners, for the nodes on edges in the order of a format.
type Pairs<const N: usize> = [[usize; 2]; N];

/// Of VTK, Elmer, Abaqus and Medit, as their documentations draw them.
const VTK: Pairs<6> = [[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]];
const GMSH: Pairs<6> = [[0, 1], [1, 2], [0, 2], [0, 3], [2, 3], [1, 3]];
const NETGEN: Pairs<6> = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];
const AROUND: Pairs<3> = [[0, 1], [1, 2], [2, 0]];
const NETGEN_TRIANGLE: Pairs<3> = [[1, 2], [0, 2], [0, 1]];

fn of_second_order(n: u32) -> RefinedMesh {
    let fixture = cube(1, false);
    let settings = Settings { order: Order::Second, ..Settings::default() };
    refine(whole(&fixture.mesh), &fixture.projector, n, &settings).unwrap()
}

fn names() -> Names {
    Names { bodies: vec![Label::new(1, "box")], patches: (1..=6).map(Label::unnamed).collect() }
}

fn numbers(line: &str) -> Vec<f64> {
    let words = line.split(|c: char| c.is_whitespace() || c == ',').filter(|word| !word.is_empty());
    words.filter_map(|word| word.parse().ok()).collect()
}

/// Checks that the nodes of an element after its corners are in the middles of these edges.
fn expect_middles<const N: usize>(nodes: &[Point], pairs: &Pairs<N>, line: &str) {
    let corners = nodes.len() - N;
    for (node, [p, q]) in nodes[corners..].iter().zip(pairs) {
        let middle = [0, 1, 2].map(|x| 0.5 * (nodes[*p][x] + nodes[*q][x]));
        assert_eq!(*node, middle, "{line}");
    }
}

/// The nodes at the end of a line, by numbers from 1.
fn last_nodes<const N: usize>(line: &str, points: &[Point]) -> [Point; N] {
    let all = numbers(line);
    let ids = all.last_chunk::<N>().expect("the nodes are last in the line");
    ids.map(|id| points[id as usize - 1])
}

/// The rows of numbers between two lines.
fn rows<'a>(text: &'a str, from: &str, to: &str) -> Vec<&'a str> {
    let rest = text.split_once(from).unwrap_or_else(|| panic!("no {from} in {text}")).1;
    rest.split_once(to).expect("the section ends").0.lines().filter(|line| !line.is_empty()).collect()
}

fn written(part: &RefinedMesh, name: &str) -> String {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join(name);
    serial::write(part, &names(), &path).unwrap();
    fs::read_to_string(&path).unwrap()
}

/// The last three numbers of each row.
fn points_of(rows: &[&str]) -> Vec<Point> {
    rows.iter().map(|row| *numbers(row).last_chunk::<3>().expect("three coordinates")).collect()
}

#[test]
fn nodes_are_where_gmsh_has_them() {
    let part = of_second_order(2);
    let text = written(&part, "m.msh");
    let points = points_of(&rows(&text, "$Nodes\n", "$EndNodes")[1..]);
    let elements = rows(&text, "$Elements\n", "$EndElements");
    assert_eq!(points.len() as u64, part.counts().vertices);
    for line in &elements[1..] {
        match numbers(line)[1] as u32 {
            9 => expect_middles(&last_nodes::<6>(line, &points), &AROUND, line),
            11 => expect_middles(&last_nodes::<10>(line, &points), &GMSH, line),
            other => panic!("type {other}"),
        }
    }
}

#[test]
fn nodes_are_where_medit_and_abaqus_have_them() {
    let part = of_second_order(2);
    let text = written(&part, "m.inp");
    let points = points_of(&rows(&text, "*NODE, NSET=NALL\n", "*ELEMENT"));
    let elements = rows(&text, "*ELEMENT, TYPE=C3D10, ELSET=BODY_1\n", "*NSET");
    assert_eq!(elements.len() as u64, part.counts().tets);
    elements.iter().for_each(|line| expect_middles(&last_nodes::<10>(line, &points), &VTK, line));

    let text = written(&part, "m.mesh");
    let points: Vec<Point> = rows(&text, "Vertices\n", "TrianglesP2")[1..]
        .iter()
        .map(|row| *numbers(row).first_chunk::<3>().expect("coordinates"))
        .collect();
    let nodes = |line: &str, count: usize| -> Vec<Point> {
        numbers(line)[..count].iter().map(|id| points[*id as usize - 1]).collect()
    };
    for line in &rows(&text, "TetrahedraP2\n", "End")[1..] {
        expect_middles(&nodes(line, 10), &VTK, line);
    }
    for line in &rows(&text, "TrianglesP2\n", "TetrahedraP2")[1..] {
        expect_middles(&nodes(line, 6), &AROUND, line);
    }
}

#[test]
fn nodes_are_where_netgen_has_them() {
    let text = written(&of_second_order(2), "m.vol");
    let points = points_of(&rows(&text, "\npoints\n", "materials")[1..]);
    for line in &rows(&text, "surfaceelements\n", "volumeelements")[1..] {
        expect_middles(&last_nodes::<6>(line, &points), &NETGEN_TRIANGLE, line);
    }
    for line in &rows(&text, "volumeelements\n", "edgesegmentsgi2")[1..] {
        expect_middles(&last_nodes::<10>(line, &points), &NETGEN, line);
    }
}

#[test]
fn nodes_are_where_elmer_has_them() {
    let dir = tempfile::tempdir().unwrap();
    let part = of_second_order(2);
    elmer::write(&thread::alone(), &part, &names(), dir.path()).unwrap();
    let text = |name: &str| fs::read_to_string(dir.path().join(name)).unwrap();
    assert!(text("mesh.header").ends_with("2\n306 48\n510 48\n"), "{}", text("mesh.header"));
    let nodes = text("mesh.nodes");
    let points = points_of(&nodes.lines().collect::<Vec<_>>());
    for line in text("mesh.elements").lines() {
        assert_eq!(numbers(line)[2], 510.0);
        expect_middles(&last_nodes::<10>(line, &points), &VTK, line);
    }
    for line in text("mesh.boundary").lines() {
        assert_eq!(numbers(line)[4], 306.0);
        expect_middles(&last_nodes::<6>(line, &points), &AROUND, line);
    }
}

#[test]
fn mfem_has_the_corners_and_then_the_nodes_in_the_order_of_its_edges() {
    let part = of_second_order(2);
    let text =
        mfem::part_text(&thread::alone(), &part, &Names { bodies: vec![Label::unnamed(1)], ..names() });
    let text = String::from_utf8(text.unwrap()).unwrap();
    let tets = rows(&text, "elements\n", "boundary");
    let corners: usize = rows(&text, "vertices\n", "nodes")[0].parse().unwrap();
    let points = points_of(&rows(&text, "Ordering: 1\n", "mfem_serial_mesh_end"));
    assert_eq!((corners, points.len()), (27, 125));
    // MFEM numbers edges as it first sees them in its elements.
    let mut edges: Vec<[usize; 2]> = Vec::new();
    for tet in &tets[1..] {
        let vertices: Vec<usize> = numbers(tet)[2..].iter().map(|v| *v as usize).collect();
        for [p, q] in NETGEN.map(|pair| pair.map(|k| vertices[k])) {
            if !edges.contains(&[p.min(q), p.max(q)]) {
                edges.push([p.min(q), p.max(q)]);
            }
        }
    }
    for ([p, q], node) in edges.iter().zip(&points[corners..]) {
        assert_eq!(*node, [0, 1, 2].map(|x| 0.5 * (points[*p][x] + points[*q][x])));
    }
}

/// Writes a curved mesh and reads it back; the volume is that of the curved tets.
#[test]
fn curved_meshes_are_read_back_as_they_are() {
    let fixture = ball(1.0);
    let settings = Settings { order: Order::Second, ..Settings::default() };
    let volume_of = |path: &Path| {
        let read = volume::read(path).unwrap();
        assert_eq!(read.edge_points.len(), read.mesh.tets.len(), "{}", path.display());
        let quality = crate::pipeline::quality::Quality::of_file("m", &read);
        assert_eq!((quality.not_valid, quality.order), (Some(0), 2));
        [quality.volume, quality.scaled_jacobian.unwrap()]
    };
    for ranks in [1, 3] {
        let dir = tempfile::tempdir().unwrap();
        let expected = together(ranks, |comm: &dyn Communicator| {
            let parts = (0..fixture.mesh.tets.len() as u32).map(|tet| tet % ranks).collect();
            let given = (comm.rank() == 0).then(|| (fixture.mesh.clone(), parts));
            let part = refine(distribute(comm, given).unwrap(), &fixture.projector, 2, &settings).unwrap();
            let names = Names { bodies: vec![Label::unnamed(1)], patches: vec![Label::unnamed(1)] };
            for (name, format) in
                [("m.msh", Format::Gmsh), ("m.vol", Format::Netgen), ("m.mesh", Format::Medit)]
            {
                serial::write_joined(comm, &part, &names, format, &dir.path().join(name)).unwrap();
            }
            vtu::write(comm, &part, &names, &dir.path().join("m.vtu")).unwrap();
            elmer::write(comm, &part, &names, &dir.path().join("elmer")).unwrap();
            let report = check_part(&part, None, &Default::default());
            [report.volume, report.scaled_jacobian.unwrap().value]
        });
        let volume: f64 = expected.iter().map(|[volume, _]| volume).sum();
        let scaled = expected.iter().map(|[_, scaled]| *scaled).fold(1.0, f64::min);
        let vtu = if ranks == 1 { "m.vtu" } else { "m.pvtu" };
        for (_, faults) in elmer::check_elmer(&dir.path().join("elmer")).unwrap() {
            assert!(faults.is_empty(), "{faults}");
        }
        for name in ["m.msh", "m.vol", "m.mesh", vtu, "elmer"] {
            let [read, of_read] = volume_of(&dir.path().join(name));
            assert!((read - volume).abs() < 1e-12, "{name}: {read} is not {volume}");
            assert!((of_read - scaled).abs() < 1e-9, "{name}: {of_read} is not {scaled}");
        }
    }
}

#[test]
fn faults_of_second_order_in_elmer_files_are_found_with_their_lines() {
    let fixture = ball(1.0);
    let settings = Settings { order: Order::Second, ..Settings::default() };
    let part = refine(whole(&fixture.mesh), &fixture.projector, 1, &settings).unwrap();
    let names = Names { bodies: vec![Label::unnamed(1)], patches: vec![Label::unnamed(1)] };
    let found = |file: &str, change: &dyn Fn(&str) -> String| {
        let dir = tempfile::tempdir().unwrap();
        elmer::write(&thread::alone(), &part, &names, dir.path()).unwrap();
        // The serial files are links to those of the part, which stay as they are.
        let path = dir.path().join(file);
        let text = fs::read_to_string(&path).unwrap();
        fs::remove_file(&path).unwrap();
        let first = text.lines().next().unwrap();
        fs::write(&path, text.replacen(first, &change(first), 1)).unwrap();
        let checked = elmer::check_elmer(dir.path()).unwrap();
        checked.into_iter().map(|(_, faults)| faults.to_string()).collect::<String>()
    };
    // The last two nodes of an element change places.
    let swapped = |line: &str| {
        let mut words: Vec<&str> = line.split(' ').collect();
        let last = words.len() - 1;
        words.swap(last, last - 1);
        words.join(" ")
    };
    let text = found("mesh.elements", &swapped);
    assert!(text.contains("element of second order that is not valid"), "{text}");
    assert!(text.contains("mesh.elements:1: the edge of nodes"), "{text}");
    let text = found("mesh.boundary", &swapped);
    assert!(text.contains("edge with different nodes in different elements"), "{text}");
}
