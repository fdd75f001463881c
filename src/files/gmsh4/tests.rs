use super::*;
use crate::files::testing::{cube, names, scattered, slabs, together, two_tets};
use crate::files::volume;
use crate::ground::kernel::simplex;
use crate::ground::mesh::{Label, Mesh, Order, Rank};
use crate::parallel::distribution::{BareMesh, distribute};
use crate::parallel::halo::{By, Ghosts, WithHalo, halo};
use crate::parallel::migrate::BareStream;
use crate::parallel::refine::{Settings, fixtures, refine};
use csg::PatchId;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;

/// The mesh with its boundary on one patch: those of the tests have no curves between patches.
fn on_one_patch(mut mesh: Mesh) -> Mesh {
    mesh.triangles.iter_mut().for_each(|triangle| triangle.patch = PatchId(1));
    mesh
}

/// What is written on several ranks.
struct Files {
    joined: Vec<u8>,
    parts: Vec<Vec<u8>>,
    ghosts: Vec<Ghosts>,
}

/// Writes the mesh with one rank for each part; with ghosts by vertices if requested.
fn files(mesh: &Mesh, tet_to_rank: &[Rank], ranks: u32, with_halo: bool, storage: Storage) -> Files {
    let folder = tempfile::tempdir().unwrap();
    let (path, stem) = (folder.path().join("m.msh"), folder.path().join("m"));
    let ghosts = together(ranks, |comm| {
        let whole = (comm.rank() == 0).then(|| (mesh.clone(), tet_to_rank.to_vec()));
        let part = BareStream::new(BareMesh::from(distribute(comm, whole).unwrap()));
        let ghosts = halo(comm, &part, By::Vertices).unwrap();
        let with_ghosts = WithHalo::new(&part, &ghosts);
        let part: &dyn MeshStream = if with_halo { &with_ghosts } else { &part };
        let written = write(comm, part, &names(), &path, storage).unwrap();
        assert_eq!(written, Written { files: 1, bytes: fs::metadata(&path).unwrap().len() });
        let written = write_parts(comm, part, &names(), &stem, storage).unwrap();
        assert_eq!(written.files, u64::from(ranks));
        ghosts
    });
    let file = |k: u32| fs::read(folder.path().join(format!("m_{k}.msh"))).unwrap();
    Files { joined: fs::read(&path).unwrap(), parts: (1..=ranks).map(file).collect(), ghosts }
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

const HEAD: &str = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n5\n\
    2 1 \"skin\"\n2 2 \"lid\"\n2 3 \"between\"\n3 1 \"lower\"\n3 2 \"upper\"\n$EndPhysicalNames\n\
    $Entities\n0 0 3 2\n1 0 0 0 1 1 1 1 1 0\n2 0 0 0 1 1 1 1 2 0\n3 0 0 0 1 1 1 1 3 0\n\
    1 0 0 0 1 1 1 1 1 0\n2 0 0 0 1 1 1 1 2 0\n$EndEntities\n";

#[test]
fn two_tets_on_two_ranks_are_written_to_the_letter() {
    let files = files(&on_one_patch(two_tets()), &[0, 1], 2, true, Storage::Text);
    let expected = "$PartitionedEntities\n2\n2\n5 1\n6 2\n0 0 2 2\n\
        4 2 2 1 1 0 0 0 1 1 1 1 2 0\n5 2 2 1 2 0 0 0 1 1 1 1 2 0\n\
        3 3 1 1 1 0 0 0 1 1 1 1 1 0\n4 3 1 1 2 0 0 0 1 1 1 1 1 0\n$EndPartitionedEntities\n\
        $Nodes\n2 5 1 5\n3 3 0 2\n1\n3\n0 0 0\n0 1 0\n3 4 0 3\n2\n4\n5\n1 0 0\n0 0 1\n1 1 1\n$EndNodes\n\
        $Elements\n4 8 1 8\n2 4 2 3\n3 1 3 2\n4 1 2 4\n5 1 4 3\n2 5 2 3\n6 2 3 5\n7 2 5 4\n8 3 4 5\n\
        3 3 4 1\n1 1 2 3 4\n3 4 4 1\n2 2 3 4 5\n$EndElements\n\
        $GhostElements\n2\n1 1 1 2\n2 2 1 1\n$EndGhostElements\n";
    assert_eq!(text(&files.joined), HEAD.to_string() + expected);
    let expected = "$PartitionedEntities\n2\n1\n6 2\n0 0 1 1\n5 2 2 1 2 0 0 0 1 1 1 1 2 0\n\
        4 3 1 1 2 0 0 0 1 1 1 1 1 0\n$EndPartitionedEntities\n\
        $Nodes\n1 5 1 5\n3 4 0 5\n2\n3\n4\n5\n1\n1 0 0\n0 1 0\n0 0 1\n1 1 1\n0 0 0\n$EndNodes\n\
        $Elements\n3 5 1 8\n2 5 2 3\n6 2 3 5\n7 2 5 4\n8 3 4 5\n\
        3 4 4 1\n2 2 3 4 5\n3 6 4 1\n1 1 2 3 4\n$EndElements\n\
        $GhostElements\n1\n1 1 1 2\n$EndGhostElements\n";
    assert_eq!(text(&files.parts[1]), HEAD.to_string() + expected);
}

#[test]
fn a_mesh_of_one_part_has_no_partitions() {
    let files = files(&on_one_patch(two_tets()), &[0, 0], 1, false, Storage::Text);
    let expected = "$Nodes\n1 5 1 5\n3 1 0 5\n1\n2\n3\n4\n5\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 1\n$EndNodes\n\
        $Elements\n2 8 1 8\n2 2 2 6\n3 1 3 2\n4 1 2 4\n5 1 4 3\n6 2 3 5\n7 2 5 4\n8 3 4 5\n\
        3 1 4 2\n1 1 2 3 4\n2 2 3 4 5\n$EndElements\n";
    assert_eq!(text(&files.joined), HEAD.to_string() + expected);
    assert!(files.parts[0] == files.joined);
}

/// An element: its entity by dimension and tag, and its nodes.
type Element = ([u64; 2], Vec<u64>);

/// The content of a text file.
#[derive(Debug, Default)]
struct Parsed {
    nodes: BTreeMap<u64, String>,
    elements: BTreeMap<u64, Element>,
    /// Volumes of ghosts with their parts.
    ghost_volumes: BTreeMap<u64, u64>,
    /// Owner and parts of each ghost.
    ghosts: BTreeMap<u64, (u64, Vec<u64>)>,
}

fn parse(file: &[u8]) -> Parsed {
    let text = text(file);
    let section = |name: &str| -> Vec<&str> {
        let lines = text.lines().skip_while(|line| *line != format!("${name}")).skip(1);
        lines.take_while(|line| *line != format!("$End{name}")).collect()
    };
    let numbers = |line: &str| -> Vec<u64> { line.split(' ').map(|word| word.parse().unwrap()).collect() };
    let mut parsed = Parsed::default();
    let partitioned = section("PartitionedEntities");
    let ghosts = partitioned.get(1).map_or(0, |line| line.parse().unwrap());
    parsed.ghost_volumes.extend(partitioned.iter().skip(2).take(ghosts).map(|line| {
        let [tag, part] = numbers(line)[..] else { panic!("{line}") };
        (tag, part)
    }));
    let nodes = section("Nodes");
    let mut rest = &nodes[1..];
    while let [head, after @ ..] = rest {
        let count = numbers(head)[3] as usize;
        let (tags, after) = after.split_at(count);
        let (points, after) = after.split_at(count);
        for (tag, point) in tags.iter().zip(points) {
            assert_eq!(parsed.nodes.insert(tag.parse().unwrap(), point.to_string()), None, "a node twice");
        }
        rest = after;
    }
    assert_eq!(numbers(nodes[0])[1], parsed.nodes.len() as u64);
    let elements = section("Elements");
    let mut rest = &elements[1..];
    let mut blocks = 0;
    while let [head, after @ ..] = rest {
        let [dimension, entity, _, count] = numbers(head)[..] else { panic!("{head}") };
        let (lines, after) = after.split_at(count as usize);
        for line in lines {
            let line = numbers(line);
            assert!(line[1..].iter().all(|node| parsed.nodes.contains_key(node)), "a missing node");
            let element = ([dimension, entity], line[1..].to_vec());
            assert_eq!(parsed.elements.insert(line[0], element), None, "an element twice");
        }
        blocks += 1;
        rest = after;
    }
    assert_eq!(numbers(elements[0])[..2], [blocks, parsed.elements.len() as u64]);
    for line in section("GhostElements").iter().skip(1) {
        let line = numbers(line);
        assert_eq!(line[2] as usize, line.len() - 3);
        parsed.ghosts.insert(line[0], (line[1], line[3..].to_vec()));
    }
    parsed
}

#[test]
fn parts_cover_the_joined_file_once_and_their_ghosts_are_those_of_the_halo() {
    for ranks in [2, 4, 7] {
        let mesh = on_one_patch(cube(4));
        let files = files(&mesh, &scattered(&mesh, ranks), ranks, true, Storage::Text);
        let joined = parse(&files.joined);
        assert_eq!((joined.nodes.len(), joined.elements.len()), (125, 384 + 192 + 32));
        let mut covered = BTreeSet::new();
        for (number, (file, ghosts)) in (1..).zip(files.parts.iter().zip(&files.ghosts)) {
            let part = parse(file);
            assert!(part.nodes.iter().all(|(tag, point)| joined.nodes[tag] == *point));
            let ghost_tags: BTreeSet<u64> = ghosts.tets.iter().map(|tet| tet.id + 1).collect();
            for (tag, (entity, nodes)) in &part.elements {
                assert_eq!(joined.elements[tag].1, *nodes);
                let is_ghost = entity[0] == 3 && part.ghost_volumes.get(&entity[1]) == Some(&number);
                assert_eq!(is_ghost, ghost_tags.contains(tag));
                assert!(is_ghost || joined.elements[tag].0 == *entity && covered.insert(*tag));
            }
            assert!(part.ghosts.keys().eq(&ghost_tags));
            for tet in &ghosts.tets {
                let owner = u64::from(tet.owner) + 1;
                assert_eq!(part.ghosts[&(tet.id + 1)], (owner, vec![number]));
                let (found, parts) = &joined.ghosts[&(tet.id + 1)];
                assert!(*found == owner && parts.contains(&number));
            }
        }
        assert_eq!(covered.len(), joined.elements.len());
        let copies: usize = joined.ghosts.values().map(|(_, parts)| parts.len()).sum();
        assert_eq!(copies, files.ghosts.iter().map(|ghosts| ghosts.tets.len()).sum::<usize>());
    }
}

/// Number of elements and measure of bodies and of boundaries by name.
fn sizes(found: &volume::VolumeMesh) -> BTreeMap<String, (usize, f64)> {
    let mut sizes: BTreeMap<String, (usize, f64)> = BTreeMap::new();
    let mut add = |label: &Label, size: f64| {
        for name in &label.names {
            let sum = sizes.entry(name.clone()).or_default();
            *sum = (sum.0 + 1, sum.1 + size);
        }
    };
    let points = &found.mesh.points;
    for (tet, body) in found.mesh.tets.iter().zip(&found.mesh.bodies) {
        let [a, b, c, d] = tet.map(|v| points[v.index()]);
        add(&found.names.bodies[body.index()], simplex::volume(&a, &b, &c, &d));
    }
    for triangle in &found.mesh.triangles {
        let [a, b, c] = triangle.vertices.map(|v| points[v.index()]);
        add(&found.names.patches[triangle.patch.index()], simplex::area(&a, &b, &c));
    }
    sizes
}

fn read(file: &[u8]) -> volume::VolumeMesh {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("m.msh");
    fs::write(&path, file).unwrap();
    volume::read(&path).unwrap()
}

#[test]
fn joined_files_are_read_back_from_binary_and_text_alike() {
    for ranks in [1, 2, 4, 7] {
        let mesh = on_one_patch(cube(4));
        for tet_to_rank in [slabs(&mesh, ranks), scattered(&mesh, ranks)] {
            for with_halo in [false, true] {
                let write = |storage| files(&mesh, &tet_to_rank, ranks, with_halo, storage);
                let (of_text, of_binary) = (write(Storage::Text), write(Storage::Binary));
                let (text, binary) = (read(&of_text.joined), read(&of_binary.joined));
                assert_eq!(text.mesh.points, binary.mesh.points);
                assert_eq!((&text.mesh.tets, &text.names), (&binary.mesh.tets, &binary.names));
                let found = sizes(&binary);
                assert_eq!(found.keys().collect::<Vec<_>>(), ["lid", "lower", "upper"]);
                assert_eq!([found["lower"].0, found["upper"].0, found["lid"].0], [192, 192, 224]);
                let off = [found["lower"].1 - 32.0 / 27.0, found["lid"].1 - 112.0 / 9.0];
                assert!(off.iter().all(|off| off.abs() < 1e-9), "{off:?}");
                for (text, binary) in of_text.parts.iter().zip(&of_binary.parts) {
                    let (text, binary) = (read(text), read(binary));
                    let note = "ghost elements of other partitions left out";
                    assert_eq!(binary.notes.iter().any(|said| said.ends_with(note)), with_halo && ranks > 1);
                    assert_eq!(text.mesh.tets, binary.mesh.tets);
                    assert_eq!(text.mesh.points, binary.mesh.points);
                }
            }
        }
    }
}

#[test]
fn nodes_on_edges_are_in_the_order_of_gmsh_in_tets_triangles_and_ghosts() {
    let fixture = fixtures::cube(2, false);
    let folder = tempfile::tempdir().unwrap();
    let (path, stem) = (folder.path().join("m.msh"), folder.path().join("m"));
    let names = Names { bodies: vec![Label::unnamed(1)], patches: (1..=6).map(Label::unnamed).collect() };
    together(2, |comm| {
        let whole = (comm.rank() == 0).then(|| (fixture.mesh.clone(), slabs(&fixture.mesh, 2)));
        let part = distribute(comm, whole).unwrap();
        let settings = Settings { order: Order::Second, ..Settings::default() };
        let part = refine(part, &fixture.projector, 2, &settings).unwrap();
        let ghosts = halo(comm, &part, By::Faces).unwrap();
        let part = WithHalo::new(&part, &ghosts);
        write(comm, &part, &names, &path, Storage::Text).unwrap();
        write_parts(comm, &part, &names, &stem, Storage::Text).unwrap();
    });
    let mut elements = Vec::new();
    for name in ["m.msh", "m_1.msh", "m_2.msh"] {
        let parsed = parse(&fs::read(folder.path().join(name)).unwrap());
        let point = |node: &u64| -> Vec<f64> {
            parsed.nodes[node].split(' ').map(|word| word.parse().unwrap()).collect()
        };
        for (_, nodes) in parsed.elements.values() {
            let edges: &[[usize; 2]] = match nodes.len() {
                6 => &[[0, 1], [1, 2], [2, 0]],
                10 => &[[0, 1], [1, 2], [2, 0], [0, 3], [2, 3], [1, 3]],
                other => panic!("{other} nodes"),
            };
            let corners = nodes.len() - edges.len();
            for (node, [i, j]) in nodes[corners..].iter().zip(edges) {
                let (node, p, q) = (point(node), point(&nodes[*i]), point(&nodes[*j]));
                assert!((0..3).all(|axis| (p[axis] + q[axis] - 2.0 * node[axis]).abs() < 1e-12));
            }
        }
        elements.push(parsed.elements.len() - parsed.ghosts.len());
    }
    // The joined file has its ghosts among the other elements.
    let joined = parse(&fs::read(&path).unwrap());
    assert_eq!(joined.elements.len(), elements[1] + elements[2]);
    assert!(!joined.ghosts.is_empty());
}

#[test]
fn an_entity_without_a_number_is_refused_on_all_ranks() {
    let folder = tempfile::tempdir().unwrap();
    let results = together(2, |comm| {
        let whole = (comm.rank() == 0).then(|| (on_one_patch(two_tets()), vec![0, 1]));
        let part = BareStream::new(BareMesh::from(distribute(comm, whole).unwrap()));
        let names = Names { bodies: names().bodies, patches: Vec::new() };
        write(comm, &part, &names, &folder.path().join("m.msh"), Storage::Binary)
    });
    assert!(results.iter().all(|result| matches!(result, Err(WriteError::UnknownPatch(_)))), "{results:?}");
    assert!(fs::read_dir(folder.path()).unwrap().next().is_none());
}
