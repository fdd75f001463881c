//! On which side of another solid the faces of a solid are.
//!
//! Faces were divided where solids cross, so each is on one side of the other solid. At a curve of
//! both solids, the directions into their faces have an order around the curve, which tells whether
//! a face leads into the other solid. Faces that share a curve of their own are on the same side.
//! Only where no curve of the other solid bounds a part of the surface its triangles are asked.

use super::super::Shapes;
use crate::model::EdgeCurve;
use crate::nearest::nearest_on_surface;
use crate::shapes::imprint::whole;
use crate::tessellate::Shell;
use crate::{BrepError, Point, Vector};
use std::collections::{BTreeSet, HashMap};
use std::f64::consts::TAU;

/// Where a face is with respect to another solid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    Outside,
    Inside,
    /// It is a face of the other solid, too, which is on the same side of it ...
    Same,
    /// ... or on the other side.
    Opposite,
}

/// Faces whose directions from a curve differ by less (radians) are tangent there.
const TANGENT: f64 = 1e-3;
/// Places are this far beside a curve (share of its length up to where it is asked).
const BESIDE: f64 = 0.1;
/// Where curves are asked (share of their range).
const PLACE: f64 = 0.43;
/// At most so many points of a part of a surface are compared with triangles.
const MOST_PLACES: usize = 9;

/// The faces at each curve, with whether their loops follow it.
pub(super) struct Uses<'a> {
    shapes: &'a Shapes,
    of: HashMap<usize, Vec<(usize, bool)>>,
    of_body: Vec<Vec<usize>>,
}

/// A face seen from one of its curves.
struct Spoke {
    face: usize,
    /// The unit vector into the face, across the curve.
    inward: Vector,
    /// The unit normal out of its solid.
    outward: Vector,
}

impl<'a> Uses<'a> {
    pub fn new(shapes: &'a Shapes) -> Self {
        let mut of: HashMap<usize, Vec<(usize, bool)>> = HashMap::new();
        let mut of_body = vec![Vec::new(); shapes.accuracy.len()];
        for (number, face) in shapes.faces.iter().enumerate() {
            of_body[face.body].push(number);
            for &(curve, is_forward) in face.loops.iter().flatten() {
                of.entry(curve).or_default().push((number, is_forward));
            }
        }
        Self { shapes, of, of_body }
    }

    /// The sides of the faces of a body with respect to another one, given the shells of that.
    ///
    /// # Errors
    /// [`BrepError::Solid`] if curves contradict each other.
    pub fn sides(
        &self,
        body: usize,
        other: usize,
        shells: &[Shell],
    ) -> Result<Vec<(usize, Side)>, BrepError> {
        let mut sides = Vec::new();
        let mut free = Vec::new();
        for &face in &self.of_body[body] {
            match self.coincident(face, other) {
                Some(side) => sides.push((face, side)),
                None => free.push(face),
            }
        }
        for part in self.parts(&free, other) {
            let side = self.side(&part, other, shells)?;
            sides.extend(part.into_iter().map(|face| (face, side)));
        }
        Ok(sides)
    }

    fn is_of(&self, curve: usize, body: usize) -> bool {
        self.of[&curve].iter().any(|&(face, _)| self.shapes.faces[face].body == body)
    }

    /// Whether a face is one of another body, too.
    fn coincident(&self, number: usize, other: usize) -> Option<Side> {
        let own = self.shapes.curves_of(number);
        let first = own.first()?;
        let faces = self.of[first].iter().map(|of| of.0);
        let face = &self.shapes.faces[number];
        let is_same = |there: usize, curve: usize| {
            let edge = &self.shapes.curves[curve];
            let spoke = |face: usize| Some(self.spokes(edge, curve, face).next()?.inward);
            matches!((spoke(number), spoke(there)), (Some(a), Some(b)) if a.angle(&b) < TANGENT)
        };
        let there = faces.into_iter().find(|&there| {
            self.shapes.faces[there].body == other
                && self.shapes.curves_of(there) == own
                && own.iter().all(|&curve| is_same(there, curve))
        })?;
        let place = at(&self.shapes.curves[*first]).0;
        let [a, b] = [face, &self.shapes.faces[there]].map(|face| face.outward(&place));
        Some(if a.dot(&b) > 0.0 { Side::Same } else { Side::Opposite })
    }

    /// The sets of faces that curves which the other body does not have connect.
    fn parts(&self, faces: &[usize], other: usize) -> Vec<Vec<usize>> {
        let mut left: BTreeSet<usize> = faces.iter().copied().collect();
        let mut parts: Vec<Vec<usize>> = Vec::new();
        while let Some(first) = left.pop_first() {
            let mut part = vec![first];
            let mut next = 0;
            while let Some(&face) = part.get(next) {
                next += 1;
                let own = self.shapes.curves_of(face).into_iter().filter(|&curve| !self.is_of(curve, other));
                part.extend(
                    own.flat_map(|curve| &self.of[&curve]).map(|of| of.0).filter(|face| left.remove(face)),
                );
            }
            parts.push(part);
        }
        parts
    }

    /// Whether a part of a surface is inside of another body.
    fn side(&self, part: &[usize], other: usize, shells: &[Shell]) -> Result<Side, BrepError> {
        let mut found: Option<bool> = None;
        for &face in part {
            for curve in self.shapes.curves_of(face).into_iter().filter(|&curve| self.is_of(curve, other)) {
                let Some(is_inside) = self.leads_inside(face, curve, other) else { continue };
                if *found.get_or_insert(is_inside) != is_inside {
                    let what =
                        format!("it cannot be decided which of its faces are inside of solid {}", other + 1);
                    let place = at(&self.shapes.curves[curve]).0;
                    return Err(BrepError::solid(self.shapes.faces[face].body, what, Some(place)));
                }
            }
        }
        let is_inside = found.unwrap_or_else(|| {
            let places = self.places(part, other);
            let contains =
                |place: &&Point| shells.iter().filter(|shell| shell.contains(**place)).count() % 2 == 1;
            2 * places.iter().filter(contains).count() > places.len()
        });
        Ok(if is_inside { Side::Inside } else { Side::Outside })
    }

    /// Whether a face at a curve of another body leads into that; `None` if it is tangent to it.
    fn leads_inside(&self, face: usize, curve: usize, other: usize) -> Option<bool> {
        let edge = &self.shapes.curves[curve];
        let own = self.spokes(edge, curve, face).next()?;
        let along = at(edge).1;
        let across = along.cross(&own.inward);
        let faces =
            self.of[&curve].iter().map(|of| of.0).filter(|&face| self.shapes.faces[face].body == other);
        let angle = |way: &Vector| way.dot(&across).atan2(way.dot(&own.inward)).rem_euclid(TAU);
        let there: Vec<Spoke> = faces.flat_map(|face| self.spokes(edge, curve, face)).collect();
        let angles: Vec<f64> = there.iter().map(|spoke| angle(&spoke.inward)).collect();
        if angles.iter().any(|angle| !(TANGENT..=TAU - TANGENT).contains(angle)) {
            return None;
        }
        // Of faces that are tangent to each other the order is that of places beside the curve.
        let largest = angles.iter().copied().fold(0.0, f64::max);
        let last = there.iter().zip(&angles).filter(|(_, angle)| **angle > largest - TANGENT);
        let beside = |spoke: &Spoke| angle(&self.way_beside(edge, spoke));
        let (last, _) = last.max_by(|(a, _), (b, _)| beside(a).total_cmp(&beside(b)))?;
        // The direction of growing angles leads from that face into its body, or out of it.
        Some(last.outward.dot(&along.cross(&last.inward)) < 0.0)
    }

    /// The way from a curve to a place of a face's surface beside it.
    fn way_beside(&self, edge: &EdgeCurve, spoke: &Spoke) -> Vector {
        let place = at(edge).0;
        let step = BESIDE * (Point::from(edge.curve.point(edge.range[0])) - place).norm();
        let surface = &self.shapes.faces[spoke.face].surface;
        nearest_on_surface(surface, &(place + spoke.inward * step)).point - place
    }

    /// A face seen from one of its curves, twice if it is on both sides of it.
    fn spokes<'b>(
        &'b self,
        edge: &EdgeCurve,
        curve: usize,
        face: usize,
    ) -> impl Iterator<Item = Spoke> + use<'b> {
        let (place, along) = at(edge);
        let uses = self.of[&curve].iter().filter(move |of| of.0 == face);
        let owner = &self.shapes.faces[face];
        let normal = nearest_on_surface(&owner.surface, &place).normal;
        let outward = if owner.is_behind { normal } else { -normal };
        uses.filter_map(move |&(_, is_forward)| {
            let inward = normal.cross(&along).try_normalize(0.0)?;
            let inward = if is_forward { inward } else { -inward };
            Some(Spoke { face, inward, outward })
        })
    }

    /// Some points of a part of a surface that are not on curves of another body if possible.
    fn places(&self, part: &[usize], other: usize) -> Vec<Point> {
        let mut places = Vec::new();
        let mut inside = Vec::new();
        for &face in part {
            let surface = &self.shapes.faces[face].surface;
            let curves = self.shapes.curves_of(face);
            if curves.is_empty() {
                places.extend(whole(surface));
            }
            for curve in curves {
                let edge = &self.shapes.curves[curve];
                if !self.is_of(curve, other) {
                    places.push(at(edge).0);
                } else if let Some(spoke) = self.spokes(edge, curve, face).next() {
                    let place = at(edge).0;
                    let length = (place - Point::from(edge.curve.point(edge.range[0]))).norm();
                    inside.push(nearest_on_surface(surface, &(place + spoke.inward * (0.1 * length))).point);
                }
            }
        }
        let places = if places.is_empty() { inside } else { places };
        let step = places.len().div_ceil(MOST_PLACES).max(1);
        places.into_iter().step_by(step).collect()
    }
}

/// A point of an edge and the unit tangent there.
fn at(edge: &EdgeCurve) -> (Point, Vector) {
    let jet = edge.curve.jet(edge.range[0] + PLACE * (edge.range[1] - edge.range[0]));
    (Point::from(jet[0]), jet[1].try_normalize(0.0).unwrap_or_else(Vector::zeros))
}
