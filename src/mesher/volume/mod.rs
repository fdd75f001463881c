//! Volume meshing: Delaunay tets inside a closed surface that is preserved exactly.
//!
//! A [`ClosedSurface`] bounds **bodies**; [`mesh`] fills them with tets whose faces on the surface
//! are exactly its triangles: none is split or flipped. So parts meshed separately still conform.
//!
//! ```
//! use tetmill::Point;
//! use tetmill::internals::UniformSize;
//! use tetmill::internals::volume::{ClosedSurface, Report, Settings, mesh};
//!
//! // A tet's four faces, outward: body 0 behind, nothing in front.
//! let corners = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]].map(Point::from);
//! let triangles = vec![[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];
//! let regions = vec![[Some(csg::BodyId(0)), None]; 4];
//! let surface = ClosedSurface::new(corners.to_vec(), triangles, regions).unwrap();
//! let (filled, report) = mesh(&surface, &UniformSize(1.0), &Settings::default()).unwrap();
//! assert_eq!(filled.tets.len(), 1);
//! assert_eq!(report, Report::default());
//! ```
//!
//! A surface that intersects itself is rejected on construction (`intersect`, with the tree of
//! `boxes`). The steps, one file each:
//! 1. `delaunay`: inserts the boundary points by exact cavities (`cavity`), in random rounds along
//!    the Hilbert curve; `ties` chooses the diagonals of grids.
//! 2. `conform`: recovers edges, then triangles, by `flips` (`recover`). If flips fail, temporary
//!    Steiner points are inserted exactly on the surface (`steiner`), at the position with the most
//!    clearance (`clearance`).
//! 3. `carve`: a flood fill from the triangles assigns each tet its body and removes the outside.
//! 4. `relocate`: Steiner points leave the surface; each leaves at most one point inside on either
//!    side (`sector`). `inside` deletes those that are not needed, by a search for tets that fill
//!    the cavity (`small`); `round` moves the others to double-precision positions.
//! 5. `keep`, `kept_edges`: insert points and edges requested by the caller.
//! 6. `points`: fills the inside by the size field: lattices in regions of constant size
//!    (`lattice`; inserted by all threads in `blocks`, see `candidates`), frontal Delaunay
//!    elsewhere, after flips that restore the Delaunay property (`legalize`); `front` runs it in
//!    blocks on all threads if many points are expected. The growth of sizes is limited for any
//!    field (`sizes`).
//!
//! If bodies touch, the steps are done for each body by itself (`apart`).
//!
//! Not guaranteed: shape. Steps 1 to 5 make whatever tets the surface allows; step 6 makes nearly
//! all tets well-shaped, but slivers remain: see [`improve`](crate::mesher::improve).

mod apart;
mod blocks;
mod bound;
mod boxes;
mod candidates;
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
mod front;
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
use crate::ground::progress::Cancelled;
use crate::ground::size::SizeField;
use csg::BodyId;

/// Tets that fill the bodies of a [`ClosedSurface`].
#[derive(Clone, Debug, Default)]
pub struct VolumeMesh {
    /// The points of the surface in order, then the kept points in order, then the others inside.
    pub points: Vec<Point>,
    /// The tets, positively oriented; their faces on the boundary are exactly the surface's
    /// triangles.
    pub tets: Vec<[u32; 4]>,
    /// The body of each tet.
    pub bodies: Vec<BodyId>,
    /// Mesh edges that make up the kept edges, each with the index of its kept edge: one per kept
    /// edge, more if it was split.
    pub kept_edges: Vec<([u32; 2], u32)>,
}

/// Options of the volume mesher.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Whether to add points inside by the size field. If false, the mesh has only the points that
    /// the boundary needs.
    pub fill: bool,
    /// Largest increase of the size per unit of distance, away from triangles finer than the size
    /// field and from regions where the field is finer. It is the only limit if the field is
    /// infinite.
    pub growth: f64,
    /// The largest number of tets; exceeding it is an error.
    pub max_tets: usize,
}

impl Default for Settings {
    fn default() -> Self {
        Self { fill: true, growth: 0.3, max_tets: tetrahedra::MAX_TETS }
    }
}

/// Statistics of one run of the volume mesher.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Report {
    /// Edges of the surface that were not in the Delaunay mesh of its points.
    pub missing_edges: usize,
    /// Triangles of the surface that were not in the Delaunay mesh of its points.
    pub missing_faces: usize,
    /// Temporary points on the surface, used because flips alone did not recover it.
    pub steiner_on_surface: usize,
    /// Points left inside the bodies in their place.
    pub steiner_inside: usize,
    /// Points that stay on kept edges; each splits one in two.
    pub on_kept_edges: usize,
    /// How often recovery was restarted with another order.
    pub restarts: usize,
    /// Points added inside by the size field.
    pub points_inside: usize,
}

/// Why the volume mesher failed.
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
        /// The first corner of each.
        places: Vec<Point>,
        /// The closest pair of surface triangles without a common vertex near them, if there is
        /// one.
        nearest: Option<NearPair>,
    },
    /// Two triangles assign different bodies to the same region.
    #[error(
        "triangle {triangle} at ({}, {}, {}) assigns {} to a region to which another triangle assigns {}",
        place.x, place.y, place.z, region_name(regions[0]), region_name(regions[1])
    )]
    Inconsistent {
        /// The triangle.
        triangle: u32,
        /// Its first corner.
        place: Point,
        /// The region it assigns, and the region that another triangle assigns.
        regions: [Option<BodyId>; 2],
    },
    /// A kept point cannot be a vertex inside a body.
    #[error("kept point {index} at ({}, {}, {}) {fault}", place.x, place.y, place.z)]
    KeptPoint {
        /// Its index among the kept points.
        index: usize,
        /// Its position.
        place: Point,
        /// The reason.
        fault: KeptPointFault,
    },
    /// A kept edge cannot be an edge inside a body.
    #[error("kept edge {index}, from ({}, {}, {}) to ({}, {}, {}), {fault}",
        ends[0].x, ends[0].y, ends[0].z, ends[1].x, ends[1].y, ends[1].z)]
    KeptEdge {
        /// Its index among the kept edges.
        index: usize,
        /// Its ends; the origin for indices that do not exist.
        ends: [Point; 2],
        /// The reason.
        fault: KeptEdgeFault,
    },
    /// The size field returned a value that is not a positive length.
    #[error("the size wanted at ({}, {}, {}) is {size}, not a positive length", place.x, place.y, place.z)]
    BadSize {
        /// The position.
        place: Point,
        /// The returned value.
        size: f64,
    },
    /// The wanted sizes need more tets than allowed.
    #[error("the wanted sizes need more than {limit} tets: increase the mesh size")]
    TooManyTets {
        /// The largest number allowed.
        limit: usize,
    },
    /// The observer cancelled the run.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// The name of a region, for messages.
fn region_name(region: Option<BodyId>) -> String {
    region.map_or_else(|| "the outside".to_owned(), |body| format!("body {}", body.0))
}

/// The first few triangles with their positions, for messages.
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

/// Fills the bodies of a surface with tets whose edges are about as long as `size` requests.
///
/// The triangles of the surface become exactly the boundary faces of the tets. All tets are
/// positively oriented by exact sign. The result is deterministic.
///
/// If bodies touch, the surface must not have kept points and edges.
///
/// # Errors
/// All errors carry coordinates, except the last:
/// - [`VolumeError::NotRecovered`] if some triangles could not be made faces of the mesh,
/// - [`VolumeError::Inconsistent`] if triangles assign different bodies to one region,
/// - [`VolumeError::KeptPoint`] and [`VolumeError::KeptEdge`] if one is not strictly inside a body
///   or not recoverable,
/// - [`VolumeError::BadSize`] if `size` returns a value that is not a positive length,
/// - [`VolumeError::TooManyTets`] if more than `settings.max_tets` tets are needed.
pub fn mesh(
    surface: &ClosedSurface,
    size: &dyn SizeField,
    settings: &Settings,
) -> Result<(VolumeMesh, Report), VolumeError> {
    if surface.is_apart {
        return apart::mesh(surface, size, settings);
    }
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
                    points::Stopped::Cancelled => VolumeError::Cancelled(Cancelled),
                })?;
    }
    Ok((finish::finish(surface, tets, &kept, kept_edges, scale), report))
}

#[cfg(test)]
mod hard_tests;
#[cfg(test)]
mod tests;
