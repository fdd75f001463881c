//! Tests of Elmer files: written, read back, and with each kind of fault.

use super::*;
use crate::files::input::ReadError;
use crate::files::plain::PlainPart;
use crate::files::testing::{cube, names, scattered, slabs, together, two_tets};
use crate::files::{WriteError, Written};
use crate::ground::comm::Communicator;
use crate::ground::mesh::stream::Counts;
use crate::ground::mesh::{Label, Mesh, Names, Rank};
use crate::parallel::distribution::distribute;
use crate::parallel::refine::fixtures::{self, Fixture, ball};
use crate::parallel::refine::refine;
use std::fs;
use std::path::Path;

/// Writes the parts of a mesh, one by each rank.
fn write_parts(mesh: &Mesh, tet_to_rank: &[Rank], ranks: u32, dir: &Path) -> Result<Written, WriteError> {
    let results = together(ranks, |comm| {
        write(comm, &PlainPart::part(mesh, tet_to_rank, ranks, comm.rank()), &names(), dir)
    });
    results
        .into_iter()
        .reduce(|a, b| a.and_then(|a| b.map(|b| [a, b].into_iter().max_by_key(|w| w.bytes).unwrap())))
        .unwrap()
}

fn text(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

#[test]
fn two_tets_in_one_part_are_written_to_the_letter() {
    let dir = tempfile::tempdir().unwrap();
    let written = write_parts(&two_tets(), &[0, 0], 1, dir.path()).unwrap();
    assert_eq!(written.files, 10);
    let nodes = "1 -1 0 0 0\n2 -1 1 0 0\n3 -1 0 1 0\n4 -1 0 0 1\n5 -1 1 1 1\n";
    let elements = "1 1 504 1 2 3 4\n2 1 504 2 3 4 5\n";
    let boundary = "1 1 1 0 303 1 3 2\n2 1 1 0 303 1 2 4\n3 1 1 0 303 1 4 3\n\
                    4 2 2 0 303 2 3 5\n5 2 2 0 303 2 5 4\n6 2 2 0 303 3 4 5\n";
    for stem in ["mesh", "partitioning.1/part.1"] {
        let file = |kind: &str| text(&dir.path().join(format!("{stem}.{kind}")));
        assert_eq!(file("nodes"), nodes);
        assert_eq!(file("elements"), elements);
        assert_eq!(file("boundary"), boundary);
    }
    assert_eq!(text(&dir.path().join("mesh.header")), "5 2 6\n2\n303 6\n504 2\n");
    assert_eq!(text(&dir.path().join("partitioning.1/part.1.header")), "5 2 6\n2\n303 6\n504 2\n0 0\n");
    assert_eq!(text(&dir.path().join("partitioning.1/part.1.shared")), "");
    assert_eq!(
        text(&dir.path().join("mesh.names")),
        "! ----- names for bodies -----\n$ lower = 1\n$ upper = 2\n\
         ! ----- names for boundaries -----\n$ skin = 1\n$ lid = 2\n$ between = 3\n"
    );
}

#[test]
fn two_tets_in_two_parts_are_written_to_the_letter() {
    let dir = tempfile::tempdir().unwrap();
    write_parts(&two_tets(), &[0, 1], 2, dir.path()).unwrap();
    // Vertices 1, 2 and 3 are shared and owned by the ranks 1, 0 and 1: rank 0 owns 0 and 2.
    let file = |name: &str| text(&dir.path().join("partitioning.2").join(name));
    assert_eq!(file("part.1.header"), "4 1 3\n2\n303 3\n504 1\n3 0\n");
    assert_eq!(file("part.1.nodes"), "1 -1 0 0 0\n3 -1 1 0 0\n2 -1 0 1 0\n4 -1 0 0 1\n");
    assert_eq!(file("part.1.elements"), "1 1 504 1 3 2 4\n");
    assert_eq!(file("part.1.boundary"), "1 1 1 0 303 1 2 3\n2 1 1 0 303 1 3 4\n3 1 1 0 303 1 4 2\n");
    assert_eq!(file("part.1.shared"), "3 2 2 1\n2 2 1 2\n4 2 2 1\n");
    assert_eq!(file("part.2.nodes"), "3 -1 1 0 0\n2 -1 0 1 0\n4 -1 0 0 1\n5 -1 1 1 1\n");
    assert_eq!(file("part.2.elements"), "2 1 504 3 2 4 5\n");
    assert_eq!(file("part.2.boundary"), "1 2 2 0 303 3 2 5\n2 2 2 0 303 3 5 4\n3 2 2 0 303 2 4 5\n");
    assert_eq!(file("part.2.shared"), file("part.1.shared"));
    assert!(!dir.path().join("mesh.nodes").exists());
}

#[test]
fn cubes_in_one_to_seven_parts_have_no_faults() {
    let mesh = cube(4);
    for ranks in [1, 2, 3, 4, 7] {
        for tet_to_rank in [slabs(&mesh, ranks), scattered(&mesh, ranks)] {
            let dir = tempfile::tempdir().unwrap();
            write_parts(&mesh, &tet_to_rank, ranks, dir.path()).unwrap();
            for (layout, faults) in check_elmer(dir.path()).unwrap() {
                assert!(faults.is_empty(), "{layout:?}\n{faults}");
            }
            let read = read(dir.path()).unwrap();
            assert_eq!(read.parts.iter().map(|p| p.elements.len()).sum::<usize>(), 384);
            for part in &read.parts {
                for node in &part.nodes {
                    // Thirds: 17 digits are needed to read back the same bits.
                    assert!(mesh.points.contains(&node.point), "{}", node.point);
                }
            }
        }
    }
}

/// Refines each part of a mesh on its rank and writes it.
fn write_refined(fixture: &Fixture, n: u32, ranks: u32, dir: &Path) -> Written {
    let named = |k: u32| Label::new(k, format!("number {k}"));
    let names = Names { bodies: (1..3).map(named).collect(), patches: (1..8).map(named).collect() };
    let write_part = |comm: &dyn Communicator| {
        let mesh = (comm.rank() == 0).then(|| (fixture.mesh.clone(), slabs(&fixture.mesh, ranks)));
        let part = distribute(comm, mesh).unwrap();
        let refined = refine(part, &fixture.projector, n, &Default::default()).unwrap();
        write(comm, &refined, &names, dir).unwrap()
    };
    together(ranks, write_part).remove(0)
}

#[test]
fn refined_balls_and_cubes_have_no_faults() {
    for fixture in [ball(2.5), fixtures::cube(2, true)] {
        for ranks in [1, 2, 5] {
            let dir = tempfile::tempdir().unwrap();
            let written = write_refined(&fixture, 4, ranks, dir.path());
            for (layout, faults) in check_elmer(dir.path()).unwrap() {
                assert!(faults.is_empty(), "{layout:?}\n{faults}");
            }
            let mesh = read(dir.path()).unwrap();
            let tets: usize = mesh.parts.iter().map(|part| part.elements.len()).sum();
            assert_eq!(tets, 64 * fixture.mesh.tets.len());
            assert_eq!(written.files, if ranks == 1 { 10 } else { 5 * u64::from(ranks) + 1 });
        }
    }
}

/// Runs the independent checker in Python, if Python and numpy are available.
fn independent_checker() -> Option<std::process::Command> {
    let shared =
        std::env::var("TETMILL_SHARED").unwrap_or(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared").into());
    let script = Path::new(&shared).join("tools/check_partition.py");
    let python = |python: &&str| {
        let probe = std::process::Command::new(python).args(["-c", "import numpy"]).output();
        probe.is_ok_and(|out| out.status.success())
    };
    let python = ["python3", "/usr/bin/python3"].into_iter().find(python);
    match python {
        Some(python) if script.exists() => {
            let mut command = std::process::Command::new(python);
            command.arg(script);
            Some(command)
        }
        _ => {
            eprintln!("SKIPPED: no {} or no python3 with numpy", script.display());
            None
        }
    }
}

#[test]
fn an_independent_checker_finds_nothing() {
    if independent_checker().is_none() {
        return;
    }
    let mesh = cube(4);
    for ranks in [1, 2, 3, 7] {
        for tet_to_rank in [slabs(&mesh, ranks), scattered(&mesh, ranks)] {
            let dir = tempfile::tempdir().unwrap();
            write_parts(&mesh, &tet_to_rank, ranks, dir.path()).unwrap();
            let folder = dir.path().join(format!("partitioning.{ranks}"));
            let volume = ["--volume", "2.370370370370370", "--rel", "1e-12"];
            let surface = ["--surface", "3:z-2/3"];
            let mut checker = independent_checker().unwrap();
            let output = checker.arg(&folder).args(volume).args(surface).output().unwrap();
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stdout));
        }
    }
}

#[test]
fn the_nodes_that_a_part_owns_have_no_gap() {
    let mesh = cube(4);
    let dir = tempfile::tempdir().unwrap();
    write_parts(&mesh, &slabs(&mesh, 4), 4, dir.path()).unwrap();
    let mut next = 1;
    for (k, part) in (1..).zip(&read(dir.path()).unwrap().parts) {
        let owned = |id: u32| part.shared.iter().find(|s| s.id == id).is_none_or(|s| s.parts[0] == k);
        for node in part.nodes.iter().filter(|node| owned(node.id)) {
            assert_eq!(node.id, next);
            next += 1;
        }
    }
    assert_eq!(next, 126);
}

#[test]
fn what_elmer_cannot_read_is_refused_before_anything_is_written() {
    let dir = tempfile::tempdir().unwrap();
    let target = dir.path().join("mesh");
    let mesh = two_tets();
    let error = write_parts(&mesh, &[0, 1], 3, &target).unwrap_err().to_string();
    assert!(error.contains("part 3 has no tets"), "{error}");

    // A fan of 63 tets around one edge, a part each: a line of 65 numbers.
    let mut fan = two_tets();
    fan.tets = vec![fan.tets[0]; 63];
    fan.bodies = vec![fan.bodies[0]; 63];
    fan.triangles.truncate(1);
    let ranks: Vec<Rank> = (0..63).collect();
    let error = write_parts(&fan, &ranks, 63, &target).unwrap_err().to_string();
    assert!(error.contains("in 63 parts"), "{error}");
    assert!(!target.exists());

    let small = Counts { vertices: 10, tets: 10, boundary: 10 };
    let limit = 2_147_483_647;
    assert!(super::write::check_limits(Counts { tets: limit, ..small }, small, 0).is_ok());
    let error = super::write::check_limits(Counts { vertices: limit + 1, ..small }, small, 0).unwrap_err();
    assert!(
        error.to_string().contains("numbers vertices up to 2147483647, and there are 2147483648"),
        "{error}"
    );

    let mut unknown = two_tets();
    unknown.bodies[1] = csg::BodyId(7);
    let error = write_parts(&unknown, &[0, 0], 1, &target).unwrap_err();
    assert!(matches!(error, WriteError::UnknownBody(csg::BodyId(7))), "{error}");
    assert!(!target.exists());
}

#[test]
fn names_that_elmer_would_confuse_are_kept_apart() {
    let named = |k: u32, name: &str| Label::new(k, name);
    let names = crate::ground::mesh::Names {
        bodies: vec![named(1, "Iron"), named(2, "")],
        patches: vec![named(1, "iron"), named(3, "a=b"), named(2, "A=B")],
    };
    let text = super::names::names_text(&names);
    let lines: Vec<&str> = text.lines().filter(|line| line.starts_with('$')).collect();
    assert_eq!(lines, ["$ Iron = 1", "$ iron_boundary = 1", "$ a_b = 2 3"]);
}

/// Writes a cube of two slabs with an interface patch, changes a line of a file, and returns the
/// faults.
fn broken(file: &str, line: usize, change: impl Fn(&str) -> String) -> Result<Faults, ReadError> {
    let mesh = cube(2);
    let dir = tempfile::tempdir().unwrap();
    write_parts(&mesh, &slabs(&mesh, 2), 2, dir.path()).unwrap();
    let path = dir.path().join("partitioning.2").join(file);
    let mut lines: Vec<String> = text(&path).lines().map(String::from).collect();
    lines[line - 1] = change(&lines[line - 1]);
    let joined: String = lines.iter().filter(|l| !l.is_empty()).map(|l| format!("{l}\n")).collect();
    fs::write(&path, joined).unwrap();
    check_elmer(dir.path()).map(|mut list| list.remove(0).1)
}

/// Replaces the word at `index` of a line.
fn word(index: usize, new: &str) -> impl Fn(&str) -> String {
    move |line| {
        let mut words: Vec<&str> = line.split(' ').collect();
        words[index] = new;
        words.join(" ")
    }
}

/// Swaps two words of a line.
fn swapped(a: usize, b: usize) -> impl Fn(&str) -> String {
    move |line| {
        let mut words: Vec<&str> = line.split(' ').collect();
        words.swap(a, b);
        words.join(" ")
    }
}

/// Changes a line and expects these kinds of faults, in the order of [`FaultKind`].
fn finds(file: &str, line: usize, change: impl Fn(&str) -> String, expected: &[FaultKind]) {
    let faults = broken(file, line, change).unwrap();
    let found: Vec<FaultKind> = faults.counts.keys().copied().collect();
    assert_eq!(found, expected, "{file}:{line}\n{faults}");
}

fn twice(line: &str) -> String {
    format!("{line}\n{line}")
}

fn gone(_: &str) -> String {
    String::new()
}

#[test]
fn each_way_to_break_the_files_is_found() {
    use FaultKind::*;
    // The files: 18 nodes, 24 elements, and 9 shared nodes in each part; the interface has 8
    // triangles.
    let elements = "part.1.elements";
    let boundary = "part.1.boundary";
    finds(elements, 1, str::to_string, &[]);
    finds("part.1.header", 1, word(0, "19"), &[Count]);
    finds("part.1.header", 4, word(1, "23"), &[Count]);
    finds("part.1.header", 5, word(0, "8"), &[Count]);
    finds(elements, 3, word(1, "0"), &[ZeroNumber]);
    finds(boundary, 1, word(1, "0"), &[ZeroNumber]);
    finds("part.2.nodes", 4, twice, &[Count, NodeTwice, UnusedNode]);
    finds("part.1.nodes", 1, word(2, "nan"), &[NotFinite, Inverted]);
    finds("part.2.nodes", 5, word(4, "0.66"), &[CopiesDiffer]);
    finds("part.1.nodes", 1, gone, &[Count, NoSuchNode]);
    finds("part.2.nodes", 18, |l| format!("{l}\n77 -1 0 0 0"), &[Count, UnusedNode]);
    finds("part.2.shared", 2, gone, &[Count, NotShared]);
    finds("part.2.shared", 2, twice, &[Count, WrongHolders]);
    finds("part.2.shared", 2, word(3, "3"), &[WrongHolders]);
    finds("part.2.shared", 2, swapped(2, 3), &[OwnersDiffer]);
    finds("part.1.shared", 9, |l| format!("{l}\n1 2 1 2"), &[Count, NeedlesslyShared]);
    finds(elements, 2, word(0, "1"), &[ElementTwice, WrongParent]);
    finds(elements, 2, twice, &[Count, ElementTwice, SameElement, CrowdedFace]);
    finds(elements, 2, swapped(3, 4), &[Inverted]);
    finds(elements, 2, gone, &[Count, NoBoundary, NoFace]);
    finds(boundary, 2, gone, &[Count, NoBoundary]);
    finds(boundary, 2, twice, &[Count, BoundaryTwice]);
    finds(boundary, 2, word(2, "0"), &[WrongParent]);
    finds(boundary, 2, word(3, "24"), &[WrongParent]);
    finds(boundary, 2, swapped(5, 6), &[Inward]);
    finds(boundary, 2, word(5, "99"), &[NoSuchNode, NoBoundary, NoFace]);
}

#[test]
fn an_element_that_overlaps_its_neighbour_is_found() {
    let dir = tempfile::tempdir().unwrap();
    let mut mesh = two_tets();
    // The second apex on the side of the first: both tets positive, one inside the other.
    mesh.points[4] = crate::Point::new(-1.0, -1.0, -1.0);
    mesh.tets[1].swap(0, 1);
    write_parts(&mesh, &[0, 0], 1, dir.path()).unwrap();
    let faults = check_elmer(dir.path()).unwrap().remove(0).1;
    assert_eq!(faults.count(FaultKind::Overlap), 1, "{faults}");
}

#[test]
fn a_folder_named_for_other_parts_and_an_empty_part_are_found() {
    let mesh = two_tets();
    let dir = tempfile::tempdir().unwrap();
    write_parts(&mesh, &[0, 1], 2, dir.path()).unwrap();
    fs::rename(dir.path().join("partitioning.2"), dir.path().join("partitioning.3")).unwrap();
    fs::write(dir.path().join("partitioning.3/part.2.elements"), "").unwrap();
    let faults = check_elmer(dir.path()).unwrap().remove(0).1;
    assert_eq!(faults.count(FaultKind::PartCount), 1);
    assert_eq!(faults.count(FaultKind::EmptyPart), 1);
}

#[test]
fn a_line_that_is_no_part_of_a_mesh_is_an_error_with_its_place() {
    let message =
        |file: &str, change: &dyn Fn(&str) -> String| broken(file, 2, change).unwrap_err().to_string();
    for (file, change, expected) in [
        (
            "part.1.elements",
            word(2, "808"),
            "part.1.elements:2: the element type is '808'; only 504 and 510 are read here",
        ),
        ("part.1.elements", word(0, "2/x"), "part.1.elements:2: the part behind the slash is not an integer"),
    ] {
        let found = message(file, &change);
        assert!(found.contains(expected), "{found}");
    }
    let found = message("part.2.nodes", &|_| "5 -1 0 0".into());
    assert!(found.contains("part.2.nodes:2: the line ends before its z"), "{found}");
    let found = message("part.2.nodes", &|line| format!("{line} 7"));
    assert!(found.contains("part.2.nodes:2: too much: '7'"), "{found}");
    let found = message("part.2.boundary", &|line| line.replace(' ', "\t"));
    assert!(found.contains("part.2.boundary:2: a tab"), "{found}");
    let found = message("part.2.shared", &|line| line.replacen(" 2 ", " 1 ", 1));
    assert!(found.contains("part.2.shared:2: 1 parts share"), "{found}");
    let found = message("part.1.header", &|_| "two".into());
    assert!(found.contains("part.1.header:2: the count is not an integer"), "{found}");
}

#[test]
fn a_folder_without_a_mesh_and_one_with_several_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    assert!(matches!(read(dir.path()), Err(ReadError::NoElmerMesh(_))));
    let mesh = two_tets();
    write_parts(&mesh, &[0, 1], 2, dir.path()).unwrap();
    write_parts(&mesh, &[0, 0], 1, dir.path()).unwrap();
    assert!(matches!(read(dir.path()), Err(ReadError::SeveralElmerMeshes { found, .. }) if found.len() == 2));
    assert_eq!(check_elmer(dir.path()).unwrap().len(), 3);
    fs::remove_file(dir.path().join("partitioning.2/part.1.header")).unwrap();
    let error = check_elmer(dir.path()).unwrap_err().to_string();
    assert!(error.contains("part.1.header"), "{error}");
}

#[test]
fn what_lies_between_parts_is_written_once_by_the_higher_body() {
    let mesh = cube(4);
    for (ranks, tet_to_rank) in
        [(1, slabs(&mesh, 1)), (2, slabs(&mesh, 2)), (4, slabs(&mesh, 4)), (7, scattered(&mesh, 7))]
    {
        let dir = tempfile::tempdir().unwrap();
        write_parts(&mesh, &tet_to_rank, ranks, dir.path()).unwrap();
        let read = read(dir.path()).unwrap();
        let between = read.parts.iter().flat_map(|part| {
            let body = |id: u32| part.elements.iter().find(|e| e.id == id).map(|e| e.body);
            part.boundary.iter().filter(|b| b.boundary == 3).map(move |b| b.parents.map(body))
        });
        let bodies: Vec<_> = between.collect();
        assert_eq!(bodies.len(), 2 * 4 * 4, "{ranks} parts");
        // A boundary element beside body 1 only, which is behind the patch, would have its normal
        // reversed in Elmer.
        assert!(bodies.iter().all(|parents| parents.contains(&Some(2))), "{bodies:?}");
        assert!(check_elmer(dir.path()).unwrap().iter().all(|(_, faults)| faults.is_empty()));
    }
}

#[test]
fn second_copies_and_turned_normals_between_parts_are_faults() {
    let mesh = cube(2);
    let dir = tempfile::tempdir().unwrap();
    write_parts(&mesh, &slabs(&mesh, 2), 2, dir.path()).unwrap();
    let folder = dir.path().join("partitioning.2");
    let read = read(dir.path()).unwrap();
    let (line, between) = text(&folder.join("part.2.boundary"))
        .lines()
        .zip(&read.parts[1].boundary)
        .find(|(_, b)| b.boundary == 3)
        .map(|(line, b)| (line.to_string(), *b))
        .unwrap();
    let mut face = between.nodes;
    face.sort_unstable();
    let has_face = |nodes: &[u32; 4]| face.iter().all(|node| nodes.contains(node));
    let parent = read.parts[0].elements.iter().find(|e| has_face(&e.nodes)).unwrap().id;
    let judged = |keep: bool, number: u32| {
        let [first, second] = [1, 2].map(|k| folder.join(format!("part.{k}.boundary")));
        let copy = line.replacen(&format!(" {} ", between.parents[0]), &format!(" {parent} "), 1);
        let copy = copy.replacen(" 3 ", &format!(" {number} "), 1);
        let (before, there) = (text(&first), text(&second));
        fs::write(&first, format!("{before}{copy}\n")).unwrap();
        if !keep {
            fs::write(&second, there.replace(&format!("{line}\n"), "")).unwrap();
        }
        let found = check_elmer(dir.path()).unwrap().remove(0).1;
        fs::write(&first, before).unwrap();
        fs::write(&second, there).unwrap();
        use FaultKind::*;
        [BoundaryInTwoParts, NormalTurned, NumbersDiffer].map(|kind| found.count(kind))
    };
    assert_eq!(judged(true, 3), [1, 0, 0]);
    assert_eq!(judged(false, 3), [0, 1, 0]);
    assert_eq!(judged(true, 7), [1, 0, 1]);
}
