//! Curves, surfaces and placements.
//!
//! Source: ISO 10303-42, geometric representation. Curves and surfaces are parametrised as in this
//! crate, not as there: no parameter of a file is used.

use super::record::{Fields, Node};
use crate::bspline::{Basis, SplineCurve, SplineSurface};
use crate::surface::Profile;
use crate::{BrepError, Curve, Placement, Surface, Vector};
use nalgebra::{Matrix3, Vector4};

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
        let operator = "CARTESIAN_TRANSFORMATION_OPERATOR_3D";
        let fields = node.fields(operator)?;
        // Label, name and description come first.
        let axis = |k: usize| fields.may_refer(k)?.map(direction).transpose();
        let z = axis(7)?.unwrap_or_else(Vector::z);
        let x = across(&z, axis(3)?);
        let y = axis(4)?.unwrap_or_else(|| z.cross(&x));
        let y = if z.cross(&x).dot(&y) < 0.0 { -z.cross(&x) } else { z.cross(&x) };
        (point(fields.refers(5)?)?, [x, y, z], fields.length(6).unwrap_or(1.0))
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
        return spline_curve(node, 1, poles, Vec::new(), &quasi_uniform(1, fields.refers_all(1)?.len()));
    }
    if let Some(fields) = node.get("OFFSET_CURVE_3D") {
        let basis = Box::new(nested_curve(fields.refers(1)?, depth - 1)?);
        return Ok(Curve::Offset {
            basis,
            distance: -fields.number(2)?,
            direction: direction(fields.refers(4)?)?,
        });
    }
    spline_curve_of(node)
}

/// Knots and their multiplicities.
type Knots = (Vec<f64>, Vec<usize>);

/// Knots at the integers that repeat at both ends.
fn quasi_uniform(degree: usize, poles: usize) -> Knots {
    let spans = poles.saturating_sub(degree).max(1);
    let mut multiplicities = vec![1; spans + 1];
    (multiplicities[0], multiplicities[spans]) = (degree + 1, degree + 1);
    ((0..=spans).map(|k| k as f64).collect(), multiplicities)
}

/// The knots of a type of splines that has them by definition.
fn implied(node: Node, kind: &str, degree: usize, poles: usize) -> Result<Knots, BrepError> {
    if node.is(&format!("QUASI_UNIFORM_{kind}")) {
        return Ok(quasi_uniform(degree, poles));
    }
    if node.is(&format!("BEZIER_{kind}")) {
        let spans = (poles.saturating_sub(1) / degree.max(1)).max(1);
        let mut multiplicities = vec![degree; spans + 1];
        (multiplicities[0], multiplicities[spans]) = (degree + 1, degree + 1);
        return Ok(((0..=spans).map(|k| k as f64).collect(), multiplicities));
    }
    if node.is(&format!("UNIFORM_{kind}")) {
        let knots: Vec<f64> = (0..=poles + degree).map(|k| k as f64 - degree as f64).collect();
        return Ok((knots.clone(), vec![1; knots.len()]));
    }
    Err(node.error(format!("{} is no {} that can be read", node.kind(), kind.to_lowercase())))
}

/// In a record of one part, the label comes first.
fn after_label(node: Node, name: &str) -> usize {
    usize::from(node.kind() == name)
}

fn spline_curve_of(node: Node) -> Result<Curve<3>, BrepError> {
    const KINDS: [&str; 5] = [
        "B_SPLINE_CURVE",
        "B_SPLINE_CURVE_WITH_KNOTS",
        "QUASI_UNIFORM_CURVE",
        "BEZIER_CURVE",
        "UNIFORM_CURVE",
    ];
    let Some(fields) = node.any(&KINDS) else {
        return Err(node.error(format!("{} is no curve that can be read", node.kind())));
    };
    let at = KINDS.iter().map(|kind| after_label(node, kind)).max().unwrap_or(0);
    let degree = fields.count(at)?;
    let poles = fields.refers_all(at + 1)?.into_iter().map(point).collect::<Result<Vec<_>, _>>()?;
    let knots = match node.get("B_SPLINE_CURVE_WITH_KNOTS") {
        Some(own) => {
            let first = if at == 1 { 6 } else { 0 };
            (own.numbers(first + 1)?, own.counts(first)?)
        }
        None => implied(node, "CURVE", degree, poles.len())?,
    };
    let weights = match node.get("RATIONAL_B_SPLINE_CURVE") {
        Some(own) => own.numbers(0)?,
        None => Vec::new(),
    };
    spline_curve(node, degree, poles, weights, &knots)
}

fn spline_curve(
    node: Node,
    degree: usize,
    mut poles: Vec<Vector>,
    mut weights: Vec<f64>,
    knots: &Knots,
) -> Result<Curve<3>, BrepError> {
    if !weights.is_empty() && (weights.len() != poles.len() || weights.iter().any(|w| !(*w > 0.0))) {
        return Err(node.error("each pole needs a positive weight"));
    }
    let size = poles.iter().map(|p| (p - poles[0]).amax()).fold(0.0, f64::max);
    let (first, last) = (0, poles.len().saturating_sub(1));
    let is_closed = poles.len() > 3
        && (poles[last] - poles[first]).amax() <= CLOSED * size
        && weights.first() == weights.last();
    let basis = basis(node, degree, poles.len(), knots, is_closed)?;
    poles.truncate(basis.poles());
    weights.truncate(if weights.is_empty() { 0 } else { basis.poles() });
    Ok(Curve::Spline(SplineCurve { basis, poles, weights }))
}

/// A spline is closed if its ends differ by at most this (fraction of its size).
const CLOSED: f64 = 1e-9;

/// A basis. That of a closed spline with repeated knots at its ends becomes a periodic one, without
/// the last pole, so that edges and faces can cross the ends.
fn basis(
    node: Node,
    degree: usize,
    poles: usize,
    (knots, multiplicities): &Knots,
    is_closed: bool,
) -> Result<Basis, BrepError> {
    let is_clamped =
        multiplicities.first() == Some(&(degree + 1)) && multiplicities.last() == Some(&(degree + 1));
    if knots.len() != multiplicities.len() {
        return Err(node.error("each knot needs a multiplicity"));
    }
    let made = if is_closed && is_clamped {
        let mut fewer = multiplicities.clone();
        let last = fewer.len() - 1;
        (fewer[0], fewer[last]) = (degree, degree);
        Basis::new(degree, knots, &fewer, poles - 1, true)
    } else {
        Basis::new(degree, knots, multiplicities, poles, false)
    };
    made.map_err(|what| node.error(what))
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
    let with = |fields: Fields, profile| -> Result<Option<Surface>, BrepError> {
        let (origin, axes) = frame(fields.refers(1)?)?;
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
        return with(fields, Profile::Circle { major: fields.length(2)?, minor: fields.length(3)? });
    }
    Ok(None)
}

fn spline_surface(node: Node) -> Result<Surface, BrepError> {
    const KINDS: [&str; 5] = [
        "B_SPLINE_SURFACE",
        "B_SPLINE_SURFACE_WITH_KNOTS",
        "QUASI_UNIFORM_SURFACE",
        "BEZIER_SURFACE",
        "UNIFORM_SURFACE",
    ];
    let Some(fields) = node.any(&KINDS) else {
        return Err(node.error(format!("{} is no surface that can be read", node.kind())));
    };
    let at = KINDS.iter().map(|kind| after_label(node, kind)).max().unwrap_or(0);
    let degrees = [fields.count(at)?, fields.count(at + 1)?];
    let rows = fields.refers_rows(at + 2)?;
    let counts = [rows.len(), rows.first().map_or(0, Vec::len)];
    if counts[1] == 0 || rows.iter().any(|row| row.len() != counts[1]) {
        return Err(node.error("the rows of poles must be equally long"));
    }
    let weights = match node.get("RATIONAL_B_SPLINE_SURFACE") {
        Some(own) => own.rows(0)?,
        None => vec![vec![1.0; counts[1]]; counts[0]],
    };
    let is_positive = |row: &Vec<f64>| row.len() == counts[1] && row.iter().all(|w| *w > 0.0);
    if weights.len() != counts[0] || !weights.iter().all(is_positive) {
        return Err(node.error("each pole needs a positive weight"));
    }
    let mut net: Vec<Vec<Vector4<f64>>> = Vec::with_capacity(counts[0]);
    for (row, weights) in rows.into_iter().zip(&weights) {
        let poles = row.into_iter().map(point).collect::<Result<Vec<_>, _>>()?;
        net.push(poles.iter().zip(weights).map(|(p, &w)| (p * w).push(w)).collect());
    }
    let knots = match node.get("B_SPLINE_SURFACE_WITH_KNOTS") {
        Some(own) => {
            let first = if at == 1 { 8 } else { 0 };
            [0, 1].map(|k| -> Result<Knots, BrepError> {
                Ok((own.numbers(first + 2 + k)?, own.counts(first + k)?))
            })
        }
        None => [0, 1].map(|k| implied(node, "SURFACE", degrees[k], counts[k])),
    };
    let [in_u, in_v] = knots;
    let size = net.iter().flatten().map(|p| (p - net[0][0]).amax()).fold(0.0, f64::max);
    let is_same = |a: &Vector4<f64>, b: &Vector4<f64>| (a - b).amax() <= CLOSED * size;
    let last = [counts[0] - 1, counts[1] - 1];
    let is_closed = [
        counts[0] > 3 && net[0].iter().zip(&net[last[0]]).all(|(a, b)| is_same(a, b)),
        counts[1] > 3 && net.iter().all(|row| is_same(&row[0], &row[last[1]])),
    ];
    let bases = [
        basis(node, degrees[0], counts[0], &in_u?, is_closed[0])?,
        basis(node, degrees[1], counts[1], &in_v?, is_closed[1])?,
    ];
    net.truncate(bases[0].poles());
    net.iter_mut().for_each(|row| row.truncate(bases[1].poles()));
    let is_rational = weights.iter().flatten().any(|w| *w != weights[0][0]);
    if !is_rational {
        net.iter_mut().flatten().for_each(|pole| *pole /= pole.w);
    }
    Ok(Surface::Spline(SplineSurface { bases, poles: net.concat(), is_rational }))
}
