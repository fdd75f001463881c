//! Predicts the number of tets for a size field from a mesh made with another one.
//!
//! The number of tets is nearly proportional to ∫ dV/h³ over the bodies. The existing mesh,
//! whatever its sizes, serves for the quadrature, and its number of tets calibrates the factor.

use super::coarse::CoarseSettings;
use super::coarse_mesh::CoarseMesh;
use super::model::Model;
use crate::Point;
use crate::ground::kernel::simplex::volume6;
use crate::ground::mesh::{Mesh, TET_EDGES};
use crate::ground::size::{SizeField, SizeSettings};
use rayon::prelude::*;

/// Tets are bisected until they are no longer than this, in units of the size at their centroid;
/// within such a tet the size varies by the grading only.
const LONGEST: f64 = 2.0;

/// Maximum depth of bisection: enough for a tet a thousand times as long as the size.
const MOST_HALVINGS: u32 = 30;

/// Maximum number of secant steps.
const MOST_STEPS: usize = 4;

/// Tolerance of the logarithm of the number: as good as the estimate, and well inside the accepted
/// range.
const NEAR: f64 = 0.08;

/// Returns the scale at which `goal` tets are expected, from a mesh `made` with these settings;
/// `None` without a size field.
pub(super) fn scale_for(
    model: &Model,
    settings: &CoarseSettings,
    made: &CoarseMesh,
    own_sources: usize,
    goal: f64,
) -> Option<f64> {
    let integral_at = |scale| integral_at(model, settings, made, own_sources, scale);
    let count = made.report.tets as f64;
    let (mut scale, base) = (settings.size.scale, integral_at(settings.size.scale)?);
    // Secant steps in logarithms: the number of tets falls with the third power of the scale, more
    // slowly where something else bounds the sizes.
    let mut error = (count / goal).ln();
    let mut slope = -3.0;
    for _ in 0..MOST_STEPS {
        let next = scale * (-error / slope).clamp(-4.0, 4.0).exp();
        let next_error = (count * integral_at(next)? / base / goal).ln();
        let step = (next / scale).ln();
        if step != 0.0 {
            slope = ((next_error - error) / step).clamp(-4.0, -0.5);
        }
        (scale, error) = (next, next_error);
        if error.abs() < NEAR {
            break;
        }
    }
    scale.is_finite().then_some(scale)
}

/// The fraction of the tets of a mesh `made` with these settings that is expected at a larger
/// scale; `None` without a size field.
pub(super) fn share_at(
    model: &Model,
    settings: &CoarseSettings,
    made: &CoarseMesh,
    own_sources: usize,
    scale: f64,
) -> Option<f64> {
    let integral_at = |scale| integral_at(model, settings, made, own_sources, scale);
    Some(integral_at(scale)? / integral_at(settings.size.scale)?)
}

/// The integral of the size field at a scale over a mesh; `None` without a size field.
fn integral_at(
    model: &Model,
    settings: &CoarseSettings,
    made: &CoarseMesh,
    own_sources: usize,
    scale: f64,
) -> Option<f64> {
    let sizes = at_scale(&settings.size, scale, own_sources);
    model.size_field(&sizes).map(|size| integral(&made.mesh, &*size))
}

/// The settings at another scale. Sources added at this scale grow at a larger one like the sizes
/// in thin regions, and are small enough at a smaller one.
fn at_scale(settings: &SizeSettings, scale: f64, own_sources: usize) -> SizeSettings {
    let mut sizes = SizeSettings { scale, ..settings.clone() };
    let [old, new] = [settings, &sizes].map(|sizes| sizes.scaled_closeness().ratio);
    let growth = if old.is_finite() { new / old } else { scale / settings.scale };
    for source in &mut sizes.sources[own_sources..] {
        source.size *= growth.max(1.0);
    }
    sizes
}

/// ∫ dV/h³ over a mesh.
fn integral(mesh: &Mesh, size: &dyn SizeField) -> f64 {
    let of_tet = |tet: &[crate::ground::mesh::VertexId; 4]| {
        over_tet(tet.map(|v| mesh.points[v.index()]), size, MOST_HALVINGS)
    };
    // Summed in order, so that the result does not depend on the threads.
    mesh.tets.par_iter().map(of_tet).collect::<Vec<f64>>().iter().sum()
}

fn over_tet(corners: [Point; 4], size: &dyn SizeField, halvings: u32) -> f64 {
    let middle = Point::from(corners.iter().map(|p| p.coords).sum::<crate::Vector>() / 4.0);
    let h = size.size_at(&middle);
    let squared = |[i, j]: [usize; 2]| (corners[j] - corners[i]).norm_squared();
    let longest =
        TET_EDGES.into_iter().fold(TET_EDGES[0], |a, b| if squared(b) > squared(a) { b } else { a });
    if halvings == 0 || squared(longest) <= (LONGEST * h).powi(2) {
        let [a, b, c, d] = &corners;
        return volume6(a, b, c, d).abs() / (6.0 * h.powi(3));
    }
    let cut = nalgebra::center(&corners[longest[0]], &corners[longest[1]]);
    longest
        .into_iter()
        .map(|end| {
            let mut half = corners;
            half[end] = cut;
            over_tet(half, size, halvings - 1)
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::size::UniformSize;

    #[test]
    fn the_integral_of_a_constant_is_the_volume_and_of_a_growing_size_that_of_calculus() {
        let corners = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]].map(Point::from);
        assert!((over_tet(corners, &UniformSize(0.1), MOST_HALVINGS) - 1000.0 / 6.0).abs() < 1e-9);

        struct Growing;
        impl SizeField for Growing {
            fn size_at(&self, p: &Point) -> f64 {
                0.05 + 0.3 * p.x
            }
        }
        // Slices across x have the area (1 - x)²/2.
        let steps = 100_000;
        let slice = |k: usize| {
            let x = (k as f64 + 0.5) / steps as f64;
            (1.0 - x).powi(2) / (2.0 * (0.05 + 0.3 * x).powi(3) * steps as f64)
        };
        let exact: f64 = (0..steps).map(slice).sum();
        let got = over_tet(corners, &Growing, MOST_HALVINGS);
        assert!((got / exact - 1.0).abs() < 0.1, "{got}, {exact}");
    }
}
