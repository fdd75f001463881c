//! Bodies that touch, each filled by itself.
//!
//! Triangles of bodies that touch may intersect, so that no triangulation of space has them all. As
//! the tets of each body have exactly its triangles as faces, bodies with common triangles conform.

use super::closed_surface::doubles;
use super::surface_faults::{SurfaceFault, SurfaceFaults};
use super::{ClosedSurface, Report, Settings, VolumeError, VolumeMesh, intersections, mesh as fill};
use crate::Point;
use crate::ground::mesh::{Touching, have_common_body};
use crate::ground::size::SizeField;
use csg::BodyId;
use std::collections::BTreeSet;

const NONE: u32 = u32::MAX;

impl ClosedSurface {
    /// Makes the surface of bodies some of which touch, each of which is filled by itself.
    ///
    /// Each body has a closed surface. Triangles of bodies that touch may intersect, and points of
    /// theirs may be at the same place.
    ///
    /// # Errors
    /// As for [`ClosedSurface::new`].
    pub fn of_touching(
        points: Vec<Point>,
        triangles: Vec<[u32; 3]>,
        regions: Vec<[Option<BodyId>; 2]>,
        touching: &Touching,
    ) -> Result<Self, SurfaceFaults> {
        if touching.is_empty() {
            return Self::new(points, triangles, regions);
        }
        let surface = Self { points, triangles, regions, is_apart: true, ..Self::default() };
        let mut faults = surface.index_faults();
        if faults.is_empty() {
            faults = surface.faults_apart(touching);
        }
        if faults.is_empty() { Ok(surface) } else { Err(SurfaceFaults(faults)) }
    }

    /// The faults of the surface of each body, and triangles that intersect of bodies that do not
    /// touch.
    fn faults_apart(&self, touching: &Touching) -> Vec<SurfaceFault> {
        let outside = self.regions.iter().zip(0..).filter(|(regions, _)| **regions == [None, None]);
        let bounds_nothing = |(_, triangle): (_, u32)| SurfaceFault::BoundsNothing {
            triangle,
            place: self.points[self.triangles[triangle as usize][0] as usize],
        };
        let mut faults: Vec<SurfaceFault> = outside.map(bounds_nothing).collect();
        for body in self.bodies() {
            let alone = Alone::new(self, body);
            for mut fault in alone.surface.form_faults() {
                fault.renumber(&alone.points, &alone.triangles);
                // Those of a common triangle are found in both bodies.
                if !faults.contains(&fault) {
                    faults.push(fault);
                }
            }
        }
        for [first, again] in doubles(&self.triangles) {
            // Those of one body are among its faults, and a common triangle is there once.
            let [a, b] = [first, again].map(|t| self.regions[t as usize]);
            if !have_common_body(a, b) {
                let place = self.points[self.triangles[first as usize][0] as usize];
                faults.push(SurfaceFault::Twice { triangles: [first, again], place });
            }
        }
        for (pair, place) in intersections(&self.points, &self.triangles) {
            let [a, b] = pair.map(|t| self.regions[t as usize]);
            // Those of one body are among its faults.
            if !have_common_body(a, b) && !touching.may_meet(a, b) {
                faults.push(SurfaceFault::Intersect { triangles: pair, place });
            }
        }
        faults
    }

    fn bodies(&self) -> BTreeSet<BodyId> {
        self.regions.iter().flatten().copied().flatten().collect()
    }
}

/// Fills each body of a surface by itself.
///
/// # Errors
/// Those of [`super::mesh`].
pub(super) fn mesh(
    surface: &ClosedSurface,
    size: &dyn SizeField,
    settings: &Settings,
) -> Result<(VolumeMesh, Report), VolumeError> {
    let mut made = VolumeMesh { points: surface.points.clone(), ..VolumeMesh::default() };
    let mut report = Report::default();
    for body in surface.bodies() {
        let alone = Alone::new(surface, body);
        let left = Settings { max_tets: settings.max_tets.saturating_sub(made.tets.len()), ..*settings };
        let (filled, own) = fill(&alone.surface, size, &left).map_err(|error| match error {
            VolumeError::TooManyTets { .. } => VolumeError::TooManyTets { limit: settings.max_tets },
            error => alone.renumbered(error),
        })?;
        alone.append(filled, &mut made);
        add(&mut report, &own);
    }
    Ok((made, report))
}

/// The surface of one body.
struct Alone {
    surface: ClosedSurface,
    /// The points and triangles in the surface of all bodies.
    points: Vec<u32>,
    triangles: Vec<u32>,
}

impl Alone {
    fn new(all: &ClosedSurface, body: BodyId) -> Self {
        let mut alone = Self { surface: ClosedSurface::default(), points: Vec::new(), triangles: Vec::new() };
        let mut new = vec![NONE; all.points.len()];
        let of_body = all.regions.iter().zip(0..).filter(|(regions, _)| regions.contains(&Some(body)));
        for (regions, t) in of_body {
            let triangle = all.triangles[t as usize].map(|old| {
                let number = &mut new[old as usize];
                if *number == NONE {
                    *number = alone.points.len() as u32;
                    alone.points.push(old);
                    alone.surface.points.push(all.points[old as usize]);
                }
                *number
            });
            alone.triangles.push(t);
            alone.surface.triangles.push(triangle);
            alone.surface.regions.push(regions.map(|region| region.filter(|region| *region == body)));
        }
        alone
    }

    /// An error with the numbers that triangles have in the surface of all bodies.
    fn renumbered(&self, mut error: VolumeError) -> VolumeError {
        let renumber = |t: &mut u32| *t = self.triangles[*t as usize];
        match &mut error {
            VolumeError::NotRecovered { triangles, nearest, .. } => {
                let near = nearest.iter_mut().flat_map(|pair| &mut pair.triangles);
                triangles.iter_mut().chain(near).for_each(renumber);
            }
            VolumeError::Inconsistent { triangle, .. } => renumber(triangle),
            _ => {}
        }
        error
    }

    /// Adds the tets of the body to those of others.
    fn append(&self, filled: VolumeMesh, made: &mut VolumeMesh) {
        let (own, first) = (self.points.len(), made.points.len());
        let number = |v: u32| match self.points.get(v as usize) {
            Some(&old) => old,
            None => (first + v as usize - own) as u32,
        };
        made.points.extend(&filled.points[own..]);
        made.tets.extend(filled.tets.iter().map(|tet| tet.map(number)));
        made.bodies.extend(filled.bodies);
    }
}

fn add(report: &mut Report, own: &Report) {
    report.missing_edges += own.missing_edges;
    report.missing_faces += own.missing_faces;
    report.steiner_on_surface += own.steiner_on_surface;
    report.steiner_inside += own.steiner_inside;
    report.on_kept_edges += own.on_kept_edges;
    report.restarts += own.restarts;
    report.points_inside += own.points_inside;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::size::UniformSize;
    use std::collections::BTreeMap;

    #[derive(Clone, Default)]
    struct Cubes {
        points: Vec<Point>,
        triangles: Vec<[u32; 3]>,
        regions: Vec<[Option<BodyId>; 2]>,
    }

    impl Cubes {
        /// Adds a cube of edge 1 from a corner.
        fn add(&mut self, body: u32, corner: [f64; 3]) {
            let first = self.points.len() as u32;
            let vertex = |k: i32| Point::from([0, 1, 2].map(|i| corner[i] + f64::from(k >> i & 1)));
            self.points.extend((0..8).map(vertex));
            let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
            let halves = |[a, b, c, d]: [u32; 4]| [[a, b, c], [a, c, d]].map(|t| t.map(|v| v + first));
            self.triangles.extend(sides.into_iter().flat_map(halves));
            self.regions.extend([[Some(BodyId(body)), None]; 12]);
        }

        /// Two cubes with parts of a side in common.
        fn shifted() -> Self {
            let mut cubes = Self::default();
            cubes.add(3, [0.0; 3]);
            cubes.add(5, [1.0, 0.3, 0.4]);
            cubes
        }

        fn apart(self) -> Result<ClosedSurface, SurfaceFaults> {
            ClosedSurface::of_touching(self.points, self.triangles, self.regions, &touching())
        }
    }

    fn touching() -> Touching {
        let mut touching = Touching::default();
        touching.add([Some(BodyId(3)), None], [Some(BodyId(5)), None]);
        touching
    }

    #[test]
    fn a_triangle_of_two_bodies_may_not_be_there_twice() {
        let mut cubes = Cubes::default();
        cubes.add(3, [0.0; 3]);
        cubes.add(5, [1.0, 0.0, 0.0]);
        // Both have the vertices of the common side, but each its own triangles.
        for v in cubes.triangles.iter_mut().flatten().filter(|v| **v >= 8) {
            *v = if *v % 2 == 0 { *v - 7 } else { (*v + 7) / 2 };
        }
        cubes.points = (0..8).chain([9, 11, 13, 15]).map(|v| cubes.points[v]).collect();
        let SurfaceFaults(faults) = cubes.apart().unwrap_err();
        assert_eq!(faults.len(), 2, "{faults:?}");
        assert!(faults.iter().all(|fault| matches!(fault, SurfaceFault::Twice { .. })), "{faults:?}");
    }

    #[test]
    fn bodies_that_touch_are_filled_each_by_itself() {
        let Cubes { points, triangles, regions } = Cubes::shifted();
        assert!(ClosedSurface::new(points.clone(), triangles, regions).is_err());
        let surface = Cubes::shifted().apart().unwrap();
        let (filled, report) = super::super::mesh(&surface, &UniformSize(0.4), &Settings::default()).unwrap();
        assert_eq!(filled.points[..16], points);
        assert!(report.points_inside > 2);
        let mut volumes = BTreeMap::new();
        for (tet, body) in filled.tets.iter().zip(&filled.bodies) {
            let [a, b, c, d] = tet.map(|v| filled.points[v as usize]);
            *volumes.entry(body.0).or_insert(0.0) += (b - a).cross(&(c - a)).dot(&(d - a)) / 6.0;
            let own = if body.0 == 3 { 0..8 } else { 8..16 };
            assert!(tet.iter().all(|v| *v >= 16 || own.contains(v)), "{tet:?}");
        }
        assert_eq!(volumes.len(), 2);
        assert!(volumes.values().all(|volume: &f64| (volume - 1.0).abs() < 1e-12), "{volumes:?}");
    }

    #[test]
    fn points_of_bodies_that_touch_may_be_at_one_place() {
        let mut cubes = Cubes::default();
        cubes.add(3, [0.0; 3]);
        cubes.add(5, [1.0, 0.0, 0.0]);
        cubes.apart().unwrap();
    }

    #[test]
    fn faults_have_the_numbers_of_the_whole_surface() {
        // A hole in the second cube, and a third one that cuts into the first.
        let mut open = Cubes::shifted();
        open.triangles.remove(20);
        open.regions.remove(20);
        let found = open.apart().unwrap_err();
        let is_of_second = |fault: &SurfaceFault| match fault {
            SurfaceFault::NotClosed { edge, triangles, .. } => {
                edge.iter().all(|v| *v >= 8) && triangles.iter().all(|t| *t >= 12)
            }
            _ => false,
        };
        assert!(found.0.len() == 3 && found.0.iter().all(is_of_second), "{found}");

        let mut cut = Cubes::shifted();
        cut.add(7, [0.1, 0.2, 0.3]);
        let found = cut.apart().unwrap_err();
        let is_of_third = |fault: &SurfaceFault| match fault {
            SurfaceFault::Intersect { triangles, .. } => triangles.iter().any(|t| *t >= 24),
            _ => false,
        };
        assert!(found.0.iter().all(is_of_third), "{found}");
    }
}
