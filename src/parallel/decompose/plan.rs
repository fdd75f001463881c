//! Choice of the cutting planes, one after the other, from a coarse mesh.
//!
//! A piece that will become p parts is cut by one plane into two that will become ⌊p/2⌋ and ⌈p/2⌉,
//! with tets in the same proportion. Candidates are planes across the axes (a k-d tree), across the
//! principal axes of the piece, and in random directions (thesis 4.1.1), each at nine positions
//! within the allowance. The plane of least cost wins. The cost counts the tets cut, and with a
//! high weight
//!
//! - boundary triangles cut at a small angle, or parallel and close to the plane: tets there would
//!   be thin slices,
//! - curves that run along the plane, and corners next to it: short edges,
//! - other planes at a small angle, and intersection lines close together on earlier planes: narrow
//!   strips.
//!
//! A plane may cut several pieces. Of a geometry with periodic faces only planes are taken that
//! keep them periodic.

use super::CutStatistics;
use super::cuts::{CutPlane, Cuts, Half, Spot, meeting_point, with_half};
use super::grid::grid;
use super::periodic::PeriodicWithin;
use super::scan::{Scan, is_met};
use super::statistics::{Crossed, Sample};
use crate::ground::kernel::random::Random;
use crate::ground::kernel::tree;
use crate::{Point, Vector};
use csg::Aabb;
use nalgebra::{Matrix3, SymmetricEigen};
use rayon::prelude::*;

/// The directions of candidate planes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Candidates {
    /// Axes, principal axes and random directions.
    #[default]
    All,
    /// Across the axes: a k-d tree.
    Axes,
    /// Across the principal axes of each piece.
    Principal,
    /// In random directions.
    Random,
    /// Across the longest side of each piece's box, at the median of its samples, without a cost.
    Median,
}

/// Parameters of `plan`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanSettings {
    /// The directions of candidate planes.
    pub candidates: Candidates,
    /// The maximum error of the share of tets on one side of a plane, as a fraction of the smaller
    /// target share; four times as much if no good plane is found.
    pub allowance: f64,
    /// The number of random directions per plane.
    pub tries: usize,
    /// The seed of the random directions.
    pub seed: u64,
    /// Whether planes may go exactly through corners.
    pub through_corners: bool,
    /// Whether periodic faces must be in one part with their copies.
    pub together: bool,
}

impl Default for PlanSettings {
    /// An allowance of two percent.
    fn default() -> Self {
        Self {
            candidates: Candidates::All,
            allowance: 0.02,
            tries: 12,
            seed: 0,
            through_corners: true,
            together: false,
        }
    }
}

/// Why there are no planes for the number of parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TooManyParts {
    /// The coarse mesh has too few samples.
    #[error("this geometry cannot be cut into {0} parts; request fewer parts or smaller sizes")]
    Samples(u32),
    /// All planes would cut a periodic face otherwise than its copy.
    #[error(
        "no planes cut this geometry into {0} parts so that periodic faces and their copies are cut alike: request \
         fewer parts, or take the method `surface`"
    )]
    Periodic(u32),
    /// All planes would separate periodic faces from their copies.
    #[error(
        "no planes cut this geometry into {0} parts so that each periodic face is in one part with its copy, which \
         Elmer needs: request fewer parts"
    )]
    Separated(u32),
}

/// A plane with less bad cost than this, in cells, is accepted without trying further directions.
const CLEAR_CUT: f64 = 0.1;

/// The cost of a badly cut cell, in units of a well cut cell.
const BAD: f64 = 100.0;

/// If no good plane is found, the allowance is multiplied by this.
const AT_WORST: f64 = 4.0;

/// The allowance is multiplied by this for planes that already cut other pieces.
const AGAIN: f64 = 2.5;

/// The cost of a spot close to a plane, in badly cut cells.
const CORNER: f64 = 3.0;

/// At distances below this fraction of the required room the cost grows little.
const ROOM: f64 = 0.1;

/// Below this distance, in units of the required room, planes pass through the same point, and
/// parallel ones are equal.
pub(super) const SAME: f64 = 1e-9;

/// Cost factor of planes that are not across an axis. Planes across axes meet each other, and
/// mostly the faces of the geometry, at right angles, an advantage that the cost of a single plane
/// does not include. Without the factor the smallest angles of NETGEN's tutorials in 16 and 32
/// parts go down to 2°; with it all but one are above 16°; with a factor of 4, shallow cuts across
/// an axis are preferred and 2° occurs again.
const OBLIQUE: f64 = 2.0;

/// A plane is across an axis if that component of its normal is at least this.
const ALONG: f64 = 1.0 - 1e-9;

/// Planes that meet at an angle with a smaller sine than this make slices.
const SHALLOW: f64 = 0.6;

/// Cuts space into `parts` pieces with equal shares of the samples, or with about equal ones if the
/// geometry is periodic in several directions.
///
/// # Errors
/// [`TooManyParts`] if there are too few samples to separate the parts, or no planes that keep
/// periodic faces periodic.
pub fn plan(statistics: &CutStatistics, parts: u32, settings: &PlanSettings) -> Result<Cuts, TooManyParts> {
    if let Some(cuts) = grid(statistics, parts, settings) {
        return Ok(cuts);
    }
    let mut cuts = Cuts::default();
    let mut waiting = vec![Piece::whole(statistics, parts)];
    while let Some(piece) = waiting.pop() {
        if piece.parts == 1 {
            cuts.leaves.push(piece.halves);
            continue;
        }
        if piece.samples.len() < 2 * piece.parts as usize {
            return Err(TooManyParts::Samples(parts));
        }
        let none = if settings.together { TooManyParts::Separated } else { TooManyParts::Periodic };
        let plane = piece.best_plane(&cuts, statistics, settings).ok_or(none(parts))?;
        let index = cuts.planes.iter().position(|known| *known == plane).unwrap_or(cuts.planes.len());
        let children = piece.cut(&plane, index);
        if children.iter().any(|child| child.samples.is_empty()) {
            return Err(TooManyParts::Samples(parts));
        }
        if index == cuts.planes.len() {
            cuts.planes.push(plane);
        }
        // Last in, first out: pieces come in the order of the tree.
        waiting.extend(children.into_iter().rev());
    }
    Ok(cuts)
}

/// The cost of a plane, in cells.
#[derive(Clone, Copy, Debug)]
struct Cost {
    cut: f64,
    /// Cells that it cuts badly.
    bad: f64,
}

impl Cost {
    fn total(self) -> f64 {
        self.cut + BAD * self.bad
    }
}

/// The planes chosen before: those that bound a piece, and the others near it.
struct Others {
    before: Vec<CutPlane>,
    beside: Vec<CutPlane>,
    /// Corners, and points where these planes meet each other or the boundary.
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

/// A piece of space that will become several parts.
pub(super) struct Piece<'a> {
    halves: Vec<Half>,
    pub samples: Vec<&'a Sample>,
    parts: u32,
}

impl<'a> Piece<'a> {
    /// All of space.
    pub fn whole(statistics: &'a CutStatistics, parts: u32) -> Self {
        Self { halves: Vec::new(), samples: statistics.samples.iter().collect(), parts }
    }

    fn cut(&self, plane: &CutPlane, index: usize) -> [Self; 2] {
        let [negative, positive] = plane.split(&self.samples);
        let child = |samples, positive, parts| {
            let halves = with_half(&self.halves, index, positive);
            Piece { halves, samples, parts }
        };
        let less = self.parts / 2;
        [child(negative, false, less), child(positive, true, self.parts - less)]
    }

    /// The target share of the samples behind the next plane.
    fn share(&self) -> f64 {
        f64::from(self.parts / 2) / f64::from(self.parts)
    }

    /// The plane of least cost; `None` if none keeps periodic faces periodic.
    fn best_plane(
        &self,
        cuts: &Cuts,
        statistics: &CutStatistics,
        settings: &PlanSettings,
    ) -> Option<CutPlane> {
        let periodic =
            PeriodicWithin::new(&statistics.periodic, &self.halves, &cuts.planes, settings.together);
        let mut directions = self.directions(settings, settings.seed << 32 | cuts.planes.len() as u64);
        if settings.candidates == Candidates::Median {
            let plane = Scan::new(&self.samples, directions[0][0]).places(self.share(), 0.0)[0];
            return periodic.allows(&plane).then_some(plane);
        }
        let normals = periodic.normals(&directions.concat());
        directions[0].extend(normals);
        let crossed = statistics.within(|point| self.contains(cuts, point));
        let others = Others::of(self, cuts, &crossed);
        let mut scans: Vec<Vec<Scan>> = Vec::new();
        let mut best: Option<(Cost, CutPlane)> = None;
        for allowance in [1.0, AT_WORST].map(|factor| factor * settings.allowance) {
            for (group, directions) in directions.iter().enumerate() {
                if scans.len() == group {
                    let scan = |normal: &Vector| Scan::new(&self.samples, *normal);
                    scans.push(directions.par_iter().map(scan).collect());
                }
                let shares = (self.share(), allowance);
                let candidates = self.candidates(&scans[group], group == 0, &others, shares, settings);
                best = self.better(best, candidates, (&crossed, &others), &periodic);
                if best.as_ref().is_some_and(|(cost, _)| cost.bad < CLEAR_CUT) {
                    break;
                }
            }
            if best.as_ref().is_some_and(|(cost, _)| cost.bad < 1.0) {
                break;
            }
        }
        best.map(|(_, plane)| plane)
    }

    /// The plane of least cost across one direction, with about this share of the samples behind
    /// it, and its cost. The share may be off by a part of the share `width` of a layer.
    pub fn best_of_scan(
        &self,
        scan: &Scan<'a>,
        (share, width): (f64, f64),
        cuts: &Cuts,
        (statistics, periodic): (&CutStatistics, &PeriodicWithin),
        settings: &PlanSettings,
    ) -> Option<(f64, CutPlane)> {
        let crossed = statistics.within(|_| true);
        let others = Others::of(self, cuts, &crossed);
        let mut best: Option<(Cost, CutPlane)> = None;
        // With the usual allowance planes through corners are less than half a layer off, so that
        // no two layers have the same.
        for factor in [1.0, AT_WORST, 2.0 * AT_WORST] {
            let shares = (share, factor * settings.allowance * width / share);
            let candidates = self.candidates(std::slice::from_ref(scan), false, &others, shares, settings);
            best = self.better(best, candidates, (&crossed, &others), periodic);
            if best.as_ref().is_some_and(|(cost, _)| cost.bad < 1.0) {
                break;
            }
        }
        best.map(|(cost, plane)| (cost.total(), plane))
    }

    /// The cheapest of the best plane so far and those of the candidates that keep periodic faces
    /// periodic.
    fn better(
        &self,
        best: Option<(Cost, CutPlane)>,
        mut candidates: Vec<(CutPlane, Vec<&Sample>)>,
        (crossed, others): (&Crossed, &Others),
        periodic: &PeriodicWithin,
    ) -> Option<(Cost, CutPlane)> {
        candidates.retain(|(plane, _)| periodic.allows(plane));
        let cost = |(plane, met): (CutPlane, Vec<&Sample>)| (self.cost(&plane, &met, crossed, others), plane);
        let costs: Vec<(Cost, CutPlane)> = candidates.into_par_iter().map(cost).collect();
        best.into_iter().chain(costs).min_by(|a, b| a.0.total().total_cmp(&b.0.total()))
    }

    /// Candidate planes, with the samples that they cut: at positions along some directions, and
    /// through corners; with `with_others` also planes that already cut other pieces. Reusing a
    /// plane avoids narrow strips, and going exactly through a corner avoids short edges.
    fn candidates(
        &self,
        scans: &[Scan<'a>],
        with_others: bool,
        others: &Others,
        (share, allowance): (f64, f64),
        settings: &PlanSettings,
    ) -> Vec<(CutPlane, Vec<&'a Sample>)> {
        let again = AGAIN * allowance;
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

    /// Whether the shares of the samples on both sides of a plane are about the target shares.
    fn shares(&self, plane: &CutPlane, allowance: f64) -> bool {
        let count = self.samples.len() as f64;
        let negative = self.samples.iter().filter(|sample| !plane.is_positive(&sample.point)).count() as f64;
        let share = self.share();
        (negative / count - share).abs() <= allowance * share
    }

    /// The samples that a plane cuts.
    fn met_by(&self, plane: &CutPlane) -> Vec<&'a Sample> {
        self.samples.iter().filter(|sample| is_met(plane, sample)).copied().collect()
    }

    /// Points on this piece where a plane that bounds it meets two others.
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

    fn contains(&self, cuts: &Cuts, point: &Point) -> bool {
        self.halves.iter().all(|half| half.contains(&cuts.planes, point))
    }

    /// Unit normals of candidate planes, in groups: later groups are tried only if no plane of the
    /// earlier ones is good.
    fn directions(&self, settings: &PlanSettings, seed: u64) -> Vec<Vec<Vector>> {
        match settings.candidates {
            Candidates::Axes => vec![axes().to_vec()],
            Candidates::Principal => vec![self.principal_axes()],
            Candidates::Random => vec![random_directions(settings.tries, seed)],
            Candidates::All => {
                let others = [self.principal_axes(), random_directions(settings.tries, seed)].concat();
                vec![axes().to_vec(), others]
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

    /// The principal axes of the samples.
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

    /// The cost of a plane.
    fn cost(&self, plane: &CutPlane, cut: &[&Sample], crossed: &Crossed, others: &Others) -> Cost {
        let near = |sample: &Sample, other: &CutPlane| other.value(&sample.point).abs() < sample.near;
        let mut bad = crossed.badly_cut(plane, shallow);
        for wall in &others.before {
            let on_wall: Vec<&Sample> = cut.iter().filter(|sample| near(sample, wall)).copied().collect();
            let line = plane.normal.cross(&wall.normal);
            bad += shallow(line.norm()) * on_wall.len() as f64;
            // Cuts on the other side of the wall leave lines on it too.
            for other in others.beside.iter().filter(|other| *other != plane) {
                let sine = line.normalize().cross(&other.normal.cross(&wall.normal).normalize()).norm();
                let weight = shallow(sine);
                if weight > 0.0 {
                    bad += weight * on_wall.iter().filter(|sample| near(sample, other)).count() as f64;
                }
            }
        }
        bad += others.spots.iter().map(|spot| crowds(plane, spot)).sum::<f64>();
        let factor = if plane.normal.amax() < ALONG { OBLIQUE } else { 1.0 };
        Cost { cut: factor * cut.len() as f64, bad: factor * bad }
    }
}

/// The cost of the distance of a plane from a spot: zero if it keeps away or goes exactly through
/// it.
fn crowds(plane: &CutPlane, spot: &Spot) -> f64 {
    let distance = plane.value(&spot.point).abs() / spot.near;
    if distance > 1.0 || spot.is_exact && distance < SAME {
        return 0.0;
    }
    CORNER * (1.0 - distance) / (ROOM + distance)
}

/// The unit vectors along the axes.
fn axes() -> [Vector; 3] {
    [Vector::x(), Vector::y(), Vector::z()]
}

/// The cost weight of an angle with this sine: from 1 for zero to 0 if it is large enough.
fn shallow(sine: f64) -> f64 {
    (1.0 - sine / SHALLOW).max(0.0)
}

/// Random directions, uniform on the sphere; the same for the same seed.
fn random_directions(count: usize, seed: u64) -> Vec<Vector> {
    let mut random = Random::new(seed);
    let mut number = || 2.0 * random.unit() - 1.0;
    std::iter::from_fn(|| Some(Vector::new(number(), number(), number())))
        .filter(|v| v.norm_squared() <= 1.0)
        // Few points are so near the centre, where rounding makes the directions uneven.
        .filter_map(|v| v.try_normalize(1e-3))
        .take(count)
        .collect()
}
