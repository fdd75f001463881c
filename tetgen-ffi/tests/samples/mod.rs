//! The hard surfaces of tetmill's unit tests, which import through this module.

#[path = "../../../src/mesher/volume/samples/hard.rs"]
#[allow(dead_code)]
pub mod hard;
#[path = "../../../src/mesher/volume/samples/soup.rs"]
#[allow(dead_code)]
pub mod soup;
#[path = "../../../src/mesher/volume/samples/volumes.rs"]
pub mod volumes;

use csg::BodyId;
pub use soup::{INSIDE, Soup};
use tetmill::internals::Random;
use tetmill::internals::volume::{ClosedSurface, SurfaceFaults};
use tetmill::mesh::TET_FACES;
use tetmill::{Point, Vector};
