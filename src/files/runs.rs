//! Runs of consecutive tets or boundary triangles of one body or patch.

use super::WriteError;
use super::lines::ByPatch;
use super::once::LeftOut;
use crate::ground::mesh::stream::{MeshStream, TetBlock};

/// Consecutive elements of one body or patch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Run {
    /// The index of the first element within the part.
    pub first: u64,
    /// The body or patch.
    pub of: u32,
    /// Number of elements.
    pub count: u64,
}

/// The runs of a part, in order.
#[derive(Clone, Debug, Default)]
pub(super) struct Runs(pub Vec<Run>);

impl Runs {
    pub fn of_bodies(part: &dyn MeshStream) -> Self {
        let mut runs = Self::default();
        let mut block = TetBlock::default();
        for index in 0..part.tet_blocks() {
            part.tet_block(index, &mut block);
            runs.add(block.body.expect("a tet block has a body").0, block.tets.len());
        }
        runs
    }

    /// Runs of the triangles that the part writes.
    pub fn of_patches(
        part: &dyn MeshStream,
        by_patch: &ByPatch,
        left_out: &LeftOut,
    ) -> Result<Self, WriteError> {
        let mut runs = Self::default();
        by_patch.visit(part, |block, first| {
            let places = first..first + block.triangles.len() as u64;
            let written = places.filter(|&place| !left_out.contains(place)).count();
            runs.add(block.patch.expect("a boundary block has a patch").0, written);
            Ok(())
        })?;
        Ok(runs)
    }

    /// Appends elements.
    pub fn add(&mut self, of: u32, count: usize) {
        if count == 0 {
            return;
        }
        match self.0.last_mut() {
            Some(last) if last.of == of => last.count += count as u64,
            last => {
                let first = last.map_or(0, |last| last.first + last.count);
                self.0.push(Run { first, of, count: count as u64 });
            }
        }
    }

    /// Returns the run that contains the element at this index within the part.
    ///
    /// # Panics
    /// If there is no such element.
    pub fn find(&self, element: u64) -> &Run {
        &self.0[self.0.partition_point(|run| run.first <= element) - 1]
    }
}
