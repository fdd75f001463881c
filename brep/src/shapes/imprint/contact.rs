//! Pairs of faces that may touch on a common surface.

use super::super::{Face, Shapes};
use super::room;
use crate::nearest::nearest_on_surface;
use crate::project::project_to_surface;
use crate::shapes::glue::SAME;
use crate::{Curve, EdgeCurve, Point, Surface};
use rayon::prelude::*;

/// Where edges are probed (fractions of their ranges).
const PROBED: [f64; 2] = [0.37, 0.81];
/// Surfaces are also compared this far beside an edge (fraction of its length).
const BESIDE: f64 = 0.02;

/// A face as its box and points of its surface.
struct Probe {
    low: Point,
    high: Point,
    /// Points of its surface on edges and beside them.
    points: Vec<Point>,
}

impl Probe {
    fn contains(&self, point: &Point) -> bool {
        (0..3).all(|axis| self.low[axis] <= point[axis] && point[axis] <= self.high[axis])
    }
}

/// Pairs of faces of different solids that have the same surface and overlapping boxes: one in
/// front of the other, or `both_ways` also with the solids on the same side.
pub(super) fn contacts(shapes: &Shapes, both_ways: bool, size: f64) -> Vec<[usize; 2]> {
    let probes: Vec<Option<Probe>> =
        (0..shapes.faces.len()).into_par_iter().map(|face| probe(shapes, face, size)).collect();
    let mut order: Vec<(usize, &Probe)> =
        probes.iter().enumerate().filter_map(|(face, probe)| Some((face, probe.as_ref()?))).collect();
    order.sort_by(|a, b| a.1.low.x.total_cmp(&b.1.low.x));
    let beside = |k: usize| {
        let (face, one) = order[k];
        let near = order[k + 1..].iter().take_while(|other| other.1.low.x <= one.high.x);
        let found = near.filter(|(other, probe)| {
            shapes.faces[face].body != shapes.faces[*other].body
                && (1..3).all(|axis| one.low[axis] <= probe.high[axis] && probe.low[axis] <= one.high[axis])
                && touch(shapes, [(face, one), (*other, probe)], both_ways, size)
        });
        found.map(|(other, _)| [face.min(*other), face.max(*other)]).collect::<Vec<_>>()
    };
    let mut found: Vec<[usize; 2]> = (0..order.len()).into_par_iter().flat_map_iter(beside).collect();
    found.sort_unstable();
    found
}

/// Points of a face; `None` if it is nowhere.
fn probe(shapes: &Shapes, number: usize, size: f64) -> Option<Probe> {
    let face = &shapes.faces[number];
    let curves = shapes.curves_of(number);
    let edges: Vec<&EdgeCurve> = curves.iter().map(|&curve| &shapes.curves[curve]).collect();
    // Edges may be beside their face.
    let on = edges
        .iter()
        .flat_map(|edge| PROBED.map(|share| nearest_on_surface(&face.surface, &at(edge, share)).point));
    let mut points: Vec<Point> = on.collect();
    let whole = if edges.is_empty() { whole(&face.surface) } else { Vec::new() };
    points.extend(&whole);
    let all = edges.iter().flat_map(|edge| (0..=16).map(|k| at(edge, f64::from(k) / 16.0)));
    let (mut low, mut high) = (*points.first()?, points[0]);
    for point in all.chain(whole) {
        (low, high) = (low.inf(&point), high.sup(&point));
    }
    points.extend(edges.iter().flat_map(|edge| beside(&face.surface, edge)));
    let room = |share: f64, [low, high]: [Point; 2]| {
        let room = SAME * size + share * (high - low).norm();
        [low.map(|x| x - room), high.map(|x| x + room)]
    };
    // Between its edges a curved face may leave their box, but not that of its poles.
    let flat = 0.02;
    [low, high] = room(if face.surface.is_plane() { flat } else { 0.5 }, [low, high]);
    if let Some(hull) = face.surface.hull() {
        let [lowest, highest] = room(flat, hull);
        (low, high) = (low.sup(&lowest), high.inf(&highest));
    }
    Some(Probe { low, high, points })
}

fn at(edge: &EdgeCurve, share: f64) -> Point {
    Point::from(edge.curve.point(edge.range[0] + share * (edge.range[1] - edge.range[0])))
}

/// The largest distance of an edge from a surface that it bounds (length), and its place there.
pub(in super::super) fn furthest(surface: &Surface, edge: &EdgeCurve) -> (f64, Point) {
    const PLACES: u32 = 8;
    let away = |k: u32| {
        let point = at(edge, f64::from(k) / f64::from(PLACES));
        ((nearest_on_surface(surface, &point).point - point).norm(), point)
    };
    (0..=PLACES).map(away).max_by(|a, b| a.0.total_cmp(&b.0)).expect("there are places")
}

/// Whether an edge without crossings lies on a surface where the surface is defined, rather than
/// beside it.
pub(in super::super) fn lies_on(surface: &Surface, edge: &EdgeCurve, room: f64) -> bool {
    [0.25, 0.5, 0.75].into_iter().all(|share| {
        let point = at(edge, share);
        let foot = nearest_on_surface(surface, &point);
        is_defined(surface, foot.parameters) && (foot.point - point).norm() <= room
    })
}

/// Points of a closed surface without edges.
pub(in super::super) fn whole(surface: &Surface) -> Vec<Point> {
    const EACH: u32 = 8;
    let ends = |direction: usize| match surface.periods()[direction] {
        Some(period) => Some([0.0, period]),
        None => {
            let pole = |is_upper| surface.pole(direction, is_upper, f64::INFINITY);
            Some([pole(false)?, pole(true)?])
        }
    };
    let [Some(in_u), Some(in_v)] = [ends(0), ends(1)] else { return Vec::new() };
    let at = |[low, high]: [f64; 2], k: u32| low + (high - low) * (f64::from(k) + 0.5) / f64::from(EACH);
    let all = (0..EACH * EACH).map(|k| surface.point([at(in_u, k % EACH), at(in_v, k / EACH)]));
    all.collect()
}

/// Points of a surface on both sides of an edge on it.
fn beside(surface: &Surface, edge: &EdgeCurve) -> Vec<Point> {
    if surface.is_plane() {
        return Vec::new();
    }
    let point = at(edge, PROBED[0]);
    let foot = nearest_on_surface(surface, &point);
    let along = edge.curve.jet(edge.range[0] + PROBED[0] * (edge.range[1] - edge.range[0]))[1];
    let length = along.norm() * (edge.range[1] - edge.range[0]);
    let Some(across) = foot.normal.cross(&along).try_normalize(0.0) else { return Vec::new() };
    let step = |by: f64| point + across * (by * BESIDE * length);
    [-1.0, 1.0].map(|by| project_to_surface(surface, &step(by), foot.parameters).point).to_vec()
}

/// Whether two faces have the same surface, where both have one, with their bodies on opposite
/// sides, or `both_ways` on the same one.
fn touch(shapes: &Shapes, [(a, one), (b, other)]: [(usize, &Probe); 2], both_ways: bool, size: f64) -> bool {
    let faces = [a, b].map(|face| &shapes.faces[face]);
    let room = room(shapes, [a, b], size);
    let are_planes = faces.iter().all(|face| face.surface.is_plane());
    let mut do_face = None;
    for (points, there, box_there) in [(one, faces[1], other), (other, faces[0], one)] {
        for point in points.points.iter().filter(|point| are_planes || box_there.contains(point)) {
            let foot = nearest_on_surface(&there.surface, point);
            // Beyond its face a surface may end.
            if is_defined(&there.surface, foot.parameters) {
                if (foot.point - point).norm() > room {
                    return false;
                }
                if !*do_face.get_or_insert_with(|| both_ways || face_each_other(faces, point)) {
                    return false;
                }
            }
        }
    }
    do_face == Some(true)
}

/// Whether a surface is defined at some parameters.
fn is_defined(surface: &Surface, parameters: [f64; 2]) -> bool {
    let inside = |t: f64, range: [f64; 2]| {
        let rounding = 1e-9 * (range[1] - range[0]);
        (range[0] - rounding..=range[1] + rounding).contains(&t)
    };
    let on_curve = |curve: &Curve<3>, t: f64| {
        curve.period().is_some() || curve.domain().is_none_or(|range| inside(t, range))
    };
    match surface {
        Surface::Plane { .. } | Surface::Round { .. } => true,
        Surface::Extrusion { curve, .. } => on_curve(curve, parameters[0]),
        Surface::Revolution { curve, .. } => on_curve(curve, parameters[1]),
        Surface::Spline(spline) => (0..2)
            .all(|i| spline.bases[i].period().is_some() || inside(parameters[i], spline.bases[i].range())),
        Surface::Offset { basis, .. } => is_defined(basis, parameters),
    }
}

/// Whether the bodies of two faces are on opposite sides at a place of both.
fn face_each_other(faces: [&Face; 2], place: &Point) -> bool {
    let [a, b] = faces.map(|face| face.outward(place));
    a.dot(&b) < 0.0
}
