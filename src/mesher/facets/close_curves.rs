//! Sizes between close curves of one patch: triangles between two curves are well-shaped only if
//! they are not much longer than the gap is wide.

use super::{BluntEnd, FacetCurve, FacetModel};
use crate::Point;
use crate::ground::kernel::tree::{Tree, bounds};
use crate::ground::projector::FacetProjector;
use crate::ground::size::{SizeSettings, Source, Sources};
use crate::mesher::surface::closeness::lowered;
use csg::{CurveId, PatchId};
use rayon::prelude::*;

/// Largest edge length, in distances of two curves: a strip of such triangles, one across, has
/// angles of at least 25°.
const ACROSS: f64 = 1.8;

/// The size is lowered at most by this factor, and not at all in bands much narrower than that: the
/// strips that Boolean operations leave would get more triangles than all the rest. A box of
/// 10⁴ × 1 × 1 is resolved everywhere, one of 10⁶ × 1 × 1 near its ends only.
const MOST: f64 = 2000.0;

/// The most bisections of a curve segment.
const MOST_CUTS: u32 = 20;

/// Adds sources along curves that are close, compared with the sizes, to another curve of the same
/// patch without a common corner, outside of blunt ends.
///
/// Far from all sources the size is `maximum`.
pub(super) fn sample(model: &FacetModel, settings: &SizeSettings, maximum: f64, sources: &mut Vec<Source>) {
    let patches = model.patches_of_curves();
    let beside = curves_of_patches(&patches, model.patches.len());
    let others: Vec<Vec<usize>> = (0..model.curves.len())
        .into_par_iter()
        .map(|c| {
            let around = patches[c].iter().flat_map(|patch| &beside[patch.index()]).copied();
            around.filter(|&d| d != c && !have_common_end(&model.curves[c], &model.curves[d])).collect()
        })
        .collect();
    if others.iter().all(Vec::is_empty) {
        return;
    }
    let curves = Curves::new(model);
    let alone = Sources::new(settings.grading, maximum, sources);
    let across = ACROSS * settings.scale.min(1.0);
    let of_curve = |related: &mut Vec<bool>, c: usize| {
        let mut added = Vec::new();
        if others[c].is_empty() {
            return added;
        }
        others[c].iter().for_each(|&d| related[d] = true);
        let is_of_curve = |end: &&BluntEnd| patches[c].iter().any(|patch| patch.index() == end.patch);
        let blunt: Vec<&BluntEnd> = model.blunt.iter().filter(is_of_curve).collect();
        let sizes = |p: &Point, most: &dyn Fn(f64) -> f64| {
            let alone = alone.size_at(p);
            if blunt.iter().any(|end| end.reaches(p)) {
                return Sizes { alone, wanted: f64::INFINITY };
            }
            let distance = curves.distance(p, related, most(alone) / across);
            Sizes { alone, wanted: (across * distance).max(settings.minh) }
        };
        for w in model.projector.curve_points(CurveId::new(c)).windows(2) {
            cut(w[0], w[1], MOST_CUTS, &sizes, &mut added);
        }
        others[c].iter().for_each(|&d| related[d] = false);
        added
    };
    let all = (0..model.curves.len()).into_par_iter();
    let added: Vec<Vec<Source>> = all.map_init(|| vec![false; model.curves.len()], of_curve).collect();
    sources.extend(added.concat());
}

/// The curves of a model.
struct Curves<'a> {
    projector: &'a FacetProjector,
    /// Of their boxes.
    tree: Tree,
}

impl<'a> Curves<'a> {
    fn new(model: &'a FacetModel) -> Self {
        let projector = &model.projector;
        let curves = (0..projector.curves()).map(CurveId::new);
        let boxes: Vec<_> = curves.map(|curve| bounds(projector.curve_points(curve))).collect();
        Self { projector, tree: Tree::new(&boxes) }
    }

    /// The distance from the nearest of some curves; infinite if that is more than `most`.
    ///
    /// Segments of all curves in one tree would be visited in vain near those of other curves.
    fn distance(&self, p: &Point, is_of_them: &[bool], most: f64) -> f64 {
        let mut least = most * most;
        let to = |curve: u32| {
            if is_of_them[curve as usize]
                && let Some(squared) = self.projector.curve_within(CurveId(curve), p, least)
            {
                least = squared;
                return squared;
            }
            f64::INFINITY
        };
        self.tree.nearest_within(p, most * most, to).map_or(f64::INFINITY, |(_, squared)| squared.sqrt())
    }
}

/// Sizes at a point of a curve.
struct Sizes {
    /// Without close curves.
    alone: f64,
    /// For well-shaped triangles between this curve and the nearest one.
    wanted: f64,
}

/// Adds a source in the middle of a segment, which is bisected while it is longer than the size
/// there.
///
/// `sizes` also gets the limit, as a function of the size alone, from which on wanted sizes have no
/// effect.
fn cut(
    a: Point,
    b: Point,
    cuts: u32,
    sizes: &impl Fn(&Point, &dyn Fn(f64) -> f64) -> Sizes,
    sources: &mut Vec<Source>,
) {
    let (middle, length) = (nalgebra::center(&a, &b), (b - a).norm());
    // Along the segment the distance changes by at most half its length, and the other size hardly
    // by more.
    let most = |alone: f64| alone + 0.5 * length + 0.5 * ACROSS * length;
    let Sizes { alone, wanted } = sizes(&middle, &most);
    if wanted >= most(alone) {
        return;
    }
    let size = lowered(alone, wanted, MOST);
    if length > size && cuts > 0 {
        cut(a, middle, cuts - 1, sizes, sources);
        cut(middle, b, cuts - 1, sizes, sources);
    } else if size < alone {
        sources.push(Source { point: middle, size });
    }
}

fn have_common_end(one: &FacetCurve, other: &FacetCurve) -> bool {
    let ends = |curve: &FacetCurve| curve.ends.into_iter().flatten();
    ends(one).any(|end| ends(other).any(|other| other == end))
}

/// The curves adjacent to each patch.
fn curves_of_patches(patches: &[Vec<PatchId>], count: usize) -> Vec<Vec<usize>> {
    let mut curves = vec![Vec::new(); count];
    for (c, patches) in patches.iter().enumerate() {
        patches.iter().for_each(|patch| curves[patch.index()].push(c));
    }
    curves
}
