//! Curves, surfaces and placements.
//!
//! Source: ISO 10303-42, geometric representation. Curves and surfaces are parametrised as in this
//! crate, not as there: no parameter of a file is used.

use super::record::{Fields, Node};
use super::splines::{polyline, spline_curve, spline_surface};
use crate::surface::Profile;
use crate::{BrepError, Curve, Placement, Surface, Vector};
use nalgebra::Matrix3;

/// Geometry may be nested this deep: trimmed curves of offsets of ...
const DEEPEST: usize = 16;

pub(super) fn point(node: Node) -> Result<Vector, BrepError> {
    let fields = node.fields("CARTESIAN_POINT")?;
    match fields.numbers(1)?[..] {
        [x, y, z] => Ok(Vector::new(x, y, z)),
        _ => Err(node.error("a point needs three coordinates")),
    }
}

fn direction(node: Node) -> Result<Vector, BrepError> {
    let fields = node.fields("DIRECTION")?;
    match fields.numbers(1)?[..] {
        [x, y, z] => Vector::new(x, y, z)
            .try_normalize(1e-100)
            .ok_or_else(|| node.error("the direction has no length")),
        _ => Err(node.error("a direction needs three components")),
    }
}

/// A direction times a length.
fn vector(node: Node) -> Result<Vector, BrepError> {
    let fields = node.fields("VECTOR")?;
    Ok(direction(fields.refers(1)?)? * fields.length(2)?)
}

/// The part of a direction across an axis, of length one; any if there is no such part.
fn across(axis: &Vector, wanted: Option<Vector>) -> Vector {
    let part = |v: Vector| (v - axis * axis.dot(&v)).try_normalize(1e-9);
    let coordinate = if axis.x.abs() < 0.9 { Vector::x() } else { Vector::y() };
    wanted.and_then(part).or_else(|| part(coordinate)).unwrap_or_else(Vector::z)
}

/// An origin, and the unit vectors x, y and z.
fn frame(node: Node) -> Result<(Vector, [Vector; 3]), BrepError> {
    let fields = node.fields("AXIS2_PLACEMENT_3D")?;
    let origin = point(fields.refers(1)?)?;
    let z = fields.may_refer(2)?.map(direction).transpose()?.unwrap_or_else(Vector::z);
    let x = across(&z, fields.may_refer(3)?.map(direction).transpose()?);
    Ok((origin, [x, z.cross(&x), z]))
}

/// The placement of a coordinate system, or a transformation with a scale.
pub(super) fn placement(node: Node) -> Result<Placement, BrepError> {
    let (shift, axes, scale) = if node.is("AXIS2_PLACEMENT_3D") {
        let (origin, axes) = frame(node)?;
        (origin, axes, 1.0)
    } else {
        let fields = node.fields("CARTESIAN_TRANSFORMATION_OPERATOR_3D")?;
        // Label, name and description come first.
        let axis = |k: usize| fields.may_refer(k)?.map(direction).transpose();
        let z = axis(7)?.unwrap_or_else(Vector::z);
        let x = across(&z, axis(3)?);
        let y = z.cross(&x);
        let is_mirrored = axis(4)?.is_some_and(|given| given.dot(&y) < 0.0);
        let scale = if fields.is_set(6) { fields.length(6)? } else { 1.0 };
        (point(fields.refers(5)?)?, [x, if is_mirrored { -y } else { y }, z], scale)
    };
    Ok(Placement { linear: Matrix3::from_columns(&axes) * scale, shift })
}

/// Curves whose own attribute is another one with the same points.
const WRAPPED: [&str; 4] = ["TRIMMED_CURVE", "SURFACE_CURVE", "SEAM_CURVE", "INTERSECTION_CURVE"];

pub(super) fn curve(node: Node) -> Result<Curve<3>, BrepError> {
    nested_curve(node, DEEPEST)
}

fn nested_curve(node: Node, depth: usize) -> Result<Curve<3>, BrepError> {
    if depth == 0 {
        return Err(node.error(format!("curves are nested more than {DEEPEST} deep")));
    }
    if let Some(fields) = node.any(&WRAPPED) {
        return nested_curve(fields.refers(1)?, depth - 1);
    }
    if let Some(fields) = node.get("LINE") {
        return Ok(Curve::Line { start: point(fields.refers(1)?)?, direction: vector(fields.refers(2)?)? });
    }
    if let Some(fields) = node.any(&["CIRCLE", "ELLIPSE"]) {
        let (center, [x, y, _]) = frame(fields.refers(1)?)?;
        let radius = fields.length(2)?;
        let other = if node.is("CIRCLE") { radius } else { fields.length(3)? };
        return Ok(Curve::Ellipse { center, axes: [x * radius, y * other] });
    }
    if let Some(fields) = node.get("HYPERBOLA") {
        let (center, [x, y, _]) = frame(fields.refers(1)?)?;
        return Ok(Curve::Hyperbola { center, axes: [x * fields.length(2)?, y * fields.length(3)?] });
    }
    if let Some(fields) = node.get("PARABOLA") {
        let (apex, [x, y, _]) = frame(fields.refers(1)?)?;
        return Ok(Curve::Parabola { apex, axes: [x / (4.0 * fields.length(2)?), y] });
    }
    if let Some(fields) = node.get("POLYLINE") {
        let poles = fields.refers_all(1)?.into_iter().map(point).collect::<Result<Vec<_>, _>>()?;
        return polyline(node, poles);
    }
    if let Some(fields) = node.get("OFFSET_CURVE_3D") {
        let basis = Box::new(nested_curve(fields.refers(1)?, depth - 1)?);
        return Ok(Curve::Offset {
            basis,
            distance: -fields.number(2)?,
            direction: direction(fields.refers(4)?)?,
        });
    }
    spline_curve(node)
}

/// Surfaces that are parts of another one.
const TRIMMED: [&str; 3] = ["RECTANGULAR_TRIMMED_SURFACE", "CURVE_BOUNDED_SURFACE", "ORIENTED_SURFACE"];

/// A surface; `radians` is the unit of angles in radians.
pub(super) fn surface(node: Node, radians: f64) -> Result<Surface, BrepError> {
    nested_surface(node, radians, DEEPEST)
}

fn nested_surface(node: Node, radians: f64, depth: usize) -> Result<Surface, BrepError> {
    if depth == 0 {
        return Err(node.error(format!("surfaces are nested more than {DEEPEST} deep")));
    }
    if let Some(fields) = node.any(&TRIMMED) {
        return nested_surface(fields.refers(1)?, radians, depth - 1);
    }
    if let Some(fields) = node.get("PLANE") {
        let (origin, [x, y, _]) = frame(fields.refers(1)?)?;
        return Ok(Surface::Plane { origin, axes: [x, y] });
    }
    if let Some(fields) = node.get("SURFACE_OF_LINEAR_EXTRUSION") {
        let direction = vector(fields.refers(2)?)?.normalize();
        return Ok(Surface::Extrusion { curve: curve(fields.refers(1)?)?, direction });
    }
    if let Some(fields) = node.get("SURFACE_OF_REVOLUTION") {
        let axis = fields.refers(2)?.fields("AXIS1_PLACEMENT")?;
        let along = axis.may_refer(2)?.map(direction).transpose()?.unwrap_or_else(Vector::z);
        let origin = point(axis.refers(1)?)?;
        return Ok(Surface::Revolution { curve: curve(fields.refers(1)?)?, origin, axis: along });
    }
    if let Some(fields) = node.get("OFFSET_SURFACE") {
        let distance = fields.number(2)?;
        return Ok(match nested_surface(fields.refers(1)?, radians, depth - 1)? {
            // Both have the same normals.
            Surface::Offset { basis, distance: inner } => {
                Surface::Offset { basis, distance: distance + inner }
            }
            basis => Surface::Offset { basis: Box::new(basis), distance },
        });
    }
    match round(node, radians)? {
        Some(surface) => Ok(surface),
        None => spline_surface(node),
    }
}

/// A cylinder, a cone, a sphere or a torus.
fn round(node: Node, radians: f64) -> Result<Option<Surface>, BrepError> {
    let with = |fields: Fields, mut profile| -> Result<Option<Surface>, BrepError> {
        let (origin, mut axes) = frame(fields.refers(1)?)?;
        if let Profile::Circle { major, .. } = &mut profile
            && *major < 0.0
        {
            // Some programs write the inner side of a torus that crosses itself so: the same circle
            // seen from the other side.
            (*major, axes) = (-*major, axes.map(|axis| -axis));
        }
        Ok(Some(Surface::Round { origin, axes, profile }))
    };
    if let Some(fields) = node.get("CYLINDRICAL_SURFACE") {
        return with(fields, Profile::Line { radius: fields.length(2)?, slope: [0.0, 1.0] });
    }
    if let Some(fields) = node.get("CONICAL_SURFACE") {
        let (sine, cosine) = (fields.number(3)? * radians).sin_cos();
        return with(fields, Profile::Line { radius: fields.number(2)?, slope: [sine, cosine] });
    }
    if let Some(fields) = node.get("SPHERICAL_SURFACE") {
        return with(fields, Profile::Circle { major: 0.0, minor: fields.length(2)? });
    }
    if let Some(fields) = node.any(&["TOROIDAL_SURFACE", "DEGENERATE_TOROIDAL_SURFACE"]) {
        return with(fields, Profile::Circle { major: fields.number(2)?, minor: fields.length(3)? });
    }
    Ok(None)
}
