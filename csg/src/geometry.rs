//! The central type: what a `.geo` file says, with equal surfaces made one.

use crate::{Point, Solid, Surface};

/// Declares the id of one kind of geometric entity: an index into the list of its kind.
macro_rules! entity_id {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
        pub struct $name(pub u32);

        impl $name {
            /// The id as an index.
            #[inline]
            pub fn index(self) -> usize {
                self.0 as usize
            }

            /// The id of the entity at `index`.
            ///
            /// # Panics
            /// Past `u32::MAX` entities.
            #[inline]
            pub fn new(index: usize) -> Self {
                Self(u32::try_from(index).expect("more than 2^32 geometric entities"))
            }
        }
    };
}

entity_id!(
    /// A surface of a [`Geometry`]; equal surfaces of the file have one id.
    SurfaceId
);
entity_id!(
    /// A corner: a point where curves end.
    CornerId
);
entity_id!(
    /// A curve: a piece of the intersection of two surfaces, between two corners or closed.
    CurveId
);
entity_id!(
    /// A patch: the pieces of one surface that separate the same two regions.
    PatchId
);
entity_id!(
    /// A body: a solid that is meshed. `BodyId(0)` is the first `tlo` of the file that is a solid.
    BodyId
);

/// An axis-parallel box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// The corner with the least coordinates.
    pub min: Point,
    /// The corner with the largest coordinates.
    pub max: Point,
}

impl Aabb {
    /// The length of the diagonal, the unit in which tolerances are given.
    pub fn diagonal(&self) -> f64 {
        (self.max - self.min).norm()
    }

    /// The middle of the box.
    pub fn center(&self) -> Point {
        nalgebra::center(&self.min, &self.max)
    }
}

/// A place in the source text, from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Span {
    /// The line, from 1.
    pub line: u32,
    /// The column in characters, from 1.
    pub column: u32,
}

/// What the file says of one surface beside its shape.
#[derive(Clone, Debug, Default)]
pub struct SurfaceInfo {
    /// Upper bound of the mesh size on it, if given (`-maxh` of a solid that has it).
    pub maxh: Option<f64>,
    /// Boundary-condition number (`-bc`).
    pub bc: Option<u32>,
    /// Boundary name (`-bcname`).
    pub bc_name: Option<String>,
    /// The named solid in which the surface first occurs, for messages.
    pub solid: String,
    /// Where its primitive stands in the file.
    pub span: Span,
}

/// A body: a top-level object that is a solid.
#[derive(Clone, Debug)]
pub struct Body {
    /// The name of its solid.
    pub name: String,
    /// Its inside.
    pub solid: Solid,
    /// The number NETGEN gives it: 1 + position among all top-level objects of the file.
    pub number: u32,
    /// Upper bound of the mesh size inside (`-maxh` of the tlo, else of the solid).
    pub maxh: Option<f64>,
    /// Material name (`-material`).
    pub material: Option<String>,
    /// Colour, 0 to 1 each (`-col`).
    pub color: Option<[f64; 3]>,
    /// `-transparent`
    pub transparent: bool,
    /// `-layer`
    pub layer: i32,
    /// Where it stands in the file.
    pub span: Span,
}

/// The part of a surface that bounds a solid, as a patch of its own: a top-level object with a surface (`tlo S F`).
///
/// It is no body and changes none: it cuts a patch out of those that lie on the surface, where the surface also
/// bounds the solid.
#[derive(Clone, Debug)]
pub struct Cutout {
    /// The name of the solid.
    pub name: String,
    /// The solid.
    pub solid: Solid,
    /// The surface.
    pub surface: SurfaceId,
    /// The number NETGEN gives it: 1 + position among all top-level objects of the file.
    pub number: u32,
    /// Upper bound of the mesh size on it (`-maxh`).
    pub maxh: Option<f64>,
    /// Boundary-condition number (`-bc`).
    pub bc: Option<u32>,
    /// Boundary name (`-bcname`).
    pub bc_name: Option<String>,
    /// Where it stands in the file.
    pub span: Span,
}

/// Two surfaces whose patches are to be the same but for a motion (`identify periodic`).
#[derive(Clone, Debug)]
pub struct Identification {
    /// The surface, and its image.
    pub surfaces: [SurfaceId; 2],
    /// The names of the solids whose first surfaces they are.
    pub solids: [String; 2],
    /// Where it stands in the file.
    pub span: Span,
}

/// A tag for solvers that grade elements towards singularities (`singular`).
#[derive(Clone, Debug)]
pub struct Singularity {
    /// Where.
    pub place: SingularPlace,
    /// How strongly (`-factor`).
    pub factor: i32,
    /// Upper bound of the mesh size there; edges only (`-maxh`).
    pub maxh: Option<f64>,
    /// Where it stands in the file.
    pub span: Span,
}

/// Where a [`Singularity`] is, by the surfaces of the solids that it names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SingularPlace {
    /// Where some surfaces bound a body.
    Face {
        /// The surfaces.
        surfaces: Vec<SurfaceId>,
        /// The body.
        body: BodyId,
    },
    /// On curves between a surface of the first list and one of the second, beside a body if one is named.
    Edge {
        /// The two lists.
        surfaces: [Vec<SurfaceId>; 2],
        /// The body.
        body: Option<BodyId>,
    },
    /// At corners on a surface of each list.
    Point {
        /// The three lists.
        surfaces: [Vec<SurfaceId>; 3],
    },
}

/// A point that is to be a mesh vertex (`point`).
#[derive(Clone, Copy, Debug)]
pub struct UserPoint {
    /// Where the vertex is to be.
    pub point: Point,
    /// Where it stands in the file.
    pub span: Span,
}

/// A boundary-condition number or name for the part of some surfaces that bounds one body
/// (`boundarycondition`, `boundaryconditionname`).
///
/// Overrides apply in file order, after patches have their numbers from [`SurfaceInfo::bc`] or the counter. A
/// number replaces the patch's number; a name goes to the patch alone: where the number came from
/// [`SurfaceInfo::bc`], which other patches may have too, the patch first gets a fresh one.
#[derive(Clone, Debug)]
pub struct BoundaryOverride {
    /// The surfaces, ascending.
    pub surfaces: Vec<SurfaceId>,
    /// The body, which may be on either side of them.
    pub body: BodyId,
    /// The number or the name.
    pub label: BoundaryLabel,
    /// Where it stands in the file.
    pub span: Span,
}

/// What a [`BoundaryOverride`] gives to its patches.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum BoundaryLabel {
    /// A boundary-condition number, from 1.
    Number(u32),
    /// A boundary name.
    Name(String),
}

/// A curve along which two surfaces are tangent: a fillet and its plane, a pipe and the ball that ends it.
///
/// The intersection of the two says little of such a curve: rounding moves it by the square root of itself. So it is
/// carried by one of them and an **auxiliary** surface across it, which need not bound anything.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Seam {
    /// The two surfaces, ascending.
    pub pair: [SurfaceId; 2],
    /// One of them and the auxiliary surface, ascending. Their intersection may have other pieces, where the two are apart.
    pub carrier: [SurfaceId; 2],
    /// What else the two have in common where they cross, carried likewise: cones tangent along a line have a conic in common, too.
    pub rest: Option<[SurfaceId; 2]>,
    /// Whether the two have no other points in common than what is carried.
    pub is_alone: bool,
}

/// What a `.geo` file says.
#[derive(Clone, Debug, Default)]
pub struct Geometry {
    /// The surfaces, equal ones made one; after those of the file the auxiliary ones of seams.
    pub surfaces: Vec<Surface>,
    /// Beside each surface what the file says of it.
    pub surface_info: Vec<SurfaceInfo>,
    /// The bodies in file order.
    pub bodies: Vec<Body>,
    /// Parts of surfaces that are patches of their own, in file order. Where several have a place, the first counts.
    pub cutouts: Vec<Cutout>,
    /// Periodic faces.
    pub identifications: Vec<Identification>,
    /// Tags for solvers.
    pub singularities: Vec<Singularity>,
    /// Points to be kept as mesh vertices.
    pub user_points: Vec<UserPoint>,
    /// Numbers and names for single boundaries of bodies, in file order.
    pub boundary_overrides: Vec<BoundaryOverride>,
    /// The `boundingbox` statement: an override, never needed.
    pub stated_box: Option<Aabb>,
    /// Where surfaces are tangent along curves, by pair ([`find_seams`](crate::features::find_seams)).
    pub seams: Vec<Seam>,
}

impl Geometry {
    /// The seam of two surfaces, ascending, if they have one.
    pub fn seam(&self, pair: [SurfaceId; 2]) -> Option<&Seam> {
        self.seams.binary_search_by_key(&pair, |seam| seam.pair).ok().map(|i| &self.seams[i])
    }
}
