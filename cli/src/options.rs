//! The command line. Only this file and `commands/extras.rs` use clap.

use crate::commands::long_version;
use clap::{Args, Parser, Subcommand, ValueEnum};
use clap_complete::Shell;
use std::path::PathBuf;
use tetmill::files::picture::Cut;
use tetmill::mesh::Order;
use tetmill::run::MAX_PIECES;
use tetmill::size::{Effort, Preset};

/// From solid geometry to partitioned tetrahedral meshes, in parallel.
#[derive(Parser, Debug)]
#[command(name = "tetmill", version, long_version = long_version(), about)]
#[command(max_term_width = 100, arg_required_else_help = true)]
pub struct Cli {
    /// The command to run.
    #[command(subcommand)]
    pub command: Command,
}

/// The commands.
#[derive(Subcommand, Debug)]
pub enum Command {
    /// Mesh a geometry or surface, or read a mesh; partition, refine, check and write it
    #[command(after_help = STATUS)]
    Generate(Generate),
    /// Write only the coarse mesh, in one part and one file
    #[command(after_help = STATUS)]
    Mesh(MeshFile),
    /// Change the number of parts of an Elmer mesh, check and write it
    ///
    /// Reads tetrahedral Elmer meshes of tetmill or ElmerGrid, without their halo elements. Each
    /// rank reads some of the parts; no rank holds the whole mesh. These files do not contain the
    /// curves and surfaces of the geometry, so refining the mesh again would not snap vertices to
    /// it.
    #[command(after_help = STATUS)]
    Repartition(Repartition),
    /// Cut a geometry by planes into parts with equal shares of the tets, and write it as .geo
    #[command(after_help = STATUS)]
    Decompose(Decompose),
    /// Show a mesh in the browser, or write it as a page that works offline
    ///
    /// Meshes are read as they are; geometries and surfaces are meshed first. The page is served on
    /// the loopback address of this machine only, at an address that others cannot guess, until
    /// Ctrl-C.
    #[command(after_help = STATUS)]
    View(View),
    /// Show the bodies, corners, curves, patches, boundary numbers and names of a geometry
    Inspect(Inspect),
    /// Check a written Elmer mesh and list every fault with its ids and coordinates
    #[command(after_help = "Exit status: 0 no faults; 1 faults found; 2 the files cannot be read.")]
    Check(Check),
    /// Compare the element quality of tetrahedral meshes, also of other programs
    #[command(
        after_help = "Exit status: 0 no inverted tets, nor curved ones that are not valid; 1 such tets found; 2 a file cannot be read."
    )]
    Quality(Quality),
    /// Print the completion script of a shell
    ///
    /// The documentation of the shell describes where such scripts are installed. For bash, for
    /// example: tetmill completions bash > ~/.local/share/bash-completion/completions/tetmill
    Completions(Completions),
    /// Print the manual page, or write one page for each command
    Man(Man),
}

const STATUS: &str = "Exit status: 0 success; 2 bad input, or a geometry that cannot be meshed; \
3 no valid mesh found; 4 not enough memory or disk space; 5 a rank failed; 130 cancelled by Ctrl-C or SIGTERM.";

/// Options for the element sizes.
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
    /// Smallest element size due to curvature and short curves (length)
    #[arg(long, value_name = "H", value_parser = positive)]
    pub minh: Option<f64>,
    /// Growth of the size per unit of distance, at most 10 [default: set by --preset]
    #[arg(long, value_name = "G", value_parser = positive)]
    pub grading: Option<f64>,
    /// Largest element size in thin regions, relative to their thickness: 1 gives one layer of good
    /// tets, 0.5 two; 0 leaves thin regions as they are [default: set by --preset]
    #[arg(long, value_name = "K", value_parser = closeness)]
    pub closeness: Option<f64>,
    /// Mesh-size file of NETGEN: a count and lines `x y z h`, then a count and lines `x1 y1 z1 x2
    /// y2 z2 h`
    #[arg(long, value_name = "FILE")]
    pub mesh_size_file: Option<PathBuf>,
    /// Effort of mesh improvement: quick, standard, careful or thorough [default: careful up to
    /// 100,000 tets, then standard]
    #[arg(long, value_name = "NAME")]
    pub effort: Option<Effort>,
    /// Number of coarse tets: COUNT to 1.5 COUNT, or the least that the geometry allows
    #[arg(long, value_name = "COUNT", value_parser = count)]
    pub coarse: Option<u64>,
}

/// Options for the order of the elements.
#[derive(Args, Debug, Clone)]
pub struct OrderOptions {
    /// Order of the elements: 1, or 2 for tets of ten nodes, curved along the geometry; each is
    /// proved valid
    #[arg(long, value_name = "ORDER", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=2))]
    pub order: u32,
    /// With --order 2: leave edges straight, off the surface, where the tets beside them would not
    /// be valid otherwise; the report lists them
    #[arg(long)]
    pub allow_off_surface: bool,
}

impl OrderOptions {
    /// The order of the elements.
    pub fn order(&self) -> Order {
        Order::of_degree(self.order).expect("one of the orders that the option takes")
    }
}

/// Options for the input.
#[derive(Args, Debug, Clone)]
pub struct InputOptions {
    /// A geometry (.geo, NETGEN CSG); CAD files (.step, .stp; .brep, OpenCASCADE) or surfaces
    /// (.stl, .off, .obj, .ply, .poly, .smesh), of which several become one geometry; or a mesh,
    /// used unchanged (.msh, .vol, .mesh, .meshb, .vtu, .pvtu, .ele, an Elmer folder)
    #[arg(required = true, value_name = "INPUT")]
    pub files: Vec<PathBuf>,
    /// Keep the triangles of input surfaces; by default they are remeshed
    #[arg(long)]
    pub keep_surface: bool,
    /// Keep edges and faces of CAD files that are far smaller than the elements; by default they
    /// are merged into their neighbours, with a note
    #[arg(long)]
    pub keep_small: bool,
    /// Take surfaces of a .geo file that are of one kind and at most this far apart as one surface
    /// (length) [default: 1e-8 of the size of the geometry]
    #[arg(long, value_name = "LENGTH", value_parser = positive)]
    pub merge: Option<f64>,
    /// Unit of lengths for a STEP file: m, cm, mm, um, km, in, ft, or that of the file
    #[arg(long, value_name = "UNIT", default_value = "file", hide_default_value = true)]
    pub unit: tetmill::Unit,
    /// Mesh this solid of a CAD file, by its name or number (tetmill inspect lists them); give the
    /// option again for others [default: all]
    #[arg(long = "solid", value_name = "NAME")]
    pub solids: Vec<String>,
    /// Give the common part of solids of a CAD file that overlap to the one that is first or last
    /// in the file, or the smaller one, and cut it out of the others: first, last, smaller
    /// [default: they are refused]
    #[arg(long, value_name = "SOLID")]
    pub overlap_to: Option<tetmill::OverlapTo>,
    /// Angle between facets that separates two patches of an input surface (degrees) [default: 40]
    #[arg(long, value_name = "DEGREES", value_parser = angle)]
    pub feature_angle: Option<f64>,
}

/// Options of the commands that write a partitioned mesh.
#[derive(Args, Debug)]
pub struct RunOptions {
    /// Total number of threads [default: number of cores]
    #[arg(short, long, value_name = "THREADS", value_parser = clap::value_parser!(u32).range(1..))]
    pub threads: Option<u32>,
    /// Output formats, separated by commas
    #[arg(short, long, value_enum, value_delimiter = ',', default_value = "elmer")]
    pub format: Vec<Format>,
    /// Where VTU output stores boundary triangles [default: beside]
    #[arg(long, value_enum, value_name = "WHERE")]
    pub boundary: Option<Boundary>,
    /// Write one layer of neighbouring tets with each part: halo elements in Elmer, ghost cells in
    /// VTU, ghost elements in msh4 and msh4-parts
    #[arg(long, value_enum, value_name = "BY")]
    pub halo: Option<Halo>,
    /// Write the adjacency of the whole mesh to the HDF5 file: edges, faces, which of them each tet
    /// has, and the lists of what each edge, face and vertex belongs to. Takes 500 bytes of memory
    /// and 400 of disk for each tet
    #[arg(long)]
    pub adjacency: bool,
    /// Write msh4 and msh4-parts as text [default: binary]
    #[arg(long)]
    pub ascii: bool,
    /// Write an Elmer mesh even if periodic faces and their copies are in different parts, where
    /// Elmer's `Periodic BC` gives wrong results
    #[arg(long)]
    pub allow_split_periodic: bool,
    /// Read the written Elmer mesh back and check it
    #[arg(long)]
    pub check: bool,
    /// Write a report as JSON; - is the standard output (the summary then goes to the standard
    /// error)
    #[arg(long, value_name = "FILE.json")]
    pub report: Option<PathBuf>,
    /// Print errors only
    #[arg(short, long)]
    pub quiet: bool,
}

/// `tetmill generate`
#[derive(Args, Debug)]
pub struct Generate {
    /// The input
    #[command(flatten)]
    pub input: InputOptions,
    /// Output folder [default: name of the first input without its extension, in the current
    /// folder]
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,
    /// How the fine mesh is made
    #[arg(short, long, value_enum, default_value_t = Method::Refine)]
    pub method: Method,
    /// Number of in-process ranks [default: 1; under mpirun the MPI ranks are used]
    #[arg(short = 'n', long, value_name = "RANKS", value_parser = clap::value_parser!(u32).range(1..))]
    pub ranks: Option<u32>,
    /// Number of parts [default: number of ranks]; under mpirun, other numbers are distributed over
    /// the ranks
    #[arg(long, value_name = "P", value_parser = clap::value_parser!(u32).range(1..))]
    pub parts: Option<u32>,
    /// Total number of tets, such as 1e9: gives COUNT to 1.3 COUNT; sets --coarse and --pieces
    #[arg(short, long, value_name = "COUNT", value_parser = count, conflicts_with_all = ["coarse", "levels", "pieces"])]
    pub elements: Option<u64>,
    /// Levels of uniform refinement; each splits a tet into eight
    #[arg(long, value_name = "L", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=i64::from(MAX_PIECES.ilog2())))]
    pub levels: u32,
    /// Split each coarse edge into N, so each coarse tet into N³. Unlike with --levels, N need not
    /// be a power of two
    #[arg(long, value_name = "N", conflicts_with = "levels", value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_PIECES)))]
    pub pieces: Option<u32>,
    /// Levels of uniform refinement of the tets that ranks made (methods surface and decompose);
    /// vertices on the boundary move to the geometry. All sizes are those before
    #[arg(long, value_name = "L", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=i64::from(MAX_PIECES.ilog2())))]
    pub refine: u32,
    /// Split all octahedra of a coarse tet along one diagonal (method refine), so that the tets of
    /// each level lie in those of the level before; the angles are hardly smaller
    #[arg(long)]
    pub nested: bool,
    /// How planes are chosen
    #[command(flatten)]
    pub planes: PlaneOptions,
    /// Memory for the fine mesh on each machine (bytes, such as 8e9) [default: the free memory]. If
    /// it does not fit, coordinates inside coarse tets are recomputed in each pass
    #[arg(long, value_name = "BYTES", value_parser = count)]
    pub memory: Option<u64>,
    /// Order of the elements
    #[command(flatten)]
    pub order: OrderOptions,
    /// Sizes of the coarse mesh
    #[command(flatten)]
    pub size: SizeOptions,
    /// Draw the mesh, coloured by part, or by patch if there is one part; - is the standard output
    #[arg(long, value_name = "FILE.png")]
    pub picture: Option<PathBuf>,
    /// Draw only the tets behind a plane, given by a point and a normal
    #[arg(long, value_name = "X,Y,Z,NX,NY,NZ", value_parser = cut, allow_hyphen_values = true, requires = "picture")]
    pub cut: Option<Cut>,
    /// Write a page with the report, pictures, and the mesh to look at; it works offline
    #[arg(long, value_name = "FILE.html")]
    pub report_html: Option<PathBuf>,
    /// Show the mesh in the browser when it is written, until Ctrl-C; more than a million tets are
    /// shown coarser, with the finest ones at a cut
    #[arg(long)]
    pub view: bool,
    /// Port of the viewer, for a tunnel from another machine; no browser is started [default: any
    /// free port]
    #[arg(long, value_name = "N", requires = "view")]
    pub port: Option<u16>,
    /// Output and report
    #[command(flatten)]
    pub run: RunOptions,
}

/// `tetmill view`
#[derive(Args, Debug)]
pub struct View {
    /// The input
    #[command(flatten)]
    pub input: InputOptions,
    /// Write one page that works offline instead of serving it, with at most 200,000 tets inside; -
    /// is the standard output
    #[arg(short, long, value_name = "PAGE.html", conflicts_with = "port")]
    pub output: Option<PathBuf>,
    /// Number of parts of a geometry [default: 1]
    #[arg(short = 'n', long, value_name = "RANKS", value_parser = clap::value_parser!(u32).range(1..))]
    pub ranks: Option<u32>,
    /// Levels of uniform refinement of a geometry
    #[arg(long, value_name = "L", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=i64::from(MAX_PIECES.ilog2())))]
    pub levels: u32,
    /// Sizes of the mesh of a geometry
    #[command(flatten)]
    pub size: SizeOptions,
    /// Port of the viewer, for a tunnel from another machine; no browser is started [default: any
    /// free port]
    #[arg(long, value_name = "N")]
    pub port: Option<u16>,
    /// Number of threads [default: number of cores]
    #[arg(short, long, value_name = "THREADS", value_parser = clap::value_parser!(u32).range(1..))]
    pub threads: Option<u32>,
    /// Print the address and errors only
    #[arg(short, long)]
    pub quiet: bool,
}

/// `tetmill repartition`
#[derive(Args, Debug)]
pub struct Repartition {
    /// Folder of the mesh: a partitioning.M, or the folder that contains one partitioning.M or
    /// mesh.*
    pub directory: PathBuf,
    /// Number of parts, each on an in-process rank [default under mpirun: the MPI ranks; other
    /// numbers are distributed over them]
    #[arg(short = 'n', long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub parts: Option<u32>,
    /// Output folder
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// How tets are assigned to parts [default: graph, if built with METIS]
    #[arg(short, long, value_enum)]
    pub method: Option<PartitionMethod>,
    /// Output and report
    #[command(flatten)]
    pub run: RunOptions,
}

/// How tets are assigned to parts.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum PartitionMethod {
    /// Equal segments of a Hilbert curve: balanced to one tet, fast
    Curve,
    /// The same, smoothed: fewer faces between parts, balanced to one percent
    SmoothedCurve,
    /// Recursive bisection across the longest side: balanced to one tet
    Bisection,
    /// The same, smoothed: fewer faces between parts, balanced to one percent
    SmoothedBisection,
    /// METIS on clusters of tets, smoothed: the fewest faces between parts, balanced to one percent
    Graph,
}

/// `tetmill mesh`
#[derive(Args, Debug)]
pub struct MeshFile {
    /// The input
    #[command(flatten)]
    pub input: InputOptions,
    /// Output file; its extension selects the format: .vtu, .msh (Gmsh), .mesh (Medit), .vol
    /// (NETGEN), .inp (Abaqus, CalculiX), .off; - is the standard output
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// Where .vtu output stores boundary triangles [default: beside]
    #[arg(long, value_enum, value_name = "WHERE")]
    pub boundary: Option<Boundary>,
    /// Format of the output file; required for - and pipes
    #[arg(short, long, value_enum)]
    pub format: Option<FileFormat>,
    /// Order of the elements
    #[command(flatten)]
    pub order: OrderOptions,
    /// Sizes of the mesh
    #[command(flatten)]
    pub size: SizeOptions,
    /// Number of threads [default: number of cores]
    #[arg(short, long, value_name = "THREADS", value_parser = clap::value_parser!(u32).range(1..))]
    pub threads: Option<u32>,
    /// Write a report as JSON; - is the standard output (the summary then goes to the standard
    /// error)
    #[arg(long, value_name = "FILE.json")]
    pub report: Option<PathBuf>,
    /// Draw the mesh; - is the standard output
    #[arg(long, value_name = "FILE.png")]
    pub picture: Option<PathBuf>,
    /// Draw only the tets behind a plane, given by a point and a normal
    #[arg(long, value_name = "X,Y,Z,NX,NY,NZ", value_parser = cut, allow_hyphen_values = true, requires = "picture")]
    pub cut: Option<Cut>,
    /// Print errors only
    #[arg(short, long)]
    pub quiet: bool,
}

/// `tetmill decompose`
#[derive(Args, Debug)]
pub struct Decompose {
    /// The input
    #[command(flatten)]
    pub input: InputOptions,
    /// Output file (.geo); - is the standard output
    #[arg(short, long, value_name = "FILE.geo")]
    pub output: PathBuf,
    /// Number of parts
    #[arg(short = 'n', long, value_name = "P", value_parser = clap::value_parser!(u32).range(1..))]
    pub parts: u32,
    /// How planes are chosen
    #[command(flatten)]
    pub planes: PlaneOptions,
    /// Number of subdivisions planned for each coarse edge: planes keep the distance of a fine edge
    /// from faces, curves and corners
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_PIECES)))]
    pub pieces: u32,
    /// Sizes of the coarse mesh used to choose the planes
    #[command(flatten)]
    pub size: SizeOptions,
    /// Print errors only
    #[arg(short, long)]
    pub quiet: bool,
}

/// Options for the planes that cut a geometry.
#[derive(Args, Debug, Clone)]
pub struct PlaneOptions {
    /// Candidate planes
    #[arg(long, value_enum, default_value_t = Planes::Best)]
    pub planes: Planes,
    /// Cut by the planes in this file instead: a point and a normal on each line; each plane cuts
    /// all pieces it meets
    #[arg(long, value_name = "FILE")]
    pub planes_from: Option<PathBuf>,
}

/// Sets of candidate planes.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Planes {
    /// All of the following except median
    Best,
    /// Perpendicular to the coordinate axes
    Axes,
    /// Perpendicular to the principal axes of each piece
    Principal,
    /// In random directions
    Random,
    /// Median cut across the longest side, without regard to the geometry
    Median,
}

/// `tetmill inspect`
#[derive(Args, Debug)]
pub struct Inspect {
    /// The input
    #[command(flatten)]
    pub input: InputOptions,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}

/// `tetmill check`
#[derive(Args, Debug)]
pub struct Check {
    /// Folder of an Elmer mesh: mesh.* or partitioning.N
    pub directory: PathBuf,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}

/// `tetmill quality`
#[derive(Args, Debug)]
pub struct Quality {
    /// Meshes: .vtu, .pvtu, .msh (Gmsh), .vol (NETGEN), .mesh or .meshb (Medit), .ele (TetGen), or
    /// the folder of an Elmer mesh
    #[arg(required = true)]
    pub meshes: Vec<PathBuf>,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
    /// Draw histograms of the dihedral angles and of NETGEN's badness; - is the standard output
    #[arg(long, value_name = "FILE.svg")]
    pub picture: Option<PathBuf>,
}

/// `tetmill completions`
#[derive(Args, Debug)]
pub struct Completions {
    /// The shell
    pub shell: Shell,
}

/// `tetmill man`
#[derive(Args, Debug)]
pub struct Man {
    /// Folder for the pages tetmill.1, tetmill-generate.1, …; without it the page of tetmill is
    /// printed
    #[arg(value_name = "DIR")]
    pub directory: Option<PathBuf>,
}

/// How the fine mesh is made.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Partition the coarse mesh and refine it uniformly, with boundary vertices on the geometry
    Refine,
    /// Partition the coarse mesh, refine the surface of each part, and mesh its inside by the size
    /// field
    Surface,
    /// Cut the geometry by planes and mesh each piece
    Decompose,
}

/// Which tets of other parts are written with a part.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Halo {
    /// Tets that share a face with the part
    Faces,
    /// Tets that share a vertex with the part
    Vertices,
}

/// Where VTU output stores boundary triangles.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Boundary {
    /// In the same file after the tets, with BoundaryId: for meshio and scikit-fem
    In,
    /// In separate files, NAME.boundary.vtu or .pvtu: for ParaView and MFEM
    Beside,
}

/// Output formats.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// partitioning.N/part.K.*, ready for ElmerSolver_mpi
    Elmer,
    /// VTK: one .vtu for each part and a .pvtu
    Vtu,
    /// Gmsh, DIR/NAME.msh: all parts joined in one text file, for most readers
    Msh,
    /// Gmsh 4.1, DIR/NAME.msh: all parts in one file, as partitions with ghosts
    Msh4,
    /// Gmsh 4.1, DIR/NAME_1.msh and so on, one file for each part, with ghosts
    Msh4Parts,
    /// Medit, DIR/NAME.mesh: all parts in one file
    Medit,
    /// NETGEN, DIR/NAME.vol: all parts in one file
    Vol,
    /// Abaqus and CalculiX, DIR/NAME.inp: all parts in one file
    Inp,
    /// MFEM, parallel: DIR/NAME.000000 and so on, one file for each part
    Mfem,
    /// HDF5, DIR/NAME.h5 and DIR/NAME.xdmf: all parts in one file for ParaView, DOLFINx, PETSc
    Hdf5,
    /// Geomview OFF: the boundary, coloured by part
    Geomview,
    /// Nothing
    None,
}

/// Formats of a single output file.
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
    /// Abaqus and CalculiX
    Inp,
    /// Geomview OFF: the boundary only
    Off,
}

/// A positive finite length.
fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if number > 0.0 && number.is_finite() => Ok(number),
        _ => Err("expected a positive number".into()),
    }
}

/// A size relative to the thickness of a thin region.
fn closeness(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if number >= 0.0 && number.is_finite() => Ok(number),
        _ => Err("expected a number that is not negative".into()),
    }
}

/// An angle between facets.
fn angle(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if number > 0.0 && number <= 180.0 => Ok(number),
        _ => Err("expected an angle above 0 and up to 180 degrees".into()),
    }
}

/// A plane, as six numbers.
fn cut(text: &str) -> Result<Cut, String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|n| n.trim().parse::<f64>()).collect();
    match numbers.as_deref() {
        Ok(&[x, y, z, nx, ny, nz]) if [nx, ny, nz] != [0.0; 3] => {
            Ok(Cut { point: [x, y, z], normal: [nx, ny, nz] })
        }
        _ => Err("expected six numbers: a point, and a normal that is not zero".into()),
    }
}

/// A count, also written as 1e9 or 2.5e6.
fn count(text: &str) -> Result<u64, String> {
    let text = text.replace('_', "");
    if let Ok(number) = text.parse::<u64>() {
        return if number > 0 { Ok(number) } else { Err("expected at least 1".into()) };
    }
    match text.parse::<f64>() {
        // Counts above 2^53 are not exact in a float, and out of reach.
        Ok(number) if (1.0..9e15).contains(&number) => Ok(number.round() as u64),
        _ => Err("expected a count such as 50000 or 1e9".into()),
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
