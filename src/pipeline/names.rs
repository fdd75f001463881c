//! Numbers and names of bodies and boundaries.

use crate::mesh::Names;
use csg::{Features, Geometry};

/// The numbers and names that the writers use: a body's material, else the name of its solid.
pub fn names(geometry: &Geometry, features: &Features) -> Names {
    let body = |body: &csg::Body| (body.number, body.material.clone().unwrap_or_else(|| body.name.clone()));
    let patch = |patch: &csg::Patch| (patch.bc, patch.name.clone());
    Names {
        bodies: geometry.bodies.iter().map(body).collect(),
        patches: features.patches.iter().map(patch).collect(),
    }
}
