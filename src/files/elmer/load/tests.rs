use super::*;
use crate::files::elmer::write;
use crate::files::plain::PlainPart;
use crate::files::testing::{cube, names, scattered, slabs, together, two_tets};
use crate::ground::mesh::{Label, Mesh, VertexId};
use crate::parallel::check::checksum_of_all;
use crate::parallel::migrate::BareStream;
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use std::fs;

/// Writes a mesh in parts; each tet belongs to the part in `tet_to_part`.
fn write_parts(mesh: &Mesh, tet_to_part: &[Rank], parts: u32, dir: &Path) {
    let part = |comm: &dyn Communicator| PlainPart::part(mesh, tet_to_part, parts, comm.rank());
    together(parts, |comm| write(comm, &part(comm), &names(), dir).unwrap());
}

type Place = [u64; 3];

/// A mesh independent of ids: tets as the bits of their coordinates with body numbers, triangles as
/// seen from their fronts with boundary numbers.
#[derive(Debug, PartialEq, Default)]
struct Content {
    tets: Vec<([Place; 4], u32)>,
    triangles: Vec<([Place; 3], u32)>,
}

fn place(point: &crate::Point) -> Place {
    [point.x, point.y, point.z].map(f64::to_bits)
}

/// Rotates a triangle so that the least point comes first.
fn from_least(mut triangle: [Place; 3]) -> [Place; 3] {
    let least = (0..3).min_by_key(|&k| triangle[k]).unwrap();
    triangle.rotate_left(least);
    triangle
}

impl Content {
    fn of_mesh(mesh: &Mesh) -> Self {
        let at = |v: VertexId| place(&mesh.points[v.index()]);
        let tet = |(tet, body): (&[VertexId; 4], &csg::BodyId)| {
            (sorted(tet.map(at)), names().bodies[body.index()].number)
        };
        let triangle = |t: &crate::ground::mesh::BoundaryTriangle| {
            (from_least(t.vertices.map(at)), names().patches[t.patch.index()].number)
        };
        Self {
            tets: mesh.tets.iter().zip(&mesh.bodies).map(tet).collect(),
            triangles: mesh.triangles.iter().map(triangle).collect(),
        }
        .sorted()
    }

    fn of_part(loaded: &Loaded) -> Self {
        let mesh = &loaded.mesh;
        let at = |v: VertexId| place(&mesh.points[v.index()]);
        let tet = |(tet, body): (&[VertexId; 4], &csg::BodyId)| {
            (sorted(tet.map(at)), loaded.names.bodies[body.index()].number)
        };
        let mine =
            |t: &&crate::parallel::distribution::BoundaryFace| mesh.face_holders(t.face)[0] == mesh.rank;
        let triangle = |t: &crate::parallel::distribution::BoundaryFace| {
            let vertices = mesh.boundary_vertices(t).map(at);
            (from_least(vertices), loaded.names.patches[t.patch.index()].number)
        };
        Self {
            tets: mesh.tets.iter().zip(&mesh.tet_bodies).map(tet).collect(),
            triangles: mesh.boundary.iter().filter(mine).map(triangle).collect(),
        }
    }

    fn sorted(mut self) -> Self {
        self.tets.sort();
        self.triangles.sort();
        self
    }
}

fn sorted<const N: usize>(mut places: [Place; N]) -> [Place; N] {
    places.sort_unstable();
    places
}

/// Loads on this many ranks and expects the given content.
fn expect_loaded(dir: &Path, ranks: u32, parts: u32, expected: &Content) -> Vec<Loaded> {
    let loaded = together(ranks, |comm| {
        let loaded = load(comm, dir).unwrap();
        loaded.mesh.check(comm).unwrap();
        let sum = checksum_of_all(comm, &BareStream::new(loaded.mesh.clone().into())).unwrap();
        assert_eq!(sum.open, 0);
        loaded
    });
    let mut content = Content::default();
    for part in loaded.iter().map(Content::of_part) {
        content.tets.extend(part.tets);
        content.triangles.extend(part.triangles);
    }
    assert!(content.sorted() == *expected, "{parts} parts on {ranks} ranks are not the mesh");
    assert!(loaded.iter().all(|l| l.parts == parts && l.names == loaded[0].names && l.notes.is_empty()));
    loaded
}

#[test]
fn what_was_written_in_some_parts_is_read_on_any_number_of_ranks() {
    let mesh = cube(4);
    let expected = Content::of_mesh(&mesh);
    for parts in [1, 2, 5] {
        for tet_to_part in [slabs(&mesh, parts), scattered(&mesh, parts)] {
            let dir = tempfile::tempdir().unwrap();
            write_parts(&mesh, &tet_to_part, parts, dir.path());
            let alone = expect_loaded(dir.path(), 1, parts, &expected).remove(0);
            for ranks in [2, 3, 7] {
                let loaded = expect_loaded(dir.path(), ranks, parts, &expected);
                // Parts, ids and classes do not depend on the number of reading ranks.
                let count = |part: u32| loaded.iter().flat_map(|l| &l.part).filter(|p| **p == part).count();
                (0..parts)
                    .for_each(|p| assert_eq!(count(p), tet_to_part.iter().filter(|q| **q == p).count()));
                for mesh in loaded.iter().map(|l| &l.mesh) {
                    for (id, class) in mesh.vertex_ids.iter().zip(&mesh.vertex_classes) {
                        let place = alone.mesh.vertex_ids.binary_search(id).unwrap();
                        assert_eq!(alone.mesh.vertex_classes[place], *class);
                    }
                }
            }
        }
    }
}

#[test]
fn names_and_numbers_are_those_of_the_files_and_patches_end_where_bodies_do() {
    let dir = tempfile::tempdir().unwrap();
    write_parts(&two_tets(), &[0, 1], 2, dir.path());
    let loaded = together(2, |comm| load(comm, dir.path()).unwrap());
    assert_eq!(loaded[0].names.bodies, [Label::new(1, "lower")]);
    assert_eq!(loaded[0].names.patches, [Label::new(1, "skin"), Label::new(2, "lid")]);
    // Also from the folder of the parts, and without names.
    fs::remove_file(dir.path().join("mesh.names")).unwrap();
    let folder = dir.path().join("partitioning.2");
    let loaded = together(1, |comm| load(comm, &folder).unwrap());
    assert_eq!(loaded[0].names.patches[1], Label::unnamed(2));
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 24, rng_seed: RngSeed::Fixed(6), failure_persistence: None, ..ProptestConfig::default()
    })]

    #[test]
    fn any_partition_is_read_as_the_mesh_it_is(
        parts in 1..9u32,
        ranks in 1..9u32,
        numbers in vec(any::<u32>(), 48),
    ) {
        let mesh = cube(2);
        // No part may be empty, so the first tets are assigned in turn.
        let first = (0..parts).chain(numbers.iter().map(|n| n % parts));
        let tet_to_part: Vec<Rank> = first.take(mesh.tets.len()).collect();
        let dir = tempfile::tempdir().unwrap();
        write_parts(&mesh, &tet_to_part, parts, dir.path());
        expect_loaded(dir.path(), ranks, parts, &Content::of_mesh(&mesh));
    }
}

/// Rewrites the lines of a file.
fn edit(path: &Path, edit: impl FnOnce(&mut Vec<String>)) {
    let text = fs::read_to_string(path).unwrap();
    let mut lines: Vec<String> = text.lines().map(String::from).collect();
    edit(&mut lines);
    fs::write(path, lines.join("\n") + if lines.is_empty() { "" } else { "\n" }).unwrap();
}

#[test]
fn ids_with_gaps_and_in_any_order_are_read() {
    let dir = tempfile::tempdir().unwrap();
    write_parts(&two_tets(), &[0, 1], 2, dir.path());
    // Node n becomes 100 n + 7, element 2 becomes 2000000000, and lines are reversed.
    let far = |number: &str| format!("{}", number.parse::<u32>().unwrap() * 100 + 7);
    for part in [1, 2] {
        let file = |kind: &str| dir.path().join(format!("partitioning.2/part.{part}.{kind}"));
        let renumber = |line: &str, which: fn(usize) -> bool| {
            let words = line.split(' ').enumerate();
            words.map(|(k, w)| if which(k) { far(w) } else { w.into() }).collect::<Vec<_>>().join(" ")
        };
        let whole = |kind: &str, which: fn(usize) -> bool| {
            edit(&file(kind), |lines| {
                lines.iter_mut().for_each(|line| *line = renumber(line, which));
                lines.reverse();
            });
        };
        whole("nodes", |k| k == 0);
        whole("elements", |k| k > 2);
        whole("boundary", |k| k > 4);
        whole("shared", |k| k == 0);
        if part == 2 {
            edit(&file("elements"), |lines| lines[0].replace_range(..1, "2000000000"));
            edit(&file("boundary"), |lines| {
                lines.iter_mut().for_each(|line| *line = line.replacen(" 2 2 ", " 2 2000000000 ", 1));
            });
        }
    }
    let expected = Content::of_mesh(&two_tets());
    for ranks in [1, 2, 3] {
        let loaded = expect_loaded(dir.path(), ranks, 2, &expected);
        assert_eq!(loaded[0].mesh.totals.vertices, 5);
    }
}

#[test]
fn negative_tets_are_reversed_and_missing_boundaries_noted() {
    let dir = tempfile::tempdir().unwrap();
    write_parts(&two_tets(), &[0, 1], 2, dir.path());
    let file = |name: &str| dir.path().join("partitioning.2").join(name);
    edit(&file("part.1.elements"), |lines| lines[0] = "1 1 504 3 1 2 4".into());
    edit(&file("part.2.boundary"), |lines| _ = lines.pop());
    edit(&file("part.2.header"), |lines| {
        (lines[0], lines[2]) = ("4 1 2".into(), "303 2".into());
    });
    for ranks in [1, 2] {
        let loaded = together(ranks, |comm| load(comm, dir.path()).unwrap());
        assert_eq!(
            loaded[0].notes,
            [
                "1 tet stored in negative orientation turned round",
                "1 outer face without a boundary element, and none was added"
            ]
        );
    }
}

#[test]
fn an_interface_gets_both_sides_whether_one_part_or_both_have_a_boundary_element_for_it() {
    let mut mesh = two_tets();
    mesh.bodies[1] = csg::BodyId(1);
    let between = [1, 2, 3].map(VertexId);
    mesh.triangles.push(crate::ground::mesh::BoundaryTriangle { vertices: between, patch: csg::PatchId(2) });
    let dir = tempfile::tempdir().unwrap();
    write_parts(&mesh, &[0, 1], 2, dir.path());
    let expected = Content::of_mesh(&mesh);
    for ranks in [1, 2, 3] {
        expect_loaded(dir.path(), ranks, 2, &expected);
    }
    // Elmer's own writer writes it in both parts, which `check` reports as a fault and loading
    // repairs.
    let file = |name: &str| dir.path().join("partitioning.2").join(name);
    edit(&file("part.1.boundary"), |lines| lines.push("4 3 1 2 303 3 2 4".into()));
    edit(&file("part.1.header"), |lines| {
        (lines[0], lines[2]) = ("4 1 4".into(), "303 4".into());
    });
    for ranks in [1, 2, 3] {
        expect_loaded(dir.path(), ranks, 2, &expected);
    }
}

/// Changes the files of two tets in two parts and expects this message on all ranks.
fn expect_refused(file: &str, break_it: impl Fn(&mut Vec<String>), expected: &str) {
    let dir = tempfile::tempdir().unwrap();
    write_parts(&two_tets(), &[0, 1], 2, dir.path());
    edit(&dir.path().join("partitioning.2").join(file), break_it);
    for ranks in [1, 2, 3] {
        let said = together(ranks, |comm| load(comm, dir.path()).unwrap_err().to_string());
        // A rank that meets a fault of its own reports that one.
        assert!(said.iter().any(|text| text.contains(expected)), "{said:?}\nexpected {expected}");
    }
}

#[test]
fn malformed_parts_are_refused_with_file_and_line_on_all_ranks() {
    let set = |line: usize, text: &'static str| move |lines: &mut Vec<String>| lines[line] = text.into();
    let drop = |line: usize| move |lines: &mut Vec<String>| _ = lines.remove(line);
    // The original lines are in the tests of the format.
    expect_refused(
        "part.1.elements",
        set(0, "1 1 504 1 3 2"),
        "part.1.elements:1: the line ends before its node",
    );
    expect_refused("part.1.nodes", drop(0), "part.1.header:1: wrong count in a header: says 4 nodes");
    expect_refused("part.2.header", set(0, "4 1 7"), "part.2.header:1: wrong count");
    expect_refused("part.2.nodes", set(1, "3 -1 0 1 0"), "part.2.nodes:2: node twice in a part");
    expect_refused("part.2.nodes", set(3, "5 -1 1 1 NaN"), "part.2.nodes:4: coordinate that is not a number");
    expect_refused(
        "part.2.elements",
        set(0, "2 1 504 3 2 4 9"),
        "part.2.elements:1: node that the part lacks",
    );
    expect_refused(
        "part.2.elements",
        set(0, "2 0 504 3 2 4 5"),
        "part.2.elements:1: body or boundary number 0",
    );
    expect_refused("part.1.elements", set(0, "1 1 504 1 3 2 2"), "node of no element");
    expect_refused("part.2.elements", set(0, "1 1 504 3 2 4 5"), "part.2.elements:1: element id twice");
    expect_refused("part.2.nodes", set(1, "2 -1 0 1 0.5"), "part.2.nodes:2: node with different coordinates");
    expect_refused("part.2.shared", set(0, "3 2 1 2"), "part.2.shared:1: node with different owners");
    expect_refused("part.1.shared", set(0, "3 2 1 3"), "part.1.shared:1: wrong holders");
    expect_refused("part.1.shared", set(0, "3 2 2 3"), "part.1.shared:1: wrong holders");
    expect_refused("part.1.shared", set(0, "1 2 1 2"), "part.1.shared:1: wrong holders");
    expect_refused(
        "part.1.boundary",
        set(0, "1 1 1 0 303 1 3 3"),
        "part.1.boundary:1: boundary element that is not a face",
    );
    expect_refused(
        "part.1.boundary",
        set(1, "2 1 1 0 303 2 1 3"),
        "part.1.boundary:2: boundary element twice",
    );
}
