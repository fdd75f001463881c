//! Numbers and names of bodies and boundaries.

use serde::{Deserialize, Serialize};

/// The number of a body or boundary, and its names.
///
/// The first name is the main one. Further names are groups that the body or boundary also belongs
/// to, such as several physical groups of a Gmsh file. Formats that allow unnamed boundaries keep
/// them unnamed.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Label {
    /// The number, from 1.
    pub number: u32,
    /// The names, none of them empty, each once.
    pub names: Vec<String>,
}

impl Label {
    /// A label with one name; unnamed if `name` is empty.
    pub fn new(number: u32, name: impl Into<String>) -> Self {
        let name = name.into();
        Self { number, names: if name.is_empty() { Vec::new() } else { vec![name] } }
    }

    /// A label without names.
    pub fn unnamed(number: u32) -> Self {
        Self { number, names: Vec::new() }
    }

    /// The main name, if any.
    pub fn name(&self) -> Option<&str> {
        self.names.first().map(String::as_str)
    }
}

/// Numbers and names of bodies and boundaries, as the formats write them.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Names {
    /// By [`BodyId`](csg::BodyId): the body's number and name (material, or the name of its solid).
    pub bodies: Vec<Label>,
    /// By [`PatchId`](csg::PatchId): boundary number and names.
    pub patches: Vec<Label>,
}
