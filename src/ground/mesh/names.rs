//! Numbers and names of bodies and boundaries.

use crate::ground::error::{ErrorKind, HasKind};
use csg::language::did_you_mean;
use csg::{BodyId, PatchId};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

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

/// No body or boundary has the name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is no {what} `{name}`{}", advice(.name, .known))]
pub struct UnknownName {
    /// `body` or `boundary`.
    pub what: &'static str,
    /// The requested name.
    pub name: String,
    /// The existing names, sorted.
    pub known: Vec<String>,
}

impl HasKind for UnknownName {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Input
    }
}

/// A message lists at most this many names.
const MOST_LISTED: usize = 20;

fn advice(name: &str, known: &[String]) -> String {
    if known.is_empty() {
        return ": none has a name".into();
    }
    let suggestion = match did_you_mean(name, known.iter().map(String::as_str)) {
        empty if empty.is_empty() => String::new(),
        question => format!("; {question}"),
    };
    let quoted = |name: &String| format!("`{name}`");
    let mut list: Vec<String> = known.iter().take(MOST_LISTED).map(quoted).collect();
    if known.len() > MOST_LISTED {
        list.push(format!("and {} others", known.len() - MOST_LISTED));
    }
    format!("{suggestion} (the names are {})", list.join(", "))
}

impl Names {
    /// The patches with this name, ascending: by their main name or a further one.
    ///
    /// ```
    /// use tetmill::Geometry;
    /// let part = Geometry::from_text(
    ///     "algebraic3d solid ball = sphere (0, 0, 0; 1) -bcname=wall; tlo ball;",
    /// )?;
    /// assert_eq!(part.names().patches_named("wall")?.len(), 1);
    /// let error = part.names().patches_named("wal").unwrap_err();
    /// assert!(error.to_string().contains("did you mean `wall`?"));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// If no patch has the name. So the list is never empty.
    pub fn patches_named(&self, name: &str) -> Result<Vec<PatchId>, UnknownName> {
        Ok(positions(&self.patches, name, "boundary")?.into_iter().map(PatchId).collect())
    }

    /// The bodies with this name, ascending: by their main name or a further one.
    ///
    /// # Errors
    /// If no body has the name. So the list is never empty.
    pub fn bodies_named(&self, name: &str) -> Result<Vec<BodyId>, UnknownName> {
        Ok(positions(&self.bodies, name, "body")?.into_iter().map(BodyId).collect())
    }
}

/// The numbers of each name, by name.
pub(crate) fn numbers_by_name(labels: &[Label]) -> BTreeMap<&str, BTreeSet<u32>> {
    let mut numbers: BTreeMap<&str, BTreeSet<u32>> = BTreeMap::new();
    for label in labels {
        for name in &label.names {
            numbers.entry(name).or_default().insert(label.number);
        }
    }
    numbers
}

/// The positions of the labels with this name.
fn positions(labels: &[Label], name: &str, what: &'static str) -> Result<Vec<u32>, UnknownName> {
    let with_name = (0..).zip(labels).filter(|(_, label)| label.names.iter().any(|other| other == name));
    let found: Vec<u32> = with_name.map(|(position, _)| position).collect();
    if !found.is_empty() {
        return Ok(found);
    }
    let mut known: Vec<String> = labels.iter().flat_map(|label| label.names.iter().cloned()).collect();
    known.sort_unstable();
    known.dedup();
    Err(UnknownName { what, name: name.to_owned(), known })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn several(number: u32, names: &[&str]) -> Label {
        Label { number, names: names.iter().map(ToString::to_string).collect() }
    }

    #[test]
    fn a_name_has_all_patches_that_are_labelled_with_it() {
        let patches = vec![several(4, &["wall"]), several(4, &["inlet", "wall"]), Label::unnamed(7)];
        let names = Names { bodies: vec![Label::new(1, "air")], patches };
        assert_eq!(names.patches_named("wall"), Ok(vec![PatchId(0), PatchId(1)]));
        assert_eq!(names.patches_named("inlet"), Ok(vec![PatchId(1)]));
        assert_eq!(names.bodies_named("air"), Ok(vec![BodyId(0)]));
    }

    #[test]
    fn an_unknown_name_is_an_error_that_lists_the_others() {
        let patches = vec![several(1, &["wall"]), several(2, &["inlet", "wall"])];
        let names = Names { bodies: Vec::new(), patches };
        let message = |name| names.patches_named(name).unwrap_err().to_string();
        assert_eq!(
            message("Wal"),
            "there is no boundary `Wal`; did you mean `wall`? (the names are `inlet`, `wall`)"
        );
        assert_eq!(message("symmetry"), "there is no boundary `symmetry` (the names are `inlet`, `wall`)");
        assert_eq!(
            names.bodies_named("air").unwrap_err().to_string(),
            "there is no body `air`: none has a name"
        );
        let many =
            Names { bodies: Vec::new(), patches: (1..=22).map(|n| Label::new(n, n.to_string())).collect() };
        assert!(many.patches_named("wall").unwrap_err().to_string().ends_with("and 2 others)"));
    }
}
