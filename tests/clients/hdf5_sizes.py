"""Prints the names that h5py finds in an HDF5 file of tetmill: number of elements and their measure; `#number` without a name.
Checks that all views of the mesh agree."""

import json
import sys

import h5py
import numpy as np

file = h5py.File(sys.argv[1])
grid, boundary = file["VTKHDF"], file["boundary"]
points, offsets = grid["Points"][:], grid["Offsets"][:]
tets = grid["Connectivity"][:].reshape(-1, 4)
assert file["geometry/vertices"] == grid["Points"]
assert (file["viz/topology/cells"][:] == tets).all() and file["viz/topology/cells"].attrs["cell_dim"] == 3
assert (offsets == 4 * np.arange(len(tets) + 1)).all() and (grid["Types"][:] == 10).all()
counts = [grid[name][0] for name in ("NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds")]
assert counts == [len(points), len(tets), tets.size]
for name, count in (("PointData/GlobalNodeId", len(points)), ("CellData/GlobalElementId", len(tets))):
    assert (np.sort(grid[name][:]) == np.arange(count)).all(), name

triangles, parents = boundary["cells"][:], boundary["parents"][:]
normals = np.cross(points[triangles[:, 1]] - points[triangles[:, 0]], points[triangles[:, 2]] - points[triangles[:, 0]])
for side, sign in ((0, -1), (1, 1)):
    there = parents[:, side] >= 0
    beside = tets[parents[there, side]]
    assert all(set(triangle) < set(tet) for triangle, tet in zip(triangles[there], beside))
    to_tet = points[beside].mean(axis=1) - points[triangles[there]].mean(axis=1)
    assert (np.sign((normals[there] * to_tet).sum(axis=1)) == sign).all()
volumes = np.linalg.det(points[tets[:, 1:]] - points[tets[:, :1]]) / 6
assert (volumes > 0).all()
# A face inside has two tets, one on the boundary of the mesh one: so each interface triangle has both of its tets.
faces = np.sort(tets[:, [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]]].reshape(-1, 3), axis=1)
outer = (np.unique(faces, axis=0, return_counts=True)[1] == 1).sum()
assert (parents < 0).sum() == outer, ((parents < 0).sum(), outer)

found = {}
for key, kind, numbers, sizes in (
    ("boundaries", "Boundary", boundary["BoundaryId"][:], np.linalg.norm(normals, axis=1) / 2),
    ("bodies", "Body", grid["CellData/BodyId"][:], volumes),
):
    names, found[key] = {}, {}
    if f"{kind}Names" in file["names"]:
        for number, name in zip(file[f"names/{kind}Numbers"][:], file[f"names/{kind}Names"][:]):
            names.setdefault(number, []).append(name.decode())
    for number in np.unique(numbers):
        of = numbers == number
        for name in names.get(number, [f"#{number}"]):
            entry = found[key].setdefault(name, [0, 0.0])
            entry[0] += int(of.sum())
            entry[1] += float(sizes[of].sum())
print(json.dumps(found))
