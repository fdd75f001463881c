//! Corners, curves, patches and bodies of a file.

use crate::build::build;
use crate::curve::Curve;
use crate::read::read;
use crate::step::Unit;
use crate::surface::Surface;
use crate::{BrepError, Point};

/// Vertices further from their curve and edges further from their surface than this (fraction of
/// the size of the model) do not belong to it.
pub(crate) const AWAY: f64 = 2e-3;

/// A corner: a vertex of the file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corner {
    /// Its place.
    pub point: Point,
    /// The largest distance of the ends of its curves (length).
    pub tolerance: f64,
}

/// A curve: an edge of the file that is not degenerate.
#[derive(Clone, Debug, PartialEq)]
pub struct EdgeCurve {
    /// The curve without ends.
    pub curve: Curve<3>,
    /// The parameters of both ends.
    pub range: [f64; 2],
    /// The corners at both ends, as indices.
    pub ends: [usize; 2],
    /// The largest distance from the patches beside it (length).
    pub tolerance: f64,
}

impl EdgeCurve {
    /// The parameters between which the curve is smooth, from end to end.
    pub(crate) fn stops(&self) -> Vec<f64> {
        let mut stops = vec![self.range[0]];
        stops.extend(self.curve.breaks(self.range));
        stops.push(self.range[1]);
        stops
    }
}

/// What a side of a patch lies on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum On {
    /// A curve, as an index.
    Curve(usize),
    /// A corner, as an index: the side has no length.
    Corner(usize),
}

/// A side of a patch.
#[derive(Clone, Debug, PartialEq)]
pub struct Fin {
    /// The curve or corner.
    pub on: On,
    /// The curve in the parameters of the surface; `None` on some planes.
    pub curve: Option<Curve<2>>,
    /// The parameters of its ends, which belong to those of the curve in space.
    pub range: [f64; 2],
    /// Whether the loop runs along the curve.
    pub is_forward: bool,
}

impl Fin {
    /// The parameter of its own curve that belongs to one of the curve in space with this range.
    pub fn parameter(&self, t: f64, [low, high]: [f64; 2]) -> f64 {
        if self.range == [low, high] {
            return t;
        }
        self.range[0] + (t - low) / (high - low) * (self.range[1] - self.range[0])
    }
}

/// A patch: a face of the file at one place.
#[derive(Clone, Debug, PartialEq)]
pub struct Patch {
    /// Its surface without bounds.
    pub surface: Surface,
    /// Its loops; each side starts where the last one ends.
    pub loops: Vec<Vec<Fin>>,
    /// The bodies behind and in front of it, along the cross product of the derivatives in u and v.
    pub bodies: [Option<usize>; 2],
}

/// The content of a file that bounds solids.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Model {
    /// The corners.
    pub corners: Vec<Corner>,
    /// The curves.
    pub curves: Vec<EdgeCurve>,
    /// The patches, in the order in which the solids use them.
    pub patches: Vec<Patch>,
    /// The number of bodies.
    pub bodies: usize,
    /// Whether the bodies were found as those that faces enclose: one whose faces point inside is
    /// a void of the body around it.
    pub from_faces: bool,
    /// The names that the file gives to bodies; empty if it gives none.
    pub body_names: Vec<Option<String>>,
    /// The names that the file gives to patches; empty if it gives none.
    pub patch_names: Vec<Option<String>>,
    /// The unit of lengths in metres, if the file has one.
    pub metres: Option<f64>,
    /// What was left out, one sentence each.
    pub notes: Vec<String>,
}

impl Model {
    /// Reads a BREP file.
    ///
    /// # Errors
    /// - [`BrepError::Syntax`] with the line if the text is not as the format prescribes,
    /// - [`BrepError::NoSolid`] if there is no solid,
    /// - [`BrepError::Face`] and [`BrepError::Edge`] for shapes without geometry, and faces that
    ///   solids use in a way that cannot be meshed.
    pub fn read(text: &[u8]) -> Result<Self, BrepError> {
        build(&read(text)?)
    }

    /// Reads a STEP file.
    ///
    /// Faces that several solids repeat become one. Coordinates are in `unit`.
    ///
    /// # Errors
    /// As for BREP files; [`BrepError::OtherFiles`] if parts of an assembly are in other files.
    pub fn read_step(text: &[u8], unit: Unit) -> Result<Self, BrepError> {
        Self::read_step_with(text, unit, &|_| Err(std::io::ErrorKind::NotFound.into()))
    }

    /// Reads a STEP file whose parts may be in other files, which `other` reads by the names that
    /// they have in this file.
    ///
    /// # Errors
    /// As for one file; [`BrepError::OtherFiles`] with all files that cannot be read, and
    /// [`BrepError::Part`] for errors in one of them.
    pub fn read_step_with(
        text: &[u8],
        unit: Unit,
        other: &dyn Fn(&str) -> std::io::Result<Vec<u8>>,
    ) -> Result<Self, BrepError> {
        crate::step::read(text, unit, other)
    }
}
