//! Projection of points to patches and curves: the only geometric information that refinement
//! needs.

use crate::primitive::{
    Cone, Cylinder, Ellipse, Ellipsoid, EllipticCone, EllipticCylinder, Nappe, Plane, Revolved, Section,
    Sphere, Sweep, Torus,
};
use crate::{CurveId, Features, Geometry, Master, PatchId, Point, Surface, SurfaceId, Vector};
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use std::collections::BTreeSet;

/// A projection to a surface or a curve that did not converge.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("projection of the point ({}, {}, {}) did not converge", .0.x, .0.y, .0.z)]
pub struct ProjectionFailed(pub Point);

/// The surfaces of patches and curves, and projection to them.
///
/// A few plain numbers, so every rank stores a copy. A projection depends only on the point and the
/// entity: results are bitwise equal on all ranks and threads. Projection does not allocate memory.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Projector {
    surfaces: Vec<Surface>,
    curves: Vec<[SurfaceId; 2]>,
    patches: Vec<SurfaceId>,
    /// Periodic copies among the curves, sorted by id.
    curve_copies: Vec<PeriodicCopy>,
    /// Periodic copies among the patches, sorted by id.
    patch_copies: Vec<PeriodicCopy>,
    /// Largest distance of a projected point from its surfaces, a length.
    tolerance: f64,
}

/// A periodic copy of an entity. To project to the copy, move the point to the master, project, and
/// move back.
#[derive(Clone, Copy, Debug, PartialEq)]
struct PeriodicCopy {
    /// Index of the copy and index of its master.
    ids: [u32; 2],
    /// Maps the master to the copy.
    motion: Isometry3<f64>,
}

impl PeriodicCopy {
    fn all(masters: &[Option<Master>]) -> Vec<Self> {
        let copy = |(id, master): (u32, &Option<Master>)| {
            master.map(|master| Self { ids: [id, master.index as u32], motion: master.motion })
        };
        (0..).zip(masters).filter_map(copy).collect()
    }

    /// The periodic copy with index `id`.
    #[inline]
    fn find(copies: &[Self], id: u32) -> Option<&Self> {
        if copies.is_empty() {
            return None;
        }
        copies.binary_search_by_key(&id, |copy| copy.ids[0]).ok().map(|at| &copies[at])
    }

    /// Projects to the master and maps the result to the copy.
    fn project(
        &self,
        point: &Point,
        project: impl Fn(&Point) -> Result<Point, ProjectionFailed>,
    ) -> Result<Point, ProjectionFailed> {
        let original = project(&self.motion.inverse_transform_point(point));
        original.map(|point| self.motion * point).map_err(|_| ProjectionFailed(*point))
    }
}

/// Tolerance of [`Projector`] as a fraction of the diagonal of the bodies' bounding box; see also
/// [`COORDINATE_ROUNDING`].
const ON_SURFACE: f64 = 1e-12;
/// Tolerance of [`Projector`] relative to the largest coordinate: four units in the last place.
const COORDINATE_ROUNDING: f64 = 4.0 * f64::EPSILON;

impl Projector {
    /// Extracts the surfaces and the periodic copies of a geometry.
    pub fn new(geometry: &Geometry, features: &Features) -> Self {
        let bounds = &features.bounds;
        let largest = bounds.min.coords.amax().max(bounds.max.coords.amax());
        let rounding = f64::max(ON_SURFACE * bounds.diagonal(), COORDINATE_ROUNDING * largest);
        let gap = GAP_ROOM * widest_gap(geometry, features, rounding);
        let masters = features.masters();
        Self {
            curve_copies: PeriodicCopy::all(&masters.curves),
            patch_copies: PeriodicCopy::all(&masters.patches),
            surfaces: geometry.surfaces.clone(),
            curves: features.curves.iter().map(|c| c.surfaces).collect(),
            patches: features.patches.iter().map(|p| p.surface).collect(),
            tolerance: if gap > rounding { gap } else { rounding },
        }
    }

    /// Largest distance of a projected point from its surfaces, a length.
    ///
    /// It is the larger of 10⁻¹² of the diagonal of the bodies' bounding box and 4 units in the
    /// last place of the largest coordinate. It is larger if surfaces that should meet in a curve
    /// have a wider gap, as tangent surfaces with rounded decimals do.
    pub fn tolerance(&self) -> f64 {
        self.tolerance
    }

    /// The point of the surface of `patch` nearest to `point`.
    ///
    /// # Errors
    /// [`ProjectionFailed`] if the nearest point is not unique, as at the center of a sphere.
    pub fn project_patch(&self, patch: PatchId, point: &Point) -> Result<Point, ProjectionFailed> {
        match PeriodicCopy::find(&self.patch_copies, patch.0) {
            Some(copy) => copy.project(point, |p| self.patch_surface(PatchId(copy.ids[1])).project(p)),
            None => self.patch_surface(patch).project(point),
        }
    }

    /// The point of `curve` nearest to `point` to first order.
    ///
    /// Newton's method: each step is orthogonal to the direction of the curve at its start.
    ///
    /// # Errors
    /// [`ProjectionFailed`] if the iteration does not converge to a point on both surfaces.
    pub fn project_curve(&self, curve: CurveId, point: &Point) -> Result<Point, ProjectionFailed> {
        let on = |curve: CurveId, point: &Point| {
            let [a, b] = self.curve_surfaces(curve);
            project_to_both(a, b, point, self.tolerance)
        };
        match PeriodicCopy::find(&self.curve_copies, curve.0) {
            Some(copy) => copy.project(point, |p| on(CurveId(copy.ids[1]), p)),
            None => on(curve, point),
        }
    }

    /// The distance of `point` from the surface of `patch`, to first order.
    pub fn patch_distance(&self, patch: PatchId, point: &Point) -> f64 {
        self.patch_surface(patch).distance(point)
    }

    /// The larger of the distances of `point` from the two surfaces of `curve`, to first order.
    pub fn curve_distance(&self, curve: CurveId, point: &Point) -> f64 {
        let [a, b] = self.curve_surfaces(curve);
        a.distance(point).max(b.distance(point))
    }

    /// The surface of `patch`.
    pub fn patch_surface(&self, patch: PatchId) -> &Surface {
        &self.surfaces[self.patches[patch.index()].index()]
    }

    /// The two surfaces of `curve`.
    pub fn curve_surfaces(&self, curve: CurveId) -> [&Surface; 2] {
        self.curves[curve.index()].map(|s| &self.surfaces[s.index()])
    }

    /// Serializes the projector to numbers, to send it to other ranks.
    ///
    /// Order: the tolerance; the counts of surfaces, curves and patches; each surface as its kind,
    /// then the vectors and the numbers of its primitive; the two surfaces of each curve; the
    /// surface of each patch; the counts of periodic curves and patches, each copy with its master
    /// and the quaternion and translation between them.
    pub fn encode(&self) -> Vec<f64> {
        let counts = [self.surfaces.len(), self.curves.len(), self.patches.len()];
        let mut out = vec![self.tolerance];
        out.extend(counts.map(|n| n as f64));
        for surface in &self.surfaces {
            encode_surface(surface, &mut out);
        }
        out.extend(self.curves.iter().flatten().chain(&self.patches).map(|s| f64::from(s.0)));
        out.extend([&self.curve_copies, &self.patch_copies].map(|copies| copies.len() as f64));
        for PeriodicCopy { ids, motion } in self.curve_copies.iter().chain(&self.patch_copies) {
            out.extend(ids.map(f64::from));
            out.extend(motion.rotation.coords.iter().chain(motion.translation.vector.iter()));
        }
        out
    }

    /// Restores a projector from the result of [`encode`](Self::encode); `None` for invalid input.
    pub fn decode(numbers: &[f64]) -> Option<Self> {
        let mut reader = Reader(numbers);
        let tolerance = reader.number()?;
        let [surfaces, curves, patches] = [reader.count()?, reader.count()?, reader.count()?];
        let surfaces: Vec<_> = (0..surfaces).map(|_| reader.surface()).collect::<Option<_>>()?;
        let id = |reader: &mut Reader| reader.count().filter(|&i| i < surfaces.len()).map(SurfaceId::new);
        let curves =
            (0..curves).map(|_| Some([id(&mut reader)?, id(&mut reader)?])).collect::<Option<Vec<_>>>()?;
        let patches = (0..patches).map(|_| id(&mut reader)).collect::<Option<Vec<_>>>()?;
        let counts = [reader.count()?, reader.count()?];
        let lengths = [curves.len(), patches.len()];
        let mut copies =
            |i: usize| (0..counts[i]).map(|_| reader.copy(lengths[i])).collect::<Option<Vec<_>>>();
        let (curve_copies, patch_copies) = (copies(0)?, copies(1)?);
        let projector = Self { surfaces, curves, patches, curve_copies, patch_copies, tolerance };
        reader.0.is_empty().then_some(projector)
    }
}

/// A gap between surfaces can be wider between the points of a trace than at them by this factor.
const GAP_ROOM: f64 = 1.25;

/// The largest distance of curves and corners from the surfaces of the adjacent patches. `rounding`
/// is the accuracy of points on two surfaces.
fn widest_gap(geometry: &Geometry, features: &Features, rounding: f64) -> f64 {
    let surface = |patch: PatchId| &geometry.surfaces[features.patch(patch).surface.index()];
    let of_curve = |curve: &crate::Curve| {
        // Tangent surfaces with a gap: the intersection of the curve's own two surfaces is where
        // points will be projected to, and differs from its ends.
        let [a, b] = curve.surfaces.map(|s| &geometry.surfaces[s.index()]);
        let between = curve.trace.windows(2).map(|pair| nalgebra::center(&pair[0], &pair[1]));
        let between = between.filter_map(|p| project_to_both(a, b, &p, rounding).ok());
        let points: Vec<Point> = curve.trace.iter().copied().chain(between).collect();
        let widest = |s: &Surface| points.iter().map(|p| s.distance(p)).fold(0.0, f64::max);
        curve.fins.iter().map(|fin| widest(surface(fin.patch))).fold(0.0, f64::max)
    };
    let bounding: BTreeSet<SurfaceId> = features.patches.iter().map(|patch| patch.surface).collect();
    let of_corner = |corner: &crate::Corner| {
        let beside = corner.surfaces.iter().filter(|s| bounding.contains(s));
        let gaps = beside.map(|s| {
            let surface = &geometry.surfaces[s.index()];
            surface.project(&corner.point).map_or(0.0, |foot| (foot - corner.point).norm())
        });
        gaps.fold(0.0, f64::max)
    };
    let curves = features.curves.iter().map(of_curve);
    curves.chain(features.corners.iter().map(of_corner)).fold(0.0, f64::max)
}

/// The first point of a curve at a given distance from the start of its trace; `None` if there is
/// none.
///
/// `project` projects a point to the curve.
pub fn at_distance(
    trace: &[Point],
    distance: f64,
    project: impl Fn(&Point) -> Result<Point, ProjectionFailed>,
) -> Option<Point> {
    /// Each step reduces the error to less than a tenth, because consecutive chords of a trace are
    /// nearly parallel.
    const STEPS: usize = 20;
    let corner = trace[0];
    let after = trace.iter().position(|p| (p - corner).norm() >= distance)?;
    let (from, chord) = (trace[after - 1], trace[after] - trace[after - 1]);
    let (low, high) = ((from - corner).norm(), (trace[after] - corner).norm());
    let mut at = from + chord * ((distance - low) / (high - low));
    for _ in 0..STEPS {
        at = project(&at).ok()?;
        let arm = at - corner;
        let lack = distance - arm.norm();
        if lack.abs() <= f64::EPSILON * distance {
            break;
        }
        at += chord * (lack * arm.norm() / arm.dot(&chord));
    }
    at = project(&at).ok()?;
    Some(at)
}

/// Projects `point` to the intersection of two surfaces by Newton's method.
///
/// Each step is the shortest solution of both linearized equations; it lies in the plane of the two
/// gradients. Steps continue while they halve the distance to the surfaces, and the best iterate is
/// returned.
///
/// # Errors
/// [`ProjectionFailed`] if the best iterate is more than `tolerance` from one of the surfaces.
pub(crate) fn project_to_both(
    a: &Surface,
    b: &Surface,
    point: &Point,
    tolerance: f64,
) -> Result<Point, ProjectionFailed> {
    /// Far away the distance halves in each step, near the solution it converges quadratically: 50
    /// halvings cover the precision of a double.
    const STEPS: usize = 60;
    /// In the first steps the distance may grow, near strongly curved surfaces.
    const FREE_STEPS: usize = 6;
    let mut at = *point;
    let mut best = (f64::INFINITY, at);
    for step in 0..STEPS {
        let (values, gradients) = ([a.value(&at), b.value(&at)], [a.gradient(&at), b.gradient(&at)]);
        let squares = gradients.map(|g| g.norm_squared());
        let distance = f64::max(
            if values[0] == 0.0 { 0.0 } else { values[0].abs() / squares[0].sqrt() },
            if values[1] == 0.0 { 0.0 } else { values[1].abs() / squares[1].sqrt() },
        );
        let halved = distance <= 0.5 * best.0;
        if distance < best.0 {
            best = (distance, at);
        }
        if distance == 0.0 || !(halved || (step < FREE_STEPS && best.0 > tolerance)) {
            break;
        }
        match shortest_step(values, gradients, squares) {
            Some(shift) => at += shift,
            None => break,
        }
    }
    if best.0 <= tolerance.max(COORDINATE_ROUNDING * best.1.coords.amax()) {
        Ok(best.1)
    } else {
        Err(ProjectionFailed(*point))
    }
}

/// The shortest vector s with gradientᵢ·s = -valueᵢ; `None` if the gradients are parallel.
pub(crate) fn shortest_step(values: [f64; 2], gradients: [Vector; 2], squares: [f64; 2]) -> Option<Vector> {
    /// Smallest squared sine of the angle between the gradients. Below it, a rounding error of
    /// 1e-16 in the values moves the point by more than 1e-9.
    const LEAST_SINE_SQUARED: f64 = 1e-14;
    let mixed = gradients[0].dot(&gradients[1]);
    // By the cross product: squares[0] * squares[1] - mixed² would lose half the digits if the
    // gradients are nearly parallel.
    let determinant = gradients[0].cross(&gradients[1]).norm_squared();
    if determinant <= LEAST_SINE_SQUARED * squares[0] * squares[1] {
        return None;
    }
    let first = (mixed * values[1] - squares[1] * values[0]) / determinant;
    let second = (mixed * values[0] - squares[0] * values[1]) / determinant;
    Some(gradients[0] * first + gradients[1] * second)
}

fn encode_surface(surface: &Surface, out: &mut Vec<f64>) {
    let mut put = |kind: u8, vectors: &[Vector], numbers: &[f64]| {
        out.push(f64::from(kind));
        out.extend(vectors.iter().flat_map(|v| v.iter()));
        out.extend(numbers);
    };
    match surface {
        Surface::Plane(p) => put(0, &[p.point.coords, p.normal], &[]),
        Surface::Sphere(s) => put(1, &[s.center.coords], &[s.radius]),
        Surface::Cylinder(c) => put(2, &[c.point.coords, c.axis], &[c.radius]),
        Surface::Cone(c) => put(3, &[c.point.coords, c.axis], &[c.radius, c.slope]),
        Surface::Torus(t) => put(4, &[t.center.coords, t.axis], &[t.major, t.minor]),
        Surface::Ellipsoid(e) => put(5, &[e.center.coords, e.axes[0], e.axes[1], e.axes[2]], &e.radii),
        Surface::EllipticCylinder(e) => put(6, &[e.point.coords, e.axes[0], e.axes[1]], &e.radii),
        Surface::EllipticCone(e) => {
            put(7, &[e.point.coords, e.axes[0], e.axes[1], e.axis], &[e.radii[0], e.radii[1], e.rate]);
        }
        Surface::Nappe(c) => put(8, &[c.point.coords, c.axis], &[c.radius, c.slope]),
        Surface::Revolved(r) => put(9, &[r.point.coords, r.axis], &ellipse_numbers(&r.profile)),
        Surface::Sweep(s) => {
            let vectors = [s.center.coords, s.axis, s.start, s.up];
            match s.section {
                Section::Line { normal: [x, y], offset } => {
                    put(10, &vectors, &[s.radii[0], s.radii[1], x, y, offset])
                }
                Section::Ellipse(e) => {
                    let [a, b, c, d, e, f] = ellipse_numbers(&e);
                    put(11, &vectors, &[s.radii[0], s.radii[1], a, b, c, d, e, f]);
                }
            }
        }
    }
}

fn ellipse_numbers(e: &Ellipse) -> [f64; 6] {
    [e.center[0], e.center[1], e.axis[0], e.axis[1], e.radii[0], e.radii[1]]
}

/// Reads numbers from the front of a slice.
struct Reader<'a>(&'a [f64]);

impl Reader<'_> {
    fn number(&mut self) -> Option<f64> {
        let (first, rest) = self.0.split_first()?;
        self.0 = rest;
        Some(*first)
    }

    /// A count or an index: an integer that fits an id.
    fn count(&mut self) -> Option<usize> {
        let number = self.number()?;
        (number.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&number)).then_some(number as usize)
    }

    fn vector(&mut self) -> Option<Vector> {
        Some(Vector::new(self.number()?, self.number()?, self.number()?))
    }

    fn point(&mut self) -> Option<Point> {
        self.vector().map(Point::from)
    }

    fn ellipse(&mut self) -> Option<Ellipse> {
        let mut pair = || Some([self.number()?, self.number()?]);
        Some(Ellipse { center: pair()?, axis: pair()?, radii: pair()? })
    }

    /// A periodic copy; both ids must be less than `count`.
    fn copy(&mut self, count: usize) -> Option<PeriodicCopy> {
        let ids = [self.count()?, self.count()?];
        let quaternion = Quaternion::from([self.number()?, self.number()?, self.number()?, self.number()?]);
        let rotation = UnitQuaternion::new_unchecked(quaternion);
        let motion = Isometry3::from_parts(Translation3::from(self.vector()?), rotation);
        ids.iter().all(|&id| id < count).then_some(PeriodicCopy { ids: ids.map(|id| id as u32), motion })
    }

    fn surface(&mut self) -> Option<Surface> {
        Some(match self.count()? {
            0 => Surface::Plane(Plane { point: self.point()?, normal: self.vector()? }),
            1 => Surface::Sphere(Sphere { center: self.point()?, radius: self.number()? }),
            2 => Surface::Cylinder(Cylinder {
                point: self.point()?,
                axis: self.vector()?,
                radius: self.number()?,
            }),
            3 => Surface::Cone(Cone {
                point: self.point()?,
                axis: self.vector()?,
                radius: self.number()?,
                slope: self.number()?,
            }),
            4 => Surface::Torus(Torus {
                center: self.point()?,
                axis: self.vector()?,
                major: self.number()?,
                minor: self.number()?,
            }),
            5 => Surface::Ellipsoid(Ellipsoid {
                center: self.point()?,
                axes: [self.vector()?, self.vector()?, self.vector()?],
                radii: [self.number()?, self.number()?, self.number()?],
            }),
            6 => Surface::EllipticCylinder(EllipticCylinder {
                point: self.point()?,
                axes: [self.vector()?, self.vector()?],
                radii: [self.number()?, self.number()?],
            }),
            7 => Surface::EllipticCone(EllipticCone {
                point: self.point()?,
                axes: [self.vector()?, self.vector()?],
                axis: self.vector()?,
                radii: [self.number()?, self.number()?],
                rate: self.number()?,
            }),
            8 => Surface::Nappe(Nappe {
                point: self.point()?,
                axis: self.vector()?,
                radius: self.number()?,
                slope: self.number()?,
            }),
            9 => Surface::Revolved(Revolved {
                point: self.point()?,
                axis: self.vector()?,
                profile: self.ellipse()?,
            }),
            kind @ (10 | 11) => {
                let center = self.point()?;
                let [axis, start, up] = [self.vector()?, self.vector()?, self.vector()?];
                let radii = [self.number()?, self.number()?];
                let section = if kind == 10 {
                    Section::Line { normal: [self.number()?, self.number()?], offset: self.number()? }
                } else {
                    Section::Ellipse(self.ellipse()?)
                };
                Surface::Sweep(Sweep { center, axis, start, radii, up, section })
            }
            _ => return None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A plane, a sphere and two crossing cylinders, with a curve for each pair that intersects.
    fn projector() -> Projector {
        let surfaces = vec![
            Surface::Plane(Plane { point: Point::new(0.0, 0.0, 0.2), normal: Vector::z() }),
            Surface::Sphere(Sphere { center: Point::new(0.1, 0.0, 0.0), radius: 1.0 }),
            Surface::Cylinder(Cylinder { point: Point::origin(), axis: Vector::z(), radius: 0.6 }),
            Surface::Cylinder(Cylinder { point: Point::origin(), axis: Vector::x(), radius: 0.4 }),
        ];
        let pair = |a, b| [SurfaceId(a), SurfaceId(b)];
        let curves = vec![pair(0, 1), pair(0, 2), pair(0, 3), pair(1, 2), pair(1, 3), pair(2, 3)];
        let patches = (0..4).map(SurfaceId).collect();
        Projector { surfaces, curves, patches, tolerance: 2e-12, ..Projector::default() }
    }

    proptest! {
        #![proptest_config(crate::seeded())]

        #[test]
        fn a_point_near_a_curve_goes_to_a_near_point_of_both_surfaces(
            curve in 0..6u32,
            start in [-1.0..1.0f64, -1.0..1.0f64, -1.0..1.0f64],
            shift in [-0.05..0.05f64, -0.05..0.05f64, -0.05..0.05f64],
        ) {
            let projector = projector();
            let Ok(on) = projector.project_curve(CurveId(curve), &start.into()) else { return Ok(()) };
            let near = on + Vector::from(shift);
            let back = projector.project_curve(CurveId(curve), &near).unwrap();
            prop_assert!(projector.curve_distance(CurveId(curve), &back) <= 4.0 * f64::EPSILON);
            // The projection is nearest to first order only; the factor allows for curvature.
            prop_assert!((near - back).norm() <= (near - on).norm() * 1.3);
            let again = projector.project_curve(CurveId(curve), &back).unwrap();
            prop_assert!((again - back).norm() <= 8.0 * f64::EPSILON);
        }
    }

    #[test]
    fn surfaces_that_do_not_meet_have_no_common_point() {
        let mut projector = projector();
        projector.surfaces[0] =
            Surface::Plane(Plane { point: Point::new(0.0, 0.0, 3.0), normal: Vector::z() });
        assert!(projector.project_curve(CurveId(0), &Point::new(0.5, 0.3, 1.5)).is_err());
    }

    #[test]
    fn encoding_round_trips_and_invalid_input_is_rejected() {
        let mut projector = projector();
        let o = Point::origin();
        let axes = [Vector::x(), Vector::y(), Vector::z()];
        projector.surfaces.extend([
            Surface::Cone(Cone { point: o, axis: axes[0], radius: 1.0, slope: 0.5 }),
            Surface::Torus(Torus { center: o, axis: axes[1], major: 2.0, minor: 0.5 }),
            Surface::Ellipsoid(Ellipsoid { center: o, axes, radii: [1.0, 2.0, 3.0] }),
            Surface::EllipticCylinder(EllipticCylinder {
                point: o,
                axes: [axes[0], axes[1]],
                radii: [1.0, 2.0],
            }),
            Surface::EllipticCone(EllipticCone {
                point: o,
                axes: [axes[0], axes[1]],
                radii: [1.0, 2.0],
                axis: axes[2],
                rate: -0.25,
            }),
            Surface::Nappe(Nappe { point: o, axis: axes[0], radius: 1.0, slope: 0.5 }),
            Surface::Revolved(Revolved {
                point: o,
                axis: axes[1],
                profile: Ellipse { center: [3.0, 0.5], axis: [0.6, 0.8], radii: [1.0, 2.0] },
            }),
        ]);
        let sections = [
            Section::Line { normal: [0.6, 0.8], offset: 0.3 },
            Section::Ellipse(Ellipse { center: [0.1, 0.2], axis: [0.6, 0.8], radii: [1.0, 2.0] }),
        ];
        let [axis, start, up] = [axes[2], axes[0], Vector::new(0.6, 0.0, 0.8)];
        let sweep =
            |section| Surface::Sweep(Sweep { center: o, axis, start, radii: [5.0, 4.0], up, section });
        projector.surfaces.extend(sections.map(sweep));
        let turn = Isometry3::new(Vector::new(1.0, 2.0, 3.0), Vector::new(0.1, 0.2, 0.3));
        projector.curve_copies = vec![PeriodicCopy { ids: [3, 1], motion: turn }];
        projector.patch_copies = vec![PeriodicCopy { ids: [2, 0], motion: turn.inverse() }];
        let numbers = projector.encode();
        assert_eq!(Projector::decode(&numbers), Some(projector));
        assert_eq!(Projector::decode(&numbers[..numbers.len() - 1]), None);
        assert_eq!(Projector::decode(&[&numbers[..], &[0.0]].concat()), None);
        let mut wrong = numbers.clone();
        wrong[4] = 99.0;
        assert_eq!(Projector::decode(&wrong), None);
    }
}
