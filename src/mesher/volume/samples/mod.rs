//! Closed surfaces for tests, and the check that a mesh fills one.
//!
//! The files here import everything through this module, so that the tests of `tetgen-ffi` can
//! include them too.

mod check;
mod hard;
mod soup;
mod volumes;

pub(super) use check::check_fills;
pub(super) use hard::*;
pub(super) use soup::{INSIDE, Soup};

use super::{ClosedSurface, SurfaceFaults, VolumeMesh};
use crate::ground::kernel::predicates::{Sign, orient3d};
use crate::ground::kernel::random::Random;
use crate::ground::mesh::TET_FACES;
use crate::{Point, Vector};
use csg::BodyId;
