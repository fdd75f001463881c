//! VTU files, joined files, Gmsh's files of parts, and MFEM's parallel files, read by MFEM, meshio,
//! scikit-fem, Gmsh and NGSolve.
//!
//! A test is skipped with a message if the Python module is missing.

use crate::common::{own, python, shared, succeed, tetmill};
use std::path::Path;
use std::process::Command;

/// Bodies substrate (1), film (2) and cover (3), with interfaces: volumes 16, 3.2 and 16.
fn layers(folder: &Path, file: &str, more: &[&str]) {
    succeed(tetmill().arg("mesh").arg(own("layers")).arg("-o").arg(folder.join(file)).args(more).arg("-q"));
}

/// Volumes and areas of meshio's cells by number.
const MEASURES: &str = "
import meshio
import numpy as np
def volumes(mesh, numbers):
    cells = mesh.cells_dict['tetra']
    a, b, c, d = (mesh.points[cells[:, k]] for k in range(4))
    each = np.einsum('ij,ij->i', np.cross(b - a, c - a), d - a) / 6
    return {int(n): each[numbers == n].sum() for n in np.unique(numbers)}
def areas(mesh, numbers):
    cells = mesh.cells_dict['triangle']
    a, b, c = (mesh.points[cells[:, k]] for k in range(3))
    each = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    return {int(n): each[numbers == n].sum() for n in np.unique(numbers)}
def same(found, expected):
    assert found.keys() == expected.keys(), (found, expected)
    assert all(abs(found[n] - expected[n]) < 1e-9 for n in found), (found, expected)
";

#[test]
fn mfem_reads_bodies_as_attributes() {
    let dir = tempfile::tempdir().unwrap();
    layers(dir.path(), "m.vtu", &[]);
    let program = "
import mfem.ser as mfem
mesh = mfem.Mesh('m.vtu')
assert mesh.attributes.ToList() == [1, 2, 3], mesh.attributes.ToList()
volumes = {n: 0 for n in (1, 2, 3)}
for k in range(mesh.GetNE()):
    volumes[mesh.GetAttribute(k)] += mesh.GetElementVolume(k)
assert abs(volumes[1] - 16) < 1e-9 and abs(volumes[2] - 3.2) < 1e-9, volumes
assert mesh.GetNBE() > 0 and mesh.CheckElementOrientation(False) == 0
";
    python(&["mfem.ser"], program, dir.path());
}

#[test]
fn parts_for_mfem_fit_together_and_keep_their_names() {
    let dir = tempfile::tempdir().unwrap();
    let out = |parts: u32| dir.path().join(format!("of{parts}"));
    for (parts, method) in [(1, "refine"), (4, "refine"), (7, "refine"), (3, "surface")] {
        let mut run = tetmill();
        run.args(["generate", "-f", "mfem", "-q", "-n", &parts.to_string(), "--method", method]);
        succeed(run.args(["-o", out(parts).to_str().unwrap()]).arg(own("layers")));
        assert_eq!(std::fs::read_dir(out(parts)).unwrap().count(), parts as usize);
        let text = std::fs::read_to_string(out(parts).join("layers.000000")).unwrap();
        assert!(text.contains("\nattribute_sets\n3\n") && text.contains("\"film\"\n1\n2\n"));
        match shared("tools/check_mfem.py") {
            Some(checker) => {
                succeed(Command::new("python3").arg(checker).arg(out(parts).join("layers")));
            }
            None => eprintln!("SKIPPED: there is no tools/check_mfem.py"),
        }
    }
    let program = "
import mfem.ser as mfem
mesh = mfem.Mesh('of1/layers.000000', 1, 0)
volumes = {n: 0 for n in (1, 2, 3)}
for k in range(mesh.GetNE()):
    volumes[mesh.GetAttribute(k)] += mesh.GetElementVolume(k)
assert abs(volumes[1] - 16) < 1e-9 and abs(volumes[2] - 3.2) < 1e-9, volumes
assert mesh.CheckElementOrientation(False) == 0 and mesh.CheckBdrElementOrientation(False) == 0
";
    python(&["mfem.ser"], program, dir.path());
}

#[test]
fn gmsh_reads_parts_of_both_orders_with_their_ghosts() {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/clients/gmsh_parts.py");
    let script = script.display();
    for (parts, more) in [("1", ""), ("4", "--halo vertices"), ("7", "--halo faces --ascii")] {
        for order in ["1", "2"] {
            let dir = tempfile::tempdir().unwrap();
            let mut run = tetmill();
            run.args(["generate", "-f", "msh4,msh4-parts", "-q", "-n", parts, "--order", order]);
            succeed(run.args(more.split_whitespace()).arg("-o").arg(dir.path()).arg(own("layers")));
            let program = format!(
                "
import json, subprocess, sys
printed = subprocess.run([sys.executable, '{script}', 'layers', 'flat'], check=True, stdout=-1, text=True).stdout
found = json.loads(printed)
assert found['partitions'] == ({parts} if {parts} > 1 else 0), found
assert len(found['ghosts']) == ({parts} if '{more}' else 0) and all(found['ghosts']), found
volumes = dict(sorted((name, size) for name, (count, size) in found['bodies'].items()))
expected = dict(substrate=16, film=3.2, cover=16)
assert all(abs(volumes[name] - expected[name]) < 1e-9 for name in expected), volumes
"
            );
            python(&["gmsh", "numpy"], &program, dir.path());
        }
    }
}

#[test]
fn meshio_reads_the_boundary_in_the_file_and_beside_it() {
    let dir = tempfile::tempdir().unwrap();
    layers(dir.path(), "beside.vtu", &[]);
    layers(dir.path(), "in.vtu", &["--boundary", "in"]);
    assert!(dir.path().join("beside.boundary.vtu").exists() && !dir.path().join("in.boundary.vtu").exists());
    let program = MEASURES.to_string()
        + "
beside, skin, both = (meshio.read(name) for name in ('beside.vtu', 'beside.boundary.vtu', 'in.vtu'))
data = both.cell_data_dict
same(volumes(both, data['BodyId']['tetra']), {1: 16, 2: 3.2, 3: 16})
same(volumes(beside, beside.cell_data_dict['BodyId']['tetra']), {1: 16, 2: 3.2, 3: 16})
expected = areas(skin, skin.cell_data_dict['BoundaryId']['triangle'])
# Outside 2 (16 + 16 * 2.2) - 2 * 16 and two interfaces of 16.
assert abs(sum(expected.values()) - (32 + 16 * 2.2 + 32)) < 1e-9, expected
same(areas(both, data['BoundaryId']['triangle']), expected)
assert not data['BodyId']['triangle'].any() and not data['BoundaryId']['tetra'].any()
assert (data['PartitionId']['triangle'] == 1).all() and (data['PartitionId']['tetra'] == 1).all()
for mesh in (skin, both):
    assert list(mesh.field_data['Body film']) == [2], mesh.field_data
";
    python(&["meshio"], &program, dir.path());
}

#[test]
fn scikit_fem_loads_the_file_with_its_boundaries() {
    let dir = tempfile::tempdir().unwrap();
    layers(dir.path(), "in.vtu", &["--boundary", "in"]);
    let program = "
import meshio, skfem
from skfem.io.meshio import from_meshio
mesh = skfem.MeshTet.load('in.vtu')
assert mesh.is_valid() and abs(skfem.Basis(mesh, skfem.ElementTetP1()).dx.sum() - 35.2) < 1e-9
read = meshio.read('in.vtu')
read.cell_data_to_sets('BoundaryId')
read.cell_data_to_sets('BodyId')
mesh = from_meshio(read)
film = mesh.subdomains['set-BodyId-2']
assert abs(skfem.Basis(mesh, skfem.ElementTetP1(), elements=film).dx.sum() - 3.2) < 1e-9
sides = [facets for name, facets in mesh.boundaries.items() if name.startswith('set-BoundaryId-')]
area = sum(skfem.FacetBasis(mesh, skfem.ElementTetP1(), facets=facets).dx.sum() for facets in sides)
assert len(sides) == 3 and abs(area - 99.2) < 1e-9, area
";
    python(&["meshio", "skfem"], program, dir.path());
}

#[test]
fn parts_come_back_as_the_mesh_that_they_were() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    let generate = |more: &[&str]| {
        succeed(
            tetmill()
                .arg("generate")
                .arg(own("layers"))
                .args(["-n", "3", "-f", "vtu", "-q", "-o"])
                .arg(&out)
                .args(more),
        );
    };
    let quality = |file: &str| {
        let output = succeed(tetmill().args(["quality", "--json"]).arg(out.join(file)));
        let mut told: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        told["meshes"][0].take()
    };
    generate(&[]);
    let beside = quality("layers.pvtu");
    generate(&["--boundary", "in", "--halo", "faces"]);
    std::fs::remove_file(out.join("layers.boundary.pvtu")).unwrap();
    let both = quality("layers.pvtu");
    assert_eq!(beside["tets"], both["tets"]);
    // As an input, the parts are the same mesh: names are kept, and each triangle occurs once.
    let again = dir.path().join("again.vtu");
    let output = succeed(tetmill().arg("mesh").arg(out.join("layers.pvtu")).arg("-o").arg(&again));
    assert!(
        !String::from_utf8_lossy(&output.stderr).contains("left out"),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let text = std::fs::read(&again).unwrap();
    let text = String::from_utf8_lossy(&text);
    for name in ["substrate", "film", "cover"] {
        assert!(text.contains(&format!("Name=\"Body {name}\"")), "{name}");
    }
    layers(dir.path(), "whole.vtu", &[]);
    let measured = MEASURES.to_string()
        + "
again, whole = (meshio.read(name + '.boundary.vtu') for name in ('again', 'whole'))
number = lambda mesh: mesh.cell_data_dict['BoundaryId']['triangle']
same(areas(again, number(again)), areas(whole, number(whole)))
";
    python(&["meshio"], &measured, dir.path());
}

#[test]
fn the_place_of_the_boundary_is_refused_for_other_formats() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("m.msh");
    let refused = |command: &mut Command| {
        let output = command.output().unwrap();
        assert_eq!(output.status.code(), Some(2));
        assert!(String::from_utf8_lossy(&output.stderr).contains("--boundary: only VTU"));
    };
    refused(tetmill().arg("mesh").arg(own("layers")).args(["--boundary", "in", "-o"]).arg(&out));
    refused(
        tetmill()
            .arg("generate")
            .arg(own("layers"))
            .args(["--boundary", "in", "-f", "elmer", "-o"])
            .arg(&out),
    );
}

#[test]
fn files_of_seven_ranks_are_the_mesh_that_one_rank_writes() {
    let dir = tempfile::tempdir().unwrap();
    for ranks in ["1", "7"] {
        let mut command = tetmill();
        command.arg("generate").arg(own("layers")).args([
            "-n",
            ranks,
            "--levels",
            "1",
            "-f",
            "msh,medit,vol",
            "-q",
            "-o",
        ]);
        succeed(command.arg(dir.path().join(ranks)));
        for file in ["layers.msh", "layers.mesh", "layers.vol"] {
            assert!(dir.path().join(ranks).join(file).exists(), "{file}");
        }
    }
    let meshio = MEASURES.to_string()
        + "
for file, key in (('layers.msh', 'gmsh:physical'), ('layers.mesh', 'medit:ref')):
    one, seven = (meshio.read(ranks + '/' + file) for ranks in '17')
    assert len(one.points) == len(seven.points)
    for mesh in (one, seven):
        same(volumes(mesh, mesh.cell_data_dict[key]['tetra']), {1: 16, 2: 3.2, 3: 16})
    same(*(areas(mesh, mesh.cell_data_dict[key]['triangle']) for mesh in (one, seven)))
    counts = [{kind: len(cells) for kind, cells in mesh.cells_dict.items()} for mesh in (one, seven)]
    assert counts[0] == counts[1], counts
    names = [sorted(mesh.field_data) for mesh in (one, seven)]
    assert names[0] == names[1] and (file.endswith('.mesh') or 'film' in names[0]), names
";
    python(&["meshio"], &meshio, dir.path());
    let gmsh = "
import gmsh
import numpy as np
gmsh.initialize()
gmsh.option.setNumber('General.Terminal', 0)
def measured(file):
    gmsh.open(file)
    tags, points, _ = gmsh.model.mesh.getNodes()
    place = dict(zip(tags, points.reshape(-1, 3)))
    found = {'nodes': len(tags)}
    for dimension, tag in gmsh.model.getPhysicalGroups():
        name = gmsh.model.getPhysicalName(dimension, tag)
        total = 0
        for entity in gmsh.model.getEntitiesForPhysicalGroup(dimension, tag):
            for nodes in gmsh.model.mesh.getElements(dimension, entity)[2]:
                for corners in nodes.reshape(-1, dimension + 1):
                    a, *others = (place[v] for v in corners)
                    edges = [b - a for b in others]
                    total += np.linalg.det(edges) / 6 if dimension == 3 else np.linalg.norm(np.cross(*edges)) / 2
        found[dimension, tag, name] = total
    return found
one, seven = measured('1/layers.msh'), measured('7/layers.msh')
assert one.keys() == seven.keys() and len(one) > 6, (one, seven)
assert all(abs(one[key] - seven[key]) < 1e-9 for key in one), (one, seven)
assert any(key[0] == 3 and key[2] == 'film' and abs(one[key] - 3.2) < 1e-9 for key in one if key != 'nodes'), one
";
    python(&["gmsh"], gmsh, dir.path());
    let ngsolve = "
from ngsolve import CF, BND, Integrate, Mesh
def measured(file):
    mesh = Mesh(file)
    volumes = {name: Integrate(CF(1), mesh.Materials(name)) for name in mesh.GetMaterials()}
    areas = {name: Integrate(CF(1), mesh.Boundaries(name)) for name in mesh.GetBoundaries()}
    return mesh.nv, mesh.ne, mesh.GetNE(BND), volumes, areas
one, seven = measured('1/layers.vol'), measured('7/layers.vol')
assert one[:3] == seven[:3], (one, seven)
for a, b in zip(one[3:], seven[3:]):
    assert a.keys() == b.keys() and all(abs(a[key] - b[key]) < 1e-9 for key in a), (a, b)
assert abs(seven[3]['film'] - 3.2) < 1e-9, seven
";
    python(&["ngsolve"], ngsolve, dir.path());
}

#[test]
fn ngsolve_counts_corners_as_vertices_in_second_order() {
    let dir = tempfile::tempdir().unwrap();
    for parts in ["1", "3"] {
        for order in ["1", "2"] {
            let mut run = tetmill();
            run.args(["generate", "-f", "vol", "-q", "-n", parts, "--order", order]).arg(own("dome"));
            succeed(run.arg("-o").arg(dir.path().join(format!("{order}.{parts}"))));
        }
    }
    let program = "
import netgen.meshing
from ngsolve import CF, H1, Integrate, Mesh
def load(file):
    mesh = netgen.meshing.Mesh()
    mesh.Load(file)
    return Mesh(mesh)
for parts in (1, 3):
    straight, curved = (load(f'{order}.{parts}/dome.vol') for order in (1, 2))
    # The meshes of both orders may differ by some tets: those to be curved are smoothed for that.
    corners = {v.nr for e in curved.ngmesh.Elements3D() for v in e.vertices}
    nodes = {v.nr for e in curved.ngmesh.Elements3D() for v in e.points}
    assert abs(straight.ne - curved.ne) < 0.05 * curved.ne and len(nodes) > 5 * len(corners)
    assert curved.nv == len(corners) == max(corners), (curved.nv, max(corners))
    assert straight.nv == len({v.nr for e in straight.ngmesh.Elements3D() for v in e.vertices})
    assert H1(curved, order=1).ndof == len(corners) and H1(curved, order=2).ndof == len(nodes)
    volumes = [Integrate(CF(1), mesh) for mesh in (straight, curved)]
    # Edges on the dome are curved outwards.
    assert 1.001 * volumes[0] < volumes[1] < 1.05 * volumes[0], volumes
";
    python(&["ngsolve"], program, dir.path());
}
