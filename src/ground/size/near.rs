//! Sizes where a curved surface nearly coincides with another.
//!
//! Triangles are chords: those of edge length L deviate by up to κL²/6 from a surface of curvature
//! κ, towards its concave side. Where another surface is nearer than that on this side (the wall of
//! a pipe, a pin in its hole), triangles of both would intersect.

use crate::Point;
use csg::{Geometry, SurfaceId};

/// Two surfaces that are so close to each other that their distance limits the size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NearSurfaces {
    /// The surfaces; the first is curved around the second.
    pub surfaces: [SurfaceId; 2],
    /// A point on the first.
    pub at: Point,
    /// Their distance there (length).
    pub gap: f64,
    /// The size at which their triangles stay apart.
    pub size: f64,
    /// The size without the other surface.
    pub size_alone: f64,
    /// Whether the size is lowered as far as the gap needs.
    pub is_resolved: bool,
}

/// The square of the size at which triangles stay apart, in units of the gap and the radius of
/// curvature: edges up to 1.3 times the size leave 30 % of the gap.
const ROOM: f64 = 2.5;

/// Surfaces that meet within this multiple of the size are left out: they share vertices there.
const WEDGE: f64 = 4.0;

/// Sizes are not lowered by more than this factor because of a gap: the number of triangles there
/// grows by its square. The wall of a pipe may be 1/4,000 of its radius. Closer surfaces are
/// probably meant as one.
const LARGEST_REDUCTION: f64 = 20.0;

/// The distance on both sides of a surface at which it is told whether it is a boundary, in units
/// of the gap.
const SIDE: f64 = 0.25;

impl NearSurfaces {
    /// The other surface near a point of a surface, if that needs a smaller size than `size_alone`,
    /// in which sizes are multiplied by `scale`. `is_boundary` returns whether the other surface is
    /// a boundary at a point, as far as points at some distance (length) on both sides tell.
    pub(super) fn find(
        geometry: &Geometry,
        surfaces: [SurfaceId; 2],
        at: &Point,
        (size_alone, scale): (f64, f64),
        is_boundary: impl Fn(&Point, f64) -> bool,
    ) -> Option<Self> {
        let [own, other] = surfaces.map(|id| &geometry.surfaces[id.index()]);
        // Far surfaces are most: their distance to first order is cheap.
        let foot = if other.distance(at) < size_alone { other.project(at).ok()? } else { return None };
        let gap = (foot - at).norm();
        let curvature = own.curvature_towards(at, &(foot - at));
        let size = (ROOM * gap / curvature).sqrt();
        let angle = own.normal(at).cross(&other.normal(&foot)).norm();
        let is_resolved = LARGEST_REDUCTION * scale.max(1.0) * size >= size_alone;
        let is_near = size < size_alone && gap > WEDGE * size * angle && is_boundary(&foot, SIDE * gap);
        is_near.then_some(Self { surfaces, at: *at, gap, size, size_alone, is_resolved })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::size::{GeometricSamples, SizeSettings};
    use csg::Features;

    /// The samples at which another surface limits the size.
    fn near(text: &str) -> Vec<NearSurfaces> {
        let geometry = csg::language::parse_geometry(&format!("algebraic3d {text}"), "near.geo").unwrap();
        let features = Features::find(&geometry.geometry).unwrap();
        GeometricSamples::new(&geometry.geometry, &features, &SizeSettings::default()).near().to_vec()
    }

    fn pipe(wall: f64) -> String {
        format!(
            "solid pipe = cylinder (0, 0, 0; 0, 0, 1; 1) and not cylinder (0, 0, 0; 0, 0, 1; {})
                 and plane (0, 0, 0; 0, 0, -1) and plane (0, 0, 1; 0, 0, 1);
             tlo pipe;",
            1.0 - wall
        )
    }

    #[test]
    fn the_size_of_a_thin_wall_keeps_its_chords_apart() {
        for wall in [1e-2, 1e-3] {
            let near = near(&pipe(wall));
            assert!(near.iter().all(|near| near.is_resolved && (near.gap / wall - 1.0).abs() < 1e-9));
            // The sagitta of an edge 1.3 times as long as the size.
            let sagitta = near.iter().map(|near| (1.3 * near.size).powi(2) / 8.0).fold(0.0, f64::max);
            assert!((0.4..0.6).contains(&(sagitta / wall)), "{sagitta} at {wall}");
        }
        let thinner = near(&pipe(1e-5));
        assert!(!thinner.is_empty() && thinner.iter().all(|near| !near.is_resolved));
    }

    #[test]
    fn surfaces_that_are_no_boundary_or_on_the_convex_side_do_not_limit_the_size() {
        let balls = "solid balls = sphere (0, 0, 0; 1) or sphere (0, 0, 0.001; 1); tlo balls;";
        let rod = "solid plate = orthobrick (-2, -2, -1; 2, 2, 0);
                   solid rod = cylinder (0, 0, 1.001; 1, 0, 1.001; 1) and orthobrick (-1, -2, -1; 1, 2, 3);
                   solid both = plate or rod; tlo both;";
        assert_eq!([near(balls), near(rod)], [vec![], vec![]]);
    }
}
