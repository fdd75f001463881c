//! The hard surfaces of the volume mesher's own tests, and its check of a filled surface; they name what they use through this module.

#[path = "../src/volume/samples/check.rs"]
mod check;
#[path = "../src/volume/samples/hard.rs"]
#[allow(dead_code)]
mod hard;
#[path = "../src/volume/samples/soup.rs"]
#[allow(dead_code)]
mod soup;
#[path = "../src/volume/samples/volumes.rs"]
mod volumes;

pub use check::check_fills;
pub use hard::{graded_ball, needle_cone, needle_tube, skin_of};
pub use soup::{INSIDE, Soup};

use csg::BodyId;
use tetmill::kernel::predicates::{Sign, orient3d};
use tetmill::kernel::random::Random;
use tetmill::mesh::TET_FACES;
use tetmill::volume::{ClosedSurface, SurfaceFaults, VolumeMesh};
use tetmill::{Point, Vector};
