//! Which narrow face joins which neighbour.

use super::Layout;
use crate::ground::kernel::nearest::in_segment;
use crate::{Point, Vector};
use std::cmp::Ordering;

/// A main face is at least this many times as wide as a face that joins it: slivers have 10⁻³ of
/// their neighbours' width, while a tenth is part of the shape.
const WIDER: f64 = 20.0;

/// The same for tips, which are cut off where they are as wide as that.
const WIDER_THAN_TIPS: f64 = 4.0;

/// The least angle between the main face and the faces beyond the narrow one (radians): tets
/// between them have no larger one. Beside chamfers and steps it is 90° and more, in thin sheets 0.
const WEDGE: f64 = 0.35;

/// The cosine of the angle between edges on opposite sides of a narrow face, at least.
const PARALLEL: f64 = 0.7;

/// Edges at the ends of a narrow face are at most this long (widths).
const END: f64 = 2.0;

/// A face is beside a narrow one, and not at its end, if their common edges have at least this
/// share of the length of the longest ones.
const ALONG: f64 = 0.25;

/// Directions between faces turn by less than this where they are taken as smooth (radians).
const SMOOTH: f64 = 0.1;

/// The cosine of the angle between normals of a face that hardly turns, at least.
const FLAT: f64 = 0.98;

/// The face that a narrow one joins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Joins {
    Main(usize),
    /// Only faces with other names in the file would be left.
    Named,
    None,
}

/// A face that another one could join.
#[derive(Clone, Copy)]
struct Candidate {
    main: usize,
    /// The length of their common edges.
    length: f64,
    leaves_no_cut: bool,
    is_at_side: bool,
    is_smooth: bool,
}

/// The main face that each face joins, if it `may`: first faces beside a main face, then those
/// beside faces that have joined one, as the corner between three rounded edges.
pub(super) fn joins(layout: &Layout, may: &[bool]) -> Vec<Joins> {
    let mut joins = vec![Joins::None; may.len()];
    loop {
        let before = joins.clone();
        for face in (0..may.len()).filter(|&face| may[face] && !matches!(before[face], Joins::Main(_))) {
            joins[face] = join(layout, face, may, &before);
        }
        if joins == before {
            return joins;
        }
    }
}

/// The best face for one to join; `joins` has those of others.
fn join(layout: &Layout, face: usize, may: &[bool], joins: &[Joins]) -> Joins {
    let mut named = false;
    let is_tip = layout.cut_of(face).is_some();
    let mut candidates: Vec<Candidate> = Vec::new();
    for (neighbour, common) in neighbours(layout, face) {
        let main = match joins[neighbour] {
            Joins::Main(main) => main,
            _ if may[neighbour] => continue,
            _ => neighbour,
        };
        let wider = if is_tip { WIDER_THAN_TIPS } else { WIDER };
        let is_wide = layout.widths[main] >= wider * layout.widths[face];
        let is_alike = layout.bodies(main) == layout.bodies(face);
        if !is_wide || !is_alike || !is_open(layout, face, &common) {
            continue;
        }
        if layout.name(face).is_some() && layout.name(face) != layout.name(main) {
            named = true;
            continue;
        }
        candidates.push(Candidate {
            main,
            length: common.iter().map(|&c| layout.lengths[c]).sum(),
            leaves_no_cut: !is_tip || ends_inside(layout, face, &common),
            is_at_side: layout.along.get(&face).is_none_or(|along| along.contains(&neighbour)),
            is_smooth: is_smooth(layout, &common),
        });
    }
    let longest = candidates.iter().map(|candidate| candidate.length).fold(0.0, f64::max);
    // Best first: those with which a tip leaves no short edge, those at the side where all pieces
    // of a face are merged, those along the face and not at its ends, smooth neighbours, then those
    // with the longest common edges. Lengths that differ by rounding are equal: the first face is
    // taken.
    let goodness = |c: &Candidate| [c.leaves_no_cut, c.is_at_side, c.length >= ALONG * longest, c.is_smooth];
    let better = |best: Candidate, other: Candidate| {
        let is_better = match goodness(&other).cmp(&goodness(&best)) {
            Ordering::Equal => other.length > (1.0 + 1e-9) * best.length,
            order => order.is_gt(),
        };
        if is_better { other } else { best }
    };
    let best = candidates.into_iter().reduce(better);
    match best {
        Some(best) => Joins::Main(best.main),
        None if named => Joins::Named,
        None => Joins::None,
    }
}

/// Whether the cut of a tip ends inside the edge of which these common edges are a part: without
/// them two edges are left there, of which the cut is one, and they become one.
fn ends_inside(layout: &Layout, tip: usize, common: &[usize]) -> bool {
    let ends = |edge: usize| layout.model.curves[edge].ends;
    let Some(cut) = layout.cut_of(tip) else { return false };
    let count = |corner: usize| layout.curves.iter().filter(|&&edge| ends(edge).contains(&corner)).count();
    common.iter().any(|&edge| ends(edge).iter().any(|end| ends(cut.edge).contains(end) && count(*end) == 3))
}

/// The neighbours over edges that no third face has, with these edges.
fn neighbours(layout: &Layout, face: usize) -> Vec<(usize, Vec<usize>)> {
    let mut found: Vec<(usize, Vec<usize>)> = Vec::new();
    for &edge in &layout.around[face] {
        let &[a, b] = &layout.faces_of[edge][..] else { continue };
        let other = if a == face { b } else { a };
        if other == face || layout.cut_of(face).is_some_and(|cut| cut.of == other) {
            continue;
        }
        match found.iter_mut().find(|(known, _)| *known == other) {
            Some((_, edges)) => edges.push(edge),
            None => found.push((other, vec![edge])),
        }
    }
    found.sort_unstable();
    found
}

/// Whether two faces continue each other across all their common edges.
pub(super) fn is_smooth(layout: &Layout, common: &[usize]) -> bool {
    layout.segments(common).all(|segment| {
        let into: Vec<Vector> = layout.faces_beside(segment).map(|(_, into)| into).collect();
        matches!(into[..], [a, b] if a.angle(&-b) < SMOOTH)
    })
}

/// The neighbours with which a narrow face goes on smoothly beyond its edges, if it hardly turns
/// from there to its other side: without it the shape is almost the same.
pub(super) fn continued(layout: &Layout, face: usize) -> impl Iterator<Item = usize> {
    let is_continued = move |(main, common): &(usize, Vec<usize>)| {
        is_smooth(layout, common) && hardly_turns(layout, face, *main, common)
    };
    neighbours(layout, face).into_iter().filter(is_continued).map(|(main, _)| main)
}

/// Whether the normals of a face are those of the main one at the nearest of their common edges.
fn hardly_turns(layout: &Layout, face: usize, main: usize, common: &[usize]) -> bool {
    // The middles of the common segments, with the normal of the main face.
    let normal = |segment: [u32; 2]| {
        let [p, q] = layout.ends(segment);
        let (_, into) = layout.faces_beside(segment).find(|(other, _)| *other == main)?;
        Some((nalgebra::center(&p, &q), (q - p).cross(&into).try_normalize(0.0)?))
    };
    let normals: Vec<(Point, Vector)> = layout.segments(common).filter_map(normal).collect();
    layout.triangles[face].iter().all(|corners| {
        let [a, b, c] = corners;
        let middle = Point::from((a.coords + b.coords + c.coords) / 3.0);
        let distance = |(p, _): &&(Point, Vector)| (p - middle).norm_squared();
        let nearest = normals.iter().min_by(|s, t| distance(s).total_cmp(&distance(t)));
        let own = (b - a).cross(&(c - a)).try_normalize(0.0);
        nearest.zip(own).is_none_or(|((_, normal), own)| own.dot(normal).abs() >= FLAT)
    })
}

/// Whether no face beyond a narrow one would make a wedge with the main face that has these common
/// edges with it.
///
/// Edges at the ends of the narrow face, across it or about as short as it is wide, join faces that
/// met the main one before.
fn is_open(layout: &Layout, face: usize, common: &[usize]) -> bool {
    let dropped: Vec<[u32; 2]> = layout.segments(common).collect();
    let is_side = |edge: &usize| !common.contains(edge) && layout.lengths[*edge] > END * layout.widths[face];
    let kept: Vec<usize> = layout.around[face].iter().copied().filter(is_side).collect();
    layout.segments(&kept).all(|segment| {
        let [p, q] = layout.ends(segment);
        let middle = nalgebra::center(&p, &q);
        let distance = |s: &[u32; 2]| {
            let [a, b] = layout.ends(*s);
            in_segment(&middle, &a, &b).1
        };
        let nearest = dropped.iter().min_by(|s, t| distance(s).total_cmp(&distance(t)));
        let &nearest = nearest.expect("neighbours have common edges");
        let [a, b] = layout.ends(nearest);
        if (b - a).dot(&(q - p)).abs() < PARALLEL * (b - a).norm() * (q - p).norm() {
            return true;
        }
        let beyond = |s: [u32; 2]| layout.faces_beside(s).filter(|(other, _)| *other != face);
        beyond(nearest).all(|(_, main)| beyond(segment).all(|(_, into)| main.angle(&into) >= WEDGE))
    })
}
