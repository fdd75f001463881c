//! Cusps without angle, cut off at a small radius.
//!
//! Where two boundaries are tangent, the body between them has no angle: the space under a ball on
//! a plate, the tip of a plate out of which a tangent cylinder is drilled. No tets fit there, so a
//! small ball around the point is taken out of that body, or a tube around the line or the circle
//! of contact. The boundaries themselves keep their contact. Where the exterior is between them and
//! opens too slowly for triangles, and where two curves leave a corner alike, the ball is taken out
//! of all bodies.

use super::contact::curvature_differences_at;
use super::{FeatureError, Features, Named, Pair, Place};
use crate::geometry::SurfaceInfo;
use crate::primitive::{Cylinder, Plane, Sphere, Torus, quadric::tangents};
use crate::{BodyId, Geometry, Point, Solid, Surface, SurfaceId, Vector};
use std::f64::consts::{PI, TAU};
use std::fmt;

/// Where two boundaries have no angle between them.
#[derive(Clone, Debug, PartialEq)]
pub struct Cusp {
    /// The surfaces, ascending.
    pub(super) surfaces: [SurfaceId; 2],
    /// The body between them; `None` for the exterior, and if several bodies end in the cusp.
    pub(super) between: Option<BodyId>,
    /// A point of it.
    pub(super) point: Point,
    /// The points of the arc along which the surfaces are tangent; empty for a single point.
    pub(super) arc: Vec<Point>,
    /// Largest radius at which it may be cut off, from what lies around it.
    pub(super) reach: f64,
    /// Where two curves leave a corner alike: the direction of both, and how far apart they get.
    pub(super) along: Option<Parting>,
}

/// Two curves that part slowly from their common tangent at a corner, and from each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Parting {
    /// The direction of both at the corner.
    pub tangent: Vector,
    /// The distance from the corner, along the tangent, at which they are far enough apart for
    /// triangles.
    pub distance: f64,
    /// Their distance from the tangent there.
    pub aside: f64,
    /// Whether a body between the same two surfaces ends there.
    pub is_spike: bool,
}

/// A part of bodies that was left out because they have no angle there.
#[derive(Clone, Debug, PartialEq)]
pub struct CutCusp {
    /// One of the solids that touch.
    pub first: Named,
    /// The other.
    pub second: Named,
    /// A point where they touch.
    pub place: Place,
    /// The radius of the ball around the point, or of the tube around the curve of contact.
    pub radius: f64,
    /// Whether they touch along a curve.
    pub is_curve: bool,
    /// The body that was cut; `None` for all.
    pub body: Option<(BodyId, Named)>,
}

impl fmt::Display for CutCusp {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { first, second, place, radius, .. } = self;
        let pair = Pair(first, second);
        write!(f, "surfaces of {pair} touch at {place} without an angle between them: ")?;
        match &self.body {
            Some((_, body)) => write!(f, "{body} ends there")?,
            None => write!(f, "the bodies end there")?,
        }
        let around = if self.is_curve { "around the curve of contact" } else { "around the point" };
        write!(f, " at a radius of {radius:.3e} {around}")
    }
}

/// Most cusps cut off in one geometry; each needs another search for the features.
const MOST: usize = 100;

/// How much is cut off.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Extent {
    /// All around the cusp, with this factor of the radius.
    Around(f64),
    /// Where two curves leave a corner alike, only the layer between the tangent surfaces, in a
    /// long and thin cylinder about the tangent of the curves; otherwise all around. Spikes are
    /// always cut off so: at the end of a ball around the tip they are still thin.
    Layer,
}

/// The extents, tried in this order while cuts end in slivers.
const EXTENTS: [Extent; 3] = [Extent::Around(1.0), Extent::Around(2.0), Extent::Layer];

/// Finds the features of a geometry, from which cusps without angle are cut off as far as needed.
///
/// # Errors
/// As [`Features::find`], for everything else.
pub fn find_and_cut_cusps(geometry: &mut Geometry) -> Result<(Features, Vec<CutCusp>), FeatureError> {
    let mut first = match Features::find(geometry) {
        Ok(features) => return Ok((features, Vec::new())),
        Err(error) => error,
    };
    for extent in EXTENTS {
        let mut cut = geometry.clone();
        match cut_all_off(&mut cut, first.clone(), extent) {
            Ok(Some(found)) => {
                *geometry = cut;
                return Ok(found);
            }
            Ok(None) => (),
            Err(error) => {
                first = error;
                break;
            }
        }
    }
    Err(first)
}

/// Cuts off the cusp of an error and all that are found afterwards; `None` if the cuts end in
/// slivers.
///
/// # Errors
/// The first error that is no cusp, or a cusp that cannot be cut off.
fn cut_all_off(
    geometry: &mut Geometry,
    mut error: FeatureError,
    extent: Extent,
) -> Result<Option<(Features, Vec<CutCusp>)>, FeatureError> {
    let own = geometry.surfaces.len();
    let mut cut_cusps: Vec<CutCusp> = Vec::new();
    loop {
        let (FeatureError::Tangent { cusp, .. } | FeatureError::Cusp { cusp, .. }) = &error else {
            return Err(error);
        };
        let cut = if cut_cusps.len() < MOST { cut_off(geometry, cusp, &cut_cusps, extent) } else { None };
        cut_cusps.push(cut.ok_or(error)?);
        match Features::find(geometry) {
            Ok(features) if leaves_slivers(&features, own, &cut_cusps) => return Ok(None),
            Ok(features) => return Ok(Some((features, cut_cusps))),
            Err(next) => error = next,
        }
    }
}

/// Whether a cut ends in curves that are very short: surfaces in contact of high order are still
/// too close at the cut. Surfaces from index `own` on are those of the cuts.
fn leaves_slivers(features: &Features, own: usize, cut_cusps: &[CutCusp]) -> bool {
    /// Least length of a curve on a cut, relative to the smallest radius. Surfaces that separate
    /// with the fourth power have an angle of 1.1° there.
    const SHORTEST: f64 = 0.005;
    let least = cut_cusps.iter().map(|cut| cut.radius).fold(f64::INFINITY, f64::min);
    let is_cut = |s: &SurfaceId| s.index() >= own;
    features.curves.iter().any(|c| c.surfaces.iter().any(is_cut) && c.length() < SHORTEST * least)
}

/// Takes a small neighborhood of a cusp out of the bodies; `None` if that cannot help.
fn cut_off(geometry: &mut Geometry, cusp: &Cusp, before: &[CutCusp], extent: Extent) -> Option<CutCusp> {
    let mut known =
        before.iter().filter(|cut_cusp| (cut_cusp.place.0 - cusp.point).norm() < 0.5 * cut_cusp.radius);
    // If something is left after the body between was cut, all bodies are.
    let body = match known.next_back() {
        None if cusp.arc.is_empty() && !separates(geometry, cusp) => None,
        None => cusp.between,
        Some(cut_cusp) => {
            cut_cusp.body.as_ref()?;
            None
        }
    };
    let (left_out, radius, is_curve) = match (extent, cusp.along) {
        (extent, Some(parting)) if extent == Extent::Layer || parting.is_spike => {
            (layer(geometry, cusp, &parting), WIDTH * parting.aside, true)
        }
        (extent, _) => {
            let wider = if let Extent::Around(factor) = extent { factor } else { 1.0 };
            let radius = radius(geometry, cusp, wider)?;
            if cusp.arc.is_empty() {
                let ball = Surface::Sphere(Sphere { center: cusp.point, radius });
                (inside(geometry, ball, cusp), radius, false)
            } else {
                (tube(geometry, cusp, radius)?, radius, true)
            }
        }
    };
    for (i, cut) in geometry.bodies.iter_mut().enumerate() {
        if body.is_none_or(|body| body.index() == i) {
            let solid = std::mem::replace(&mut cut.solid, Solid::Or(Vec::new()));
            cut.solid = Solid::And(vec![solid, Solid::Not(Box::new(left_out.clone()))]);
        }
    }
    let [first, second] = cusp.surfaces.map(|s| Named::surface(geometry, s));
    let body = body.map(|body| (body, Named::body(geometry, body)));
    Some(CutCusp { first, second, place: Place(cusp.point), radius, is_curve, body })
}

/// Whether the surfaces of a cusp separate in all directions, so that their boundaries can keep the
/// common point.
fn separates(geometry: &Geometry, cusp: &Cusp) -> bool {
    /// Least ratio of the differences of curvatures in two directions.
    const LEAST_RATIO: f64 = 1e-2;
    let surfaces = cusp.surfaces.map(|s| &geometry.surfaces[s.index()]);
    let [low, high] = curvature_differences_at(surfaces, &cusp.point);
    low * high > 0.0 && low.abs().min(high.abs()) >= LEAST_RATIO * low.abs().max(high.abs())
}

/// The radius at which a cusp is cut off; `None` if it has hardly any angle there.
fn radius(geometry: &Geometry, cusp: &Cusp, wider: f64) -> Option<f64> {
    /// The wanted angle between the surfaces at the cut, radians (14°).
    const ANGLE: f64 = 0.25;
    /// The least angle (1.5°).
    const LEAST_ANGLE: f64 = 0.026;
    /// Largest radius relative to the smallest radius of curvature.
    const LARGEST: f64 = 0.3;
    /// The cut stays within this part of the way to the next surface, if that leaves it this part
    /// of its radius.
    const ROOM: [f64; 2] = [0.5, 0.3];
    let [a, b] = cusp.surfaces.map(|s| &geometry.surfaces[s.index()]);
    let at = &cusp.point;
    let bend = a.curvature(at).max(b.curvature(at));
    let rates = curvature_differences_at([a, b], at).map(f64::abs);
    let [low, high] = [rates[0].min(rates[1]), rates[0].max(rates[1])];
    // Along an arc, and where the surfaces cross, they separate to the sides only.
    let rate = if low < 0.2 * high { high } else { low };
    let mut radius = wider * cusp.reach.min(ANGLE / rate).min(LARGEST / bend);
    let others = geometry.surfaces.iter().map(|s| s.distance(at)).filter(|&d| d > 1e-6 * radius);
    let nearest = others.fold(f64::INFINITY, f64::min);
    radius = radius.min((ROOM[0] * nearest).max(ROOM[1] * radius));
    let normal = a.normal(at);
    let (u, v) = tangents(&normal);
    let opening = (0..16).map(|k| {
        let (sin, cos) = (TAU * f64::from(k) / 16.0 + 0.1).sin_cos();
        let beside = at + (u * cos + v * sin) * radius;
        let normals = [a, b].map(|s| s.project(&beside).map(|p| s.normal(&p)).unwrap_or(normal));
        normals[0].cross(&normals[1]).norm()
    });
    let is_open = opening.fold(0.0, f64::max) >= LEAST_ANGLE;
    (radius.is_finite() && radius > 0.0 && is_open).then_some(radius)
}

/// The half-space inside a surface, which is added to the geometry unless it has the same.
fn inside(geometry: &mut Geometry, surface: Surface, cusp: &Cusp) -> Solid {
    /// Equal surfaces differ by less than this fraction of the distances around them.
    const SAME: f64 = 1e-9;
    let tolerance = SAME * cusp.arc.iter().map(|p| (p - cusp.point).norm()).fold(0.0, f64::max);
    let same = geometry.surfaces.iter().enumerate();
    let mut same = same.filter_map(|(i, s)| Some((i, s.same_as(&surface, tolerance)?)));
    if let Some((i, same)) = same.next() {
        return Solid::Half { surface: SurfaceId::new(i), positive: !same };
    }
    let of = &geometry.surface_info[cusp.surfaces[0].index()];
    let info = SurfaceInfo { solid: of.solid.clone(), span: of.span, ..SurfaceInfo::default() };
    geometry.surfaces.push(surface);
    geometry.surface_info.push(info);
    Solid::Half { surface: SurfaceId::new(geometry.surfaces.len() - 1), positive: false }
}

/// Radius of the cylinder of a layer, relative to the distance of the curves from their tangent.
const WIDTH: f64 = 1.6;

/// The layer between the two surfaces of a cusp, in a cylinder about the tangent of the curves that
/// part there.
fn layer(geometry: &mut Geometry, cusp: &Cusp, parting: &Parting) -> Solid {
    let Parting { tangent: axis, distance, aside, .. } = *parting;
    let round = Cylinder { point: cusp.point, axis, radius: WIDTH * aside };
    let ends = [-axis, axis].map(|normal| Plane { point: cusp.point + normal * distance, normal });
    let mut parts = vec![inside(geometry, Surface::Cylinder(round), cusp)];
    parts.extend(ends.map(|end| inside(geometry, Surface::Plane(end), cusp)));
    let half = |k: usize, positive: bool| Solid::Half { surface: cusp.surfaces[k], positive };
    let between = [true, false].map(|side| Solid::And(vec![half(0, side), half(1, !side)]));
    parts.push(Solid::Or(between.to_vec()));
    Solid::And(parts)
}

/// A tube around the arc of contact, longer than it by the radius at both ends; `None` if that is
/// neither a line nor a circle.
fn tube(geometry: &mut Geometry, cusp: &Cusp, radius: f64) -> Option<Solid> {
    /// Largest distance of the points of the arc from a line or a circle, relative to their
    /// distances.
    const STRAIGHT: f64 = 1e-6;
    let arc = &cusp.arc;
    let (start, end, half) = (arc[0], arc[arc.len() - 1], arc[arc.len() / 2]);
    let is_closed = (end - start).norm() <= STRAIGHT * (half - start).norm();
    let axis = (end - start).try_normalize(0.0).unwrap_or_default();
    let off_line = |p: &Point| (p - start).cross(&axis).norm();
    if !is_closed && arc.iter().all(|p| off_line(p) <= STRAIGHT * (end - start).norm()) {
        let round = inside(geometry, Surface::Cylinder(Cylinder { point: start, axis, radius }), cusp);
        let caps = [(start, -axis), (end, axis)].map(|(point, normal)| {
            inside(geometry, Surface::Plane(Plane { point: point + normal * radius, normal }), cusp)
        });
        return Some(Solid::And([vec![round], caps.to_vec()].concat()));
    }
    let third = if is_closed { arc[arc.len() / 4] } else { end };
    let (center, axis) = circle(&start, &half, &third)?;
    let major = (start - center).norm();
    let off_circle = |p: &Point| {
        let arm = p - center;
        (arm - axis * arm.dot(&axis)).norm() - major
    };
    let is_circle =
        arc.iter().all(|p| off_circle(p).abs().max((p - center).dot(&axis).abs()) <= STRAIGHT * major);
    if !is_circle || radius >= major {
        return None;
    }
    let round = inside(geometry, Surface::Torus(Torus { center, axis, major, minor: radius }), cusp);
    let [from, to] = [start, end].map(|p| p - center);
    let extra = radius / major;
    let swept = from.cross(&to).dot(&axis).atan2(from.dot(&to)).rem_euclid(TAU) + 2.0 * extra;
    if is_closed || swept >= TAU {
        return Some(round);
    }
    // The arc runs counterclockwise about the axis from start to end.
    let caps = [(start, -1.0), (end, 1.0)].map(|(p, sign)| {
        let turn = nalgebra::Rotation3::new(axis * (sign * extra));
        let arm = turn * (p - center);
        let normal = axis.cross(&arm) * (sign / major);
        inside(geometry, Surface::Plane(Plane { point: center + arm, normal }), cusp)
    });
    let between = if swept > PI { Solid::Or(caps.to_vec()) } else { Solid::And(caps.to_vec()) };
    Some(Solid::And(vec![round, between]))
}

/// The center and the axis of the circle through three points, counterclockwise in their order.
fn circle(a: &Point, b: &Point, c: &Point) -> Option<(Point, Vector)> {
    let (p, q) = (b - a, c - a);
    let normal = p.cross(&q);
    let axis = normal.try_normalize(0.0)?;
    let arm = normal.cross(&p) * q.norm_squared() + q.cross(&normal) * p.norm_squared();
    Some((a + arm / (2.0 * normal.norm_squared()), axis))
        .filter(|(center, _)| center.coords.iter().all(|x| x.is_finite()))
}
