//! The text of a pair of surfaces, and the volume that it encloses.

use std::f64::consts::{PI, TAU};
use std::fmt::Write;
use tetmill::internals::Random;

/// What the gap lies between.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Two cubes, apart or overlapping.
    Cubes,
    /// Two cubes side by side, one higher than the other.
    Flush,
    /// A ball above a plate, or sunk into it.
    BallPlate,
    /// Two balls, apart or overlapping.
    Balls,
    /// Two balls of one radius, nearly in one place.
    SameBalls,
    /// The shell of a ball.
    Shell,
    /// The wall of a pipe.
    Pipe,
    /// A cylinder on another with a slightly different radius.
    Step,
    /// Two rods side by side, apart or overlapping.
    Rods,
    /// A rod on a plate, apart or sunk into it.
    RodPlate,
    /// The tip of a cone above a plate, or in it.
    Tip,
    /// A torus on a plate, apart or sunk into it.
    TorusPlate,
    /// A hole beside a face: a thin wall, or a narrow slot.
    Hole,
    /// An ellipsoid on a plate, apart or sunk into it.
    EllipsoidPlate,
    /// A cube without a thin wedge, and that wedge as a second body.
    Wedge,
    /// A cube without a thin wedge.
    Cut,
    /// A pin in a hole that is slightly wider.
    Pin,
    /// A bar in a slot that is slightly wider.
    Slot,
}

pub const KINDS: [Kind; 18] = [
    Kind::Cubes,
    Kind::Flush,
    Kind::BallPlate,
    Kind::Balls,
    Kind::SameBalls,
    Kind::Shell,
    Kind::Pipe,
    Kind::Step,
    Kind::Rods,
    Kind::RodPlate,
    Kind::Tip,
    Kind::TorusPlate,
    Kind::Hole,
    Kind::EllipsoidPlate,
    Kind::Wedge,
    Kind::Cut,
    Kind::Pin,
    Kind::Slot,
];

/// A pair of surfaces of size 1 with a gap between them.
#[derive(Clone, Debug)]
pub struct Pair {
    pub kind: Kind,
    /// The gap; negative if the surfaces overlap.
    pub gap: f64,
    pub text: String,
    /// The volume of all bodies.
    pub volume: f64,
}

impl Pair {
    /// The pair of a seed: the kinds in turn, gaps between 1e-12 and 1e-2, every second pair
    /// rotated.
    pub fn new(seed: u64) -> Self {
        let mut random = Random::new(seed);
        let kind = KINDS[seed as usize % KINDS.len()];
        let size = 10_f64.powf(-2.0 - 10.0 * random.unit());
        let gap = if random.unit() < 0.5 { size } else { -size };
        let rotated = (seed as usize / KINDS.len()).is_multiple_of(2);
        let mut text = Text::new(rotated, &mut random);
        let (gap, volume) = text.pair(kind, gap);
        Self { kind, gap, text: text.text, volume }
    }
}

/// The text of a geometry in a frame.
struct Text {
    text: String,
    rows: [[f64; 3]; 3],
    origin: [f64; 3],
}

impl Text {
    fn new(rotated: bool, random: &mut Random) -> Self {
        let angles: [f64; 3] = [(); 3].map(|()| if rotated { TAU * random.unit() } else { 0.0 });
        let origin = [(); 3].map(|()| random.unit());
        let ([a, b, c], [sa, sb, sc]) = (angles.map(f64::cos), angles.map(f64::sin));
        let rows = [
            [a * b, a * sb * sc - sa * c, a * sb * c + sa * sc],
            [sa * b, sa * sb * sc + a * c, sa * sb * c - a * sc],
            [-sb, b * sc, b * c],
        ];
        Self { text: "algebraic3d\n".into(), rows, origin }
    }

    fn vector(&self, v: [f64; 3]) -> String {
        let [x, y, z] = self.rows.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2]);
        format!("{x:?}, {y:?}, {z:?}")
    }

    fn point(&self, p: [f64; 3]) -> String {
        let turned = self.rows.map(|row| row[0] * p[0] + row[1] * p[1] + row[2] * p[2]);
        let [x, y, z] = [0, 1, 2].map(|k| self.origin[k] + turned[k]);
        format!("{x:?}, {y:?}, {z:?}")
    }

    fn plane(&self, point: [f64; 3], normal: [f64; 3]) -> String {
        format!("plane({}; {})", self.point(point), self.vector(normal))
    }

    fn brick(&self, low: [f64; 3], high: [f64; 3]) -> String {
        let planes = (0..3).flat_map(|k| {
            let mut normal = [0.0; 3];
            normal[k] = 1.0;
            [self.plane(low, normal.map(|x| -x)), self.plane(high, normal)]
        });
        planes.collect::<Vec<_>>().join(" and ")
    }

    fn ball(&self, center: [f64; 3], radius: f64) -> String {
        format!("sphere({}; {radius:?})", self.point(center))
    }

    /// A cylinder along z between two planes.
    fn rod(&self, [x, y]: [f64; 2], radius: f64, [low, high]: [f64; 2]) -> String {
        let [a, b] = [[x, y, low], [x, y, high]];
        let [below, above] = [self.plane(a, [0.0, 0.0, -1.0]), self.plane(b, [0.0, 0.0, 1.0])];
        format!("cylinder({}; {}; {radius:?}) and {below} and {above}", self.point(a), self.point(b))
    }

    fn solid(&mut self, name: &str, definition: &str) {
        writeln!(self.text, "solid {name} = {definition};").expect("text can be written");
    }

    fn body(&mut self, name: &str, definition: &str) {
        self.solid(name, definition);
        writeln!(self.text, "tlo {name};").expect("text can be written");
    }

    /// The body that joins two pieces.
    fn joined(&mut self, first: &str, second: &str) {
        self.solid("first", first);
        self.solid("second", second);
        self.body("both", "first or second");
    }

    /// The body of one piece without another.
    fn without(&mut self, first: &str, second: &str) {
        self.solid("first", first);
        self.solid("second", second);
        self.body("rest", "first and not second");
    }

    /// A plate below z = 0, with a piece; returns the volume of the plate.
    fn on_plate(&mut self, piece: &str) -> f64 {
        let plate = self.brick([-1.0, -1.0, -0.3], [1.0, 1.0, 0.0]);
        self.joined(&plate, piece);
        4.0 * 0.3
    }

    /// Writes a pair; returns the gap with the sign that the pair can have, and the volume.
    /// Overlaps of curved surfaces are too small for the volume.
    fn pair(&mut self, kind: Kind, gap: f64) -> (f64, f64) {
        let size = gap.abs();
        let cube = self.brick([0.0; 3], [1.0; 3]);
        match kind {
            Kind::Cubes => {
                let other = self.brick([1.0 + gap, 0.2, 0.3], [2.0, 1.2, 1.3]);
                self.joined(&cube, &other);
                (gap, 2.0 - size)
            }
            Kind::Flush => {
                let other = self.brick([0.5, 0.0, 0.0], [1.5, 1.0, 1.0 + gap]);
                self.joined(&cube, &other);
                (gap, 1.5)
            }
            Kind::BallPlate => {
                let ball = self.ball([0.1, 0.2, 0.5 + gap], 0.5);
                (gap, self.on_plate(&ball) + PI / 6.0)
            }
            Kind::Balls => {
                let [first, second] = [self.ball([0.0; 3], 1.0), self.ball([0.0, 0.0, 1.6 + gap], 0.6)];
                self.joined(&first, &second);
                (gap, 4.0 / 3.0 * PI * (1.0 + 0.216))
            }
            Kind::SameBalls => {
                let [first, second] = [self.ball([0.0; 3], 1.0), self.ball([0.0, 0.0, size], 1.0)];
                self.joined(&first, &second);
                (size, 4.0 / 3.0 * PI)
            }
            Kind::Shell => {
                let [outer, inner] = [self.ball([0.0; 3], 1.0), self.ball([0.0; 3], 1.0 - size)];
                self.without(&outer, &inner);
                (size, 0.0)
            }
            Kind::Pipe => {
                let outer = self.rod([0.0; 2], 0.5, [0.0, 1.0]);
                let inner = self.rod([0.0; 2], 0.5 - size, [-1.0, 2.0]);
                self.without(&outer, &inner);
                (size, 0.0)
            }
            Kind::Step => {
                let [low, high] =
                    [self.rod([0.0; 2], 1.0, [0.0, 1.0]), self.rod([0.0; 2], 1.0 + gap, [1.0, 2.0])];
                self.joined(&low, &high);
                (gap, 2.0 * PI)
            }
            Kind::Rods => {
                let [a, b] =
                    [self.rod([0.0; 2], 0.5, [0.0, 1.0]), self.rod([0.8 + gap, 0.0], 0.3, [0.0, 1.0])];
                self.joined(&a, &b);
                (gap, PI * (0.25 + 0.09))
            }
            Kind::RodPlate => {
                // The rod lies along the plate: both stand on z = 0.
                let plate = self.brick([-1.0, -0.3, 0.0], [1.0, 0.0, 1.0]);
                let rod = self.rod([0.1, 0.4 + gap], 0.4, [0.0, 1.0]);
                self.joined(&plate, &rod);
                (gap, 0.6 + PI * 0.16)
            }
            Kind::Tip => {
                let top = self.plane([0.0, 0.0, 0.9], [0.0, 0.0, 1.0]);
                let [tip, wide] = [[0.0, 0.0, gap], [0.0, 0.0, 1.0 + gap]];
                let side = self.plane(tip, [0.0, 0.0, -1.0]);
                let cone =
                    format!("cone({}; 0; {}; 0.5) and {side} and {top}", self.point(tip), self.point(wide));
                (gap, self.on_plate(&cone) + PI / 12.0 * 0.729)
            }
            Kind::TorusPlate => {
                let center = self.point([0.0, 0.0, 0.2 + gap]);
                let torus = format!("torus({center}; {}; 0.6; 0.2)", self.vector([0.0, 0.0, 1.0]));
                (gap, self.on_plate(&torus) + 2.0 * PI * PI * 0.6 * 0.04)
            }
            Kind::Hole => {
                let hole = self.rod([0.5, 0.3 + gap], 0.3, [-1.0, 2.0]);
                self.without(&cube, &hole);
                (gap, 1.0 - 0.09 * PI)
            }
            Kind::EllipsoidPlate => {
                let axes = [[0.6, 0.0, 0.0], [0.0, 0.4, 0.0], [0.0, 0.0, 0.3]].map(|axis| self.vector(axis));
                let center = self.point([0.0, 0.0, 0.3 + gap]);
                let ellipsoid = format!("ellipsoid({center}; {})", axes.join("; "));
                (gap, self.on_plate(&ellipsoid) + 4.0 / 3.0 * PI * 0.072)
            }
            Kind::Wedge | Kind::Cut => {
                let plane = self.plane([0.0, 0.0, 1.0], [size, 0.0, 1.0]);
                self.solid("cube", &cube);
                self.solid("below", &plane);
                self.body("most", "cube and below");
                if kind == Kind::Wedge {
                    self.body("wedge", "cube and not below");
                }
                (size, 1.0)
            }
            Kind::Pin => {
                self.solid("block", &cube);
                let hole = self.rod([0.5; 2], 0.3 + size, [-1.0, 2.0]);
                let pin = self.rod([0.5; 2], 0.3, [0.0, 1.0]);
                self.solid("hole", &hole);
                self.body("housing", "block and not hole");
                self.body("pin", &pin);
                (size, 1.0)
            }
            Kind::Slot => {
                self.solid("block", &cube);
                let slot = self.brick([0.3 - size, 0.5, -1.0], [0.7 + size, 2.0, 2.0]);
                let bar = self.brick([0.3, 0.5 + size, 0.0], [0.7, 1.0, 1.0]);
                self.solid("slot", &slot);
                self.body("housing", "block and not slot");
                self.body("bar", &bar);
                (size, 1.0)
            }
        }
    }
}
