//! What surface meshing tells of its result.

use csg::PatchId;

/// One patch.
#[derive(Clone, Debug, PartialEq)]
pub struct PatchReport {
    /// The patch.
    pub patch: PatchId,
    /// Its triangles.
    pub triangles: usize,
    /// Its vertices inside, not on curves.
    pub vertices: usize,
    /// The least quality 4√3·area/Σl², 1 for the regular triangle.
    pub worst_quality: f64,
    /// The mean quality.
    pub mean_quality: f64,
    /// The least angle, degrees.
    pub min_angle: f64,
    /// The largest angle between a triangle's normal and the surface's at one of its vertices, degrees.
    pub worst_normal: f64,
    /// Triangles with two edges on one smooth curve that had to be split.
    pub flattening_repaired: usize,
    /// Triangles with two edges on one smooth curve that are left (0 unless something is wrong).
    pub flattening_left: usize,
    /// Places where the front wanted a vertex and there was no room: a measure of its collisions.
    pub refused: usize,
    /// Edges swapped in the improvement.
    pub swaps: usize,
    /// Vertices moved in the improvement, each as often as it was.
    pub moves: usize,
    /// Edges collapsed.
    pub collapses: usize,
    /// Edges split.
    pub splits: usize,
}

/// All patches.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Report {
    /// By patch.
    pub patches: Vec<PatchReport>,
}

impl Report {
    /// The triangles of all patches.
    pub fn triangles(&self) -> usize {
        self.patches.iter().map(|p| p.triangles).sum()
    }

    /// The least quality of all triangles.
    pub fn worst_quality(&self) -> f64 {
        self.patches.iter().map(|p| p.worst_quality).fold(1.0, f64::min)
    }

    /// The mean quality of all triangles; 0 if there are none.
    pub fn mean_quality(&self) -> f64 {
        let sum: f64 = self.patches.iter().map(|p| p.mean_quality * p.triangles as f64).sum();
        sum / self.triangles().max(1) as f64
    }

    /// The least angle of all triangles, degrees.
    pub fn min_angle(&self) -> f64 {
        self.patches.iter().map(|p| p.min_angle).fold(60.0, f64::min)
    }

    /// The largest angle between a triangle's normal and the surface's at one of its vertices, degrees.
    pub fn worst_normal(&self) -> f64 {
        self.patches.iter().map(|p| p.worst_normal).fold(0.0, f64::max)
    }

    /// Triangles with two edges on one smooth curve that are left.
    pub fn flattening_left(&self) -> usize {
        self.patches.iter().map(|p| p.flattening_left).sum()
    }

    /// Triangles with two edges on one smooth curve that were split.
    pub fn flattening_repaired(&self) -> usize {
        self.patches.iter().map(|p| p.flattening_repaired).sum()
    }
}
