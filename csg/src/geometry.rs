//! The geometry described by a `.geo` file: surfaces, bodies and the options that apply to them.

use crate::{Point, Solid, Surface};
use std::ops::RangeInclusive;

/// Declares the id of one kind of geometric entity: an index into the list of that kind.
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
            /// If `index` does not fit in 32 bits.
            #[inline]
            pub fn new(index: usize) -> Self {
                Self(u32::try_from(index).expect("more than 2^32 geometric entities"))
            }
        }
    };
}

entity_id!(
    /// A surface of a [`Geometry`]. Coincident surfaces of the file share one id.
    SurfaceId
);
entity_id!(
    /// A corner: an end point of curves, or an isolated vertex.
    CornerId
);
entity_id!(
    /// A curve: a connected piece of the intersection of two surfaces, closed or between two
    /// corners.
    CurveId
);
entity_id!(
    /// A patch: the pieces of one surface that separate the same two regions.
    PatchId
);
entity_id!(
    /// A body: a solid that is meshed. `BodyId(0)` is the first `tlo` of the file that declares
    /// a body and not a cutout.
    BodyId
);

/// An axis-aligned box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// The corner with the smallest coordinates.
    pub min: Point,
    /// The corner with the largest coordinates.
    pub max: Point,
}

impl Aabb {
    /// The length of the diagonal. Tolerances are given relative to it.
    pub fn diagonal(&self) -> f64 {
        (self.max - self.min).norm()
    }

    /// The center of the box.
    pub fn center(&self) -> Point {
        nalgebra::center(&self.min, &self.max)
    }
}

/// Extents that can be meshed (length): exact predicates overflow and underflow in double precision
/// beyond them, and single precision stores sizes.
const POSSIBLE_EXTENTS: RangeInclusive<f64> = 1e-25..=1e30;

/// A geometry is too large or too small for double precision.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "a length of {0:.1e} is out of range: extents from {start:.0e} to {end:.0e} are possible, so choose another unit of length",
    start = POSSIBLE_EXTENTS.start(), end = POSSIBLE_EXTENTS.end()
)]
pub struct OutOfRange(pub f64);

impl Aabb {
    /// Refuses a box around a geometry whose extent or position is out of the range of double
    /// precision.
    ///
    /// # Errors
    /// If it is out of range; the error has the diagonal or the coordinate.
    pub fn refuse_out_of_range(&self) -> Result<(), OutOfRange> {
        let largest = self.min.coords.amax().max(self.max.coords.amax());
        // The diagonal may overflow and underflow.
        let extent = (self.max - self.min).amax();
        if largest > *POSSIBLE_EXTENTS.end() {
            Err(OutOfRange(largest))
        } else if extent < *POSSIBLE_EXTENTS.start() {
            Err(OutOfRange(extent))
        } else {
            Ok(())
        }
    }
}

/// A position in the source text.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Span {
    /// The line, from 1.
    pub line: u32,
    /// The column in characters, from 1.
    pub column: u32,
}

/// Options of one surface, and its position in the file.
#[derive(Clone, Debug, Default)]
pub struct SurfaceInfo {
    /// Upper bound of the mesh size on the surface (`-maxh` of a solid that contains it), if given.
    pub maxh: Option<f64>,
    /// Boundary-condition number (`-bc`).
    pub bc: Option<u32>,
    /// Boundary name (`-bcname`).
    pub bc_name: Option<String>,
    /// The named solid in which the surface first occurs, for error messages.
    pub solid: String,
    /// Position of its primitive in the file.
    pub span: Span,
}

/// A body: a top-level object that is a solid.
#[derive(Clone, Debug)]
pub struct Body {
    /// The name of its solid.
    pub name: String,
    /// The set of points inside the body.
    pub solid: Solid,
    /// The NETGEN domain number: 1 + position among all top-level objects of the file.
    pub number: u32,
    /// Upper bound of the mesh size inside (`-maxh` of the tlo, else of the solid).
    pub maxh: Option<f64>,
    /// Material name (`-material`).
    pub material: Option<String>,
    /// Color, 0 to 1 each (`-col`).
    pub color: Option<[f64; 3]>,
    /// `-transparent`
    pub transparent: bool,
    /// `-layer`
    pub layer: i32,
    /// Position in the file.
    pub span: Span,
}

/// The part of a surface that bounds a solid, as a patch of its own (`tlo S F`).
///
/// A cutout does not change the bodies. It splits the patches on its surface where the surface also
/// bounds the solid.
#[derive(Clone, Debug)]
pub struct Cutout {
    /// The name of the solid.
    pub name: String,
    /// The solid.
    pub solid: Solid,
    /// The surface.
    pub surface: SurfaceId,
    /// The NETGEN number: 1 + position among all top-level objects of the file.
    pub number: u32,
    /// Upper bound of the mesh size on the cutout (`-maxh`).
    pub maxh: Option<f64>,
    /// Boundary-condition number (`-bc`).
    pub bc: Option<u32>,
    /// Boundary name (`-bcname`).
    pub bc_name: Option<String>,
    /// Position in the file.
    pub span: Span,
}

/// Two surfaces with matching patches: a rigid motion maps those of the first to those of the
/// second (`identify periodic`).
#[derive(Clone, Debug)]
pub struct Identification {
    /// The master surface and its periodic copy.
    pub surfaces: [SurfaceId; 2],
    /// The solids named in the statement; the first surface of each is meant.
    pub solids: [String; 2],
    /// Position in the file.
    pub span: Span,
}

/// A tag for solvers that grade elements toward singularities (`singular`).
#[derive(Clone, Debug)]
pub struct Singularity {
    /// The tagged entities.
    pub place: SingularPlace,
    /// Grading factor (`-factor`).
    pub factor: i32,
    /// Upper bound of the mesh size (`-maxh`); edges only.
    pub maxh: Option<f64>,
    /// Position in the file.
    pub span: Span,
}

/// The entities tagged by a [`Singularity`], given by the surfaces of the solids it names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SingularPlace {
    /// Patches of some surfaces that bound a body.
    Face {
        /// The surfaces.
        surfaces: Vec<SurfaceId>,
        /// The body.
        body: BodyId,
    },
    /// Curves between a surface of the first list and one of the second, restricted to one body if
    /// given.
    Edge {
        /// The two lists.
        surfaces: [Vec<SurfaceId>; 2],
        /// The body.
        body: Option<BodyId>,
    },
    /// Corners on one surface of each list.
    Point {
        /// The three lists.
        surfaces: [Vec<SurfaceId>; 3],
    },
}

/// A point that must become a mesh vertex (`point`).
#[derive(Clone, Copy, Debug)]
pub struct UserPoint {
    /// Coordinates of the vertex.
    pub point: Point,
    /// Position in the file.
    pub span: Span,
}

/// A boundary-condition number or name for the part of some surfaces that bounds one body
/// (`boundarycondition`, `boundaryconditionname`).
///
/// Overrides apply in file order, after every patch has its number from [`SurfaceInfo::bc`] or from
/// the counter. A number replaces the number of the patch. A name applies to that patch alone: if
/// its number comes from [`SurfaceInfo::bc`], which other patches may share, the patch first gets a
/// new number.
#[derive(Clone, Debug)]
pub struct BoundaryOverride {
    /// The surfaces, ascending.
    pub surfaces: Vec<SurfaceId>,
    /// The body, on either side of the surfaces.
    pub body: BodyId,
    /// The number or name to assign.
    pub label: BoundaryLabel,
    /// Position in the file.
    pub span: Span,
}

/// The label that a [`BoundaryOverride`] assigns.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum BoundaryLabel {
    /// A boundary-condition number, from 1.
    Number(u32),
    /// A boundary name.
    Name(String),
}

/// A curve along which two surfaces are tangent, for example where a fillet ends on a plane or a
/// spherical cap on a pipe.
///
/// The intersection of a tangent pair is ill-conditioned: a relative perturbation ε of the surfaces
/// moves it by √ε. The seam is therefore computed as the intersection of one surface of the pair
/// with an **auxiliary surface** that crosses it transversally. The auxiliary surface need not
/// bound any solid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Seam {
    /// The tangent pair, ascending.
    pub pair: [SurfaceId; 2],
    /// The seam surfaces, ascending: one of the pair and the auxiliary surface. They may also
    /// intersect where the pair is not tangent.
    pub surfaces: [SurfaceId; 2],
    /// The residual intersection of the pair, given by two surfaces in the same way. For example,
    /// two cones tangent along a line may also share a conic.
    pub residual: Option<[SurfaceId; 2]>,
    /// Whether the seam and the residual intersection are all that the pair has in common.
    pub is_complete: bool,
}

/// The geometry described by a `.geo` file.
#[derive(Clone, Debug, Default)]
pub struct Geometry {
    /// The surfaces without duplicates: those of the file, then the auxiliary surfaces of seams.
    pub surfaces: Vec<Surface>,
    /// Options of each surface, in the same order.
    pub surface_info: Vec<SurfaceInfo>,
    /// The bodies in file order.
    pub bodies: Vec<Body>,
    /// Parts of surfaces that are patches of their own, in file order. If several contain a point,
    /// the first applies.
    pub cutouts: Vec<Cutout>,
    /// Pairs of periodic surfaces.
    pub identifications: Vec<Identification>,
    /// Singularity tags for solvers.
    pub singularities: Vec<Singularity>,
    /// Points that must become mesh vertices.
    pub user_points: Vec<UserPoint>,
    /// Boundary numbers and names for parts of the boundary of one body, in file order.
    pub boundary_overrides: Vec<BoundaryOverride>,
    /// The box of the `boundingbox` statement. Optional: the bounds are computed.
    pub stated_box: Option<Aabb>,
    /// The seams of tangent pairs of surfaces, sorted by pair.
    pub seams: Vec<Seam>,
}

impl Geometry {
    /// The seam of a pair of surfaces (ascending), if they are tangent along a curve.
    pub(crate) fn seam(&self, pair: [SurfaceId; 2]) -> Option<&Seam> {
        self.seams.binary_search_by_key(&pair, |seam| seam.pair).ok().map(|i| &self.seams[i])
    }
}
