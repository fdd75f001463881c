//! Small closed surfaces for tests, and the check that a mesh fills one.

use super::{ClosedSurface, SurfaceFaults, VolumeMesh};
use crate::Point;
use crate::kernel::predicates::{Sign, orient3d};
use crate::kernel::simplex::volume6;
use crate::mesh::TET_FACES;
use csg::BodyId;
use std::collections::BTreeMap;

/// Triangles under construction, with regions behind and in front.
#[derive(Clone, Debug, Default)]
pub(super) struct Soup {
    pub points: Vec<Point>,
    pub triangles: Vec<[u32; 3]>,
    pub regions: Vec<[Option<BodyId>; 2]>,
}

pub(super) const INSIDE: [Option<BodyId>; 2] = [Some(BodyId(0)), None];

impl Soup {
    /// Points become one vertex where they are equal.
    pub fn add(&mut self, corners: [Point; 3], regions: [Option<BodyId>; 2]) {
        let triangle = corners.map(|p| {
            self.points.iter().position(|q| *q == p).unwrap_or_else(|| {
                self.points.push(p);
                self.points.len() - 1
            }) as u32
        });
        self.triangles.push(triangle);
        self.regions.push(regions);
    }

    pub fn quad(&mut self, [a, b, c, d]: [Point; 4], regions: [Option<BodyId>; 2]) {
        self.add([a, b, c], regions);
        self.add([a, c, d], regions);
    }

    /// A box of n×n squares a side, from one corner to the opposite one.
    pub fn brick(&mut self, low: [f64; 3], high: [f64; 3], n: usize, regions: [Option<BodyId>; 2]) {
        for axis in 0..3 {
            self.brick_side(low, high, n, axis, false, regions);
            self.brick_side(low, high, n, axis, true, regions);
        }
    }

    pub fn brick_side(
        &mut self,
        low: [f64; 3],
        high: [f64; 3],
        n: usize,
        axis: usize,
        upper: bool,
        regions: [Option<BodyId>; 2],
    ) {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let at = |i: usize, j: usize| {
            let mut p = low;
            p[axis] = if upper { high[axis] } else { low[axis] };
            let between = |k: usize, i: usize| low[k] + (high[k] - low[k]) * (i as f64 / n as f64);
            p[u] = between(u, i);
            p[v] = between(v, j);
            Point::from(p)
        };
        for i in 0..n {
            for j in 0..n {
                let mut corners = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                if !upper {
                    corners.reverse();
                }
                self.quad(corners, regions);
            }
        }
    }

    /// A sphere: the icosahedron with each triangle split in four, `levels` times.
    pub fn sphere(&mut self, center: Point, radius: f64, levels: u32, regions: [Option<BodyId>; 2]) {
        let g = 0.5 * (1.0 + 5f64.sqrt());
        let mut points: Vec<Point> = Vec::new();
        for k in 0..3 {
            for (s, t) in [(1., 1.), (-1., 1.), (1., -1.), (-1., -1.)] {
                let mut p = [0.0; 3];
                (p[k], p[(k + 1) % 3]) = (s, t * g);
                points.push(Point::from(p));
            }
        }
        let near = |p: &Point, q: &Point| (p - q).norm() < 2.1;
        let mut faces = Vec::new();
        for i in 0..12 {
            for j in i + 1..12 {
                for k in j + 1..12 {
                    let [p, q, r] = [points[i], points[j], points[k]];
                    if near(&p, &q) && near(&q, &r) && near(&p, &r) {
                        let out = volume6(&Point::origin(), &p, &q, &r) > 0.0;
                        faces.push(if out { [p, q, r] } else { [q, p, r] });
                    }
                }
            }
        }
        for _ in 0..levels {
            faces = faces
                .iter()
                .flat_map(|&[p, q, r]| {
                    let [a, b, c] =
                        [nalgebra::center(&q, &r), nalgebra::center(&p, &r), nalgebra::center(&p, &q)];
                    [[p, c, b], [c, q, a], [b, a, r], [a, b, c]]
                })
                .collect();
        }
        for face in faces {
            self.add(face.map(|p| center + p.coords.normalize() * radius), regions);
        }
    }

    /// A torus about the z axis.
    pub fn torus(&mut self, [major, minor]: [f64; 2], [m, n]: [usize; 2], regions: [Option<BodyId>; 2]) {
        let at = |i: usize, j: usize| {
            let (u, v) = ((i % m) as f64 / m as f64, (j % n) as f64 / n as f64);
            let (u, v) = (u * std::f64::consts::TAU, v * std::f64::consts::TAU);
            let r = major + minor * v.cos();
            Point::new(r * u.cos(), r * u.sin(), minor * v.sin())
        };
        for i in 0..m {
            for j in 0..n {
                self.quad([at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)], regions);
            }
        }
    }

    pub fn map(&mut self, f: impl Fn(&Point) -> Point) {
        self.points = self.points.iter().map(f).collect();
    }

    pub fn surface(self) -> Result<ClosedSurface, SurfaceFaults> {
        ClosedSurface::new(self.points, self.triangles, self.regions)
    }
}

/// The volume of each body by the surface integral, in exact order of the triangles.
fn volumes_by_surface(surface: &ClosedSurface) -> BTreeMap<BodyId, f64> {
    let mut volumes = BTreeMap::new();
    let center = surface.points[0];
    for (triangle, [behind, front]) in surface.triangles.iter().zip(&surface.regions) {
        let [a, b, c] = triangle.map(|v| &surface.points[v as usize]);
        let v = volume6(&center, a, b, c) / 6.0;
        for (region, sign) in [(behind, 1.0), (front, -1.0)] {
            if let Some(body) = region {
                *volumes.entry(*body).or_insert(0.0) += sign * v;
            }
        }
    }
    volumes
}

/// Everything that a volume mesh promises of its surface; panics with what is broken.
pub(super) fn check_fills(surface: &ClosedSurface, mesh: &VolumeMesh) {
    assert_eq!(mesh.points[..surface.points.len()], surface.points[..]);
    assert_eq!(mesh.tets.len(), mesh.bodies.len());
    let mut used = vec![false; mesh.points.len()];
    let mut sides: BTreeMap<[u32; 3], Vec<([u32; 3], BodyId)>> = BTreeMap::new();
    let mut volumes: BTreeMap<BodyId, f64> = BTreeMap::new();
    for (tet, &body) in mesh.tets.iter().zip(&mesh.bodies) {
        let [a, b, c, d] = tet.map(|v| &mesh.points[v as usize]);
        assert_eq!(orient3d(a, b, c, d), Sign::Positive, "tet {tet:?} at {a}");
        *volumes.entry(body).or_insert(0.0) += volume6(a, b, c, d) / 6.0;
        for face in TET_FACES {
            let face = face.map(|i| tet[i]);
            sides.entry(super::tetrahedra::sorted(face)).or_default().push((face, body));
        }
        tet.iter().for_each(|&v| used[v as usize] = true);
    }
    assert!(used.iter().all(|&u| u), "a vertex without tets");
    for (&triangle, &[behind, front]) in surface.triangles.iter().zip(&surface.regions) {
        let found = sides.remove(&super::tetrahedra::sorted(triangle)).unwrap_or_default();
        for (region, outward) in [(behind, true), (front, false)] {
            let here: Vec<BodyId> = found
                .iter()
                .filter(|(face, _)| super::carve::is_even(*face, triangle) == outward)
                .map(|(_, body)| *body)
                .collect();
            assert_eq!(here, region.into_iter().collect::<Vec<_>>(), "beside triangle {triangle:?}");
        }
    }
    for (face, found) in sides {
        assert!(found.len() == 2 && found[0].1 == found[1].1, "face {face:?} inside has {found:?}");
        assert!(!super::carve::is_even(found[0].0, found[1].0), "face {face:?} has one side twice");
    }
    let expected = volumes_by_surface(surface);
    assert_eq!(expected.keys().collect::<Vec<_>>(), volumes.keys().collect::<Vec<_>>());
    for (body, v) in expected {
        let error = (volumes[&body] - v).abs() / v;
        assert!(error < 1e-12, "body {body:?}: {} instead of {v}", volumes[&body]);
    }
}
