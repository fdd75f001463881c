//! Gmsh's text `.msh`: a physical group for each name, elementary entities for patches and bodies
//! (from 1).
//!
//! Version 2.2 has one group an element. For several groups Gmsh repeats the element, which MFEM
//! refuses as a duplicate; and Gmsh ignores periodic pairs in version 2.2. So if a boundary or body
//! is in several groups, or faces are periodic, the file has version 4.1, in which an entity has
//! any number of groups. Gmsh, meshio and MFEM read both.

use super::{coordinates, listed};
use crate::files::WriteError;
use crate::files::gmsh::{Bounds, Groups, bounds, bounds_of_all, physical_names, types};
use crate::files::joined::{Section, Whole};
use crate::files::node_order::GMSH;
use crate::files::runs::Runs;
use crate::files::text::Line;
use crate::ground::comm::Communicator;
use crate::ground::mesh::Names;

/// **Collective.** The sections of the file.
pub(super) fn sections<'a>(
    comm: &dyn Communicator,
    whole: &'a Whole<'a>,
) -> Result<Vec<Section<'a>>, WriteError> {
    let [patches, bodies] = [&whole.names.patches, &whole.names.bodies].map(|labels| Groups::of(labels));
    if patches.are_apart() && bodies.are_apart() && whole.part.links().is_empty() {
        Ok(sections_2(whole, patches, bodies))
    } else {
        sections_4(comm, whole, &patches, &bodies)
    }
}

/// The first lines: version and physical names.
fn head(version: &str, patches: &Groups, bodies: &Groups) -> String {
    format!("$MeshFormat\n{version} 0 8\n$EndMeshFormat\n") + &physical_names(patches, bodies)
}

fn sections_2<'a>(whole: &'a Whole<'a>, patches: Groups, bodies: Groups) -> Vec<Section<'a>> {
    let counts = whole.totals;
    let head = head("2.2", &patches, &bodies) + &format!("$Nodes\n{}\n", counts.vertices);
    let group = |groups: &Groups, of: usize| u64::from(groups.of[of][0]);
    let [triangle_type, tet_type] = types(whole.order()).map(u64::from);
    vec![
        Section::Text(head),
        Section::Vertices(Box::new(|line, number, point| coordinates(line.int(number).blank(), point))),
        Section::Text(format!("$EndNodes\n$Elements\n{}\n", counts.boundary + counts.tets)),
        Section::Triangles(Box::new(move |line, triangle| {
            let group = group(&patches, triangle.patch.index());
            line.int(whole.triangle(triangle)).blank().int(triangle_type).bytes(b" 2 ").int(group).blank();
            whole.triangle_ids(line.int(u64::from(triangle.patch.0) + 1), triangle);
        })),
        Section::Tets(Box::new(move |line, tet| {
            let group = group(&bodies, tet.body.index());
            line.int(counts.boundary + whole.tet(tet)).blank().int(tet_type).bytes(b" 2 ").int(group).blank();
            whole.tet_ids(line.int(u64::from(tet.body.0) + 1), tet, &GMSH);
        })),
        Section::Text("$EndElements\n".into()),
    ]
}

/// The sections of version 4.1. All nodes are in one block: Gmsh finds the nodes of a surface
/// through its elements.
fn sections_4<'a>(
    comm: &dyn Communicator,
    whole: &'a Whole<'a>,
    patches: &Groups,
    bodies: &Groups,
) -> Result<Vec<Section<'a>>, WriteError> {
    let counts = whole.totals;
    let (of_patches, of_bodies) =
        (Runs::of_patches(whole.part, &whole.by_patch, &whole.left_out)?, Runs::of_bodies(whole.part));
    let [blocks] = comm.all_reduce_sum_u64([(of_patches.0.len() + of_bodies.0.len()) as u64])?;
    let first_body = of_bodies.0.first().map_or(1, |run| run.of + 1);
    let (n, elements) = (counts.vertices, counts.boundary + counts.tets);
    let [triangle_type, tet_type] = types(whole.order()).map(u64::from);
    let head = head("4.1", patches, bodies)
        + &entities(whole.names, bounds_of_all(comm, bounds(whole.part))?, patches, bodies)
        + &format!("$Nodes\n1 {n} 1 {n}\n3 {first_body} 0 {n}\n");
    Ok(vec![
        Section::Text(head),
        Section::Vertices(Box::new(|line, number, _| _ = line.int(number))),
        Section::Vertices(Box::new(|line, _, point| coordinates(line, point))),
        Section::Text(format!("$EndNodes\n$Elements\n{blocks} {elements} 1 {elements}\n")),
        Section::Triangles(Box::new(move |line, triangle| {
            begin_block(line, &of_patches, triangle.index, 2, triangle_type);
            whole.triangle_ids(line.int(whole.triangle(triangle)), triangle);
        })),
        Section::Tets(Box::new(move |line, tet| {
            begin_block(line, &of_bodies, tet.index, 3, tet_type);
            whole.tet_ids(line.int(counts.boundary + whole.tet(tet)), tet, &GMSH);
        })),
        Section::Text(String::from("$EndElements\n") + &periodic(whole)),
    ])
}

/// Starts a block before the first element of a run: dimension, entity, type, count.
fn begin_block(line: &mut Line, runs: &Runs, element: u64, dimension: u64, kind: u64) {
    let run = runs.find(element);
    if run.first == element {
        line.int(dimension).blank().int(u64::from(run.of) + 1).blank().int(kind);
        line.blank().int(run.count).bytes(b"\n");
    }
}

/// The section of patches and bodies with their groups. All get the box of the mesh, as Gmsh itself
/// does for entities without geometry.
fn entities(names: &Names, bounds: Bounds, patches: &Groups, bodies: &Groups) -> String {
    let bounds: String = bounds.iter().map(|x| format!(" {x}")).collect();
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

/// The section of periodic patches: the elementary tags of each copy and its master, the matrix of
/// the motion by rows preceded by its length, and the pairs of nodes, copy first. Empty without
/// periodic patches.
fn periodic(whole: &Whole) -> String {
    let links = whole.part.links();
    if links.is_empty() {
        return String::new();
    }
    let mut pairs: Vec<String> = vec![String::new(); links.len()];
    let mut counts = vec![0_u64; links.len()];
    for &[image, of, link] in &whole.pairs {
        pairs[link as usize] += &format!("{image} {of}\n");
        counts[link as usize] += 1;
    }
    let mut text = format!("$Periodic\n{}\n", links.len());
    for ((link, pairs), count) in links.iter().zip(pairs).zip(counts) {
        text += &format!("2 {} {}\n16", link.image.0 + 1, link.of.0 + 1);
        link.motion.to_homogeneous().transpose().iter().for_each(|x| text += &format!(" {x}"));
        text += &format!("\n{count}\n{pairs}");
    }
    text + "$EndPeriodic\n"
}

/// Names that the file cannot represent, one sentence each: numbers of boundaries and bodies
/// replaced by that of another with the same name.
pub(super) fn losses(names: &Names) -> Vec<String> {
    let mut losses = Vec::new();
    for (kind, labels) in [("bodies", &names.bodies), ("boundaries", &names.patches)] {
        let groups = Groups::of(labels);
        let mut lost: Vec<(u32, &[u32], &[String])> = (labels.iter().zip(&groups.of))
            .filter(|(label, tags)| !tags.contains(&label.number))
            .map(|(label, tags)| (label.number, tags.as_slice(), label.names.as_slice()))
            .collect();
        lost.sort_unstable();
        lost.dedup();
        let one = |(number, tags, names): &(u32, &[u32], &[String])| {
            let groups: Vec<String> =
                tags.iter().zip(*names).map(|(tag, name)| format!("{tag} (`{name}`)")).collect();
            format!("{number} in {}", groups.join(" and "))
        };
        if !lost.is_empty() {
            let list = listed(lost.iter().map(one));
            losses.push(format!("Gmsh has one number a name: of {kind}, {list}"));
        }
    }
    losses
}
