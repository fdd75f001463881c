//! Triangles of patches that were made before, for the same division of their curves.

use super::face::Made;
use super::{Tessellation, Triangle};
use crate::model::{Model, On};
use rustc_hash::FxHashMap as HashMap;
use std::ops::Range;

/// A tessellation of a model with the same patches, of which some curves may be divided otherwise.
pub(super) struct Known<'a> {
    tessellation: &'a Tessellation,
    /// The triangles of each patch; none of patches that failed.
    triangles: Vec<Range<usize>>,
}

impl<'a> Known<'a> {
    pub fn new(tessellation: &'a Tessellation) -> Self {
        let mut triangles = vec![0..0; tessellation.gaps.len()];
        let mut start = 0;
        for of_patch in tessellation.triangles.chunk_by(|s, t| s.patch == t.patch) {
            triangles[of_patch[0].patch as usize] = start..start + of_patch.len();
            start += of_patch.len();
        }
        Self { tessellation, triangles }
    }

    /// The triangles of a patch, if it is as fine and its curves are divided as before; `out` has
    /// them.
    pub fn made(&self, model: &Model, patch: usize, out: &Tessellation) -> Option<Made> {
        if self.tessellation.settings.get(patch) != out.settings.get(patch) {
            return None;
        }
        let triangles = self.triangles.get(patch).filter(|range| !range.is_empty())?;
        let mut to: HashMap<u32, u32> = HashMap::default();
        for fin in model.patches[patch].loops.iter().flatten() {
            match fin.on {
                On::Corner(corner) => {
                    to.insert(corner as u32, corner as u32);
                }
                On::Curve(curve) => {
                    let (before, now) = (self.tessellation.lines.get(curve)?, &out.lines[curve]);
                    let is_same =
                        before.len() == now.len() && before.iter().zip(now).all(|(a, b)| a.1 == b.1);
                    if !is_same {
                        return None;
                    }
                    to.extend(before.iter().zip(now).map(|(a, b)| (a.0, b.0)));
                }
            }
        }
        let mut made = Made::empty(self.tessellation.gaps[patch]);
        for t in &self.tessellation.triangles[triangles.clone()] {
            let vertices = t.vertices.map(|v| {
                *to.entry(v).or_insert_with(|| made.add_point(self.tessellation.points[v as usize]))
            });
            made.add(Triangle { vertices, ..*t });
        }
        Some(made)
    }
}
