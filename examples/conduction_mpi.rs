//! Heat conduction in two materials, in a program that initialises MPI itself.
//!
//! ```sh
//! cargo build --release --features mpi --example conduction_mpi
//! mpirun -n 4 target/release/examples/conduction_mpi [FOLDER]
//! target/release/examples/conduction_mpi [FOLDER]    # without mpirun: four threads
//! ```
//!
//! A column of steel under wool. Its bottom has the temperature 0 (Dirichlet), heat enters through
//! its top (Neumann), nothing leaves through its sides. The exact temperature is linear in each
//! body, so linear elements have no error. The program writes the temperature, the heat flux of
//! each tet, and the largest difference of that flux to the neighbouring tets, also across ranks
//! (ghosts).

mod common;

use common::{assemble_with, conjugate_gradients, dot, gradients};
use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};
use tetmill::comm::mpi::{self, rsmpi};
use tetmill::comm::{CommError, Communicator, Rank, thread};
use tetmill::files::vtu::{self, Field, On};
use tetmill::mesh::{Arrays, By, EdgeId, Ghosts, TET_FACES};
use tetmill::{Generated, Geometry, Mesher};

type Failure = Box<dyn std::error::Error + Send + Sync>;

const COLUMN: &str = "
algebraic3d
solid bottom = plane (0, 0, 0; 0, 0, -1) -bcname=cold;
solid top = plane (0, 0, 2; 0, 0, 1) -bcname=heated;
solid column = orthobrick (0, 0, -1; 1, 1, 3) and bottom and top;
solid below = plane (0, 0, 1; 0, 0, 1);
solid lower = column and below;
solid upper = column and not below;
tlo lower -material=steel;
tlo upper -material=wool;
";
/// Heat that enters through a unit of area of the top.
const HEAT: f64 = 2.0;
const STEEL: f64 = 4.0;
const WOOL: f64 = 0.5;

fn exact(height: f64) -> f64 {
    HEAT * (height.min(1.0) / STEEL + (height - 1.0).max(0.0) / WOOL)
}

fn main() -> Result<(), Failure> {
    let folder = std::env::args().nth(1).map(PathBuf::from);
    let folder = folder.unwrap_or_else(|| std::env::temp_dir().join("tetmill_conduction"));
    if !mpi::launched() {
        return thread::run(4, |comm| run(comm, &folder))?.into_iter().collect();
    }
    // Without this the other ranks would wait without end for one that panics.
    mpi::abort_on_panic();
    let (universe, _) =
        rsmpi::initialize_with_threading(rsmpi::Threading::Funneled).ok_or("MPI is initialised already")?;
    // The messages of the program go through `world`, those of tetmill through a duplicate.
    run(&mpi::duplicate_of(&universe.world())?, &folder)
}

/// **Collective.** All errors that it returns are errors on all ranks, so none waits for another.
fn run(comm: &dyn Communicator, folder: &Path) -> Result<(), Failure> {
    // Rank 0 alone needs the geometry. `agree` makes an error of rank 0 one of all ranks.
    let geometry = comm.agree((comm.rank() == 0).then(|| Geometry::from_text(COLUMN)).transpose())?;
    for note in geometry.iter().flat_map(Geometry::notes) {
        eprintln!("{note}");
    }
    let mesh = Mesher::new().max_size(0.3).levels(1).generate_on(comm, geometry.as_ref())?;
    let (arrays, sharing) = (mesh.arrays(), mesh.sharing());

    let steel = mesh.names.bodies_named("steel")?;
    let conductivity = |tet: usize| if steel.contains(&arrays.tet_bodies[tet]) { STEEL } else { WOOL };
    let (matrix, mut load) = assemble_with(&arrays, conductivity, |_| 0.0);
    // A boundary triangle with a body on one side is on one rank. (Between two bodies it may be on
    // two, each with a tet beside it.)
    for triangle in on_patches(&mesh, &arrays, "heated")? {
        let [a, b, c] = triangle.map(|vertex| arrays.points[vertex as usize]);
        triangle.iter().for_each(|&vertex| load[vertex as usize] += HEAT * area(a, b, c) / 3.0);
    }
    sharing.sum(comm, &mut load)?;
    let mut fixed = vec![false; arrays.points.len()];
    on_patches(&mesh, &arrays, "cold")?.iter().flatten().for_each(|&vertex| fixed[vertex as usize] = true);
    // A rank may hold a vertex of the bottom without a triangle there.
    sharing.any(comm, &mut fixed)?;

    // The prescribed temperature is 0.
    let start = vec![0.0; arrays.points.len()];
    let (temperature, iterations) = conjugate_gradients(comm, &sharing, &matrix, &load, &fixed, start)?;
    let flux = |tet: usize| {
        let (gradients, _) = gradients(arrays.corners(tet));
        let value = |k: usize| temperature[arrays.tets[tet][k] as usize];
        [0, 1, 2].map(|axis| -conductivity(tet) * (0..4).map(|k| value(k) * gradients[k][axis]).sum::<f64>())
    };
    let flux: Vec<[f64; 3]> = (0..arrays.tets.len()).map(flux).collect();
    let jumps = jumps(comm, &mesh.ghosts(comm, By::Faces)?, &arrays, &flux)?;

    let off = arrays.points.iter().zip(&temperature).map(|(point, value)| (value - exact(point[2])).abs());
    let worst = [off.fold(0.0, f64::max), jumps.iter().copied().fold(0.0, f64::max)];
    let worst = comm
        .all_gather_one(worst)?
        .into_iter()
        .fold([0.0; 2], |a: [f64; 2], b| [a[0].max(b[0]), a[1].max(b[1])]);

    // Unknowns of quadratic elements: the vertices, then the edges. Ids have no gaps, and each edge
    // has one owner.
    let with_edges = mesh.with_edges_and_faces(comm)?;
    let edges = 0..with_edges.edges.len() as u32;
    let owned = edges.filter(|&edge| with_edges.owns_edge(EdgeId(edge))).count() as u64;
    let [edges] = comm.all_reduce_sum_u64([owned])?;
    assert_eq!(edges, with_edges.totals.edges);

    let fields = [
        Field { name: "temperature", on: On::Points, values: &temperature, components: 1 },
        Field { name: "flux", on: On::Cells, values: flux.as_flattened(), components: 3 },
        Field { name: "jump", on: On::Cells, values: &jumps, components: 1 },
    ];
    let written = vtu::write_fields(comm, mesh.stream(), &mesh.names, &folder.join("column"), &fields)?;
    if comm.rank() == 0 {
        println!("{} ranks, {} tets, {iterations} iterations", comm.size(), mesh.check.tets);
        println!("error {:.1e}, largest jump of the flux {:.1e}", worst[0], worst[1]);
        println!("quadratic elements: {} unknowns", with_edges.totals.vertices + edges);
        println!("{} files in {}", written.files, folder.display());
    }
    assert!(worst.iter().all(|&worst| worst < 1e-7), "linear elements are exact here: {worst:?}");
    Ok(())
}

/// The triangles of this part on the boundary with this name.
fn on_patches(mesh: &Generated, arrays: &Arrays, name: &str) -> Result<Vec<[u32; 3]>, Failure> {
    let patches = mesh.names.patches_named(name)?;
    let all = arrays.triangles.iter().zip(&arrays.triangle_patches);
    Ok(all.filter(|(_, patch)| patches.contains(patch)).map(|(&triangle, _)| triangle).collect())
}

fn area(a: [f64; 3], b: [f64; 3], c: [f64; 3]) -> f64 {
    let [u, v] = [b, c].map(|p| [p[0] - a[0], p[1] - a[1], p[2] - a[2]]);
    0.5 * (dot(u, u) * dot(v, v) - dot(u, v).powi(2)).sqrt()
}

/// **Collective.** For each tet the length of the largest difference of its flux to that of a tet
/// with a common face.
fn jumps(
    comm: &dyn Communicator,
    ghosts: &Ghosts,
    arrays: &Arrays,
    flux: &[[f64; 3]],
) -> Result<Vec<f64>, CommError> {
    // Request the fluxes of ghosts from their owners, by the index in the owner's part.
    let mut requests: BTreeMap<Rank, Vec<u64>> = BTreeMap::new();
    for ghost in &ghosts.tets {
        requests.entry(ghost.owner).or_default().push(ghost.index);
    }
    let requests = comm.exchange(requests.into_iter().collect())?;
    let reply = |indices: Vec<u64>| indices.iter().map(|&index| flux[index as usize]).collect();
    let replies =
        comm.exchange(requests.into_iter().map(|(from, indices)| (from, reply(indices))).collect())?;
    let mut replies: BTreeMap<Rank, std::vec::IntoIter<[f64; 3]>> =
        replies.into_iter().map(|(from, fluxes)| (from, fluxes.into_iter())).collect();
    let mut of_ghost =
        |owner| replies.get_mut(&owner).and_then(Iterator::next).expect("a reply to each request");

    let mut tets: Vec<([u32; 4], [f64; 3])> = arrays.tets.iter().copied().zip(flux.iter().copied()).collect();
    tets.extend(ghosts.tets.iter().map(|ghost| (ghost.vertices, of_ghost(ghost.owner))));
    let mut jumps = vec![0.0; tets.len()];
    let mut behind: HashMap<[u32; 3], usize> = HashMap::new();
    for (tet, (vertices, flux)) in tets.iter().enumerate() {
        for mut face in TET_FACES.map(|face| face.map(|k| vertices[k])) {
            face.sort_unstable();
            if let Some(other) = behind.insert(face, tet) {
                let difference = [0, 1, 2].map(|axis| flux[axis] - tets[other].1[axis]);
                for side in [tet, other] {
                    jumps[side] = f64::max(jumps[side], dot(difference, difference).sqrt());
                }
            }
        }
    }
    jumps.truncate(arrays.tets.len());
    Ok(jumps)
}
