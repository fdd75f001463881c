//! Spheres turned so that no curve passes through a pole.
//!
//! A curve through a pole has no place in the parameters, and the axis of a sphere in a file is
//! often in the plane that cuts it.

use super::super::Shapes;
use crate::nearest::nearest_on_curve;
use crate::surface::Profile;
use crate::{EdgeCurve, Point, Surface};
use nalgebra::{Rotation3, Vector3};

/// Curves closer to a pole than this (fraction of the radius) are too close.
const TOO_CLOSE: f64 = 0.1;
/// Turns that are tried, by these angles around two axes (radians).
const TURNS: [[f64; 2]; 6] = [[0.5, 0.7], [1.1, 0.3], [0.8, 1.9], [1.4, 2.5], [0.3, 1.3], [0.9, 3.7]];

impl Shapes {
    /// Turns the surfaces of the spheres that curves divide near their poles.
    pub(super) fn turn_spheres(&mut self) {
        for number in 0..self.faces.len() {
            let face = &self.faces[number];
            let Surface::Round { origin, axes, profile: profile @ Profile::Circle { major: 0.0, minor } } =
                face.surface
            else {
                continue;
            };
            let radius = minor.abs() * axes[2].norm();
            // Seams are left out when the face is divided.
            let once = self.curves_used_once(number);
            let curves: Vec<&EdgeCurve> =
                once.iter().chain(&face.inner).map(|&curve| &self.curves[curve]).collect();
            let clearance = |axes: &[Vector3<f64>; 3]| {
                let pole = |sign: f64| Point::from(origin + axes[2] * (sign * minor));
                let away = |pole: &Point, edge: &&EdgeCurve| {
                    (nearest_on_curve(&edge.curve, pole).point - pole).norm() / radius
                };
                let poles = [pole(1.0), pole(-1.0)];
                let all = poles.iter().flat_map(|pole| curves.iter().map(move |edge| away(pole, edge)));
                all.fold(f64::INFINITY, f64::min)
            };
            if face.inner.is_empty() || clearance(&axes) > TOO_CLOSE {
                continue;
            }
            let turned = TURNS.map(|[a, b]| {
                let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), b)
                    * Rotation3::from_axis_angle(&Vector3::x_axis(), a);
                axes.map(|axis| turn * axis)
            });
            let best = turned.into_iter().max_by(|a, b| clearance(a).total_cmp(&clearance(b)));
            if let Some(axes) = best {
                self.faces[number].surface = Surface::Round { origin, axes, profile };
            }
        }
    }
}
