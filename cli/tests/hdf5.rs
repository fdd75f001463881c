//! HDF5 files of the program, read by h5py.

use crate::common::{own, python, succeed, tetmill};
use std::path::Path;

/// Writes a mesh in parts to the folder `ORDER.PARTS`.
fn write(folder: &Path, geometry: &str, [order, parts]: [&str; 2], more: &[&str]) {
    let mut run = tetmill();
    run.args(["generate", "-f", "hdf5", "-q", "-n", parts, "--order", order, "-o"]);
    succeed(run.arg(folder.join(format!("{order}.{parts}"))).arg(own(geometry)).args(more));
}

#[test]
fn one_hdf5_file_has_all_parts_in_both_orders() {
    let dir = tempfile::tempdir().unwrap();
    for (order, parts) in [("1", "1"), ("1", "4"), ("2", "1"), ("2", "4")] {
        write(dir.path(), "layers", [order, parts], &[]);
        let out = dir.path().join(format!("{order}.{parts}"));
        assert_eq!(std::fs::read_dir(out).unwrap().count(), 2);
    }
    let program = "
import re
import h5py
import numpy as np
for order, nodes in ((1, (4, 3)), (2, (10, 6))):
    for parts in (1, 4):
        name = f'{order}.{parts}/layers'
        file = h5py.File(name + '.h5')
        grid, triangles = file['VTKHDF'], file['boundary/cells'][:]
        points, tets = grid['Points'][:], grid['Connectivity'][:].reshape(-1, nodes[0])
        assert triangles.shape[1] == nodes[1] and (grid['Types'][:] == {1: 10, 2: 24}[order]).all()
        assert sorted(grid['CellData/GlobalElementId'][:]) == list(range(len(tets)))
        assert set(grid['CellData/PartitionId'][:]) == set(range(1, parts + 1))
        edges = points[tets[:, 1:4]] - points[tets[:, :1]]
        volumes, bodies = np.linalg.det(edges) / 6, grid['CellData/BodyId'][:]
        for body, volume in ((1, 16), (2, 3.2), (3, 16)):
            assert abs(volumes[bodies == body].sum() - volume) < 1e-9, (order, parts, body)
        # Planes: nodes on edges are midpoints, in VTK's order.
        for cells, first in ((tets, 4), (triangles, 3)):
            pairs = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))[:cells.shape[1] - first]
            for node, (a, b) in enumerate(pairs, first):
                middle = (points[cells[:, a]] + points[cells[:, b]]) / 2
                assert abs(points[cells[:, node]] - middle).max() < 1e-12, (order, parts, node)
        # The index refers to datasets of the file, with their shapes.
        items = re.findall(r'Dimensions=\"([0-9 ]+)\">layers.h5:([^<]+)<', open(name + '.xdmf').read())
        assert len(items) == 10
        for shape, path in items:
            assert file[path].shape == tuple(map(int, shape.split())), path
";
    python(&["h5py", "numpy"], program, dir.path());
}

#[test]
fn the_adjacency_is_that_of_the_mesh_for_any_number_of_parts() {
    let dir = tempfile::tempdir().unwrap();
    let cases = [["1", "1"], ["1", "3"], ["1", "7"], ["2", "1"], ["2", "3"]];
    for case in cases {
        write(dir.path(), "square_ring", case, &["--adjacency"]);
    }
    let program = "
import h5py
import numpy as np
def transposed(rows, count):
    order = np.argsort(rows.ravel(), kind='stable')
    return np.searchsorted(rows.ravel()[order], range(count + 1)), order // rows.shape[1]
alone = {}
for order, parts in ((1, 1), (1, 3), (1, 7), (2, 1), (2, 3)):
    file = h5py.File(f'{order}.{parts}/square_ring.h5')
    group = file['adjacency']
    assert len(group) == 6 + 2 * 4, list(group)
    edges, faces, tet_edges, tet_faces, face_edges, face_tets = (
        group[name][:] for name in ('edges', 'faces', 'tet_edges', 'tet_faces', 'face_edges', 'face_tets'))
    nodes = {1: 4, 2: 10}[order]
    cells = file['VTKHDF/Connectivity'][:].reshape(-1, nodes)
    tets, ids, tet_ids = cells[:, :4], file['VTKHDF/PointData/GlobalNodeId'][:], file['VTKHDF/CellData/GlobalElementId'][:]
    # A ring has the Euler characteristic 0.
    assert len(np.unique(tets)) - len(edges) + len(faces) - len(tets) == 0
    for rows in (edges, faces):
        assert (np.diff(rows, axis=1) > 0).all() and len(np.unique(rows, axis=0)) == len(rows)
    ends = np.array([[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]])
    assert (edges[tet_edges] == np.sort(tets[:, ends], axis=2)).all()
    corners = np.array([[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]])
    assert (faces[tet_faces] == np.sort(tets[:, corners], axis=2)).all()
    assert (edges[face_edges] == faces[:, ends[:3]]).all()
    for name, rows, count in (('edge_faces', face_edges, len(edges)), ('edge_tets', tet_edges, len(edges)),
                              ('vertex_edges', edges, len(ids)), ('vertex_tets', tets, len(ids))):
        offsets, values = transposed(rows, count)
        assert (group[name + '_offsets'][:] == offsets).all() and (group[name][:] == values).all(), name
    offsets, values = transposed(tet_faces, len(faces))
    counts = np.diff(offsets)
    assert (face_tets[:, 0] == values[offsets[:-1]]).all()
    assert (face_tets[:, 1] == np.where(counts == 2, values[offsets[1:] - 1], -1)).all()
    # The outside: the boundary triangles, as the geometry has one body.
    triangles = np.sort(file['boundary/cells'][:, :3], axis=1)
    assert sorted(map(tuple, faces[counts == 1])) == sorted(map(tuple, triangles))
    if order == 2:
        # Column k of the edges has the node in column 4 + k of the tets.
        of_edge = np.full(len(edges), -1)
        of_edge[tet_edges] = cells[:, 4:]
        assert (of_edge[tet_edges] == cells[:, 4:]).all()
    # By global ids, all numbers of parts have the same faces and tets at them.
    beside = np.sort(np.where(face_tets < 0, -1, tet_ids[face_tets]), axis=1)
    known = np.hstack([np.sort(ids[faces], axis=1), beside])
    known = known[np.lexsort(known.T)]
    assert (alone.setdefault(order, known) == known).all(), (order, parts)
";
    python(&["h5py", "numpy"], program, dir.path());
}

#[test]
fn the_adjacency_needs_hdf5_among_the_formats() {
    let output =
        tetmill().args(["generate", "-f", "vtu", "--adjacency"]).arg(own("layers")).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("--adjacency: only HDF5 holds it"));
}

#[test]
fn an_adjacency_that_does_not_fit_the_memory_is_refused_before_refinement() {
    let dir = tempfile::tempdir().unwrap();
    let mut run = tetmill();
    run.args(["generate", "--levels", "2", "--memory", "1e6", "--preset", "very-coarse", "-o"])
        .arg(dir.path());
    let run = run.args(["-f", "hdf5", "--adjacency"]).arg(own("layers")).output().unwrap();
    let stderr = String::from_utf8_lossy(&run.stderr);
    assert_eq!(run.status.code(), Some(4), "{stderr}");
    assert!(stderr.contains("leave out the adjacency"), "{stderr}");
    assert!(std::fs::read_dir(dir.path()).unwrap().next().is_none());
}

#[test]
fn periodic_ids_are_those_of_the_masters() {
    let dir = tempfile::tempdir().unwrap();
    for parts in ["1", "3"] {
        for order in ["1", "2"] {
            write(dir.path(), "unit_cell", [order, parts], &["--preset", "very-coarse"]);
        }
    }
    let program = "
import h5py
import numpy as np
for order in (1, 2):
    for parts in (1, 3):
        points = h5py.File(f'{order}.{parts}/unit_cell.h5')['VTKHDF']
        data = points['PointData']
        ids, masters, points = data['GlobalNodeId'][:], data['PeriodicId'][:], points['Points'][:]
        # Periodic with period 1 in all directions: a class has the points that are equal modulo 1.
        keys = np.round(points % 1, 7) % 1
        classes = np.unique(keys, axis=0, return_inverse=True)[1].ravel()
        row_of = np.argsort(ids)
        assert (ids[row_of] == np.arange(len(ids))).all()
        # Each class has one master, one of its own points.
        assert (classes[row_of[masters]] == classes).all()
        assert len(np.unique(masters)) == classes.max() + 1
        assert (masters[row_of[masters]] == masters).all()
        sizes = np.bincount(classes)
        assert sizes.max() == 8 and (sizes == 4).any() and (sizes == 2).sum() > 20, sizes
        # Points inside are their own masters.
        inside = ((points > 1e-6) & (points < 1 - 1e-6)).all(axis=1)
        assert inside.any() and (masters[inside] == ids[inside]).all()
";
    python(&["h5py", "numpy"], program, dir.path());
}
