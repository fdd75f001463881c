//! Tests of groups and periodic pairs in files, and of writing and reading them back.

use super::*;
use crate::files::plain::PlainPart;
use crate::files::serial;
use crate::files::testing::two_tets;
use crate::ground::mesh::{Label, VertexId};
use std::fs;

fn read_as(name: &str, content: &str) -> VolumeMesh {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join(name), content).unwrap();
    read(&dir.path().join(name)).unwrap()
}

fn several(number: u32, names: &[&str]) -> Label {
    Label { number, names: names.iter().map(ToString::to_string).collect() }
}

/// Points of two tets for Gmsh 2.2, up to the elements.
const HEAD: &str = "$Nodes\n5\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n5 1 1 1\n$EndNodes\n$Elements\n";

/// A file of version 2.2 with these elements of two tets: type, physical group, entity and nodes.
fn gmsh_2(names: &str, elements: &[&str]) -> String {
    let mut text = format!("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n{names}{HEAD}{}\n", elements.len());
    for (id, element) in (1..).zip(elements) {
        let (kind, rest) = element.split_once(' ').unwrap();
        text += &format!("{id} {kind} 2 {rest}\n");
    }
    text + "$EndElements\n"
}

const NAMES: &str =
    "$PhysicalNames\n4\n2 1 \"all\"\n2 2 \"clamp\"\n3 7 \"solid\"\n3 8 \"everything\"\n$EndPhysicalNames\n";

#[test]
fn an_element_that_gmsh_repeats_for_its_groups_is_one_in_all_of_them() {
    let elements = [
        "2 1 1 1 3 2",
        "2 1 1 1 2 4",
        "2 1 1 1 4 3",
        "2 1 2 2 3 5",
        "2 2 2 2 3 5",
        "2 1 2 2 5 4",
        "2 2 2 2 5 4",
        "2 2 2 3 4 5",
        "2 1 2 3 4 5",
        "4 7 1 1 2 3 4",
        "4 8 1 1 2 3 4",
        "4 7 2 2 3 4 5",
        "4 8 2 2 3 4 5",
    ];
    let found = read_as("m.msh", &gmsh_2(NAMES, &elements));
    assert_eq!((found.mesh.tets.len(), found.mesh.triangles.len()), (2, 7));
    assert_eq!(found.names.patches[..2], [several(1, &["all"]), several(2, &["all", "clamp"])]);
    // Both volumes are in the same groups but remain two bodies; the face between them is another
    // boundary.
    let solid = several(9, &["solid", "everything"]);
    let solid = Label { number: found.names.bodies[0].number, ..solid };
    assert_eq!(found.names.bodies, [solid.clone(), solid]);
    assert_eq!(found.names.patches.len(), 3);
    assert!(found.names.patches[2].names.is_empty());
    assert_eq!(found.notes.len(), 1, "{:?}", found.notes);
}

#[test]
fn groups_come_back_from_what_is_written() {
    let names = Names {
        bodies: vec![several(3, &["solid", "everything"])],
        patches: vec![several(1, &["all"]), several(2, &["all", "clamp"])],
    };
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("m.msh");
    serial::write(&PlainPart::whole(&two_tets()), &names, &path).unwrap();
    let found = read(&path).unwrap();
    assert_eq!(found.names.patches, names.patches);
    assert_eq!(found.names.bodies[0].names, names.bodies[0].names);
    assert!(found.notes.is_empty(), "{:?}", found.notes);
}

#[test]
fn an_unnamed_group_that_shares_faces_is_named_with_a_note() {
    let elements = ["2 1 1 1 3 2", "2 9 1 1 3 2", "2 9 2 1 2 4", "4 7 1 1 2 3 4"];
    let found = read_as("m.msh", &gmsh_2(NAMES, &elements));
    assert_eq!(found.names.patches[0], several(1, &["all", "group_9"]));
    assert_eq!(found.names.patches[1], several(9, &["group_9"]));
    assert!(
        found.notes[0].starts_with("the physical group 9 of boundaries has no name"),
        "{:?}",
        found.notes
    );
}

#[test]
fn groups_of_one_name_are_one() {
    let names = "$PhysicalNames\n2\n2 1 \"skin\"\n2 2 \"skin\"\n$EndPhysicalNames\n";
    let elements = ["2 1 1 1 3 2", "2 2 1 1 3 2", "2 1 2 1 2 4", "4 7 1 1 2 3 4"];
    let found = read_as("m.msh", &gmsh_2(names, &elements));
    assert_eq!(found.names.patches[..2], [Label::new(2, "skin"), Label::new(1, "skin")]);
}

#[test]
fn entities_stay_apart_without_groups_and_beside_them() {
    let elements = ["2 0 4 1 3 2", "2 0 4 1 2 4", "2 0 6 1 4 3", "4 0 11 1 2 3 4", "4 0 12 2 3 4 5"];
    let found = read_as("m.msh", &gmsh_2("", &elements));
    let numbers = |labels: &[Label]| labels.iter().map(|label| label.number).collect::<Vec<_>>();
    assert_eq!(numbers(&found.names.bodies), [11, 12]);
    assert_eq!(numbers(&found.names.patches)[..2], [4, 6]);
    // One face is in a group: the others get numbers different from those of groups and from each
    // other.
    let grouped = ["2 5 4 1 3 2", "2 0 4 1 2 4", "2 0 6 1 4 3", "4 0 11 1 2 3 4"];
    let found = read_as("m.msh", &gmsh_2("", &grouped));
    let of_faces: Vec<u32> =
        found.mesh.triangles.iter().map(|t| found.names.patches[t.patch.index()].number).collect();
    assert_eq!(of_faces, [5, 7, 8, 6]);
    assert!(
        found.notes.contains(&"boundary without number in the file: 7 to 8 here".to_string()),
        "{:?}",
        found.notes
    );
}

#[test]
fn version_4_has_groups_by_entity() {
    let text = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n2 1 \"all\"\n2 2 \"clamp\"\n$EndPhysicalNames\n\
        $Entities\n0 0 2 1\n3 0 0 0 1 1 1 2 1 -2 0\n4 0 0 0 1 1 1 1 1 0\n5 0 0 0 1 1 1 0 0\n$EndEntities\n\
        $Nodes\n1 4 1 4\n3 5 0 4\n1\n2\n3\n4\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n$EndNodes\n\
        $Elements\n3 5 1 5\n2 3 2 1\n1 1 3 2\n2 4 2 3\n2 1 2 4\n3 1 4 3\n4 2 3 4\n3 5 4 1\n5 1 2 3 4\n$EndElements\n";
    let found = read_as("m.msh", text);
    assert_eq!(found.names.patches, [several(2, &["all", "clamp"]), several(1, &["all"])]);
    // No volume is in a group.
    assert_eq!(found.names.bodies, [Label::unnamed(5)]);
}

#[test]
fn netgens_default_is_no_name() {
    let text = samples::VOL.replace("bcnames\n1\n5 skin of it", "bcnames\n1\n5 default");
    assert_eq!(read_as("m.vol", &text).names.patches, [Label::unnamed(5)]);
}

/// A column of two cubes of six tets each, periodic along z, with the text `periodic` of the vertex
/// pairs at its ends; `stretch` distorts the upper end.
fn column(periodic: impl Fn(&[[u32; 2]]) -> String, stretch: f64) -> String {
    let mesh = crate::ground::mesh::fixtures::lattice_box([1, 1, 2], |_| 0);
    let mut text = format!("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{}\n", mesh.points.len());
    let height = mesh.points.iter().map(|p| p.z).fold(0.0, f64::max);
    let is_top = |v: VertexId| mesh.points[v.index()].z == height;
    for (id, p) in (1..).zip(&mesh.points) {
        let shift = if p.z == height { stretch * p.x } else { 0.0 };
        text += &format!("{id} {} {} {}\n", p.x + shift, p.y, p.z);
    }
    text += &format!("$EndNodes\n$Elements\n{}\n", mesh.triangles.len() + mesh.tets.len());
    for t in &mesh.triangles {
        let entity = t.patch.0 + 1;
        let [a, b, c] = t.vertices.map(|v| v.0 + 1);
        text += &format!("1 2 2 {entity} {entity} {a} {b} {c}\n");
    }
    for t in &mesh.tets {
        let [a, b, c, d] = t.map(|v| v.0 + 1);
        text += &format!("1 4 2 1 1 {a} {b} {c} {d}\n");
    }
    let mut pairs = Vec::new();
    for v in (0..mesh.points.len() as u32).filter(|v| is_top(VertexId(*v))) {
        let p = mesh.points[v as usize];
        let of = mesh.points.iter().position(|q| (q.x, q.y, q.z) == (p.x, p.y, 0.0)).unwrap();
        pairs.push([v + 1, of as u32 + 1]);
    }
    text + "$EndElements\n" + &periodic(&pairs)
}

/// The text of a `$Periodic` section.
type Section = fn(&[[u32; 2]]) -> String;

fn section(pairs: &[[u32; 2]]) -> String {
    let lines: String = pairs.iter().map(|[image, of]| format!("{image} {of}\n")).collect();
    format!(
        "$Periodic\n1\n2 6 5\nAffine 1 0 0 0 0 1 0 0 0 0 1 2 0 0 0 1\n{}\n{lines}$EndPeriodic\n",
        pairs.len()
    )
}

#[test]
fn periodic_pairs_become_links_and_come_back() {
    let first = read_as("m.msh", &column(section, 0.0));
    assert!(first.notes.is_empty(), "{:?}", first.notes);
    let [link] = &first.links[..] else { panic!("{:?}", first.links) };
    let height = first.mesh.points.iter().map(|p| p.z).fold(0.0, f64::max);
    assert_eq!(link.motion, nalgebra::Isometry3::translation(0.0, 0.0, height));
    let on = |patch| first.mesh.triangles.iter().find(|t| t.patch == patch).unwrap().vertices[0];
    assert_eq!(first.mesh.points[on(link.of).index()].z, 0.0);
    assert_eq!(first.mesh.points[on(link.image).index()].z, height);
}

#[test]
fn pairs_without_rigid_motion_or_whole_patch_are_dropped_with_a_note() {
    let found = read_as("m.msh", &column(section, 0.1));
    assert!(
        found.links.is_empty() && found.notes[0].contains("not a rigid motion of another"),
        "{:?}",
        found.notes
    );
    let crossed = |pairs: &[[u32; 2]]| {
        let [a, b] = [pairs[0], pairs[1]];
        section(&[[a[0], b[1]], [b[0], a[1]], pairs[2], pairs[3]])
    };
    let part = |pairs: &[[u32; 2]]| section(&pairs[..3]);
    let twice = |pairs: &[[u32; 2]]| section(&[pairs[0], [pairs[0][0], pairs[1][1]]]);
    let said: [(Section, &str); 3] = [
        (crossed, "1 periodic surface whose triangles are not those of another"),
        (part, "1 periodic surface whose triangles are not those of another"),
        (twice, "not paired one to one"),
    ];
    for (pairs, note) in said {
        let found = read_as("m.msh", &column(pairs, 0.0));
        assert!(found.links.is_empty());
        assert!(found.notes.iter().any(|n| n.contains(note)), "{note}: {:?}", found.notes);
    }
}

#[test]
fn a_cut_section_of_pairs_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("m.msh");
    let text = column(section, 0.0);
    fs::write(&path, &text[..text.len() - 20]).unwrap();
    assert!(read(&path).is_err());
}
