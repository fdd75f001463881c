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
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

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

/// Integrals end at this many times the number that is wanted. A step to far too small a scale
/// would otherwise take as many evaluations as there are tets at that scale, in the billions.
const MANY: f64 = 8.0;

/// The largest change of the logarithm of the scale in a step: a factor of 8. The field of far too
/// small sizes takes long, because it has sources as close as they are small.
const LONGEST_STEP: f64 = 2.08;

/// Scales nearer to each other than this, as a factor, are not divided further.
const NEARLY_SAME: f64 = 0.99;

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
        estimate.base = estimate.share_at(settings.size.scale, f64::INFINITY)?;
        Some(estimate)
    }

    /// The scale at which `goal` tets are expected.
    pub fn scale_for(&self, goal: f64) -> Option<f64> {
        // Secant steps in logarithms: the number of tets falls with the third power of the scale,
        // more slowly where something else bounds the sizes.
        let (mut scale, mut slope) = (self.settings.size.scale, -3.0);
        let made = self.made.report.tets as f64;
        let (mut error, most) = ((made / goal).ln(), MANY * (goal / made).max(1.0));
        let step = |error: f64, slope: f64| (-error / slope).clamp(-LONGEST_STEP, LONGEST_STEP).exp();
        for _ in 0..MOST_STEPS {
            let mut next = scale * step(error, slope);
            let mut share = self.share_at(next, most)?;
            while share.is_infinite() && next < NEARLY_SAME * scale {
                next = (scale * next).sqrt();
                share = self.share_at(next, most)?;
            }
            let next_error = (made * share / goal).ln();
            if next != scale {
                slope = ((next_error - error) / (next / scale).ln()).clamp(-4.0, -1.0);
            }
            (scale, error) = (next, next_error);
            if error.abs() < NEAR {
                break;
            }
        }
        Some(scale * step(error, slope)).filter(|scale| scale.is_finite())
    }

    /// The expected number of tets at a scale, as a fraction of those of the mesh; infinite if it
    /// is more than `most`. `None` without a size field.
    pub fn share_at(&self, scale: f64, most: f64) -> Option<f64> {
        let sizes = at_scale(&self.settings.size, scale, self.own_sources);
        let size = self.model.size_field(&sizes, Evaluation::Rough)?;
        Some(integral(&self.made.mesh, &*size, most * self.base) / self.base)
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

/// ∫ dV/h³ over a mesh; infinite if it is more than `most`.
fn integral(mesh: &Mesh, size: &dyn SizeField, most: f64) -> f64 {
    let (sum, is_more) = (AtomicU64::new(0), AtomicBool::new(false));
    let of_tet = |tet: &[crate::ground::mesh::VertexId; 4]| {
        let mut part = Part { size, most, sum: &sum, is_more: &is_more, counted: 0.0, own: 0.0 };
        part.add_tet(tet.map(|v| mesh.points[v.index()]), MOST_HALVINGS);
        part.count();
        part.own
    };
    // Summed in order, so that the result does not depend on the threads.
    let sum = mesh.tets.par_iter().map(of_tet).collect::<Vec<f64>>().iter().sum();
    if is_more.into_inner() { f64::INFINITY } else { sum }
}

/// The unit in which parts of an integral are counted is this fraction of the most it may be. Whole
/// numbers have the same sum in any order.
const UNITS: f64 = (1_u64 << 32) as f64;

/// The part of an integral over one tet of a mesh.
struct Part<'a> {
    size: &'a dyn SizeField,
    most: f64,
    /// The sum over all tets so far, in units, and whether it is more than the most.
    sum: &'a AtomicU64,
    is_more: &'a AtomicBool,
    /// The integral over this tet so far, and how much of it has been counted in the sum.
    own: f64,
    counted: f64,
}

impl Part<'_> {
    /// Counts what was added in the sum of all tets.
    fn count(&mut self) {
        let units = ((self.own - self.counted) / self.most * UNITS) as u64;
        self.counted = self.own;
        if self.sum.fetch_add(units, Ordering::Relaxed) + units > UNITS as u64 {
            self.is_more.store(true, Ordering::Relaxed);
        }
    }

    fn add_tet(&mut self, corners: [Point; 4], halvings: u32) {
        if self.is_more.load(Ordering::Relaxed) {
            return;
        }
        let middle = Point::from(corners.iter().map(|p| p.coords).sum::<crate::Vector>() / 4.0);
        let h = self.size.size_at(&middle);
        let squared = |[i, j]: [usize; 2]| (corners[j] - corners[i]).norm_squared();
        let longest =
            TET_EDGES.into_iter().fold(TET_EDGES[0], |a, b| if squared(b) > squared(a) { b } else { a });
        if halvings == 0 || squared(longest) <= (LONGEST * h).powi(2) {
            let [a, b, c, d] = &corners;
            self.own += volume6(a, b, c, d).abs() / (6.0 * h.powi(3));
            if self.own - self.counted > self.most / 256.0 {
                self.count();
            }
            return;
        }
        let cut = nalgebra::center(&corners[longest[0]], &corners[longest[1]]);
        for end in longest {
            let mut half = corners;
            half[end] = cut;
            self.add_tet(half, halvings - 1);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::size::UniformSize;

    #[test]
    fn the_integral_of_a_constant_is_the_volume_and_of_a_growing_size_that_of_calculus() {
        let corners = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]].map(Point::from);
        let mesh = Mesh {
            points: corners.to_vec(),
            tets: vec![[0, 1, 2, 3].map(crate::ground::mesh::VertexId)],
            ..Mesh::default()
        };
        let over_tet = |size: &dyn SizeField| integral(&mesh, size, f64::INFINITY);
        assert!((over_tet(&UniformSize(0.1)) - 1000.0 / 6.0).abs() < 1e-9);
        // More than was to be counted: without the limit this would take hours.
        assert_eq!(integral(&mesh, &UniformSize(1e-5), 1e6), f64::INFINITY);
        assert!((integral(&mesh, &UniformSize(0.1), 167.0) - 1000.0 / 6.0).abs() < 1e-9);
        assert_eq!(integral(&mesh, &UniformSize(0.1), 166.0), f64::INFINITY);

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
        let got = over_tet(&Growing);
        assert!((got / exact - 1.0).abs() < 0.1, "{got}, {exact}");
    }
}
