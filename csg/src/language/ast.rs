//! The statements of a file, before names are resolved.

use crate::geometry::Span;
use crate::{Point, Vector};

/// A name and its position.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Name {
    pub text: String,
    pub span: Span,
}

/// A number where the grammar expects an integer, with its position; checked later.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Num {
    pub value: f64,
    pub span: Span,
}

/// A Boolean expression of solids.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Expr {
    Primitive(Primitive, Span),
    Transform(Transform, Span, Box<Expr>),
    Name(Name),
    Not(Box<Expr>),
    And(Vec<Expr>),
    Or(Vec<Expr>),
}

/// A primitive solid; the fields are its arguments in order.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Primitive {
    Plane(Point, Vector),
    Sphere(Point, f64),
    Cylinder(Point, Point, f64),
    Cone(Point, f64, Point, f64),
    EllipticCylinder(Point, Vector, Vector),
    EllipticCone(Point, Vector, Vector, f64, f64),
    Ellipsoid(Point, Vector, Vector, Vector),
    Orthobrick(Point, Point),
    Torus(Point, Vector, f64, f64),
    Polyhedron(Vec<Point>, Vec<PolyFace>),
    Extrusion { path: Name, profile: Name, up: Vector },
    Revolution { from: Point, to: Point, profile: Name },
}

/// A face of a polyhedron: three or four point numbers, from 1.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PolyFace {
    pub points: Vec<Num>,
    pub span: Span,
}

/// A transform, or repeated copies by a transform.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Transform {
    Translate(Vector),
    Rotate(Point, Vector),
    MultiTranslate(Vector, Num),
    MultiRotate(Point, Vector, Num),
}

/// A segment of a curve: its kind (2, 3 or 4) and point numbers, from 1.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Segment {
    pub kind: Num,
    pub points: Vec<Num>,
}

/// The coordinates of the points of a curve (two or three each) and its segments.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct CurveText {
    pub points: Vec<Vec<f64>>,
    pub segments: Vec<Segment>,
}

/// `-name` or `-name=value`.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Flag {
    pub name: String,
    pub value: FlagValue,
    pub span: Span,
}

/// The value of a flag after the `=`.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum FlagValue {
    Nothing,
    Word(String),
    Number(f64),
    Numbers(Vec<f64>),
    Words(Vec<String>),
}

/// A statement.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Statement {
    Solid {
        name: Name,
        body: Expr,
        flags: Vec<Flag>,
    },
    /// A solid or curve with an error. Its name is defined, so that uses of it give no further
    /// errors.
    Broken {
        name: Name,
    },
    Tlo {
        solid: Name,
        surface: Option<Name>,
        flags: Vec<Flag>,
    },
    Curve2d {
        name: Name,
        text: CurveText,
    },
    Curve3d {
        name: Name,
        text: CurveText,
    },
    BoundingBox {
        min: Point,
        max: Point,
        span: Span,
    },
    UserPoint {
        point: Point,
        flags: Vec<Flag>,
        span: Span,
    },
    IdentifyPeriodic {
        solids: [Name; 2],
        span: Span,
    },
    IdentifyCloseSurfaces {
        solids: [Name; 2],
        flags: Vec<Flag>,
        span: Span,
    },
    SingularFace {
        tlo: Name,
        solid: Name,
        flags: Vec<Flag>,
        span: Span,
    },
    SingularEdge {
        solids: [Name; 2],
        flags: Vec<Flag>,
        span: Span,
    },
    SingularPoint {
        solids: [Name; 3],
        flags: Vec<Flag>,
        span: Span,
    },
    Boundary {
        solid: Name,
        tlo: Name,
        number: Num,
    },
    BoundaryName {
        solid: Name,
        tlo: Name,
        word: Name,
    },
    Constant {
        name: Name,
    },
}

impl Statement {
    /// The name of the solid that the statement defines, even with errors.
    pub fn solid_name(&self) -> Option<&str> {
        match self {
            Self::Solid { name, .. } | Self::Broken { name } => Some(&name.text),
            _ => None,
        }
    }
}
