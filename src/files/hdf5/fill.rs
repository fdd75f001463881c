//! Writes a rank's share of each dataset.

use super::tree::Placed;
use super::{
    BODIES, BOUNDARIES, CONNECTIVITY, COUNTS, Content, ELEMENT_IDS, NODE_IDS, Named, OFFSETS, PARENTS, PARTS,
    PERIODIC_IDS, POINTS, TRIANGLE_PARTS, TRIANGLES, TYPES, cells, fields, named_path,
};
use crate::files::chunks::{items, split, write_chunks};
use crate::files::lines::FLUSH_AT;
use crate::files::node_order::{VTK, arranged, vtk_types};
use crate::files::output::Output;
use crate::files::{WriteError, body_number, patch_number};
use crate::ground::mesh::stream::{NO_TET, TetBlock};
use std::ops::Range;
use std::path::Path;

/// Tets or vertices that one thread encodes at a time.
const PER_CHUNK: u64 = 1 << 14;

/// A file that several ranks write.
pub(super) struct Datasets<'a> {
    placed: &'a Placed,
    path: &'a Path,
}

impl Datasets<'_> {
    /// Opens the file at a value of a dataset.
    pub fn at(&self, dataset: &str, index: u64) -> Result<Output, WriteError> {
        let mut output = Output::shared(self.path)?;
        output.go_to(self.placed.place_of(dataset, index))?;
        Ok(output)
    }
}

impl Content<'_> {
    /// Writes this rank's share of the file; the first rank also writes the metadata, and the last
    /// rank the last offset.
    pub(super) fn fill(&self, placed: &Placed, path: &Path, is_last: bool) -> Result<(), WriteError> {
        let file = Datasets { placed, path };
        if self.part.rank() == 0 {
            Output::shared(path)?.write(&placed.head())?;
            self.counts(&file)?;
            self.named(&file)?;
        }
        self.points(&file)?;
        self.tets(&file)?;
        self.computed(&file, is_last)?;
        self.triangles(&file)?;
        if let Some(adjacency) = &self.adjacency {
            adjacency.fill(&file, is_last)?;
        }
        Output::shared(path)?.finish().map(drop)
    }

    /// The counts of the whole mesh.
    fn counts(&self, file: &Datasets) -> Result<(), WriteError> {
        let totals = self.totals;
        let corners = self.part.order().tet_nodes() as u64 * totals.tets;
        for (path, count) in COUNTS.iter().zip([totals.vertices, totals.tets, corners]) {
            file.at(path, 0)?.write(&count.to_ne_bytes())?;
        }
        Ok(())
    }

    /// The names of bodies and boundaries.
    fn named(&self, file: &Datasets) -> Result<(), WriteError> {
        for (kind, labels) in self.labels() {
            for (path, numbers) in fields(kind, labels) {
                let numbers: Vec<u32> = numbers.into_iter().collect();
                file.at(&path, 0)?.write(bytemuck::cast_slice(&numbers))?;
            }
            let named = Named::of(labels);
            if named.0.is_empty() {
                continue;
            }
            let (mut numbers, mut names) = (Vec::new(), Vec::new());
            let length = named.text().bytes() as usize;
            for (number, name) in &named.0 {
                numbers.extend(number.to_ne_bytes());
                names.extend(name.as_bytes());
                names.resize(numbers.len() / 4 * length, 0);
            }
            file.at(&named_path(kind, "Numbers"), 0)?.write(&numbers)?;
            file.at(&named_path(kind, "Names"), 0)?.write(&names)?;
        }
        Ok(())
    }

    /// The coordinates and ids of the vertices that this part owns.
    fn points(&self, file: &Datasets) -> Result<(), WriteError> {
        let (part, first) = (self.part, self.numbering.owned.start - 1);
        let blocks = part.vertex_blocks();
        let (chunks, per_chunk) = split(blocks, part.counts().vertices, PER_CHUNK);
        let owns = |local: u32| self.numbering.owns(local as usize);
        let outputs = [&mut file.at(POINTS, 3 * first)?, &mut file.at(NODE_IDS, first)?];
        write_chunks(outputs, chunks, part.work(), |chunk, [points, ids]| {
            for index in items(chunk, per_chunk, blocks) {
                let block = part.vertex_block(index);
                let here = part.vertex_points(index);
                for ((local, id), point) in block.local.clone().zip(block.ids()).zip(here.iter()) {
                    if owns(local) {
                        points.extend_from_slice(bytemuck::cast_slice(point));
                        ids.extend(id.to_ne_bytes());
                    }
                }
            }
            Ok(())
        })?;
        if !file.placed.has(PERIODIC_IDS) {
            return Ok(());
        }
        let mut masters = part.masters();
        masters.sort_unstable();
        let master = |local| masters.binary_search_by_key(&local, |of| of.0).ok().map(|at| masters[at].1);
        write_chunks([&mut file.at(PERIODIC_IDS, first)?], chunks, part.work(), |chunk, [ids]| {
            for index in items(chunk, per_chunk, blocks) {
                let block = part.vertex_block(index);
                for (local, id) in block.local.clone().zip(block.ids()).filter(|of| owns(of.0)) {
                    ids.extend(master(local).unwrap_or(id).to_ne_bytes());
                }
            }
            Ok(())
        })
    }

    /// The vertices, ids and bodies of tets.
    fn tets(&self, file: &Datasets) -> Result<(), WriteError> {
        let (part, first) = (self.part, self.numbering.first_tet - 1);
        let nodes = part.order().tet_nodes() as u64;
        let (chunks, per_chunk) = split(part.tet_blocks(), part.counts().tets, PER_CHUNK);
        let outputs = [
            &mut file.at(CONNECTIVITY, nodes * first)?,
            &mut file.at(cells(part.order()), nodes * first)?,
            &mut file.at(ELEMENT_IDS, first)?,
            &mut file.at(BODIES, first)?,
        ];
        write_chunks(outputs, chunks, part.work(), |chunk, [connectivity, cells, ids, bodies]| {
            let mut block = TetBlock::default();
            for index in items(chunk, per_chunk, part.tet_blocks()) {
                part.tet_block(index, &mut block);
                let body = body_number(block.body, self.names)? as i32;
                for (index, (tet, id)) in block.tets.iter().zip(block.first_id..).enumerate() {
                    let edges = arranged(block.edge_nodes_of(index), &VTK);
                    tet.iter().copied().chain(edges).for_each(|v| self.push_vertex(v, connectivity));
                    ids.extend(id.to_ne_bytes());
                    bodies.extend(body.to_ne_bytes());
                }
            }
            cells.extend_from_slice(connectivity);
            Ok(())
        })
    }

    /// Appends the number of a vertex, from 0.
    fn push_vertex(&self, vertex: u32, bytes: &mut Vec<u8>) {
        bytes.extend((self.numbering.vertex(vertex) - 1).to_ne_bytes());
    }

    /// The arrays of tets that follow from their numbers alone.
    fn computed(&self, file: &Datasets, is_last: bool) -> Result<(), WriteError> {
        let order = self.part.order();
        let first = self.numbering.first_tet - 1;
        let own = first..first + self.part.counts().tets;
        let offsets = own.start..own.end + u64::from(is_last);
        let (nodes, [_, vtk_type]) = (order.tet_nodes() as u64, vtk_types(order));
        self.each(&mut file.at(OFFSETS, first)?, offsets, |tet| (nodes * tet).to_ne_bytes())?;
        self.each(&mut file.at(TYPES, first)?, own.clone(), |_| [vtk_type])?;
        let number = (self.part.rank() + 1).to_ne_bytes();
        self.each(&mut file.at(PARTS, first)?, own, |_| number)
    }

    /// Writes one value for each number.
    fn each<const N: usize>(
        &self,
        output: &mut Output,
        numbers: Range<u64>,
        value: impl Fn(u64) -> [u8; N] + Sync,
    ) -> Result<(), WriteError> {
        let count = (numbers.end - numbers.start) as usize;
        let (chunks, per_chunk) = split(count, count as u64, PER_CHUNK);
        write_chunks([output], chunks, self.part.work(), |chunk, [bytes]| {
            let here = items(chunk, per_chunk, count);
            here.for_each(|index| bytes.extend(value(numbers.start + index as u64)));
            Ok(())
        })
    }

    /// The boundary triangles that this part writes. One thread suffices: they are few compared to
    /// tets.
    fn triangles(&self, file: &Datasets) -> Result<(), WriteError> {
        let (part, first) = (self.part, self.triangles_before);
        let nodes = part.order().triangle_nodes() as u64;
        let mut outputs =
            [file.at(TRIANGLES, nodes * first)?, file.at(BOUNDARIES, first)?, file.at(PARENTS, 2 * first)?];
        let mut buffers: [Vec<u8>; 3] = Default::default();
        let mut flush = |buffers: &mut [Vec<u8>; 3], limit| {
            outputs.iter_mut().zip(buffers).try_for_each(|(output, buffer)| output.flush_past(limit, buffer))
        };
        self.by_patch.visit(part, |block, first_of_block| {
            let number = patch_number(block.patch, self.names)? as i32;
            let [vertices, numbers, parents] = &mut buffers;
            for (index, corners) in block.triangles.iter().enumerate() {
                let place = first_of_block + index as u64;
                if self.between.left_out.contains(place) {
                    continue;
                }
                let all = corners.iter().chain(block.edge_nodes_of(index));
                all.for_each(|&v| self.push_vertex(v, vertices));
                numbers.extend(number.to_ne_bytes());
                for tet in self.parents(place, block.parents[index]) {
                    parents.extend(tet.to_ne_bytes());
                }
            }
            flush(&mut buffers, FLUSH_AT)
        })?;
        flush(&mut buffers, 0)?;
        let own = first..first + part.counts().boundary - self.between.left_out.len();
        let number = (part.rank() + 1).to_ne_bytes();
        self.each(&mut file.at(TRIANGLE_PARTS, first)?, own, |_| number)
    }

    /// The numbers from 0 of the tets behind and in front of a triangle of this part, also those of
    /// other parts; -1 for none.
    fn parents(&self, place: u64, here: [u64; 2]) -> [i64; 2] {
        let elsewhere = self.between.tet_beside(place).map_or(-1, |number| number as i64 - 1);
        here.map(|tet| if tet == NO_TET { elsewhere } else { self.numbering.tet(tet) as i64 - 1 })
    }
}
