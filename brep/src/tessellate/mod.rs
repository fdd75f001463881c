//! Triangulation of all patches, so that neighbours fit.
//!
//! Each curve is divided once. Each patch is triangulated in its parameters, scaled to lengths, by
//! a constrained Delaunay triangulation of its loops, and refined at the midpoints of inner edges.
//! Curves, patches and the errors of their triangles are computed on all threads; the result does
//! not depend on the number of threads.

mod chain;
mod curves;
mod face;
mod frame;
mod measure;
mod orient;
mod outline;
mod overlap;
mod reuse;

pub(crate) use curves::diagonal;
pub use measure::{area, check, volume};
pub(crate) use orient::Shell;

use crate::tips::Cut;
use crate::{BrepError, EdgeCurve, Model, Point};
use rayon::prelude::*;
use reuse::Known;

/// How fine a tessellation is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// The largest distance between a surface and its triangles (fraction of the box's diagonal).
    pub chord: f64,
    /// The largest angle between the normals, or tangents, at both ends of an edge (radians).
    pub angle: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { chord: 1e-3, angle: 0.2 }
    }
}

/// A triangle of a patch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triangle {
    /// Its corners, counterclockwise seen from where the normal of the patch points.
    pub vertices: [u32; 3],
    /// The patch.
    pub patch: u32,
    /// The parameters of its corners; a vertex on a seam has several.
    pub parameters: [[f64; 2]; 3],
}

/// Triangles of all patches of a model.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tessellation {
    /// The vertices: corners in the order of the model, then those on curves, then others.
    pub points: Vec<Point>,
    /// The triangles, patch by patch.
    pub triangles: Vec<Triangle>,
    /// The vertices along each curve, with their parameters.
    pub lines: Vec<Vec<(u32, f64)>>,
    /// The largest distance between a curve and its place on a patch (length).
    pub gap: f64,
    /// The same for each patch.
    gaps: Vec<f64>,
}

/// How often curves are divided, more finely each time because loops of a patch cross or triangles
/// are folded.
const MOST_RETRIES: usize = 6;

/// How often of these, at most, because of folded triangles: at kinks no division unfolds them.
const UNFOLDING_RETRIES: usize = 3;

/// Curves are not divided into more points in all than this to try again, ...
const MOST_POINTS: usize = 30_000;
/// ... unless the first division has so many times fewer.
const MOST_GROWTH: usize = 4;

impl Tessellation {
    /// Triangulates all patches.
    ///
    /// # Errors
    /// [`BrepError::Face`] and [`BrepError::Edge`] with a place if curves and surfaces do not fit
    /// each other or loops cross; [`BrepError::Solid`] if a body is not closed.
    pub fn of(model: &mut Model, settings: &Settings) -> Result<Self, BrepError> {
        let (out, shells) = Self::of_overlapping(model, settings)?;
        overlap::check(model, &shells)?;
        Ok(out)
    }

    /// The same for solids that may overlap, with the shells of each solid.
    pub(crate) fn of_overlapping(
        model: &mut Model,
        settings: &Settings,
    ) -> Result<(Self, Vec<Vec<Shell>>), BrepError> {
        let divided = vec![None; model.curves.len()];
        Self::with(model, settings, divided, None)
    }

    /// The same for a model of which tips were cut off. Patches without a tip or a divided curve
    /// keep the triangles of `before`, the tessellation of the model without cuts.
    ///
    /// # Errors
    /// The same.
    pub fn of_cut(cut: &mut Cut, before: &Self, settings: &Settings) -> Result<Self, BrepError> {
        // Parts of curves are divided anew, so that no vertex is close to a cut.
        let divided = |(curve, of): (&EdgeCurve, &Option<usize>)| {
            let line = &before.lines[(*of)?];
            let is_whole = [line[0].1, line[line.len() - 1].1] == curve.range;
            is_whole.then(|| line.iter().map(|on| on.1).collect())
        };
        let divided = cut.model.curves.iter().zip(&cut.parts_of).map(divided).collect();
        let (out, shells) = Self::with(&mut cut.model, settings, divided, Some(before))?;
        overlap::check(&cut.model, &shells)?;
        Ok(out)
    }

    /// Triangulates all patches, with curves `divided` at known parameters at first, and triangles
    /// of the tessellation `before` where these are the same.
    fn with(
        model: &mut Model,
        settings: &Settings,
        mut divided: Vec<Option<Vec<f64>>>,
        before: Option<&Self>,
    ) -> Result<(Self, Vec<Vec<Shell>>), BrepError> {
        let diagonal = diagonal(&model.corners, &model.curves, Vec::new());
        let chord = settings.chord * diagonal;
        let mut tolerances = face::Tolerances { chord, angle: settings.angle, diagonal, refuses_folds: true };
        let mut chords = vec![tolerances.chord; model.curves.len()];
        let (mut failed, mut most_points) = (None, 0);
        let mut last: Option<Self> = None;
        for retry in 0..MOST_RETRIES {
            tolerances.refuses_folds = retry < UNFOLDING_RETRIES;
            let mut out = Self::of_curves(model, &divided, &chords, settings.angle, diagonal)?;
            if retry == 0 {
                most_points = MOST_POINTS.max(MOST_GROWTH * out.points.len());
            } else if out.points.len() > most_points {
                break;
            }
            let mut conflicts = Vec::new();
            let known = last.as_ref().or(before).map(Known::new);
            let of_patch = |patch| match known.as_ref().and_then(|known| known.made(model, patch, &out)) {
                Some(made) => Ok(made),
                None => face::triangulate(model, patch, &out, &tolerances),
            };
            let made: Vec<_> = (0..model.patches.len()).into_par_iter().map(of_patch).collect();
            for (patch, made) in made.into_iter().enumerate() {
                match made {
                    Ok(made) => made.append_to(&mut out),
                    Err(face::Failure::Coarse(error)) => {
                        out.gaps.push(0.0);
                        conflicts.push(patch);
                        failed = Some(error);
                    }
                    Err(face::Failure::Final(error)) => return Err(error),
                }
            }
            if conflicts.is_empty() {
                let shells = orient::orient(model, &out)?;
                measure::check(model, &out)?;
                return Ok((out, shells));
            }
            for patch in conflicts {
                let fins = model.patches[patch].loops.iter().flatten();
                for curve in
                    fins.filter_map(|fin| if let crate::On::Curve(c) = fin.on { Some(c) } else { None })
                {
                    chords[curve] = chords[curve].min(tolerances.chord) * 0.2;
                    divided[curve] = None;
                }
            }
            last = Some(out);
        }
        Err(failed.expect("there was a conflict before each retry"))
    }

    fn of_curves(
        model: &Model,
        known: &[Option<Vec<f64>>],
        chords: &[f64],
        angle: f64,
        diagonal: f64,
    ) -> Result<Self, BrepError> {
        let mut out = Self { points: model.corners.iter().map(|c| c.point).collect(), ..Self::default() };
        let mut beside: Vec<Vec<curves::Beside>> = vec![Vec::new(); model.curves.len()];
        for patch in &model.patches {
            for fin in patch.loops.iter().flatten() {
                if let crate::On::Curve(curve) = fin.on {
                    beside[curve].push((&patch.surface, fin));
                }
            }
        }
        let divided = |number: usize| {
            if let Some(parameters) = &known[number] {
                return Ok(parameters.clone());
            }
            let (curve, chord) = (&model.curves[number], chords[number]);
            // Finer where loops crossed.
            let angle = angle * (chord / chords[0].max(chord)).sqrt();
            curves::divide(curve, &beside[number], (chord, angle), diagonal)
                .map_err(|what| BrepError::edge(number, what, Some(model.corners[curve.ends[0]].point)))
        };
        let divided: Vec<_> = (0..model.curves.len()).into_par_iter().map(divided).collect();
        for (curve, parameters) in model.curves.iter().zip(divided) {
            let parameters = parameters?;
            let last = parameters.len() - 1;
            let mut line = Vec::with_capacity(last + 1);
            for (i, t) in parameters.into_iter().enumerate() {
                let vertex = if i == 0 {
                    curve.ends[0] as u32
                } else if i == last {
                    curve.ends[1] as u32
                } else {
                    out.points.push(Point::from(curve.curve.point(t)));
                    out.points.len() as u32 - 1
                };
                line.push((vertex, t));
            }
            out.lines.push(line);
        }
        Ok(out)
    }
}
