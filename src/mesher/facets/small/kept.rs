//! Small faces and edges that are kept, because beside them there was no mesh without them.

use super::report::MergedSmall;
use crate::Point;
use crate::ground::kernel::nearest::{at, in_segment, in_triangle};
use brep::Tessellation;
use std::collections::{BTreeMap, BTreeSet};

/// What was merged is beside a place if it is at most so many times its width away.
const NEAR: f64 = 4.0;

/// Faces, with their tips, and edges that are not merged: their indices in the model.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Kept {
    /// The faces.
    pub faces: BTreeSet<usize>,
    /// The edges.
    pub edges: BTreeSet<usize>,
}

impl Kept {
    /// Adds what was merged beside some places; returns whether there is any.
    pub fn add_beside(
        &mut self,
        merged: &MergedSmall,
        tessellation: &Tessellation,
        places: &[Point],
    ) -> bool {
        let mut widths: BTreeMap<usize, f64> = BTreeMap::new();
        let faces = merged.faces.iter().map(|merged| (merged.face, merged.width));
        for (face, width) in faces.chain(merged.tips.iter().map(|tip| (tip.face, tip.width))) {
            let widest = widths.entry(face - 1).or_default();
            *widest = width.max(*widest);
        }
        let before = (self.faces.len(), self.edges.len());
        for triangle in &tessellation.triangles {
            let face = triangle.patch as usize;
            let Some(width) = widths.get(&face) else { continue };
            let corners = triangle.vertices.map(|v| tessellation.points[v as usize]);
            let distance = |p: &Point| (at(&corners, in_triangle(p, &corners)) - p).norm();
            if !self.faces.contains(&face) && places.iter().any(|p| distance(p) <= NEAR * width) {
                self.faces.insert(face);
            }
        }
        for merged in &merged.edges {
            let line = &tessellation.lines[merged.edge - 1];
            let points: Vec<Point> = line.iter().map(|on| tessellation.points[on.0 as usize]).collect();
            let distance = |p: &Point, w: &[Point]| in_segment(p, &w[0], &w[1]).1.sqrt();
            let is_near = |p: &Point| points.windows(2).any(|w| distance(p, w) <= NEAR * merged.length);
            if places.iter().any(is_near) {
                self.edges.insert(merged.edge - 1);
            }
        }
        before != (self.faces.len(), self.edges.len())
    }
}
