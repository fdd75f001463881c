//! Solids of CAD files as facets, and whether they touch.

use crate::Point;
use crate::ground::projector::BrepProjector;
use crate::mesher::facets::{Crossing, FacetModel, of_brep};

/// A boundary representation with its tessellation.
#[derive(Debug)]
pub(super) struct Cad {
    pub model: brep::Model,
    /// How it is tessellated.
    pub settings: brep::Settings,
    pub tessellation: brep::Tessellation,
}

/// How often a tessellation is made finer because its triangles intersect.
const FINER: i32 = 3;

/// Facets that intersect deeper than this, in largest distances of facets from their faces, do so
/// because the faces do: twice would be enough if the distances were not found by samples.
const DEEPER: f64 = 5.0;

/// Facets that approximate a boundary representation, so fine that those of close faces do not
/// intersect, unless the faces do.
pub(super) fn tessellated(
    mut model: brep::Model,
) -> Result<(Cad, (FacetModel, BrepProjector)), brep::BrepError> {
    let initial = brep::Settings::default();
    let mut coarsest = None;
    for k in 0..FINER {
        let settings =
            brep::Settings { chord: initial.chord * 0.1_f64.powi(k), angle: initial.angle * 0.5_f64.powi(k) };
        let tessellation = match brep::Tessellation::of(&mut model, &settings) {
            Ok(tessellation) => tessellation,
            Err(error) if coarsest.is_none() => return Err(error),
            // The intersection tells more than that finer facets would be too many.
            Err(_) => break,
        };
        let made = of_brep(&model, &tessellation);
        let crossings = made.0.intersections();
        if !crossings.iter().any(|crossing| made.0.is_deep(crossing)) {
            return Ok((Cad { model, settings, tessellation }, made));
        }
        let most = DEEPER * settings.chord * (made.0.bounds.max - made.0.bounds.min).norm();
        let never_ends =
            crossings.iter().any(|crossing| crossing.depth > most) || touch(&made.0, &made.1, &crossings);
        coarsest.get_or_insert((settings, tessellation, made));
        if never_ends {
            break;
        }
    }
    let (settings, tessellation, made) = coarsest.expect("the first of several");
    Ok((Cad { model, settings, tessellation }, made))
}

/// Surfaces at most this far apart touch (fraction of the size of the model).
const TOUCH: f64 = 1e-8;
/// Projections onto two surfaces, in search of a common point.
const TURNS: usize = 30;

/// Whether facets intersect because faces of two solids without a common face do: finer facets
/// would intersect too.
pub(super) fn touch(model: &FacetModel, exact: &BrepProjector, crossings: &[Crossing]) -> bool {
    let size = (model.bounds.max - model.bounds.min).norm();
    crossings.iter().any(|crossing| model.are_of_different_bodies(crossing) && meet(exact, crossing, size))
}

/// Whether two patches have a common point near where their facets intersect.
fn meet(exact: &BrepProjector, crossing: &Crossing, size: f64) -> bool {
    let [a, b] = crossing.patches;
    let mut at = crossing.at;
    let project = |patch, at: &Point| exact.project_patch(patch, at).ok();
    for _ in 0..TURNS {
        let (Some(on_a), Some(on_b)) = (project(a, &at), project(b, &at)) else { return false };
        if (on_a - on_b).norm() <= TOUCH * size {
            // Not where only the surfaces beyond the faces meet.
            return exact.is_within(a, &on_a) && exact.is_within(b, &on_b);
        }
        at = nearest_common(at, [on_a, on_b]);
    }
    false
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
