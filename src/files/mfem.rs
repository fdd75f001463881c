//! MFEM's parallel text, which `ParMesh(comm, stream)` reads on each rank.
//!
//! ```text
//! MFEM mesh v1.2      dimension, elements, boundary, vertices: the part, by local index; version
//!                     1.3 if there are names: attribute_sets, bdr_attribute_sets
//! mfem_serial_mesh_end
//! communication_groups    sets of ranks; group 0 is this rank alone
//! total_shared_...        counts of shared entities
//! shared_vertices n       for each further group the entities that exactly its ranks share:
//! shared_edges n          vertices, edges and triangles by local vertices, in the same order
//! shared_faces n          on all these ranks
//! mfem_mesh_end
//! ```
//! An edge whose ends are both shared is not always shared, so the text needs the edges and faces
//! of a [`DistMesh`]. Attributes are the numbers of bodies and boundaries. Vertices of periodic
//! faces stay separate.

use super::text::Line;
use super::{WriteError, body_number, patch_number};
use crate::ground::mesh::{Label, Names, Rank, VertexId};
use crate::parallel::distribution::{DistMesh, Shared};
use std::collections::{BTreeMap, BTreeSet};
use std::io::Write;

/// MFEM's local numbers are 32-bit integers.
const MOST: u64 = i32::MAX as u64;

/// MFEM's numbers of the geometries of elements.
const TRIANGLE: u64 = 2;
const TET: u64 = 4;

/// *Local.* A part as the text that MFEM's `ParMesh(comm, stream)` reads on this rank.
///
/// Attribute sets have the names of bodies and boundaries, which MFEM 4.8 and later read. Older ones
/// read the text of a mesh without names: give `Names` from which they were removed.
///
/// A triangle between two parts is in the text of the part with the tet behind it, as in a mesh
/// that MFEM partitions itself. The files of MFEM's examples are named `NAME.000000`, `NAME.000001`
/// and so on, by rank.
///
/// ```
/// use tetmill::comm::thread;
/// use tetmill::{Error, Geometry, Mesher, files::mfem};
///
/// let ball = Geometry::from_text("algebraic3d solid ball = sphere (0, 0, 0; 1); tlo ball;")?;
/// let texts = thread::try_run(2, |comm| -> Result<Vec<u8>, Error> {
///     let mesh = Mesher::new().generate_on(comm, Some(&ball))?;
///     Ok(mfem::part_text(&mesh.with_edges_and_faces(comm)?, &mesh.names)?)
/// })?;
/// assert!(texts.iter().all(|text| text.starts_with(b"MFEM mesh v1.3\n")), "the body has a name");
/// # Ok::<(), Error>(())
/// ```
///
/// # Errors
/// If the part has more vertices or tets than MFEM can number, or a body or patch has no number.
pub fn part_text(part: &DistMesh, names: &Names) -> Result<Vec<u8>, WriteError> {
    for (what, count) in [("vertices", part.points.len()), ("tets", part.tets.len())] {
        if count as u64 > MOST {
            return Err(WriteError::TooMany { format: "MFEM", what, count: count as u64, limit: MOST });
        }
    }
    let sets = [&names.bodies, &names.patches].map(|labels| by_name(labels));
    let has_names = sets.iter().any(|sets| !sets.is_empty());
    let mut text = Vec::new();
    title(&mut text, "MFEM mesh v1.", if has_names { 3 } else { 2 });
    write_elements(part, names, &mut text)?;
    if has_names {
        write_sets("attribute_sets", &sets[0], &mut text);
    }
    write_boundary(part, names, &mut text)?;
    if has_names {
        write_sets("bdr_attribute_sets", &sets[1], &mut text);
    }
    write_vertices(part, &mut text);
    write_groups(part, &mut text);
    Ok(text)
}

/// Appends a title and a count.
fn title(text: &mut Vec<u8>, title: &str, count: usize) {
    writeln!(text, "{title}{count}").expect("memory can be written to");
}

/// Ends a line with the vertices of an element.
fn end(line: &mut Line, vertices: &[VertexId], text: &mut Vec<u8>) {
    for vertex in vertices {
        line.blank().int(vertex.0.into());
    }
    line.end(text);
}

/// The numbers of each name.
fn by_name(labels: &[Label]) -> BTreeMap<&str, BTreeSet<u32>> {
    let mut sets: BTreeMap<&str, BTreeSet<u32>> = BTreeMap::new();
    for label in labels {
        for name in &label.names {
            sets.entry(name).or_default().insert(label.number);
        }
    }
    sets
}

fn write_sets(section: &str, sets: &BTreeMap<&str, BTreeSet<u32>>, text: &mut Vec<u8>) {
    title(text, &format!("\n{section}\n"), sets.len());
    let mut line = Line::default();
    for (name, numbers) in sets {
        let quoted = name.replace('\\', "\\\\").replace('"', "\\\"");
        title(text, &format!("\"{quoted}\"\n"), numbers.len());
        for (index, &number) in numbers.iter().enumerate() {
            if index > 0 {
                line.blank();
            }
            line.int(number.into());
        }
        line.end(text);
    }
}

fn write_elements(part: &DistMesh, names: &Names, text: &mut Vec<u8>) -> Result<(), WriteError> {
    title(text, "\ndimension\n3\n\nelements\n", part.tets.len());
    let mut line = Line::default();
    for (tet, body) in part.tets.iter().zip(&part.tet_bodies) {
        line.int(body_number(Some(*body), names)?).blank().int(TET);
        end(&mut line, tet, text);
    }
    Ok(())
}

fn write_boundary(part: &DistMesh, names: &Names, text: &mut Vec<u8>) -> Result<(), WriteError> {
    // Each triangle has a tet behind it on one rank, and perhaps one in front of it on another.
    let own = || part.boundary.iter().filter(|triangle| triangle.parents[0].is_some());
    title(text, "\nboundary\n", own().count());
    let mut line = Line::default();
    for triangle in own() {
        line.int(patch_number(Some(triangle.patch), names)?).blank().int(TRIANGLE);
        end(&mut line, &part.boundary_vertices(triangle), text);
    }
    Ok(())
}

fn write_vertices(part: &DistMesh, text: &mut Vec<u8>) {
    title(text, "\nvertices\n", part.points.len());
    text.extend(b"3\n");
    let mut line = Line::default();
    for point in &part.points {
        line.float(point.x).blank().float(point.y).blank().float(point.z).end(text);
    }
    text.extend(b"\nmfem_serial_mesh_end\n\n");
}

/// The entities that exactly the ranks of a group share, as indices into the lists of shared
/// vertices, edges and faces. Local ids ascend with global ids, so the order is the same on all
/// ranks.
type Group = [Vec<u32>; 3];

/// The groups of a part, by their ranks.
fn groups(part: &DistMesh) -> BTreeMap<&[Rank], Group> {
    let mut groups: BTreeMap<&[Rank], Group> = BTreeMap::new();
    let kinds: [&Shared; 3] = [&part.shared_vertices, &part.shared_edges, &part.shared_faces];
    for (kind, shared) in kinds.into_iter().enumerate() {
        for (id, ranks) in shared.iter() {
            groups.entry(ranks).or_default()[kind].push(id);
        }
    }
    groups
}

fn write_groups(part: &DistMesh, text: &mut Vec<u8>) {
    let groups = groups(part);
    title(text, "communication_groups\nnumber_of_groups ", groups.len() + 1);
    text.extend(b"\n# number of entities in each group, followed by ranks in group\n");
    title(text, "1 ", part.rank as usize);
    for ranks in groups.keys() {
        let all: Vec<String> = ranks.iter().map(ToString::to_string).collect();
        writeln!(text, "{} {}", ranks.len(), all.join(" ")).expect("memory can be written to");
    }
    title(text, "\ntotal_shared_vertices ", part.shared_vertices.len());
    title(text, "total_shared_edges ", part.shared_edges.len());
    title(text, "total_shared_faces ", part.shared_faces.len());
    text.extend(b"\n# group 0 has no shared entities\n");
    for (index, group) in (1..).zip(groups.values()) {
        write_group(part, index, group, text);
    }
    text.extend(b"\nmfem_mesh_end\n");
}

fn write_group(part: &DistMesh, index: usize, [vertices, edges, faces]: &Group, text: &mut Vec<u8>) {
    let mut line = Line::default();
    title(text, "\n# group ", index);
    title(text, "shared_vertices ", vertices.len());
    for &vertex in vertices {
        line.int(vertex.into()).end(text);
    }
    title(text, "shared_edges ", edges.len());
    // Edges and faces list their vertices by ascending global id, so alike on all ranks.
    for &edge in edges {
        let [a, b] = part.edges[edge as usize];
        line.int(a.0.into()).blank().int(b.0.into()).end(text);
    }
    title(text, "shared_faces ", faces.len());
    for &face in faces {
        line.int(TRIANGLE);
        end(&mut line, &part.faces[face as usize], text);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::testing::{cube, names, scattered, together, two_tets};
    use crate::ground::mesh::Mesh;
    use crate::parallel::distribution::distribute;
    use csg::PatchId;

    /// The mesh with its boundary on one patch: those of the tests have no curves between patches.
    fn on_one_patch(mut mesh: Mesh) -> Mesh {
        mesh.triangles.iter_mut().for_each(|triangle| triangle.patch = PatchId(1));
        mesh
    }

    #[test]
    fn two_tets_on_two_ranks_are_written_as_mfem_reads_them() {
        let texts = together(2, |comm| {
            let part =
                distribute(comm, (comm.rank() == 0).then(|| (on_one_patch(two_tets()), vec![0, 1]))).unwrap();
            String::from_utf8(part_text(&part, &names()).unwrap()).unwrap()
        });
        let of_rank_1 = "MFEM mesh v1.3\n\ndimension\n3\n\nelements\n1\n1 4 0 1 2 3\n\n\
            attribute_sets\n2\n\"lower\"\n1\n1\n\"upper\"\n1\n2\n\nboundary\n3\n2 2 0 1 3\n\
            2 2 0 3 2\n2 2 1 2 3\n\nbdr_attribute_sets\n3\n\"between\"\n1\n3\n\"lid\"\n1\n2\n\"skin\"\n1\n1\n\nvertices\n4\n3\n1 0 0\n0 1 0\n0 0 1\n1 1 1\n\nmfem_serial_mesh_end\n\n\
            communication_groups\nnumber_of_groups 2\n\n\
            # number of entities in each group, followed by ranks in group\n1 1\n2 0 1\n\n\
            total_shared_vertices 3\ntotal_shared_edges 3\ntotal_shared_faces 1\n\n\
            # group 0 has no shared entities\n\n# group 1\nshared_vertices 3\n0\n1\n2\n\
            shared_edges 3\n0 1\n0 2\n1 2\nshared_faces 1\n2 0 1 2\n\nmfem_mesh_end\n";
        assert_eq!(texts[1], of_rank_1);
        assert!(texts[0].contains(
            "shared_vertices 3\n1\n2\n3\nshared_edges 3\n1 2\n1 3\n2 3\nshared_faces 1\n2 1 2 3\n"
        ));
    }

    #[test]
    fn a_name_has_all_its_numbers_and_quotes_are_escaped() {
        let labels = [Label::new(7, "a \"b\""), Label::new(2, "a \"b\""), Label::new(7, "c\\d")];
        let mut text = Vec::new();
        write_sets("bdr_attribute_sets", &by_name(&labels), &mut text);
        let expected = "\nbdr_attribute_sets\n2\n\"a \\\"b\\\"\"\n2\n2 7\n\"c\\\\d\"\n1\n7\n";
        assert_eq!(String::from_utf8(text).unwrap(), expected);
        let text = together(1, |comm| {
            let part = distribute(comm, Some((on_one_patch(two_tets()), vec![0, 0]))).unwrap();
            let mut names = names();
            names.bodies.iter_mut().chain(&mut names.patches).for_each(|label| label.names.clear());
            part_text(&part, &names).unwrap()
        });
        assert!(
            text[0].starts_with(b"MFEM mesh v1.2\n") && !String::from_utf8_lossy(&text[0]).contains("sets")
        );
    }

    /// The number after a title.
    fn number(text: &str, title: &str) -> u64 {
        let rest = text.split_once(title).expect("the title is there").1;
        rest.split_whitespace().next().unwrap().parse().unwrap()
    }

    #[test]
    fn every_triangle_is_written_once_and_every_group_is_on_all_its_ranks() {
        for ranks in [1, 2, 4, 7] {
            let mesh = cube(4);
            let triangles = mesh.triangles.len() as u64;
            let parts = together(ranks, |comm| {
                let whole = (comm.rank() == 0).then(|| (on_one_patch(cube(4)), scattered(&mesh, ranks)));
                let part = distribute(comm, whole).unwrap();
                let text = String::from_utf8(part_text(&part, &names()).unwrap()).unwrap();
                let sizes: Vec<(Vec<Rank>, [usize; 3])> = groups(&part)
                    .into_iter()
                    .map(|(ranks, group)| (ranks.to_vec(), group.map(|entities| entities.len())))
                    .collect();
                (text, sizes)
            });
            assert_eq!(parts.iter().map(|(text, _)| number(text, "\nboundary\n")).sum::<u64>(), triangles);
            for (rank, (text, groups)) in parts.iter().enumerate() {
                assert_eq!(number(text, "number_of_groups "), groups.len() as u64 + 1);
                for group in groups {
                    assert!(group.0.contains(&(rank as Rank)) && group.0.len() > 1);
                    assert!(
                        group.0.iter().all(|&other| parts[other as usize].1.contains(group)),
                        "{group:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn a_body_without_a_number_is_refused() {
        let part =
            together(1, |comm| distribute(comm, Some((on_one_patch(two_tets()), vec![0, 0]))).unwrap())
                .remove(0);
        assert!(matches!(part_text(&part, &Names::default()), Err(WriteError::UnknownBody(_))));
    }
}
