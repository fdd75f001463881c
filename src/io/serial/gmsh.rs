//! Gmsh's `.msh`, text: a physical group for each name, elementary entities for patches and bodies (from 1).
//!
//! Version 2.2 can say only one group of an element; Gmsh then repeats the element, which MFEM takes for a second one at the same
//! place and refuses. So where a boundary or body is in several groups the file is of version 4.1, in which an entity has any number of groups, and
//! which Gmsh, meshio and MFEM read.

use super::groups::Groups;
use super::runs::Runs;
use super::{coordinates, ids};
use crate::io::WriteError;
use crate::io::lines::{self, TetLine, TriangleLine, VertexLine};
use crate::io::once::LeftOut;
use crate::io::output::Output;
use crate::io::text::Line;
use crate::mesh::stream::MeshStream;
use crate::mesh::{Label, Names};

/// Writes the mesh.
pub(super) fn write(part: &dyn MeshStream, names: &Names, file: &mut Output) -> Result<(), WriteError> {
    let [patches, bodies] = [&names.patches, &names.bodies].map(|labels| Groups::of(labels));
    if patches.are_apart() && bodies.are_apart() {
        write_2(part, names, &patches, &bodies, file)
    } else {
        write_4(part, names, &patches, &bodies, file)
    }
}

/// The first lines: the version and the names.
fn head(version: &str, patches: &Groups, bodies: &Groups) -> String {
    let mut list = String::new();
    let mut count = 0;
    for (dimension, groups) in [(2, patches), (3, bodies)] {
        for group in groups.list.iter().filter(|group| !group.name.is_empty()) {
            let name = group.name.replace(['"', '\n', '\r'], "_");
            list += &format!("{dimension} {} \"{name}\"\n", group.tag);
            count += 1;
        }
    }
    format!("$MeshFormat\n{version} 0 8\n$EndMeshFormat\n$PhysicalNames\n{count}\n{list}$EndPhysicalNames\n")
}

fn write_2(
    part: &dyn MeshStream,
    names: &Names,
    patches: &Groups,
    bodies: &Groups,
    file: &mut Output,
) -> Result<(), WriteError> {
    let counts = part.counts();
    file.write((head("2.2", patches, bodies) + &format!("$Nodes\n{}\n", counts.vertices)).as_bytes())?;
    lines::vertices(part, file, |line, VertexLine { index, point }| {
        coordinates(line.int(index as u64 + 1).blank(), point);
    })?;
    file.write(format!("$EndNodes\n$Elements\n{}\n", counts.boundary + counts.tets).as_bytes())?;
    let group = |groups: &Groups, of: usize| u64::from(groups.of[of][0]);
    lines::triangles(part, names, &LeftOut::default(), file, |line, triangle: TriangleLine| {
        line.int(triangle.index + 1).bytes(b" 2 2 ").int(group(patches, triangle.patch.index())).blank();
        ids(line.int(u64::from(triangle.patch.0) + 1), triangle.vertices);
    })?;
    lines::tets(part, names, file, |line, tet: TetLine| {
        line.int(counts.boundary + tet.index + 1)
            .bytes(b" 4 2 ")
            .int(group(bodies, tet.body.index()))
            .blank();
        ids(line.int(u64::from(tet.body.0) + 1), tet.vertices);
    })?;
    file.write(b"$EndElements\n")?;
    periodic(part, "Affine", file)
}

/// Nodes stand in one block: Gmsh finds those of a surface by its elements.
fn write_4(
    part: &dyn MeshStream,
    names: &Names,
    patches: &Groups,
    bodies: &Groups,
    file: &mut Output,
) -> Result<(), WriteError> {
    let counts = part.counts();
    let [of_patches, of_bodies] = [Runs::of_patches(part), Runs::of_bodies(part)];
    let first_body = of_bodies.0.first().map_or(1, |run| run.of + 1);
    let n = counts.vertices;
    file.write((head("4.1", patches, bodies) + &entities(part, names, patches, bodies)).as_bytes())?;
    file.write(format!("$Nodes\n1 {n} 1 {n}\n3 {first_body} 0 {n}\n").as_bytes())?;
    lines::vertices(part, file, |line, VertexLine { index, .. }| _ = line.int(index as u64 + 1))?;
    lines::vertices(part, file, |line, VertexLine { point, .. }| coordinates(line, point))?;
    let (blocks, elements) = (of_patches.0.len() + of_bodies.0.len(), counts.boundary + counts.tets);
    file.write(format!("$EndNodes\n$Elements\n{blocks} {elements} 1 {elements}\n").as_bytes())?;
    lines::triangles(part, names, &LeftOut::default(), file, |line, triangle: TriangleLine| {
        begin_block(line, &of_patches, triangle.index, b"2 ", b" 2 ");
        ids(line.int(triangle.index + 1), triangle.vertices);
    })?;
    lines::tets(part, names, file, |line, tet: TetLine| {
        begin_block(line, &of_bodies, tet.index, b"3 ", b" 4 ");
        ids(line.int(counts.boundary + tet.index + 1), tet.vertices);
    })?;
    file.write(b"$EndElements\n")?;
    periodic(part, "16", file)
}

/// The line before the first element of a run: dimension, entity, type, count.
fn begin_block(line: &mut Line, runs: &Runs, element: u64, dimension: &[u8], kind: &[u8]) {
    let run = runs.find(element);
    if run.first == element {
        line.bytes(dimension).int(u64::from(run.of) + 1).bytes(kind).int(run.count).bytes(b"\n");
    }
}

/// The section of patches and bodies with their groups. All have the box of the mesh, as Gmsh itself computes those of entities that have only a mesh.
fn entities(part: &dyn MeshStream, names: &Names, patches: &Groups, bodies: &Groups) -> String {
    let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    for index in 0..part.vertex_blocks() {
        for point in part.vertex_points(index).iter() {
            for axis in 0..3 {
                bounds[0][axis] = bounds[0][axis].min(point[axis]);
                bounds[1][axis] = bounds[1][axis].max(point[axis]);
            }
        }
    }
    let bounds: String = bounds.iter().flatten().map(|x| format!(" {x}")).collect();
    let mut text = format!("$Entities\n0 0 {} {}\n", names.patches.len(), names.bodies.len());
    for groups in [patches, bodies] {
        for (entity, tags) in (1..).zip(&groups.of) {
            text += &format!("{entity}{bounds} {}", tags.len());
            tags.iter().for_each(|tag| text += &format!(" {tag}"));
            text += " 0\n";
        }
    }
    text + "$EndEntities\n"
}

/// The section of periodic patches: for each image its elementary tag and that of the patch it is the image of, the matrix of the motion by
/// rows behind the word that begins it, and the pairs of nodes, image first.
fn periodic(part: &dyn MeshStream, begin: &str, file: &mut Output) -> Result<(), WriteError> {
    let links = part.links();
    if links.is_empty() {
        return Ok(());
    }
    let mut text = format!("$Periodic\n{}\n", links.len());
    for (index, link) in links.iter().enumerate() {
        text += &format!("2 {} {}\n{begin}", link.image.0 + 1, link.of.0 + 1);
        link.motion.to_homogeneous().transpose().iter().for_each(|x| text += &format!(" {x}"));
        let pairs = part.images(index);
        text += &format!("\n{}\n", pairs.len());
        for (image, of) in pairs {
            text += &format!("{} {}\n", image + 1, of + 1);
        }
    }
    file.write((text + "$EndPeriodic\n").as_bytes())
}

/// What the file cannot hold of these names, a sentence each: the numbers of boundaries and bodies that share a name.
pub(super) fn losses(names: &Names) -> Vec<String> {
    let mut losses = Vec::new();
    for (kind, labels) in [("bodies", &names.bodies), ("boundaries", &names.patches)] {
        let groups = Groups::of(labels);
        for group in &groups.list {
            let mut numbers: Vec<u32> = numbers_in(labels, &groups, group.tag).collect();
            numbers.sort_unstable();
            numbers.dedup();
            let numbers: Vec<String> = numbers.into_iter().map(|number| number.to_string()).collect();
            if groups.are_apart() && numbers != [group.tag.to_string()] {
                losses.push(format!(
                    "Gmsh has one number a name: {kind} {} are the physical group {} (`{}`)",
                    numbers.join(", "),
                    group.tag,
                    group.name
                ));
            }
        }
    }
    losses
}

fn numbers_in(labels: &[Label], groups: &Groups, tag: u32) -> impl Iterator<Item = u32> {
    labels.iter().zip(&groups.of).filter(move |(_, tags)| tags.contains(&tag)).map(|(label, _)| label.number)
}
