//! Unifies equal surfaces.
//!
//! Two bodies meet conformingly if their boundaries have the same surface; for example, adjacent
//! bricks must share a plane. As in NETGEN, a surface is replaced by the first equal surface of the
//! file, whose flags apply.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use super::forest::RawSurface;
use crate::geometry::SurfaceInfo;
use crate::{Point, Surface, SurfaceId, Vector};

/// Largest distance between equal surfaces, as a fraction of the size of the geometry.
///
/// It exceeds the rounding of transforms (10⁻¹⁵) and of decimals with nine digits, and is less than
/// any intended gap (a coating of one micrometer on a part of ten meters is 10⁻⁷). NETGEN uses the
/// same factor, but with the size of `boundingbox`, which is 1100 by default.
const EQUAL_SURFACES: f64 = 1e-8;

/// Surfaces that are taken as one are told if they are more than this fraction of the size of the
/// geometry apart: decimals with ten digits are not.
const TOLD: f64 = 1e-10;

/// Upper bound of the angle between surfaces that [`Surface::same_as`] considers equal, with a
/// margin.
const LARGEST_ANGLE: f64 = 1e-4;

/// The equivalence classes of raw surfaces.
#[derive(Debug, Default)]
pub(super) struct Classes {
    /// For each raw surface, the first equal one and whether it has the opposite inside.
    first: Vec<(usize, bool)>,
    /// Used raw surfaces that are apart from the first equal one, and by how much (length).
    gaps: Vec<(usize, f64)>,
    /// The ids of the representatives that are used by bodies, ascending.
    ids: BTreeMap<usize, SurfaceId>,
}

impl Classes {
    /// Finds equal surfaces in `raw`; `used` are the indices used by bodies. Surfaces within
    /// `merge` (length) are equal in any case.
    pub fn find(raw: &[RawSurface], used: &BTreeSet<usize>, merge: f64) -> Self {
        let place = Place::of(used.iter().filter_map(|&i| raw[i].surface.as_ref()), merge);
        let mut cells: HashMap<Cell, Vec<usize>> = HashMap::new();
        let mut first = Vec::with_capacity(raw.len());
        for (i, RawSurface { surface, .. }) in raw.iter().enumerate() {
            let Some(surface) = surface else {
                first.push((i, false));
                continue;
            };
            let cell = place.cell(surface);
            let near = cell.with_neighbors();
            let near = near.iter().filter_map(|cell| cells.get(cell)).flatten();
            let equal = |&j: &usize| {
                let same_side = surface.same_as(raw[j].surface.as_ref()?, place.tolerance)?;
                Some((j, !same_side))
            };
            let representative = near.filter_map(equal).min();
            if representative.is_none() {
                cells.entry(cell).or_default().push(i);
            }
            first.push(representative.unwrap_or((i, false)));
        }
        let firsts: BTreeSet<usize> = used.iter().map(|&i| first[i].0).collect();
        let ids = firsts.into_iter().enumerate().map(|(id, i)| (i, SurfaceId::new(id))).collect();
        let gaps = used.iter().filter_map(|&i| Some((i, place.gap(raw, [i, first[i].0])?))).collect();
        Self { first, gaps, ids }
    }

    /// Raw surfaces that were taken as one with another although they are apart, and by how much.
    pub fn gaps(&self) -> &[(usize, f64)] {
        &self.gaps
    }

    /// The representative of the raw surface at `index`, and whether its orientation is opposite.
    ///
    /// # Panics
    /// If no body uses the surface.
    pub fn half_space(&self, index: usize) -> (SurfaceId, bool) {
        let (first, flipped) = self.first[index];
        (self.ids[&first], flipped)
    }

    /// The id of the raw surface at `index`, if bodies use it or an equal one.
    pub fn id(&self, index: usize) -> Option<SurfaceId> {
        self.ids.get(&self.first[index].0).copied()
    }

    /// The raw surface whose flags apply to the one at `index`.
    pub fn first(&self, index: usize) -> usize {
        self.first[index].0
    }

    /// The surfaces used by bodies, with their options.
    ///
    /// The mesh size is the smallest of all equal surfaces in use; the other options come from the
    /// first one.
    pub fn surfaces(&self, raw: &[RawSurface], used: &BTreeSet<usize>) -> (Vec<Surface>, Vec<SurfaceInfo>) {
        let counts = |&i: &usize| raw[i].surface.clone().map(|surface| (surface, raw[i].info.clone()));
        let (surfaces, mut infos): (Vec<Surface>, Vec<SurfaceInfo>) =
            self.ids.keys().filter_map(counts).unzip();
        for info in &mut infos {
            info.maxh = None;
        }
        for &i in used {
            if let (Some(id), Some(maxh)) = (self.id(i), raw[i].info.maxh) {
                let least = &mut infos[id.index()].maxh;
                *least = Some(least.map_or(maxh, |least: f64| least.min(maxh)));
            }
        }
        (surfaces, infos)
    }
}

/// The bounding box of the points that define the surfaces.
struct Place {
    center: Point,
    size: f64,
    /// Largest distance between equal surfaces, a length.
    tolerance: f64,
}

impl Place {
    fn of<'a>(surfaces: impl Iterator<Item = &'a Surface>, merge: f64) -> Self {
        let mut min = Vector::repeat(f64::INFINITY);
        let mut max = -min;
        for (point, radius) in surfaces.map(anchor) {
            min = min.inf(&(point.coords - Vector::repeat(radius)));
            max = max.sup(&(point.coords + Vector::repeat(radius)));
        }
        if min.x > max.x {
            (min, max) = (Vector::zeros(), Vector::zeros());
        }
        let size = (max - min).norm();
        Self { center: Point::from((min + max) / 2.0), size, tolerance: merge.max(EQUAL_SURFACES * size) }
    }

    /// How far two equal surfaces are apart (length), to three digits; `None` if that is rounding.
    fn gap(&self, raw: &[RawSurface], pair: [usize; 2]) -> Option<f64> {
        /// Halvings of an interval that spans a factor of 10¹⁶.
        const STEPS: usize = 20;
        let [a, b] = pair.map(|i| raw[i].surface.as_ref());
        let (a, b) = (a?, b?);
        let least = TOLD * self.size;
        if pair[0] == pair[1] || a.same_as(b, least).is_some() {
            return None;
        }
        let (mut low, mut high) = (least, self.tolerance);
        for _ in 0..STEPS {
            let middle = (low * high).sqrt();
            *(if a.same_as(b, middle).is_some() { &mut high } else { &mut low }) = middle;
        }
        Some(high)
    }

    /// The hash cell of a surface; equal surfaces are in the same or in adjacent cells.
    fn cell(&self, surface: &Surface) -> Cell {
        // Equal surfaces nearly agree in this point. If they are rotated against each other, they
        // separate toward the center.
        let foot_on_axis = |point: &Point, axis: &Vector| {
            let arm = self.center - point;
            point + axis * (arm.dot(axis) / axis.norm_squared())
        };
        let (kind, point) = match surface {
            Surface::Plane(p) => (0, self.center - p.normal * p.normal.dot(&(self.center - p.point))),
            Surface::Sphere(sphere) => (1, sphere.center),
            Surface::Ellipsoid(ellipsoid) => (1, ellipsoid.center),
            Surface::Torus(torus) => (2, torus.center),
            Surface::Cylinder(c) => (3, foot_on_axis(&c.point, &c.axis)),
            Surface::EllipticCylinder(c) => (3, foot_on_axis(&c.point, &c.axes[0].cross(&c.axes[1]))),
            Surface::Cone(cone) => (4, cone.apex()),
            Surface::EllipticCone(cone) => (4, cone.apex()),
            Surface::Nappe(cone) => (5, cone.apex()),
            Surface::Revolved(r) => (6, r.point + r.axis * r.profile.center[1]),
            Surface::Sweep(s) => (7, s.center),
        };
        let width = (4.0 * (self.tolerance + LARGEST_ANGLE * self.size)).max(f64::MIN_POSITIVE);
        // Arbitrary directions that rarely map points of a regular grid to the same value.
        let directions = [Vector::new(0.618, 0.414, 0.666), Vector::new(-0.532, 0.771, 0.351)];
        let place = directions.map(|d| ((point - self.center).dot(&d) / width).floor() as i64);
        Cell { kind, place }
    }
}

/// Surfaces of one kind with about the same position.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
struct Cell {
    kind: u8,
    place: [i64; 2],
}

impl Cell {
    fn with_neighbors(self) -> [Self; 9] {
        std::array::from_fn(|i| {
            let shift = [i as i64 / 3 - 1, i as i64 % 3 - 1];
            Self { place: [0, 1].map(|k| self.place[k].saturating_add(shift[k])), ..self }
        })
    }
}

/// A point that defines the surface, and the distance of the surface from it where it indicates the
/// size.
fn anchor(surface: &Surface) -> (Point, f64) {
    match surface {
        Surface::Plane(plane) => (plane.point, 0.0),
        Surface::Sphere(sphere) => (sphere.center, sphere.radius),
        Surface::Cylinder(cylinder) => (cylinder.point, cylinder.radius),
        Surface::Cone(cone) => (cone.point, cone.radius),
        Surface::Torus(torus) => (torus.center, torus.major + torus.minor),
        Surface::Ellipsoid(e) => (e.center, e.radii.iter().copied().fold(0.0, f64::max)),
        Surface::EllipticCylinder(c) => (c.point, c.radii[0].max(c.radii[1])),
        Surface::EllipticCone(c) => (c.point, c.radii[0].max(c.radii[1])),
        Surface::Nappe(cone) => (cone.point, cone.radius),
        Surface::Revolved(r) => (r.point, r.reach()),
        Surface::Sweep(s) => (s.center, s.reach()),
    }
}
