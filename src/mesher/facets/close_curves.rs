//! Sizes between close curves of one patch: triangles between two curves are well-shaped only if
//! they are not much longer than the gap is wide.

use super::{FacetCurve, FacetModel};
use crate::Point;
use crate::ground::kernel::nearest::in_segment;
use crate::ground::kernel::tree::{Tree, bounds};
use crate::ground::size::{SizeSettings, Source};

/// Largest edge length, in distances of two curves: a strip of such triangles, one across, has
/// angles of at least 25°.
const ACROSS: f64 = 1.8;

/// The most bisections of a curve segment.
const MOST_CUTS: u32 = 20;

/// Adds sources along curves that are close, compared with the sizes, to another curve of the same
/// patch without a common corner.
pub(super) fn sample(model: &FacetModel, settings: &SizeSettings, maximum: f64, sources: &mut Vec<Source>) {
    let patches = patches_of_curves(model);
    let point = |v: u32| model.points[v as usize];
    let segments: Vec<(usize, [Point; 2])> = model
        .curves
        .iter()
        .enumerate()
        .flat_map(|(c, curve)| curve.vertices.windows(2).map(move |w| (c, [point(w[0]), point(w[1])])))
        .collect();
    let tree = Tree::new(&segments.iter().map(|(_, ends)| bounds(ends)).collect::<Vec<_>>());
    let mut own = 0;
    for (c, curve) in model.curves.iter().enumerate() {
        let related: Vec<bool> = (0..model.curves.len())
            .map(|d| d != c && !have_common_end(curve, &model.curves[d]) && meet(&patches[c], &patches[d]))
            .collect();
        let count = curve.vertices.len() - 1;
        let own_segments = &segments[own..own + count];
        own += count;
        if !related.contains(&true) {
            continue;
        }
        let distance = |p: &Point| {
            let to = |s: u32| {
                let (d, [a, b]) = &segments[s as usize];
                if related[*d] { in_segment(p, a, b).1 } else { f64::INFINITY }
            };
            tree.nearest(p, to).map_or(f64::INFINITY, |(_, squared)| squared.sqrt())
        };
        for (_, [a, b]) in own_segments {
            let size_of = |p: &Point| (ACROSS * settings.scale.min(1.0) * distance(p)).max(settings.minh);
            cut(*a, *b, MOST_CUTS, maximum, &size_of, sources);
        }
    }
}

/// Adds a source in the middle of a segment, which is bisected while it is longer than the size
/// there.
fn cut(
    a: Point,
    b: Point,
    cuts: u32,
    maximum: f64,
    size_of: &impl Fn(&Point) -> f64,
    sources: &mut Vec<Source>,
) {
    let (middle, length) = (nalgebra::center(&a, &b), (b - a).norm());
    let size = size_of(&middle);
    // Along the segment the distance changes by at most half its length.
    if size - ACROSS * 0.5 * length >= maximum || size <= 0.0 {
        return;
    }
    if length > size && cuts > 0 {
        cut(a, middle, cuts - 1, maximum, size_of, sources);
        cut(middle, b, cuts - 1, maximum, size_of, sources);
    } else if size < maximum {
        sources.push(Source { point: middle, size });
    }
}

fn have_common_end(one: &FacetCurve, other: &FacetCurve) -> bool {
    let ends = |c: &FacetCurve| c.ends.into_iter().flatten().collect::<Vec<_>>();
    ends(one).iter().any(|e| ends(other).contains(e))
}

fn meet(one: &[u32], other: &[u32]) -> bool {
    one.iter().any(|p| other.contains(p))
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
