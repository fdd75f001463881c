//! Finds a seed on every piece of the intersection curves.
//!
//! In a leaf the curve of a pair is monotone: it has at most one point on each plane perpendicular
//! to a direction. So a trace through the leaf **covers** the slab between the perpendicular planes
//! through its ends: no other curve of the pair is in that slab. A leaf is split until each part is
//! excluded, covered by traces, or so small that Newton's method from its center finds the curve if
//! there is one.

use super::bounds::split;
use super::neighborhood::Tolerances;
use super::octree::{Leaf, Octree, can_meet, is_monotone};
use super::trace::{Trace, Tracer, step_box};
use crate::interval::{Cell, dot, middle};
use crate::project::project_to_both;
use crate::{Geometry, Interval, Point, Surface, SurfaceId, Vector};
use std::collections::{HashMap, VecDeque};

/// Largest depth of parts of a leaf. In 1/256 of a cell in which it is monotone, a curve is nearly
/// straight, and one step of Newton's method from the center leads to it.
const DEPTH: u32 = 8;
/// Largest number of parts per leaf, visited by decreasing size, for surfaces that are nearly
/// tangent all along a leaf: then no part can be excluded. It suffices for all parts of 1/8 of the
/// cell.
const MOST_PARTS: usize = 600;
/// The same limit for pairs with a seam, because about a hundred cells along a seam contain such a
/// pair.
const PARTS_BESIDE_SEAM: usize = 73;
/// Smallest sine of the angle between surfaces with a seam at which a point counts as a crossing
/// and not as a point of the seam. Newton's method converges to the seam within about 10⁻⁶.
const LEAST_SINE: f64 = 1e-4;
/// Margins around a leaf, as fractions of its sides, within which the curve may be monotone too.
const ROOMS: [f64; 4] = [0.5, 0.2, 0.08, 0.03];

/// Chords near a leaf are bisected until their sagitta is below this fraction of the leaf: the
/// trace covers only what is farther from the faces. With the coarser chords of the trace, most
/// leaves along an extrusion path would be split into a hundred parts.
const FINE: f64 = 0.01;

/// Number of consecutive chords with a common box: a trace beside a contact may have ten thousand,
/// and as many leaves around it.
const RUN: usize = 64;

/// A trace with its steps refined to shorter chords.
struct RefinedTrace {
    trace: Trace,
    /// The box of each run of steps.
    step_boxes: Vec<Cell>,
    chords: Vec<Chord>,
    /// The box of the curve along each run of chords.
    chord_boxes: Vec<Cell>,
}

/// A chord of a curve.
struct Chord {
    ends: [Point; 2],
    /// The point of the curve at the middle of the chord, if Newton's method finds one.
    middle: Option<Point>,
    /// Upper bound of the distance between curve and chord.
    sagitta: f64,
}

/// Traces all pieces of intersection curves in the leaves where they are relevant.
pub(super) fn trace_all(geometry: &Geometry, tree: &Octree, tolerances: &Tolerances) -> Vec<Trace> {
    let mut known: HashMap<[SurfaceId; 2], Vec<usize>> = HashMap::new();
    let mut all: Vec<RefinedTrace> = Vec::new();
    for leaf in &tree.leaves {
        for &pair in &leaf.pairs {
            let of_pair = known.entry(pair).or_default();
            search(geometry, tree, leaf, pair, &mut all, of_pair, tolerances);
        }
    }
    all.into_iter().map(|known| known.trace).collect()
}

/// Traces the curves of a pair in a leaf that are not yet known; `of_pair` indexes the pair's
/// traces in `all`.
fn search(
    geometry: &Geometry,
    tree: &Octree,
    leaf: &Leaf,
    pair: [SurfaceId; 2],
    all: &mut Vec<RefinedTrace>,
    of_pair: &mut Vec<usize>,
    tolerances: &Tolerances,
) {
    let [a, b] = pair.map(|s| &geometry.surfaces[s.index()]);
    let center = middle(&leaf.cell);
    let direction = a.gradient(&center).cross(&b.gradient(&center));
    // In a larger monotone cell, the slab of a trace extends beyond the point where it leaves the
    // leaf.
    let wider = ROOMS.into_iter().map(|room| widened(&leaf.cell, room));
    let cell = wider.into_iter().find(|wide| is_monotone(a, b, wide, &direction)).unwrap_or(leaf.cell);
    let mut covered = Vec::new();
    for &t in of_pair.iter() {
        all[t].refine([a, b], &leaf.cell, tolerances);
        cover(&all[t], &cell, &direction, &mut covered);
    }
    let reachable = widened(&leaf.cell, 1.0 / 64.0);
    // Newton's method may converge to a seam of the pair, where no curve can be traced.
    let has_seam = geometry.seam(pair).is_some();
    let crosses = |p: &Point| !has_seam || a.normal(p).cross(&b.normal(p)).norm() > LEAST_SINE;
    let is_here = |p: &Point| {
        (0..3).all(|i| reachable[i].contains(p[i]))
            && crosses(p)
            && tree.leaf(p).is_some_and(|leaf| tree.is_relevant(leaf, pair))
    };
    let mut open = VecDeque::from([(leaf.cell, 0)]);
    let most = if has_seam { PARTS_BESIDE_SEAM } else { MOST_PARTS };
    let mut count = 0;
    while let Some((part, depth)) = open.pop_front() {
        count += 1;
        if is_covered(&slab(&part, &direction), &covered) || !can_meet(a, b, &part) {
            continue;
        }
        let seed = project_to_both(a, b, &middle(&part), tolerances.exact).ok().filter(is_here);
        if let Some(seed) = seed.filter(|seed| !of_pair.iter().any(|&t| all[t].passes(seed))) {
            let trace = Tracer::new(geometry, tree, pair, tolerances).trace(&seed);
            // A trace with one point is a contact from which no step continues.
            if trace.points.len() > 1 {
                let mut known = RefinedTrace::new(trace, [a, b], tolerances);
                known.refine([a, b], &leaf.cell, tolerances);
                cover(&known, &cell, &direction, &mut covered);
                of_pair.push(all.len());
                all.push(known);
            }
        }
        if depth < DEPTH && count < most && !is_covered(&slab(&part, &direction), &covered) {
            open.extend(split(&part).map(|part| (part, depth + 1)));
        }
    }
}

impl Chord {
    fn new([a, b]: [&Surface; 2], ends: [Point; 2], tolerances: &Tolerances) -> Self {
        /// A step turns little: the deviation is nowhere twice that in the middle.
        const ROOM: f64 = 2.0;
        let middle = nalgebra::center(&ends[0], &ends[1]);
        let on = project_to_both(a, b, &middle, tolerances.exact).ok();
        let sagitta = on.map_or((ends[1] - ends[0]).norm(), |on| ROOM * (on - middle).norm());
        Self { ends, middle: on, sagitta }
    }

    /// The box of the curve.
    fn bounds(&self) -> Cell {
        let [from, to] = self.ends;
        [0, 1, 2].map(|i| Interval::new(from[i].min(to[i]) - self.sagitta, from[i].max(to[i]) + self.sagitta))
    }

    /// The point at which to bisect the chord for a cell, if the chord is near and still too
    /// coarse.
    fn cut_for(&self, cell: &Cell) -> Option<Point> {
        let fine = FINE * cell.iter().map(Interval::width).fold(f64::INFINITY, f64::min);
        let is_coarse = self.sagitta > fine && (self.ends[1] - self.ends[0]).norm() > fine;
        self.middle.filter(|_| is_coarse && chord_in(&self.ends, cell, -self.sagitta).is_some())
    }
}

impl RefinedTrace {
    fn new(trace: Trace, pair: [&Surface; 2], tolerances: &Tolerances) -> Self {
        let steps: Vec<[Point; 2]> = trace.points.windows(2).map(|ends| [ends[0], ends[1]]).collect();
        let step_boxes = boxes_of_runs(&steps, |[from, to]| step_box(from, to));
        let chords: Vec<Chord> = steps.into_iter().map(|ends| Chord::new(pair, ends, tolerances)).collect();
        Self { trace, step_boxes, chord_boxes: boxes_of_runs(&chords, Chord::bounds), chords }
    }

    /// Whether a point of the intersection of both surfaces lies on this trace.
    fn passes(&self, point: &Point) -> bool {
        let is_in = |cell: &Cell| (0..3).all(|i| cell[i].contains(point[i]));
        let near = self.step_boxes.iter().enumerate().filter(|(_, cell)| is_in(cell));
        near.map(|(run, _)| run).any(|run| self.trace.passes(run * RUN..(run + 1) * RUN, point))
    }

    /// The chords that may be in a cell.
    fn chords_near(&self, cell: &Cell) -> impl Iterator<Item = &Chord> {
        let meets = |(_, other): &(&[Chord], &Cell)| {
            (0..3).all(|i| other[i].lo <= cell[i].hi && cell[i].lo <= other[i].hi)
        };
        self.chords.chunks(RUN).zip(&self.chord_boxes).filter(meets).flat_map(|(run, _)| run)
    }

    /// Bisects the chords near a cell until they are fine enough.
    fn refine(&mut self, pair: [&Surface; 2], cell: &Cell, tolerances: &Tolerances) {
        if !self.chords_near(cell).any(|chord| chord.cut_for(cell).is_some()) {
            return;
        }
        let mut open = std::mem::take(&mut self.chords);
        open.reverse();
        while let Some(chord) = open.pop() {
            match chord.cut_for(cell) {
                Some(middle) => {
                    let [from, to] = chord.ends;
                    open.push(Chord::new(pair, [middle, to], tolerances));
                    open.push(Chord::new(pair, [from, middle], tolerances));
                }
                None => self.chords.push(chord),
            }
        }
        self.chord_boxes = boxes_of_runs(&self.chords, Chord::bounds);
    }
}

/// The box of each run of items.
fn boxes_of_runs<T>(items: &[T], bounds: impl Fn(&T) -> Cell) -> Vec<Cell> {
    let hull =
        |a: Cell, b: Cell| [0, 1, 2].map(|i| Interval::new(a[i].lo.min(b[i].lo), a[i].hi.max(b[i].hi)));
    items.chunks(RUN).filter_map(|run| run.iter().map(&bounds).reduce(hull)).collect()
}

/// A cell enlarged by a fraction of its sides on each side.
fn widened(cell: &Cell, part: f64) -> Cell {
    cell.map(|side| Interval::new(side.lo - part * side.width(), side.hi + part * side.width()))
}

/// The range of a cell along a direction.
fn slab(cell: &Cell, direction: &Vector) -> Interval {
    dot(direction, cell)
}

/// Adds the slabs that a trace covers in a cell along a direction, and merges adjacent ones.
fn cover(known: &RefinedTrace, cell: &Cell, direction: &Vector, covered: &mut Vec<Interval>) {
    for chord in known.chords_near(cell) {
        if let Some([from, to]) = chord_in(&chord.ends, cell, chord.sagitta) {
            let [x, y] = [from, to].map(|p| p.coords.dot(direction));
            covered.push(Interval::new(x.min(y), x.max(y)));
        }
    }
    covered.sort_by(|x, y| x.lo.total_cmp(&y.lo));
    // Rounding at the common end of consecutive chords.
    let slack = direction.norm() * f64::EPSILON * cell.iter().map(Interval::magnitude).fold(0.0, f64::max);
    covered.dedup_by(|next, last| {
        let touch = next.lo <= last.hi + 8.0 * slack;
        if touch {
            last.hi = last.hi.max(next.hi);
        }
        touch
    });
}

/// The ends of the part of a chord whose distance from the outside of a cell is at least
/// `distance`.
fn chord_in(ends: &[Point], cell: &Cell, distance: f64) -> Option<[Point; 2]> {
    let chord = ends[1] - ends[0];
    let (mut from, mut to) = (0.0, 1.0);
    for i in 0..3 {
        let (low, high) = (cell[i].lo + distance - ends[0][i], cell[i].hi - distance - ends[0][i]);
        if chord[i] == 0.0 {
            if low > 0.0 || high < 0.0 {
                return None;
            }
            continue;
        }
        let (enter, leave) = (low / chord[i], high / chord[i]);
        from = f64::max(from, enter.min(leave));
        to = f64::min(to, enter.max(leave));
    }
    (from < to).then(|| [ends[0] + chord * from, ends[0] + chord * to])
}

/// Whether a slab is inside a covered one.
fn is_covered(slab: &Interval, covered: &[Interval]) -> bool {
    covered.iter().any(|c| c.lo <= slab.lo && slab.hi <= c.hi)
}

#[cfg(test)]
mod tests {
    use crate::{Features, language};

    fn closed_curves(source: &str) -> usize {
        let geometry =
            language::parse_geometry(&format!("algebraic3d {source}"), "test.geo").unwrap().geometry;
        Features::find(&geometry).unwrap().curves.iter().filter(|c| c.ends.is_none()).count()
    }

    #[test]
    fn small_caps_and_holes_anywhere_in_a_large_body_are_found() {
        for k in 0..40 {
            let (x, y) = (0.1 + 0.0201 * f64::from(k), 0.9 - 0.0173 * f64::from(k));
            let r = 10_f64.powf(-2.0 - 0.1 * f64::from(k));
            // A ball that protrudes from a face by a tenth of its radius, and a hole of the same
            // radius.
            let source = format!(
                "solid s = orthobrick (0, 0, 0; 1, 1, 1) or sphere ({x}, {y}, {z}; {r}); tlo s;",
                z = 1.0 - 0.9 * r
            );
            assert_eq!(closed_curves(&source), 1, "a ball of radius {r} at {x}, {y}");
            let source = format!(
                "solid s = orthobrick (0, 0, 0; 1, 1, 1) and not cylinder ({x}, {y}, 0; {x}, {y}, 1; {r}); tlo s;"
            );
            assert_eq!(closed_curves(&source), 2, "a hole of radius {r} at {x}, {y}");
        }
    }
}
