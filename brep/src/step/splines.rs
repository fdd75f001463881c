//! B-spline curves and surfaces.
//!
//! Source: ISO 10303-42. Splines of that standard are never periodic: closed ones become so here,
//! so that edges and faces can cross their ends.

use super::geometry::point;
use super::record::Node;
use crate::bspline::{Basis, SplineCurve, SplineSurface};
use crate::{BrepError, Curve, Surface, Vector};
use nalgebra::Vector4;

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

/// A B-spline curve of any type.
pub(super) fn spline_curve(node: Node) -> Result<Curve<3>, BrepError> {
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
    spline(node, degree, poles, weights, &knots)
}

/// Straight lines between points.
pub(super) fn polyline(node: Node, points: Vec<Vector>) -> Result<Curve<3>, BrepError> {
    let knots = quasi_uniform(1, points.len());
    spline(node, 1, points, Vec::new(), &knots)
}

fn spline(
    node: Node,
    degree: usize,
    mut poles: Vec<Vector>,
    mut weights: Vec<f64>,
    knots: &Knots,
) -> Result<Curve<3>, BrepError> {
    if !weights.is_empty() && (weights.len() != poles.len() || !weights.iter().all(|w| *w > 0.0)) {
        return Err(node.error("each pole needs a positive weight"));
    }
    let size = poles.iter().map(|p| (p - poles[0]).amax()).fold(0.0, f64::max);
    let is_same = |i: usize, j: usize| {
        (poles[i] - poles[j]).amax() <= crate::bspline::CLOSED * size && weights.get(i) == weights.get(j)
    };
    let basis = basis(node, degree, poles.len(), knots, is_same)?;
    poles.truncate(basis.poles());
    weights.truncate(basis.poles());
    Ok(Curve::Spline(SplineCurve { basis, poles, weights }))
}

/// A basis, periodic if the spline is closed; `is_same` compares two poles.
fn basis(
    node: Node,
    degree: usize,
    poles: usize,
    knots: &Knots,
    is_same: impl Fn(usize, usize) -> bool,
) -> Result<Basis, BrepError> {
    let made = open_basis(node, degree, poles, knots)?;
    Ok(made.closed(is_same).unwrap_or(made))
}

fn open_basis(node: Node, degree: usize, poles: usize, knots: &Knots) -> Result<Basis, BrepError> {
    if knots.0.len() != knots.1.len() {
        return Err(node.error("each knot needs a multiplicity"));
    }
    Basis::new(degree, &knots.0, &knots.1, poles, false).map_err(|what| node.error(what))
}

/// A B-spline surface of any type.
pub(super) fn spline_surface(node: Node) -> Result<Surface, BrepError> {
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
    let bases =
        [open_basis(node, degrees[0], counts[0], &in_u?)?, open_basis(node, degrees[1], counts[1], &in_v?)?];
    let is_rational = weights.iter().flatten().any(|w| *w != weights[0][0]);
    if !is_rational {
        net.iter_mut().flatten().for_each(|pole| *pole /= pole.w);
    }
    Ok(Surface::Spline(SplineSurface { bases, poles: net.concat(), is_rational }.closed()))
}
