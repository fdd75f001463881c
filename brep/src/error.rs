//! Why a file cannot be read or meshed.

use crate::Point;

/// A BREP file that cannot be read or whose shapes cannot be meshed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BrepError {
    /// The text is not as the format prescribes.
    #[error("line {line}: {what}")]
    Syntax {
        /// The line, from 1.
        line: usize,
        /// What is wrong.
        what: String,
    },
    /// A face that cannot be meshed.
    #[error("face {face}: {what}{}", at(.place))]
    Face {
        /// The number of the face in the order of the file, from 1.
        face: usize,
        /// What is wrong.
        what: String,
        /// A place there.
        place: Option<Point>,
    },
    /// An edge that cannot be meshed.
    #[error("edge {edge}: {what}{}", at(.place))]
    Edge {
        /// The number of the edge in the order of the file, from 1.
        edge: usize,
        /// What is wrong.
        what: String,
        /// A place there.
        place: Option<Point>,
    },
    /// A solid that cannot be meshed.
    #[error("solid {solid}: {what}{}", at(.place))]
    Solid {
        /// The number of the solid in the order of the file, from 1.
        solid: usize,
        /// What is wrong.
        what: String,
        /// A place there.
        place: Option<Point>,
    },
    /// The file has no solid.
    #[error("the file has no solid, only {faces} faces and {edges} edges{}", no_solid(*.faces, .open))]
    NoSolid {
        /// Its faces.
        faces: usize,
        /// Its edges, wires and vertices that bound no solid.
        edges: usize,
        /// A place on an edge that does not have two faces, so that they enclose nothing.
        open: Option<Point>,
    },
    /// Parts of an assembly are in other files, which cannot be read.
    #[error(
        "parts of it are in other files, which are not beside it: {0}: put them there, or export the assembly as one file"
    )]
    OtherFiles(String),
    /// An error in a file with a part of an assembly.
    #[error("in its part {file}: {error}")]
    Part {
        /// The name of the file.
        file: String,
        /// What is wrong there.
        error: Box<BrepError>,
    },
}

/// What to do about a file without solids.
fn no_solid(faces: usize, open: &Option<Point>) -> String {
    match open {
        Some(_) => {
            let open = at(open);
            format!(
                "; the faces enclose none, because not two of them meet at an edge{open}: sew them to a solid in the CAD program"
            )
        }
        None if faces > 0 => ": sew its faces to a solid in the CAD program".to_owned(),
        None => ": export the part as a solid".to_owned(),
    }
}

fn at(place: &Option<Point>) -> String {
    place.map_or(String::new(), |p| format!(" near ({}, {}, {})", p.x, p.y, p.z))
}

impl BrepError {
    /// The error in a file with a part of an assembly; it names the innermost file.
    pub(crate) fn in_part(self, file: &str) -> Self {
        match self {
            Self::Part { .. } => self,
            error => Self::Part { file: file.to_owned(), error: Box::new(error) },
        }
    }

    pub(crate) fn face(face: usize, what: impl Into<String>, place: Option<Point>) -> Self {
        Self::Face { face: face + 1, what: what.into(), place }
    }

    pub(crate) fn edge(edge: usize, what: impl Into<String>, place: Option<Point>) -> Self {
        Self::Edge { edge: edge + 1, what: what.into(), place }
    }

    pub(crate) fn solid(solid: usize, what: impl Into<String>, place: Option<Point>) -> Self {
        Self::Solid { solid: solid + 1, what: what.into(), place }
    }
}
