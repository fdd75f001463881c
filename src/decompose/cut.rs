//! The geometry in pieces: each body cut into one for each part that it reaches into.

use super::plan::{Cuts, Half};
use crate::Point;
use crate::kernel::nearest::in_segment;
use crate::mesh::Class;
use crate::pipeline::CsgModel;
use csg::{
    Body, BodyId, CornerId, CurveId, FeatureError, Features, Geometry, Patch, PatchId, Solid, Surface,
    SurfaceId,
};
use std::collections::HashMap;

/// Why a geometry cannot be cut.
#[derive(Debug, thiserror::Error)]
pub enum CutError {
    /// The pieces have no features.
    #[error("the geometry cannot be cut so: {0}")]
    Features(#[from] FeatureError),
    /// A face of a piece is none of the geometry.
    #[error(
        "a cut would make a face of part {part} at ({}, {}, {}) that the geometry does not have; other planes may do (`--planes-from FILE`)",
        point.x, point.y, point.z
    )]
    NewFace {
        /// The part, from 0.
        part: usize,
        /// A point on it, or near.
        point: Point,
    },
}

/// What a face of a piece lies on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Face {
    /// A patch of the geometry, and whether it has the same normal.
    Old(PatchId, bool),
    /// A plane that cuts this body.
    Cut(BodyId),
}

/// A geometry whose bodies are pieces of those of another.
#[derive(Clone, Debug)]
pub struct CutModel {
    /// The pieces, with what they are meshed by.
    pub model: CsgModel,
    /// By piece: the part, and the body that it is a piece of.
    pub pieces: Vec<(usize, BodyId)>,
    /// What the patches lie on.
    pub faces: Vec<Face>,
    /// What the curves lie on.
    pub curves: Vec<Class>,
    /// What the corners lie on.
    pub corners: Vec<Class>,
}

/// The geometry that planes make of another: bodies are the pieces, part by part. Planes nearer than `tolerance` to one of the geometry
/// are that.
///
/// Statements that name bodies (`boundarycondition`, `singular`) are left out: numbers and names are those of the whole.
pub fn cut_geometry(
    geometry: &Geometry,
    cuts: &Cuts,
    pieces: &[(usize, BodyId)],
    tolerance: f64,
) -> Geometry {
    let mut cut = geometry.clone();
    // Of a plane that is one of the geometry's already, its surface, and whether the normal is the same.
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
    /// Cuts a geometry. `pieces` are those that may not be empty, by part and body; others are taken for empty, and found out if they
    /// are not.
    ///
    /// # Errors
    /// Pieces that cannot be meshed, with the place.
    pub fn new(whole: &CsgModel, cuts: &Cuts, mut pieces: Vec<(usize, BodyId)>) -> Result<Self, CutError> {
        let model = loop {
            match CsgModel::new(cut_geometry(&whole.geometry, cuts, &pieces, whole.projector.tolerance())) {
                Err(FeatureError::Empty(empty)) => pieces.retain(|&(part, body)| {
                    let name = piece_name(&whole.geometry.bodies[body.index()], part);
                    empty.iter().all(|named| named.solid != name)
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

    /// The body that a piece is of.
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

    /// What is no further apart than this is one, in the whole and in the pieces.
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
            // Another piece of the intersection of the same surfaces may be the nearest curve.
            let is_on = |&(id, away): &(CurveId, f64)| {
                on_patches > 1 || away < BESIDE && whole.projector.curve_distance(id, middle) <= tolerance
            };
            match old.filter(is_on) {
                Some((id, _)) if on_patches > 0 => Class::Curve(id),
                // Of those beside it, a patch says more than the inside of a body.
                _ => faces[0],
            }
        };
        (0..).zip(&self.model.features.curves).map(of_curve).collect()
    }

    /// A point inside a curve.
    fn middle(&self, id: CurveId, curve: &csg::Curve) -> Point {
        let half = curve.trace.len() / 2;
        let between = nalgebra::center(&curve.trace[half - 1], &curve.trace[half]);
        self.model.projector.project_curve(id, &between).unwrap_or(between)
    }

    /// What a vertex inside a patch of the pieces lies on.
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

    /// What a vertex of the pieces' surface mesh lies on.
    pub fn class(&self, class: Class) -> Class {
        match class {
            Class::Corner(id) => self.corners[id.index()],
            Class::Curve(id) => self.curves[id.index()],
            Class::Patch(id) => self.face_class(id),
            Class::Body(id) => Class::Body(self.pieces[id.index()].1),
        }
    }

    /// Whether a patch of the pieces lies on one of the geometry.
    pub fn is_old(&self, patch: PatchId) -> bool {
        matches!(self.faces[patch.index()], Face::Old(..))
    }

    /// The part and the body behind and in front of a patch.
    pub fn beside(&self, patch: PatchId) -> [Option<(usize, BodyId)>; 2] {
        let patch = self.model.features.patch(patch);
        [patch.inside, patch.outside].map(|piece| Some(self.pieces[piece?.index()]))
    }
}

/// A curve is no further from the chords of its trace than this, in units of their length: it turns by a quarter radian at most.
const BESIDE: f64 = 0.05;

/// The curve that is nearest to a point, and how far the point is from a chord of its trace, in units of the chord's length.
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
