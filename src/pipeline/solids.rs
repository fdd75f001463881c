//! Solids of CAD files as facets, and whether they touch.

use crate::Point;
use crate::ground::projector::BrepProjector;
use crate::mesher::facets::{Crossing, FacetModel, of_brep};
use csg::PatchId;

/// A boundary representation with its tessellation.
#[derive(Debug)]
pub(super) struct Cad {
    pub model: brep::Model,
    pub tessellation: brep::Tessellation,
}

/// Faces whose facets have a smaller chord (fraction of the size of the model) get no finer ones.
const FINEST: f64 = 2e-5;

/// How often faces are made finer because their facets intersect: usually twice, and again where
/// the finer facets of one face reach through those of another one.
const MOST_ROUNDS: usize = 12;

/// Facets that intersect deeper than this, in largest distances of facets from their faces, do so
/// because the faces do: twice would be enough if the distances were not found by samples.
const DEEPER: f64 = 5.0;

/// Facets that approximate a boundary representation. Where those of close faces intersect, these
/// faces have finer ones, unless the faces themselves intersect.
pub(super) fn tessellated(
    mut model: brep::Model,
) -> Result<(Cad, (FacetModel, BrepProjector)), brep::BrepError> {
    let first = brep::Tessellation::of(&mut model, &brep::Settings::default())?;
    let made = of_brep(&model, &first);
    let mut finer: Option<(brep::Tessellation, (FacetModel, BrepProjector))> = None;
    for _ in 0..MOST_ROUNDS {
        let (tessellation, (facets, exact)) = match &finer {
            Some((tessellation, made)) => (tessellation, made),
            None => (&first, &made),
        };
        let mut crossings = facets.intersections();
        crossings.retain(|crossing| facets.is_deep(crossing));
        if crossings.is_empty() {
            let (tessellation, made) = finer.unwrap_or((first, made));
            return Ok((Cad { model, tessellation }, made));
        }
        let Some(settings) = finer_at(&crossings, tessellation.settings(), facets) else { break };
        if touch(facets, exact, &crossings) {
            break;
        }
        // The intersection tells more than that finer facets would be too many.
        let Ok(tessellation) = tessellation.with_settings(&mut model, settings) else { break };
        let made = of_brep(&model, &tessellation);
        finer = Some((tessellation, made));
    }
    Ok((Cad { model, tessellation: first }, made))
}

/// Settings with which facets that intersect are finer, if these may be free of each other.
fn finer_at(
    crossings: &[Crossing],
    settings: &[brep::Settings],
    facets: &FacetModel,
) -> Option<Vec<brep::Settings>> {
    let size = (facets.bounds.max - facets.bounds.min).norm();
    let mut finer = settings.to_vec();
    for crossing in crossings {
        let patches = crossing.patches.map(PatchId::index);
        let coarser = patches.map(|patch| settings[patch].chord).into_iter().fold(0.0, f64::max);
        if crossing.depth > DEEPER * coarser * size || coarser < FINEST {
            return None;
        }
        for patch in patches {
            let brep::Settings { chord, angle } = settings[patch];
            if chord > FINEST {
                finer[patch] = brep::Settings { chord: 0.1 * chord, angle: 0.5 * angle };
            }
        }
    }
    Some(finer)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_faces_whose_facets_intersect_are_made_finer() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/geometries/step/bubbles.step");
        let read = || brep::Model::read_step(&std::fs::read(path).unwrap(), brep::Unit::OfFile).unwrap();
        let count = |tessellation: &brep::Tessellation, patch: usize| {
            tessellation.triangles.iter().filter(|t| t.patch as usize == patch).count()
        };
        let (cad, (facets, _)) = tessellated(read()).unwrap();
        assert_eq!(facets.intersections(), []);
        let coarse = brep::Tessellation::of(&mut read(), &brep::Settings::default()).unwrap();
        let chords: Vec<f64> = cad.tessellation.settings().iter().map(|s| s.chord).collect();
        // The ball and the bubble below its surface; the other bubble is far from both.
        assert!(chords[0] < 2e-4 && chords[0] == chords[2], "{chords:?}");
        let counts = [0, 1, 2].map(|patch| [&coarse, &cad.tessellation].map(|t| count(t, patch)));
        assert!(counts[1][0] == counts[1][1] && counts[1][0] > 100, "{counts:?}");
        assert!([0, 2].iter().all(|&patch| counts[patch][1] > 3 * counts[patch][0]), "{counts:?}");
    }
}
