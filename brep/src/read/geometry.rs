//! Curves and surfaces.

use super::tokens::Tokens;
use crate::BrepError;
use crate::bspline::{Basis, SplineCurve, SplineSurface};
use crate::curve::Curve;
use crate::surface::{Profile, Surface};
use nalgebra::{SVector, Vector4};

/// Trimmed and offset geometry may be nested this deep.
const DEEPEST: usize = 16;

pub(super) fn curve_2d(tokens: &mut Tokens) -> Result<Curve<2>, BrepError> {
    curve(tokens, DEEPEST)
}

pub(super) fn curve_3d(tokens: &mut Tokens) -> Result<Curve<3>, BrepError> {
    curve(tokens, DEEPEST)
}

fn too_deep(tokens: &Tokens) -> BrepError {
    tokens.error(&format!("curves or surfaces are nested more than {DEEPEST} deep"))
}

/// A center and the unit vectors x and y.
fn axes<const D: usize>(tokens: &mut Tokens) -> Result<(SVector<f64, D>, [SVector<f64, D>; 2]), BrepError> {
    let center = tokens.vector()?;
    if D == 3 {
        // The normal follows from the axes.
        tokens.vector::<3>()?;
    }
    Ok((center, [tokens.unit()?, tokens.unit()?]))
}

fn curve<const D: usize>(tokens: &mut Tokens, depth: usize) -> Result<Curve<D>, BrepError> {
    if depth == 0 {
        return Err(too_deep(tokens));
    }
    Ok(match tokens.integer()? {
        1 => Curve::Line { start: tokens.vector()?, direction: tokens.unit()? },
        2 => {
            let (center, axes) = axes(tokens)?;
            let radius = tokens.number()?;
            Curve::Ellipse { center, axes: axes.map(|a| a * radius) }
        }
        kind @ (3 | 5) => {
            let (center, [x, y]) = axes(tokens)?;
            let axes = [x * tokens.number()?, y * tokens.number()?];
            if kind == 3 { Curve::Ellipse { center, axes } } else { Curve::Hyperbola { center, axes } }
        }
        4 => {
            let (apex, [x, y]) = axes(tokens)?;
            let focal = tokens.number()?;
            if focal == 0.0 {
                return Err(tokens.error("a parabola has focal length 0"));
            }
            Curve::Parabola { apex, axes: [x / (4.0 * focal), y] }
        }
        6 => {
            let is_rational = tokens.flag()?;
            let degree = tokens.count()?;
            let basis = Basis::bezier(degree).map_err(|what| tokens.error(&what))?;
            spline(tokens, basis, is_rational)?
        }
        7 => {
            let (is_rational, is_periodic) = (tokens.flag()?, tokens.flag()?);
            let (degree, poles, knots) = (tokens.count()?, tokens.count()?, tokens.count()?);
            let (points, weights) = poles_of(tokens, poles, is_rational)?;
            let basis = basis(tokens, degree, poles, knots, is_periodic)?;
            Curve::Spline(SplineCurve { basis, poles: points, weights })
        }
        8 => {
            tokens.skip_numbers(2)?;
            curve(tokens, depth - 1)?
        }
        9 => {
            let distance = tokens.number()?;
            let direction = if D == 3 { tokens.unit()? } else { SVector::zeros() };
            let basis = Box::new(curve(tokens, depth - 1)?);
            Curve::Offset { basis, distance, direction }
        }
        kind => return Err(tokens.error(&format!("a curve has kind {kind}; 1 to 9 are known"))),
    })
}

fn spline<const D: usize>(
    tokens: &mut Tokens,
    basis: Basis,
    is_rational: bool,
) -> Result<Curve<D>, BrepError> {
    let (poles, weights) = poles_of(tokens, basis.poles(), is_rational)?;
    Ok(Curve::Spline(SplineCurve { basis, poles, weights }))
}

/// Poles and weights of a curve.
type Poles<const D: usize> = (Vec<SVector<f64, D>>, Vec<f64>);

fn poles_of<const D: usize>(
    tokens: &mut Tokens,
    count: usize,
    is_rational: bool,
) -> Result<Poles<D>, BrepError> {
    let (mut poles, mut weights) = (Vec::new(), Vec::new());
    for _ in 0..count {
        poles.push(tokens.vector()?);
        if is_rational {
            weights.push(weight(tokens)?);
        }
    }
    Ok((poles, weights))
}

fn weight(tokens: &mut Tokens) -> Result<f64, BrepError> {
    let weight = tokens.number()?;
    if weight > 0.0 { Ok(weight) } else { Err(tokens.error("the weights of a spline must be positive")) }
}

fn basis(
    tokens: &mut Tokens,
    degree: usize,
    poles: usize,
    count: usize,
    is_periodic: bool,
) -> Result<Basis, BrepError> {
    let (mut knots, mut multiplicities) = (Vec::new(), Vec::new());
    for _ in 0..count {
        knots.push(tokens.number()?);
        multiplicities.push(tokens.count()?);
    }
    Basis::new(degree, &knots, &multiplicities, poles, is_periodic).map_err(|what| tokens.error(&what))
}

pub(super) fn surface(tokens: &mut Tokens) -> Result<Surface, BrepError> {
    nested_surface(tokens, DEEPEST)
}

fn nested_surface(tokens: &mut Tokens, depth: usize) -> Result<Surface, BrepError> {
    if depth == 0 {
        return Err(too_deep(tokens));
    }
    Ok(match tokens.integer()? {
        1 => {
            let (origin, [x, y, _]) = tokens.frame()?;
            Surface::Plane { origin, axes: [x, y] }
        }
        kind @ 2..=5 => round(tokens, kind)?,
        6 => {
            let direction = tokens.unit()?;
            Surface::Extrusion { curve: curve(tokens, depth - 1)?, direction }
        }
        7 => {
            let (origin, axis) = (tokens.vector()?, tokens.unit()?);
            Surface::Revolution { curve: curve(tokens, depth - 1)?, origin, axis }
        }
        8 => {
            let rational = tokens.flag()? | tokens.flag()?;
            let degrees = [tokens.count()?, tokens.count()?];
            let [u, v] = degrees.map(Basis::bezier);
            let bases = [u.map_err(|what| tokens.error(&what))?, v.map_err(|what| tokens.error(&what))?];
            let poles = net(tokens, bases[0].poles(), bases[1].poles(), rational)?;
            Surface::Spline(SplineSurface { bases, poles, is_rational: rational })
        }
        9 => {
            let rational = tokens.flag()? | tokens.flag()?;
            let periodic = [tokens.flag()?, tokens.flag()?];
            let degrees = [tokens.count()?, tokens.count()?];
            let counts = [tokens.count()?, tokens.count()?];
            let knots = [tokens.count()?, tokens.count()?];
            let poles = net(tokens, counts[0], counts[1], rational)?;
            let bases = [
                basis(tokens, degrees[0], counts[0], knots[0], periodic[0])?,
                basis(tokens, degrees[1], counts[1], knots[1], periodic[1])?,
            ];
            Surface::Spline(SplineSurface { bases, poles, is_rational: rational })
        }
        10 => {
            tokens.skip_numbers(4)?;
            nested_surface(tokens, depth - 1)?
        }
        11 => {
            let distance = tokens.number()?;
            match nested_surface(tokens, depth - 1)? {
                // Both have the same normals.
                Surface::Offset { basis, distance: inner } => {
                    Surface::Offset { basis, distance: distance + inner }
                }
                basis => Surface::Offset { basis: Box::new(basis), distance },
            }
        }
        kind => return Err(tokens.error(&format!("a surface has kind {kind}; 1 to 11 are known"))),
    })
}

/// A cylinder, a cone, a sphere or a torus.
fn round(tokens: &mut Tokens, kind: i64) -> Result<Surface, BrepError> {
    let (origin, axes) = tokens.frame()?;
    let radius = tokens.number()?;
    let profile = match kind {
        2 => Profile::Line { radius, slope: [0.0, 1.0] },
        3 => {
            let angle = tokens.number()?;
            Profile::Line { radius, slope: [angle.sin(), angle.cos()] }
        }
        4 => Profile::Circle { major: 0.0, minor: radius },
        _ => Profile::Circle { major: radius, minor: tokens.number()? },
    };
    Ok(Surface::Round { origin, axes, profile })
}

/// Poles of a surface, weighted.
fn net(
    tokens: &mut Tokens,
    in_u: usize,
    in_v: usize,
    rational: bool,
) -> Result<Vec<Vector4<f64>>, BrepError> {
    let mut poles = Vec::new();
    for _ in 0..in_u {
        for _ in 0..in_v {
            let point = tokens.vector::<3>()?;
            let weight = if rational { weight(tokens)? } else { 1.0 };
            poles.push((point * weight).push(weight));
        }
    }
    Ok(poles)
}
