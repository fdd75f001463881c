//! The command line: the only file that knows clap.

use clap::{Args, Parser, Subcommand, ValueEnum};
use std::path::PathBuf;
use tetmill::improve::Effort;
use tetmill::picture::Cut;
use tetmill::refine::lattice::MAX_PIECES;
use tetmill::size::Preset;

/// From solid geometry to partitioned tetrahedral meshes, in parallel.
#[derive(Parser, Debug)]
#[command(name = "tetmill", version, about, max_term_width = 100, arg_required_else_help = true)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The commands.
#[derive(Subcommand, Debug)]
pub enum Command {
    /// Make a partitioned mesh: mesh the geometry or surface, or take a mesh; partition, refine, check, write
    #[command(after_help = STATUS)]
    Generate(Generate),
    /// Make the coarse mesh alone, in one part and one file
    #[command(after_help = STATUS)]
    Mesh(MeshFile),
    /// Read a partitioned Elmer mesh, give its tets to another number of parts, check and write it
    ///
    /// Ours or ElmerGrid's, of tets; halo elements are left out. Each rank reads some of the parts; none sees the whole mesh. Such files tell nothing of the
    /// curves and surfaces of a geometry, so that refining the mesh again would not round it.
    #[command(after_help = STATUS)]
    Repartition(Repartition),
    /// Cut a geometry by planes into parts with equal shares of the tets, as a geometry
    #[command(after_help = STATUS)]
    Decompose(Decompose),
    /// Show the bodies, corners, curves, patches, boundary numbers and names of a geometry
    Inspect(Inspect),
    /// Check a written Elmer mesh: every fault, with ids and places
    #[command(after_help = "Exit status: 0 no fault, 1 faults were found, 2 the files cannot be read.")]
    Check(Check),
    /// Measure tetrahedral meshes of any program side by side
    #[command(after_help = "Exit status: 0 no inverted tets, 1 some mesh has them, 2 a file cannot be read.")]
    Quality(Quality),
}

const STATUS: &str = "Exit status: 0 done; 2 bad input, or a geometry refused with its place; \
3 no valid mesh reached; 4 memory or disk; 5 a rank failed.";

/// How the sizes are chosen.
#[derive(Args, Debug, Clone)]
pub struct SizeOptions {
    /// Fineness: very-coarse, coarse, moderate, fine or very-fine
    ///
    /// [default: moderate]
    #[arg(long, value_name = "NAME")]
    pub preset: Option<Preset>,
    /// Largest element size (length)
    #[arg(long, value_name = "H", value_parser = positive)]
    pub maxh: Option<f64>,
    /// Smallest element size that curvature and short curves may ask for (length)
    #[arg(long, value_name = "H", value_parser = positive)]
    pub minh: Option<f64>,
    /// Growth of the size per unit of distance, instead of the preset's
    #[arg(long, value_name = "G", value_parser = positive)]
    pub grading: Option<f64>,
    /// Largest element size in thin walls, in units of their thickness, instead of the preset's: 1 gives a layer of good
    /// tets, 0.5 two; 0 leaves thin walls as they are
    #[arg(long, value_name = "K", value_parser = closeness)]
    pub closeness: Option<f64>,
    /// NETGEN's mesh-size file: a count and lines `x y z h`, then a count and lines `x1 y1 z1 x2 y2 z2 h`
    #[arg(long, value_name = "FILE")]
    pub mesh_size_file: Option<PathBuf>,
    /// How much is done for better shapes: quick, standard, careful or thorough [default: careful up to 100,000 tets, then standard]
    #[arg(long, value_name = "NAME")]
    pub effort: Option<Effort>,
    /// Number of tets of the coarse mesh: COUNT to 1.5 COUNT, or the least that the geometry allows
    #[arg(long, value_name = "COUNT", value_parser = count)]
    pub coarse: Option<u64>,
}

/// What is meshed.
#[derive(Args, Debug, Clone)]
pub struct InputOptions {
    /// A geometry (.geo, NETGEN CSG), surfaces (.stl, .off, .obj, .ply, .poly, .smesh: several become
    /// several bodies), or a mesh (.msh, .vol, .mesh, .meshb, .vtu, .pvtu, .ele, an Elmer folder), which is taken as it is
    #[arg(required = true, value_name = "INPUT")]
    pub files: Vec<PathBuf>,
    /// Keep the triangles of surfaces as they are; else they are made anew by the sizes
    #[arg(long)]
    pub keep_surface: bool,
    /// Patches of surfaces end where their triangles turn by more than this (degrees) [default: 40]
    #[arg(long, value_name = "DEGREES", value_parser = angle)]
    pub feature_angle: Option<f64>,
}

/// How a command runs that writes a partitioned mesh.
#[derive(Args, Debug)]
pub struct RunOptions {
    /// Number of threads in all [default: the cores]
    #[arg(short, long, value_name = "THREADS", value_parser = clap::value_parser!(u32).range(1..))]
    pub threads: Option<u32>,
    /// What to write, with commas between, or none
    #[arg(short, long, value_enum, value_delimiter = ',', default_value = "elmer")]
    pub format: Vec<Format>,
    /// Where VTU has the triangles on boundaries [default: beside]
    #[arg(long, value_enum, value_name = "WHERE")]
    pub boundary: Option<Boundary>,
    /// Write with each part one layer of tets of the parts beside it: as Elmer's halo elements, or VTU's ghosts
    #[arg(long, value_enum, value_name = "BY")]
    pub halo: Option<Halo>,
    /// Write an Elmer mesh even if periodic faces and their images are in different parts, where Elmer's `Periodic BC` is wrong
    #[arg(long)]
    pub allow_split_periodic: bool,
    /// Read the written Elmer mesh again and check it
    #[arg(long)]
    pub check: bool,
    /// Write the summary as JSON; - is the standard output (the readable summary then goes to the standard error)
    #[arg(long, value_name = "FILE.json")]
    pub report: Option<PathBuf>,
    /// Say nothing but errors
    #[arg(short, long)]
    pub quiet: bool,
}

/// `tetmill generate`
#[derive(Args, Debug)]
pub struct Generate {
    /// What is meshed
    #[command(flatten)]
    pub input: InputOptions,
    /// Folder to write to [default: the first input's name without its ending, in the current folder]
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,
    /// How the fine mesh is made
    #[arg(short, long, value_enum, default_value_t = Method::Refine)]
    pub method: Method,
    /// Number of in-process ranks [default: 1; under mpirun the ranks are MPI's]
    #[arg(short = 'n', long, value_name = "RANKS", value_parser = clap::value_parser!(u32).range(1..))]
    pub ranks: Option<u32>,
    /// Number of parts to write [default: the ranks]; under mpirun more or fewer than these are dealt out to them
    #[arg(long, value_name = "P", value_parser = clap::value_parser!(u32).range(1..))]
    pub parts: Option<u32>,
    /// Number of tets wanted in all (1e9 is understood): COUNT to 1.3 COUNT; chooses --coarse and --pieces
    #[arg(short, long, value_name = "COUNT", value_parser = count, conflicts_with_all = ["coarse", "levels", "pieces"])]
    pub elements: Option<u64>,
    /// Levels of uniform refinement: each makes eight tets of one
    #[arg(long, value_name = "L", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=i64::from(MAX_PIECES.ilog2())))]
    pub levels: u32,
    /// Pieces of each coarse edge: makes N³ tets of one; a number beside 1, 2, 4, 8, … of levels
    #[arg(long, value_name = "N", conflicts_with = "levels", value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_PIECES)))]
    pub pieces: Option<u32>,
    /// How planes are chosen (method decompose)
    #[command(flatten)]
    pub planes: PlaneOptions,
    /// Memory for fine vertices on each machine (bytes, 8e9 is understood) [default: what it has left]: where all do not
    /// fit, those inside coarse tets are computed anew wherever they are needed
    #[arg(long, value_name = "BYTES", value_parser = count)]
    pub memory: Option<u64>,
    /// Sizes of the coarse mesh
    #[command(flatten)]
    pub size: SizeOptions,
    /// Draw the mesh: its parts in colours, or its patches if there is one; - is the standard output
    #[arg(long, value_name = "FILE.png")]
    pub picture: Option<PathBuf>,
    /// Draw only the tets behind a plane, given by a point on it and its normal
    #[arg(long, value_name = "X,Y,Z,NX,NY,NZ", value_parser = cut, allow_hyphen_values = true, requires = "picture")]
    pub cut: Option<Cut>,
    /// What is written, and what is told of it
    #[command(flatten)]
    pub run: RunOptions,
}

/// `tetmill repartition`
#[derive(Args, Debug)]
pub struct Repartition {
    /// Folder with the mesh: one partitioning.M in it, or that folder itself, with mesh.names beside; or mesh.*
    pub directory: PathBuf,
    /// Number of parts wanted, each on an in-process rank [default under mpirun: MPI's ranks; other numbers are dealt out to them]
    #[arg(short = 'n', long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub parts: Option<u32>,
    /// Folder to write to
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// How tets are given to parts [default: graph, in a build with METIS]
    #[arg(short, long, value_enum)]
    pub method: Option<PartitionMethod>,
    /// What is written, and what is told of it
    #[command(flatten)]
    pub run: RunOptions,
}

/// How tets are given to parts.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum PartitionMethod {
    /// Equal stretches of a Hilbert curve: balanced to one tet, fast
    Curve,
    /// The same with fewer faces between parts, balanced to one percent
    SmoothedCurve,
    /// Parts cut in two across their longest side, again and again: balanced to one tet
    Bisection,
    /// The same with fewer faces between parts, balanced to one percent
    SmoothedBisection,
    /// METIS on clusters of tets, then fewer faces between parts: the best, balanced to one percent
    Graph,
}

/// `tetmill mesh`
#[derive(Args, Debug)]
pub struct MeshFile {
    /// What is meshed
    #[command(flatten)]
    pub input: InputOptions,
    /// File to write; its ending names the format: .vtu, .msh (Gmsh), .mesh (Medit), .vol (NETGEN), .off; - is the standard output
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// Where a .vtu has the triangles on boundaries [default: beside]
    #[arg(long, value_enum, value_name = "WHERE")]
    pub boundary: Option<Boundary>,
    /// Format of the file, whatever its ending; needed with - and pipes
    #[arg(short, long, value_enum)]
    pub format: Option<FileFormat>,
    /// Sizes of the mesh
    #[command(flatten)]
    pub size: SizeOptions,
    /// Number of threads [default: the cores]
    #[arg(short, long, value_name = "THREADS", value_parser = clap::value_parser!(u32).range(1..))]
    pub threads: Option<u32>,
    /// Write the summary as JSON; - is the standard output (the readable summary then goes to the standard error)
    #[arg(long, value_name = "FILE.json")]
    pub report: Option<PathBuf>,
    /// Draw the mesh; - is the standard output
    #[arg(long, value_name = "FILE.png")]
    pub picture: Option<PathBuf>,
    /// Draw only the tets behind a plane, given by a point on it and its normal
    #[arg(long, value_name = "X,Y,Z,NX,NY,NZ", value_parser = cut, allow_hyphen_values = true, requires = "picture")]
    pub cut: Option<Cut>,
    /// Say nothing but errors
    #[arg(short, long)]
    pub quiet: bool,
}

/// `tetmill decompose`
#[derive(Args, Debug)]
pub struct Decompose {
    /// What is cut
    #[command(flatten)]
    pub input: InputOptions,
    /// File to write (.geo); - is the standard output
    #[arg(short, long, value_name = "FILE.geo")]
    pub output: PathBuf,
    /// Number of parts
    #[arg(short = 'n', long, value_name = "P", value_parser = clap::value_parser!(u32).range(1..))]
    pub parts: u32,
    /// How planes are chosen
    #[command(flatten)]
    pub planes: PlaneOptions,
    /// Pieces that each edge of the coarse mesh stands for: planes keep clear of what is nearer than the fine edges
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_PIECES)))]
    pub pieces: u32,
    /// Sizes of the coarse mesh that the planes are chosen by
    #[command(flatten)]
    pub size: SizeOptions,
    /// Say nothing but errors
    #[arg(short, long)]
    pub quiet: bool,
}

/// How the planes are chosen that cut a geometry.
#[derive(Args, Debug, Clone)]
pub struct PlaneOptions {
    /// Planes that are considered where the geometry is cut
    #[arg(long, value_enum, default_value_t = Planes::Best)]
    pub planes: Planes,
    /// Cut by the planes of this file instead: a line each, a point and a normal; each cuts all pieces that it meets
    #[arg(long, value_name = "FILE")]
    pub planes_from: Option<PathBuf>,
}

/// Which planes are considered.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Planes {
    /// All of the following, but the last
    Best,
    /// Across the axes
    Axes,
    /// Across the principal axes of each piece
    Principal,
    /// In random directions
    Random,
    /// Through the middle, across the longest side, whatever is there
    Median,
}

/// `tetmill inspect`
#[derive(Args, Debug)]
pub struct Inspect {
    /// What is looked at
    #[command(flatten)]
    pub input: InputOptions,
    /// As JSON
    #[arg(long)]
    pub json: bool,
}

/// `tetmill check`
#[derive(Args, Debug)]
pub struct Check {
    /// A folder with an Elmer mesh: mesh.* or partitioning.N
    pub directory: PathBuf,
    /// As JSON
    #[arg(long)]
    pub json: bool,
}

/// `tetmill quality`
#[derive(Args, Debug)]
pub struct Quality {
    /// Meshes: .vtu, .pvtu, .msh (Gmsh), .vol (NETGEN), .mesh or .meshb (Medit), .ele (TetGen), or the folder of an Elmer mesh
    #[arg(required = true)]
    pub meshes: Vec<PathBuf>,
    /// As JSON
    #[arg(long)]
    pub json: bool,
    /// Draw histograms of the angles and of NETGEN's badness; - is the standard output
    #[arg(long, value_name = "FILE.svg")]
    pub picture: Option<PathBuf>,
}

/// How the fine mesh is made.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Coarse mesh, partitioned, refined uniformly with boundary vertices on the geometry
    Refine,
    /// Coarse mesh, partitioned; the skins of the parts refined, and each meshed inside by the sizes
    Surface,
    /// Geometry cut by planes, each piece meshed
    Decompose,
}

/// Which tets of other parts are written with a part.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Halo {
    /// Those with a face in common with the part
    Faces,
    /// Those with a vertex in common with the part
    Vertices,
}

/// Where VTU files have the triangles on boundaries.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Boundary {
    /// Behind the tets in the same file, with BoundaryId: for meshio and scikit-fem
    In,
    /// In files of their own, NAME.boundary.vtu or .pvtu: for ParaView and MFEM
    Beside,
}

/// What is written.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// partitioning.N/part.K.*, ready for ElmerSolver_mpi
    Elmer,
    /// VTK: one .vtu for each part and a .pvtu
    Vtu,
    /// Gmsh, DIR/NAME.msh: all parts in one file
    Msh,
    /// Medit, DIR/NAME.mesh: all parts in one file
    Medit,
    /// NETGEN, DIR/NAME.vol: all parts in one file
    Vol,
    /// Geomview OFF: the boundary, one colour for each part
    Geomview,
    /// Nothing
    None,
}

/// A format of one file.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileFormat {
    /// VTK: FILE.vtu, and the boundary in FILE.boundary.vtu
    Vtu,
    /// Gmsh
    Msh,
    /// Medit
    Mesh,
    /// NETGEN
    Vol,
    /// Geomview OFF: the boundary alone
    Off,
}

/// A positive finite length.
fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if number > 0.0 && number.is_finite() => Ok(number),
        _ => Err("a positive number is needed".into()),
    }
}

/// A size in units of the thickness of a wall.
fn closeness(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if number >= 0.0 && number.is_finite() => Ok(number),
        _ => Err("a number that is not negative is needed".into()),
    }
}

/// An angle between facets.
fn angle(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if number > 0.0 && number <= 180.0 => Ok(number),
        _ => Err("an angle above 0 and up to 180 degrees is needed".into()),
    }
}

/// A plane as six numbers.
fn cut(text: &str) -> Result<Cut, String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|n| n.trim().parse::<f64>()).collect();
    match numbers.as_deref() {
        Ok(&[x, y, z, nx, ny, nz]) if [nx, ny, nz] != [0.0; 3] => {
            Ok(Cut { point: [x, y, z], normal: [nx, ny, nz] })
        }
        _ => Err("six numbers are needed: a point, and a normal that is not zero".into()),
    }
}

/// A count, also written as 1e9 or 2.5e6.
fn count(text: &str) -> Result<u64, String> {
    let text = text.replace('_', "");
    if let Ok(number) = text.parse::<u64>() {
        return if number > 0 { Ok(number) } else { Err("at least 1 is needed".into()) };
    }
    match text.parse::<f64>() {
        // Counts above 2^53 are not exact in a float, nor within reach.
        Ok(number) if (1.0..9e15).contains(&number) => Ok(number.round() as u64),
        _ => Err("a count such as 50000 or 1e9 is needed".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_read_as_people_write_them() {
        assert_eq!(count("1e9"), Ok(1_000_000_000));
        assert_eq!(count("2.5e6"), Ok(2_500_000));
        assert_eq!(count("1_000"), Ok(1000));
        assert!(count("0").is_err() && count("-3").is_err() && count("many").is_err());
    }

    #[test]
    fn the_command_line_is_consistent() {
        use clap::CommandFactory;
        Cli::command().debug_assert();
    }
}
