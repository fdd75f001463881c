//! Tests of halo elements: written, read back, with faults, and in ElmerGrid's variants.

use super::*;
use crate::files::plain::PlainPart;
use crate::files::testing::{cube, names, scattered, slabs, together, two_tets};
use crate::ground::mesh::{Mesh, Rank};
use crate::parallel::halo::{By, WithHalo, halo};
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

/// Writes the parts of a mesh, one by each rank, with a halo or without.
fn write_parts(mesh: &Mesh, tet_to_rank: &[Rank], ranks: u32, by: Option<By>, dir: &Path) {
    together(ranks, |comm| {
        let part = PlainPart::part(mesh, tet_to_rank, ranks, comm.rank());
        match by {
            None => write(comm, &part, &names(), dir).unwrap(),
            Some(by) => {
                let ghosts = halo(comm, &part, by).unwrap();
                write(comm, &WithHalo::new(&part, &ghosts), &names(), dir).unwrap()
            }
        }
    });
}

fn text(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

#[test]
fn two_tets_that_see_each_other_are_written_to_the_letter() {
    let dir = tempfile::tempdir().unwrap();
    let mut mesh = two_tets();
    let between = [1, 2, 3].map(crate::ground::mesh::VertexId);
    mesh.triangles.push(crate::ground::mesh::BoundaryTriangle { vertices: between, patch: csg::PatchId(2) });
    write_parts(&mesh, &[0, 1], 2, Some(By::Faces), dir.path());
    let file = |name: &str| text(&dir.path().join("partitioning.2").join(name));
    assert_eq!(file("part.1.header"), "5 2 4\n2\n303 4\n504 2\n5 0\n");
    assert_eq!(file("part.1.nodes"), "1 -1 0 0 0\n3 -1 1 0 0\n2 -1 0 1 0\n4 -1 0 0 1\n5 -1 1 1 1\n");
    assert_eq!(file("part.1.elements"), "1 1 504 1 3 2 4\n2/2 1 504 3 2 4 5\n");
    // Both parents of an interface element, the part's own first.
    let boundary = "1 1 1 0 303 1 2 3\n2 1 1 0 303 1 3 4\n3 1 1 0 303 1 4 2\n4 3 1 2 303 3 2 4\n";
    assert_eq!(file("part.1.boundary"), boundary);
    // Parts that have a node in halo elements only come last.
    assert_eq!(file("part.1.shared"), "1 2 1 2\n3 2 2 1\n2 2 1 2\n4 2 2 1\n5 2 2 1\n");
    assert_eq!(file("part.2.elements"), "2 1 504 3 2 4 5\n1/1 1 504 1 3 2 4\n");
    assert!(file("part.2.boundary").ends_with("4 3 2 1 303 3 2 4\n"), "{}", file("part.2.boundary"));
    let sorted = |name: &str| file(name).lines().map(String::from).collect::<BTreeSet<_>>();
    assert_eq!(sorted("part.2.shared"), sorted("part.1.shared"));
}

#[test]
fn meshes_with_halos_have_no_faults_and_are_read_as_without() {
    let mesh = cube(4);
    for (ranks, tet_to_rank) in
        [(1, slabs(&mesh, 1)), (2, slabs(&mesh, 2)), (4, slabs(&mesh, 4)), (5, scattered(&mesh, 5))]
    {
        let plain = tempfile::tempdir().unwrap();
        write_parts(&mesh, &tet_to_rank, ranks, None, plain.path());
        for by in [By::Faces, By::Vertices] {
            let dir = tempfile::tempdir().unwrap();
            write_parts(&mesh, &tet_to_rank, ranks, Some(by), dir.path());
            for (layout, faults) in check_elmer(dir.path()).unwrap() {
                assert!(faults.is_empty(), "{layout:?}\n{faults}");
            }
            let (with, without) = (read(dir.path()).unwrap(), read(plain.path()).unwrap());
            for (with, without) in with.parts.iter().zip(&without.parts) {
                assert!(with.elements[..] == without.elements[..] && with.halo.is_empty() == (ranks == 1));
                // Equal but for the parents across cuts and for the interface elements, which both
                // parts have.
                let content = |part: &ElmerPart| {
                    part.boundary.iter().map(|b| (b.boundary, b.parents[0], b.nodes)).collect::<BTreeSet<_>>()
                };
                assert!(content(with).is_superset(&content(without)));
                let twice: Vec<_> = content(with).difference(&content(without)).copied().collect();
                assert!(twice.iter().all(|(number, ..)| *number == 3), "between the bodies alone: {twice:?}");
            }
            for readers in [1, 2, 3, 7] {
                let of = |dir: &Path| together(readers, |comm| load(comm, dir).unwrap());
                for (with, without) in of(dir.path()).into_iter().zip(of(plain.path())) {
                    assert!(with.mesh == without.mesh, "{ranks} parts on {readers} ranks, {by:?}");
                    assert_eq!(with.part, without.part);
                    let noted = with.notes.iter().any(|note| note.ends_with(" halo elements left out"));
                    assert_eq!(noted, ranks > 1, "{:?}", with.notes);
                }
            }
        }
    }
}

/// Writes a cube of two slabs with a halo by faces and changes a line of a file: returns the faults
/// found and the reader's message.
fn broken(file: &str, line: usize, change: impl Fn(&str) -> String) -> (Vec<FaultKind>, String) {
    let mesh = cube(2);
    let dir = tempfile::tempdir().unwrap();
    write_parts(&mesh, &slabs(&mesh, 2), 2, Some(By::Faces), dir.path());
    let path = dir.path().join("partitioning.2").join(file);
    let mut lines: Vec<String> = text(&path).lines().map(String::from).collect();
    lines[line - 1] = change(&lines[line - 1]);
    let kept = lines.iter().filter(|line| !line.is_empty());
    fs::write(&path, kept.map(|line| format!("{line}\n")).collect::<String>()).unwrap();
    let said = |ranks| {
        together(ranks, |comm| load(comm, dir.path()).err().map(|e| e.to_string()).unwrap_or_default())
    };
    let loaded = said(1).remove(0);
    assert!(said(2).iter().all(|text| text.ends_with(&loaded)), "{loaded}");
    let judged = check_elmer(dir.path());
    let kinds = judged.map(|mut list| list.remove(0).1.counts.into_keys().collect()).unwrap_or_default();
    (kinds, loaded)
}

#[test]
fn halo_elements_that_are_not_their_owners_are_found() {
    use FaultKind::*;
    // 24 elements, then the 8 of the other part with a face on the cut.
    let elements = "part.1.elements";
    let with = |from: &'static str, to: &'static str| move |line: &str| line.replacen(from, to, 1);
    let judged = |file, line, change: &dyn Fn(&str) -> String| broken(file, line, change).0;
    assert_eq!(judged(elements, 25, &|line| line.into()), []);
    assert_eq!(judged(elements, 25, &with("/2 ", "/1 ")), [WrongHalo]);
    assert_eq!(judged(elements, 25, &with("/2 ", "/3 ")), [WrongHalo]);
    assert_eq!(judged(elements, 25, &with(" 2 504", " 1 504")), [WrongHalo]);
    assert_eq!(judged(elements, 25, &|line| format!("9{line}")), [WrongHalo]);
    assert_eq!(judged(elements, 25, &|line| format!("{line}\n{line}")), [Count, WrongHalo]);
    // Line 3 is the first one on the interface, which both parts have.
    assert_eq!(judged("part.1.boundary", 3, &|_| String::new()), [Count, NoBoundary]);
    let (kinds, said) = broken(elements, 25, with("/2 ", "/0 "));
    assert!(kinds.is_empty() && said.contains("part.1.elements:25: the element is of part 0"), "{said}");
    // A halo element listed as the part's own.
    let (kinds, said) = broken(elements, 25, with("/2 ", " "));
    assert!(kinds.contains(&ElementTwice), "{kinds:?}");
    assert!(said.contains(".elements:") && said.contains("element id twice"), "{said}");
}

#[test]
fn owners_must_hold_what_they_own() {
    let dir = tempfile::tempdir().unwrap();
    let mesh = cube(2);
    write_parts(&mesh, &slabs(&mesh, 2), 2, Some(By::Faces), dir.path());
    let file = |part: u32| dir.path().join(format!("partitioning.2/part.{part}.shared"));
    // The first node that both parts have and only part 1 has in own elements, with part 2 as its
    // owner.
    let held = text(&dir.path().join("partitioning.2/part.1.elements"));
    let mine: BTreeSet<&str> =
        held.lines().filter(|line| !line.contains('/')).flat_map(|line| line.split(' ').skip(3)).collect();
    let halo = text(&dir.path().join("partitioning.2/part.2.elements"));
    let theirs: BTreeSet<&str> =
        halo.lines().filter(|line| !line.contains('/')).flat_map(|line| line.split(' ').skip(3)).collect();
    let shared = text(&file(1));
    let mut nodes = shared.lines().map(|line| line.split(' ').next().unwrap());
    let node = nodes.find(|node| mine.contains(node) && !theirs.contains(node)).unwrap();
    for part in [1, 2] {
        let (before, after) = (format!("{node} 2 1 2"), format!("{node} 2 2 1"));
        let swap = |line: &str| if line == before { after.clone() } else { line.to_string() } + "\n";
        let swapped: String = text(&file(part)).lines().map(swap).collect();
        assert_ne!(swapped, text(&file(part)));
        fs::write(file(part), swapped).unwrap();
    }
    let (_, faults) = check_elmer(dir.path()).unwrap().remove(0);
    assert_eq!(faults.counts.into_iter().collect::<Vec<_>>(), [(FaultKind::OwnerWatches, 1)]);
    for ranks in [1, 2, 3] {
        let said = together(ranks, |comm| load(comm, dir.path()).unwrap_err().to_string());
        let what = "owner that has the node in halo elements only";
        assert!(said.iter().all(|text| text.contains(what)), "{said:?}");
    }
}

/// A partition as ElmerGrid writes it (`SaveElmerInputPartitioned`): whole-mesh numbers, trailing
/// blanks, 12 digits, boundary elements numbered consecutively, `.shared` with the owner first and
/// the others in any order, elements and halo elements of a part in order of their numbers. `halo`
/// is 0, 1 (`-halo`), 2 (`-halobc`) or 4 (`-halogreedy`).
struct ElmerGrid<'a> {
    mesh: &'a Mesh,
    part: &'a [Rank],
    parts: u32,
    halo: u32,
}

impl ElmerGrid<'_> {
    fn write(&self, dir: &Path) {
        let folder = dir.join(format!("partitioning.{}", self.parts));
        fs::create_dir_all(&folder).unwrap();
        let numbers = |vertices: &[crate::ground::mesh::VertexId]| {
            vertices.iter().map(|v| v.0 as usize).collect::<Vec<usize>>()
        };
        let tets: Vec<Vec<usize>> = self.mesh.tets.iter().map(|tet| numbers(tet)).collect();
        let mut holders: Vec<Vec<Rank>> = vec![Vec::new(); self.mesh.points.len()];
        let add = |holders: &mut [Vec<Rank>], tet: &[usize], part: Rank| {
            for &v in tet {
                if !holders[v].contains(&part) {
                    holders[v].push(part);
                }
            }
        };
        for (tet, &part) in tets.iter().zip(self.part) {
            add(&mut holders, tet, part);
        }
        let owners: Vec<Rank> = holders.iter().enumerate().map(|(v, h)| h[v * 7 % h.len()]).collect();
        let held = holders.clone();
        let on_boundary: BTreeSet<usize> =
            self.mesh.triangles.iter().flat_map(|t| numbers(&t.vertices)).collect();
        let sees = |tet: &[usize], other: Rank| match self.halo {
            0 => false,
            1 => (0..4).any(|left| (0..4).all(|k| k == left || held[tet[k]].contains(&other))),
            2 => tet.iter().any(|v| on_boundary.contains(v) && held[*v].contains(&other)),
            _ => tet.iter().any(|v| held[*v].contains(&other)),
        };
        let mut elements = vec![String::new(); self.parts as usize];
        let mut counts = vec![0; self.parts as usize];
        for (t, tet) in tets.iter().enumerate() {
            let of = self.part[t];
            let nodes: String = tet.iter().map(|v| format!("{} ", v + 1)).collect();
            let body = self.mesh.bodies[t].0 + 1;
            for part in (0..self.parts).filter(|&part| part == of || sees(tet, part)) {
                let owner = if part == of { String::new() } else { format!("/{}", of + 1) };
                elements[part as usize] += &format!("{}{owner} {body} 504 {nodes}\n", t + 1);
                counts[part as usize] += 1;
                add(&mut holders, tet, part);
            }
        }
        for part in 0..self.parts {
            let (boundary, kinds) = self.boundary(&tets, &held, part);
            let (mut nodes, mut shared) = (String::new(), String::new());
            for (v, of) in holders.iter().enumerate().filter(|(_, of)| of.contains(&part)) {
                let [x, y, z] = self.mesh.points[v].coords.into();
                nodes += &format!("{} -1 {x:.12} {y:.12} {z:.12}\n", v + 1);
                if of.len() > 1 {
                    shared += &format!("{} {} {}", v + 1, of.len(), owners[v] + 1);
                    of.iter().filter(|p| **p != owners[v]).for_each(|p| shared += &format!(" {}", p + 1));
                    shared += "\n";
                }
            }
            let lines = |text: &str| text.lines().count();
            let [triangles, edges] = kinds;
            let mut header = format!(
                "{:<6} {:<6} {:<6}\n{:<6}\n{:<6} {:<6}\n",
                lines(&nodes),
                counts[part as usize],
                triangles + edges,
                1 + u32::from(triangles > 0) + u32::from(edges > 0),
                504,
                counts[part as usize]
            );
            for (kind, count) in [(202, edges), (303, triangles)].into_iter().filter(|(_, n)| *n > 0) {
                header += &format!("{kind:<6} {count:<6}\n");
            }
            header += &format!("{:<6} {:<6}\n", lines(&shared), 0);
            let files = [("nodes", nodes), ("shared", shared), ("boundary", boundary), ("header", header)];
            for (kind, text) in files.into_iter().chain([("elements", elements[part as usize].clone())]) {
                fs::write(folder.join(format!("part.{}.{kind}", part + 1)), text).unwrap();
            }
        }
    }

    /// The triangles of a part, with one edge among them if it has vertex 1, and the counts of
    /// both.
    fn boundary(&self, tets: &[Vec<usize>], held: &[Vec<Rank>], part: Rank) -> (String, [u32; 2]) {
        let (mut text, mut kinds) = (String::new(), [0; 2]);
        for (number, triangle) in (1..).zip(&self.mesh.triangles) {
            let vertices = triangle.vertices.map(|v| v.0 as usize);
            let mut parents: Vec<usize> =
                (0..tets.len()).filter(|&t| vertices.iter().all(|v| tets[t].contains(v))).collect();
            let here = parents.iter().any(|&t| self.part[t] == part);
            let greedy = matches!(self.halo, 2 | 4) && vertices.iter().any(|v| held[*v].contains(&part));
            // ElmerGrid keeps both parents of an interior boundary element in one part; if the
            // partition does not, one part has the triangle.
            let body = |t: &usize| self.mesh.bodies[*t];
            let theirs = parents.iter().max_by_key(|t| body(t)).is_some_and(|&t| self.part[t] != part);
            if !here && !greedy || self.halo == 0 && theirs {
                continue;
            }
            if self.halo == 0 {
                parents.retain(|&t| self.part[t] == part);
            }
            let parent = |k: usize| parents.get(k).map_or(0, |t| t + 1);
            let [a, b, c] = vertices.map(|v| v + 1);
            text +=
                &format!("{number} {} {} {} 303 {a} {b} {c}\n", triangle.patch.0 + 1, parent(0), parent(1));
            kinds[0] += 1;
        }
        if held[0].contains(&part) && held[1].contains(&part) {
            text += &format!("{} 9 0 0 202 1 2\n", self.mesh.triangles.len() + 1);
            kinds[1] += 1;
        }
        (text, kinds)
    }
}

#[test]
fn partitions_in_elmergrids_dialect_are_read_with_each_of_its_halos() {
    let mut mesh = cube(4);
    // Resolution of 12 digits.
    mesh.points.iter_mut().for_each(|p| *p = p.map(|x| format!("{x:.12}").parse().unwrap()));
    for (parts, part) in [(2, slabs(&mesh, 2)), (5, slabs(&mesh, 5)), (4, scattered(&mesh, 4))] {
        let plain = tempfile::tempdir().unwrap();
        ElmerGrid { mesh: &mesh, part: &part, parts, halo: 0 }.write(plain.path());
        let expected = together(3, |comm| load(comm, plain.path()).unwrap());
        assert_eq!(expected[0].mesh.totals.boundary, 224);
        let noted = expected[0].notes[0].ends_with(" boundary elements that are points or edges left out");
        assert!(noted && expected[0].notes.len() == 1, "{:?}", expected[0].notes);
        for halo in [0, 1, 2, 4] {
            let dir = tempfile::tempdir().unwrap();
            ElmerGrid { mesh: &mesh, part: &part, parts, halo }.write(dir.path());
            let (_, faults) = check_elmer(dir.path()).unwrap().remove(0);
            assert!(faults.is_empty(), "{parts} parts, halo {halo}\n{faults}");
            let loaded = together(3, |comm| load(comm, dir.path()).unwrap());
            for (with, without) in loaded.iter().zip(&expected) {
                assert!(with.mesh == without.mesh, "{parts} parts, halo {halo}");
            }
            let left_out =
                read(dir.path()).unwrap().parts.iter().any(|part| part.left_out.contains_key(&303));
            assert_eq!(left_out, matches!(halo, 2 | 4), "{parts} parts, halo {halo}");
        }
    }
}
