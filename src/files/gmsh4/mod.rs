//! Gmsh's format MSH 4.1 with parts, binary or text: one file of all parts, or a file for each.
//!
//! ```text
//! $MeshFormat           4.1  0 text or 1 binary  8
//! $PhysicalNames        one group for each name
//! $Entities             surfaces: patches; volumes: bodies; both from 1
//! $PartitionedEntities  number of parts; volumes of ghosts; what each part has of a patch or body
//! $Nodes                a block for each part
//! $Elements             triangles of each part by patch, tets of each part by body; in the file of
//!                       a part also its ghosts
//! $Periodic             pairs of nodes (copy, master) for each periodic patch
//! $GhostElements        tet, its part, and the parts that have it as a ghost
//! ```
//! Tags of nodes and tets are their global ids plus one, in the files of parts too; a shared node
//! is in the files of all its parts. A triangle between two parts is in one of them (see
//! `files::once`). A mesh of one part has no
//! `$PartitionedEntities` and no ghosts.
//!
//! In the file of all parts each rank writes its shares of the sections, at offsets that follow
//! from their lengths. Numbers in binary files have 64 bits.
//!
//! Not written: surfaces, curves and points between parts, which Gmsh makes on request only and its
//! readers do not need.

mod head;
mod numbers;
mod plan;
mod records;
mod sections;
#[cfg(test)]
mod tests;

use super::joined::write_shares;
use super::output::{
    Output, files_of_parts, folder_and_name, remove_files, with_ending, write_file, write_together,
};
use super::{WriteError, Written, sum_written};
use crate::ground::comm::Communicator;
use crate::ground::mesh::Names;
use crate::ground::mesh::stream::MeshStream;
use numbers::end_of;
use plan::{NO_TAGS, Plan, Tags, extend, owns, tags_of_all};
use sections::{Section, Share, between, head_of_link};
use std::path::{Path, PathBuf};

/// How numbers are stored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Storage {
    /// In binary, the lowest byte first.
    #[default]
    Binary,
    /// As text: t8code and some other programs read only this.
    Text,
}

/// **Collective.** Writes the mesh of all ranks to one file, with each part as a partition. All
/// ranks get the totals.
///
/// ```
/// use tetmill::comm::thread;
/// use tetmill::{Error, Geometry, Mesher, files::gmsh4};
///
/// let ball = Geometry::from_text("algebraic3d solid ball = sphere (0, 0, 0; 1); tlo ball;")?;
/// let folder = tempfile::tempdir().unwrap();
/// let path = folder.path().join("ball.msh");
/// thread::try_run(2, |comm| -> Result<(), Error> {
///     let mesh = Mesher::new().generate_on(comm, Some(&ball))?;
///     gmsh4::write(comm, mesh.stream(), &mesh.names, &path, gmsh4::Storage::Text)?;
///     Ok(())
/// })?;
/// assert!(std::fs::read_to_string(&path).unwrap().contains("$PartitionedEntities\n2\n"));
/// # Ok::<(), Error>(())
/// ```
///
/// # Errors
/// A body or patch without a number, more entities than 32-bit tags, not enough disk space, or an
/// I/O error. All ranks get the error, and an existing file is kept.
pub fn write(
    comm: &dyn Communicator,
    part: &dyn MeshStream,
    names: &Names,
    path: &Path,
    storage: Storage,
) -> Result<Written, WriteError> {
    let plan = Plan::of(comm, part, names)?;
    let head = head::of_all(comm, &plan, storage)?;
    let (nodes, tags) = nodes(part, false);
    let share = Share {
        plan: &plan,
        storage,
        is_part: false,
        nodes,
        pairs: records::pairs(&plan, |local| plan.owns(local)),
        ghosts: records::ghosts_elsewhere(comm, &plan)?,
    };
    let counts = Counts::of(&share, tags).of_all(comm)?;
    let mut sections = sections(&share, &counts, head);
    if comm.size() == 1 {
        let needed = estimate(&share, &sections);
        let bytes = write_file(path, needed, |file| {
            sections.iter().try_for_each(|section| share.write(section, file))
        })?;
        return Ok(Written { files: 1, bytes });
    }
    if comm.rank() > 0 {
        let others = sections.iter_mut().filter(|section| matches!(section, Section::Once(_)));
        others.for_each(|section| *section = Section::Once(Vec::new()));
    }
    let lengths = sections.iter().map(|section| share.length(section)).collect();
    write_shares(comm, path, lengths, |section, file| share.write(&sections[section], file))
}

/// **Collective.** Writes a file for each part, `STEM_1.msh`, `STEM_2.msh` and so on, as Gmsh names
/// them, and removes such files of an earlier run with more parts. Each has the nodes of its
/// elements. All ranks get the totals.
///
/// # Errors
/// Those of [`write()`]. All ranks get the error, and old files are kept.
pub fn write_parts(
    comm: &dyn Communicator,
    part: &dyn MeshStream,
    names: &Names,
    stem: &Path,
    storage: Storage,
) -> Result<Written, WriteError> {
    let plan = Plan::of(comm, part, names)?;
    let head = head::of_part(comm, &plan, storage)?;
    let (nodes, tags) = nodes(part, true);
    let (pairs, ghosts) = (records::pairs(&plan, |_| true), records::ghosts_of_part(&plan));
    let share = Share { plan: &plan, storage, is_part: true, nodes, pairs, ghosts };
    let sections = sections(&share, &Counts::of(&share, tags), head);
    let (folder, name) = folder_and_name(stem)?;
    let written = write_together(
        comm,
        &folder,
        estimate(&share, &sections),
        |_| false,
        |stage| {
            let mut file = Output::create(&stage.join(file_of(&name, plan.number())))?;
            sections.iter().try_for_each(|section| share.write(section, &mut file))?;
            Ok(Written { files: 1, bytes: file.finish()? })
        },
    )?;
    remove_files(comm, &folder, || outdated(stem, comm.size()))?;
    sum_written(comm, written)
}

/// The file of a part, from 1.
fn file_of(stem: &Path, number: u32) -> PathBuf {
    with_ending(stem, &format!("_{number}.msh"))
}

/// *Local.* The files of an earlier run with more parts, which [`write_parts`] removes.
pub fn outdated(stem: &Path, parts: u32) -> Vec<PathBuf> {
    files_of_parts(parts + 1, |number| file_of(stem, number), b"$MeshFormat")
}

/// The length of a share in bytes, roughly for text: coordinates take more than in binary, and
/// small numbers less.
fn estimate(share: &Share, sections: &[Section]) -> u64 {
    sections.iter().map(|section| share.binary_length(section)).sum()
}

/// The number of nodes of the part, with or without copies, and their tags.
fn nodes(part: &dyn MeshStream, copies: bool) -> (u64, Tags) {
    let (mut count, mut tags) = (0, NO_TAGS);
    for index in 0..part.vertex_blocks() {
        let block = part.vertex_block(index);
        for id in block.ids().filter(|&id| copies || owns(part, &block, id)) {
            count += 1;
            extend(&mut tags, id..id + 1);
        }
    }
    (count, tags)
}

/// Counts in the heads of the sections of a file.
#[derive(Debug)]
struct Counts {
    node_blocks: u64,
    nodes: u64,
    node_tags: Tags,
    element_blocks: u64,
    elements: u64,
    element_tags: Tags,
    /// By link.
    pairs: Vec<u64>,
    ghosts: u64,
}

impl Counts {
    /// Those of one share.
    fn of(share: &Share, node_tags: Tags) -> Self {
        let plan = share.plan;
        // Ghosts have tags among those of all tets.
        let mut element_tags = plan.tet_tags;
        if plan.own_triangles > 0 {
            element_tags[1] = plan.first_triangle + plan.own_triangles - 1;
        }
        Self {
            node_blocks: u64::from(share.nodes > 0),
            nodes: share.nodes,
            node_tags,
            element_blocks: share.element_blocks(),
            elements: plan.own_tets + plan.own_triangles + share.ghost_elements(),
            element_tags,
            pairs: share.pairs.iter().map(|pairs| pairs.len() as u64).collect(),
            ghosts: share.ghosts.len() as u64,
        }
    }

    /// **Collective.** Those of all shares.
    fn of_all(self, comm: &dyn Communicator) -> Result<Self, WriteError> {
        let counts = [self.node_blocks, self.nodes, self.element_blocks, self.elements, self.ghosts];
        let [node_blocks, nodes, element_blocks, elements, ghosts] = comm.all_reduce_sum_u64(counts)?;
        let pairs = self.pairs.iter().map(|&count| comm.all_reduce_sum_u64([count]).map(|[sum]| sum));
        Ok(Self {
            node_blocks,
            nodes,
            node_tags: tags_of_all(comm, self.node_tags)?,
            element_blocks,
            elements,
            element_tags: tags_of_all(comm, self.element_tags)?,
            pairs: pairs.collect::<Result<_, _>>()?,
            ghosts,
        })
    }
}

/// The sections of the file in order.
fn sections<'a>(share: &'a Share, counts: &Counts, head: Vec<u8>) -> Vec<Section<'a>> {
    let (part, storage) = (share.plan.part, share.storage);
    let with_tags = |blocks, count, [least, largest]: Tags| [blocks, count, least.min(largest), largest];
    let of_nodes = with_tags(counts.node_blocks, counts.nodes, counts.node_tags);
    let of_elements = with_tags(counts.element_blocks, counts.elements, counts.element_tags);
    let mut list = vec![
        Section::Once(head),
        between(None, "Nodes", &of_nodes, storage),
        Section::Nodes,
        between(Some("Nodes"), "Elements", &of_elements, storage),
        Section::Triangles,
        Section::Tets,
    ];
    let mut last = "Elements";
    let links = part.links();
    if !links.is_empty() {
        list.push(between(Some(last), "Periodic", &[links.len() as u64], storage));
        for ((link, pairs), &count) in links.iter().zip(&share.pairs).zip(&counts.pairs) {
            list.push(Section::Once(head_of_link(link, count, storage)));
            list.push(Section::Pairs(pairs));
        }
        last = "Periodic";
    }
    if part.ghosts().is_some() && share.plan.is_partitioned() {
        list.push(between(Some(last), "GhostElements", &[counts.ghosts], storage));
        list.push(Section::Ghosts(&share.ghosts));
        last = "GhostElements";
    }
    list.push(Section::Once(end_of(last, storage)));
    list
}
