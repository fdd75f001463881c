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

pub(crate) use curves::diagonal;
pub use measure::{area, check, volume};

use crate::{BrepError, Model, Point};
use rayon::prelude::*;

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
        let diagonal = diagonal(&model.corners, &model.curves, Vec::new());
        let chord = settings.chord * diagonal;
        let mut tolerances = face::Tolerances { chord, angle: settings.angle, diagonal, refuses_folds: true };
        let mut chords = vec![tolerances.chord; model.curves.len()];
        let (mut failed, mut most_points) = (None, 0);
        for retry in 0..MOST_RETRIES {
            tolerances.refuses_folds = retry < UNFOLDING_RETRIES;
            let mut out = Self::of_curves(model, &chords, settings.angle, diagonal)?;
            if retry == 0 {
                most_points = MOST_POINTS.max(MOST_GROWTH * out.points.len());
            } else if out.points.len() > most_points {
                break;
            }
            let mut conflicts = Vec::new();
            let of_patch = |patch| face::triangulate(model, patch, &out, &tolerances);
            let made: Vec<_> = (0..model.patches.len()).into_par_iter().map(of_patch).collect();
            for (patch, made) in made.into_iter().enumerate() {
                match made {
                    Ok(made) => made.append_to(&mut out),
                    Err(face::Failure::Coarse(error)) => {
                        conflicts.push(patch);
                        failed = Some(error);
                    }
                    Err(face::Failure::Final(error)) => return Err(error),
                }
            }
            if conflicts.is_empty() {
                orient::orient(model, &out)?;
                measure::check(model, &out)?;
                return Ok(out);
            }
            for patch in conflicts {
                let fins = model.patches[patch].loops.iter().flatten();
                for curve in
                    fins.filter_map(|fin| if let crate::On::Curve(c) = fin.on { Some(c) } else { None })
                {
                    chords[curve] = chords[curve].min(tolerances.chord) * 0.2;
                }
            }
        }
        Err(failed.expect("there was a conflict before each retry"))
    }

    fn of_curves(model: &Model, chords: &[f64], angle: f64, diagonal: f64) -> Result<Self, BrepError> {
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
