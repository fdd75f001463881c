//! Errors of the library as exceptions, with their fields.

use csg::Point;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::fmt;
use tetmill::Error;
use tetmill::comm::CommError;
use tetmill::error::{ErrorKind, FeatureError, HasKind, InputError, PartitionError, RequestError};

/// Why a run ends: an exception of Python, or an error of the library.
pub enum Failure {
    Exception(PyErr),
    Error(Error),
}

impl Failure {
    /// The exception that tells the caller.
    pub fn raise(self, py: Python<'_>) -> PyErr {
        match self {
            Self::Exception(exception) => exception,
            Self::Error(error) => exception(py, &error),
        }
    }
}

impl From<PyErr> for Failure {
    fn from(exception: PyErr) -> Self {
        Self::Exception(exception)
    }
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        Self::Error(error)
    }
}

impl From<CommError> for Failure {
    fn from(error: CommError) -> Self {
        Self::Error(error.into())
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Exception(exception) => exception.fmt(f),
            Self::Error(error) => error.fmt(f),
        }
    }
}

/// So that ranks can agree on it.
impl HasKind for Failure {
    fn kind(&self) -> ErrorKind {
        match self {
            Self::Exception(_) => ErrorKind::Input,
            Self::Error(error) => error.kind(),
        }
    }

    fn is_elsewhere(&self) -> bool {
        matches!(self, Self::Error(error) if error.is_elsewhere())
    }
}

/// The exception of an error: a `tetmill.Error` with the fields that are known.
pub fn exception(py: Python<'_>, error: &Error) -> PyErr {
    construct(py, error).unwrap_or_else(|failure| failure)
}

fn construct(py: Python<'_>, error: &Error) -> PyResult<PyErr> {
    let fields = PyDict::new(py);
    if let Some(hint) = hint(error) {
        fields.set_item("hint", hint)?;
    }
    if let Some(point) = place(error) {
        fields.set_item("place", (point.x, point.y, point.z))?;
    }
    match error {
        Error::Language(diagnostics) => {
            if let Some(first) = diagnostics.errors().next() {
                fields.set_item("file", &first.file)?;
                fields.set_item("line", first.span.line)?;
                fields.set_item("column", first.span.column)?;
                fields.set_item("hint", first.help.as_deref())?;
            }
        }
        Error::Features { path: Some(path), .. } | Error::Facets { path: Some(path), .. } => {
            fields.set_item("file", path)?;
        }
        _ => {}
    }
    let kind = match error.kind() {
        ErrorKind::Input => "input",
        ErrorKind::NoMesh => "no mesh",
        ErrorKind::Resources => "resources",
        ErrorKind::Rank => "rank",
        ErrorKind::Cancelled => "cancelled",
    };
    let make = py.import("tetmill._errors")?.getattr("error_of_kind")?;
    Ok(PyErr::from_value(make.call1((kind, message(error), fields))?))
}

/// The text, with options by their names in Python.
fn message(error: &Error) -> String {
    match error {
        Error::Request(RequestError::Option { name, value, allowed }) => {
            format!("{} cannot be {value}: possible are {allowed}", keyword(name))
        }
        _ => error.to_string(),
    }
}

/// The keyword argument that sets an option of the library.
fn keyword(name: &str) -> &str {
    match name {
        "max_size" => "maxh",
        "min_size" => "minh",
        "coarse_tets" => "coarse",
        _ => name,
    }
}

/// What to do, if arguments of this package help.
fn hint(error: &Error) -> Option<String> {
    match error {
        Error::Partition(PartitionError::MoreParts { parts, .. }) => {
            Some(format!("coarse={parts} makes enough coarse tets"))
        }
        _ => None,
    }
}

/// Where the input is wrong.
fn place(error: &Error) -> Option<Point> {
    match error {
        Error::Features { error, .. } => match &**error {
            FeatureError::Overlap { place, .. }
            | FeatureError::Tangent { place, .. }
            | FeatureError::Cusp { place, .. }
            | FeatureError::LooseCurve { place, .. }
            | FeatureError::TooIntricate { place, .. }
            | FeatureError::PointOutside { place, .. }
            | FeatureError::NotPeriodic { place, .. } => Some(place.0),
            _ => None,
        },
        Error::Input(InputError::Overlap { place, .. }) => Some(*place),
        Error::Input(InputError::Inverted { corner, .. }) => Some(*corner),
        _ => None,
    }
}
