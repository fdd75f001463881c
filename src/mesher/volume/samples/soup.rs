//! Closed surfaces built triangle by triangle: boxes, spheres, tori.

use super::{BodyId, ClosedSurface, Point, SurfaceFaults};
use std::collections::HashMap;

/// A triangle soup under construction, with regions behind and in front.
#[derive(Clone, Debug, Default)]
pub struct Soup {
    pub points: Vec<Point>,
    pub triangles: Vec<[u32; 3]>,
    pub regions: Vec<[Option<BodyId>; 2]>,
    by_place: HashMap<[u64; 3], u32>,
}

pub const INSIDE: [Option<BodyId>; 2] = [Some(BodyId(0)), None];

impl Soup {
    /// Adds a triangle; equal points become one vertex.
    pub fn add(&mut self, corners: [Point; 3], regions: [Option<BodyId>; 2]) {
        let key = |p: &Point| [p.x, p.y, p.z].map(|x| (x + 0.0).to_bits());
        if self.by_place.len() != self.points.len() {
            self.by_place = self.points.iter().map(key).zip(0..).collect();
        }
        let triangle = corners.map(|p| {
            *self.by_place.entry(key(&p)).or_insert_with(|| {
                self.points.push(p);
                (self.points.len() - 1) as u32
            })
        });
        self.triangles.push(triangle);
        self.regions.push(regions);
    }

    pub fn quad(&mut self, [a, b, c, d]: [Point; 4], regions: [Option<BodyId>; 2]) {
        self.add([a, b, c], regions);
        self.add([a, c, d], regions);
    }

    /// Adds a box of n×n squares per side, from one corner to the opposite one.
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

    /// Adds a sphere: the icosahedron with each triangle split in four, `levels` times.
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
                        let out = p.coords.cross(&q.coords).dot(&r.coords) > 0.0;
                        faces.push(if out { [p, q, r] } else { [q, p, r] });
                    }
                }
            }
        }
        for _ in 0..levels {
            faces = faces
                .iter()
                .flat_map(|&[p, q, r]| {
                    let middle = |p: Point, q: Point| Point::from((p.coords + q.coords) / 2.0);
                    let [a, b, c] = [middle(q, r), middle(p, r), middle(p, q)];
                    [[p, c, b], [c, q, a], [b, a, r], [a, b, c]]
                })
                .collect();
        }
        for face in faces {
            self.add(face.map(|p| center + p.coords.normalize() * radius), regions);
        }
    }

    /// Adds a torus around the z axis.
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
        self.by_place.clear();
    }

    pub fn surface(self) -> Result<ClosedSurface, SurfaceFaults> {
        ClosedSurface::new(self.points, self.triangles, self.regions)
    }
}
