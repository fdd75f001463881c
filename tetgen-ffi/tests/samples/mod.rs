//! The hard surfaces of tetmill's own tests, which name what they use through this module.

#[path = "../../../src/volume/samples/hard.rs"]
#[allow(dead_code)]
pub mod hard;
#[path = "../../../src/volume/samples/soup.rs"]
#[allow(dead_code)]
pub mod soup;
#[path = "../../../src/volume/samples/volumes.rs"]
pub mod volumes;

use csg::BodyId;
pub use soup::{INSIDE, Soup};
use tetmill::kernel::random::Random;
use tetmill::mesh::TET_FACES;
use tetmill::volume::{ClosedSurface, SurfaceFaults};
use tetmill::{Point, Vector};
