//! The hard surfaces of tetmill's own tests and the check of a mesh, which name what they use through this module.

#[path = "../../src/volume/samples/check.rs"]
mod check;
#[path = "../../src/volume/samples/hard.rs"]
#[allow(dead_code)]
mod hard;
#[path = "../../src/volume/samples/soup.rs"]
#[allow(dead_code)]
mod soup;
#[path = "../../src/volume/samples/volumes.rs"]
mod volumes;

pub use check::check_fills;
pub use hard::*;
pub use soup::{INSIDE, Soup};

use csg::BodyId;
use tetmill::kernel::predicates::{Sign, orient3d};
use tetmill::kernel::random::Random;
use tetmill::mesh::TET_FACES;
use tetmill::volume::{ClosedSurface, SurfaceFaults, VolumeMesh};
use tetmill::{Point, Vector};
