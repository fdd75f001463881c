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
use crate::ground::size::{Evaluation, SizeField, SizeSettings};
use rayon::prelude::*;

/// Tets are bisected until they are no longer than this, in units of the size at their centroid;
/// within such a tet the size varies by the grading only.
const LONGEST: f64 = 2.0;

/// Maximum depth of bisection: enough for a tet a thousand times as long as the size.
const MOST_HALVINGS: u32 = 30;

/// Maximum number of secant steps.
const MOST_STEPS: usize = 4;

/// An error of the logarithm of the number from which one more secant step is accurate without
/// another integral: slopes between scales so close to each other differ by a tenth.
const NEAR: f64 = 0.3;

/// A mesh from which numbers of tets at other scales are predicted.
pub(super) struct Estimate<'a> {
    model: &'a Model,
    made: &'a CoarseMesh,
    /// The settings it was made with.
    settings: &'a CoarseSettings,
    /// The number of sources in the settings that were not added when it was made.
    own_sources: usize,
    /// The integral with these settings.
    base: f64,
}

impl<'a> Estimate<'a> {
    /// Returns `None` without a size field.
    pub fn new(
        model: &'a Model,
        settings: &'a CoarseSettings,
        made: &'a CoarseMesh,
        own_sources: usize,
    ) -> Option<Self> {
        let mut estimate = Self { model, made, settings, own_sources, base: 1.0 };
        estimate.base = estimate.share_at(settings.size.scale)?;
        Some(estimate)
    }

    /// The scale at which `goal` tets are expected.
    pub fn scale_for(&self, goal: f64) -> Option<f64> {
        // Secant steps in logarithms: the number of tets falls with the third power of the scale,
        // more slowly where something else bounds the sizes.
        let (mut scale, mut slope) = (self.settings.size.scale, -3.0);
        let mut error = (self.made.report.tets as f64 / goal).ln();
        let step = |error: f64, slope: f64| (-error / slope).clamp(-4.0, 4.0).exp();
        for _ in 0..MOST_STEPS {
            let next = scale * step(error, slope);
            let next_error = (self.made.report.tets as f64 * self.share_at(next)? / goal).ln();
            if next != scale {
                slope = ((next_error - error) / (next / scale).ln()).clamp(-4.0, -0.5);
            }
            (scale, error) = (next, next_error);
            if error.abs() < NEAR {
                break;
            }
        }
        Some(scale * step(error, slope)).filter(|scale| scale.is_finite())
    }

    /// The expected number of tets at a scale, as a fraction of those of the mesh.
    pub fn share_at(&self, scale: f64) -> Option<f64> {
        let sizes = at_scale(&self.settings.size, scale, self.own_sources);
        let size = self.model.size_field(&sizes, Evaluation::Rough)?;
        Some(integral(&self.made.mesh, &*size) / self.base)
    }
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
