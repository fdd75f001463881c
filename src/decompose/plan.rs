//! Where a geometry is cut: planes, chosen one after the other by a coarse mesh.
//!
//! A part that is to become p parts is cut by one plane into two that become ⌊p/2⌋ and ⌈p/2⌉, with shares of the tets as these. Candidates
//! are planes across the axes (a k-d tree), across the principal axes of the part, and in random directions (thesis 4.1.1), each at
//! nine places within the allowance. The one is taken that crosses least: tets, and above all
//!
//! - boundary triangles at a small angle, or parallel to them and near: the tets there would be slices as thin,
//! - curves that run along the plane, and corners beside it: short edges,
//! - other planes at a small angle, and lines that others leave on the planes before it: narrow strips. A plane may cut several pieces.

use super::Evidence;
use super::evidence::{Crossed, Sample};
use super::scan::{Scan, is_met};
use crate::kernel::random::Random;
use crate::kernel::tree;
use crate::{Point, Vector};
use csg::Aabb;
use nalgebra::{Matrix3, SymmetricEigen};
use rayon::prelude::*;

/// A plane that cuts, oriented.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CutPlane {
    /// A point on it.
    pub point: Point,
    /// Its unit normal.
    pub normal: Vector,
}

impl CutPlane {
    /// The signed distance of a point.
    pub fn value(&self, point: &Point) -> f64 {
        self.normal.dot(&(point - self.point))
    }

    /// Whether a point is on the side that the normal points to.
    fn is_positive(&self, point: &Point) -> bool {
        self.value(point) > 0.0
    }

    /// The samples behind it and in front of it.
    fn split<'a>(&self, samples: &[&'a Sample]) -> [Vec<&'a Sample>; 2] {
        let (positive, negative) = samples.iter().partition(|sample| self.is_positive(&sample.point));
        [negative, positive]
    }

    /// Whether it is no further than `room` from some point of a box.
    fn comes_near(&self, bounds: &Aabb, room: f64) -> bool {
        let half = 0.5 * (bounds.max - bounds.min);
        let reach = half.dot(&self.normal.abs());
        self.value(&nalgebra::center(&bounds.min, &bounds.max)).abs() <= reach + room
    }

    /// How bad it is to pass a spot as near as it does: nothing where it keeps away, or goes right through.
    fn crowds(&self, spot: &Spot) -> f64 {
        let distance = self.value(&spot.point).abs() / spot.near;
        if distance > 1.0 || spot.is_exact && distance < SAME {
            return 0.0;
        }
        CORNER * (1.0 - distance) / (ROOM + distance)
    }
}

/// A point that planes keep away from.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spot {
    pub point: Point,
    /// Nearer than this there is no room for good tets.
    pub near: f64,
    /// Whether it is known so well that a plane may go right through it.
    pub is_exact: bool,
}

/// One side of a plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Half {
    /// The plane, by its place in [`Cuts::planes`].
    pub plane: usize,
    /// Whether it is the side that the normal points to.
    pub positive: bool,
}

/// Convex pieces of space, one for each part.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cuts {
    /// The planes.
    pub planes: Vec<CutPlane>,
    /// The pieces: intersections of sides of planes.
    pub leaves: Vec<Vec<Half>>,
}

impl Half {
    /// How far inside a point is.
    fn depth(self, planes: &[CutPlane], point: &Point) -> f64 {
        let value = planes[self.plane].value(point);
        if self.positive { value } else { -value }
    }

    /// Whether a point belongs to it; those on the plane do to the side that the normal points away from.
    fn holds(self, planes: &[CutPlane], point: &Point) -> bool {
        planes[self.plane].is_positive(point) == self.positive
    }
}

impl Cuts {
    /// The piece that a point lies in; of several, where it lies on a plane, the first.
    pub fn leaf_of(&self, point: &Point) -> usize {
        let holds = |leaf: &Vec<Half>| leaf.iter().all(|half| half.holds(&self.planes, point));
        self.leaves.iter().position(holds).expect("the pieces fill space")
    }

    /// The pieces that one of some points is in, or is no further from than `room`.
    pub fn leaves_near(&self, points: &[Point], room: f64) -> impl Iterator<Item = usize> {
        let reaches = move |half: &Half| points.iter().any(|point| half.depth(&self.planes, point) > -room);
        (0..self.leaves.len()).filter(move |&leaf| self.leaves[leaf].iter().all(reaches))
    }

    /// The pieces that planes make one after the other: each cuts all pieces that have evidence on both sides of it.
    pub fn by_planes(planes: &[CutPlane], evidence: &Evidence) -> Self {
        let mut leaves = vec![(Vec::new(), evidence.samples.iter().collect::<Vec<&Sample>>())];
        for (plane, cut) in planes.iter().enumerate() {
            leaves = leaves
                .into_iter()
                .flat_map(|(halves, samples)| {
                    let [negative, positive] = cut.split(&samples);
                    if positive.is_empty() || negative.is_empty() {
                        return vec![(halves, samples)];
                    }
                    vec![
                        (with_half(&halves, plane, false), negative),
                        (with_half(&halves, plane, true), positive),
                    ]
                })
                .collect();
        }
        Self { planes: planes.to_vec(), leaves: leaves.into_iter().map(|leaf| leaf.0).collect() }
    }
}

/// Which planes are considered.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Candidates {
    /// All of the following but the last.
    #[default]
    All,
    /// Across the axes: a k-d tree.
    Axes,
    /// Across the principal axes of each part.
    Principal,
    /// In random directions.
    Random,
    /// Across the longest side of each part's box, in the middle of its tets, whatever is there.
    Median,
}

/// How planes are chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Which planes are considered.
    pub candidates: Candidates,
    /// How far the share of tets on one side of a plane may be off, as a part of the smaller share wanted; four times as far where
    /// nothing can be cut well.
    pub allowance: f64,
    /// Random directions that are tried for each plane.
    pub tries: usize,
    /// Which random directions.
    pub seed: u64,
    /// Whether planes may go right through corners.
    pub through_corners: bool,
}

impl Default for Settings {
    /// Two percent, as the thesis has it.
    fn default() -> Self {
        Self { candidates: Candidates::All, allowance: 0.02, tries: 12, seed: 0, through_corners: true }
    }
}

/// Too many parts for what there is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{parts} parts are more than this geometry can be cut into; ask for fewer, or smaller sizes")]
pub struct TooManyParts {
    /// The parts wanted.
    pub parts: u32,
}

/// A plane that cuts less than this badly, in cells, is as clear as any: no further directions are tried.
const CLEAR_CUT: f64 = 0.1;

/// What a cell that is cut badly costs, in cells that are cut well.
const BAD: f64 = 100.0;

/// Where nothing can be cut well, shares may be so many times further off.
const AT_WORST: f64 = 4.0;

/// A plane that cuts other pieces already may be so many times further off the wanted shares.
const AGAIN: f64 = 2.5;

/// What a spot costs that a plane passes near, in cells that are cut badly.
const CORNER: f64 = 3.0;

/// Nearer than this part of the room that is wanted, it does not get much worse.
const ROOM: f64 = 0.1;

/// Nearer than this, in units of the room that is wanted, planes pass through one point, and parallel ones are one.
pub(super) const SAME: f64 = 1e-9;

/// Planes that are not across an axis cost so many times what they cut: those across the axes meet each other, and mostly the faces of
/// the geometry, at right angles, which leaves more room than the cost of each plane alone tells. Without it the smallest angles of NETGEN's tutorials in 16
/// and 32 parts are between 2° and 27°, with it but one are above 16°; with 4 some are at 2° again, as shallow cuts across an axis are preferred.
const OBLIQUE: f64 = 2.0;

/// A plane is across an axis if that component of its normal is at least this.
const ALONG: f64 = 1.0 - 1e-9;

/// Planes that meet at a smaller angle than this make slices: its sine.
const SHALLOW: f64 = 0.6;

/// Cuts space into so many pieces with equal shares of the samples.
///
/// # Errors
/// If there are too few samples to tell parts from one another.
pub fn plan(evidence: &Evidence, parts: u32, settings: &Settings) -> Result<Cuts, TooManyParts> {
    let mut cuts = Cuts::default();
    let all = Piece { halves: Vec::new(), samples: evidence.samples.iter().collect(), parts };
    let mut waiting = vec![all];
    while let Some(piece) = waiting.pop() {
        if piece.parts == 1 {
            cuts.leaves.push(piece.halves);
            continue;
        }
        if piece.samples.len() < 2 * piece.parts as usize {
            return Err(TooManyParts { parts });
        }
        let plane = piece.best_plane(&cuts, evidence, settings);
        let index = cuts.planes.iter().position(|known| *known == plane).unwrap_or(cuts.planes.len());
        let children = piece.cut(&plane, index);
        if children.iter().any(|child| child.samples.is_empty()) {
            return Err(TooManyParts { parts });
        }
        if index == cuts.planes.len() {
            cuts.planes.push(plane);
        }
        // The last in is the first out: pieces come in the order of the tree.
        waiting.extend(children.into_iter().rev());
    }
    Ok(cuts)
}

/// What a plane cuts, in cells.
#[derive(Clone, Copy, Debug)]
struct Cost {
    cut: f64,
    /// Those that it cuts badly.
    bad: f64,
}

impl Cost {
    fn total(self) -> f64 {
        self.cut + BAD * self.bad
    }
}

/// Planes that were chosen already: those that bound a piece, and the others.
struct Others {
    before: Vec<CutPlane>,
    beside: Vec<CutPlane>,
    /// Corners, and where these planes meet each other or the boundary.
    spots: Vec<Spot>,
}

impl Others {
    fn of(piece: &Piece, cuts: &Cuts, crossed: &Crossed) -> Self {
        let is_before = |plane: usize| piece.halves.iter().any(|half| half.plane == plane);
        let bounds = piece.bounds();
        let room = piece.samples.iter().map(|sample| sample.near).fold(0.0, f64::max);
        let comes_near = |plane: &usize| is_before(*plane) || cuts.planes[*plane].comes_near(&bounds, room);
        let (before, beside): (Vec<usize>, Vec<usize>) =
            (0..cuts.planes.len()).filter(comes_near).partition(|&plane| is_before(plane));
        let [before, beside]: [Vec<CutPlane>; 2] =
            [before, beside].map(|list| list.into_iter().map(|p| cuts.planes[p]).collect());
        let mut spots = piece.meeting_points(cuts, &before, &beside);
        spots.extend(crossed.meeting_points(&before, &beside));
        spots.extend(crossed.corners());
        Self { before, beside, spots }
    }
}

/// A piece of space that is to become some parts.
struct Piece<'a> {
    halves: Vec<Half>,
    samples: Vec<&'a Sample>,
    parts: u32,
}

impl<'a> Piece<'a> {
    fn cut(&self, plane: &CutPlane, index: usize) -> [Self; 2] {
        let [negative, positive] = plane.split(&self.samples);
        let child = |samples, positive, parts| {
            let halves = with_half(&self.halves, index, positive);
            Piece { halves, samples, parts }
        };
        let less = self.parts / 2;
        [child(negative, false, less), child(positive, true, self.parts - less)]
    }

    /// The share of the samples that is to be behind the next plane.
    fn share(&self) -> f64 {
        f64::from(self.parts / 2) / f64::from(self.parts)
    }

    fn best_plane(&self, cuts: &Cuts, evidence: &Evidence, settings: &Settings) -> CutPlane {
        let directions = self.directions(settings, settings.seed << 32 | cuts.planes.len() as u64);
        if settings.candidates == Candidates::Median {
            return Scan::new(&self.samples, directions[0][0]).places(self.share(), 0.0)[0];
        }
        let crossed = evidence.within(|point| self.holds(cuts, point));
        let others = Others::of(self, cuts, &crossed);
        let mut scans: Vec<Vec<Scan>> = Vec::new();
        let mut best: Option<(Cost, CutPlane)> = None;
        for allowance in [1.0, AT_WORST].map(|factor| factor * settings.allowance) {
            for (group, directions) in directions.iter().enumerate() {
                if scans.len() == group {
                    let scan = |normal: &Vector| Scan::new(&self.samples, *normal);
                    scans.push(directions.par_iter().map(scan).collect());
                }
                let candidates = self.candidates(&scans[group], group == 0, &others, allowance, settings);
                let cost = |(plane, met): (CutPlane, Vec<&Sample>)| {
                    (self.cost(&plane, &met, &crossed, &others), plane)
                };
                let costs: Vec<(Cost, CutPlane)> = candidates.into_par_iter().map(cost).collect();
                best = best.into_iter().chain(costs).min_by(|a, b| a.0.total().total_cmp(&b.0.total()));
                if best.as_ref().is_some_and(|(cost, _)| cost.bad < CLEAR_CUT) {
                    break;
                }
            }
            if best.as_ref().is_some_and(|(cost, _)| cost.bad < 1.0) {
                break;
            }
        }
        best.expect("there are directions").1
    }

    /// Planes to try, and the samples that they meet: at places along some directions, and through corners; if asked for, those that cut other pieces
    /// already. A plane that is one of these leaves no narrow strips beside them, and one right through a corner none beside that.
    fn candidates(
        &self,
        scans: &[Scan<'a>],
        with_others: bool,
        others: &Others,
        allowance: f64,
        settings: &Settings,
    ) -> Vec<(CutPlane, Vec<&'a Sample>)> {
        let (share, again) = (self.share(), AGAIN * allowance);
        let exact = others.spots.iter().filter(|spot| settings.through_corners && spot.is_exact);
        let exact: Vec<&Spot> = exact.collect();
        let across = |scan: &Scan<'a>| {
            let planes = [scan.places(share, allowance), scan.through(&exact, share, again)].concat();
            planes.into_iter().map(|plane| (plane, scan.met_by(&plane))).collect::<Vec<_>>()
        };
        let mut found: Vec<_> = scans.par_iter().flat_map(across).collect();
        if with_others {
            let fits = |plane: &&CutPlane| self.shares(plane, again);
            let known = others.beside.par_iter().filter(fits).map(|plane| (*plane, self.met_by(plane)));
            found.extend(known.collect::<Vec<_>>());
        }
        found
    }

    /// Whether a plane leaves about the wanted shares on both sides.
    fn shares(&self, plane: &CutPlane, allowance: f64) -> bool {
        let count = self.samples.len() as f64;
        let negative = self.samples.iter().filter(|sample| !plane.is_positive(&sample.point)).count() as f64;
        let share = self.share();
        (negative / count - share).abs() <= allowance * share
    }

    /// The samples that a plane meets.
    fn met_by(&self, plane: &CutPlane) -> Vec<&'a Sample> {
        self.samples.iter().filter(|sample| is_met(plane, sample)).copied().collect()
    }

    /// Points on this piece where a plane that bounds it and two others meet, and how far from them there is no room.
    fn meeting_points(&self, cuts: &Cuts, before: &[CutPlane], beside: &[CutPlane]) -> Vec<Spot> {
        let planes: Vec<&CutPlane> = before.iter().chain(beside).collect();
        let near = self.samples.iter().map(|sample| sample.near).sum::<f64>() / self.samples.len() as f64;
        let bounds = self.bounds();
        let touches = |point: &Point| {
            let beside = |half: &Half| half.depth(&cuts.planes, point) > -near;
            let inside = (0..3).all(|k| point[k] > bounds.min[k] - near && point[k] < bounds.max[k] + near);
            inside && self.halves.iter().all(beside)
        };
        let mut points = Vec::new();
        for a in 0..before.len() {
            for b in a + 1..planes.len() {
                for c in b + 1..planes.len() {
                    let point = meeting_point([planes[a], planes[b], planes[c]]);
                    points.extend(point.filter(&touches).map(|point| Spot { point, near, is_exact: true }));
                }
            }
        }
        points
    }

    fn holds(&self, cuts: &Cuts, point: &Point) -> bool {
        self.halves.iter().all(|half| half.holds(&cuts.planes, point))
    }

    /// Unit normals of the planes to try, those to be tried first in a list of their own: others only where no plane of these is clear.
    fn directions(&self, settings: &Settings, seed: u64) -> Vec<Vec<Vector>> {
        let axes = || vec![Vector::x(), Vector::y(), Vector::z()];
        match settings.candidates {
            Candidates::Axes => vec![axes()],
            Candidates::Principal => vec![self.principal_axes()],
            Candidates::Random => vec![random_directions(settings.tries, seed)],
            Candidates::All => {
                let others = [self.principal_axes(), random_directions(settings.tries, seed)].concat();
                vec![axes(), others]
            }
            Candidates::Median => {
                let bounds = self.bounds();
                vec![vec![axes()[(bounds.max - bounds.min).imax()]]]
            }
        }
    }

    fn bounds(&self) -> Aabb {
        tree::bounds(&self.samples.iter().map(|sample| sample.point).collect::<Vec<_>>())
    }

    /// The axes of inertia of the samples.
    fn principal_axes(&self) -> Vec<Vector> {
        let count = self.samples.len() as f64;
        let mean = self.samples.iter().map(|sample| sample.point.coords).sum::<Vector>() / count;
        let spread: Matrix3<f64> = self
            .samples
            .iter()
            .map(|sample| {
                let away = sample.point.coords - mean;
                away * away.transpose()
            })
            .sum();
        let axes = SymmetricEigen::new(spread).eigenvectors;
        axes.column_iter().filter_map(|axis| Vector::from(axis).try_normalize(0.0)).collect()
    }

    /// Cells that a plane cuts, those that it cuts badly many times over.
    fn cost(&self, plane: &CutPlane, cut: &[&Sample], crossed: &Crossed, others: &Others) -> Cost {
        let near = |sample: &Sample, other: &CutPlane| other.value(&sample.point).abs() < sample.near;
        let mut bad = crossed.badly_cut(plane, shallow);
        for wall in &others.before {
            let on_wall: Vec<&Sample> = cut.iter().filter(|sample| near(sample, wall)).copied().collect();
            let line = plane.normal.cross(&wall.normal);
            bad += shallow(line.norm()) * on_wall.len() as f64;
            // What cuts the other side of the wall leaves a line on it too.
            for other in others.beside.iter().filter(|other| *other != plane) {
                let sine = line.normalize().cross(&other.normal.cross(&wall.normal).normalize()).norm();
                let weight = shallow(sine);
                if weight > 0.0 {
                    bad += weight * on_wall.iter().filter(|sample| near(sample, other)).count() as f64;
                }
            }
        }
        bad += others.spots.iter().map(|spot| plane.crowds(spot)).sum::<f64>();
        let factor = if plane.normal.amax() < ALONG { OBLIQUE } else { 1.0 };
        Cost { cut: factor * cut.len() as f64, bad: factor * bad }
    }
}

/// A piece with one half more.
fn with_half(halves: &[Half], plane: usize, positive: bool) -> Vec<Half> {
    [halves, &[Half { plane, positive }]].concat()
}

/// Where three planes meet, unless nearly at no point.
pub(super) fn meeting_point(planes: [&CutPlane; 3]) -> Option<Point> {
    let rows = planes.map(|plane| plane.normal.transpose());
    let offsets = planes.map(|plane| plane.normal.dot(&plane.point.coords));
    let inverse = Matrix3::from_rows(&rows).try_inverse()?;
    Some(Point::from(inverse * Vector::from(offsets)))
}

/// How bad an angle is by its sine: from 1 for none to 0 for one that is large enough.
fn shallow(sine: f64) -> f64 {
    (1.0 - sine / SHALLOW).max(0.0)
}

/// Directions spread over the sphere at random, the same for the same seed.
fn random_directions(count: usize, seed: u64) -> Vec<Vector> {
    let mut random = Random::new(seed);
    let mut number = || 2.0 * random.unit() - 1.0;
    std::iter::from_fn(|| Some(Vector::new(number(), number(), number())))
        .filter(|v| v.norm_squared() <= 1.0)
        .filter_map(|v| v.try_normalize(1e-3))
        .take(count)
        .collect()
}
