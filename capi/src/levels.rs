//! The refinement levels of a part, for multigrid.

use crate::fault::{Fault, Status, guard};
use crate::geometry::out_of_range;
use crate::part::Part;
use crate::pointers::{given, store, store_array};
use std::sync::Arc;

/// The parents of a level's vertices and tets.
pub struct Parents {
    vertices: Vec<[u32; 2]>,
    /// Empty if levels are not nested.
    tets: Vec<u64>,
}

impl Part {
    /// The levels, made at the first request.
    fn all_levels(&self) -> Result<&[Self], Fault> {
        if self.levels.get().is_none() {
            let hierarchy = self.made()?.hierarchy()?.map(Arc::new);
            let levels = hierarchy.map(|hierarchy| {
                let level = |index| Self::of_level(Arc::clone(&hierarchy), index);
                (0..hierarchy.levels.len()).map(level).collect()
            });
            self.levels.get_or_init(|| levels);
        }
        let levels = self.levels.get().and_then(Option::as_deref);
        levels.ok_or_else(|| Fault::usage("only parts that were refined, of order 1, have levels"))
    }

    fn all_parents(&self) -> Result<&Parents, Fault> {
        let (hierarchy, level) = self.level().filter(|(_, level)| *level > 0).ok_or_else(|| {
            Fault::usage("only levels after the coarsest have parents: see tetmill_part_level")
        })?;
        Ok(self.parents.get_or_init(|| Parents {
            vertices: hierarchy.vertex_parents(level),
            tets: hierarchy.tet_parents(level).unwrap_or_default(),
        }))
    }
}

/// The number of refinement levels of a part, the coarse mesh and the part itself included.
///
/// TETMILL_STATUS_USAGE unless the parts were refined (the method `refine`, or the option `refine`)
/// and the elements are of order 1. The levels are made now: the coarser ones have a seventh of the
/// part's tets together.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_part_level_count(part: Option<&Part>, count: *mut usize) -> Status {
    // SAFETY: the contract of the header.
    guard(|| unsafe { store(count, given(part, "part")?.all_levels()?.len(), "count") })
}

/// A refinement level of a part, by its index from 0, the coarsest. Valid until the mesh is freed.
///
/// It is a part itself: the functions for arrays, owners and sharing take it, those for ghosts,
/// MFEM's text and levels do not. All levels are on the geometry: vertices move when a level is
/// refined.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_part_level(
    part: Option<&Part>,
    index: usize,
    level: *mut *const Part,
) -> Status {
    guard(|| {
        let levels = given(part, "part")?.all_levels()?;
        let found = levels.get(index).ok_or_else(|| out_of_range("level", index, levels.len()))?;
        // SAFETY: the contract of the header.
        unsafe { store(level, std::ptr::from_ref(found), "level") }
    })
}

/// The two vertices of the level before that each vertex of a level is between, two local indices
/// for each of `count` vertices; twice the same for a vertex of both levels.
///
/// Linear interpolation is the mean of the values of both. Parents are in the same part.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_level_vertex_parents(
    level: Option<&Part>,
    parents: *mut *const u32,
    count: *mut usize,
) -> Status {
    // SAFETY: the contract of the header.
    guard(|| unsafe {
        store_array(&given(level, "level")?.all_parents()?.vertices, parents, count, "parents")
    })
}

/// The tet of the level before that each tet of a level is in, by its index in the part. `count` is
/// 0 unless the option `nested` was set.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tetmill_level_tet_parents(
    level: Option<&Part>,
    parents: *mut *const u64,
    count: *mut usize,
) -> Status {
    // SAFETY: the contract of the header.
    guard(|| unsafe { store_array(&given(level, "level")?.all_parents()?.tets, parents, count, "parents") })
}
