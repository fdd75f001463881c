//! The cut geometry: each body is cut into one piece for each part that it extends into.

use super::cuts::{Cuts, Half};
use crate::Point;
use crate::ground::error::{ErrorKind, HasKind};
use crate::ground::kernel::nearest::in_segment;
use crate::ground::mesh::Class;
use crate::mesher::model::CsgModel;
use crate::parallel::distribution::DistError;
use crate::parallel::refine::RefineError;
use csg::{
    Body, BodyId, CornerId, CurveId, FeatureError, Features, Geometry, Patch, PatchId, Solid, Surface,
    SurfaceId,
};
use std::collections::HashMap;

/// Why a geometry cannot be cut.
#[derive(Debug, thiserror::Error)]
pub enum CutError {
    /// The features (curves and patches) of the pieces cannot be computed.
    #[error("the geometry cannot be cut by these planes: {0}")]
    Features(#[from] FeatureError),
    /// The coarse mesh from which planes are chosen is invalid.
    #[error(transparent)]
    Distribute(#[from] DistError),
    /// The boundary of the coarse mesh cannot be refined.
    #[error(transparent)]
    Refine(#[from] RefineError),
    /// A face of a piece is neither on a patch of the geometry nor a cut.
    #[error(
        "a cut would make a face of part {part} at ({}, {}, {}) that the geometry does not have; other planes may do",
        point.x, point.y, point.z
    )]
    NewFace {
        /// The part, from 0.
        part: usize,
        /// A point on the face, or near it.
        point: Point,
    },
}

impl HasKind for CutError {
    fn kind(&self) -> ErrorKind {
        match self {
            Self::Features(_) | Self::NewFace { .. } => ErrorKind::NoMesh,
            Self::Distribute(error) => error.kind(),
            Self::Refine(error) => error.kind(),
        }
    }
}

/// The origin of a face of a piece.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Face {
    /// A patch of the geometry, and whether the normals agree.
    Old(PatchId, bool),
    /// A plane that cuts this body.
    Cut(BodyId),
}

/// A geometry whose bodies are the pieces of another geometry's bodies.
#[derive(Clone, Debug)]
pub struct CutModel {
    /// The pieces, as a model to mesh.
    pub model: CsgModel,
    /// For each piece its part, and the body it is a piece of.
    pub pieces: Vec<(usize, BodyId)>,
    /// The origins of the patches.
    pub faces: Vec<Face>,
    /// The classes of the curves in the original geometry.
    pub curves: Vec<Class>,
    /// The classes of the corners in the original geometry.
    pub corners: Vec<Class>,
}

/// The geometry whose bodies are the pieces, part by part. Cutting planes closer than `tolerance`
/// to a plane of the geometry are identified with it.
///
/// Statements that refer to bodies by name (`boundarycondition`, `singular`) are dropped: numbers
/// and names come from the whole geometry.
pub fn cut_geometry(
    geometry: &Geometry,
    cuts: &Cuts,
    pieces: &[(usize, BodyId)],
    tolerance: f64,
) -> Geometry {
    let mut cut = geometry.clone();
    // For each plane its surface (an existing one if identified), and whether the normals agree.
    let mut surfaces: Vec<(SurfaceId, bool)> = Vec::with_capacity(cuts.planes.len());
    for plane in &cuts.planes {
        let (point, normal) = (plane.point, plane.normal);
        let plane = Surface::Plane(csg::primitive::Plane { point, normal });
        let known = geometry.surfaces.iter().map(|known| known.same_as(&plane, tolerance));
        surfaces.push(match (0..).zip(known).find_map(|(k, same)| Some((SurfaceId(k), same?))) {
            Some(known) => known,
            None => {
                cut.surfaces.push(plane);
                cut.surface_info.push(Default::default());
                (SurfaceId::new(cut.surfaces.len() - 1), true)
            }
        });
    }
    cut.boundary_overrides.clear();
    cut.singularities.clear();
    let half = |half: &Half| {
        let (surface, same) = surfaces[half.plane];
        Solid::Half { surface, positive: half.positive == same }
    };
    let piece = |&(part, body): &(usize, BodyId)| {
        let body = &geometry.bodies[body.index()];
        let halves = cuts.leaves[part].iter().map(half);
        Body {
            name: piece_name(body, part),
            solid: Solid::And(std::iter::once(body.solid.clone()).chain(halves).collect()),
            ..body.clone()
        }
    };
    cut.bodies = pieces.iter().map(piece).collect();
    cut
}

fn piece_name(body: &Body, part: usize) -> String {
    format!("{} in part {part}", body.name)
}

impl CutModel {
    /// Cuts a geometry. `pieces` are those that may be nonempty, by part and body. All others must
    /// be empty; if one is not, a face without an origin is found.
    ///
    /// # Errors
    /// [`CutError::Features`] if the pieces have no valid features, [`CutError::NewFace`] with a
    /// point on a face without an origin.
    pub fn new(whole: &CsgModel, cuts: &Cuts, mut pieces: Vec<(usize, BodyId)>) -> Result<Self, CutError> {
        let model = loop {
            match CsgModel::new(cut_geometry(&whole.geometry, cuts, &pieces, whole.projector.tolerance())) {
                Err(FeatureError::Empty(empty)) => pieces.retain(|&(part, body)| {
                    let name = piece_name(&whole.geometry.bodies[body.index()], part);
                    empty.iter().all(|named| *named.solid != *name)
                }),
                made => break made?,
            }
        };
        let mut cut = Self { model, pieces, faces: Vec::new(), curves: Vec::new(), corners: Vec::new() };
        cut.faces = cut.find_faces(&whole.features)?;
        cut.curves = cut.find_curves(whole);
        cut.corners = cut.find_corners(whole);
        Ok(cut)
    }

    /// The body that a piece belongs to.
    fn body(&self, piece: Option<BodyId>) -> Option<BodyId> {
        piece.map(|piece| self.pieces[piece.index()].1)
    }

    fn find_faces(&self, whole: &Features) -> Result<Vec<Face>, CutError> {
        let key = |patch: &Patch, inside, outside| (patch.surface, inside, outside, patch.cutout);
        let known: HashMap<_, PatchId> =
            whole.patches.iter().zip(0..).map(|(p, id)| (key(p, p.inside, p.outside), PatchId(id))).collect();
        let face = |patch: &Patch| {
            let [inside, outside] = [patch.inside, patch.outside].map(|piece| self.body(piece));
            if let (Some(body), true) = (inside, inside == outside && patch.cutout.is_none()) {
                return Ok(Face::Cut(body));
            }
            let same = known.get(&key(patch, inside, outside)).map(|&id| Face::Old(id, true));
            let other = || known.get(&key(patch, outside, inside)).map(|&id| Face::Old(id, false));
            same.or_else(other).ok_or_else(|| {
                let piece = patch.inside.or(patch.outside).expect("a patch bounds a piece");
                let curve =
                    patch.boundary.first().map(|(curve, _)| self.model.features.curve(*curve).trace[0]);
                let point = curve.or(patch.seeds.first().copied()).unwrap_or_else(Point::origin);
                CutError::NewFace { part: self.pieces[piece.index()].0, point }
            })
        };
        self.model.features.patches.iter().map(face).collect()
    }

    /// Entities at most this far apart are the same in the whole and in the pieces.
    fn tolerance(&self, whole: &CsgModel) -> f64 {
        whole.projector.tolerance().max(self.model.projector.tolerance())
    }

    fn find_curves(&self, whole: &CsgModel) -> Vec<Class> {
        let tolerance = self.tolerance(whole);
        let of_curve = |(id, curve): (u32, &csg::Curve)| {
            let mut faces: Vec<Class> = curve.fins.iter().map(|fin| self.face_class(fin.patch)).collect();
            faces.sort_unstable();
            faces.dedup();
            let on_patches = faces.iter().filter(|class| matches!(class, Class::Patch(_))).count();
            let middle = &self.middle(CurveId(id), curve);
            let old = nearest_curve(&whole.features, middle);
            // The nearest curve may be another part of the intersection of the same surfaces.
            let is_on = |&(id, away): &(CurveId, f64)| {
                on_patches > 1 || away < BESIDE && whole.projector.curve_distance(id, middle) <= tolerance
            };
            match old.filter(is_on) {
                Some((id, _)) if on_patches > 0 => Class::Curve(id),
                // Among the adjacent classes a patch is more specific than a body.
                _ => faces[0],
            }
        };
        (0..).zip(&self.model.features.curves).map(of_curve).collect()
    }

    /// A point in the interior of a curve.
    fn middle(&self, id: CurveId, curve: &csg::Curve) -> Point {
        let half = curve.trace.len() / 2;
        let between = nalgebra::center(&curve.trace[half - 1], &curve.trace[half]);
        self.model.projector.project_curve(id, &between).unwrap_or(between)
    }

    /// The class of a vertex in the interior of a patch of the pieces.
    fn face_class(&self, patch: PatchId) -> Class {
        match self.faces[patch.index()] {
            Face::Old(patch, _) => Class::Patch(patch),
            Face::Cut(body) => Class::Body(body),
        }
    }

    fn find_corners(&self, whole: &CsgModel) -> Vec<Class> {
        let tolerance = self.tolerance(whole);
        let mut classes: Vec<Option<Class>> = vec![None; self.model.features.corners.len()];
        for (curve, class) in self.model.features.curves.iter().zip(&self.curves) {
            for end in curve.ends.into_iter().flatten() {
                let known = &mut classes[end.index()];
                *known = Some(known.map_or(*class, |known| known.min(*class)));
            }
        }
        let old = |point: &Point| {
            let same = |corner: &csg::Corner| (corner.point - point).norm() <= tolerance;
            whole.features.corners.iter().position(same).map(|id| Class::Corner(CornerId::new(id)))
        };
        let corners = self.model.features.corners.iter().zip(classes);
        corners
            .map(|(corner, class)| old(&corner.point).or(class).unwrap_or(Class::Body(BodyId(0))))
            .collect()
    }

    /// The class in the original geometry of a vertex of the pieces' surface mesh.
    pub fn class(&self, class: Class) -> Class {
        match class {
            Class::Corner(id) => self.corners[id.index()],
            Class::Curve(id) => self.curves[id.index()],
            Class::Patch(id) => self.face_class(id),
            Class::Body(id) => Class::Body(self.pieces[id.index()].1),
        }
    }

    /// Whether a patch of the pieces is on a patch of the geometry.
    pub fn is_old(&self, patch: PatchId) -> bool {
        matches!(self.faces[patch.index()], Face::Old(..))
    }

    /// The part and the body behind and in front of a patch.
    pub fn beside(&self, patch: PatchId) -> [Option<(usize, BodyId)>; 2] {
        let patch = self.model.features.patch(patch);
        [patch.inside, patch.outside].map(|piece| Some(self.pieces[piece?.index()]))
    }
}

/// The maximum distance of a curve from the chords of its trace, in units of the chord's length:
/// between trace points it turns by a quarter radian at most.
const BESIDE: f64 = 0.05;

/// The curve nearest to a point, and the distance of the point from a chord of its trace, in units
/// of the chord's length.
fn nearest_curve(features: &Features, point: &Point) -> Option<(CurveId, f64)> {
    let chords = |(id, curve): (u32, &csg::Curve)| {
        let to =
            move |ends: &[Point]| (in_segment(point, &ends[0], &ends[1]).1, (ends[1] - ends[0]).norm(), id);
        curve.trace.windows(2).map(to).collect::<Vec<_>>()
    };
    let all = (0..).zip(&features.curves).flat_map(chords);
    let nearest = all.min_by(|a, b| a.0.total_cmp(&b.0));
    nearest.map(|(squared, length, id)| (CurveId(id), squared.sqrt() / length))
}
