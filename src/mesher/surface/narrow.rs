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
/// of plates would get more triangles than the rest.
const NARROWEST: f64 = 1.0 / 12.0;

/// Sources that shorten the segments along narrow bands of patches.
///
/// Curves with a common corner are excluded: between two curves that meet at an angle the band
/// tapers to zero for any size.
pub fn narrow(
    mesh: &SurfaceMesh,
    features: &Features,
    projector: &Projector,
    size: &dyn SizeField,
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
        for (k, a) in sides.iter().enumerate() {
            for b in sides[k + 1..].iter().take_while(|b| b.low.x <= a.high.x) {
                if (1..3).all(|i| a.low[i] <= b.high[i] && b.low[i] <= a.high[i]) && may_face(features, a, b)
                {
                    sources.extend(a.facing_sources(b, size).chain(b.facing_sources(a, size)));
                }
            }
        }
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
}

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
        Self { segment, ends, length, inward, low, high }
    }

    /// Sources along this segment where `other` faces it across a narrow band.
    fn facing_sources<'b>(
        &'b self,
        other: &'b Self,
        used: &'b dyn SizeField,
    ) -> impl Iterator<Item = Source> + 'b {
        /// Number of sampled intervals; within one the width of the band changes little.
        const PARTS: u32 = 4;
        let [from, to] = other.ends;
        let along = to - from;
        (0..=PARTS).filter_map(move |part| {
            let point = self.ends[0] + (self.ends[1] - self.ends[0]) * (f64::from(part) / f64::from(PARTS));
            let foot = ((point - from).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
            let way = from + along * foot - point;
            let width = way.norm();
            let is_inside = way.dot(&self.inward) > 0.0 && way.dot(&other.inward) < 0.0;
            let is_narrow = LONG * width < self.length && width > NARROWEST * self.length;
            let size = || (SHORT * width).min(SHORTENED * self.length.min(used.size_at(&point)));
            (is_inside && is_narrow).then(|| Source { point, size: size() })
        })
    }
}
