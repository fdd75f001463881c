//! Matches the features of periodic surfaces.
//!
//! An **identification** (`identify periodic S1 S2`) states that a rigid motion maps the patches on
//! the first surface of S1, the **masters**, to those on the first surface of S2, their **copies**.
//! The motion is computed from the surfaces: as in NETGEN, along the normal if both are parallel
//! planes; oblique if only that matches; and, beyond NETGEN, a rotation if the planes are not
//! parallel. Every corner, curve and patch must have a copy.
//!
//! A copy may be the master of another copy, and may have several masters (the last corner of a
//! cell with three periods). Its **origin** is the entity at the start of all these chains, the
//! only one that is meshed.

use super::neighborhood::Tolerances;
use super::{CornerId, CurveId, FeatureError, Features, Geometry, Named, PatchId, Place, Point, SurfaceId};
use crate::{Surface, Vector};
use nalgebra::{Isometry3, Point3, Translation3, Unit, UnitQuaternion};
use std::collections::BTreeMap;

/// A curve and its periodic copy.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CurveCopy {
    /// The master curve.
    pub master: CurveId,
    /// Its copy.
    pub copy: CurveId,
    /// Whether the copy has the opposite direction.
    pub reversed: bool,
}

/// The entities matched by one `identify periodic` statement.
#[derive(Clone, Debug)]
pub struct PeriodicMatch {
    /// The motion that maps the first surface to the second.
    pub motion: Isometry3<f64>,
    /// Corners and their copies.
    pub corners: Vec<[CornerId; 2]>,
    /// Curves and their copies.
    pub curves: Vec<CurveCopy>,
    /// Patches and their copies.
    pub patches: Vec<[PatchId; 2]>,
}

/// The entity of which another is, directly or indirectly, a periodic copy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Master {
    /// Its index among entities of its kind.
    pub index: usize,
    /// The motion that maps the origin to the copy.
    pub motion: Isometry3<f64>,
    /// For curves: whether the copy has the opposite direction.
    pub reversed: bool,
}

/// The origin of each periodic copy; `None` for entities that are not copies.
#[derive(Clone, Debug, Default)]
pub struct Masters {
    /// By corner.
    pub corners: Vec<Option<Master>>,
    /// By curve.
    pub curves: Vec<Option<Master>>,
    /// By patch.
    pub patches: Vec<Option<Master>>,
}

/// A master, its copy, the motion between them, and whether a curve is reversed.
type Link = (usize, usize, Isometry3<f64>, bool);

impl Features {
    /// The origins of all periodic copies.
    pub fn masters(&self) -> Masters {
        let mut links: [Vec<Link>; 3] = Default::default();
        for PeriodicMatch { motion, corners, curves, patches } in &self.identified {
            links[0].extend(corners.iter().map(|[a, b]| (a.index(), b.index(), *motion, false)));
            links[1].extend(curves.iter().map(|c| (c.master.index(), c.copy.index(), *motion, c.reversed)));
            links[2].extend(patches.iter().map(|[a, b]| (a.index(), b.index(), *motion, false)));
        }
        Masters {
            corners: masters_along(self.corners.len(), &links[0]),
            curves: masters_along(self.curves.len(), &links[1]),
            patches: masters_along(self.patches.len(), &links[2]),
        }
    }
}

/// Follows the links from entities that are not copies. In a ring all entities are copies; then the
/// one with the smallest index is the origin.
fn masters_along(count: usize, links: &[Link]) -> Vec<Option<Master>> {
    let mut origins: Vec<Option<Master>> = vec![None; count];
    let mut steps: BTreeMap<usize, Vec<Link>> = BTreeMap::new();
    let mut is_image = vec![false; count];
    for &(of, image, motion, reversed) in links.iter().filter(|link| link.0 != link.1) {
        steps.entry(of).or_default().push((of, image, motion, reversed));
        steps.entry(image).or_default().push((image, of, motion.inverse(), reversed));
        is_image[image] = true;
    }
    let (images, firsts): (Vec<usize>, Vec<usize>) = steps.keys().partition(|&&i| is_image[i]);
    let mut reached = vec![false; count];
    for start in firsts.into_iter().chain(images) {
        if std::mem::replace(&mut reached[start], true) {
            continue;
        }
        let mut open = vec![(start, Isometry3::identity(), false)];
        while let Some((at, motion, reversed)) = open.pop() {
            for &(_, next, step, turned) in &steps[&at] {
                if !std::mem::replace(&mut reached[next], true) {
                    let origin = Master { index: start, motion: step * motion, reversed: reversed != turned };
                    origins[next] = Some(origin);
                    open.push((next, origin.motion, origin.reversed));
                }
            }
        }
    }
    origins
}

/// An entity of one of two identified surfaces without a counterpart on the other.
struct Unmatched {
    what: &'static str,
    place: Point,
}

/// Matches the entities of all identifications.
///
/// # Errors
/// [`FeatureError::NoPeriodicFace`] if a surface bounds no body, [`FeatureError::NoMotion`] if no
/// motion maps one surface to the other, [`FeatureError::NotPeriodic`] with the first entity
/// without a counterpart.
pub(super) fn identify(
    geometry: &Geometry,
    features: &Features,
    tolerances: &Tolerances,
) -> Result<Vec<PeriodicMatch>, FeatureError> {
    let mut all: Vec<PeriodicMatch> = Vec::new();
    for (index, identification) in geometry.identifications.iter().enumerate() {
        let [first, second] = [0, 1].map(|i| Named {
            solid: identification.solids[i].as_str().into(),
            line: geometry.surface_info[identification.surfaces[i].index()].span.line,
            surface: None,
        });
        let line = identification.span.line;
        let sides = identification.surfaces.map(|s| Side::new(features, s));
        if let Some(i) = sides.iter().position(|side| side.patches.is_empty()) {
            let [first, second] = [first, second];
            return Err(FeatureError::NoPeriodicFace { solid: if i == 0 { first } else { second }, line });
        }
        let mut refused = None;
        let mut found = None;
        for motion in motions(geometry, features, identification.surfaces, &sides, tolerances) {
            match matched(geometry, features, &sides, motion, tolerances) {
                Ok(identified) => found = Some(identified),
                Err(unmatched) => _ = refused.get_or_insert(unmatched),
            }
            if found.is_some() {
                break;
            }
        }
        match (found, refused) {
            (Some(identified), _) => all.push(identified),
            (None, Some(Unmatched { what, place })) => {
                return Err(FeatureError::NotPeriodic { first, second, line, what, place: Place(place) });
            }
            (None, None) => return Err(FeatureError::NoMotion { first, second, line }),
        }
        debug_assert_eq!(all.len(), index + 1);
    }
    check_consistency(geometry, features, &all, tolerances)?;
    Ok(all)
}

/// The corners, curves and patches on a surface.
struct Side {
    surface: SurfaceId,
    corners: Vec<CornerId>,
    curves: Vec<CurveId>,
    patches: Vec<PatchId>,
}

impl Side {
    fn new(features: &Features, surface: SurfaceId) -> Self {
        let on_it = |id: &PatchId| features.patch(*id).surface == surface;
        let patches: Vec<PatchId> = (0..features.patches.len()).map(PatchId::new).filter(on_it).collect();
        let mut curves: Vec<CurveId> =
            patches.iter().flat_map(|&p| features.patch(p).boundary.iter().map(|(c, _)| *c)).collect();
        curves.sort_unstable();
        curves.dedup();
        let mut corners: Vec<CornerId> =
            curves.iter().filter_map(|&c| features.curve(c).ends).flatten().collect();
        // Isolated corners: points of the user on no curve.
        let ends: Vec<CornerId> = features.curves.iter().filter_map(|c| c.ends).flatten().collect();
        let lonely = (0..features.corners.len()).map(CornerId::new).filter(|c| !ends.contains(c));
        corners.extend(lonely.filter(|&c| features.corner(c).surfaces.contains(&surface)));
        corners.sort_unstable();
        corners.dedup();
        Self { surface, corners, curves, patches }
    }

    /// The mean of its corners, or the centroid of its curves if all are closed.
    fn center(&self, features: &Features) -> Option<Point> {
        let mut points: Vec<(Point, f64)> =
            self.corners.iter().map(|&c| (features.corner(c).point, 1.0)).collect();
        if points.is_empty() {
            let steps = self.curves.iter().flat_map(|&c| features.curve(c).trace.windows(2));
            points.extend(steps.map(|w| (nalgebra::center(&w[0], &w[1]), (w[1] - w[0]).norm())));
        }
        let weight: f64 = points.iter().map(|p| p.1).sum();
        let sum: Vector = points.iter().map(|(p, w)| p.coords * *w).sum();
        (weight > 0.0).then(|| Point::from(sum / weight))
    }

    /// The normal of a plane, pointing away from the body.
    fn outward(&self, geometry: &Geometry, features: &Features) -> Vector {
        let patch = features.patch(self.patches[0]);
        let normal = geometry.surfaces[self.surface.index()].normal(&Point::origin());
        if patch.flipped { -normal } else { normal }
    }
}

/// The motions that may map one surface to the other, most likely first.
fn motions(
    geometry: &Geometry,
    features: &Features,
    surfaces: [SurfaceId; 2],
    sides: &[Side; 2],
    tolerances: &Tolerances,
) -> Vec<Isometry3<f64>> {
    /// Planes are parallel if the sine of their angle is at most this; the same bound as for equal
    /// planes.
    const PARALLEL: f64 = 1e-8;
    let [from, to] = surfaces.map(|s| &geometry.surfaces[s.index()]);
    let shift = |v: Vector| {
        // Zero out rounding errors, so that copies of round coordinates stay round.
        let clean = v.map(|x| if x.abs() <= tolerances.exact { 0.0 } else { x });
        Isometry3::from_parts(Translation3::from(clean), UnitQuaternion::identity())
    };
    let between = sides[0].center(features).zip(sides[1].center(features)).map(|(a, b)| b - a);
    let mut found = Vec::new();
    if let (Surface::Plane(p), Surface::Plane(q)) = (from, to) {
        let [m, n] = [0, 1].map(|i| sides[i].outward(geometry, features));
        let cross = m.cross(&n);
        if cross.norm() <= PARALLEL {
            let along = m * (q.point - p.point).dot(&m);
            found.push(shift(along));
            found.extend(between.map(|v| shift(v - m * v.dot(&m) + along)));
        } else {
            found.extend([-n, n].map(|target| turn([p.point, q.point], [m, n], cross, target)));
        }
    } else {
        found.extend(between.map(shift));
    }
    found.retain(|motion| from.transformed(motion).same_as(to, tolerances.merge).is_some());
    found
}

/// The rotation about the common line of two planes that maps the normal of the first to `target`.
fn turn(points: [Point; 2], [m, n]: [Vector; 2], cross: Vector, target: Vector) -> Isometry3<f64> {
    // The point of the line nearest to the given point of the first plane.
    let in_first = n - m * n.dot(&m);
    let at = points[0] + in_first * ((points[1] - points[0]).dot(&n) / in_first.norm_squared());
    let axis = Unit::new_normalize(cross);
    let angle = m.cross(&target).dot(&axis).atan2(m.dot(&target));
    let rotation = UnitQuaternion::from_axis_angle(&axis, angle);
    Isometry3::rotation_wrt_point(rotation, Point3::from(at))
}

/// Matches all corners, curves and patches under a motion.
fn matched(
    geometry: &Geometry,
    features: &Features,
    sides: &[Side; 2],
    motion: Isometry3<f64>,
    tolerances: &Tolerances,
) -> Result<PeriodicMatch, Unmatched> {
    let mut identified =
        PeriodicMatch { motion, corners: Vec::new(), curves: Vec::new(), patches: Vec::new() };
    let [from, to] = sides;
    for &of in &from.corners {
        let place = features.corner(of).point;
        let is_copy =
            |c: &&CornerId| (features.corner(**c).point - motion * place).norm() <= tolerances.merge;
        let copy = to.corners.iter().find(is_copy).ok_or(Unmatched { what: "corner", place })?;
        identified.corners.push([of, *copy]);
    }
    let missed = |c: &&CornerId| !identified.corners.iter().any(|pair| pair[1] == **c);
    if let Some(&corner) = to.corners.iter().find(missed) {
        return Err(Unmatched { what: "corner", place: features.corner(corner).point });
    }
    for &of in &from.curves {
        let place = middle(features, of);
        let copies = to.curves.iter().filter_map(|&copy| {
            let reversed = orientation_of_copy(
                geometry,
                features,
                [of, copy],
                &motion,
                &identified.corners,
                tolerances,
            )?;
            Some(CurveCopy { master: of, copy, reversed })
        });
        let copy = copies.into_iter().next().ok_or(Unmatched { what: "curve", place })?;
        identified.curves.push(copy);
    }
    let missed = |c: &&CurveId| !identified.curves.iter().any(|pair| pair.copy == **c);
    if let Some(&curve) = to.curves.iter().find(missed) {
        return Err(Unmatched { what: "curve", place: middle(features, curve) });
    }
    let boundary = |id: PatchId, moved: bool| {
        let copy =
            |c: CurveId| identified.curves.iter().find(|pair| pair.master == c).map_or(c, |pair| pair.copy);
        let curves = features.patch(id).boundary.iter().map(|(c, _)| if moved { copy(*c) } else { *c });
        let mut curves: Vec<CurveId> = curves.collect();
        curves.sort_unstable();
        curves.dedup();
        curves
    };
    let mut patches = Vec::new();
    for &of in &from.patches {
        let curves = boundary(of, true);
        let place = features.patch(of).seeds.first().copied();
        let place = place.unwrap_or_else(|| middle(features, features.patch(of).boundary[0].0));
        let copy = to.patches.iter().find(|&&p| !curves.is_empty() && boundary(p, false) == curves);
        patches.push([of, *copy.ok_or(Unmatched { what: "boundary of the patch", place })?]);
    }
    identified.patches = patches;
    Ok(identified)
}

/// A point near the middle of a curve.
fn middle(features: &Features, curve: CurveId) -> Point {
    let trace = &features.curve(curve).trace;
    match trace.len() {
        2 => nalgebra::center(&trace[0], &trace[1]),
        n => trace[n / 2],
    }
}

/// Compares two curves: `Some(reversed)` if the second is the copy of the first, else `None`.
fn orientation_of_copy(
    geometry: &Geometry,
    features: &Features,
    [master, copy]: [CurveId; 2],
    motion: &Isometry3<f64>,
    corners: &[[CornerId; 2]],
    tolerances: &Tolerances,
) -> Option<bool> {
    /// Bound of the sagitta relative to the chord; a trace turns by less than a quarter radian per
    /// step.
    const SAGITTA: f64 = 0.05;
    let [a, b] = [master, copy].map(|c| features.curve(c));
    let moved = |c: CornerId| corners.iter().find(|pair| pair[0] == c).map(|pair| pair[1]);
    let ends = match (a.ends, b.ends) {
        (None, None) => true,
        (Some(from), Some(ends)) => {
            let copies = from.map(moved);
            copies == ends.map(Some) || copies == [ends[1], ends[0]].map(Some)
        }
        _ => false,
    };
    if !ends {
        return None;
    }
    // Points along the curve must map to both surfaces of the copy, close to the chords of its
    // trace.
    let last = a.trace.len() - 1;
    let direction_at = |at: usize| {
        let on_it = motion * if last == 1 { middle(features, master) } else { a.trace[at] };
        let surfaces = b.surfaces.map(|s| geometry.surfaces[s.index()].distance(&on_it));
        let near = b.trace.windows(2).find(|w| {
            let chord = w[1] - w[0];
            let part = ((on_it - w[0]).dot(&chord) / chord.norm_squared()).clamp(0.0, 1.0);
            (on_it - (w[0] + chord * part)).norm() <= SAGITTA * chord.norm() + tolerances.merge
        })?;
        let forward = motion * (a.trace[(at + 1).min(last)] - a.trace[at.saturating_sub(1)]);
        // The middle of a trace of one chord is not on the curve.
        let off = if last == 1 { SAGITTA * forward.norm() } else { 0.0 } + tolerances.merge;
        (surfaces[0].max(surfaces[1]) <= off).then(|| forward.dot(&(near[1] - near[0])) < 0.0)
    };
    let places = [last / 4, last / 2, 3 * last / 4].map(|at| at.max(1).min(last.max(2) - 1));
    let reversed = direction_at(places[0])?;
    places.iter().all(|&at| direction_at(at) == Some(reversed)).then_some(reversed)
}

/// Checks that different chains of identifications map each entity to the same place.
///
/// # Errors
/// [`FeatureError::NotPeriodic`] at the first point with two different periodic copies.
fn check_consistency(
    geometry: &Geometry,
    features: &Features,
    identified: &[PeriodicMatch],
    tolerances: &Tolerances,
) -> Result<(), FeatureError> {
    let with = Features { identified: identified.to_vec(), ..features.clone() };
    let origins = with.masters();
    let to = |origins: &[Option<Master>], index: usize| {
        origins[index].map_or((index, Isometry3::identity()), |o| (o.index, o.motion))
    };
    for (identification, all) in geometry.identifications.iter().zip(identified) {
        let corners = all.corners.iter().map(|[a, b]| {
            let [a, b] = [a, b].map(|c| to(&origins.corners, c.index()));
            (a, b, features.corners[a.0].point)
        });
        let curves = all.curves.iter().map(|pair| {
            let [a, b] = [pair.master, pair.copy].map(|c| to(&origins.curves, c.index()));
            (a, b, middle(features, CurveId::new(a.0)))
        });
        for ((from, first), (other, second), place) in corners.chain(curves) {
            let there = [all.motion * (first * place), second * place];
            if from == other && (there[1] - there[0]).norm() > tolerances.merge {
                let [first, second] = identification.surfaces.map(|s| Named::surface(geometry, s));
                let line = identification.span.line;
                return Err(FeatureError::NotPeriodic {
                    first,
                    second,
                    line,
                    what: "point that other identifications map elsewhere",
                    place: Place(there[0]),
                });
            }
        }
    }
    Ok(())
}

#[cfg(test)]
#[path = "periodic_tests.rs"]
mod tests;
