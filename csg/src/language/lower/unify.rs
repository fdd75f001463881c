//! Equal surfaces become one.
//!
//! Two bodies meet conformingly where their boundaries have the same surface, so that two bricks side by side
//! must find that they share a plane. As in NETGEN, a surface is replaced by the first of the file that
//! equals it, and the flags of that one count.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use super::forest::RawSurface;
use crate::geometry::SurfaceInfo;
use crate::{Point, Surface, SurfaceId, Vector};

/// How far two surfaces may lie apart and still be one, as a fraction of the size of the geometry.
///
/// Above: the rounding of transforms (10⁻¹⁵) and of decimals typed with nine digits. Below: any gap meant as
/// one (a coating of a micrometre on a part of ten metres is 10⁻⁷). NETGEN has the same factor, but takes the
/// size from `boundingbox`, which is 1100 where the file says nothing.
const EQUAL_SURFACES: f64 = 1e-8;

/// Bound for the angle between two surfaces that [`Surface::same_as`] may call equal, with room to spare.
const LARGEST_ANGLE: f64 = 1e-4;

/// Which surfaces are one.
#[derive(Debug, Default)]
pub(super) struct Classes {
    /// For each raw surface the first that equals it, and whether its inside is the outside of that one.
    first: Vec<(usize, bool)>,
    /// The surfaces that count: the first ones of those in use, ascending.
    ids: BTreeMap<usize, SurfaceId>,
}

impl Classes {
    /// Finds the equal ones of `raw`; `used` are those that bodies need.
    pub fn find(raw: &[RawSurface], used: &BTreeSet<usize>) -> Self {
        let place = Place::of(used.iter().filter_map(|&i| raw[i].surface.as_ref()));
        let mut cells: HashMap<Cell, Vec<usize>> = HashMap::new();
        let mut first = Vec::with_capacity(raw.len());
        for (i, RawSurface { surface, .. }) in raw.iter().enumerate() {
            let Some(surface) = surface else {
                first.push((i, false));
                continue;
            };
            let cell = place.cell(surface);
            let near = cell.with_neighbours();
            let near = near.iter().filter_map(|cell| cells.get(cell)).flatten();
            let equal = |&j: &usize| {
                let same_side = surface.same_as(raw[j].surface.as_ref()?, place.tolerance())?;
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
        Self { first, ids }
    }

    /// The surface that stands for the raw one at `index`, and whether the other side of it is meant.
    ///
    /// # Panics
    /// If no body uses it.
    pub fn half_space(&self, index: usize) -> (SurfaceId, bool) {
        let (first, flipped) = self.first[index];
        (self.ids[&first], flipped)
    }

    /// The id of the raw surface at `index`, if bodies use it or one that equals it.
    pub fn id(&self, index: usize) -> Option<SurfaceId> {
        self.ids.get(&self.first[index].0).copied()
    }

    /// The raw surface whose flags count for the one at `index`.
    pub fn first(&self, index: usize) -> usize {
        self.first[index].0
    }

    /// The surfaces that bodies use with what the file says of them. The mesh size is the least of all that
    /// are in use and equal; all else comes from the first.
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

/// Where the geometry is: the box of the points that define its surfaces.
struct Place {
    center: Point,
    size: f64,
}

impl Place {
    fn of<'a>(surfaces: impl Iterator<Item = &'a Surface>) -> Self {
        let mut min = Vector::repeat(f64::INFINITY);
        let mut max = -min;
        for (point, radius) in surfaces.map(anchor) {
            min = min.inf(&(point.coords - Vector::repeat(radius)));
            max = max.sup(&(point.coords + Vector::repeat(radius)));
        }
        if min.x > max.x {
            (min, max) = (Vector::zeros(), Vector::zeros());
        }
        Self { center: Point::from((min + max) / 2.0), size: (max - min).norm() }
    }

    fn tolerance(&self) -> f64 {
        EQUAL_SURFACES * self.size
    }

    /// The cell of a surface; equal ones are in the same one or in neighbours.
    fn cell(&self, surface: &Surface) -> Cell {
        // Equal surfaces have this point in common, nearly: those that turn a little against each other drift
        // apart towards the centre.
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
        let width = (4.0 * (EQUAL_SURFACES + LARGEST_ANGLE) * self.size).max(f64::MIN_POSITIVE);
        // Any directions will do; these seldom map points of a regular grid to one place.
        let directions = [Vector::new(0.618, 0.414, 0.666), Vector::new(-0.532, 0.771, 0.351)];
        let place = directions.map(|d| ((point - self.center).dot(&d) / width).floor() as i64);
        Cell { kind, place }
    }
}

/// Surfaces of one kind at about the same place.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
struct Cell {
    kind: u8,
    place: [i64; 2],
}

impl Cell {
    fn with_neighbours(self) -> [Self; 9] {
        std::array::from_fn(|i| {
            let shift = [i as i64 / 3 - 1, i as i64 % 3 - 1];
            Self { place: [0, 1].map(|k| self.place[k].saturating_add(shift[k])), ..self }
        })
    }
}

/// A point that defines the surface and how far the surface is from it, where that tells of its size.
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
