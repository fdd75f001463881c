//! Numbers and names of bodies and boundaries.

use crate::ground::mesh::{Label, Names};
use csg::{Features, Geometry};

/// The numbers and names in output files: a body has the name of its material, else of its solid.
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
