//! Numbers and names of bodies and boundaries.

use crate::mesh::{Label, Names};
use csg::{Features, Geometry};

/// The numbers and names that the writers use: a body's material, else the name of its solid.
pub fn names(geometry: &Geometry, features: &Features) -> Names {
    let body = |body: &csg::Body| {
        Label::new(body.number, body.material.clone().unwrap_or_else(|| body.name.clone()))
    };
    let patch = |patch: &csg::Patch| Label::new(patch.bc, patch.name.clone().unwrap_or_default());
    Names {
        bodies: geometry.bodies.iter().map(body).collect(),
        patches: features.patches.iter().map(patch).collect(),
    }
}
