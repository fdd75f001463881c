//! Volume meshing: Delaunay tetrahedra inside a closed surface that is kept exactly.
//!
//! A [`ClosedSurface`] bounds **bodies**; [`mesh`] fills them with tets whose faces on the surface are its
//! triangles, none split, none turned. So parts that were meshed apart still fit.
//!
//! ```
//! use tetmill::size::UniformSize;
//! use tetmill::volume::{ClosedSurface, Settings, mesh};
//! use tetmill::{Point, volume};
//!
//! // A tet's four faces, outward: body 0 behind, nothing in front.
//! let corners = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]].map(Point::from);
//! let triangles = vec![[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];
//! let regions = vec![[Some(csg::BodyId(0)), None]; 4];
//! let surface = ClosedSurface::new(corners.to_vec(), triangles, regions).unwrap();
//! let (filled, report) = mesh(&surface, &UniformSize(1.0), &Settings::default()).unwrap();
//! assert_eq!(filled.tets.len(), 1);
//! assert_eq!(report, volume::Report::default());
//! ```
//!
//! A surface that meets itself is refused when it is made (`intersect`, over the tree of `boxes`). The steps, one file each:
//! 1. `delaunay`: the boundary points, by exact cavities (`cavity`), in random rounds along the Hilbert curve; `ties` make it have the diagonals
//!    of grids.
//! 2. `conform`: edges, then triangles: by `flips` (`recover`); where none is left, the mesh is cut along the surface, by Steiner points for a
//!    while that lie exactly on it (`steiner`), where their cavity has most room (`clearance`).
//! 3. `carve`: a flood from the triangles gives each tet its body and removes the outside.
//! 4. `relocate`: Steiner points leave the surface: none or one stays inside on either side of it (`sector`). `inside` deletes those that are not
//!    needed, by a search for tets that fill the hole (`small`); `round` gives the others places with doubles.
//! 5. `keep`, `kept_edges`: points and edges that the caller wants.
//! 6. `points`: the inside by the size field: lattices where it is level (`lattice`), frontal Delaunay elsewhere, after flips that make
//!    the mesh Delaunay again (`legalize`); sizes grow by a limited gradient whatever the field (`sizes`).
//!
//! Not promised: good shape. Steps 1 to 5 leave whatever the surface allows; step 6 places points so that nearly all tets are well
//! shaped, but slivers remain: see [`improve`](crate::improve).

mod bound;
mod boxes;

mod carve;
mod cavity;
mod clearance;
pub mod closed_surface;
mod conform;
mod constraints;
mod crossing;
mod delaunay;
mod exact;
mod finish;
mod flips;
mod inside;
mod intersect;
mod keep;
mod kept_edges;
mod lattice;
mod legalize;
mod near;
mod points;
mod polygon;
mod recover;
mod relax;
mod relocate;
mod round;
#[cfg(test)]
mod samples;
mod sector;
mod sectors;
mod sizes;
mod small;
mod steiner;
mod surface_faults;
mod tetrahedra;
mod ties;

pub use closed_surface::ClosedSurface;
pub(crate) use intersect::{intersections, middles_of_sides};
pub use keep::KeptPointFault;
pub use kept_edges::KeptEdgeFault;
pub use near::NearPair;
pub use surface_faults::{SurfaceFault, SurfaceFaults};

use crate::Point;
use crate::size::SizeField;
use csg::BodyId;

/// Tets that fill the bodies of a [`ClosedSurface`].
#[derive(Clone, Debug, Default)]
pub struct VolumeMesh {
    /// The points of the surface, unchanged and in order, then those kept, in order, then the others inside.
    pub points: Vec<Point>,
    /// The tets, positively oriented; their faces on the boundary are the surface's triangles, exactly.
    pub tets: Vec<[u32; 4]>,
    /// The body of each tet.
    pub bodies: Vec<BodyId>,
    /// The edges of the tets that the kept ones consist of, and the place of each of those in the list: one each, more where one had to
    /// be cut.
    pub kept_edges: Vec<([u32; 2], u32)>,
}

/// Choices of the volume mesher.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Whether to add points inside by the size field. Without: only what the boundary needs.
    pub fill: bool,
    /// How much the wanted size may grow per unit of distance, from a skin that is finer than the size field asks and from where the
    /// field is finer; the only rule where the field is infinite.
    pub growth: f64,
    /// The largest number of tets; more end with an error.
    pub max_tets: usize,
}

impl Default for Settings {
    fn default() -> Self {
        Self { fill: true, growth: 0.3, max_tets: tetrahedra::MAX_TETS }
    }
}

/// What the volume mesher met and did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Report {
    /// Edges of the surface that the Delaunay mesh of its points did not have.
    pub missing_edges: usize,
    /// Triangles of the surface that the Delaunay mesh of its points did not have.
    pub missing_faces: usize,
    /// Points put on the surface for a while, because flips alone did not recover it.
    pub steiner_on_surface: usize,
    /// Points left inside the bodies to replace them.
    pub steiner_inside: usize,
    /// Points that had to stay on kept edges: each cuts one in two.
    pub on_kept_edges: usize,
    /// How often the recovery was begun anew, in another order.
    pub restarts: usize,
    /// Points added inside by the size field.
    pub points_inside: usize,
}

/// Why there is no volume mesh.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum VolumeError {
    /// Some triangles could not be made faces of the mesh.
    #[error(
        "{} triangles could not be recovered: {}{}",
        triangles.len(), list_places(triangles, places), nearest.map(|pair| format!("; {pair}")).unwrap_or_default()
    )]
    NotRecovered {
        /// The triangles.
        triangles: Vec<u32>,
        /// A corner of each.
        places: Vec<Point>,
        /// Those of the surface that come nearest to each other there, if any have no common vertex.
        nearest: Option<NearPair>,
    },
    /// Two triangles name different regions for one and the same.
    #[error(
        "triangle {triangle} at ({}, {}, {}) says {regions:?} for a region that another triangle names otherwise",
        place.x, place.y, place.z
    )]
    Inconsistent {
        /// The triangle.
        triangle: u32,
        /// A corner of it.
        place: Point,
        /// What it names, and what the other does.
        regions: [Option<BodyId>; 2],
    },
    /// A point that was to be kept cannot be a vertex inside a body.
    #[error("point {index} at ({}, {}, {}) was to be kept but {fault}", place.x, place.y, place.z)]
    KeptPoint {
        /// Its index among the kept points.
        index: usize,
        /// Where it is.
        place: Point,
        /// Why not.
        fault: KeptPointFault,
    },
    /// An edge that was to be kept cannot be an edge inside a body.
    #[error("edge {index}, from ({}, {}, {}) to ({}, {}, {}), was to be kept but {fault}",
        ends[0].x, ends[0].y, ends[0].z, ends[1].x, ends[1].y, ends[1].z)]
    KeptEdge {
        /// Its index among the kept edges.
        index: usize,
        /// Its ends; the origin for those that do not exist.
        ends: [Point; 2],
        /// Why not.
        fault: KeptEdgeFault,
    },
    /// The size field gives something that is no length.
    #[error("the size wanted at ({}, {}, {}) is {size}, not a positive length", place.x, place.y, place.z)]
    BadSize {
        /// Where.
        place: Point,
        /// What it gives.
        size: f64,
    },
    /// The sizes ask for more tets than are allowed.
    #[error("the wanted sizes lead to more than {limit} tets")]
    TooManyTets {
        /// The largest number allowed.
        limit: usize,
    },
}

/// The first few triangles with their places, for messages.
fn list_places(triangles: &[u32], places: &[Point]) -> String {
    const SHOWN: usize = 5;
    let mut text: Vec<String> = triangles
        .iter()
        .zip(places)
        .take(SHOWN)
        .map(|(t, p)| format!("triangle {t} at ({}, {}, {})", p.x, p.y, p.z))
        .collect();
    if triangles.len() > SHOWN {
        text.push(format!("and {} more", triangles.len() - SHOWN));
    }
    text.join(", ")
}

/// Fills the bodies of a surface with tets whose edges are about as long as `size` says.
///
/// The surface stays as it is: its triangles are the faces of the tets on it, exactly. All tets are
/// positively oriented by exact sign. The same input gives the same mesh.
///
/// # Errors
/// Regions that disagree, kept features that cannot be, and triangles that could not be recovered, each with places.
pub fn mesh(
    surface: &ClosedSurface,
    size: &dyn SizeField,
    settings: &Settings,
) -> Result<(VolumeMesh, Report), VolumeError> {
    let scale = finish::scale_of(&surface.points);
    let points: Vec<Point> = surface.points.iter().map(|p| p * scale).collect();
    let mut report = Report::default();
    let (mut tets, mut constraints) = bound::bound(surface, &points, &mut report)?;
    let mut cavity = cavity::Cavity::default();
    let mut kept = Vec::with_capacity(surface.kept_points.len());
    for (index, &place) in surface.kept_points.iter().enumerate() {
        let vertex = keep::keep(&mut tets, &mut cavity, place * scale);
        kept.push(vertex.map_err(|fault| VolumeError::KeptPoint { index, place, fault })?);
    }
    let kept_edges = kept_edges::keep(surface, &mut tets, &mut constraints, &kept, scale, &mut report)?;
    if settings.fill {
        let limit = settings.max_tets.min(tetrahedra::MAX_TETS);
        report.points_inside =
            points::fill(&mut tets, size, scale, points::Limits { growth: settings.growth, max_tets: limit })
                .map_err(|stopped| match stopped {
                    points::Stopped::BadSize { place, size } => VolumeError::BadSize { place, size },
                    points::Stopped::TooManyTets => VolumeError::TooManyTets { limit },
                })?;
    }
    Ok((finish::finish(surface, tets, &kept, kept_edges, scale), report))
}

#[cfg(test)]
mod hard_tests;
#[cfg(test)]
mod tests;
