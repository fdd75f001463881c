//! Meshing of a geometry on one rank: surface meshes, facets, tets, improvement of tets.

pub mod facets;
mod half_face;
pub mod improve;
pub mod model;
pub mod smoothness;
pub mod surface;
pub mod volume;
