//! Why a run ends without a mesh.

use super::coarse_error::CoarseError;
use super::room_error::RoomError;
use crate::Point;
use crate::files::WriteError;
use crate::files::arrays::ArrayError;
use crate::files::elmer::LoadError;
use crate::files::input::ReadError;
use crate::files::{surface, volume};
use crate::ground::comm::CommError;
use crate::ground::error::{ErrorKind, HasKind};
use crate::ground::mesh::periodic::MapError;
use crate::ground::mesh::{Rank, UnknownName};
use crate::ground::progress::Cancelled;
use crate::mesher::facets::FacetError;
use crate::parallel::check::{Checksum, Fault};
use crate::parallel::decompose::{CutError, LooseEdge, TooManyParts};
use crate::parallel::distribution::{DistError, NumberError};
use crate::parallel::halo::HaloError;
use crate::parallel::migrate::MigrateError;
use crate::parallel::partition::PartitionError;
use crate::parallel::refine::RefineError;
use crate::parallel::repartition::RepartitionError;
use crate::parallel::skin::FillError;
use csg::FeatureError;
use csg::language::Diagnostics;
use std::path::PathBuf;

/// Why a run ends without a mesh, by the stage that failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// A partitioned mesh cannot be read.
    #[error(transparent)]
    Load(LoadError),
    /// The text of a geometry has errors.
    #[error(transparent)]
    Language(#[from] Diagnostics),
    /// A geometry cannot be meshed.
    #[error("{}{error}", prefix(.path))]
    Features {
        /// The file of the geometry, if it came from one.
        path: Option<PathBuf>,
        /// The reason, with the location.
        error: Box<FeatureError>,
    },
    /// Triangles do not bound bodies.
    #[error("{}{error}", prefix(.path))]
    Facets {
        /// The file of the triangles, if they came from one.
        path: Option<PathBuf>,
        /// The reason, with the location.
        error: Box<FacetError>,
    },
    /// The shapes of a CAD file cannot be meshed.
    #[error("{}: {error}", .path.display())]
    Brep {
        /// The file.
        path: PathBuf,
        /// The reason, with the location.
        error: Box<brep::BrepError>,
    },
    /// The input cannot be meshed.
    #[error(transparent)]
    Input(#[from] InputError),
    /// The request cannot be met for this input.
    #[error(transparent)]
    Request(#[from] RequestError),
    /// A body or boundary of a name that does not exist was asked for.
    #[error(transparent)]
    Name(#[from] UnknownName),
    /// There is no coarse mesh.
    #[error(transparent)]
    Coarse(Box<CoarseError>),
    /// The geometry cannot be cut into pieces.
    #[error(transparent)]
    Cut(Box<CutError>),
    /// A part cannot be meshed inside its surface.
    #[error("part {part} (from 0) cannot be meshed: {error}")]
    Fill {
        /// The part.
        part: Rank,
        /// The reason.
        error: Box<FillError>,
    },
    /// Periodic faces of the coarse mesh do not match.
    #[error(transparent)]
    Periodic(Box<MapError>),
    /// The coarse mesh cannot be partitioned.
    #[error(transparent)]
    Partition(#[from] PartitionError),
    /// The mesh cannot be distributed.
    #[error(transparent)]
    Distribute(DistError),
    /// Shared entities cannot be numbered.
    #[error(transparent)]
    Number(NumberError),
    /// The mesh cannot be refined.
    #[error(transparent)]
    Refine(RefineError),
    /// The mesh cannot be repartitioned.
    #[error(transparent)]
    Repartition(RepartitionError),
    /// Tets cannot be moved to other ranks.
    #[error(transparent)]
    Migrate(MigrateError),
    /// Ghosts cannot be determined.
    #[error(transparent)]
    Halo(HaloError),
    /// Memory, disk or a format is too small.
    #[error(transparent)]
    Room(#[from] RoomError),
    /// The mesh that was made is not valid.
    #[error(transparent)]
    Invalid(Box<InvalidMesh>),
    /// A file cannot be written.
    #[error(transparent)]
    Write(WriteError),
    /// The observer cancelled the run.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// Another rank met an error, or the ranks cannot communicate.
    #[error(transparent)]
    Comm(#[from] CommError),
}

fn prefix(path: &Option<PathBuf>) -> String {
    path.as_ref().map_or_else(String::new, |path| format!("{}: ", path.display()))
}

/// The input cannot be meshed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum InputError {
    /// The extension of a file is that of no known format.
    #[error(
        "cannot tell by its name what {} contains; known are geometries (.geo, .step, .brep), surfaces ({}) and meshes ({})",
        .0.display(), surface::KNOWN, volume::KNOWN
    )]
    UnknownFormat(PathBuf),
    /// An IGES file, which cannot be read.
    #[error(
        "{} is an IGES file, which cannot be read: save the part as STEP in the CAD program, or convert it with the Python \
         package gmsh (`import gmsh; gmsh.initialize(); gmsh.model.occ.importShapes(\"PART.iges\"); \
         gmsh.model.occ.synchronize(); gmsh.write(\"PART.step\")`)",
        .0.display()
    )]
    Cad(PathBuf),
    /// Invalid arrays of a surface or mesh.
    #[error(transparent)]
    Arrays(#[from] ArrayError),
    /// A mesh that is too large or too small for double precision.
    #[error("{}{range}", prefix(.path))]
    OutOfRange {
        /// The file, if the mesh came from one.
        path: Option<PathBuf>,
        /// The length that is out of range.
        range: csg::OutOfRange,
    },
    /// Several files that are neither all surfaces nor all CAD files.
    #[error("several files are taken together only if all of them are surfaces, or all CAD files")]
    SeveralFiles,
    /// A length to merge surfaces is given for a file without analytic surfaces.
    #[error("{}: only surfaces of .geo files can be merged", .0.display())]
    MergesOnlyCsg(PathBuf),
    /// Solids are chosen in a file without solids.
    #[error("{}: only solids of CAD files (.step, .stp, .brep) can be chosen", .0.display())]
    SolidsOnlyOfCad(PathBuf),
    /// What solids have in common is given to one of them in a file without solids.
    #[error("{}: only solids of CAD files (.step, .stp, .brep) can be cut out of each other", .0.display())]
    OverlapsOnlyOfCad(PathBuf),
    /// A chosen solid is not in the file.
    #[error("{}: there is no solid `{name}`: the file has {count}{}", path.display(), called(.names))]
    NoSuchSolid {
        /// The file.
        path: PathBuf,
        /// The name or number that was given.
        name: String,
        /// The number of solids.
        count: usize,
        /// The names of the solids, each once.
        names: String,
    },
    /// Two files share a face, but not its triangles.
    #[error(
        "{} and {} overlap at ({}, {}, {}): where surfaces touch, both need the same triangles, and no option makes them \
         the same; export both from one model that shares the face, or move them apart",
        files[0].display(), files[1].display(), place.x, place.y, place.z
    )]
    Overlap {
        /// The two files.
        files: Box<[PathBuf; 2]>,
        /// The midpoint of an edge where triangles of both overlap.
        place: Point,
    },
    /// A mesh with tets that are not positively oriented.
    #[error(
        "{}{count} tets are inverted or flat, the first of them number {} (counted from 1) at ({}, {}, {})",
        prefix(.path), first + 1, corner.x, corner.y, corner.z
    )]
    Inverted {
        /// The file, if the mesh came from one.
        path: Option<PathBuf>,
        /// Number of such tets.
        count: usize,
        /// The first of them, from 0.
        first: usize,
        /// A corner of it.
        corner: Point,
    },
}

fn called(names: &str) -> String {
    if names.is_empty() { String::new() } else { format!(": {names}") }
}

/// The request cannot be met for this input.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RequestError {
    /// An option has a value that no mesh can have.
    #[error("`{name}` cannot be {value}: possible are {allowed}")]
    Option {
        /// The function of [`Mesher`](crate::Mesher) or the setting.
        name: &'static str,
        /// Its value.
        value: String,
        /// The values that it can have.
        allowed: String,
    },
    /// Rank 0 was given no geometry.
    #[error("rank 0 has no geometry to mesh")]
    NoGeometry,
    /// The ranks have different settings.
    #[error("rank {rank} has another setting than rank 0: {option}")]
    OtherSettings {
        /// The lowest rank whose settings differ from those of rank 0.
        rank: Rank,
        /// The first option that differs.
        option: &'static str,
    },
    /// Periodic faces cannot be in one part with their copies.
    #[error(
        "{lost} of the {tets} tets before refinement cannot be in one part with those at the partners of their periodic \
         faces, which Elmer needs: use fewer parts or a finer coarse mesh"
    )]
    SplitPeriodic {
        /// Number of tets in the wrong part, before refinement.
        lost: usize,
        /// Number of all tets, before refinement.
        tets: usize,
    },
    /// Repartitioning ignores periodic faces.
    #[error(
        "{} has periodic faces, and parts are chosen without regard to them, so that Elmer's `Periodic BC` would be wrong",
        .0.display()
    )]
    PeriodicRepartition(PathBuf),
    /// Only CSG geometries can be cut into pieces.
    #[error(
        "only geometries (.geo) can be cut; for triangles and meshes take the methods `refine` or `surface`"
    )]
    NotCuttable,
    /// Tags that name bodies, which would be divided in a geometry of the pieces.
    #[error(
        "`boundarycondition` and `singular` refer to bodies, which the planes would cut: remove them from the file, or use \
         `generate -m decompose`, which keeps them"
    )]
    TaggedBodies,
    /// The user's planes make another number of pieces.
    #[error(
        "the planes cut the geometry into {pieces} pieces, for {parts} parts; each plane cuts every piece that it meets"
    )]
    Planes {
        /// Number of pieces.
        pieces: usize,
        /// Number of requested parts.
        parts: u32,
    },
    /// The geometry is too small for this many parts.
    #[error(transparent)]
    Parts(#[from] TooManyParts),
    /// The method `decompose` does not keep edges inside bodies.
    #[error(transparent)]
    LooseEdge(#[from] LooseEdge),
}

/// Faults of the finished mesh; nothing is written.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum InvalidMesh {
    /// Tets, boundary triangles or vertices have faults.
    #[error("the mesh has {count} faults, nothing was written:\n  {}", list(.first))]
    Faults {
        /// Number of faults.
        count: u64,
        /// The first faults.
        first: Vec<Fault>,
    },
    /// The faces of tets do not match.
    #[error("faces of the mesh do not match; nothing was written")]
    OpenFaces,
    /// Vertices of periodic faces are not where the motion puts them.
    #[error(
        "{lost} vertices of periodic faces have no partner, others are {furthest:e} off; nothing was written"
    )]
    Periodic {
        /// Number of vertices without a partner.
        lost: u64,
        /// The largest distance of a vertex from its place according to the motion.
        furthest: f64,
    },
    /// Moving tets changed the mesh.
    #[error("moving tets changed the mesh: checksum {before} before, {after} after; nothing was written")]
    Changed {
        /// Its checksum before.
        before: Checksum,
        /// Its checksum after.
        after: Checksum,
    },
}

fn list(faults: &[Fault]) -> String {
    faults.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n  ")
}

impl HasKind for Error {
    fn kind(&self) -> ErrorKind {
        match self {
            Self::Read(_) | Self::Language(_) | Self::Input(_) | Self::Request(_) => ErrorKind::Input,
            Self::Features { .. } | Self::Facets { .. } | Self::Brep { .. } | Self::Name(_) => {
                ErrorKind::Input
            }
            Self::Coarse(error) => error.kind(),
            Self::Cut(error) => error.kind(),
            Self::Fill { .. } => ErrorKind::NoMesh,
            Self::Periodic(_) | Self::Invalid(_) => ErrorKind::NoMesh,
            Self::Room(_) => ErrorKind::Resources,
            Self::Cancelled(_) => ErrorKind::Cancelled,
            Self::Load(error) => error.kind(),
            Self::Partition(error) => error.kind(),
            Self::Distribute(error) => error.kind(),
            Self::Number(error) => error.kind(),
            Self::Refine(error) => error.kind(),
            Self::Repartition(error) => error.kind(),
            Self::Migrate(error) => error.kind(),
            Self::Halo(error) => error.kind(),
            Self::Write(error) => error.kind(),
            Self::Comm(error) => error.kind(),
        }
    }

    fn is_elsewhere(&self) -> bool {
        matches!(self, Self::Comm(error) if error.is_elsewhere())
    }
}

impl From<FeatureError> for Error {
    fn from(error: FeatureError) -> Self {
        Self::Features { path: None, error: Box::new(error) }
    }
}

impl From<FacetError> for Error {
    fn from(error: FacetError) -> Self {
        Self::Facets { path: None, error: Box::new(error) }
    }
}

/// Conversions of the stages' errors. Variants that are an error of another stage, a cancelled run
/// or a failure of another rank are converted to that, so that a caller finds each in one place.
macro_rules! stages {
    ($($error:ident => $variant:ident ($($inner:ident)*);)*) => {$(
        impl From<$error> for Error {
            fn from(error: $error) -> Self {
                match error {
                    $($error::$inner(inner) => inner.into(),)*
                    error => Self::$variant(error.into()),
                }
            }
        }
    )*};
}

stages! {
    LoadError => Load (Read Comm);
    CoarseError => Coarse (Room Cancelled);
    CutError => Cut (Distribute Refine);
    DistError => Distribute (Comm);
    NumberError => Number (Comm);
    RefineError => Refine (Cancelled);
    RepartitionError => Repartition (Comm);
    MigrateError => Migrate (Number Comm);
    HaloError => Halo (Comm);
    WriteError => Write (Cancelled Comm);
    InvalidMesh => Invalid ();
    MapError => Periodic ();
}
