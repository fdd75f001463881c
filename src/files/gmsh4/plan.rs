//! What a rank writes: its entities with their tags, its runs of elements, and its numbers of
//! nodes and elements.

use crate::files::WriteError;
use crate::files::lines::ByPatch;
use crate::files::once::{LeftOut, left_out};
use crate::files::runs::Runs;
use crate::ground::comm::Communicator;
use crate::ground::mesh::stream::{MeshStream, TetBlock, VertexBlock, vertex_block_of};
use crate::ground::mesh::{GlobalId, Names};
use std::collections::BTreeSet;
use std::ops::Range;

/// The largest tag of an entity.
const MOST: u64 = i32::MAX as u64;

/// The number of entities or elements of a part, and tags that are consecutive over all parts.
///
/// Nodes and tets have their global ids plus one as tags, triangles the numbers after those of
/// tets.
pub(super) struct Plan<'a> {
    pub part: &'a dyn MeshStream,
    pub names: &'a Names,
    pub by_patch: ByPatch,
    /// Triangles that another part writes.
    pub left_out: LeftOut,
    /// Runs of the part's own tets, and of the triangles that it writes.
    pub tets: Runs,
    pub triangles: Runs,
    /// The bodies and patches of these elements, ascending.
    pub bodies: Vec<u32>,
    pub patches: Vec<u32>,
    /// Tags of the first volume and surface of this part; those of the others follow.
    pub first_volume: u32,
    pub first_surface: u32,
    /// Tag of the volume of the ghosts of the first part.
    pub first_ghosts: u32,
    /// Tag of the first triangle.
    pub first_triangle: u64,
    /// Tags of the tets of all parts.
    pub tet_tags: Tags,
    /// Number of tets of this part, without ghosts.
    pub own_tets: u64,
    /// Number of triangles that this part writes.
    pub own_triangles: u64,
}

impl<'a> Plan<'a> {
    /// **Collective.** Assigns the tags.
    ///
    /// # Errors
    /// More entities than 32-bit tags, a body or patch without a number; on all ranks.
    pub fn of(
        comm: &dyn Communicator,
        part: &'a dyn MeshStream,
        names: &'a Names,
    ) -> Result<Self, WriteError> {
        let left_out = left_out(comm, part, names)?;
        let by_patch = ByPatch::of(part);
        let triangles = comm.agree(Runs::of_patches(part, &by_patch, &left_out))?;
        let (tets, own_tags) = runs_of_tets(part);
        let [patches, bodies] = [&triangles, &tets].map(entities);
        comm.agree(refuse_unknown(names, &patches, &bodies))?;
        let own_triangles = count(&triangles);
        let own = [bodies.len() as u64, patches.len() as u64, own_triangles];
        let [volumes_before, surfaces_before, triangles_before] = comm.exclusive_scan(own)?;
        let [volumes, surfaces] = comm.all_reduce_sum_u64([own[0], own[1]])?;
        let tet_tags = tags_of_all(comm, own_tags)?;
        let [first_volume, first_surface] = [names.bodies.len(), names.patches.len()].map(|n| n as u64 + 1);
        let first_ghosts = first_volume + volumes;
        let largest = (first_ghosts + u64::from(part.ranks())).max(first_surface + surfaces);
        if largest > MOST {
            return Err(WriteError::TooMany {
                format: "Gmsh",
                what: "entities",
                count: largest,
                limit: MOST,
            });
        }
        Ok(Self {
            part,
            names,
            by_patch,
            left_out,
            first_volume: (first_volume + volumes_before) as u32,
            first_surface: (first_surface + surfaces_before) as u32,
            first_ghosts: first_ghosts as u32,
            first_triangle: tet_tags[1] + 1 + triangles_before,
            own_tets: count(&tets),
            own_triangles,
            tets,
            triangles,
            bodies,
            patches,
            tet_tags,
        })
    }

    /// Whether the file has parts: a mesh of one part has none.
    pub fn is_partitioned(&self) -> bool {
        self.part.ranks() > 1
    }

    /// The number of this part, from 1.
    pub fn number(&self) -> u32 {
        self.part.rank() + 1
    }

    /// The tag of the volume of a body in this part.
    pub fn volume(&self, body: u32) -> u32 {
        self.tag(body, &self.bodies, self.first_volume)
    }

    /// The tag of the surface of a patch in this part.
    pub fn surface(&self, patch: u32) -> u32 {
        self.tag(patch, &self.patches, self.first_surface)
    }

    fn tag(&self, parent: u32, parents: &[u32], first: u32) -> u32 {
        match parents.binary_search(&parent) {
            Ok(place) if self.is_partitioned() => first + place as u32,
            _ => parent + 1,
        }
    }

    /// The tag of the volume of this part's ghosts.
    pub fn ghosts_volume(&self) -> u32 {
        self.first_ghosts + self.part.rank()
    }

    /// Whether this part owns the vertex with this local index.
    pub fn owns(&self, local: u32) -> bool {
        let block = self.part.vertex_block(vertex_block_of(self.part, local));
        owns(self.part, &block, block.first_id + u64::from(local - block.local.start))
    }
}

/// Whether the part owns a vertex of one of its blocks.
pub(super) fn owns(part: &dyn MeshStream, block: &VertexBlock, id: GlobalId) -> bool {
    block.owner(id, part.rank()) == part.rank()
}

/// The least and the largest tag.
pub(super) type Tags = [u64; 2];

/// Of no elements.
pub(super) const NO_TAGS: Tags = [u64::MAX, 0];

/// **Collective.** The least and the largest tag of all ranks.
pub(super) fn tags_of_all(comm: &dyn Communicator, [least, largest]: Tags) -> Result<Tags, WriteError> {
    let [least, largest] = comm.all_reduce_max_u64([!least, largest])?;
    Ok([!least, largest])
}

/// Adds tags, which are global ids plus one.
pub(super) fn extend(tags: &mut Tags, ids: Range<GlobalId>) {
    if !ids.is_empty() {
        *tags = [tags[0].min(ids.start + 1), tags[1].max(ids.end)];
    }
}

/// The runs of the part's own tets by body, and their tags.
fn runs_of_tets(part: &dyn MeshStream) -> (Runs, Tags) {
    let first_ghost = part.ghosts().map_or(u64::MAX, |ghosts| ghosts.first_tet);
    let (mut runs, mut tags) = (Runs::default(), NO_TAGS);
    let mut block = TetBlock::default();
    for index in 0..part.tet_blocks() {
        part.tet_block(index, &mut block);
        if block.first_local >= first_ghost {
            break;
        }
        let count = block.tets.len();
        runs.add(block.body.expect("a tet block has a body").0, count);
        extend(&mut tags, block.first_id..block.first_id + count as u64);
    }
    (runs, tags)
}

fn entities(runs: &Runs) -> Vec<u32> {
    runs.0.iter().map(|run| run.of).collect::<BTreeSet<u32>>().into_iter().collect()
}

fn count(runs: &Runs) -> u64 {
    runs.0.iter().map(|run| run.count).sum()
}

fn refuse_unknown(names: &Names, patches: &[u32], bodies: &[u32]) -> Result<(), WriteError> {
    for &body in bodies {
        crate::files::body_number(Some(csg::BodyId(body)), names)?;
    }
    for &patch in patches {
        crate::files::patch_number(Some(csg::PatchId(patch)), names)?;
    }
    Ok(())
}
