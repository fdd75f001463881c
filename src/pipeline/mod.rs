//! The stages in order: the one place that knows all of them.

pub mod coarse;
pub mod decompose;
mod estimate;
mod facet_model;
pub mod generate;
pub mod input;
pub mod mend;
pub mod model;
pub mod moved;
pub mod names;
pub mod part;
pub mod room;
mod skins;
pub mod target;
pub mod wanted;

pub use coarse::{CoarseError, CoarseMesh, CoarseReport, CoarseSettings};
pub use decompose::CutSettings;
pub use facet_model::FacetSolid;
pub use generate::{GenerateSettings, Generated, Method, generate};
pub use model::{CsgModel, Entities, GivenMesh, Model};
pub use moved::{Repartitioned, repartition};
pub use names::names;
pub use part::Part;
pub use room::Disk;
pub use skins::Refused;
pub use wanted::Wanted;
