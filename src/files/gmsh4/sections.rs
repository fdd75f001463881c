//! The sections of a file from the nodes on, streamed from the part.

use super::Storage;
use super::numbers::{Numbers, end_of};
use super::plan::{Plan, owns};
use super::records::Ghost;
use crate::files::WriteError;
use crate::files::chunks::{items, split, write_chunks};
use crate::files::gmsh::types;
use crate::files::lines::FLUSH_AT;
use crate::files::node_order::{GMSH, arranged};
use crate::files::output::Output;
use crate::ground::mesh::GlobalId;
use crate::ground::mesh::periodic::Link;
use crate::ground::mesh::stream::LocalBlock;

/// Nodes or tets that one thread formats at a time.
const PER_CHUNK: u64 = 4096;

/// Bytes of the head of a block, of one node, and of one number.
const BLOCK: u64 = 20;
const NODE: u64 = 32;
const NUMBER: u64 = 8;

/// A rank's share of a file, section by section.
pub(super) struct Share<'a> {
    pub plan: &'a Plan<'a>,
    pub storage: Storage,
    /// Whether the file has only this part, with copies of nodes that other parts own and with the
    /// ghosts as elements.
    pub is_part: bool,
    /// Number of nodes of the share.
    pub nodes: u64,
    /// Pairs of periodic nodes, by link.
    pub pairs: Vec<Vec<[u64; 2]>>,
    pub ghosts: Vec<Ghost>,
}

/// A section, or a part of one.
pub(super) enum Section<'a> {
    /// Bytes from one rank.
    Once(Vec<u8>),
    /// The nodes of the share, as one block.
    Nodes,
    /// The triangles of the share, one block a patch.
    Triangles,
    /// The tets of the share, one block for each run of a body.
    Tets,
    /// Pairs of periodic nodes of a link.
    Pairs(&'a [[u64; 2]]),
    /// Ghosts.
    Ghosts(&'a [Ghost]),
}

impl Share<'_> {
    /// Writes this rank's share of a section.
    pub fn write(&self, section: &Section, file: &mut Output) -> Result<(), WriteError> {
        match section {
            Section::Once(bytes) => file.write(bytes),
            Section::Nodes => self.write_nodes(file),
            Section::Triangles => self.write_triangles(file),
            Section::Tets => self.write_tets(file),
            Section::Pairs(pairs) => self.write_list(file, pairs, |numbers, [image, of]| {
                numbers.size(*image).size(*of);
            }),
            Section::Ghosts(ghosts) => self.write_list(file, ghosts, |numbers, ghost| {
                numbers.size(ghost.tag).int(ghost.owner).size(ghost.parts.len() as u64);
                ghost.parts.iter().for_each(|&part| _ = numbers.int(part));
            }),
        }
    }

    /// The length of this rank's share of a section in bytes. Text is written once to count it.
    pub fn length(&self, section: &Section) -> Result<u64, WriteError> {
        if self.storage == Storage::Text {
            let mut counter = Output::counter();
            self.write(section, &mut counter)?;
            return Ok(counter.written());
        }
        Ok(self.binary_length(section))
    }

    /// The length of this rank's share of a section in a binary file.
    pub fn binary_length(&self, section: &Section) -> u64 {
        let order = self.plan.part.order();
        let elements = |blocks: usize, count: u64, nodes: usize| {
            blocks as u64 * BLOCK + count * NUMBER * (1 + nodes as u64)
        };
        match section {
            Section::Once(bytes) => bytes.len() as u64,
            Section::Nodes if self.nodes == 0 => 0,
            Section::Nodes => BLOCK + self.nodes * NODE,
            Section::Triangles => {
                elements(self.plan.triangles.0.len(), self.plan.own_triangles, order.triangle_nodes())
            }
            Section::Tets => {
                let ghosts = self.ghost_elements();
                let blocks = self.plan.tets.0.len() + usize::from(ghosts > 0);
                elements(blocks, self.plan.own_tets + ghosts, order.tet_nodes())
            }
            Section::Pairs(pairs) => pairs.len() as u64 * 2 * NUMBER,
            Section::Ghosts(ghosts) => {
                ghosts.iter().map(|ghost| 2 * NUMBER + 4 + 4 * ghost.parts.len() as u64).sum()
            }
        }
    }

    /// Number of ghosts that the share has as elements.
    pub fn ghost_elements(&self) -> u64 {
        if self.is_part { self.ghosts.len() as u64 } else { 0 }
    }

    /// Number of blocks of elements.
    pub fn element_blocks(&self) -> u64 {
        let own = self.plan.triangles.0.len() + self.plan.tets.0.len();
        own as u64 + u64::from(self.ghost_elements() > 0)
    }

    /// One block on the first volume of the part. Gmsh finds the nodes of a surface through its
    /// elements.
    fn write_nodes(&self, file: &mut Output) -> Result<(), WriteError> {
        let Some(&body) = self.plan.bodies.first().filter(|_| self.nodes > 0) else { return Ok(()) };
        let mut head = Vec::new();
        let mut numbers = Numbers::new(self.storage, &mut head);
        numbers.int(3).int(self.plan.volume(body)).int(0).size(self.nodes).end();
        file.write(&head)?;
        self.for_each_node(file, |numbers, id, _| _ = numbers.size(id + 1), false)?;
        let point = |numbers: &mut Numbers, _, [x, y, z]: [f64; 3]| _ = numbers.float(x).float(y).float(z);
        self.for_each_node(file, point, true)
    }

    /// Writes a line for each node of the share: its global id and, if requested, its coordinates.
    fn for_each_node(
        &self,
        file: &mut Output,
        format: impl Fn(&mut Numbers, GlobalId, [f64; 3]) + Sync,
        with_points: bool,
    ) -> Result<(), WriteError> {
        let part = self.plan.part;
        let blocks = part.vertex_blocks();
        let (chunks, per_chunk) = split(blocks, part.counts().vertices, PER_CHUNK);
        write_chunks([file], chunks, part.work(), |chunk, [bytes]| {
            let mut numbers = Numbers::new(self.storage, bytes);
            for index in items(chunk, per_chunk, blocks) {
                let block = part.vertex_block(index);
                let points = if with_points { part.vertex_points(index) } else { Default::default() };
                for (place, id) in block.ids().enumerate() {
                    if self.is_part || owns(part, &block, id) {
                        format(&mut numbers, id, points.get(place).copied().unwrap_or_default());
                        numbers.end();
                    }
                }
            }
            Ok(())
        })
    }

    fn write_triangles(&self, file: &mut Output) -> Result<(), WriteError> {
        let (plan, part) = (self.plan, self.plan.part);
        let (mut bytes, mut index) = (Vec::new(), 0);
        plan.by_patch.visit(part, |block, first| {
            let mut numbers = Numbers::new(self.storage, &mut bytes);
            for (within, corners) in block.triangles.iter().enumerate() {
                if plan.left_out.contains(first + within as u64) {
                    continue;
                }
                let run = plan.triangles.find(index);
                if run.first == index {
                    numbers.int(2).int(plan.surface(run.of)).int(types(part.order())[0]);
                    numbers.size(run.count).end();
                }
                numbers.size(plan.first_triangle + index);
                let nodes = corners.iter().chain(block.edge_nodes_of(within));
                nodes.for_each(|&vertex| _ = numbers.size(part.vertex_id(vertex) + 1));
                numbers.end();
                index += 1;
            }
            file.flush_past(FLUSH_AT, &mut bytes)
        })?;
        file.write(&bytes)
    }

    fn write_tets(&self, file: &mut Output) -> Result<(), WriteError> {
        let part = self.plan.part;
        let (chunks, per_chunk) = split(part.tet_blocks(), part.counts().tets, PER_CHUNK);
        write_chunks([file], chunks, part.work(), |chunk, [bytes]| {
            let mut numbers = Numbers::new(self.storage, bytes);
            let (mut block, mut ids) = (LocalBlock::default(), Vec::new());
            for index in items(chunk, per_chunk, part.tet_blocks()) {
                part.local_block(index, &mut block);
                if block.tets.first_local >= self.plan.own_tets && !self.is_part {
                    break;
                }
                part.block_ids(&block, &mut ids);
                for (place, tet) in block.tets.tets.iter().enumerate() {
                    self.begin_block(block.tets.first_local + place as u64, &mut numbers);
                    numbers.size(block.tets.first_id + place as u64 + 1);
                    tet.iter().for_each(|&vertex| _ = numbers.size(ids[vertex as usize] + 1));
                    let edges = arranged(block.tets.edge_nodes_of(place), &GMSH);
                    edges.for_each(|vertex| _ = numbers.size(ids[vertex as usize] + 1));
                    numbers.end();
                }
            }
            Ok(())
        })
    }

    /// Starts a block before the first tet of a run, and before the first ghost.
    fn begin_block(&self, tet: u64, numbers: &mut Numbers) {
        let plan = self.plan;
        let (volume, first, count) = if tet < plan.own_tets {
            let run = plan.tets.find(tet);
            (plan.volume(run.of), run.first, run.count)
        } else {
            (plan.ghosts_volume(), plan.own_tets, self.ghost_elements())
        };
        if tet == first {
            numbers.int(3).int(volume).int(types(plan.part.order())[1]).size(count).end();
        }
    }

    fn write_list<T>(
        &self,
        file: &mut Output,
        list: &[T],
        format: impl Fn(&mut Numbers, &T),
    ) -> Result<(), WriteError> {
        let mut bytes = Vec::new();
        for item in list {
            let mut numbers = Numbers::new(self.storage, &mut bytes);
            format(&mut numbers, item);
            numbers.end();
            file.flush_past(FLUSH_AT, &mut bytes)?;
        }
        file.write(&bytes)
    }
}

/// The head of a link: entities, matrix of the motion by rows, number of pairs.
pub(super) fn head_of_link(link: &Link, pairs: u64, storage: Storage) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut numbers = Numbers::new(storage, &mut bytes);
    numbers.int(2).int(link.image.0 + 1).int(link.of.0 + 1).end();
    numbers.size(16);
    link.motion.to_homogeneous().transpose().iter().for_each(|&x| _ = numbers.float(x));
    numbers.end();
    numbers.size(pairs).end();
    bytes
}

/// Ends a section and begins another one with some counts.
pub(super) fn between(end: Option<&str>, begin: &str, counts: &[u64], storage: Storage) -> Section<'static> {
    let mut bytes = end.map_or_else(Vec::new, |section| end_of(section, storage));
    bytes.extend(format!("${begin}\n").bytes());
    let mut numbers = Numbers::new(storage, &mut bytes);
    counts.iter().for_each(|&count| _ = numbers.size(count));
    numbers.end();
    Section::Once(bytes)
}
