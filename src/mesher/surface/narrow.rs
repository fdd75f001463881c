//! Sizes for narrow bands of patches, narrower than their segments are long.
//!
//! Between two nearly parallel curves there is no space for vertices: triangles have a segment of
//! one curve as a side and a vertex of the other as a corner. If that is opposite an end of the
//! segment, the triangle has an angle of atan(width / length).

use super::SurfaceMesh;
use crate::ground::mesh::Segment;
use crate::ground::size::{SizeField, Source};
use crate::{Point, Vector};
use csg::{Features, PatchId, Projector};

/// Ratio of segment length to band width above which the segment is shortened; it gives an angle of
/// 23.5°.
const LONG: f64 = 2.3;
/// Length to which such a segment is shortened, in widths of the band.
const SHORT: f64 = 1.8;
/// Upper limit of the new size, as a fraction of the segment's length and of the size used: because
/// of steep grading and rounding to whole segments, a segment may be longer than the size at its
/// ends.
const SHORTENED: f64 = 0.7;
/// Bands narrower than this fraction of their segments' length are left unchanged: the thin sides
/// of plates would get more triangles than the rest. The length is that before any correction, or
/// short segments at the ends of a band would spread along it from attempt to attempt.
const NARROWEST: f64 = 1.0 / 12.0;

/// Sources that shorten the segments along narrow bands of patches.
///
/// `size` is the field used, `initial` the same without corrections. Curves with a common corner
/// are excluded: between two curves that meet at an angle the band tapers to zero for any size.
pub fn narrow(
    mesh: &SurfaceMesh,
    features: &Features,
    projector: &Projector,
    [size, initial]: [&dyn SizeField; 2],
) -> Vec<Source> {
    let mut sources = Vec::new();
    for (i, patch) in features.patches.iter().enumerate() {
        let id = PatchId::new(i);
        let mut sides: Vec<Side> = Vec::new();
        for &(curve, forward) in &patch.boundary {
            let sign = if forward != patch.flipped { 1.0 } else { -1.0 };
            sides
                .extend(mesh.segments_of(curve).map(|segment| Side::new(mesh, projector, id, segment, sign)));
        }
        sides.sort_by(|a, b| a.low.x.total_cmp(&b.low.x));
        for k in 1..sides.len() {
            let (before, after) = sides.split_at_mut(k);
            let a = &mut before[k - 1];
            let last = a.high.x;
            for b in after.iter_mut().take_while(|b| b.low.x <= last) {
                if (1..3).all(|i| a.low[i] <= b.high[i] && b.low[i] <= a.high[i]) && may_face(features, a, b)
                {
                    a.measure(b);
                    b.measure(a);
                }
            }
        }
        sources.extend(sides.iter().flat_map(|side| side.sources([size, initial])));
    }
    sources
}

/// Whether two segments belong to different curves without a common corner.
fn may_face(features: &Features, a: &Side, b: &Side) -> bool {
    let [c, d] = [a, b].map(|side| features.curve(side.segment.curve).ends.into_iter().flatten());
    a.segment.curve != b.segment.curve && !c.into_iter().any(|corner| d.clone().any(|other| other == corner))
}

/// A segment on the boundary of a patch.
struct Side<'a> {
    segment: &'a Segment,
    ends: [Point; 2],
    length: f64,
    /// The unit vector normal to the segment and into the patch.
    inward: Vector,
    /// The box of everything that may be too close.
    low: Point,
    high: Point,
    /// The width of the band at points along the segment, as far as it has been measured.
    widths: [f64; SAMPLES],
}

/// Number of points of a segment at which the width of the band is measured; between two it changes
/// little.
const SAMPLES: usize = 5;

impl<'a> Side<'a> {
    /// `sign` is positive if the patch is on the left of the segment as seen against the gradient
    /// of its surface.
    fn new(
        mesh: &SurfaceMesh,
        projector: &Projector,
        patch: PatchId,
        segment: &'a Segment,
        sign: f64,
    ) -> Self {
        let ends = segment.vertices.map(|v| mesh.points[v.index()]);
        let along = ends[1] - ends[0];
        let length = along.norm();
        let normal = projector.patch_surface(patch).normal(&nalgebra::center(&ends[0], &ends[1]));
        let inward = (normal.cross(&along) * sign).try_normalize(0.0).unwrap_or_default();
        let room = Vector::repeat(0.5 * length / LONG);
        let (low, high) = (ends[0].inf(&ends[1]) - room, ends[0].sup(&ends[1]) + room);
        Self { segment, ends, length, inward, low, high, widths: [f64::INFINITY; SAMPLES] }
    }

    fn samples(&self) -> [Point; SAMPLES] {
        let way = self.ends[1] - self.ends[0];
        std::array::from_fn(|k| self.ends[0] + way * (k as f64 / (SAMPLES - 1) as f64))
    }

    /// Measures the width of the band where `other` is on its opposite side. Of all segments there
    /// the nearest counts.
    fn measure(&mut self, other: &Self) {
        let [from, to] = other.ends;
        let along = to - from;
        for (point, width) in self.samples().iter().zip(&mut self.widths) {
            let foot = ((point - from).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
            let way = from + along * foot - point;
            if way.dot(&self.inward) > 0.0 && way.dot(&other.inward) < 0.0 {
                *width = width.min(way.norm());
            }
        }
    }

    /// Sources along this segment where the band is narrow.
    fn sources<'b>(&'b self, [used, initial]: [&'b dyn SizeField; 2]) -> impl Iterator<Item = Source> + 'b {
        self.samples().into_iter().zip(self.widths).filter_map(move |(point, width)| {
            let is_narrow =
                LONG * width < self.length && width > NARROWEST * self.length.max(initial.size_at(&point));
            let size = || (SHORT * width).min(SHORTENED * self.length.min(used.size_at(&point)));
            is_narrow.then(|| Source { point, size: size() })
        })
    }
}
