//! Curves in the parameters of surfaces, for files that have none.
//!
//! Each edge of a face is followed across the surface in small steps, so its curve in the
//! parameters is continuous across the seams of periodic surfaces. Loops that go around such a
//! surface are then joined by seams, or to a pole.

mod close;
mod route;
mod trace;

pub(crate) use close::close;
pub(crate) use trace::Loop;

use crate::bspline::{Basis, SplineCurve};
use crate::model::{Fin, On};
use crate::nearest::{nearest_on_surface, nearest_within};
use crate::project::{Domain, SurfaceFoot, project_to_surface, project_within};
use crate::surface::Profile;
use crate::{Curve, Point, Surface, Vector};
use nalgebra::Vector2;

/// Parameters of a surface.
pub(crate) type Parameters = [f64; 2];

/// Derivatives shorter than this (fraction of the diagonal of the model) are those of a pole.
const AT_REST: f64 = 1e-7;

/// Feet beyond the knots of a spline by more than this fraction of its domain are doubtful ...
const BEYOND: f64 = 1e-2;
/// ... if the domain itself is this close, as a fraction of the diagonal.
const BESIDE: f64 = 1e-4;
/// Points whose distances differ by less than this (fraction of the diagonal) are equally near, and
/// parameters this close to the domain (fraction of it) are inside.
const NEARLY: f64 = 1e-6;

/// A surface on which edges are followed.
pub(crate) struct Chart<'a> {
    surface: &'a Surface,
    periods: [Option<f64>; 2],
    /// The diagonal of the model.
    diagonal: f64,
}

/// A side of a face, as parameters along its loop.
#[derive(Clone, Debug)]
pub(crate) struct Side {
    pub on: On,
    pub is_forward: bool,
    /// The parameter of the curve in space, and those of the surface.
    pub nodes: Vec<(f64, Parameters)>,
}

impl Side {
    fn start(&self) -> Parameters {
        self.nodes[0].1
    }

    fn end(&self) -> Parameters {
        self.nodes[self.nodes.len() - 1].1
    }

    /// A side without length.
    fn at_corner(corner: usize, from: Parameters, to: Parameters) -> Self {
        Self { on: On::Corner(corner), is_forward: true, nodes: vec![(0.0, from), (1.0, to)] }
    }

    /// A side along a straight line in the parameters, on a curve over [0, 1].
    fn straight(curve: usize, is_forward: bool, from: Parameters, to: Parameters) -> Self {
        const STEPS: usize = 32;
        let node = |k: usize| {
            let share = k as f64 / STEPS as f64;
            let t = if is_forward { share } else { 1.0 - share };
            (t, if k == STEPS { to } else { [0, 1].map(|i| from[i] + share * (to[i] - from[i])) })
        };
        Self { on: On::Curve(curve), is_forward, nodes: (0..=STEPS).map(node).collect() }
    }

    /// Adds a multiple of the periods.
    fn shift(&mut self, by: Parameters) {
        self.nodes.iter_mut().for_each(|node| node.1 = [node.1[0] + by[0], node.1[1] + by[1]]);
    }

    /// The side as a piecewise linear curve.
    ///
    /// # Errors
    /// If its parameters do not ascend or descend.
    pub fn fin(mut self) -> Result<Fin, String> {
        if !self.is_forward {
            self.nodes.reverse();
        }
        let knots: Vec<f64> = self.nodes.iter().map(|node| node.0).collect();
        let basis = Basis::clamped(1, &knots, 1)?;
        let range = basis.range();
        let poles = self.nodes.iter().map(|node| Vector2::from(node.1)).collect();
        let curve = Some(Curve::Spline(SplineCurve { basis, poles, weights: Vec::new() }));
        Ok(Fin { on: self.on, curve, range, is_forward: self.is_forward })
    }
}

impl<'a> Chart<'a> {
    pub fn new(surface: &'a Surface, diagonal: f64) -> Self {
        Self { surface, periods: surface.periods(), diagonal }
    }

    /// Shorter derivatives are those of a pole.
    fn least(&self) -> f64 {
        AT_REST * self.diagonal
    }

    /// The direction whose derivative vanishes at some parameters.
    fn pole_at(&self, p: Parameters) -> Option<usize> {
        let d = self.surface.jet(p[0], p[1], 1).d;
        [d[1][0], d[0][1]].iter().position(|d| d.norm() < self.least())
    }

    /// The period in u or v.
    pub fn period(&self, direction: usize) -> Option<f64> {
        self.periods[direction]
    }

    /// The unit normal of the surface, if it has one there.
    pub fn normal(&self, [u, v]: Parameters) -> Option<Vector> {
        self.surface.jet(u, v, 1).normal()
    }

    /// The derivatives along both parameters.
    pub fn derivatives(&self, [u, v]: Parameters) -> [Vector; 2] {
        let d = self.surface.jet(u, v, 1).d;
        [d[1][0], d[0][1]]
    }

    /// Parameters moved by multiples of the periods to be nearest to others.
    pub fn unwrapped(&self, p: Parameters, near: Parameters) -> Parameters {
        [0, 1].map(|i| match self.periods[i] {
            Some(period) => p[i] + period * ((near[i] - p[i]) / period).round(),
            None => p[i],
        })
    }

    /// The parameters of the nearest point of the whole surface, inside the domain of a spline if
    /// one there is about as near: across a slit, an extrapolated surface meets its other side.
    fn anywhere(&self, point: &Point) -> Parameters {
        let foot = nearest_on_surface(self.surface, point);
        let domain = self.surface.domain();
        if !is_beyond(domain, foot.parameters, NEARLY) {
            return foot.parameters;
        }
        let inside = nearest_within(self.surface, domain, point);
        let off = |found: Point| (found - point).norm();
        let is_near = off(self.surface.point(inside)) <= off(foot.point) + NEARLY * self.diagonal;
        if is_near { inside } else { foot.parameters }
    }

    /// The parameters of the nearest point inside the domain of a spline, if a foot is far outside
    /// of it and no nearer: extrapolated surfaces turn back.
    fn within(&self, point: &Point, guess: Parameters, foot: &SurfaceFoot) -> Option<Parameters> {
        let domain = self.surface.domain();
        if !is_beyond(domain, foot.parameters, BEYOND) {
            return None;
        }
        let found = project_within(self.surface, domain, point, guess);
        let off = (self.surface.point(found) - point).norm();
        (off <= (foot.point - point).norm().max(BESIDE * self.diagonal)).then_some(found)
    }

    /// The distance of a point from the whole surface.
    fn distance(&self, point: &Point) -> f64 {
        (nearest_on_surface(self.surface, point).point - point).norm()
    }

    /// The parameters of the nearest point near a guess.
    pub fn near(&self, point: &Point, guess: Parameters) -> Parameters {
        let Surface::Round { axes, profile, .. } = self.surface else {
            let found = project_to_surface(self.surface, point, guess);
            return self.within(point, guess, &found).unwrap_or(found.parameters);
        };
        // Some surfaces cross themselves on their axis: the nearest point may be on the other side.
        let crosses = match *profile {
            Profile::Line { slope: [a, _], .. } => a != 0.0,
            Profile::Circle { major, minor } => 0.0 < major && major < minor,
        };
        let [x, y, _] = self.surface.local(point).expect("a surface of revolution");
        let found = if crosses {
            project_to_surface(self.surface, point, guess).parameters
        } else {
            nearest_on_surface(self.surface, point).parameters
        };
        let mut found = self.unwrapped(found, guess);
        // At a pole every angle is right.
        if x.hypot(y) * axes[0].norm() < self.least() {
            found[0] = guess[0];
        }
        found
    }
}

/// Whether parameters are outside of a domain by more than a fraction of it.
fn is_beyond(domain: Domain, at: Parameters, room: f64) -> bool {
    let is_one = |([low, high], at): ([f64; 2], f64)| (at - high).max(low - at) > room * (high - low);
    domain.into_iter().zip(at).any(|(range, at)| range.is_some_and(|range| is_one((range, at))))
}

#[cfg(test)]
pub(crate) mod tests {
    use crate::{Surface, Vector, surface::Profile};

    /// A torus of radii 2 and 1 around the z axis.
    pub(crate) fn torus() -> Surface {
        let axes = [Vector::x(), Vector::y(), Vector::z()];
        let profile = Profile::Circle { major: 2.0, minor: 1.0 };
        Surface::Round { origin: Vector::zeros(), axes, profile }
    }
}
