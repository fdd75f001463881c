//! Statistics of remeshing.

use super::sheet::{Sheet, shape};
use crate::Point;

/// Numbers of changes, and the quality of the triangles.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RemeshReport {
    /// Number of triangles.
    pub triangles: usize,
    /// Number of vertices.
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
    /// Triangles that do not follow their facets: normals differ by more than 60°, or the distance
    /// is a fifth of an edge.
    pub misfits: usize,
    /// The midpoints of the edges of triangles that intersect others improperly.
    pub crossings: Vec<Point>,
    /// How often sizes were lowered at intersections of triangles.
    pub corrections: usize,
    /// Edges collapsed.
    pub collapses: usize,
    /// Edges split.
    pub splits: usize,
    /// Edges flipped.
    pub flips: usize,
    /// Number of vertex moves.
    pub moves: usize,
}

impl RemeshReport {
    /// Measures the triangles of the sheet.
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
