//! Narrow tips of faces: where two edges meet at a small angle, the face between them is narrower
//! than the elements for a while.
//!
//! Edges that touch tangentially, as at the end of a fillet or a run-out, leave such tips.
//! Triangles in them are as sharp as the tips, whatever their size. So a tip is cut off where it
//! becomes about as wide as a small face may be, and merged as a narrow face of its own.

use super::faces::is_smooth;
use super::layout::Layout;
use crate::Point;
use crate::ground::kernel::nearest::in_segment;
use crate::ground::kernel::tree::bounds;
use crate::ground::size::SizeField;
use crate::mesher::facets::sharp_places::angles;
use brep::{EdgeCurve, Fin, Model, On, Piece, project_to_curve};

/// Tips with a larger angle between their triangles are not cut (radians).
const SHARP: f64 = 0.35;

/// Tips that cannot be merged are cut again where they are narrower by these factors. The mesh
/// begins with an edge as short as the cut, so half the width halves the angles.
const NARROWER: [f64; 3] = [1.0, 0.67, 0.33];

/// Tips are not cut where they are thinner than this (fraction of the size of the model): that may
/// be rounding.
const THINNEST: f64 = 1e-8;

/// Tips are cut again where they are so much wider.
const WIDER: f64 = 1.25;

/// A tip is cut if it is at least this long (units of the element size), so that it is sharper than
/// 14°.
const LONG: f64 = 0.4;

/// Steps along an edge for one element.
const STEPS: f64 = 8.0;

/// The cosine of the angle by which the edges of a side turn, at least.
const STRAIGHT: f64 = 0.7;

/// The most steps along an edge.
const MOST_STEPS: usize = 10_000;

/// Bisections of the last step.
const BISECTIONS: usize = 20;

/// A corner of a face that is so sharp that there may be a narrow tip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Candidate {
    tip: Piece,
    corner: usize,
    /// Whether the face goes on smoothly beyond one of the edges there.
    is_smooth: bool,
    /// Which of [`NARROWER`] to cut with; none after the last one.
    pub attempt: usize,
}

/// A tip that is cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct NarrowTip {
    pub tip: Piece,
    /// Its corner.
    pub corner: usize,
    /// Its width at the cut (length).
    pub width: f64,
    /// The index of its candidate.
    pub candidate: usize,
}

/// The corners of faces that are so sharp that there may be a narrow tip.
pub(super) fn candidates(layout: &Layout) -> Vec<Candidate> {
    let (model, tessellation) = (layout.model, layout.tessellation);
    let triangles = tessellation.triangles.iter().map(|t| (t.vertices, t.patch));
    let angles = angles(&tessellation.points, triangles, |v| (v as usize) < model.corners.len());
    let mut found = Vec::new();
    for (patch, face) in model.patches.iter().enumerate() {
        let beyond = |fin: &Fin| layout.beyond(patch, fin);
        for (of_loop, fins) in face.loops.iter().enumerate() {
            for (fin, arriving) in fins.iter().enumerate() {
                // Between both edges there may be a pole of the surface.
                let mut after = (fin + 1..fin + fins.len()).map(|k| k % fins.len());
                let Some(next) = after.find(|&k| matches!(fins[k].on, On::Curve(_))) else {
                    continue;
                };
                let (Some((a, one)), Some((b, other))) = (beyond(arriving), beyond(&fins[next])) else {
                    continue;
                };
                let (_, corner) = model.end_of(arriving, false);
                let is_sharp = angles.get(&(corner as u32, patch as u32)).is_some_and(|angle| *angle < SHARP);
                if a != b && one != other && is_sharp {
                    let tip = Piece { patch, of_loop, sides: [fin, next], at: [None; 2] };
                    let is_smooth = [a, b].iter().any(|&edge| is_smooth(layout, &[edge]));
                    found.push(Candidate { is_smooth, ..Candidate::of(tip, corner) });
                }
            }
        }
    }
    found
}

/// Those of the candidates that are at most as wide as elements divided by a factor for a while,
/// the second one if they go on smoothly beyond an edge.
///
/// Tips that are `done` stay as they are, unless they are wider now.
pub(super) fn narrow(
    layout: &Layout,
    candidates: &[Candidate],
    size: &dyn SizeField,
    factors: [f64; 2],
    done: &[NarrowTip],
) -> Vec<NarrowTip> {
    let least = THINNEST * bounds(&layout.tessellation.points).diagonal();
    let parts = |narrow: &NarrowTip| parts(layout.model, &narrow.tip);
    let mut taken: Vec<(usize, Vec<Part>)> = done.iter().map(|tip| (tip.candidate, parts(tip))).collect();
    let mut found = Vec::new();
    for (k, candidate) in candidates.iter().enumerate() {
        let before = done.iter().find(|tip| tip.candidate == k);
        let tip = candidate.narrow(layout, size, factors, k).filter(|narrow| {
            least < narrow.width
                && before.is_none_or(|before| narrow.width > WIDER * before.width)
                && !taken.iter().any(|(other, taken)| *other != k && overlap(taken, &parts(narrow)))
        });
        if let Some(tip) = &tip {
            taken.push((k, parts(tip)));
        }
        found.extend(tip.or(before.copied()));
    }
    found
}

/// A part of an edge: its index, and the parameters at both ends, ascending.
pub(super) type Part = (usize, [f64; 2]);

pub(super) fn overlap(one: &[Part], other: &[Part]) -> bool {
    let is_common = |(a, p): &Part, (b, q): &Part| a == b && p[0] < q[1] && q[0] < p[1];
    one.iter().any(|a| other.iter().any(|b| is_common(a, b)))
}

impl Candidate {
    /// A corner of a face with sharp edges, which has not been cut yet.
    pub(super) fn of(tip: Piece, corner: usize) -> Self {
        Self { tip, corner, is_smooth: false, attempt: 0 }
    }

    /// The face with the tip.
    pub(super) fn face(&self) -> usize {
        self.tip.patch
    }

    /// The parameters of the face at a place on a side of the loop with the tip; `None` for planes.
    pub(super) fn parameters(&self, model: &Model, side: usize, at: f64) -> Option<[f64; 2]> {
        let fin = &model.patches[self.tip.patch].loops[self.tip.of_loop][side];
        let On::Curve(edge) = fin.on else { return None };
        let place = fin.curve.as_ref()?.point(fin.parameter(at, model.curves[edge].range));
        Some(place.into())
    }

    /// Both sides of the tip.
    pub(super) fn sides<'a>(&self, layout: &Layout<'a>) -> [Side<'a>; 2] {
        [false, true].map(|leaves| Side::new(layout, &self.tip, leaves))
    }

    /// The tip, if it is at most as wide as elements divided by its factor for a while.
    pub(super) fn narrow(
        &self,
        layout: &Layout,
        size: &dyn SizeField,
        factors: [f64; 2],
        candidate: usize,
    ) -> Option<NarrowTip> {
        let Self { tip, corner, is_smooth, attempt } = *self;
        let factor = factors[usize::from(is_smooth)] / NARROWER.get(attempt)?;
        let [one, other] = self.sides(layout);
        let (places, width) = cut(&one, &other, size, factor)?;
        let tip = Piece { sides: places.map(|place| place.0), at: places.map(|place| place.1), ..tip };
        Some(NarrowTip { tip, corner, width, candidate })
    }
}

/// The parts of its edges that belong to a tip.
pub(super) fn parts(model: &Model, tip: &Piece) -> Vec<Part> {
    let part = |fin: &Fin| match fin.on {
        On::Curve(curve) => Some((curve, model.curves[curve].range)),
        // A pole.
        On::Corner(_) => None,
    };
    let mut parts: Vec<_> = tip.all_sides(model).filter_map(part).collect();
    // Along the loop, the first edge begins at its cut, and the last one ends there.
    let last = parts.len() - 1;
    for (k, part) in [(0, 0), (1, last)] {
        let is_forward = tip.sides(model)[k].is_forward;
        if let Some(t) = tip.at[k] {
            parts[part].1[if is_forward { k } else { 1 - k }] = t;
        }
    }
    parts
}

/// A place on one side of a tip.
#[derive(Clone, Copy)]
pub(super) struct Place {
    pub point: Point,
    /// The index of the edge.
    edge: usize,
    /// The parameter on it.
    at: f64,
}

/// An edge at a tip and those that continue it, seen from the tip.
pub(super) struct Side<'a> {
    /// The edges, each with its number in the loop of the face.
    edges: Vec<(usize, &'a EdgeCurve)>,
    /// Points on them, from the tip on; where an edge ends and another one begins there are two.
    line: Vec<Place>,
}

/// A place where the width of a tip is measured.
pub(super) struct Across {
    /// The places on both sides.
    pub places: [Place; 2],
    width: f64,
    /// Whether the other side ends there.
    is_end: bool,
}

impl<'a> Side<'a> {
    /// The side that arrives at a tip, or that `leaves` it.
    fn new(layout: &Layout<'a>, tip: &Piece, leaves: bool) -> Self {
        let fins = &layout.model.patches[tip.patch].loops[tip.of_loop];
        let mut out = Self { edges: Vec::new(), line: Vec::new() };
        for step in 0..(fins.len() / 2).max(1) {
            let side = match leaves {
                true => (tip.sides[1] + step) % fins.len(),
                false => (tip.sides[0] + fins.len() - step) % fins.len(),
            };
            let Some((curve, _)) = layout.beyond(tip.patch, &fins[side]) else { break };
            let edge = out.edges.len();
            let line = layout.line(&fins[side]).into_iter();
            let mut line: Vec<Place> = line.map(|(point, at)| Place { point, edge, at }).collect();
            if !leaves {
                line.reverse();
            }
            if !out.continues(&line) {
                break;
            }
            out.edges.push((side, &layout.model.curves[curve]));
            out.line.extend(line);
        }
        out
    }

    /// Whether a line goes on from the last point without a bend.
    fn continues(&self, line: &[Place]) -> bool {
        let [.., before, last] = self.line[..] else { return true };
        let [along, next] = [last.point - before.point, line[1].point - line[0].point];
        along.dot(&next) > STRAIGHT * along.norm() * next.norm()
    }

    /// The point of the tip.
    pub fn tip(&self) -> Point {
        self.line[0].point
    }

    /// About the first place so far from the tip: the number of its edge in the loop, and the
    /// parameter there.
    pub fn at_distance(&self, distance: f64) -> Option<(usize, f64)> {
        let from_tip = |place: &Place| (place.point - self.tip()).norm();
        let mut segments = self.line.windows(2).filter(|w| w[0].edge == w[1].edge);
        let w = segments.find(|w| from_tip(&w[1]) >= distance)?;
        let [near, far] = [from_tip(&w[0]), from_tip(&w[1])];
        let share = ((distance - near) / (far - near)).clamp(0.0, 1.0);
        Some((self.edges[w[0].edge].0, w[0].at + share * (w[1].at - w[0].at)))
    }

    /// The nearest place to a point.
    fn nearest(&self, point: &Point) -> Place {
        let segments = self.line.windows(2).filter(|w| w[0].edge == w[1].edge);
        let nearest = segments.map(|w| (in_segment(point, &w[0].point, &w[1].point), w));
        let nearest = nearest.min_by(|a, b| a.0.1.total_cmp(&b.0.1));
        let ((share, _), w) = nearest.expect("an edge has two points");
        let start = w[0].at + share * (w[1].at - w[0].at);
        let curve = self.edges[w[0].edge].1;
        let at = project_to_curve(&curve.curve, curve.range, point, start).parameter;
        self.place(w[0].edge, at)
    }

    fn place(&self, edge: usize, at: f64) -> Place {
        Place { point: Point::from(self.edges[edge].1.curve.point(at)), edge, at }
    }

    fn end(&self) -> Place {
        self.line[self.line.len() - 1]
    }

    /// The width between this side, at a place, and the other one.
    fn across(&self, other: &Self, place: Place) -> Across {
        let opposite = other.nearest(&place.point);
        let end = other.end();
        let is_end = (opposite.edge, opposite.at) == (end.edge, end.at);
        Across { places: [place, opposite], width: (opposite.point - place.point).norm(), is_end }
    }

    /// The number of the edge in the loop at which to cut, and the parameter there; none at the end
    /// of an edge, if the place is at most this far from it.
    fn cut(&self, place: &Place, width: f64) -> (usize, Option<f64>) {
        let ends = self.line.windows(2).filter(|w| w[0].edge != w[1].edge).map(|w| w[0]);
        let is_near = |end: &Place| (end.point - place.point).norm() <= width;
        match ends.chain([self.end()]).find(is_near) {
            Some(end) => (self.edges[end.edge].0, None),
            None => (self.edges[place.edge].0, Some(place.at)),
        }
    }
}

/// A place on the boundary of a face: the number of a side in its loop, and the parameter there, or
/// none at the end of the side.
type CutPlace = (usize, Option<f64>);

/// Where to cut between two sides that meet in a tip, and the width there, at most that of elements
/// divided by `factor`; `None` if the tip is not narrow for long enough.
fn cut(one: &Side, other: &Side, size: &dyn SizeField, factor: f64) -> Option<([CutPlace; 2], f64)> {
    let Across { places: [place, opposite], width, .. } = last_narrow(one, other, size, factor)?;
    if (place.point - one.tip()).norm() < LONG * size.size_at(&place.point) {
        return None;
    }
    // At the ends of edges of which almost nothing would be left.
    let cut = [one.cut(&place, width), other.cut(&opposite, width)];
    let is_whole = |side: &Side, cut: CutPlace| cut == (side.edges[side.edges.len() - 1].0, None);
    (!is_whole(one, cut[0]) || !is_whole(other, cut[1])).then_some((cut, width))
}

/// The last place from the tip on until which the width between both sides is at most that of
/// elements divided by `factor`; `None` if it is nowhere.
pub(super) fn last_narrow(one: &Side, other: &Side, size: &dyn SizeField, factor: f64) -> Option<Across> {
    let is_narrow = |place: Place| {
        let across = one.across(other, place);
        (!across.is_end && factor * across.width <= size.size_at(&place.point)).then_some(across)
    };
    let mut last: Option<Across> = None;
    let mut steps = 0;
    for w in one.line.windows(2).filter(|w| w[0].edge == w[1].edge) {
        let [p, q] = [w[0], w[1]];
        let parts = (STEPS * (q.point - p.point).norm() / size.size_at(&p.point)).ceil();
        let parts = parts.clamp(1.0, MOST_STEPS as f64) as usize;
        for part in 1..=parts {
            let place = |share: f64| p.at + (q.at - p.at) * share / parts as f64;
            let (mut good, mut bad) = (place(part as f64 - 1.0), place(part as f64));
            steps += 1;
            match is_narrow(one.place(p.edge, bad)) {
                Some(across) if steps < MOST_STEPS => last = Some(across),
                _ => {
                    for _ in 0..BISECTIONS {
                        let middle = 0.5 * (good + bad);
                        match is_narrow(one.place(p.edge, middle)) {
                            Some(across) => (good, last) = (middle, Some(across)),
                            None => bad = middle,
                        }
                    }
                    return last;
                }
            }
        }
    }
    last
}
