//! Files written by several ranks have the same mesh as the file of one rank.

use super::Written;
use super::plain::PlainPart;
use super::serial::{Format, write_joined};
use super::testing::{cube, names, scattered, slabs, together, two_tets};
use super::volume;
use crate::ground::mesh::{Mesh, Names, Rank};
use std::fs;
use std::path::Path;

const FILES: [&str; 3] = ["m.msh", "m.mesh", "m.vol"];

/// Writes a mesh in parts and returns the text of the file.
fn written(mesh: &Mesh, tet_to_rank: &[Rank], ranks: u32, path: &Path) -> String {
    let written = together(ranks, |comm| {
        let part = PlainPart::part(mesh, tet_to_rank, ranks, comm.rank());
        write_joined(comm, &part, &names(), Format::of(path).unwrap(), path).unwrap()
    });
    let text = fs::read_to_string(path).unwrap();
    assert!(written.iter().all(|w| *w == Written { files: 1, bytes: text.len() as u64 }), "{written:?}");
    text
}

/// Tets with their bodies and triangles with their boundary numbers, by vertex coordinates.
type Places = (Vec<(Vec<[u64; 3]>, u32)>, Vec<(Vec<[u64; 3]>, u32)>);

fn places(mesh: &Mesh, names: &Names) -> Places {
    let places = |vertices: &[crate::ground::mesh::VertexId]| {
        let place =
            |v: &crate::ground::mesh::VertexId| <[f64; 3]>::from(mesh.points[v.index()]).map(f64::to_bits);
        let mut places: Vec<[u64; 3]> = vertices.iter().map(place).collect();
        places.sort_unstable();
        places
    };
    let tets = mesh.tets.iter().zip(&mesh.bodies);
    let mut tets: Vec<_> = tets.map(|(t, body)| (places(t), names.bodies[body.index()].number)).collect();
    let triangles = mesh.triangles.iter();
    let mut triangles: Vec<_> =
        triangles.map(|t| (places(&t.vertices), names.patches[t.patch.index()].number)).collect();
    tets.sort_unstable();
    triangles.sort_unstable();
    (tets, triangles)
}

#[test]
fn any_number_of_ranks_write_the_same_mesh() {
    let mesh = cube(4);
    let dir = tempfile::tempdir().unwrap();
    for name in FILES {
        let path = dir.path().join(name);
        for (ranks, tet_to_rank) in
            [(2, slabs(&mesh, 2)), (3, scattered(&mesh, 3)), (7, scattered(&mesh, 7)), (7, slabs(&mesh, 3))]
        {
            let text = written(&mesh, &tet_to_rank, ranks, &path);
            let alone = written(&mesh, &slabs(&mesh, 1), 1, &dir.path().join(format!("alone.{name}")));
            assert_eq!(text.lines().count(), alone.lines().count(), "{name} of {ranks}");
            let found = volume::read(&path).unwrap();
            assert_eq!(found.mesh.points.len(), 125, "each vertex once: {name} of {ranks}");
            assert_eq!(places(&found.mesh, &found.names), places(&mesh, &names()), "{name} of {ranks}");
            let lost = |note: &String| !note.contains("orientation");
            assert!(!found.notes.iter().any(lost), "{name} of {ranks}: {:?}", found.notes);
        }
        assert_eq!(fs::read_dir(dir.path()).unwrap().count() % 2, 0, "no other files are left");
    }
}

#[test]
fn elements_are_numbered_without_a_gap() {
    let dir = tempfile::tempdir().unwrap();
    let mesh = cube(4);
    let text = written(&mesh, &scattered(&mesh, 5), 5, &dir.path().join("m.msh"));
    let section = |from: &str, to: &str| {
        let inner = text.split(from).nth(1).unwrap().split(to).next().unwrap();
        let number = |line: &str| line.split(' ').next().unwrap().parse::<u32>().unwrap();
        inner.trim().lines().map(number).collect::<Vec<u32>>()
    };
    let nodes = section("$Nodes", "$EndNodes");
    assert!(nodes[1..].iter().copied().eq(1..=125));
    let elements = section("$Elements", "$EndElements");
    assert!(elements[1..].iter().copied().eq(1..=224 + 384));
}

#[test]
fn bodies_of_other_parts_are_in_front_of_interfaces() {
    let dir = tempfile::tempdir().unwrap();
    let mesh = cube(4);
    // The interface of the bodies is also the cut between parts at first, then lies inside them.
    for (ranks, tet_to_rank) in [(2, slabs(&mesh, 2)), (7, scattered(&mesh, 7))] {
        let text = written(&mesh, &tet_to_rank, ranks, &dir.path().join("m.vol"));
        let surface = text.lines().skip_while(|line| *line != "surfaceelements").skip(2).take(192 + 32);
        let (interface, outer): (Vec<&str>, Vec<&str>) = surface.partition(|line| line.starts_with("3 3 "));
        assert_eq!((interface.len(), outer.len()), (32, 192));
        assert!(interface.iter().all(|line| line.starts_with("3 3 1 2 3 ")), "{interface:?}");
        assert!(outer.iter().all(|line| line.starts_with("1 1 1 0 3 ") || line.starts_with("2 2 2 0 3 ")));
    }
}

#[test]
fn a_rank_without_tets_writes_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let mesh = two_tets();
    let alone = written(&mesh, &[0, 0], 1, &dir.path().join("m.mesh"));
    assert_eq!(written(&mesh, &[0, 0], 3, &dir.path().join("m.mesh")), alone);
}

#[test]
fn halos_and_numbers_that_are_missing_are_refused_on_all_ranks() {
    let dir = tempfile::tempdir().unwrap();
    let mesh = two_tets();
    together(2, |comm| {
        let part = PlainPart::part(&mesh, &[0, 1], 2, comm.rank());
        let ghosts = crate::parallel::halo::halo(comm, &part, crate::parallel::halo::By::Faces).unwrap();
        for name in FILES {
            let path = dir.path().join(name);
            let with_halo = crate::parallel::halo::WithHalo::new(&part, &ghosts);
            let error = write_joined(comm, &with_halo, &names(), Format::of(&path).unwrap(), &path)
                .unwrap_err()
                .to_string();
            assert!(error.contains("no halo elements"), "{error}");
            // The lid is on rank 1 only.
            let few = Names { patches: names().patches[..1].to_vec(), ..names() };
            let error =
                write_joined(comm, &part, &few, Format::of(&path).unwrap(), &path).unwrap_err().to_string();
            assert!(error.contains("patch 1 has no boundary number"), "{error}");
        }
    });
    assert!(fs::read_dir(dir.path()).unwrap().next().is_none());
}
