//! Whether solids whose facets intersect overlap, or only touch.
//!
//! Facets of two faces intersect because the faces cross, because they touch in a line or a point,
//! or because facets are beside their faces. The exact surfaces tell which: they have a common
//! point there or not, and cross it or are tangent. Solids whose faces only touch may still be one
//! inside of the other; a facet of one that is inside of the other tells.

use crate::ground::kernel::nearest::{at, in_segment, in_triangle};
use crate::ground::kernel::predicates::{Sign, orient3d};
use crate::ground::kernel::tree::{Tree, bounds};
use crate::ground::mesh::{BoundaryTriangle, Touching, pairs_of_bodies};
use crate::ground::projector::BrepProjector;
use crate::mesher::facets::{Crossing, FacetModel};
use crate::{Point, Vector};
use csg::{BodyId, CurveId, PatchId};
use nalgebra::{Matrix2, Vector2};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::OnceLock;

/// Surfaces at most this far apart have a common point (fraction of the size of the model).
const COMMON: f64 = 1e-8;
/// Facets that intersect by no more than this touch (fraction of the size of the model).
const SHALLOW: f64 = 1e-7;
/// Surfaces that meet at a smaller angle (radians) are tangent.
const TANGENT: f64 = 1e-3;
/// The most steps in search of a common point of two surfaces.
const TURNS: usize = 30;

/// How two solids meet where their facets intersect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Contact {
    /// Their faces are tangent, or intersect by no more than rounding.
    Touch,
    /// Their faces cross.
    Overlap,
}

/// Where two solids meet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Meeting {
    /// A face of each.
    pub patches: [PatchId; 2],
    /// A place of both.
    pub at: Point,
}

/// The facets of a model, and the exact faces that they approximate.
pub(super) struct Contacts<'a> {
    model: &'a FacetModel,
    exact: &'a BrepProjector,
    size: f64,
    patches_of_curves: OnceLock<Vec<Vec<PatchId>>>,
}

impl<'a> Contacts<'a> {
    pub fn new(model: &'a FacetModel, exact: &'a BrepProjector) -> Self {
        Self { model, exact, size: model.bounds.diagonal(), patches_of_curves: OnceLock::new() }
    }

    /// How solids meet where facets intersect; `None` for facets of one solid, and for those that
    /// intersect only because they are beside their faces, or beside an edge of both.
    pub fn of(&self, crossing: &Crossing) -> Option<Contact> {
        if !self.model.are_of_different_bodies(crossing) {
            return None;
        }
        let at = self.common_point(crossing.patches, crossing.at)?;
        if self.part_at_common_curve(crossing.patches, &at) {
            return Some(Contact::Touch);
        }
        if self.is_on_common_curve(crossing.patches, &at) {
            return None;
        }
        if crossing.depth <= SHALLOW * self.size || self.are_tangent(crossing.patches, &at) {
            return Some(Contact::Touch);
        }
        let edges = crossing.patches.map(|patch| self.edges_at(patch, &at));
        if edges.iter().all(Vec::is_empty) {
            return Some(Contact::Overlap);
        }
        // The faces beyond an edge may touch the other one.
        let pairs = (0..2).flat_map(|k| edges[k].iter().map(move |&edge| (k, edge))).flat_map(|(k, edge)| {
            let other = crossing.patches[1 - k];
            self.beside_curves()[edge].iter().map(move |&beyond| [beyond, other])
        });
        self.touch_near(pairs, &at).then_some(Contact::Touch)
    }

    /// The normals of two faces near a place; `None` at a pole.
    fn normals(&self, patches: [PatchId; 2], at: &Point) -> Option<[Vector; 2]> {
        let [a, b] = patches.map(|patch| self.exact.normal(patch, at));
        Some([a?, b?])
    }

    /// Whether two faces have a common normal at a place of both.
    fn are_tangent(&self, patches: [PatchId; 2], at: &Point) -> bool {
        self.normals(patches, at).is_some_and(|[a, b]| a.cross(&b).norm() <= TANGENT)
    }

    /// Whether two faces of some pairs are tangent near a place.
    fn touch_near(&self, mut pairs: impl Iterator<Item = [PatchId; 2]>, at: &Point) -> bool {
        /// How far from it (fraction of the size of the model).
        const NEAR: f64 = 0.05;
        pairs.any(|pair| {
            let found = self.common_point(pair, *at);
            found.is_some_and(|found| {
                (found - at).norm() <= NEAR * self.size
                    && (self.are_tangent(pair, &found) || self.part_at_common_curve(pair, &found))
            })
        })
    }

    /// The edges of a face so close to a place on its surface, as facets are beside them, that it
    /// may be beyond the face.
    fn edges_at(&self, patch: PatchId, at: &Point) -> Vec<usize> {
        /// In distances of the chords from the edge.
        const ROOM: f64 = 1.5;
        let is_at = |number: usize| {
            let curve = &self.model.curves[number].vertices;
            let point = |v: u32| &self.model.points[v as usize];
            let distance = |w: &&[u32]| in_segment(at, point(w[0]), point(w[1])).1;
            let nearest = curve.windows(2).min_by(|v, w| distance(v).total_cmp(&distance(w)))?;
            let chord = nalgebra::center(point(nearest[0]), point(nearest[1]));
            let off = |place: &Point| {
                let foot = self.exact.project_curve(CurveId::new(number), place).ok()?;
                Some((foot - place).norm())
            };
            Some(off(at)? <= ROOM * off(&chord)? + COMMON * self.size)
        };
        let own = self.beside_curves().iter().enumerate().filter(|(_, beside)| beside.contains(&patch));
        own.map(|(number, _)| number).filter(|&number| is_at(number).unwrap_or(true)).collect()
    }

    /// The patches adjacent to each curve.
    fn beside_curves(&self) -> &[Vec<PatchId>] {
        self.patches_of_curves.get_or_init(|| self.model.patches_of_curves())
    }

    /// Whether a place is on an edge of both faces, from which points of the file may be off.
    fn is_on_common_curve(&self, patches: [PatchId; 2], at: &Point) -> bool {
        let room = patches.map(|patch| self.model.patch(patch).inaccuracy);
        let room = room[0].max(room[1]).max(COMMON * self.size);
        self.feet_on_common_curves(patches, at).any(|foot| (foot - at).norm() <= room)
    }

    /// Whether a place is beside an edge of both faces at which these face each other and are
    /// tangent: the gap between them begins there with no angle.
    fn part_at_common_curve(&self, patches: [PatchId; 2], at: &Point) -> bool {
        /// How far they are closer than `COMMON` (fraction of the size of the model).
        const BESIDE: f64 = 1e-3;
        let part = |[a, b]: [Vector; 2]| a.dot(&b) < 0.0 && a.cross(&b).norm() <= TANGENT;
        self.feet_on_common_curves(patches, at).any(|foot| {
            (foot - at).norm() <= BESIDE * self.size && self.normals(patches, &foot).is_some_and(part)
        })
    }

    /// The nearest places to one on the edges that two faces have in common.
    fn feet_on_common_curves(&self, [a, b]: [PatchId; 2], at: &Point) -> impl Iterator<Item = Point> {
        let curves = self.beside_curves().iter().enumerate();
        let common = curves.filter(move |(_, beside)| beside.contains(&a) && beside.contains(&b));
        common.filter_map(|(c, _)| self.exact.project_curve(CurveId::new(c), at).ok())
    }

    /// A common point of two faces near a place, if they have one.
    fn common_point(&self, patches: [PatchId; 2], at: Point) -> Option<Point> {
        let near = |at: Point, feet: [Point; 2]| Some(nearest_common(at, feet));
        let parallel = |_, feet| self.toward_parallel(patches, feet);
        let found = self.search(patches, at, &near).or_else(|| self.search(patches, at, &parallel))?;
        // Not where only the surfaces beyond the faces meet.
        patches.iter().zip(found).all(|(&patch, foot)| self.exact.is_within(patch, &foot)).then_some(found[0])
    }

    /// The feet of a place on two surfaces, once they are at one place; `next` is the place after
    /// one with its feet.
    fn search(
        &self,
        patches: [PatchId; 2],
        mut at: Point,
        next: &dyn Fn(Point, [Point; 2]) -> Option<Point>,
    ) -> Option<[Point; 2]> {
        for _ in 0..TURNS {
            let [a, b] = patches.map(|patch| self.exact.project_patch(patch, &at).ok());
            let feet = [a?, b?];
            if (feet[0] - feet[1]).norm() <= COMMON * self.size {
                return Some(feet);
            }
            at = next(at, feet)?;
        }
        None
    }

    /// A place where the normals of two surfaces are parallel, by a step of Newton's method from
    /// two feet: surfaces that touch do so there. `None` at such a place.
    fn toward_parallel(&self, patches: [PatchId; 2], feet: [Point; 2]) -> Option<Point> {
        /// The step for differences (fraction of the size of the model).
        const STEP: f64 = 1e-5;
        /// Shorter steps lead nowhere (fraction of the size of the model).
        const SHORTEST: f64 = 1e-7;
        /// Directions in which surfaces bend alike (fraction of the largest difference).
        const ALIKE: f64 = 1e-3;
        let at = nalgebra::center(&feet[0], &feet[1]);
        let normals = |at: &Point| -> Option<[Vector; 2]> {
            let [a, b] = self.normals(patches, at)?;
            Some([a, if a.dot(&b) < 0.0 { -b } else { b }])
        };
        let [normal, other] = normals(&at)?;
        let x = normal.cross(&Vector::ith(normal.iamin(), 1.0)).normalize();
        let y = normal.cross(&x);
        let tilt = |[a, b]: [Vector; 2]| Vector2::new(x.dot(&(b - a)), y.dot(&(b - a)));
        let here = tilt([normal, other]);
        let step = STEP * self.size;
        let along = |way: Vector| Some((tilt(normals(&(at + way * step))?) - here) / step);
        let bend = Matrix2::from_columns(&[along(x)?, along(y)?]);
        if !bend.iter().chain(&here).all(|x| x.is_finite()) {
            return None;
        }
        let way = bend.pseudo_inverse(ALIKE * bend.norm()).ok()? * here;
        (way.norm() > SHORTEST * self.size).then(|| at - x * way.x - y * way.y)
    }

    /// The bodies that touch, given the facets of theirs that intersect, with the first place of
    /// each pair.
    ///
    /// # Errors
    /// Where a body reaches into another one although their faces only touch.
    pub fn touching(&self, crossings: &[Crossing]) -> Result<(Touching, Vec<Meeting>), Meeting> {
        let mut touching = Touching::default();
        let mut first: BTreeMap<[BodyId; 2], Meeting> = BTreeMap::new();
        for &Crossing { patches, at, .. } in crossings {
            let beside = patches.map(|patch| self.model.bodies_beside(patch));
            touching.add(beside[0], beside[1]);
            for pair in pairs_of_bodies(beside[0], beside[1]) {
                first.entry(pair).or_insert(Meeting { patches, at });
            }
        }
        for (&[a, b], meeting) in &first {
            if let Some(at) = self.inside(a, b).or_else(|| self.inside(b, a)) {
                return Err(Meeting { at, ..*meeting });
            }
        }
        Ok((touching, first.into_values().collect()))
    }

    /// A place on the surface of a body that is inside of another body.
    fn inside(&self, body: BodyId, other: BodyId) -> Option<Point> {
        let there = Facets::of(self.model, other);
        let beside = |patch| self.model.bodies_beside(patch);
        let own = self.model.triangles.par_iter().filter(|t| beside(t.patch).contains(&Some(body)));
        // A common face is beside both.
        let free = own.filter(|t| !beside(t.patch).contains(&Some(other)));
        let place = |t: &BoundaryTriangle| {
            let corners = t.vertices.map(|v| self.model.points[v.index()].coords);
            let middle = Point::from(corners.iter().sum::<Vector>() / 3.0);
            self.exact.project_patch(t.patch, &middle).ok()
        };
        free.filter_map(place).find_first(|place| self.is_inside(other, &there, place))
    }

    /// Whether a place is inside of a body. Where it is closer to facets than these are to their
    /// face, the face decides.
    fn is_inside(&self, body: BodyId, facets: &Facets, place: &Point) -> bool {
        /// In distances of the facets from the face.
        const ROOM: f64 = 3.0;
        if !facets.is_near(place) {
            return false;
        }
        // The place may be behind the facets of a face beside that of the nearest one.
        let nearest = facets.nearest_patch(place);
        let of_body = |patch: &PatchId| self.model.bodies_beside(*patch).contains(&Some(body));
        let at_curves = self.beside_curves().iter().filter(|beside| beside.contains(&nearest)).flatten();
        let patches: BTreeSet<PatchId> = at_curves.copied().filter(of_body).chain([nearest]).collect();
        let foot = |patch: PatchId, from: &Point| self.exact.project_patch(patch, from).ok();
        let close = patches.into_iter().filter_map(|patch| {
            let near = self.model.projector.project_patch(patch, place);
            let off = (foot(patch, &near)? - near).norm();
            let is_close = (near - place).norm() <= ROOM * off + SHALLOW * self.size;
            is_close.then_some((patch, foot(patch, place)?))
        });
        let close: Vec<(PatchId, Point)> = close.collect();
        if close.is_empty() {
            return facets.contain(place);
        }
        let away = |(_, foot): &&(PatchId, Point)| (foot - place).norm();
        let within = close.iter().filter(|(patch, foot)| self.exact.is_within(*patch, foot));
        let nearest = within.min_by(|a, b| away(a).total_cmp(&away(b)));
        let Some(&(patch, foot)) = nearest else { return false };
        let Some(normal) = self.exact.normal(patch, &foot) else { return false };
        let outward = if self.model.patch(patch).inside == Some(body) { normal } else { -normal };
        outward.dot(&(place - foot)) < -SHALLOW * self.size && self.edges_at(patch, &foot).is_empty()
    }
}

/// The facets of one body.
struct Facets {
    tree: Tree,
    corners: Vec<[Point; 3]>,
    patches: Vec<PatchId>,
    low: Point,
    high: Point,
}

impl Facets {
    fn of(model: &FacetModel, body: BodyId) -> Self {
        let own = model.triangles.iter().filter(|t| model.bodies_beside(t.patch).contains(&Some(body)));
        let (corners, patches): (Vec<[Point; 3]>, Vec<PatchId>) =
            own.map(|t| (t.vertices.map(|v| model.points[v.index()]), t.patch)).unzip();
        let tree = Tree::new(&corners.iter().map(bounds).collect::<Vec<_>>());
        let all = bounds(corners.as_flattened());
        Self { tree, corners, patches, low: all.min, high: all.max }
    }

    /// Whether a point is in the box around them.
    fn is_near(&self, point: &Point) -> bool {
        (0..3).all(|axis| self.low[axis] <= point[axis] && point[axis] <= self.high[axis])
    }

    /// The patch of the nearest one.
    fn nearest_patch(&self, place: &Point) -> PatchId {
        let squared = |k: u32| {
            let corners = &self.corners[k as usize];
            (at(corners, in_triangle(place, corners)) - place).norm_squared()
        };
        let (nearest, _) = self.tree.nearest(place, squared).expect("a body has facets");
        self.patches[nearest as usize]
    }

    /// Whether a point is inside of the body.
    fn contain(&self, point: &Point) -> bool {
        // Along no edge that a designer would draw.
        let way = Vector::new(1.0, 0.272_218, 0.138_964) * (self.high - self.low).norm();
        let to = point + way * 2.0;
        let mut is_inside = false;
        self.tree.along(point, &to, |k| {
            let [a, b, c] = &self.corners[k as usize];
            let sides = [a, b, c].map(|corner| *corner);
            let turns = [[0, 1], [1, 2], [2, 0]].map(|[i, j]| orient3d(point, &to, &sides[i], &sides[j]));
            let ends = [point, &to].map(|end| orient3d(a, b, c, end));
            let is_through = turns.iter().all(|turn| *turn == turns[0]) && turns[0] != Sign::Zero;
            is_inside ^= is_through && ends[0] != ends[1];
            true
        });
        is_inside
    }
}

/// The point nearest to another one in the planes through its feet on two surfaces, across the ways
/// to them; the middle of the feet where that is not defined.
fn nearest_common(at: Point, feet: [Point; 2]) -> Point {
    /// Planes that meet at a smaller angle (radians) have no common point near.
    const LEAST_ANGLE: f64 = 1e-3;
    let ways = feet.map(|foot| foot - at);
    let [a, b] = ways.map(|way| way.norm());
    let [m, n] = ways.map(|way| way.try_normalize(0.0).unwrap_or_default());
    let cosine = m.dot(&n);
    let squared = 1.0 - cosine * cosine;
    if a == 0.0 || b == 0.0 || squared < LEAST_ANGLE * LEAST_ANGLE {
        return nalgebra::center(&feet[0], &feet[1]);
    }
    at + m * ((a - cosine * b) / squared) + n * ((b - cosine * a) / squared)
}
