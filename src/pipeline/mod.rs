//! The pipeline from input to checked mesh: the only module that knows all stages.

pub mod coarse;
pub mod coarse_error;
pub mod coarse_mesh;
pub mod decompose;
pub mod error;
mod estimate;
mod expected;
pub(crate) mod facet_model;
mod fill;
mod generate;
mod geometry;
pub mod input;
pub mod inspect;
pub mod mend;
mod mesher;
pub mod model;
pub mod moved;
pub mod names;
mod options;
pub mod part;
#[cfg(test)]
mod periodic_tests;
pub mod quality;
pub mod result;
pub mod retries;
mod room;
pub mod room_error;
pub mod settings;
mod skins;
pub mod target;
mod verify;
pub mod wanted;

pub use crate::mesher::facets::{SharpPlace, SharpPlaces};
pub use crate::mesher::surface::closeness::{FlatPlace, ThinRegions};
pub use coarse::CoarseSettings;
pub use coarse_error::CoarseError;
pub use coarse_mesh::{CoarseReport, CutCusp};
pub use facet_model::FacetSolid;
pub use generate::generate;
pub use geometry::Geometry;
pub use mesher::Mesher;
pub use model::Entities;
pub use moved::{Repartitioned, repartition};
pub use names::names;
pub use result::{CoarseResult, Generated, Hierarchy, Level, Refused};
pub use settings::{CutSettings, Disk, GenerateSettings, InputSettings, Method, Wanted};
