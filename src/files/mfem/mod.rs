//! MFEM's parallel meshes, which `ParMesh(comm, stream)` reads on each rank: as texts in memory, or
//! as files `NAME.000000`, `NAME.000001` and so on, by rank.
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
//! In a mesh of second order the vertices have no coordinates; `nodes` follows instead, a grid
//! function of degree 2 with the corners first, then the nodes on edges, in the order in which the
//! elements first have them: that of MFEM's own table of edges.
//!
//! Attributes are the numbers of bodies and boundaries. Vertices of periodic faces stay separate.

mod shared;

use super::corners::Corners;
use super::lines::FLUSH_AT;
use super::output::{Output, files_of_parts, folder_and_name, remove_files, with_ending, write_together};
use super::text::{FLOAT_CHARS, Line};
use super::{WriteError, Written, body_number, patch_number, sum_written};
use crate::ground::comm::Communicator;
use crate::ground::mesh::stream::{BoundaryBlock, LocalBlock, MeshStream, NO_TET, TetBlock};
use crate::ground::mesh::{Names, Order, Rank, numbers_by_name};
use shared::{Group, Groups, groups};
use std::collections::{BTreeMap, BTreeSet};
use std::io::Write;
use std::path::{Path, PathBuf};

/// MFEM's local numbers are 32-bit integers.
const MOST: u64 = i32::MAX as u64;

/// MFEM's numbers of the geometries of elements.
const TRIANGLE: u64 = 2;
const TET: u64 = 4;

/// **Collective.** This rank's part as the text that MFEM's `ParMesh(comm, stream)` reads on it.
///
/// Attribute sets have the names of bodies and boundaries, which MFEM 4.8 and later read. Older
/// ones read the text of a mesh without names: give `Names` from which they were removed.
///
/// A triangle between two parts is in the text of the part with the tet behind it, as in a mesh
/// that MFEM partitions itself.
///
/// ```
/// use tetmill::comm::thread;
/// use tetmill::{Error, Geometry, Mesher, files::mfem};
///
/// let ball = Geometry::from_text("algebraic3d solid ball = sphere (0, 0, 0; 1); tlo ball;")?;
/// let texts = thread::try_run(2, |comm| -> Result<Vec<u8>, Error> {
///     let mesh = Mesher::new().generate_on(comm, Some(&ball))?;
///     Ok(mfem::part_text(comm, mesh.stream(), &mesh.names)?)
/// })?;
/// assert!(texts.iter().all(|text| text.starts_with(b"MFEM mesh v1.3\n")), "the body has a name");
/// # Ok::<(), Error>(())
/// ```
///
/// # Errors
/// A part with ghosts or with more vertices or tets than MFEM can number, or a body or patch
/// without a number. All ranks get an error.
pub fn part_text(
    comm: &dyn Communicator,
    part: &dyn MeshStream,
    names: &Names,
) -> Result<Vec<u8>, WriteError> {
    comm.agree(refuse(part))?;
    let content = Content::of(comm, part, names)?;
    let mut text = Vec::new();
    let written = content.write(&mut text, &mut |_| Ok(()));
    comm.agree(written.map(|()| text))
}

/// **Collective.** Writes the text of each rank's part to the file `STEM.` and its rank in six
/// digits, and removes such files of an earlier run with more parts. All ranks get the totals.
///
/// # Errors
/// Those of [`part_text`], not enough disk space, or an I/O error. All ranks get an error, and old
/// files are kept.
pub fn write(
    comm: &dyn Communicator,
    part: &dyn MeshStream,
    names: &Names,
    stem: &Path,
) -> Result<Written, WriteError> {
    comm.agree(refuse(part))?;
    let content = Content::of(comm, part, names)?;
    let (folder, name) = folder_and_name(stem)?;
    let written = write_together(
        comm,
        &folder,
        estimate(part),
        |_| false,
        |stage| {
            let mut file = Output::create(&stage.join(file_of(&name, part.rank())))?;
            let mut text = Vec::new();
            content.write(&mut text, &mut |text| file.flush_past(FLUSH_AT, text))?;
            file.write(&text)?;
            Ok(Written { files: 1, bytes: file.finish()? })
        },
    )?;
    remove_files(comm, &folder, || outdated(stem, comm.size()))?;
    sum_written(comm, written)
}

/// The file of a rank.
fn file_of(stem: &Path, rank: Rank) -> PathBuf {
    with_ending(stem, &format!(".{rank:06}"))
}

/// *Local.* The files of an earlier run with more parts, which [`write()`] removes.
pub fn outdated(stem: &Path, parts: u32) -> Vec<PathBuf> {
    files_of_parts(parts, |rank| file_of(stem, rank), b"MFEM mesh v1.")
}

/// The length of a text in bytes, at least: short numbers.
fn estimate(part: &dyn MeshStream) -> u64 {
    let counts = part.counts();
    counts.vertices * 3 * (FLOAT_CHARS as u64 * 3 / 4) + counts.tets * 24 + counts.boundary * 18
}

fn refuse(part: &dyn MeshStream) -> Result<(), WriteError> {
    if part.ghosts().is_some() {
        return Err(WriteError::NoHalo("MFEM's parallel mesh"));
    }
    let counts = part.counts();
    for (what, count) in [("vertices", counts.vertices), ("tets", counts.tets)] {
        if count > MOST {
            return Err(WriteError::TooMany { format: "MFEM", what, count, limit: MOST });
        }
    }
    Ok(())
}

/// Takes text that is complete, and may write and clear it.
type Flush<'a> = &'a mut dyn FnMut(&mut Vec<u8>) -> Result<(), WriteError>;

/// Everything that the text of a part is written from.
struct Content<'a> {
    part: &'a dyn MeshStream,
    names: &'a Names,
    /// The corners, if the part is of second order.
    corners: Option<Corners<'a>>,
    groups: Groups,
}

impl<'a> Content<'a> {
    /// **Collective.** Finds what the part shares with others.
    fn of(comm: &dyn Communicator, part: &'a dyn MeshStream, names: &'a Names) -> Result<Self, WriteError> {
        let corners = (part.order() == Order::Second).then(|| Corners::of(part));
        let linear = corners.as_ref().map_or(part, |corners| corners);
        let groups = groups(comm, linear)?;
        Ok(Self { part, names, groups, corners })
    }

    fn write(&self, text: &mut Vec<u8>, flush: Flush<'_>) -> Result<(), WriteError> {
        let names = self.names;
        let sets = [&names.bodies, &names.patches].map(|labels| numbers_by_name(labels));
        let has_names = sets.iter().any(|sets| !sets.is_empty());
        title(text, "MFEM mesh v1.", if has_names { 3 } else { 2 });
        let linear = self.corners.as_ref().map_or(self.part, |corners| corners);
        write_elements(linear, names, text, flush)?;
        if has_names {
            write_sets("attribute_sets", &sets[0], text);
        }
        write_boundary(linear, names, text, flush)?;
        if has_names {
            write_sets("bdr_attribute_sets", &sets[1], text);
        }
        title(text, "\nvertices\n", linear.counts().vertices as usize);
        match &self.corners {
            None => {
                text.extend(b"3\n");
                write_points(linear, text, flush)?;
            }
            Some(corners) => {
                text.extend(b"\nnodes\nFiniteElementSpace\nFiniteElementCollection: H1_3D_P2\n");
                text.extend(b"VDim: 3\nOrdering: 1\n\n");
                write_points(corners, text, flush)?;
                write_edge_nodes(self.part, text, flush)?;
            }
        }
        text.extend(b"\nmfem_serial_mesh_end\n\n");
        write_groups(linear, &self.groups, text);
        Ok(())
    }
}

/// Appends a title and a count.
fn title(text: &mut Vec<u8>, title: &str, count: usize) {
    writeln!(text, "{title}{count}").expect("memory can be written to");
}

/// Ends a line with the vertices of an element.
fn end(line: &mut Line, vertices: &[u32], text: &mut Vec<u8>) {
    for &vertex in vertices {
        line.blank().int(vertex.into());
    }
    line.end(text);
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

fn write_elements(
    part: &dyn MeshStream,
    names: &Names,
    text: &mut Vec<u8>,
    flush: Flush<'_>,
) -> Result<(), WriteError> {
    title(text, "\ndimension\n3\n\nelements\n", part.counts().tets as usize);
    let (mut line, mut block) = (Line::default(), TetBlock::default());
    for index in 0..part.tet_blocks() {
        part.tet_block(index, &mut block);
        let body = body_number(block.body, names)?;
        for tet in &block.tets {
            line.int(body).blank().int(TET);
            end(&mut line, tet, text);
        }
        flush(text)?;
    }
    Ok(())
}

/// Calls `visit` with each boundary block of which this part has the triangles: those with a tet
/// behind them. Another rank may have the one in front.
fn with_boundary<E>(
    part: &dyn MeshStream,
    mut visit: impl FnMut(&BoundaryBlock) -> Result<(), E>,
) -> Result<(), E> {
    let mut block = BoundaryBlock::default();
    for index in 0..part.boundary_blocks() {
        part.boundary_block(index, &mut block);
        // All triangles of a block have a tet behind them, or none.
        if block.parents.first().is_some_and(|parents| parents[0] != NO_TET) {
            visit(&block)?;
        }
    }
    Ok(())
}

fn write_boundary(
    part: &dyn MeshStream,
    names: &Names,
    text: &mut Vec<u8>,
    flush: Flush<'_>,
) -> Result<(), WriteError> {
    let mut count = 0;
    with_boundary::<WriteError>(part, |block| {
        count += block.triangles.len();
        Ok(())
    })?;
    title(text, "\nboundary\n", count);
    let mut line = Line::default();
    with_boundary(part, |block| {
        let patch = patch_number(block.patch, names)?;
        for triangle in &block.triangles {
            line.int(patch).blank().int(TRIANGLE);
            end(&mut line, triangle, text);
        }
        flush(text)
    })
}

fn write_points(part: &dyn MeshStream, text: &mut Vec<u8>, flush: Flush<'_>) -> Result<(), WriteError> {
    let mut line = Line::default();
    for index in 0..part.vertex_blocks() {
        for [x, y, z] in part.vertex_points(index).iter() {
            line.float(*x).blank().float(*y).blank().float(*z).end(text);
        }
        flush(text)?;
    }
    Ok(())
}

/// Writes the nodes on edges, each with the first tet that has it.
fn write_edge_nodes(part: &dyn MeshStream, text: &mut Vec<u8>, flush: Flush<'_>) -> Result<(), WriteError> {
    let mut is_written = vec![false; part.counts().vertices as usize];
    let (mut line, mut block, mut points) = (Line::default(), LocalBlock::default(), Vec::new());
    for index in 0..part.tet_blocks() {
        part.local_block(index, &mut block);
        part.block_points(&block, &mut points);
        for &place in block.tets.edge_nodes.iter().flatten() {
            let node = block.vertices[place as usize] as usize;
            if !std::mem::replace(&mut is_written[node], true) {
                let [x, y, z] = points[place as usize];
                line.float(x).blank().float(y).blank().float(z).end(text);
            }
        }
        flush(text)?;
    }
    Ok(())
}

fn write_groups(part: &dyn MeshStream, groups: &Groups, text: &mut Vec<u8>) {
    title(text, "communication_groups\nnumber_of_groups ", groups.len() + 1);
    text.extend(b"\n# number of entities in each group, followed by ranks in group\n");
    title(text, "1 ", part.rank() as usize);
    for ranks in groups.keys() {
        let all: Vec<String> = ranks.iter().map(ToString::to_string).collect();
        writeln!(text, "{} {}", ranks.len(), all.join(" ")).expect("memory can be written to");
    }
    let count = |of: fn(&Group) -> usize| groups.values().map(of).sum::<usize>();
    title(text, "\ntotal_shared_vertices ", count(|group| group.vertices.len()));
    title(text, "total_shared_edges ", count(|group| group.edges.len()));
    title(text, "total_shared_faces ", count(|group| group.faces.len()));
    text.extend(b"\n# group 0 has no shared entities\n");
    for (index, group) in (1..).zip(groups.values()) {
        write_group(index, group, text);
    }
    text.extend(b"\nmfem_mesh_end\n");
}

fn write_group(index: usize, group: &Group, text: &mut Vec<u8>) {
    let mut line = Line::default();
    title(text, "\n# group ", index);
    title(text, "shared_vertices ", group.vertices.len());
    for &vertex in &group.vertices {
        line.int(vertex.into()).end(text);
    }
    title(text, "shared_edges ", group.edges.len());
    for [a, b] in &group.edges {
        line.int((*a).into()).blank().int((*b).into()).end(text);
    }
    title(text, "shared_faces ", group.faces.len());
    for face in &group.faces {
        line.int(TRIANGLE);
        end(&mut line, face, text);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::testing::{cube, names, scattered, together, two_tets};
    use crate::ground::mesh::{Label, Mesh};
    use crate::parallel::distribution::{BareMesh, DistMesh, Shared, distribute, number_shared};
    use crate::parallel::migrate::{BareStream, bare};
    use crate::parallel::refine::fixtures::ball;
    use crate::parallel::refine::refine;
    use csg::PatchId;

    fn stream(part: DistMesh) -> BareStream {
        BareStream::new(BareMesh::from(part))
    }

    fn text_of(comm: &dyn Communicator, part: DistMesh, names: &Names) -> String {
        String::from_utf8(part_text(comm, &stream(part), names).unwrap()).unwrap()
    }

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
            text_of(comm, part, &names())
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
        write_sets("bdr_attribute_sets", &numbers_by_name(&labels), &mut text);
        let expected = "\nbdr_attribute_sets\n2\n\"a \\\"b\\\"\"\n2\n2 7\n\"c\\\\d\"\n1\n7\n";
        assert_eq!(String::from_utf8(text).unwrap(), expected);
        let text = together(1, |comm| {
            let part = distribute(comm, Some((on_one_patch(two_tets()), vec![0, 0]))).unwrap();
            let mut names = names();
            names.bodies.iter_mut().chain(&mut names.patches).for_each(|label| label.names.clear());
            text_of(comm, part, &names)
        });
        assert!(text[0].starts_with("MFEM mesh v1.2\n") && !text[0].contains("sets"));
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
                let part = stream(distribute(comm, whole).unwrap());
                let text = String::from_utf8(part_text(comm, &part, &names()).unwrap()).unwrap();
                let sizes: Vec<(Vec<Rank>, [usize; 3])> = groups(comm, &part)
                    .unwrap()
                    .into_iter()
                    .map(|(ranks, of)| (ranks, [of.vertices.len(), of.edges.len(), of.faces.len()]))
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

    /// The groups of a part with tables of its edges and faces, by the holders there.
    fn expected(part: &DistMesh) -> Groups {
        let mut groups = Groups::new();
        let of = |shared: &Shared, put: &mut dyn FnMut(&[Rank], usize)| {
            shared.iter().for_each(|(id, ranks)| put(ranks, id as usize));
        };
        of(&part.shared_vertices, &mut |ranks, id| {
            groups.entry(ranks.to_vec()).or_default().vertices.push(id as u32);
        });
        of(&part.shared_edges, &mut |ranks, id| {
            groups.entry(ranks.to_vec()).or_default().edges.push(part.edges[id].map(|vertex| vertex.0));
        });
        of(&part.shared_faces, &mut |ranks, id| {
            groups.entry(ranks.to_vec()).or_default().faces.push(part.faces[id].map(|vertex| vertex.0));
        });
        groups
    }

    #[test]
    fn refined_parts_share_the_edges_and_faces_that_a_directory_finds() {
        let fixture = ball(0.5);
        for ranks in [2, 5] {
            for pieces in [1, 3] {
                together(ranks, |comm| {
                    let parts = || scattered(&fixture.mesh, ranks);
                    let whole = (comm.rank() == 0).then(|| (fixture.mesh.clone(), parts()));
                    let part = distribute(comm, whole).unwrap();
                    let refined = refine(part, &fixture.projector, pieces, &Default::default()).unwrap();
                    let numbered = number_shared(comm, bare(&refined).unwrap()).unwrap();
                    // Local numbers follow global ids in stored parts only: compare that part.
                    let stored = stream(numbered.clone());
                    assert_eq!(groups(comm, &stored).unwrap(), expected(&numbered));
                    let sizes = |groups: &Groups| -> Vec<(Vec<Rank>, [usize; 3])> {
                        let size = |of: &Group| [of.vertices.len(), of.edges.len(), of.faces.len()];
                        groups.iter().map(|(ranks, of)| (ranks.clone(), size(of))).collect()
                    };
                    assert_eq!(sizes(&groups(comm, &refined).unwrap()), sizes(&expected(&numbered)));
                });
            }
        }
    }

    #[test]
    fn files_have_the_texts_of_all_ranks() {
        let folder = tempfile::tempdir().unwrap();
        let mesh = cube(2);
        let texts = together(3, |comm| {
            let whole = (comm.rank() == 0).then(|| (on_one_patch(cube(2)), scattered(&mesh, 3)));
            let part = stream(distribute(comm, whole).unwrap());
            let written = write(comm, &part, &names(), &folder.path().join("cube")).unwrap();
            let text = part_text(comm, &part, &names()).unwrap();
            assert_eq!(written.files, 3);
            (text, written.bytes)
        });
        for (rank, (text, _)) in texts.iter().enumerate() {
            let file = std::fs::read(folder.path().join(format!("cube.{rank:06}"))).unwrap();
            assert!(file == *text);
        }
        assert_eq!(texts[0].1, texts.iter().map(|(text, _)| text.len() as u64).sum::<u64>());
    }

    #[test]
    fn a_body_without_a_number_is_refused() {
        let results = together(1, |comm| {
            let part = distribute(comm, Some((on_one_patch(two_tets()), vec![0, 0]))).unwrap();
            part_text(comm, &stream(part), &Names::default())
        });
        assert!(matches!(results[0], Err(WriteError::UnknownBody(_))));
    }
}
