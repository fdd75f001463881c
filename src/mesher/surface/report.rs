//! Statistics of surface meshing.

use super::sheet::Sheet;
use crate::ground::kernel::simplex::area_vector;
use crate::{Point, Vector};
use csg::PatchId;

/// Statistics of one patch.
#[derive(Clone, Debug, PartialEq)]
pub struct PatchReport {
    /// The patch.
    pub patch: PatchId,
    /// Number of triangles.
    pub triangles: usize,
    /// Number of interior vertices, not on curves.
    pub vertices: usize,
    /// The least quality 4√3·area/Σl², 1 for the regular triangle.
    pub worst_quality: f64,
    /// The mean quality.
    pub mean_quality: f64,
    /// The least angle, degrees.
    pub min_angle: f64,
    /// The largest angle between the normals of triangle and surface at a triangle's vertex,
    /// degrees.
    pub worst_normal: f64,
    /// Triangles with two edges on one smooth curve that had to be split.
    pub flattening_repaired: usize,
    /// Triangles with two edges on one smooth curve that remain (normally 0).
    pub flattening_left: usize,
    /// Positions rejected by the front because they were too close to others.
    pub refused: usize,
    /// Edges swapped in the improvement.
    pub swaps: usize,
    /// Number of vertex moves in the improvement.
    pub moves: usize,
    /// Edges collapsed.
    pub collapses: usize,
    /// Edges split.
    pub splits: usize,
}

/// Statistics of all patches.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Report {
    /// One report per patch.
    pub patches: Vec<PatchReport>,
}

impl Report {
    /// The number of triangles of all patches.
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

    /// The largest angle between the normals of triangle and surface at a triangle's vertex,
    /// degrees.
    pub fn worst_normal(&self) -> f64 {
        self.patches.iter().map(|p| p.worst_normal).fold(0.0, f64::max)
    }

    /// The number of triangles with two edges on one smooth curve that remain.
    pub fn flattening_left(&self) -> usize {
        self.patches.iter().map(|p| p.flattening_left).sum()
    }

    /// The number of triangles with two edges on one smooth curve that were split.
    pub fn flattening_repaired(&self) -> usize {
        self.patches.iter().map(|p| p.flattening_repaired).sum()
    }
}

impl PatchReport {
    /// The report of a patch without triangles.
    pub(super) fn blank(patch: PatchId) -> Self {
        Self {
            patch,
            triangles: 0,
            vertices: 0,
            worst_quality: 1.0,
            mean_quality: 0.0,
            min_angle: 60.0,
            worst_normal: 0.0,
            flattening_repaired: 0,
            flattening_left: 0,
            refused: 0,
            swaps: 0,
            moves: 0,
            collapses: 0,
            splits: 0,
        }
    }

    /// Adds the triangles of a sheet; the mean quality is a sum until [`finish`](Self::finish).
    pub(super) fn measure(&mut self, sheet: &Sheet) {
        for t in sheet.mesh.living() {
            let corners = sheet.corners(t);
            let p = corners.map(|n| n.point);
            let quality = triangle_quality(&p);
            self.triangles += 1;
            self.worst_quality = self.worst_quality.min(quality);
            self.mean_quality += quality;
            self.min_angle = self.min_angle.min(least_angle(&p));
            let normal = area_vector(&p[0], &p[1], &p[2]);
            for node in corners.iter().filter(|n| n.normal != Vector::zeros()) {
                self.worst_normal = self.worst_normal.max(normal.angle(&node.normal).to_degrees());
            }
        }
    }

    /// Divides the sum of qualities by the number of triangles.
    pub(super) fn finish(&mut self) {
        self.mean_quality /= self.triangles.max(1) as f64;
    }
}

/// 4√3·area/Σl²: 1 for the regular triangle, 0 for one without area.
fn triangle_quality(p: &[Point; 3]) -> f64 {
    let squares = (p[1] - p[0]).norm_squared() + (p[2] - p[1]).norm_squared() + (p[0] - p[2]).norm_squared();
    let double_area = area_vector(&p[0], &p[1], &p[2]).norm();
    if squares > 0.0 { 2.0 * 3.0_f64.sqrt() * double_area / squares } else { 0.0 }
}

/// The least angle of a triangle, degrees.
fn least_angle(p: &[Point; 3]) -> f64 {
    (0..3).map(|i| (p[(i + 1) % 3] - p[i]).angle(&(p[(i + 2) % 3] - p[i])).to_degrees()).fold(180.0, f64::min)
}
