//! From solid geometry to very large, partitioned tetrahedral meshes, in parallel.
//!
//! A **geometry** ([`Geometry`]) is read from a file (`.geo`, STL, meshes of other programs), from
//! text, or from arrays. It consists of **bodies**, which are meshed, the **patches** around and
//! between them, the **curves** where patches meet, and **corners**. A [`Mesher`] makes the mesh,
//! on one rank or on many:
//!
//! ```
//! use tetmill::comm::{Communicator, thread};
//! use tetmill::{Error, Geometry, Mesher};
//!
//! let part = Geometry::from_text(
//!     "algebraic3d
//!      solid base = plane (0, 0, 0; 0, 0, -1) -bcname=fixed;
//!      solid dome = sphere (0, 0, 0; 1) and base;
//!      tlo dome;",
//! )?;
//! // Warnings of the language, repairs of a file.
//! for note in part.notes() {
//!     eprintln!("{note}");
//! }
//!
//! // Three ranks, here threads of this process. Each gets its part of the same mesh.
//! let owned = thread::try_run(3, |comm| -> Result<u64, Error> {
//!     let mesh = Mesher::new().max_size(0.4).levels(2).generate_on(comm, Some(&part))?;
//!
//!     // The part as flat arrays: points, tets, bodies, boundary triangles and their patches.
//!     let arrays = mesh.arrays();
//!     let fixed = mesh.names.patches_named("fixed")?; // an error if no boundary has the name
//!     let on_base = |index: &usize| fixed.contains(&arrays.triangle_patches[*index]);
//!     for triangle in (0..arrays.triangles.len()).filter(on_base) {
//!         assert!(arrays.triangles[triangle].iter().all(|&v| arrays.points[v as usize][2].abs() < 1e-9));
//!     }
//!
//!     // Vertices on interfaces are on several ranks, and owned by one of them.
//!     let sharing = mesh.sharing();
//!     Ok((0..arrays.points.len() as u32).filter(|&vertex| sharing.is_owned(vertex)).count() as u64)
//! })?;
//! let alone = Mesher::new().max_size(0.4).levels(2).generate(&part)?;
//! assert_eq!(owned.iter().sum::<u64>(), alone.stream().totals().vertices);
//! # Ok::<(), Error>(())
//! ```
//!
//! # How a mesh is made
//!
//! Rank 0 makes a **coarse mesh** and partitions it. Each rank then refines its part: a coarse edge
//! is cut into n **pieces**, a coarse tet into n³ children, and new vertices on the boundary are
//! moved onto the geometry. Fine ids are computed from coarse ids, so refinement needs no messages,
//! and the mesh is the same, bit by bit, for any number of ranks and threads. Other
//! [methods](Method) mesh the inside of the parts by the size field instead.
//!
//! A refined mesh is not stored. A part is a **stream** ([`mesh::MeshStream`]) that computes blocks
//! of tets when they are read. [`Generated::arrays`] copies all of it, [`mesh::blocks`] reads it in
//! blocks of bounded size, and the writers of [`files`] read it directly. So meshes of 10⁹ tets fit
//! a laptop.
//!
//! # Where to go
//!
//! | you want | look at |
//! |---|---|
//! | sizes, refinement, methods | [`Mesher`], [`size`] |
//! | elements assembled across ranks | [`mesh::Sharing`], [`Generated::with_edges_and_faces`] |
//! | one layer of tets of other parts | [`Generated::ghosts`] |
//! | multigrid | [`Generated::hierarchy`], [`Hierarchy`] |
//! | tets moved to other ranks | [`repartition`] |
//! | the patches of a boundary name | [`mesh::Names::patches_named`] |
//! | files, with a solution | [`files`], [`files::vtu::write_fields`] |
//! | MPI, in a program of your own | [`comm::mpi`] |
//! | a progress bar, a cancel button | [`progress`] |
//! | to match on what went wrong | [`error`], [`error::HasKind`] |
//!
//! Complete programs are in the folder `examples`: Poisson's equation across ranks, a multigrid
//! cycle, sizes by a function, heat conduction in a program that initialises MPI itself.
//!
//! The library prints nothing. [`Geometry::notes`] has the warnings of a geometry's text and what
//! was repaired while reading a file: a program should show them.
//!
//! # What is guaranteed
//!
//! Every tet is positively oriented in exact arithmetic, also after refinement. Each boundary
//! vertex is on its patch, curve or corner, within a tolerance that the report states. The parts
//! fit together. If a mesh does not pass the check, an error is returned instead. *Not* guaranteed
//! are lower bounds on angles: thin regions and sharp edges of the geometry cause flat tets.
//! [`Mesher::tets`] states how close the number of tets comes to its target.
#![forbid(unsafe_code)]

pub mod files;
mod ground;
mod mesher;
mod parallel;
mod pipeline;

pub use brep::{OverlapTo, Unit};
pub use csg::{self, Point, Vector};
pub use files::arrays::{MeshArrays, SurfaceArrays};
pub use pipeline::error::Error;
pub use pipeline::{Generated, Geometry, Hierarchy, InputSettings, Mesher, Method};

/// Ranks: threads of this process, or processes of an MPI job.
pub mod comm {
    pub use crate::ground::comm::group::Group;
    pub use crate::ground::comm::{CommError, Communicator, Fold, Rank, grouped, mpi, thread};
}

/// Meshes: ids and entities, parts as arrays, blocks or streams, shared vertices and ghosts.
pub mod mesh {
    pub use crate::ground::mesh::ghosts::{By, GhostTet, GhostVertex, Ghosts, RankLists};
    pub use crate::ground::mesh::periodic::{Link, Pair, Pairs, PeriodicMap};
    pub use crate::ground::mesh::stream::{
        BoundaryBlock, Counts, LocalBlock, MeshStream, NO_TET, SingularTags, TetBlock, VertexBlock,
    };
    pub use crate::ground::mesh::{
        Arrays, BoundaryTriangle, Class, EdgeId, FaceId, GlobalId, Label, Mesh, Names, Neighbour, Order,
        QualitySummary, Segment, Sharing, TET_EDGES, TET_FACES, TetId, VertexId, Watched, blocks,
    };
    pub use crate::parallel::distribution::{BareMesh, BoundaryFace, DistMesh, Shared, Totals};
    pub use crate::parallel::halo::{WithHalo, halo};
    pub use crate::parallel::migrate::BareStream;
    pub use crate::parallel::refine::RefinedMesh;
    pub use csg::{BodyId, CornerId, CurveId, PatchId};
}

/// Element sizes, and the effort of mesh improvement.
pub mod size {
    pub use crate::ground::size::{Closeness, Preset, SizeFunction, SizeSettings, Source};
    pub use crate::mesher::improve::Effort;
}

/// The memory and the processor time of this process and machine.
pub mod memory {
    pub use crate::ground::memory::{
        allocation_may_fail, available_bytes, cpu_seconds, machine, peak_bytes, sized,
    };
}

/// Progress reports and cancellation of a run.
pub mod progress {
    pub use crate::ground::progress::{Cancelled, Observer, Progress, Silent, Stage, StageTime, Work};
}

/// The errors, by stage.
pub mod error {
    pub use crate::files::WriteError;
    pub use crate::files::arrays::ArrayError;
    pub use crate::files::elmer::LoadError;
    pub use crate::files::input::ReadError;
    pub use crate::files::vtu::FieldError;
    pub use crate::ground::comm::CommError;
    pub use crate::ground::comm::launch::LaunchError;
    pub use crate::ground::error::{ErrorKind, HasKind};
    pub use crate::ground::mesh::UnknownName;
    pub use crate::ground::mesh::periodic::MapError;
    pub use crate::ground::progress::Cancelled;
    pub use crate::ground::size::BackgroundError;
    pub use crate::mesher::facets::FacetError;
    pub use crate::mesher::surface::SurfaceError;
    pub use crate::mesher::surface::curves::CurveError;
    pub use crate::mesher::volume::{SurfaceFaults, VolumeError};
    pub use crate::parallel::decompose::{CutError, LooseEdge, TooManyParts};
    pub use crate::parallel::distribution::{CheckError, DistError, NumberError};
    pub use crate::parallel::halo::HaloError;
    pub use crate::parallel::migrate::MigrateError;
    pub use crate::parallel::partition::PartitionError;
    pub use crate::parallel::refine::RefineError;
    pub use crate::parallel::refine::parents::LevelError;
    pub use crate::parallel::repartition::RepartitionError;
    pub use crate::parallel::skin::FillError;
    pub use crate::pipeline::CoarseError;
    pub use crate::pipeline::close::TooClose;
    pub use crate::pipeline::error::{Error, InputError, InvalidMesh, RequestError};
    pub use crate::pipeline::room_error::RoomError;
    pub use csg::FeatureError;
    pub use csg::language::Diagnostics;
}

/// All settings and results of a [`Mesher`].
pub mod run {
    pub use crate::mesher::facets::{MergedEdge, MergedFace, MergedSmall, MergedTip, NamedFace};
    pub use crate::parallel::decompose::{Candidates, CutPlane, PlanSettings};
    pub use crate::parallel::interfaces::InterfaceReport;
    pub use crate::parallel::partition::Metrics;
    pub use crate::parallel::refine::PeriodicCheck;
    pub use crate::parallel::refine::lattice::MAX_PIECES;
    pub use crate::parallel::skin::DeliveredSizes;
    pub use crate::pipeline::decompose::{Planned, planned};
    pub use crate::pipeline::inspect::{
        BodyLine, CurveLine, Inspection, PatchLine, PeriodicLine, SingularLine,
    };
    pub use crate::pipeline::part::{Balance, Evened, Part, balance};
    pub use crate::pipeline::result::StraightEdge;
    pub use crate::pipeline::target::Outcome;
    pub use crate::pipeline::{
        CoarseReport, CoarseResult, CoarseSettings, Cut, CutCusp, CutSettings, Disk, Entities, FlatPlace,
        GenerateSettings, Level, Levels, Refused, SharpPlace, SharpPlaces, ThinRegions, Wanted, generate,
    };
}

/// Repartitioning: new destinations of tets, and their migration.
pub mod repartition {
    pub use crate::parallel::migrate::{MoveSettings, Moved, bare, migrate, migrate_bare};
    pub use crate::parallel::repartition::metrics::{Metrics, measure};
    pub use crate::parallel::repartition::{
        Geometric, Method, Neighbours, repartition, repartition_weighted,
    };
    pub use crate::pipeline::{Repartitioned, repartition as repartition_files};
}

/// Checks of meshes, as streams.
pub mod check {
    pub use crate::parallel::check::{
        Checksum, Extreme, Fault, OffSurface, PartReport, Settings, ShapeReport, check, check_and_sum,
        check_part, check_part_and_sum, checksum, checksum_of_all,
    };
}

/// Shape measures of meshes, as several programs define them.
pub mod quality {
    pub use crate::pipeline::quality::{Quality, histograms, measure, table};
}

/// Separate stages for the benches and tests of this project, without any promise of stability.
#[doc(hidden)]
pub mod internals {
    pub use crate::files::plain::PlainPart;
    pub use crate::ground::comm::conformance;
    pub use crate::ground::kernel::predicates::{Sign, orient3d};
    pub use crate::ground::kernel::random::Random;
    pub use crate::ground::kernel::simplex;
    pub use crate::ground::mesh::{Touching, topology};
    pub use crate::ground::projector::{BrepProjector, FacetProjector, Projector};
    pub use crate::ground::size::{GeometricSamples, GeometricSize, SizeField, UniformSize};
    pub use crate::mesher::model::CsgModel;
    pub use crate::mesher::{facets, improve, surface, volume};
    pub use crate::parallel::{distribution, migrate, partition, refine, repartition};
    pub use crate::pipeline::coarse_mesh::CoarseMesh;
    pub use crate::pipeline::facet_model::FacetSolid;
    pub use crate::pipeline::model::{GivenMesh, Model};
    pub use crate::pipeline::retries::Budget;
    pub use crate::pipeline::target::mesh_to_target;
}
