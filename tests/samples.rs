//! The hard surfaces of the volume mesher's unit tests, and its check of a filled surface. They
//! import through this module.

#[path = "../src/mesher/volume/samples/check.rs"]
mod check;
#[path = "../src/mesher/volume/samples/hard.rs"]
#[allow(dead_code)]
mod hard;
#[path = "../src/mesher/volume/samples/soup.rs"]
#[allow(dead_code)]
mod soup;
#[path = "../src/mesher/volume/samples/volumes.rs"]
mod volumes;

pub use check::check_fills;
pub use hard::{graded_ball, needle_cone, needle_tube, skin_of};
pub use soup::{INSIDE, Soup};

use csg::BodyId;
use tetmill::internals::volume::{ClosedSurface, SurfaceFaults, VolumeMesh};
use tetmill::internals::{Random, Sign, orient3d};
use tetmill::mesh::TET_FACES;
use tetmill::{Point, Vector};
