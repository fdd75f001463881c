//! Random scenes: a tree of shapes, its text, and the body at a point.

use super::random::Random;
use super::shape::{Shape, Vec3, add, cross, norm, scale, sub};
use std::fmt::Write;

/// Distribution of the numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// Arbitrary positions and rotations: surfaces cross in general position.
    General,
    /// Multiples of a quarter along the axes, as in drawings: faces coincide and surfaces touch.
    Grid,
}

/// A solid.
#[derive(Clone, Debug)]
pub enum Solid {
    Shape(Shape),
    And(Box<Solid>, Box<Solid>),
    Or(Box<Solid>, Box<Solid>),
    Not(Box<Solid>),
    Translated(Vec3, Box<Solid>),
    /// Rotation about a point, with the three angles of the statement `rotate`.
    Rotated(Vec3, Vec3, Box<Solid>),
}

/// Bodies and their text.
#[derive(Debug)]
pub struct Scene {
    pub text: String,
    /// Each body is its solid minus those before it.
    pub bodies: Vec<Solid>,
}

/// Half the edge of a cube around the scene.
pub const REACH: f64 = 3.0;

impl Solid {
    fn and(self, other: Self) -> Self {
        Self::And(Box::new(self), Box::new(other))
    }
    fn or(self, other: Self) -> Self {
        Self::Or(Box::new(self), Box::new(other))
    }
    fn and_not(self, other: Self) -> Self {
        self.and(Self::Not(Box::new(other)))
    }

    fn text(&self) -> String {
        match self {
            Self::Shape(shape) => shape.text(),
            Self::And(a, b) => format!("({} and {})", a.text(), b.text()),
            Self::Or(a, b) => format!("({} or {})", a.text(), b.text()),
            Self::Not(a) => format!("not {}", a.text()),
            Self::Translated([x, y, z], a) => format!("translate ({x}, {y}, {z}; {})", a.text()),
            Self::Rotated([x, y, z], [a, b, c], s) => {
                format!("rotate ({x}, {y}, {z}; {a}, {b}, {c}; {})", s.text())
            }
        }
    }

    /// Whether a point is inside; `see` receives the distance and the radius of curvature of each
    /// surface.
    pub fn holds(&self, p: Vec3, see: &mut dyn FnMut(super::shape::Sight)) -> bool {
        match self {
            Self::Shape(shape) => {
                let sight = shape.look(p);
                see(sight);
                sight.distance < 0.0
            }
            // Both operands are evaluated, so that `see` receives all surfaces.
            Self::And(a, b) => a.holds(p, see) & b.holds(p, see),
            Self::Or(a, b) => a.holds(p, see) | b.holds(p, see),
            Self::Not(a) => !a.holds(p, see),
            Self::Translated(shift, a) => a.holds(sub(p, *shift), see),
            Self::Rotated(center, angles, a) => {
                a.holds(add(*center, turned_back(sub(p, *center), *angles)), see)
            }
        }
    }
}

/// The point that the statement `rotate` maps to `p`. It rotates clockwise about z by the first
/// angle, then about x by the second, then about z by the third.
fn turned_back(p: Vec3, [a, b, c]: Vec3) -> Vec3 {
    let about_z = |[x, y, z]: Vec3, t: f64| [x * t.cos() - y * t.sin(), x * t.sin() + y * t.cos(), z];
    let about_x = |[x, y, z]: Vec3, t: f64| [x, y * t.cos() - z * t.sin(), y * t.sin() + z * t.cos()];
    about_z(about_x(about_z(p, c), b), a)
}

impl Scene {
    /// The scene of a seed: 2 to 12 primitives.
    pub fn new(seed: u64, style: Style) -> Self {
        let mut random = Random::new(seed);
        let primitives = 2 + random.below(11);
        let mut draw = Draw { random, style };
        let main = draw.tree(primitives);
        let [main_text, frame] =
            [main.text(), format!("orthobrick ({0}, {0}, {0}; {1}, {1}, {1})", -REACH, REACH)];
        let mut text =
            format!("# seed {seed}, {style:?}\nalgebraic3d\nsolid main = {main_text};\ntlo main;\n");
        let mut bodies = vec![main];
        if draw.random.chance(0.3) {
            write!(text, "solid rest = {frame} and not main;\ntlo rest;\n").unwrap();
            bodies.push(Solid::Shape(Shape::Brick { low: [-REACH; 3], high: [REACH; 3] }));
        }
        Self { text, bodies }
    }

    /// The body at a point, from 1, or 0; `see` as in [`Solid::holds`].
    pub fn body_at(&self, p: Vec3, see: &mut dyn FnMut(super::shape::Sight)) -> usize {
        let inside: Vec<bool> = self.bodies.iter().map(|body| body.holds(p, see)).collect();
        inside.iter().position(|&inside| inside).map_or(0, |body| body + 1)
    }
}

/// Generator of random solids.
struct Draw {
    random: Random,
    style: Style,
}

impl Draw {
    fn tree(&mut self, primitives: usize) -> Solid {
        if primitives == 1 {
            return self.part();
        }
        let left =
            if self.random.chance(0.7) { primitives - 1 } else { 1 + self.random.below(primitives - 1) };
        let (a, b) = (self.tree(left), self.tree(primitives - left));
        let solid = match self.random.below(20) {
            0..=9 => a.or(b),
            10..=16 => a.and_not(b),
            _ => a.and(b),
        };
        self.moved(solid, 0.1)
    }

    fn length(&mut self, low: f64, high: f64) -> f64 {
        match self.style {
            Style::General => self.random.between(low, high),
            Style::Grid => {
                let (low, high) = ((low * 4.0).ceil() as usize, (high * 4.0).floor() as usize);
                (low.max(1) + self.random.below(high.max(low.max(1)) + 1 - low.max(1))) as f64 / 4.0
            }
        }
    }

    fn point(&mut self) -> Vec3 {
        let sign = |draw: &mut Self| if draw.random.chance(0.5) { 1.0 } else { -1.0 };
        [(); 3].map(|()| match self.style {
            Style::General => self.random.between(-0.6, 0.6),
            Style::Grid => sign(self) * (self.random.below(4) as f64) / 4.0,
        })
    }

    /// A direction of about unit length.
    fn axis(&mut self) -> Vec3 {
        if self.style == Style::Grid {
            let mut axis = [0.0; 3];
            axis[self.random.below(3)] = if self.random.chance(0.5) { 1.0 } else { -1.0 };
            return axis;
        }
        loop {
            let axis = [(); 3].map(|()| self.random.between(-1.0, 1.0));
            if (0.3..=1.0).contains(&norm(axis)) {
                return axis;
            }
        }
    }

    /// A frame of three orthogonal unit vectors.
    fn frame(&mut self) -> [Vec3; 3] {
        let unit = |v: Vec3| scale(v, 1.0 / norm(v));
        let axis = unit(self.axis());
        let least = (0..3).min_by(|&i, &j| axis[i].abs().total_cmp(&axis[j].abs())).unwrap();
        let mut other = [0.0; 3];
        other[least] = 1.0;
        let second = unit(cross(axis, other));
        [axis, second, cross(axis, second)]
    }

    fn moved(&mut self, solid: Solid, probability: f64) -> Solid {
        if !self.random.chance(probability) {
            return solid;
        }
        let shift = scale(self.point(), 0.5);
        match (self.random.chance(0.5), self.style) {
            (true, _) => Solid::Translated(shift, Box::new(solid)),
            (false, Style::General) => {
                let angles = [(); 3].map(|()| self.random.between(-3.0, 3.0));
                Solid::Rotated(shift, angles, Box::new(solid))
            }
            (false, Style::Grid) => {
                let quarter = [0.0, std::f64::consts::FRAC_PI_2, std::f64::consts::PI];
                let angles = [(); 3].map(|()| quarter[self.random.below(3)]);
                Solid::Rotated([0.0; 3], angles, Box::new(solid))
            }
        }
    }

    /// A bounded primitive.
    fn part(&mut self) -> Solid {
        let solid = match self.random.below(11) {
            0 => Solid::Shape(self.brick()),
            1 | 2 => Solid::Shape(Shape::Sphere { center: self.point(), radius: self.length(0.25, 0.9) }),
            3 | 4 => self.cylinder(),
            5 => self.cone(),
            6 => self.torus(),
            7 => self.ellipsoid(),
            8 => self.elliptic_cylinder(),
            9 => self.elliptic_cone(),
            _ => self.polyhedron(),
        };
        self.moved(solid, 0.3)
    }

    fn brick(&mut self) -> Shape {
        let low = self.point();
        let size = [(); 3].map(|()| self.length(0.25, 1.4));
        Shape::Brick { low, high: add(low, size).map(|x| (x * 1e4).round() / 1e4) }
    }

    /// Bounds a shape that is infinite along an axis by a plane at each end.
    fn capped(&mut self, shape: Shape, ends: [Vec3; 2]) -> Solid {
        let way = sub(ends[1], ends[0]);
        let plane = |point: Vec3, normal: Vec3| Solid::Shape(Shape::Plane { point, normal });
        Solid::Shape(shape).and(plane(ends[0], scale(way, -1.0))).and(plane(ends[1], way))
    }

    fn ends(&mut self) -> [Vec3; 2] {
        let (start, length) = (self.point(), self.length(0.5, 1.5));
        let axis = self.axis();
        let end = add(start, scale(axis, length / norm(axis))).map(|x| (x * 1e4).round() / 1e4);
        [start, end]
    }

    fn cylinder(&mut self) -> Solid {
        let (ends, radius) = (self.ends(), self.length(0.15, 0.6));
        self.capped(Shape::Cylinder { ends, radius }, ends)
    }

    /// Truncated, or with its apex.
    fn cone(&mut self) -> Solid {
        let ends = self.ends();
        let base = self.length(0.4, 0.8);
        let tip = if self.random.chance(0.4) { 0.0 } else { self.length(0.1, 0.35).min(base - 0.05) };
        self.capped(Shape::Cone { ends, radii: [base, tip] }, ends)
    }

    fn torus(&mut self) -> Solid {
        let minor = self.length(0.1, 0.3);
        let major = minor + self.length(0.15, 0.5);
        let major = (major * 1e4).round() / 1e4;
        Solid::Shape(Shape::Torus { center: self.point(), axis: self.axis(), radii: [major, minor] })
    }

    fn ellipsoid(&mut self) -> Solid {
        let axes = self.frame().map(|axis| scale(axis, self.length(0.25, 0.9)));
        Solid::Shape(Shape::Ellipsoid { center: self.point(), axes })
    }

    fn elliptic_cylinder(&mut self) -> Solid {
        let [axis, u, v] = self.frame();
        let center = self.point();
        let axes = [scale(u, self.length(0.2, 0.7)), scale(v, self.length(0.2, 0.7))];
        let end = add(center, scale(axis, self.length(0.5, 1.5)));
        self.capped(Shape::EllipticCylinder { center, axes }, [center, end])
    }

    /// Truncated: the apex lies beyond the cut.
    fn elliptic_cone(&mut self) -> Solid {
        let [_, u, v] = self.frame();
        let center = self.point();
        let long = self.length(0.4, 0.8);
        let axes = [scale(u, long), scale(v, f64::min(self.length(0.25, 0.6), long - 0.05))];
        let height = self.length(0.5, 1.2);
        let up = cross(axes[0], axes[1]);
        let end = add(center, scale(up, height / norm(up)));
        let ratio = if self.style == Style::Grid { 0.5 } else { self.random.between(0.2, 0.8) };
        self.capped(Shape::EllipticCone { center, axes, height, ratio }, [center, end])
    }

    /// A tetrahedron, an octahedron or a wedge.
    fn polyhedron(&mut self) -> Solid {
        let center = self.point();
        let [u, v, w] = self.frame().map(|axis| scale(axis, self.length(0.3, 0.9)));
        let at = |a: f64, b: f64, c: f64| add(center, add(scale(u, a), add(scale(v, b), scale(w, c))));
        let (points, faces): (Vec<Vec3>, Vec<Vec<usize>>) = match self.random.below(3) {
            0 => (
                vec![at(0., 0., 0.), at(1., 0., 0.), at(0., 1., 0.), at(0., 0., 1.)],
                vec![vec![0, 2, 1], vec![0, 1, 3], vec![0, 3, 2], vec![1, 2, 3]],
            ),
            1 => (
                vec![
                    at(1., 0., 0.),
                    at(-1., 0., 0.),
                    at(0., 1., 0.),
                    at(0., -1., 0.),
                    at(0., 0., 1.),
                    at(0., 0., -1.),
                ],
                [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]
                    .iter()
                    .map(|f| f.to_vec())
                    .collect(),
            ),
            _ => (
                vec![
                    at(0., 0., 0.),
                    at(1., 0., 0.),
                    at(0., 1., 0.),
                    at(0., 0., 1.),
                    at(1., 0., 1.),
                    at(0., 1., 1.),
                ],
                vec![vec![0, 2, 1], vec![3, 4, 5], vec![0, 1, 4, 3], vec![1, 2, 5, 4], vec![2, 0, 3, 5]],
            ),
        };
        Solid::Shape(Shape::Polyhedron { points, faces })
    }
}
