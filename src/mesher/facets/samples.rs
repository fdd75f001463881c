//! Small facet models for tests, as CAD programs export them, and readers for STL and PLY files of
//! the shared folder.

use super::Facets;
use crate::{Point, Vector};
use std::f64::consts::TAU;
use std::path::PathBuf;

/// A triangle soup under construction.
#[derive(Clone, Debug, Default)]
pub(super) struct Soup {
    pub facets: Facets,
    /// The group of triangles added next.
    pub group: u32,
}

impl Soup {
    pub fn add(&mut self, corners: [Point; 3]) {
        let first = self.facets.points.len() as u32;
        self.facets.points.extend(corners);
        self.facets.triangles.push([first, first + 1, first + 2]);
        self.facets.groups.push(self.group);
    }

    pub fn quad(&mut self, [a, b, c, d]: [Point; 4]) {
        self.add([a, b, c]);
        self.add([a, c, d]);
    }

    /// Adds a box with two triangles per side; its normals point inward if `inward`.
    pub fn brick(&mut self, low: [f64; 3], high: [f64; 3], inward: bool) {
        for axis in 0..3 {
            for upper in [false, true] {
                self.side(low, high, axis, upper, inward);
            }
        }
    }

    /// Adds one side of a box.
    pub fn side(&mut self, low: [f64; 3], high: [f64; 3], axis: usize, upper: bool, inward: bool) {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let at = |i: bool, j: bool| {
            let mut p = low;
            p[axis] = if upper { high[axis] } else { low[axis] };
            p[u] = if i { high[u] } else { low[u] };
            p[v] = if j { high[v] } else { low[v] };
            Point::from(p)
        };
        let mut corners = [at(false, false), at(true, false), at(true, true), at(false, true)];
        if upper == inward {
            // The diagonal is kept, so that adjacent boxes conform.
            corners.swap(1, 3);
        }
        self.quad(corners);
    }

    /// Adds a cylinder about z with n facets around, as long as the cylinder; the caps are fans of
    /// slivers from one rim vertex.
    pub fn cylinder(&mut self, radius: f64, height: f64, n: usize) {
        let at = |i: usize, z: f64| {
            let a = (i % n) as f64 / n as f64 * TAU;
            Point::new(radius * a.cos(), radius * a.sin(), z)
        };
        for i in 0..n {
            self.quad([at(i, 0.0), at(i + 1, 0.0), at(i + 1, height), at(i, height)]);
        }
        for i in 1..n - 1 {
            self.add([at(0, height), at(i, height), at(i + 1, height)]);
            self.add([at(0, 0.0), at(i + 1, 0.0), at(i, 0.0)]);
        }
    }

    /// Adds a sphere with m meridians and n bands, with needles at the poles.
    pub fn sphere(&mut self, center: Point, radius: f64, m: usize, n: usize, inward: bool) {
        let at = |i: usize, j: usize| {
            let (u, v) = ((i % m) as f64 / m as f64 * TAU, j as f64 / n as f64 * TAU / 2.0);
            let across = if j == 0 || j == n { 0.0 } else { v.sin() };
            center + radius * Vector::new(across * u.cos(), across * u.sin(), v.cos())
        };
        let mut add = |mut t: [Point; 3]| {
            if inward {
                t.swap(0, 1);
            }
            self.add(t);
        };
        for i in 0..m {
            for j in 0..n {
                let [a, b, c, d] = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
                if j + 1 < n {
                    add([a, b, c]);
                } else {
                    add([a, b, d]);
                }
                if j > 0 && j + 1 < n {
                    add([a, c, d]);
                }
            }
        }
    }

    /// Adds a torus about z.
    pub fn torus(&mut self, major: f64, minor: f64, m: usize, n: usize) {
        let at = |i: usize, j: usize| {
            let (u, v) = ((i % m) as f64 / m as f64 * TAU, (j % n) as f64 / n as f64 * TAU);
            let r = major + minor * v.cos();
            Point::new(r * u.cos(), r * u.sin(), minor * v.sin())
        };
        for i in 0..m {
            for j in 0..n {
                self.quad([at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
    }

    /// Adds a square plate with a round hole: n facets in the hole, top and bottom made of fans.
    pub fn plate_with_hole(&mut self, half: f64, radius: f64, height: f64, n: usize) {
        assert!(n.is_multiple_of(4));
        let rim = |i: usize, z: f64| {
            let a = (i % n) as f64 / n as f64 * TAU;
            Point::new(radius * a.cos(), radius * a.sin(), z)
        };
        let corner = |k: usize, z: f64| {
            let a = ((k % 4) as f64 + 0.5) / 4.0 * TAU;
            Point::new(half * a.cos().signum(), half * a.sin().signum(), z)
        };
        for i in 0..n {
            self.quad([rim(i + 1, 0.0), rim(i, 0.0), rim(i, height), rim(i + 1, height)]);
            // Each quarter of the rim is joined to one corner; between quarters is a side of the
            // square.
            let k = 4 * i / n;
            self.add([rim(i + 1, height), rim(i, height), corner(k, height)]);
            self.add([rim(i, 0.0), rim(i + 1, 0.0), corner(k, 0.0)]);
            if (i + 1) % (n / 4) == 0 {
                self.add([rim(i + 1, height), corner(k, height), corner(k + 1, height)]);
                self.add([corner(k, 0.0), rim(i + 1, 0.0), corner(k + 1, 0.0)]);
            }
        }
        for k in 0..4 {
            self.quad([corner(k, 0.0), corner(k + 1, 0.0), corner(k + 1, height), corner(k, height)]);
        }
    }

    /// Adds a cone of n facets with its tip above.
    pub fn cone(&mut self, radius: f64, height: f64, n: usize) {
        let at = |i: usize| {
            let a = (i % n) as f64 / n as f64 * TAU;
            Point::new(radius * a.cos(), radius * a.sin(), 0.0)
        };
        for i in 0..n {
            self.add([at(i), at(i + 1), Point::new(0.0, 0.0, height)]);
            if i > 0 && i + 1 < n {
                self.add([at(0), at(i + 1), at(i)]);
            }
        }
    }

    pub fn map(mut self, f: impl Fn(&Point) -> Point) -> Self {
        self.facets.points.iter_mut().for_each(|p| *p = f(p));
        self
    }
}

/// A file of the shared folder; `None`, with a note on stderr, if it does not exist.
pub(super) fn shared(name: &str) -> Option<PathBuf> {
    let folder = std::env::var("TETMILL_SHARED")
        .map_or_else(|_| PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared")), PathBuf::from);
    let file = folder.join(name);
    if !file.is_file() {
        eprintln!("skipped: no {}", file.display());
    }
    file.is_file().then_some(file)
}

/// Reads an ASCII STL file: only the numbers after `vertex`.
pub(super) fn read_stl(text: &str) -> Facets {
    let mut soup = Soup::default();
    let numbers =
        |line: &str| line.split_whitespace().skip(1).map(|w| w.parse().unwrap()).collect::<Vec<f64>>();
    let points: Vec<Point> = text
        .lines()
        .filter(|l| l.trim_start().starts_with("vertex"))
        .map(|l| Point::from_slice(&numbers(l)))
        .collect();
    points.as_chunks().0.iter().for_each(|&t: &[Point; 3]| soup.add(t));
    soup.facets
}

/// Reads a binary little-endian PLY of doubles and triangles.
pub(super) fn read_ply(bytes: &[u8]) -> Facets {
    let end = bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    let header = std::str::from_utf8(&bytes[..end]).unwrap();
    let count = |what: &str| -> usize {
        header.lines().find_map(|l| l.strip_prefix(what)).unwrap().trim().parse().unwrap()
    };
    let (points, triangles) = (count("element vertex"), count("element face"));
    let body = &bytes[end..];
    let number = |i: usize| f64::from_le_bytes(body[8 * i..8 * i + 8].try_into().unwrap());
    let faces = &body[24 * points..];
    let index = |t: usize, k: usize| {
        let at = 13 * t + 1 + 4 * k;
        u32::from_le_bytes(faces[at..at + 4].try_into().unwrap())
    };
    Facets {
        points: (0..points)
            .map(|i| Point::new(number(3 * i), number(3 * i + 1), number(3 * i + 2)))
            .collect(),
        triangles: (0..triangles).map(|t| [0, 1, 2].map(|k| index(t, k))).collect(),
        groups: vec![0; triangles],
        marks: None,
    }
}
