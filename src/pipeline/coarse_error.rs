//! Why there is no coarse mesh, and where a finer mesh may help.

use super::close::TooClose;
use super::room_error::RoomError;
use crate::Point;
use crate::ground::error::{ErrorKind, HasKind};
use crate::ground::progress::Cancelled;
use crate::ground::size::{SizeField, Source};
use crate::mesher::surface::SurfaceError;
use crate::mesher::surface::curves::CurveError;
use crate::mesher::volume::{SurfaceFault, SurfaceFaults, VolumeError};
use csg::features::{Named, Pair, Place};

/// Factor applied to the size where an attempt failed.
const LOWERED: f64 = 0.6;

/// Why there is no coarse mesh.
#[derive(Debug, thiserror::Error)]
pub enum CoarseError {
    /// A curve could not be divided into segments.
    #[error(transparent)]
    Curve(#[from] CurveError),
    /// A patch could not be meshed.
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    /// Curves remain too close to each other, however short their segments.
    #[error(
        "an edge between surfaces of {} comes too near another at {place} for any segments that were tried: surfaces \
         touch there to a high order, or leave too narrow a face; move one of them or let them overlap",
        Pair(.first, .second)
    )]
    TooNear {
        /// One surface.
        first: Named,
        /// The other.
        second: Named,
        /// Where the curves are too close.
        place: Place,
    },
    /// Surfaces are so close to each other that only very small elements keep them apart.
    #[error(transparent)]
    TooClose(#[from] TooClose),
    /// The surface mesh does not bound the bodies.
    #[error(
        "the surface mesh does not bound the bodies: {faults}; surfaces may touch there, or leave too thin a wall: move one of them"
    )]
    NotClosed {
        /// The faults.
        faults: SurfaceFaults,
        /// Edge midpoints of triangles that intersect others.
        crossing: Vec<Point>,
    },
    /// Two patches have edges in common that are on no curve.
    #[error(
        "patches are so close to each other at ({}, {}, {}) that they have an edge in common: surfaces touch there to a \
         high order, or leave too thin a wall; move one of them",
        .middles[0].x, .middles[0].y, .middles[0].z
    )]
    CommonEdges {
        /// The midpoints of the edges; at least one.
        middles: Vec<Point>,
    },
    /// The input triangles do not bound bodies.
    #[error(
        "{} intersect, or touch without being the same: {count} pairs, the first at ({}, {}, {}); no option repairs this: \
         where surfaces touch, give both the same triangles there (join them in the program that made them), or keep them \
         apart",
        triangles_of(.files), first.x, first.y, first.z
    )]
    FacetsMeet {
        /// The files of the first pair if they differ.
        files: Option<Box<[String; 2]>>,
        /// Number of pairs of triangles.
        count: usize,
        /// Where the first pair intersects.
        first: Point,
    },
    /// Two faces of one solid of a CAD file intersect, or one face intersects itself.
    #[error(
        "{} near ({}, {}, {}), at {count} pairs of triangles: mend the solid in the CAD program, \
         so that its faces meet in their edges alone",
        faces_intersect(.faces), at.x, at.y, at.z
    )]
    FacesMeet {
        /// The numbers of the faces in the file.
        faces: [u32; 2],
        /// Number of pairs of triangles.
        count: usize,
        /// Where they intersect deepest.
        at: Point,
    },
    /// Two solids of a CAD file overlap.
    #[error(
        "the solids {} ({}) and {} ({}) {}, near ({}, {}, {}): {}cut the common part off in the CAD program, move one of \
         them, or mesh one alone (--solid)",
        solids[0].0, solids[0].1, solids[1].0, solids[1].1, solids_meet(.are_cut), first.x, first.y, first.z,
        if *.are_cut { "" } else { "give the common part to one of them (--overlap-to smaller), " }
    )]
    SolidsMeet {
        /// The numbers and names of the solids.
        solids: Box<[(u32, String); 2]>,
        /// Where they meet.
        first: Point,
        /// Whether the common parts of solids were cut off before.
        are_cut: bool,
    },
    /// A vertex could not be moved onto its face or edge.
    #[error(transparent)]
    Projection(#[from] csg::ProjectionFailed),
    /// A body could not be filled.
    #[error(transparent)]
    Volume(VolumeError),
    /// More tets are expected than the memory can hold.
    #[error(transparent)]
    Room(#[from] RoomError),
    /// The observer cancelled the run.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Names triangles that intersect.
fn triangles_of(files: &Option<Box<[String; 2]>>) -> String {
    match files.as_deref() {
        Some([a, b]) => format!("triangles of {a} and {b}"),
        None => "the surface's own triangles".into(),
    }
}

/// Says that faces intersect.
fn faces_intersect([a, b]: &[u32; 2]) -> String {
    if a == b { format!("face {a} intersects itself") } else { format!("the faces {a} and {b} intersect") }
}

/// Says how solids meet.
fn solids_meet(are_cut: &bool) -> &'static str {
    if *are_cut { "still overlap where nothing more could be cut off (--overlap-to)" } else { "overlap" }
}

impl From<VolumeError> for CoarseError {
    fn from(error: VolumeError) -> Self {
        match error {
            VolumeError::Cancelled(cancelled) => Self::Cancelled(cancelled),
            error => Self::Volume(error),
        }
    }
}

impl HasKind for CoarseError {
    fn kind(&self) -> ErrorKind {
        match self {
            Self::TooClose(_)
            | Self::FacetsMeet { .. }
            | Self::FacesMeet { .. }
            | Self::SolidsMeet { .. } => ErrorKind::Input,
            Self::Room(_) => ErrorKind::Resources,
            Self::Cancelled(_) => ErrorKind::Cancelled,
            _ => ErrorKind::NoMesh,
        }
    }
}

impl CoarseError {
    /// Sources that lower the sizes where a finer mesh may help. `segments` are the ends of the
    /// initial segments, `size` is the size field that was used.
    pub(super) fn remedy(&self, segments: &[[Point; 2]], size: &dyn SizeField) -> Vec<Source> {
        match self {
            Self::Surface(SurfaceError::TooCoarse { segments: long, .. }) => {
                let shorter = |&s: &usize| {
                    let [a, b] = segments[s];
                    Source { point: nalgebra::center(&a, &b), size: LOWERED * (b - a).norm() }
                };
                long.iter().map(shorter).collect()
            }
            _ => self.places().iter().map(|&point| smaller_at(point, size)).collect(),
        }
    }

    /// Places where there is no mesh, all that are known.
    pub(super) fn all_places(&self) -> Vec<Point> {
        match self {
            Self::NotClosed { faults, .. } => faults.0.iter().filter_map(SurfaceFault::place).collect(),
            Self::Surface(SurfaceError::TooCoarse { places, .. }) => places.clone(),
            _ => self.places().to_vec(),
        }
    }

    /// Places where surfaces are too close to each other for the sizes.
    pub(super) fn places(&self) -> &[Point] {
        match self {
            Self::CommonEdges { middles: places }
            | Self::NotClosed { crossing: places, .. }
            | Self::Volume(VolumeError::NotRecovered { places, .. }) => places,
            _ => &[],
        }
    }
}

/// A source that lowers the size at a place with too little room.
pub(super) fn smaller_at(point: Point, size: &dyn SizeField) -> Source {
    Source { point, size: LOWERED * size.size_at(&point) }
}
