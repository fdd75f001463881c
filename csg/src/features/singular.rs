//! Patches, curves and corners tagged as singular.
//!
//! Solvers grade their elements there. The mesh does not depend on the tags, except for the mesh
//! size that a singular edge may set.

use super::Features;
use crate::{CornerId, CurveId, Geometry, PatchId, SingularPlace, SurfaceId};

/// The factors of singular patches, curves and corners. Each entity occurs once, with its last tag.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Singular {
    /// Patches, ascending.
    pub patches: Vec<(PatchId, i32)>,
    /// Curves, ascending.
    pub curves: Vec<(CurveId, i32)>,
    /// Corners, ascending.
    pub corners: Vec<(CornerId, i32)>,
}

impl Features {
    /// The singular entities and their factors.
    pub fn singular(&self, geometry: &Geometry) -> Singular {
        let factor = |is_here: &dyn Fn(&SingularPlace) -> bool| {
            let mut here = geometry.singularities.iter().filter(|s| is_here(&s.place));
            here.next_back().map(|singularity| singularity.factor)
        };
        let patches = (0..self.patches.len()).map(PatchId::new);
        let curves = (0..self.curves.len()).map(CurveId::new);
        let corners = (0..self.corners.len()).map(CornerId::new);
        Singular {
            patches: patches.filter_map(|id| Some((id, factor(&|place| self.is_face(id, place))?))).collect(),
            curves: curves.filter_map(|id| Some((id, factor(&|place| self.is_edge(id, place))?))).collect(),
            corners: corners
                .filter_map(|id| Some((id, factor(&|place| self.is_point(id, place))?)))
                .collect(),
        }
    }

    /// The smallest mesh size that singular edges set along a curve; infinity if none.
    pub fn edge_bound(&self, geometry: &Geometry, curve: CurveId) -> f64 {
        let here = geometry.singularities.iter().filter(|s| self.is_edge(curve, &s.place));
        here.filter_map(|singularity| singularity.maxh).fold(f64::INFINITY, f64::min)
    }

    fn is_face(&self, id: PatchId, place: &SingularPlace) -> bool {
        let patch = self.patch(id);
        match place {
            SingularPlace::Face { surfaces, body } => {
                surfaces.contains(&patch.surface) && [patch.inside, patch.outside].contains(&Some(*body))
            }
            _ => false,
        }
    }

    fn is_edge(&self, id: CurveId, place: &SingularPlace) -> bool {
        let SingularPlace::Edge { surfaces: [first, second], body } = place else { return false };
        let curve = self.curve(id);
        let beside = curve.fins.iter().map(|fin| self.patch(fin.patch));
        let at_body = body.is_none_or(|body| {
            beside.clone().any(|patch| [patch.inside, patch.outside].contains(&Some(body)))
        });
        let mut through: Vec<SurfaceId> = curve.surfaces.to_vec();
        through.extend(beside.map(|patch| patch.surface));
        at_body && are_different(&through, &[first, second])
    }

    fn is_point(&self, id: CornerId, place: &SingularPlace) -> bool {
        let SingularPlace::Point { surfaces: [first, second, third] } = place else { return false };
        are_different(&self.corner(id).surfaces, &[first, second, third])
    }
}

/// Whether `through` contains distinct surfaces, one from each list.
fn are_different(through: &[SurfaceId], lists: &[&Vec<SurfaceId>]) -> bool {
    let Some((list, rest)) = lists.split_first() else { return true };
    let mut candidates = through.iter().filter(|surface| list.contains(surface));
    candidates.any(|taken| {
        let left: Vec<SurfaceId> = through.iter().copied().filter(|surface| surface != taken).collect();
        are_different(&left, rest)
    })
}

#[cfg(test)]
mod tests {
    use crate::{Features, language};

    #[test]
    fn faces_edges_and_points_between_the_named_solids_are_singular() {
        let source = "algebraic3d
            solid top = plane (0,0,1; 0,0,1); solid right = plane (1,0,0; 1,0,0); solid front = plane (0,0,0; 0,-1,0);
            solid box = orthobrick (0,0,0; 1,1,1) and top and right and front; tlo box;
            singular face box top -factor=3; singular edge top right -maxh=0.05 -tlo=box; singular point top right front;";
        let geometry = language::parse_geometry(source, "box.geo").unwrap().geometry;
        let features = Features::find(&geometry).unwrap();
        let singular = features.singular(&geometry);
        let [(patch, 3)] = singular.patches[..] else { panic!("{singular:?}") };
        assert_eq!(features.patch(patch).bc, 1, "the top is the first surface of the file");
        let [(curve, 1)] = singular.curves[..] else { panic!("{singular:?}") };
        assert!(features.curve(curve).trace.iter().all(|p| p.x == 1.0 && p.z == 1.0));
        assert_eq!(features.edge_bound(&geometry, curve), 0.05);
        let [(corner, 1)] = singular.corners[..] else { panic!("{singular:?}") };
        assert_eq!(features.corner(corner).point, crate::Point::new(1.0, 0.0, 1.0));
    }
}
