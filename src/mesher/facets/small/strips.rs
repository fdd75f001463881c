//! Narrow faces with several faces along both sides: where to divide them.
//!
//! A low step that goes around a corner has several faces along each side. Merged with one of them,
//! it would remain as narrow beside the others. So it is divided into pieces, from the corners
//! between faces along it to its other side, and each is merged as a narrow face of its own.

use super::layout::Layout;
use crate::Point;
use crate::ground::kernel::nearest::{self, in_segment, in_triangle};
use brep::{Fin, Piece};

/// A face is not divided if one neighbour has at least this share of one of its sides.
const COVERED: f64 = 0.8;

/// A cut is this long (widths): across a corner of a strip it is longer than elsewhere.
const ACROSS: [f64; 2] = [0.3, 2.0];

/// The middle of a cut is at most this far from the face (widths), and not in a gap beside it.
const INSIDE: f64 = 0.1;

/// The boundary of a piece is at least this long on both sides of a cut, together (widths).
const LONG: f64 = 4.0;

/// An edge of a strip, along its loop.
struct Side {
    /// The face beyond it.
    beyond: usize,
    /// Its points with their parameters.
    line: Vec<(Point, f64)>,
    /// The length of the loop before it.
    start: f64,
    length: f64,
}

/// A face with one loop.
struct Strip<'a> {
    face: usize,
    width: f64,
    triangles: &'a [[Point; 3]],
    sides: Vec<Side>,
}

/// A place on the loop of a strip.
#[derive(Clone, Copy)]
struct Place {
    /// The length of the loop before it.
    position: f64,
    side: usize,
    /// The parameter on the edge, or none at the start of the side.
    at: Option<f64>,
    point: Point,
}

/// A face to be divided.
pub(super) struct Division {
    pub face: usize,
    /// The pieces that are cut off, those inside others first.
    pub pieces: Vec<Piece>,
    /// The faces along one side, where all pieces should be merged: with one at each side, a step
    /// as short as the face is wide would remain between them. None for pieces that do not follow
    /// each other.
    pub along: Vec<usize>,
    pub rest: Rest,
}

/// What becomes of a divided face without the pieces that are cut off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Rest {
    /// It is merged as well.
    Merged,
    /// It is a face of its own.
    Kept,
}

/// How to divide faces of which `is_narrow`. Those with names are kept whole.
pub(super) fn divisions(layout: &Layout, is_narrow: &[bool]) -> Vec<Division> {
    let narrow = (0..is_narrow.len()).filter(|&face| is_narrow[face] && layout.name(face).is_none());
    narrow.filter_map(|face| Strip::new(layout, face)?.division()).collect()
}

impl<'a> Strip<'a> {
    /// The face, if it has one loop of edges with other faces beyond them.
    fn new(layout: &'a Layout, face: usize) -> Option<Self> {
        let [fins] = &layout.model.patches[face].loops[..] else { return None };
        let mut end = 0.0;
        let side = |fin: &Fin| {
            let (edge, beyond) = layout.beyond(face, fin)?;
            let (start, length) = (end, layout.lengths[edge]);
            end += length;
            Some(Side { beyond, line: layout.line(fin), start, length })
        };
        let sides = fins.iter().map(side).collect::<Option<Vec<Side>>>()?;
        Some(Self { face, width: layout.widths[face], triangles: &layout.triangles[face], sides })
    }

    fn length(&self) -> f64 {
        self.sides.iter().map(|side| side.length).sum()
    }

    /// Whether one neighbour has about the whole of one side.
    fn is_covered(&self) -> bool {
        let common = |beyond: usize| -> f64 {
            self.sides.iter().filter(|side| side.beyond == beyond).map(|side| side.length).sum()
        };
        self.sides.iter().any(|side| common(side.beyond) >= COVERED * 0.5 * self.length())
    }

    fn division(&self) -> Option<Division> {
        if self.is_covered() {
            return None;
        }
        let cuts = self.cuts();
        (!cuts.is_empty()).then(|| Division {
            face: self.face,
            pieces: cuts.iter().map(|cut| self.piece(cut)).collect(),
            along: self.side(&cuts),
            rest: Rest::Merged,
        })
    }

    /// The cuts that do not meet, those of pieces inside others first.
    fn cuts(&self) -> Vec<[Place; 2]> {
        let mut cuts: Vec<[Place; 2]> = Vec::new();
        for side in 0..self.sides.len() {
            if self.sides[self.before(side)].beyond == self.sides[side].beyond {
                continue;
            }
            let corner = self.corner(side);
            let Some(opposite) = self.opposite(side) else { continue };
            let cut =
                if corner.position < opposite.position { [corner, opposite] } else { [opposite, corner] };
            if self.is_long(&cut) && self.is_across(&cut) && cuts.iter().all(|other| !meet(&cut, other)) {
                cuts.push(cut);
            }
        }
        let length = |[from, to]: &[Place; 2]| to.position - from.position;
        cuts.sort_by(|a, b| length(a).total_cmp(&length(b)));
        cuts
    }

    fn before(&self, side: usize) -> usize {
        (side + self.sides.len() - 1) % self.sides.len()
    }

    /// The faces along one side of the strip: from cut to cut those that continue it, at the first
    /// one those with the longer edges.
    fn side(&self, cuts: &[[Place; 2]]) -> Vec<usize> {
        let length = |faces: &[usize]| -> f64 {
            self.sides.iter().filter(|side| faces.contains(&side.beyond)).map(|side| side.length).sum()
        };
        let mut chosen: Vec<usize> = Vec::new();
        for cut in cuts {
            let [one, other] = cut.map(|place| self.beyond(&place));
            let continues = |faces: &[usize]| faces.iter().any(|face| chosen.contains(face));
            let takes_other = match [continues(&one), continues(&other)] {
                [false, false] => length(&other) > length(&one),
                [is_one, _] => !is_one,
            };
            chosen.extend(if takes_other { other } else { one });
        }
        chosen
    }

    /// The faces beyond a place on the loop.
    fn beyond(&self, place: &Place) -> Vec<usize> {
        let after = self.sides[place.side].beyond;
        match place.at {
            Some(_) => vec![after],
            None => vec![self.sides[self.before(place.side)].beyond, after],
        }
    }

    fn is_long(&self, [from, to]: &[Place; 2]) -> bool {
        let between = to.position - from.position;
        between.min(self.length() - between) >= LONG * self.width
    }

    /// Whether a cut is about as long as the face is wide, and on it.
    fn is_across(&self, [from, to]: &[Place; 2]) -> bool {
        let middle = nalgebra::center(&from.point, &to.point);
        let [least, most] = ACROSS.map(|widths| widths * self.width);
        let is_near = |corners: &[Point; 3]| {
            let nearest = nearest::at(corners, in_triangle(&middle, corners));
            (nearest - middle).norm() <= INSIDE * self.width
        };
        (least..=most).contains(&(to.point - from.point).norm()) && self.triangles.iter().any(is_near)
    }

    /// The corner at the start of a side.
    fn corner(&self, side: usize) -> Place {
        let Side { start, ref line, .. } = self.sides[side];
        Place { position: start, side, at: None, point: line[0].0 }
    }

    /// The place across the strip from the corner at the start of a side: a corner, or else the
    /// nearest point.
    fn opposite(&self, side: usize) -> Option<Place> {
        let count = self.sides.len();
        let corner = self.sides[side].line[0].0;
        let before = self.before(side);
        let others = || (0..count).filter(move |&other| other != side && other != before);
        let distance = |place: &Place| (place.point - corner).norm();
        let nearer = |a: &Place, b: &Place| distance(a).total_cmp(&distance(b));
        let corners = others().filter(|&other| other != (side + 1) % count);
        let nearest = corners.map(|other| self.corner(other)).min_by(nearer);
        if let Some(corner) = nearest.filter(|place| distance(place) <= ACROSS[1] * self.width) {
            return Some(corner);
        }
        let place = others().map(|other| self.foot(other, &corner)).min_by(nearer)?;
        let Side { start, length, .. } = self.sides[place.side];
        let from_start = place.position - start;
        (from_start.min(length - from_start) > self.width).then_some(place)
    }

    /// The place of a side that is nearest to a point.
    fn foot(&self, side: usize, point: &Point) -> Place {
        let mut position = self.sides[side].start;
        let mut best = (f64::INFINITY, self.corner(side));
        for w in self.sides[side].line.windows(2) {
            let [(a, start), (b, end)] = [w[0], w[1]];
            let (share, squared) = in_segment(point, &a, &b);
            if squared < best.0 {
                let on_edge = Place {
                    position: position + share * (b - a).norm(),
                    side,
                    at: Some(start + share * (end - start)),
                    point: a + share * (b - a),
                };
                best = (squared, on_edge);
            }
            position += (b - a).norm();
        }
        best.1
    }

    /// What is between two places along the loop.
    fn piece(&self, [from, to]: &[Place; 2]) -> Piece {
        // A corner is at the end of the side before it.
        let last = if to.at.is_some() { to.side } else { to.side - 1 };
        Piece { patch: self.face, of_loop: 0, sides: [from.side, last], at: [from.at, to.at] }
    }
}

/// Whether two cuts cross each other or have a common end.
fn meet([a, b]: &[Place; 2], [c, d]: &[Place; 2]) -> bool {
    let is_inside = |place: &Place| a.position < place.position && place.position < b.position;
    let ends = [a, b].iter().any(|p| [c, d].iter().any(|q| p.position == q.position));
    ends || is_inside(c) != is_inside(d)
}
