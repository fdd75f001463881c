//! Narrow tips of faces: where two edges meet at a small angle, the face between them is narrower
//! than the elements for a while.
//!
//! Edges that touch tangentially, as at the end of a fillet or a run-out, leave such tips.
//! Triangles in them are as sharp as the tips, whatever their size. So a tip is cut off where it
//! becomes about as wide as a small face may be, and merged as a narrow face of its own.

use super::layout::Layout;
use crate::Point;
use crate::ground::kernel::nearest::in_segment;
use crate::ground::size::SizeField;
use crate::mesher::facets::sharp_places::angles;
use brep::{EdgeCurve, Fin, Model, On, Piece, project_to_curve};

/// Tips with a larger angle between their triangles are not cut (radians).
const SHARP: f64 = 0.35;

/// Tips that cannot be merged are cut again where they are narrower by these factors. The mesh
/// begins with an edge as short as the cut, so half the width halves the angles.
const NARROWER: [f64; 2] = [1.0, 0.5];

/// A tip is cut if it is at least this long (units of the element size), so that it is sharper than
/// 14°.
const LONG: f64 = 0.4;

/// Steps along an edge for one element.
const STEPS: f64 = 8.0;

/// The most steps along an edge.
const MOST_STEPS: usize = 10_000;

/// Bisections of the last step.
const BISECTIONS: usize = 20;

/// A corner of a face that is so sharp that there may be a narrow tip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Candidate {
    tip: Piece,
    corner: usize,
    /// Which of [`NARROWER`] to cut with.
    attempt: usize,
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
                let sides = [fin, (fin + 1) % fins.len()];
                let leaving = &fins[sides[1]];
                let (Some((a, one)), Some((b, other))) = (beyond(arriving), beyond(leaving)) else {
                    continue;
                };
                let corner = model.curves[a].ends[usize::from(arriving.is_forward)];
                let is_sharp = angles.get(&(corner as u32, patch as u32)).is_some_and(|angle| *angle < SHARP);
                if a != b && one != other && is_sharp {
                    let tip = Piece { patch, of_loop, sides, at: [None; 2] };
                    found.push(Candidate { tip, corner, attempt: 0 });
                }
            }
        }
    }
    found
}

/// Those of the candidates that are at most as wide as elements divided by `factor` for a while.
pub(super) fn narrow(
    layout: &Layout,
    candidates: &[Candidate],
    size: &dyn SizeField,
    factor: f64,
) -> Vec<NarrowTip> {
    let tip = |(candidate, &Candidate { tip, corner, attempt }): (usize, &Candidate)| {
        let sides = tip.sides(layout.model);
        let [one, other] = [0, 1].map(|k| Side::new(layout, sides[k], k == 1));
        let (at, width) = cut(&one, &other, size, factor / NARROWER[attempt])?;
        Some(NarrowTip { tip: Piece { at, ..tip }, corner, width, candidate })
    };
    let mut taken: Vec<(usize, [f64; 2])> = Vec::new();
    let mut found = Vec::new();
    for narrow in candidates.iter().enumerate().filter_map(tip) {
        let parts = parts(layout.model, &narrow.tip);
        let overlaps = |(c, [low, high]): &(usize, [f64; 2])| {
            taken.iter().any(|(d, other)| c == d && *low < other[1] && other[0] < *high)
        };
        if !parts.iter().any(overlaps) {
            taken.extend(parts);
            found.push(narrow);
        }
    }
    found
}

/// The candidates after those with these indices, ascending, failed.
pub(super) fn without(candidates: &[Candidate], failed: &[usize]) -> Vec<Candidate> {
    let next = |(k, candidate): (usize, &Candidate)| {
        let attempt = candidate.attempt + usize::from(failed.binary_search(&k).is_ok());
        (attempt < NARROWER.len()).then_some(Candidate { attempt, ..*candidate })
    };
    candidates.iter().enumerate().filter_map(next).collect()
}

/// The parts of its edges that belong to a tip.
fn parts(model: &Model, tip: &Piece) -> [(usize, [f64; 2]); 2] {
    let sides = tip.sides(model);
    [0, 1].map(|k| {
        let fin = sides[k];
        let On::Curve(curve) = fin.on else { unreachable!("a candidate has edges on both sides") };
        let [low, high] = model.curves[curve].range;
        // The first edge arrives at the tip, the second one leaves it.
        let is_at_end = fin.is_forward == (k == 0);
        let part = match tip.at[k] {
            None => [low, high],
            Some(t) if is_at_end => [t, high],
            Some(t) => [low, t],
        };
        (curve, part)
    })
}

/// An edge at a tip, seen from the tip.
struct Side<'a> {
    edge: &'a EdgeCurve,
    /// Its points with their parameters, from the tip on.
    line: Vec<(Point, f64)>,
}

/// A place where the width of a tip is measured.
struct Across {
    /// The parameters on both edges.
    at: [f64; 2],
    width: f64,
    /// Whether the other edge ends there.
    is_end: bool,
}

impl<'a> Side<'a> {
    fn new(layout: &Layout<'a>, fin: &Fin, leaves: bool) -> Self {
        let On::Curve(curve) = fin.on else { unreachable!("a candidate has edges on both sides") };
        let mut line = layout.line(fin);
        if !leaves {
            line.reverse();
        }
        Self { edge: &layout.model.curves[curve], line }
    }

    /// The parameter nearest to a point.
    fn nearest(&self, point: &Point) -> f64 {
        let squared = |w: &[(Point, f64)]| in_segment(point, &w[0].0, &w[1].0);
        let nearest = self.line.windows(2).map(|w| (squared(w), w)).min_by(|a, b| a.0.1.total_cmp(&b.0.1));
        let ((share, _), w) = nearest.expect("an edge has two points");
        let start = w[0].1 + share * (w[1].1 - w[0].1);
        project_to_curve(&self.edge.curve, self.edge.range, point, start).parameter
    }

    fn end(&self) -> f64 {
        self.line[self.line.len() - 1].1
    }

    /// The width between this edge, at a parameter, and the other one.
    fn across(&self, other: &Self, t: f64) -> Across {
        let point = Point::from(self.edge.curve.point(t));
        let on_other = other.nearest(&point);
        let width = (other.edge.curve.point(on_other) - point.coords).norm();
        Across { at: [t, on_other], width, is_end: on_other == other.end() }
    }
}

/// Where to cut between two edges that meet in a tip, and the width there, at most that of elements
/// divided by `factor`; `None` if the tip is not narrow for long enough.
fn cut(one: &Side, other: &Side, size: &dyn SizeField, factor: f64) -> Option<([Option<f64>; 2], f64)> {
    let tip = one.line[0].0;
    let is_narrow = |t: f64| {
        let across = one.across(other, t);
        let size = size.size_at(&Point::from(one.edge.curve.point(t)));
        (!across.is_end && factor * across.width <= size).then_some(across)
    };
    let mut last: Option<Across> = None;
    let mut steps = 0;
    for w in one.line.windows(2) {
        let [(p, low), (q, high)] = [w[0], w[1]];
        let parts = (STEPS * (q - p).norm() / size.size_at(&p)).ceil().clamp(1.0, MOST_STEPS as f64) as usize;
        for part in 1..=parts {
            let place = |share: f64| low + (high - low) * share / parts as f64;
            let (mut good, mut bad) = (place(part as f64 - 1.0), place(part as f64));
            steps += 1;
            match is_narrow(bad) {
                Some(across) if steps < MOST_STEPS => last = Some(across),
                _ => {
                    for _ in 0..BISECTIONS {
                        let middle = 0.5 * (good + bad);
                        match is_narrow(middle) {
                            Some(across) => (good, last) = (middle, Some(across)),
                            None => bad = middle,
                        }
                    }
                    return finished(one, other, tip, last?, size);
                }
            }
        }
    }
    finished(one, other, tip, last?, size)
}

/// The cut, at the ends of edges of which almost nothing would be left.
fn finished(
    one: &Side,
    other: &Side,
    tip: Point,
    across: Across,
    size: &dyn SizeField,
) -> Option<([Option<f64>; 2], f64)> {
    let places = [one, other].map(|side| Point::from(side.edge.curve.point(side.end())));
    let points = [(one, 0), (other, 1)].map(|(side, k)| Point::from(side.edge.curve.point(across.at[k])));
    if (points[0] - tip).norm() < LONG * size.size_at(&points[0]) {
        return None;
    }
    let at = [0, 1].map(|k| ((places[k] - points[k]).norm() > across.width).then_some(across.at[k]));
    (at != [None; 2]).then_some((at, across.width))
}
