//! Checks the mesh of a scene against the scene.

use super::random::van_der_corput;
use super::scene::{REACH, Scene};
use super::shape::{Sight, Vec3, add, cross, dot, norm, scale, sub};
use std::collections::HashMap;
use std::f64::consts::SQRT_2;
use std::path::Path;

/// The contents of a Medit file.
pub struct Mesh {
    vertices: Vec<Vec3>,
    triangles: Vec<[usize; 3]>,
    /// Tets and their bodies, from 1.
    pub tets: Vec<([usize; 4], usize)>,
    /// The cusps that were cut off.
    cuts: Vec<Cut>,
}

/// A cusp that the program reports as cut off.
struct Cut {
    point: Vec3,
    radius: f64,
    is_curve: bool,
}

impl Cut {
    fn of(report: &serde_json::Value) -> Vec<Self> {
        let cuts = report["coarse"]["cut_cusps"].as_array().expect("the report lists the cuts");
        let number = |value: &serde_json::Value| value.as_f64().expect("a number");
        let cut = |cut: &serde_json::Value| Self {
            point: [0, 1, 2].map(|i| number(&cut["point"][i])),
            radius: number(&cut["radius"]),
            is_curve: cut["is_curve"].as_bool().expect("true or false"),
        };
        cuts.iter().map(cut).collect()
    }

    /// Whether a point may be in the part that was cut off, or within `room` of it. Along a curve
    /// of contact, two surfaces are near; the tube around it has flat ends, whose edges are
    /// further from the curve than the radius.
    fn may_hold(&self, scene: &Scene, p: Vec3, room: f64) -> bool {
        let reach = room + if self.is_curve { SQRT_2 * self.radius } else { self.radius };
        let mut near = 0;
        scene.body_at(p, &mut |sight: Sight| near += u32::from(sight.distance.abs() <= reach));
        if self.is_curve { near >= 2 } else { norm(sub(p, self.point)) <= reach }
    }
}

/// Bound on the chord error in radii of curvature, for segments of at most one radius.
const CHORD: f64 = 0.13;
/// Tolerance for boundary vertices.
const ON_SURFACE: f64 = 1e-9;
/// Number of probe points in the cube around the scene.
const PROBES: u64 = 4000;

impl Mesh {
    /// Reads an ASCII file and the report of the run.
    pub fn read(file: &Path, report: &Path) -> Self {
        let report = std::fs::read(report).expect("the report was written");
        let report = serde_json::from_slice(&report).expect("the report is JSON");
        let text = std::fs::read_to_string(file).expect("the mesh was written");
        let mut words = text.split_ascii_whitespace();
        let mut mesh =
            Self { vertices: Vec::new(), triangles: Vec::new(), tets: Vec::new(), cuts: Cut::of(&report) };
        while let Some(word) = words.next() {
            let mut rows = |width: usize| -> Vec<Vec<&str>> {
                let count: usize = words.next().expect("a count").parse().expect("a count");
                (0..count).map(|_| words.by_ref().take(width).collect()).collect()
            };
            let index = |word: &str| word.parse::<usize>().expect("an index") - 1;
            match word {
                "Vertices" => {
                    mesh.vertices = rows(4)
                        .iter()
                        .map(|row| [0, 1, 2].map(|i| row[i].parse().expect("a coordinate")))
                        .collect();
                }
                "Triangles" => {
                    mesh.triangles = rows(4).iter().map(|row| [0, 1, 2].map(|i| index(row[i]))).collect();
                }
                "Tetrahedra" => {
                    let tet = |row: &Vec<&str>| ([0, 1, 2, 3].map(|i| index(row[i])), index(row[4]) + 1);
                    mesh.tets = rows(5).iter().map(tet).collect();
                }
                _ => {}
            }
        }
        mesh
    }

    fn corners(&self, tet: &[usize; 4]) -> [Vec3; 4] {
        tet.map(|v| self.vertices[v])
    }

    /// The first fault of the mesh, if any.
    pub fn fault(&self, scene: &Scene) -> Option<String> {
        self.wrong_shape()
            .or_else(|| self.wrong_boundary(scene))
            .or_else(|| self.wrong_bodies(scene))
            .or_else(|| {
                let index = Index::new(self);
                (1..=PROBES).find_map(|i| self.wrong_at(scene, &index, probe(i)))
            })
    }

    /// Tets must be positive, and their faces must match each other and the boundary triangles.
    fn wrong_shape(&self) -> Option<String> {
        let mut faces: HashMap<[usize; 3], (usize, bool)> = HashMap::new();
        for (i, (tet, body)) in self.tets.iter().enumerate() {
            if volume6(&self.corners(tet)) <= 0.0 {
                return Some(format!("tet {i} is not positive"));
            }
            for skipped in 0..4 {
                let mut face: Vec<usize> = (0..4).filter(|&k| k != skipped).map(|k| tet[k]).collect();
                face.sort_unstable();
                let face = [face[0], face[1], face[2]];
                // Faces with the same body on both sides are interior.
                match faces.remove(&face) {
                    None => drop(faces.insert(face, (*body, false))),
                    Some((other, false)) if other != *body => drop(faces.insert(face, (0, true))),
                    Some((_, false)) => {}
                    Some((_, true)) => return Some(format!("three tets at the face {face:?}")),
                }
            }
        }
        let mut boundary: Vec<[usize; 3]> = self.triangles.clone();
        boundary.iter_mut().for_each(|t| t.sort_unstable());
        boundary.sort_unstable();
        let mut needed: Vec<[usize; 3]> = faces.into_keys().collect();
        needed.sort_unstable();
        (boundary != needed)
            .then(|| format!("{} boundary triangles where tets need {}", boundary.len(), needed.len()))
    }

    /// Boundary vertices must lie on surfaces.
    fn wrong_boundary(&self, scene: &Scene) -> Option<String> {
        self.triangles.iter().flatten().find_map(|&v| {
            let mut least = f64::INFINITY;
            scene.body_at(self.vertices[v], &mut |sight: Sight| least = least.min(sight.distance.abs()));
            let cut = || self.cuts.iter().any(|cut| cut.may_hold(scene, self.vertices[v], ON_SURFACE));
            (least > ON_SURFACE && !cut())
                .then(|| format!("boundary vertex {v} is {least:e} off all surfaces"))
        })
    }

    /// The centroid of each tet must be in its body.
    fn wrong_bodies(&self, scene: &Scene) -> Option<String> {
        self.tets.iter().enumerate().find_map(|(i, (tet, body))| {
            let middle = scale(self.corners(tet).into_iter().fold([0.0; 3], add), 0.25);
            let known = sure_body(scene, middle)?;
            (known != *body).then(|| format!("tet {i} of body {body} is in body {known} at {middle:?}"))
        })
    }

    /// A probe clearly inside a body must be in a tet of it, a probe clearly outside in no tet.
    fn wrong_at(&self, scene: &Scene, index: &Index, p: Vec3) -> Option<String> {
        let known = sure_body(scene, p)?;
        let meshed =
            index.near(p).iter().map(|&i| self.tets[i]).find(|(tet, _)| contains(&self.corners(tet), p));
        let meshed = meshed.map_or(0, |(_, body)| body);
        // Where a cusp was cut off, the boundary is a ball or a tube in place of surfaces.
        let cut = || meshed == 0 && self.cuts.iter().any(|cut| cut.may_hold(scene, p, 0.0));
        (meshed != known && !cut())
            .then(|| format!("the mesh has body {meshed} where body {known} is, at {p:?}"))
    }
}

/// The body at a point, unless a surface is within the chord error.
pub fn sure_body(scene: &Scene, p: Vec3) -> Option<usize> {
    let mut sure = true;
    let body = scene.body_at(p, &mut |sight: Sight| {
        let room = if sight.radius.is_finite() { CHORD * sight.radius } else { 0.0 };
        sure &= sight.distance.abs() > room + 1e-9;
    });
    sure.then_some(body)
}

/// A point of a sequence that fills the cube around the scene evenly.
pub fn probe(i: u64) -> Vec3 {
    [2, 3, 5].map(|base| (2.0 * van_der_corput(i, base) - 1.0) * 0.6 * REACH)
}

fn volume6([a, b, c, d]: &[Vec3; 4]) -> f64 {
    dot(cross(sub(*b, *a), sub(*c, *a)), sub(*d, *a))
}

fn contains(corners: &[Vec3; 4], p: Vec3) -> bool {
    (0..4).all(|k| {
        let mut with = *corners;
        with[k] = p;
        volume6(&with) >= 0.0
    })
}

/// A grid for finding the tets near a point.
struct Index {
    cells: HashMap<[i32; 3], Vec<usize>>,
}

impl Index {
    const CELL: f64 = 0.15;

    fn new(mesh: &Mesh) -> Self {
        let mut cells: HashMap<[i32; 3], Vec<usize>> = HashMap::new();
        for (i, (tet, _)) in mesh.tets.iter().enumerate() {
            let corners = mesh.corners(tet);
            let end = |axis: usize, pick: fn(f64, f64) -> f64| {
                let at = corners.iter().map(|c| c[axis]).reduce(pick).expect("four corners");
                (at / Self::CELL).floor() as i32
            };
            let range = |axis: usize| end(axis, f64::min)..=end(axis, f64::max);
            for x in range(0) {
                for y in range(1) {
                    range(2).for_each(|z| cells.entry([x, y, z]).or_default().push(i));
                }
            }
        }
        Self { cells }
    }

    fn near(&self, p: Vec3) -> &[usize] {
        self.cells.get(&p.map(|x| (x / Self::CELL).floor() as i32)).map_or(&[], Vec::as_slice)
    }
}
