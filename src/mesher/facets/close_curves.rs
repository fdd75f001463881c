//! Sizes between close curves of one patch: triangles between two curves are well-shaped only if
//! they are not much longer than the gap is wide.

use super::{FacetCurve, FacetModel};
use crate::Point;
use crate::ground::kernel::nearest::in_segment;
use crate::ground::kernel::tree::{Tree, bounds};
use crate::ground::size::{SizeSettings, Source, Sources, thinned};
use crate::mesher::surface::closeness::lowered;
use std::cell::OnceCell;

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
/// patch without a common corner.
///
/// Far from all sources the size is `maximum`.
pub(super) fn sample(model: &FacetModel, settings: &SizeSettings, maximum: f64, sources: &mut Vec<Source>) {
    let alone = OnceCell::new();
    let mut added: Vec<Source> = Vec::new();
    let patches = patches_of_curves(model);
    let point = |v: u32| model.points[v as usize];
    let segments: Vec<(usize, [Point; 2])> = model
        .curves
        .iter()
        .enumerate()
        .flat_map(|(c, curve)| curve.vertices.windows(2).map(move |w| (c, [point(w[0]), point(w[1])])))
        .collect();
    let tree = Tree::new(&segments.iter().map(|(_, ends)| bounds(ends)).collect::<Vec<_>>());
    let beside = curves_of_patches(&patches, model.patches.len());
    let mut related = vec![false; model.curves.len()];
    let mut own = 0;
    for (c, curve) in model.curves.iter().enumerate() {
        let count = curve.vertices.len() - 1;
        let own_segments = &segments[own..own + count];
        own += count;
        let others: Vec<usize> = patches[c]
            .iter()
            .flat_map(|&patch| &beside[patch as usize])
            .copied()
            .filter(|&d| d != c && !have_common_end(curve, &model.curves[d]))
            .collect();
        if others.is_empty() {
            continue;
        }
        others.iter().for_each(|&d| related[d] = true);
        let distance = |p: &Point| {
            let to = |s: u32| {
                let (d, [a, b]) = &segments[s as usize];
                if related[*d] { in_segment(p, a, b).1 } else { f64::INFINITY }
            };
            tree.nearest(p, to).map_or(f64::INFINITY, |(_, squared)| squared.sqrt())
        };
        let alone = alone.get_or_init(|| Sources::new(settings.grading, maximum, &thinned(sources.clone())));
        let sizes = |p: &Point| Sizes {
            alone: alone.size_at(p),
            wanted: (ACROSS * settings.scale.min(1.0) * distance(p)).max(settings.minh),
        };
        for (_, [a, b]) in own_segments {
            cut(*a, *b, MOST_CUTS, &sizes, &mut added);
        }
        others.iter().for_each(|&d| related[d] = false);
    }
    sources.extend(added);
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
fn cut(a: Point, b: Point, cuts: u32, sizes: &impl Fn(&Point) -> Sizes, sources: &mut Vec<Source>) {
    let (middle, length) = (nalgebra::center(&a, &b), (b - a).norm());
    let Sizes { alone, wanted } = sizes(&middle);
    // Along the segment the distance changes by at most half its length, and the other size hardly
    // by more.
    if wanted - 0.5 * ACROSS * length >= alone + 0.5 * length {
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
fn curves_of_patches(patches: &[Vec<u32>], count: usize) -> Vec<Vec<usize>> {
    let mut curves = vec![Vec::new(); count];
    for (c, patches) in patches.iter().enumerate() {
        patches.iter().for_each(|&patch| curves[patch as usize].push(c));
    }
    curves
}

/// The patches adjacent to each curve.
fn patches_of_curves(model: &FacetModel) -> Vec<Vec<u32>> {
    let mut steps: Vec<([u32; 2], usize)> = Vec::new();
    for (c, curve) in model.curves.iter().enumerate() {
        // One step suffices: a curve ends where its adjacent patches change.
        steps.extend(curve.vertices.windows(2).take(1).map(|w| ([w[0].min(w[1]), w[0].max(w[1])], c)));
    }
    steps.sort_unstable();
    let mut patches = vec![Vec::new(); model.curves.len()];
    for t in &model.triangles {
        let v = t.vertices.map(|v| v.0);
        for [a, b] in [[v[0], v[1]], [v[1], v[2]], [v[2], v[0]]] {
            if let Ok(i) = steps.binary_search_by_key(&[a.min(b), a.max(b)], |s| s.0) {
                patches[steps[i].1].push(t.patch.0);
            }
        }
    }
    patches
}
