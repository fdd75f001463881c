//! What came of a remeshing.

use super::sheet::{Sheet, shape};
use crate::Point;

/// What was done, and how good the triangles are.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RemeshReport {
    /// Triangles.
    pub triangles: usize,
    /// Vertices.
    pub vertices: usize,
    /// The least quality, 4√3·area/Σl².
    pub worst_quality: f64,
    /// The mean quality.
    pub mean_quality: f64,
    /// The least angle, degrees.
    pub min_angle: f64,
    /// Triangles with an angle below 20°.
    pub below_20: usize,
    /// Triangles with two edges on one smooth curve: they flatten in refinement.
    pub flattening_left: usize,
    /// Triangles that do not follow their facets: normals 60° off, or a fifth of an edge away.
    pub misfits: usize,
    /// The middles of the sides of triangles that meet others where they must not.
    pub crossings: Vec<Point>,
    /// Times the mesh was made anew with smaller sizes where triangles met.
    pub corrections: usize,
    /// Edges collapsed.
    pub collapses: usize,
    /// Edges split.
    pub splits: usize,
    /// Edges flipped.
    pub flips: usize,
    /// Vertices moved, each as often as it was.
    pub moves: usize,
}

impl RemeshReport {
    /// Measures the triangles.
    pub(super) fn measure(&mut self, sheet: &Sheet) {
        (self.worst_quality, self.min_angle) = (1.0, 60.0);
        let mut sum = 0.0;
        for t in sheet.living() {
            let triangle = sheet.at(t);
            let p = sheet.corners(triangle.v);
            let quality = shape(&p);
            sum += quality;
            let angle = least_angle(&p);
            self.triangles += 1;
            self.worst_quality = self.worst_quality.min(quality);
            self.min_angle = self.min_angle.min(angle);
            self.below_20 += usize::from(angle < 20.0);
            self.flattening_left += usize::from(sheet.flattens(triangle.curve));
            self.misfits += usize::from(!sheet.fits_at(t));
        }
        self.mean_quality = sum / self.triangles.max(1) as f64;
        self.vertices = sheet.around.iter().filter(|a| !a.is_empty()).count();
    }
}

/// The least angle of a triangle, degrees.
pub(super) fn least_angle(p: &[Point; 3]) -> f64 {
    (0..3).map(|i| (p[(i + 1) % 3] - p[i]).angle(&(p[(i + 2) % 3] - p[i])).to_degrees()).fold(180.0, f64::min)
}
