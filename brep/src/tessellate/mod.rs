//! Triangulation of all patches, so that neighbours fit.
//!
//! Each curve is divided once. Each patch is triangulated in its parameters, scaled to lengths, by
//! a constrained Delaunay triangulation of its loops, and refined at the midpoints of inner edges.
//! Curves, patches and the errors of their triangles are computed on all threads; the result does
//! not depend on the number of threads.

mod chain;
mod cross;
mod curves;
mod face;
mod frame;
mod measure;
mod orient;
mod outline;
mod overlap;
mod refine;
mod reuse;
mod tangent;

pub(crate) use curves::diagonal;
pub use measure::{area, check, volume};
pub(crate) use orient::Shell;

use crate::model::Patch;
use crate::pieces::Cut;
use crate::{BrepError, EdgeCurve, Fin, Model, On, Point};
use face::Failure;
use rayon::prelude::*;
use reuse::Known;
use std::collections::BTreeSet;

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
    /// How fine each patch is.
    settings: Vec<Settings>,
}

/// How often curves are divided: more finely each time, because loops of a patch cross or triangles
/// are folded, or alike where loops of a patch cross a second time.
const MOST_RETRIES: usize = 7;

/// How often of these, at most, because of folded triangles: at kinks no division unfolds them.
const UNFOLDING_RETRIES: usize = 3;

/// Curves are not divided into more points in all than this to try again, ...
const MOST_POINTS: usize = 30_000;
/// ... unless the first division has so many times fewer.
const MOST_GROWTH: usize = 4;

/// A patch for which curves are divided too coarsely.
struct Conflict {
    patch: usize,
    /// Whether its loops cross; else its triangles are folded.
    crosses: bool,
    error: BrepError,
}

impl Settings {
    /// Finer, for curves of a patch whose loops cross or whose triangles are folded.
    fn finer(self) -> Self {
        /// By how much chords become smaller.
        const FACTOR: f64 = 0.2;
        Self { chord: FACTOR * self.chord, angle: FACTOR.sqrt() * self.angle }
    }
}

impl Tessellation {
    /// Triangulates all patches.
    ///
    /// # Errors
    /// [`BrepError::Face`] and [`BrepError::Edge`] with a place if curves and surfaces do not fit
    /// each other or loops cross; [`BrepError::Solid`] if a body is not closed.
    pub fn of(model: &mut Model, settings: &Settings) -> Result<Self, BrepError> {
        Self::without_overlaps(Self::of_overlapping(model, settings)?, model)
    }

    /// The same for solids that may overlap, with the shells of each solid.
    pub(crate) fn of_overlapping(
        model: &mut Model,
        settings: &Settings,
    ) -> Result<(Self, Vec<Vec<Shell>>), BrepError> {
        let divided = vec![None; model.curves.len()];
        let settings = vec![*settings; model.patches.len()];
        Self::with(model, settings, divided, None)
    }

    /// The patch that is furthest from its curves, and how far (length).
    pub fn widest_gap(&self) -> Option<(usize, f64)> {
        self.gaps.iter().copied().enumerate().max_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// How fine each patch is.
    pub fn settings(&self) -> &[Settings] {
        &self.settings
    }

    /// The same with these settings of each patch. Patches keep their triangles if neither their
    /// settings nor those of their neighbours are others.
    ///
    /// # Errors
    /// The same.
    ///
    /// # Panics
    /// If there are not as many settings as patches.
    pub fn with_settings(&self, model: &mut Model, settings: Vec<Settings>) -> Result<Self, BrepError> {
        let [before, now] = [&self.settings, &settings].map(|settings| of_curves(model, settings));
        let divided = |(curve, line): (usize, &Vec<(u32, f64)>)| {
            (before[curve] == now[curve]).then(|| line.iter().map(|on| on.1).collect())
        };
        let divided = self.lines.iter().enumerate().map(divided).collect();
        Self::without_overlaps(Self::with(model, settings, divided, Some(self))?, model)
    }

    /// The same for a model of which tips were cut off, each as fine as its patch `before`, in the
    /// tessellation of the model without cuts. Patches without a tip or a divided curve keep their
    /// triangles.
    ///
    /// # Errors
    /// The same.
    pub fn of_cut(cut: &mut Cut, before: &Self) -> Result<Self, BrepError> {
        // Parts of curves are divided anew, so that no vertex is close to a cut.
        let divided = |(curve, of): (&EdgeCurve, &Option<usize>)| {
            let line = &before.lines[(*of)?];
            let is_whole = [line[0].1, line[line.len() - 1].1] == curve.range;
            is_whole.then(|| line.iter().map(|on| on.1).collect())
        };
        let divided = cut.model.curves.iter().zip(&cut.parts_of).map(divided).collect();
        let settings = cut.patch_parts_of.iter().map(|&patch| before.settings[patch]).collect();
        Self::without_overlaps(Self::with(&mut cut.model, settings, divided, Some(before))?, &cut.model)
    }

    /// A tessellation if its solids, of which it has the shells, do not overlap.
    fn without_overlaps((out, shells): (Self, Vec<Vec<Shell>>), model: &Model) -> Result<Self, BrepError> {
        overlap::check(model, &shells)?;
        Ok(out)
    }

    /// Triangulates all patches, with curves `divided` at known parameters at first, and triangles
    /// of the tessellation `before` where these are the same.
    fn with(
        model: &mut Model,
        settings: Vec<Settings>,
        mut divided: Vec<Option<Vec<f64>>>,
        before: Option<&Self>,
    ) -> Result<(Self, Vec<Vec<Shell>>), BrepError> {
        assert_eq!(settings.len(), model.patches.len(), "each patch has settings");
        let diagonal = diagonal(&model.corners, &model.curves, Vec::new());
        let mut curve_settings = of_curves(model, &settings);
        let (mut failed, mut most_points) = (None, 0);
        let mut last: Option<Self> = None;
        let (mut crossed, mut alike, mut cut) = (Vec::new(), BTreeSet::new(), BTreeSet::new());
        for retry in 0..MOST_RETRIES {
            let mut out = Self::divided(model, &divided, &curve_settings, diagonal, &alike)?;
            out.settings.clone_from(&settings);
            if retry == 0 {
                most_points = MOST_POINTS.max(MOST_GROWTH * out.points.len());
            } else if out.points.len() > most_points {
                break;
            }
            let known = last.as_ref().or(before).map(Known::new);
            let tolerances = |patch: usize, Settings { chord, angle }: Settings| face::Tolerances {
                chord: chord * diagonal,
                angle,
                diagonal,
                refuses_folds: retry < UNFOLDING_RETRIES,
                cuts_sides: cut.contains(&patch),
            };
            let conflicts = out.triangulate(model, known.as_ref(), tolerances)?;
            if conflicts.is_empty() {
                let shells = orient::orient(model, &out)?;
                measure::check(model, &out)?;
                return Ok((out, shells));
            }
            let (mut crosses, mut finer) = (Vec::new(), BTreeSet::new());
            for Conflict { patch, crosses: is_crossing, error } in conflicts {
                if is_crossing && crossed.contains(&patch) && alike.insert(patch) {
                    // Finer curves have not helped.
                } else {
                    finer.extend(curves_of(&model.patches[patch]).map(|(curve, _)| curve));
                }
                if is_crossing {
                    crosses.push(patch);
                    cut.insert(patch);
                }
                failed = Some(error);
            }
            for curve in finer {
                curve_settings[curve] = curve_settings[curve].finer();
                divided[curve] = None;
            }
            crossed = crosses;
            last = Some(out);
        }
        Err(failed.expect("there was a conflict before each retry"))
    }

    /// Triangulates all patches, of which the curves are divided; those that were made before for
    /// the same division are `known`. Returns those that need another one.
    fn triangulate(
        &mut self,
        model: &Model,
        known: Option<&Known>,
        tolerances: impl Fn(usize, Settings) -> face::Tolerances + Sync,
    ) -> Result<Vec<Conflict>, BrepError> {
        let of_patch = |patch| match known.and_then(|known| known.made(model, patch, self)) {
            Some(made) => Ok(made),
            None => face::triangulate(model, patch, self, &tolerances(patch, self.settings[patch])),
        };
        let made: Vec<_> = (0..model.patches.len()).into_par_iter().map(of_patch).collect();
        let mut conflicts = Vec::new();
        for (patch, made) in made.into_iter().enumerate() {
            let (crosses, error) = match made {
                Ok(made) => {
                    made.append_to(self);
                    continue;
                }
                Err(Failure::Crossing(error)) => (true, error),
                Err(Failure::Folded(error)) => (false, error),
                Err(Failure::Final(error)) => return Err(error),
            };
            self.gaps.push(0.0);
            conflicts.push(Conflict { patch, crosses, error });
        }
        Ok(conflicts)
    }

    /// The vertices on curves, which are divided at known parameters or by their settings, and
    /// alike where they touch at corners of the patches `alike`.
    fn divided(
        model: &Model,
        known: &[Option<Vec<f64>>],
        settings: &[Settings],
        diagonal: f64,
        alike: &BTreeSet<usize>,
    ) -> Result<Self, BrepError> {
        let mut out = Self { points: model.corners.iter().map(|c| c.point).collect(), ..Self::default() };
        let beside = beside(model);
        let divided = |number: usize| {
            if let Some(parameters) = &known[number] {
                return Ok(parameters.clone());
            }
            let (curve, Settings { chord, angle }) = (&model.curves[number], settings[number]);
            let beside: Vec<curves::Beside> =
                beside[number].iter().map(|&(patch, fin)| (&model.patches[patch].surface, fin)).collect();
            let ends = curve.ends.map(|end| model.corners[end].point);
            curves::divide(curve, &beside, (chord * diagonal, angle), diagonal)
                .map(|parameters| curves::away_from_ends(curve, ends, parameters, diagonal))
                .map_err(|what| BrepError::edge(number, what, Some(model.corners[curve.ends[0]].point)))
        };
        let divided: Vec<_> = (0..model.curves.len()).into_par_iter().map(divided).collect();
        let mut divided: Vec<Vec<f64>> = divided.into_iter().collect::<Result<_, _>>()?;
        for &patch in alike {
            tangent::divide_alike(model, patch, diagonal, &mut divided);
        }
        for (curve, parameters) in model.curves.iter().zip(divided) {
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

/// The curves of a patch, each with its side.
fn curves_of(patch: &Patch) -> impl Iterator<Item = (usize, &Fin)> {
    let on_curve = |fin: &Fin| if let On::Curve(curve) = fin.on { Some(curve) } else { None };
    patch.loops.iter().flatten().filter_map(move |fin| Some((on_curve(fin)?, fin)))
}

/// For each curve, the patches beside it with their sides.
fn beside(model: &Model) -> Vec<Vec<(usize, &Fin)>> {
    let mut beside = vec![Vec::new(); model.curves.len()];
    for (number, patch) in model.patches.iter().enumerate() {
        curves_of(patch).for_each(|(curve, fin)| beside[curve].push((number, fin)));
    }
    beside
}

/// For each curve, the finest settings of the patches beside it.
fn of_curves(model: &Model, settings: &[Settings]) -> Vec<Settings> {
    let finer =
        |a: Settings, b: Settings| Settings { chord: a.chord.min(b.chord), angle: a.angle.min(b.angle) };
    let of_curve = |beside: &Vec<(usize, &Fin)>| {
        beside.iter().map(|&(patch, _)| settings[patch]).reduce(finer).unwrap_or_default()
    };
    beside(model).iter().map(of_curve).collect()
}
