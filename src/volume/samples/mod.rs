//! Closed surfaces for tests, and the check that a mesh fills one.
//!
//! The files here name what they use through this module, so that the tests of `tetgen-ffi` can include them too.

mod check;
mod hard;
mod soup;
mod volumes;

pub(super) use check::check_fills;
pub(super) use hard::*;
pub(super) use soup::{INSIDE, Soup};

use super::{ClosedSurface, SurfaceFaults, VolumeMesh};
use crate::kernel::predicates::{Sign, orient3d};
use crate::kernel::random::Random;
use crate::mesh::TET_FACES;
use crate::{Point, Vector};
use csg::BodyId;
