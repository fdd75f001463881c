//! Exchange of meshes with other programs: names, numbers of elements, and areas by name, in both
//! directions.
//!
//! The programs are the Python modules of Gmsh, NGSolve, meshio, h5py, VTK, DOLFINx and PETSc. A
//! test is skipped with a message if its module is missing.

use csg::{BodyId, PatchId};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;
use tetmill::Point;
use tetmill::comm::{Communicator, thread};
use tetmill::files::vtu::{self, Field, On};
use tetmill::files::{gmsh4, hdf5, serial, volume};
use tetmill::internals::{PlainPart, simplex};
use tetmill::mesh::{
    Arrays, BoundaryTriangle, By, Class, Label, Mesh, MeshStream, Names, TET_FACES, VertexId, WithHalo, halo,
};

/// Number of elements and total area or volume, by name.
type Sizes = BTreeMap<String, (u64, f64)>;

/// What a program reads from a mesh: boundaries and bodies.
type Found = [Sizes; 2];

/// A Python program that reads or writes meshes.
struct Client(&'static str);

const GMSH: Client = Client("gmsh_groups.py");
const MESHIO: Client = Client("meshio_groups.py");
const NGSOLVE: Client = Client("ngsolve_regions.py");

impl Client {
    /// Runs the script on a file or folder. Returns its output, or `None` if the module is missing.
    fn run(&self, path: &Path) -> Option<String> {
        self.finish(Command::new("python3"), path)
    }

    /// Runs the script on processes of the system's Python, the one with DOLFINx and PETSc.
    fn run_on(&self, ranks: u32, path: &Path) -> Option<String> {
        if Command::new("mpirun").arg("--version").output().is_err() {
            eprintln!("SKIPPED: no mpirun");
            return None;
        }
        let mut mpirun = Command::new("mpirun");
        mpirun.args(["-n", &ranks.to_string(), "/usr/bin/python3"]);
        // By default Open MPI refuses to run as root or with more ranks than cores.
        mpirun.envs([("OMPI_ALLOW_RUN_AS_ROOT", "1"), ("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1")]);
        mpirun.env("OMPI_MCA_rmaps_base_oversubscribe", "1");
        self.finish(mpirun, path)
    }

    fn finish(&self, mut python: Command, path: &Path) -> Option<String> {
        let script = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/clients").join(self.0);
        let output = python.arg(script).arg(path).output().unwrap();
        let printed = String::from_utf8_lossy(&output.stdout).into_owned();
        let complaint = String::from_utf8_lossy(&output.stderr);
        // The module, or a system library that it needs, is missing.
        if ["ModuleNotFoundError", "ImportError", "OSError: lib"]
            .iter()
            .any(|error| complaint.contains(error))
        {
            eprintln!("SKIPPED: {}", complaint.lines().last().unwrap_or_default());
            return None;
        }
        assert!(output.status.success(), "{}: {printed}{complaint}", self.0);
        Some(printed)
    }

    /// Reads a mesh with the program.
    fn find(&self, path: &Path) -> Option<Found> {
        let printed = self.run(path)?;
        let last = printed.lines().last().unwrap();
        let found: BTreeMap<String, Sizes> = serde_json::from_str(last).unwrap();
        Some(["boundaries", "bodies"].map(|kind| found[kind].clone()))
    }
}

/// Cells of the box along each axis: 288 squares on its faces and in the middle.
const CELLS: [u32; 3] = [8, 8, 4];

/// A box of cubes of six tets each, as one body or two adjacent ones. Each boundary square of a
/// cell is its own patch.
fn squares(bodies: u32) -> Mesh {
    const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];
    let [nx, ny, nz] = CELLS.map(|n| n + 1);
    let id = |[x, y, z]: [u32; 3]| VertexId((z * ny + y) * nx + x);
    let mut mesh = Mesh::default();
    for k in 0..nx * ny * nz {
        let place = [k % nx, k / nx % ny, k / nx / ny];
        mesh.points.push(Point::from(place.map(f64::from)));
        // Each vertex belongs to several patches.
        mesh.classes.push(Class::Corner(csg::CornerId(k)));
    }
    let body_of = |cell: [u32; 3]| u32::from(bodies == 2 && cell[0] >= CELLS[0] / 2);
    let mut patches: BTreeMap<[[u32; 3]; 2], u32> = BTreeMap::new();
    for cell in 0..CELLS.iter().product() {
        let cell = [cell % CELLS[0], cell / CELLS[0] % CELLS[1], cell / CELLS[0] / CELLS[1]];
        for (k, order) in ORDERS.iter().enumerate() {
            let mut path = [cell; 4];
            for step in 0..3 {
                path[step + 1] = path[step];
                path[step + 1][order[step]] += 1;
            }
            if k >= 3 {
                path.swap(0, 3);
            }
            mesh.tets.push(path.map(id));
            mesh.bodies.push(BodyId(body_of(cell)));
            for face in TET_FACES.map(|face| face.map(|v| path[v])) {
                let flat = |axis: usize, at: u32| face.iter().all(|p| p[axis] == at);
                let is_outer = (0..3).any(|axis| flat(axis, 0) || flat(axis, CELLS[axis]));
                let is_between = bodies == 2 && body_of(cell) == 0 && flat(0, CELLS[0] / 2);
                if is_outer || is_between {
                    let corner = |pick: fn(u32, u32) -> u32| {
                        [0, 1, 2].map(|axis| face.iter().map(|p| p[axis]).reduce(pick).unwrap())
                    };
                    let next = patches.len() as u32;
                    let patch = *patches.entry([corner(u32::min), corner(u32::max)]).or_insert(next);
                    mesh.triangles.push(BoundaryTriangle { vertices: face.map(id), patch: PatchId(patch) });
                }
            }
        }
    }
    mesh
}

fn patch_count(mesh: &Mesh) -> u32 {
    mesh.triangles.iter().map(|t| t.patch.0 + 1).max().unwrap()
}

/// A number for each patch, and no names.
fn numbered_patches(mesh: &Mesh) -> Vec<Label> {
    (1..=patch_count(mesh)).map(Label::unnamed).collect()
}

/// The expected contents of a mesh, by the keys of its labels.
fn sizes(mesh: &Mesh, names: &Names, keys: impl Fn(&Label) -> Vec<String>) -> Found {
    let mut found = Found::default();
    let mut add = |kind: usize, label: &Label, size: f64| {
        for key in keys(label) {
            let entry = found[kind].entry(key).or_insert((0, 0.0));
            entry.0 += 1;
            entry.1 += size;
        }
    };
    for t in &mesh.triangles {
        let [a, b, c] = t.vertices.map(|v| mesh.points[v.index()]);
        add(0, &names.patches[t.patch.index()], 0.5 * (b - a).cross(&(c - a)).norm());
    }
    for (t, body) in mesh.tets.iter().zip(&mesh.bodies) {
        let [a, b, c, d] = t.map(|v| mesh.points[v.index()]);
        add(1, &names.bodies[body.index()], simplex::volume(&a, &b, &c, &d));
    }
    found
}

#[track_caller]
fn assert_alike(found: &Found, expected: &Found, what: &str) {
    for (found, expected) in found.iter().zip(expected) {
        let keys = |sizes: &Sizes| sizes.keys().cloned().collect::<Vec<_>>();
        assert_eq!(keys(found), keys(expected), "{what}");
        for (name, (count, size)) in expected {
            let (found_count, found_size) = found[name];
            assert_eq!(found_count, *count, "{what}: elements of {name}");
            assert!((found_size - size).abs() < 1e-9 * size, "{what}: {name} has {found_size}, not {size}");
        }
    }
}

fn several(number: u32, names: &[&str]) -> Label {
    Label { number, names: names.iter().map(ToString::to_string).collect() }
}

/// Labels of patches by their index, as in real files.
type Labels = fn(u32) -> Label;

/// Named, unnamed, repeated and sparse numbers; several numbers with one name.
fn mixed(patch: u32) -> Label {
    match patch % 6 {
        0 => Label::new(7, "skin"),
        1 => Label::new(12, "skin"),
        2 => Label::unnamed(3),
        3 => Label::new(900, "clamp"),
        4 => Label::unnamed(41),
        _ => Label::new(12, "skin"),
    }
}

/// A number for each patch, most of them named.
fn hundreds(patch: u32) -> Label {
    if patch.is_multiple_of(7) {
        Label::unnamed(patch + 1)
    } else {
        Label::new(patch + 1, format!("wall_{patch}"))
    }
}

/// Numbers up to 2·10⁹.
fn sparse(patch: u32) -> Label {
    let number = 1 + patch % 20 * 100_000_000;
    if patch % 20 == 3 { Label::unnamed(number) } else { Label::new(number, format!("far_{}", patch % 20)) }
}

/// Each in one to three groups.
fn groups(patch: u32) -> Label {
    match patch % 4 {
        0 => several(1, &["all"]),
        1 => several(2, &["all", "clamp"]),
        2 => several(3, &["all", "clamp", "hot"]),
        _ => several(9, &["all", "hot"]),
    }
}

const CASES: [(&str, Labels); 4] =
    [("mixed", mixed), ("hundreds", hundreds), ("sparse", sparse), ("groups", groups)];

/// Calls `check` for each case with one and two bodies, in one and in seven parts, written with
/// this extension.
fn for_each_case(ending: &str, check: impl FnMut(&Path, &Mesh, &Names, &str)) {
    let write = |comm: &dyn Communicator, part: &dyn MeshStream, names: &Names, stem: &Path| {
        let path = stem.with_extension(ending);
        serial::write_joined(comm, part, names, serial::Format::of(&path).unwrap(), &path).unwrap();
    };
    for_each_written(ending, &write, check);
}

/// **Collective.** Writes a part to a file with this path without its extension.
type Write<'a> = &'a (dyn Fn(&dyn Communicator, &dyn MeshStream, &Names, &Path) + Sync);

/// Like [`for_each_case`], with files that `write` writes.
fn for_each_written(ending: &str, write: Write, mut check: impl FnMut(&Path, &Mesh, &Names, &str)) {
    let dir = tempfile::tempdir().unwrap();
    for bodies in [1, 2] {
        let mesh = squares(bodies);
        for (case, label) in CASES {
            let patches = (0..patch_count(&mesh)).map(label).collect();
            let bodies_of = match case {
                "groups" => vec![several(4, &["solid", "copper"]), several(5, &["solid"])],
                "sparse" => vec![Label::new(3_000_000, "copper"), Label::unnamed(17)],
                _ => vec![Label::new(2, "copper"), Label::unnamed(6)],
            };
            let names = Names { bodies: bodies_of[..bodies as usize].to_vec(), patches };
            let (stem, path) = (dir.path().join(case), dir.path().join(format!("{case}.{ending}")));
            write(&thread::alone(), &PlainPart::whole(&mesh), &names, &stem);
            check(&path, &mesh, &names, &format!("{case}, {bodies} bodies"));
            let rank_of: Vec<u32> = (0..mesh.tets.len()).map(|tet| (tet / 100 % 7) as u32).collect();
            let write_part = |comm: &dyn Communicator| {
                write(comm, &PlainPart::part(&mesh, &rank_of, 7, comm.rank()), &names, &stem);
            };
            thread::run(7, write_part).unwrap();
            check(&path, &mesh, &names, &format!("{case}, {bodies} bodies in seven parts"));
        }
    }
}

/// In Gmsh a label is in a group for each of its names, or else in one of its number.
fn by_group(label: &Label) -> Vec<String> {
    if label.names.is_empty() { vec![format!("#{}", label.number)] } else { label.names.clone() }
}

#[test]
fn ngsolve_finds_all_names_and_areas() {
    for_each_case("vol", |path, mesh, names, case| {
        let Some(found) = NGSOLVE.find(path) else { return };
        let expected = sizes(mesh, names, |label| vec![label.name().unwrap_or("default").to_string()]);
        assert_alike(&found, &expected, case);
    });
}

#[test]
fn gmsh_finds_all_names_and_areas() {
    for_each_case("msh", |path, mesh, names, case| {
        let Some(found) = GMSH.find(path) else { return };
        assert_alike(&found, &sizes(mesh, names, by_group), case);
    });
}

#[test]
fn gmsh_opens_parts_in_one_file_and_in_a_file_for_each_with_the_ghosts_of_the_halo() {
    use gmsh4::Storage::{Binary, Text};
    let mesh = squares(2);
    let names = Names {
        bodies: vec![several(4, &["solid", "copper"]), several(5, &["solid"])],
        patches: (0..patch_count(&mesh)).map(groups).collect(),
    };
    for (ranks, storage) in [(1, Binary), (1, Text), (4, Binary), (4, Text), (7, Binary)] {
        let dir = tempfile::tempdir().unwrap();
        let stem = dir.path().join("box");
        let rank_of: Vec<u32> = (0..mesh.tets.len()).map(|tet| tet as u32 / 50 % ranks).collect();
        let ghosts = thread::run(ranks, |comm| {
            let part = PlainPart::part(&mesh, &rank_of, ranks, comm.rank());
            let ghosts = halo(comm, &part, By::Vertices).unwrap();
            let part = WithHalo::new(&part, &ghosts);
            gmsh4::write(comm, &part, &names, &stem.with_extension("msh"), storage).unwrap();
            gmsh4::write_parts(comm, &part, &names, &stem, storage).unwrap();
            ghosts.tets.len()
        })
        .unwrap();
        let Some(printed) = Client("gmsh_parts.py").run(&stem) else { return };
        let found: serde_json::Value = serde_json::from_str(printed.lines().last().unwrap()).unwrap();
        assert_eq!(found["partitions"], if ranks == 1 { 0 } else { ranks });
        assert_eq!(found["ghosts"], serde_json::json!(if ranks == 1 { Vec::new() } else { ghosts }));
        let found = ["boundaries", "bodies"].map(|kind| serde_json::from_value(found[kind].clone()).unwrap());
        assert_alike(&found, &sizes(&mesh, &names, by_group), &format!("{ranks} ranks, {storage:?}"));
        if ranks == 1 {
            // meshio refuses partitions, those of Gmsh too.
            let Some(found) = MESHIO.find(&stem.with_extension("msh")) else { return };
            assert_alike(&found, &sizes(&mesh, &names, by_group), "meshio");
        }
    }
}

#[test]
fn meshio_finds_all_names_and_areas() {
    for_each_case("msh", |path, mesh, names, case| {
        let Some(found) = MESHIO.find(path) else { return };
        assert_alike(&found, &sizes(mesh, names, by_group), case);
    });
}

fn write_hdf5(comm: &dyn Communicator, part: &dyn MeshStream, names: &Names, stem: &Path) {
    hdf5::write(comm, part, names, stem).unwrap();
}

#[test]
fn h5py_finds_all_names_and_areas() {
    for_each_written("h5", &write_hdf5, |path, mesh, names, case| {
        let Some(found) = Client("hdf5_sizes.py").find(path) else { return };
        assert_alike(&found, &sizes(mesh, names, by_group), case);
    });
}

#[test]
fn vtk_finds_all_names_and_volumes() {
    for_each_written("h5", &write_hdf5, |path, mesh, names, case| {
        let Some([boundaries, bodies]) = Client("vtkhdf_sizes.py").find(path) else { return };
        let expected = sizes(mesh, names, by_group);
        // VTK gets the names of boundaries without triangles.
        let named = expected[0].keys().filter(|name| !name.starts_with('#'));
        assert!(boundaries.keys().eq(named), "{case}");
        assert_alike(&[Sizes::new(), bodies], &[Sizes::new(), expected[1].clone()], case);
    });
}

#[test]
fn dolfinx_and_petsc_read_the_file_on_any_number_of_ranks() {
    let mesh = squares(2);
    let by_side = |patch: u32| Label::unnamed(1 + patch % 3);
    let names = Names {
        bodies: vec![Label::new(1, "left"), Label::new(4, "right")],
        patches: (0..patch_count(&mesh)).map(by_side).collect(),
    };
    let [areas, volumes] = sizes(&mesh, &names, |label| vec![label.number.to_string()]);
    let dir = tempfile::tempdir().unwrap();
    let rank_of: Vec<u32> = (0..mesh.tets.len()).map(|tet| (tet / 100 % 7) as u32).collect();
    thread::run(7, |comm| {
        let part = PlainPart::part(&mesh, &rank_of, 7, comm.rank());
        write_hdf5(comm, &part, &names, &dir.path().join("box"));
    })
    .unwrap();
    let close = |found: &serde_json::Value, expected: &Sizes| {
        let found: BTreeMap<String, f64> = serde_json::from_value(found.clone()).unwrap();
        let same = |(name, (_, size)): (&String, &(u64, f64))| (found[name] - size).abs() < 1e-9 * size;
        assert!(found.keys().eq(expected.keys()) && expected.iter().all(same), "{found:?}, not {expected:?}");
    };
    for ranks in [1, 2] {
        if let Some(printed) = Client("xdmf_dolfinx.py").run_on(ranks, &dir.path().join("box.xdmf")) {
            let found: serde_json::Value = serde_json::from_str(printed.lines().last().unwrap()).unwrap();
            assert_eq!(found["tets"], mesh.tets.len());
            close(&found["areas"], &areas);
            close(&found["volumes"], &volumes);
        }
        if let Some(printed) = Client("hdf5_petsc.py").run_on(ranks, &dir.path().join("box.h5")) {
            let found: serde_json::Value = serde_json::from_str(printed.lines().last().unwrap()).unwrap();
            assert_eq!(found["tets"], mesh.tets.len());
            let volume: f64 = volumes.values().map(|(_, volume)| volume).sum();
            assert!((found["volume"].as_f64().unwrap() - volume).abs() < 1e-9 * volume, "{found}");
        }
    }
}

#[test]
fn meshio_finds_the_values_of_points_and_tets() {
    let mesh = squares(1);
    let names = Names { bodies: vec![Label::new(1, "box")], patches: numbered_patches(&mesh) };
    for ranks in [1, 4] {
        let dir = tempfile::tempdir().unwrap();
        let tet_to_rank: Vec<u32> = (0..mesh.tets.len() as u32).map(|tet| tet / 7 % ranks).collect();
        thread::run(ranks, |comm| {
            let part = PlainPart::part(&mesh, &tet_to_rank, ranks, comm.rank());
            let arrays = Arrays::of(&part);
            let heights: Vec<f64> = arrays.points.iter().map(|point| point[2]).collect();
            let ids: Vec<f64> = arrays.tet_ids.iter().map(|&id| id as f64).collect();
            let center = |tet: usize| {
                let corners = arrays.corners(tet);
                [0, 1, 2].map(|axis| corners.iter().map(|corner| corner[axis]).sum::<f64>() / 4.0)
            };
            let centers: Vec<[f64; 3]> = (0..arrays.tets.len()).map(center).collect();
            let fields = [
                Field { name: "height", on: On::Points, values: &heights, components: 1 },
                Field { name: "center", on: On::Cells, values: centers.as_flattened(), components: 3 },
                Field { name: "index", on: On::Cells, values: &ids, components: 1 },
            ];
            vtu::write_fields(comm, &part, &names, &dir.path().join("box"), &fields).unwrap();
        })
        .unwrap();
        let files: Vec<String> = match ranks {
            1 => vec!["box.vtu".to_owned()],
            _ => (1..=ranks).map(|part| format!("box.parts/part.{part}.vtu")).collect(),
        };
        let mut tets = 0;
        for file in files {
            let Some(found) = Client("meshio_fields.py").run(&dir.path().join(file)) else { return };
            tets += found.trim().parse::<usize>().unwrap();
        }
        assert_eq!(tets, mesh.tets.len());
        // Values do not disturb our own reader.
        let file = if ranks == 1 { "box.vtu" } else { "box.pvtu" };
        assert_eq!(volume::read(&dir.path().join(file)).unwrap().mesh.tets.len(), mesh.tets.len());
    }
}

#[test]
fn our_own_reader_finds_all_names_and_areas() {
    for_each_case("msh", |path, mesh, names, case| {
        let found = volume::read(path).unwrap();
        assert_alike(&sizes(&found.mesh, &found.names, by_group), &sizes(mesh, names, by_group), case);
    });
    let main = |label: &Label| vec![label.name().unwrap_or("default").to_string()];
    for_each_case("vol", |path, mesh, names, case| {
        let found = volume::read(path).unwrap();
        assert_alike(&sizes(&found.mesh, &found.names, main), &sizes(mesh, names, main), case);
    });
}

#[test]
fn groups_and_periods_of_gmshs_files_are_read() {
    let dir = tempfile::tempdir().unwrap();
    let client = Client("gmsh_write.py");
    if client.run(dir.path()).is_none() {
        return;
    }
    for version in ["2.2", "4.1"] {
        for (binary, order) in [(0, 1), (1, 1), (0, 2), (1, 2)] {
            let name = format!("{version}-{binary}-{order}.msh");
            let found = volume::read(&dir.path().join(&name)).unwrap();
            let [boundaries, bodies] = sizes(&found.mesh, &found.names, |label| label.names.clone());
            let areas: Vec<(&str, f64)> = boundaries.iter().map(|(name, size)| (&**name, size.1)).collect();
            let [("clamp", clamp), ("ends", ends), ("outer", outer)] = areas[..] else { panic!("{areas:?}") };
            let off =
                [(clamp, 1.0), (ends, 2.0), (outer, 10.0), (bodies["all"].1, 2.0), (bodies["first"].1, 1.0)];
            assert!(off.iter().all(|(found, expected)| (found - expected).abs() < 1e-9), "{name}: {off:?}");
            let [link] = &found.links[..] else { panic!("{name}: {:?}", found.links) };
            let by_two = Point::new(2.0, 0.0, 0.0).coords;
            assert!((link.motion.translation.vector - by_two).norm() < 1e-12, "{name}");
            let says_order = found.notes.iter().any(|note| note.starts_with("the mesh is of higher order"));
            assert_eq!(says_order, order == 2, "{name}: {:?}", found.notes);
        }
    }
}

#[test]
fn periodic_meshes_of_netgen_are_read() {
    let dir = tempfile::tempdir().unwrap();
    let client = Client("netgen_write.py");
    if client.run(dir.path()).is_none() {
        return;
    }
    for order in [1, 2] {
        let found = volume::read(&dir.path().join(format!("{order}.vol"))).unwrap();
        let [boundaries, bodies] = sizes(&found.mesh, &found.names, |label| label.names.clone());
        let areas: Vec<(&str, f64)> =
            boundaries.iter().map(|(name, size)| (&**name, size.1.round())).collect();
        assert_eq!(areas, [("left", 1.0), ("right", 1.0), ("side", 4.0)]);
        assert!((bodies["block"].1 - 1.0).abs() < 1e-9);
        let [link] = &found.links[..] else { panic!("{:?}", found.links) };
        assert!((link.motion.translation.vector - Point::new(1.0, 0.0, 0.0).coords).norm() < 1e-12);
        let says_order = found.notes.iter().any(|note| note.starts_with("the mesh is of higher order"));
        assert_eq!(says_order, order == 2, "{:?}", found.notes);
    }
}
