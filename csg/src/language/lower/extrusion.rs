//! `extrusion`: a profile moved along a path.
//!
//! In the plane perpendicular to the path, the profile's y axis is the projection y' of the given
//! direction to that plane, and its x axis is tangent × y'. For each segment of the path, the
//! profile sweeps a solid between two planes across the path: a prism along a line, part of a body
//! of revolution along a circle, or a sweep along an ellipse or where the profile rotates about the
//! path.
//!
//! NETGEN has no faces at the ends of an open path and requires planes that cut it off. Here the
//! perpendicular planes at the ends close the solid; if a plane of the file cuts it off earlier,
//! they have no effect.

use super::conic::{Arc, Piece, SpaceEllipse};
use super::primitive::Shape;
use super::profile::{Bound, Profile, formula};
use super::swept::{Assembly, NO_FACE, SweepError, Swept, Turn, complement};
use crate::primitive::{Cylinder, Ellipse, EllipticCylinder, Plane, Section, Sweep, Torus};
use crate::{Point, Solid, Surface, Vector};

/// Tangents of two segments are the same if the sine of their angle is at most this: decimals have
/// six digits.
const SMOOTH: f64 = 1e-5;
/// Smallest sine of the angle between the path and the direction of the profile's y axis.
const UPRIGHT: f64 = 1e-6;
/// Largest sine of the angle at which the direction counts as lying in the plane of an arc, or
/// perpendicular to it.
const RIGID: f64 = 1e-9;

/// The solid of a profile along a path; `up` is the direction of the profile's y axis.
pub(super) fn shape(path: &[Piece], profile: &[Piece], up: Vector) -> Result<Shape, SweepError> {
    check_directions(path)?;
    let profile = formula(profile, false)?;
    check_corners(path, profile.reach)?;
    let up = up.normalize();
    let mut assembly = Assembly::default();
    let swept = path.iter().enumerate().map(|(index, piece)| match *piece {
        Piece::Line(ends) => along_line(&mut assembly, ends, &profile, up),
        Piece::Arc(arc) => along_arc(&mut assembly, [index, path.len()], &arc, &profile, up),
    });
    let swept = swept.collect::<Result<Vec<_>, _>>()?;
    let last = path.len() - 1;
    let is_closed = last > 0 && meets(&path[last], &path[0]);
    let next = |index: usize| if index < last { Some(index + 1) } else { is_closed.then_some(0) };
    let ends = path.iter().enumerate().map(|(index, piece)| {
        let normal = next(index).map_or(piece.tangents()[1], |next| mitre(piece, &path[next]));
        assembly.behind(piece.ends()[1], normal, NO_FACE)
    });
    let ends: Vec<Solid> = ends.collect();
    let mut members = Vec::new();
    for (index, piece) in path.iter().enumerate() {
        let before = if index > 0 { Some(index - 1) } else { is_closed.then_some(last) };
        let start = match before {
            Some(before) => {
                if is_smooth_joint(&path[before], &path[index]) {
                    assembly.join([before, index].map(|i| &swept[i].sides[..]), &ends[before]);
                }
                complement(ends[before].clone())
            }
            None => assembly.behind(piece.ends()[0], -piece.tangents()[0], NO_FACE),
        };
        members.push(Solid::And(vec![swept[index].inside.clone(), start, ends[index].clone()]));
    }
    let inside = if members.len() == 1 { members.swap_remove(0) } else { Solid::Or(members) };
    Ok(assembly.shape(inside))
}

/// Whether the end tangent of a segment and the start tangent of the next one agree.
fn is_smooth_joint(before: &Piece, after: &Piece) -> bool {
    let (before, after) = (before.tangents()[1], after.tangents()[0]);
    let sine = before.cross(&after).norm() / (before.norm() * after.norm());
    sine <= SMOOTH && before.dot(&after) > 0.0
}

/// Whether a segment starts where another ends.
fn meets(before: &Piece, after: &Piece) -> bool {
    let [start, end] = before.ends();
    (after.ends()[0] - end).norm() <= SMOOTH * (end - start).norm()
}

/// The normal of the plane between two segments: the tangent at a smooth joint, else the mean of
/// both directions.
fn mitre(before: &Piece, after: &Piece) -> Vector {
    let end = before.tangents()[1];
    if is_smooth_joint(before, after) { end } else { end.normalize() + after.tangents()[0].normalize() }
}

fn check_directions(path: &[Piece]) -> Result<(), SweepError> {
    if let Some(index) = path.iter().position(|piece| piece.tangents().iter().any(|t| t.norm() == 0.0)) {
        let message = format!("segment {} of the path has no direction at an end", index + 1);
        return Err(SweepError::Wrong(message, "consecutive points of a segment must differ"));
    }
    Ok(())
}

/// Checks that segments are long enough for the mitred corners at their ends.
///
/// At a corner, the sides of a profile extend beyond the corner of the path, or end before it, by
/// the profile's reach times the tangent of half the turning angle. The extensions at both ends of
/// a segment must not overlap.
fn check_corners(path: &[Piece], reach: f64) -> Result<(), SweepError> {
    let last = path.len() - 1;
    let lack = |index: usize, next: usize| {
        let [p, q] = [path[index].tangents()[1], path[next].tangents()[0]].map(|t| t.normalize());
        // tan(α/2) = sin α / (1 + cos α); practically infinite if the path runs back.
        if p.dot(&q) < -1.0 + SMOOTH {
            f64::INFINITY
        } else if is_smooth_joint(&path[index], &path[next]) {
            0.0
        } else {
            reach * p.cross(&q).norm() / (1.0 + p.dot(&q))
        }
    };
    let is_closed = last > 0 && meets(&path[last], &path[0]);
    let mut taken = vec![0.0; path.len()];
    for index in 0..path.len() {
        let next = if index < last { index + 1 } else { 0 };
        if index < last || is_closed {
            let lack = lack(index, next);
            taken[index] += lack;
            taken[next] += lack;
        }
    }
    for (index, (piece, taken)) in path.iter().zip(taken).enumerate() {
        let [p, q] = piece.ends();
        if taken >= (q - p).norm() {
            let message = format!("segment {} of the path is too short for its mitred corners", index + 1);
            return Err(SweepError::Unsupported(message + ": lengthen it, or make the profile smaller"));
        }
    }
    Ok(())
}

/// Whether a profile with y axis along `up` rotates about the path on an arc with the given axis.
fn is_rotating(axis: Vector, up: Vector) -> bool {
    let height = up.dot(&axis).abs();
    height > RIGID && height < 1.0 - RIGID
}

/// The directions of the profile's x and y axes at a point of the path.
fn frame(tangent: Vector, up: Vector) -> Result<[Vector; 2], SweepError> {
    let across = up - tangent * up.dot(&tangent);
    if across.norm() <= UPRIGHT {
        let message = "the path of the extrusion is parallel to the direction of the profile's y axis".into();
        return Err(SweepError::Wrong(message, "the third argument must not be parallel to the path"));
    }
    let y = across.normalize();
    Ok([tangent.cross(&y), y])
}

/// The solid of a profile along a line.
fn along_line(
    into: &mut Assembly,
    ends: [Vector; 2],
    profile: &Profile,
    up: Vector,
) -> Result<Swept, SweepError> {
    let tangent = (ends[1] - ends[0]).normalize();
    let [x, y] = frame(tangent, up)?;
    let place = |p: [f64; 2]| ends[0] + x * p[0] + y * p[1];
    into.sweep(profile, |into, bound, face| {
        Ok(match bound {
            Bound::Left(from, to) => {
                let [p, q] = [*from, *to].map(place);
                // To the right of the line, because x × y points against the path.
                into.behind(p, tangent.cross(&(q - p)), face)
            }
            Bound::Inside(ellipse) => {
                let Ellipse { center, axis: [c, s], radii } = *ellipse;
                let point = Point::from(place(center));
                let surface = if radii[0] == radii[1] {
                    Surface::Cylinder(Cylinder { point, axis: tangent, radius: radii[0] })
                } else {
                    let axes = [x * c + y * s, y * c - x * s];
                    Surface::EllipticCylinder(EllipticCylinder { point, axes, radii })
                };
                into.side(surface, false, face)
            }
        })
    })
}

/// The solid of a profile along an arc of a circle or an ellipse.
fn along_arc(
    into: &mut Assembly,
    [index, count]: [usize; 2],
    arc: &Arc,
    profile: &Profile,
    up: Vector,
) -> Result<Swept, SweepError> {
    let ellipse = SpaceEllipse::of(arc);
    let points = arc.points;
    let Some(radius) = ellipse.radius() else {
        return along_ellipse(into, [index, count], arc, &ellipse, profile, up);
    };
    let outward = (points[0] - ellipse.center) / radius;
    let tangent = (points[1] - points[0]).normalize();
    let axis = outward.cross(&tangent).normalize();
    let [x, y] = frame(tangent, up)?;
    if is_rotating(axis, up) {
        let circle = Sweep {
            center: Point::from(ellipse.center),
            axis,
            start: outward,
            radii: [radius; 2],
            up,
            section: Section::Line { normal: [1.0, 0.0], offset: 0.0 },
        };
        return sweep_section(into, [index, count], profile, circle, &|p| p);
    }
    check_side(arc, index, axis, up)?;
    let place = |p: [f64; 2]| {
        let v = x * p[0] + y * p[1];
        [v.dot(&axis), radius + v.dot(&outward)]
    };
    let size = radius.max(profile.reach);
    let turn = Turn { point: ellipse.center, axis, tolerance: 1e-9 * size };
    let reaches_axis = |bound: &Bound| match bound {
        Bound::Left(from, to) => place(*from)[1].min(place(*to)[1]) <= turn.tolerance,
        Bound::Inside(ellipse) => {
            let whole = profile.literals.len() == 1;
            whole && place(ellipse.center)[1] - ellipse.radii[0].max(ellipse.radii[1]) <= turn.tolerance
        }
    };
    if profile.literals.iter().any(|literal| reaches_axis(&literal.bound)) {
        let message = format!("the profile reaches the center of segment {} of the path", index + 1);
        return Err(SweepError::Wrong(
            message,
            "the radius of an arc must be larger than the profile's reach",
        ));
    }
    let mirrored = x.dot(&axis) * y.dot(&outward) - x.dot(&outward) * y.dot(&axis) < 0.0;
    into.sweep(profile, |into, bound, face| {
        let moved = match bound {
            Bound::Left(from, to) if mirrored => Bound::Left(place(*to), place(*from)),
            Bound::Left(from, to) => Bound::Left(place(*from), place(*to)),
            Bound::Inside(ellipse) => {
                let [origin, tip] = [[0.0, 0.0], ellipse.axis].map(place);
                let axis = [tip[0] - origin[0], tip[1] - origin[1]];
                Bound::Inside(Ellipse { center: place(ellipse.center), axis, radii: ellipse.radii })
            }
        };
        Ok(turn.turned(into, &moved, face))
    })
}

/// Rejects an arc along which y' changes sign: the direction lies in its plane, and is tangent to
/// the path somewhere.
fn check_side(arc: &Arc, index: usize, axis: Vector, up: Vector) -> Result<(), SweepError> {
    let [p, q, r] = arc.points;
    let [start, end] = [(q - p).normalize(), (r - q).normalize()];
    let [y, at_end] = [frame(start, up)?[1], frame(end, up)?[1]];
    // Cosines equal to a thousandth: a turn by more reverses y' or tilts the section visibly.
    let same = |before: Vector, after: Vector| (y.dot(&before) - at_end.dot(&after)).abs() <= 1e-3;
    if !same(axis, axis) || !same(start.cross(&axis), end.cross(&axis)) {
        let message = format!(
            "segment {} of the path becomes parallel to the direction of the profile's y axis",
            index + 1
        );
        return Err(SweepError::Wrong(message, "the third argument must not be parallel to the path"));
    }
    Ok(())
}

/// The solid of a profile along an arc of an ellipse.
fn along_ellipse(
    into: &mut Assembly,
    place: [usize; 2],
    arc: &Arc,
    ellipse: &SpaceEllipse,
    profile: &Profile,
    up: Vector,
) -> Result<Swept, SweepError> {
    let [p, q, _] = arc.points;
    let tangent = (q - p).normalize();
    let axis = (p - ellipse.center).cross(&tangent).normalize();
    // The semi-axis nearest to the middle of the arc, so that parameters along the arc stay away
    // from ±π.
    let middle = arc.middle() - ellipse.center;
    let share = |arm: &Vector| middle.dot(arm) / arm.norm_squared();
    let [a, b] = ellipse.arms;
    let (first, second) = if share(&a).abs() >= share(&b).abs() { (a, b) } else { (b, a) };
    let mut path = Sweep {
        center: Point::from(ellipse.center),
        axis,
        start: first.normalize() * share(&first).signum(),
        radii: [first.norm(), second.norm()],
        up,
        section: Section::Line { normal: [1.0, 0.0], offset: 0.0 },
    };
    if is_rotating(axis, up) {
        return sweep_section(into, place, profile, path, &|p| p);
    }
    check_side(arc, place[0], axis, up)?;
    // Without rotation, the section is constant in the coordinates (outward, axis).
    let [x, y] = frame(tangent, up)?;
    let outward = tangent.cross(&axis);
    path.up = axis;
    sweep_section(into, place, profile, path, &|p| {
        let v = x * p[0] + y * p[1];
        [v.dot(&outward), v.dot(&axis)]
    })
}

/// The solid of a profile swept along an elliptic path, possibly rotating about it.
///
/// `moved` maps profile coordinates to section coordinates, possibly by a rotation.
fn sweep_section(
    into: &mut Assembly,
    [index, count]: [usize; 2],
    profile: &Profile,
    path: Sweep,
    moved: &dyn Fn([f64; 2]) -> [f64; 2],
) -> Result<Swept, SweepError> {
    let (reach, radius) = (profile.reach, path.least_curvature_radius());
    if reach >= 0.9 * radius {
        let what = if path.is_round() { "along which it rotates" } else { "an elliptic arc" };
        let message = format!("the profile is too wide for segment {} of the path, {what}", index + 1);
        return Err(SweepError::Unsupported(
            message + ": it comes too close to the arc's centers of curvature",
        ));
    }
    let swept = into.sweep(profile, |into, bound, face| {
        let section = match *bound {
            Bound::Left(from, to) => {
                let ([a, b], [c, d]) = (moved(from), moved(to));
                let length = (c - a).hypot(d - b);
                let normal = [(d - b) / length, (a - c) / length];
                Section::Line { normal, offset: 0.5 * (normal[0] * (a + c) + normal[1] * (b + d)) }
            }
            Bound::Inside(ellipse) => {
                let ([x, y], [u, v]) = (moved([0.0, 0.0]), moved(ellipse.axis));
                Section::Ellipse(Ellipse { center: moved(ellipse.center), axis: [u - x, v - y], ..ellipse })
            }
        };
        Ok(into.side(swept_surface(section, &path), false, face))
    })?;
    // Restrict the solid to a tube that contains it: near the centers of curvature the surfaces of
    // the section continue, but the solid does not. Tubes of consecutive segments have different
    // radii so that they do not touch.
    let part = if index + 1 == count { 0.7 } else { [0.3, 0.5][index % 2] };
    let minor = reach + part * f64::min(0.5 * reach, radius - reach);
    let around = if path.is_round() {
        Surface::Torus(Torus { center: path.center, axis: path.axis, major: path.radii[0], minor })
    } else {
        let section = Section::Ellipse(Ellipse { center: [0.0; 2], axis: [1.0, 0.0], radii: [minor; 2] });
        Surface::Sweep(Sweep { section, ..path })
    };
    let around = into.side(around, false, NO_FACE);
    Ok(Swept { inside: Solid::And(vec![around, swept.inside]), ..swept })
}

/// The surface swept by a section: a plane for a line parallel to the plane of a path without
/// rotation.
fn swept_surface(section: Section, path: &Sweep) -> Surface {
    match section {
        Section::Line { normal: [x, y], offset } if path.up == path.axis && x.abs() <= RIGID => {
            let normal = path.axis * y.signum();
            Surface::Plane(Plane { point: path.center + normal * offset, normal })
        }
        _ => Surface::Sweep(Sweep { section, ..*path }),
    }
}
