//! Periodic faces: what on one surface is the image of what on another.
//!
//! An **identification** (`identify periodic S1 S2`) says that the patches on the first surface of S2, the **images**, are those
//! on the first surface of S1 moved. The motion is found from the surfaces, as in NETGEN along the normal where both are
//! parallel planes; also askew where only that matches, and, what NETGEN does not know, a rotation where the planes
//! are not parallel. Then each corner, curve and patch must have its image. An entity may be an image of an image, and of several
//! (the last corner of a cell with three periods): its **origin** is the first of all these, the only one that is meshed.

use super::around::Tolerances;
use super::{CornerId, CurveId, FeatureError, Features, Geometry, Named, PatchId, Place, Point, SurfaceId};
use crate::{Surface, Vector};
use nalgebra::{Isometry3, Point3, Translation3, Unit, UnitQuaternion};
use std::collections::BTreeMap;

/// A curve that is the image of another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CurveImage {
    /// The curve.
    pub of: CurveId,
    /// Its image.
    pub image: CurveId,
    /// Whether the image runs the other way.
    pub reversed: bool,
}

/// What one `identify periodic` statement identifies.
#[derive(Clone, Debug)]
pub struct Identified {
    /// How the first surface is moved to the second.
    pub motion: Isometry3<f64>,
    /// Corners and their images.
    pub corners: Vec<[CornerId; 2]>,
    /// Curves and their images.
    pub curves: Vec<CurveImage>,
    /// Patches and their images.
    pub patches: Vec<[PatchId; 2]>,
}

/// The entity that another is, directly or not, the image of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Origin {
    /// Its index among its kind.
    pub index: usize,
    /// The motion from it to its image.
    pub motion: Isometry3<f64>,
    /// For curves: whether the image runs the other way.
    pub reversed: bool,
}

/// By corner, curve and patch the origin of those that are images.
#[derive(Clone, Debug, Default)]
pub struct Origins {
    /// By corner.
    pub corners: Vec<Option<Origin>>,
    /// By curve.
    pub curves: Vec<Option<Origin>>,
    /// By patch.
    pub patches: Vec<Option<Origin>>,
}

/// One step from an entity to its image.
type Link = (usize, usize, Isometry3<f64>, bool);

impl Features {
    /// The origins of all images.
    pub fn origins(&self) -> Origins {
        let mut links: [Vec<Link>; 3] = Default::default();
        for Identified { motion, corners, curves, patches } in &self.identified {
            links[0].extend(corners.iter().map(|[a, b]| (a.index(), b.index(), *motion, false)));
            links[1].extend(curves.iter().map(|c| (c.of.index(), c.image.index(), *motion, c.reversed)));
            links[2].extend(patches.iter().map(|[a, b]| (a.index(), b.index(), *motion, false)));
        }
        Origins {
            corners: origins_along(self.corners.len(), &links[0]),
            curves: origins_along(self.curves.len(), &links[1]),
            patches: origins_along(self.patches.len(), &links[2]),
        }
    }
}

/// Follows the links from entities that are no images; where all are (in a ring), from the first of them.
fn origins_along(count: usize, links: &[Link]) -> Vec<Option<Origin>> {
    let mut origins: Vec<Option<Origin>> = vec![None; count];
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
                    let origin = Origin { index: start, motion: step * motion, reversed: reversed != turned };
                    origins[next] = Some(origin);
                    open.push((next, origin.motion, origin.reversed));
                }
            }
        }
    }
    origins
}

/// Something on one of two identified surfaces without counterpart on the other.
struct Unmatched {
    what: &'static str,
    place: Point,
}

/// Finds the images of all identifications.
///
/// # Errors
/// Surfaces that are no images of each other, and the first entity without image.
pub(super) fn identify(
    geometry: &Geometry,
    features: &Features,
    tolerances: &Tolerances,
) -> Result<Vec<Identified>, FeatureError> {
    let mut all: Vec<Identified> = Vec::new();
    for (index, identification) in geometry.identifications.iter().enumerate() {
        let [first, second] = [0, 1].map(|i| Named {
            solid: identification.solids[i].clone(),
            line: geometry.surface_info[identification.surfaces[i].index()].span.line,
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
    refuse_contradictions(geometry, features, &all, tolerances)?;
    Ok(all)
}

/// Corners, curves and patches on a surface.
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
        // Points of the user that are on no curve.
        let ends: Vec<CornerId> = features.curves.iter().filter_map(|c| c.ends).flatten().collect();
        let lonely = (0..features.corners.len()).map(CornerId::new).filter(|c| !ends.contains(c));
        corners.extend(lonely.filter(|&c| features.corner(c).surfaces.contains(&surface)));
        corners.sort_unstable();
        corners.dedup();
        Self { surface, corners, curves, patches }
    }

    /// The middle of its corners, or of its curves where they are closed.
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

    /// The normal of a plane, away from the body.
    fn outward(&self, geometry: &Geometry, features: &Features) -> Vector {
        let patch = features.patch(self.patches[0]);
        let normal = geometry.surfaces[self.surface.index()].normal(&Point::origin());
        if patch.flipped { -normal } else { normal }
    }
}

/// The motions that may take one surface to the other, the likeliest first.
fn motions(
    geometry: &Geometry,
    features: &Features,
    surfaces: [SurfaceId; 2],
    sides: &[Side; 2],
    tolerances: &Tolerances,
) -> Vec<Isometry3<f64>> {
    /// Planes at a smaller angle (its sine) are parallel: the same bound as for equal planes.
    const PARALLEL: f64 = 1e-8;
    let [from, to] = surfaces.map(|s| &geometry.surfaces[s.index()]);
    let shift = |v: Vector| {
        // A component that is rounding would make images of round coordinates not round.
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

/// The rotation about the line that two planes share that turns the normal of the first to `target`.
fn turn(points: [Point; 2], [m, n]: [Vector; 2], cross: Vector, target: Vector) -> Isometry3<f64> {
    // The point of the line nearest to the first plane's point.
    let in_first = n - m * n.dot(&m);
    let at = points[0] + in_first * ((points[1] - points[0]).dot(&n) / in_first.norm_squared());
    let axis = Unit::new_normalize(cross);
    let angle = m.cross(&target).dot(&axis).atan2(m.dot(&target));
    let rotation = UnitQuaternion::from_axis_angle(&axis, angle);
    Isometry3::rotation_wrt_point(rotation, Point3::from(at))
}

/// All images under a motion.
fn matched(
    geometry: &Geometry,
    features: &Features,
    sides: &[Side; 2],
    motion: Isometry3<f64>,
    tolerances: &Tolerances,
) -> Result<Identified, Unmatched> {
    let mut identified = Identified { motion, corners: Vec::new(), curves: Vec::new(), patches: Vec::new() };
    let [from, to] = sides;
    for &of in &from.corners {
        let place = features.corner(of).point;
        let is_image =
            |c: &&CornerId| (features.corner(**c).point - motion * place).norm() <= tolerances.merge;
        let image = to.corners.iter().find(is_image).ok_or(Unmatched { what: "corner", place })?;
        identified.corners.push([of, *image]);
    }
    let missed = |c: &&CornerId| !identified.corners.iter().any(|pair| pair[1] == **c);
    if let Some(&corner) = to.corners.iter().find(missed) {
        return Err(Unmatched { what: "corner", place: features.corner(corner).point });
    }
    for &of in &from.curves {
        let place = middle(features, of);
        let images = to.curves.iter().filter_map(|&image| {
            let reversed =
                image_of(geometry, features, [of, image], &motion, &identified.corners, tolerances)?;
            Some(CurveImage { of, image, reversed })
        });
        let image = images.into_iter().next().ok_or(Unmatched { what: "curve", place })?;
        identified.curves.push(image);
    }
    let missed = |c: &&CurveId| !identified.curves.iter().any(|pair| pair.image == **c);
    if let Some(&curve) = to.curves.iter().find(missed) {
        return Err(Unmatched { what: "curve", place: middle(features, curve) });
    }
    let boundary = |id: PatchId, moved: bool| {
        let image =
            |c: CurveId| identified.curves.iter().find(|pair| pair.of == c).map_or(c, |pair| pair.image);
        let curves = features.patch(id).boundary.iter().map(|(c, _)| if moved { image(*c) } else { *c });
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
        let image = to.patches.iter().find(|&&p| !curves.is_empty() && boundary(p, false) == curves);
        patches.push([of, *image.ok_or(Unmatched { what: "boundary of the patch", place })?]);
    }
    identified.patches = patches;
    Ok(identified)
}

/// A point in the midst of a curve.
fn middle(features: &Features, curve: CurveId) -> Point {
    let trace = &features.curve(curve).trace;
    match trace.len() {
        2 => nalgebra::center(&trace[0], &trace[1]),
        n => trace[n / 2],
    }
}

/// Whether the second curve is the image of the first; if so, whether it runs the other way.
fn image_of(
    geometry: &Geometry,
    features: &Features,
    [of, image]: [CurveId; 2],
    motion: &Isometry3<f64>,
    corners: &[[CornerId; 2]],
    tolerances: &Tolerances,
) -> Option<bool> {
    /// A trace turns by less than a quarter radian a step: its chords are nearer to the curve than this part of them.
    const SAGITTA: f64 = 0.05;
    let [a, b] = [of, image].map(|c| features.curve(c));
    let moved = |c: CornerId| corners.iter().find(|pair| pair[0] == c).map(|pair| pair[1]);
    let ends = match (a.ends, b.ends) {
        (None, None) => true,
        (Some(of), Some(ends)) => {
            let images = of.map(moved);
            images == ends.map(Some) || images == [ends[1], ends[0]].map(Some)
        }
        _ => false,
    };
    if !ends {
        return None;
    }
    // Points all along the curve must be on both surfaces of its image, and near the chords of its trace.
    let last = a.trace.len() - 1;
    let direction_at = |at: usize| {
        let on_it = motion * if last == 1 { middle(features, of) } else { a.trace[at] };
        let surfaces = b.surfaces.map(|s| geometry.surfaces[s.index()].distance(&on_it));
        let near = b.trace.windows(2).find(|w| {
            let chord = w[1] - w[0];
            let part = ((on_it - w[0]).dot(&chord) / chord.norm_squared()).clamp(0.0, 1.0);
            (on_it - (w[0] + chord * part)).norm() <= SAGITTA * chord.norm() + tolerances.merge
        })?;
        let forward = motion * (a.trace[(at + 1).min(last)] - a.trace[at.saturating_sub(1)]);
        (surfaces[0].max(surfaces[1]) <= tolerances.merge).then(|| forward.dot(&(near[1] - near[0])) < 0.0)
    };
    let places = [last / 4, last / 2, 3 * last / 4].map(|at| at.max(1).min(last.max(2) - 1));
    let reversed = direction_at(places[0])?;
    places.iter().all(|&at| direction_at(at) == Some(reversed)).then_some(reversed)
}

/// Refuses motions that take one entity to different places on different ways.
fn refuse_contradictions(
    geometry: &Geometry,
    features: &Features,
    identified: &[Identified],
    tolerances: &Tolerances,
) -> Result<(), FeatureError> {
    let with = Features { identified: identified.to_vec(), ..features.clone() };
    let origins = with.origins();
    let to = |origins: &[Option<Origin>], index: usize| {
        origins[index].map_or((index, Isometry3::identity()), |o| (o.index, o.motion))
    };
    for (identification, all) in geometry.identifications.iter().zip(identified) {
        let corners = all.corners.iter().map(|[a, b]| {
            let [a, b] = [a, b].map(|c| to(&origins.corners, c.index()));
            (a, b, features.corners[a.0].point)
        });
        let curves = all.curves.iter().map(|pair| {
            let [a, b] = [pair.of, pair.image].map(|c| to(&origins.curves, c.index()));
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
                    what: "point that other identifications take elsewhere",
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
