"""Checks values in a VTU file: `height` of points is z, `center` of tets is the mean of the corners, `index` of tets is the global id."""

import sys

import meshio
import numpy as np

mesh = meshio.read(sys.argv[1])
assert np.array_equal(mesh.point_data["height"], mesh.points[:, 2])
(tets,) = [block.data for block in mesh.cells if block.type == "tetra"]
assert mesh.cell_data["center"][0].shape == (len(tets), 3)
assert np.allclose(mesh.cell_data["center"][0], mesh.points[tets].mean(axis=1), rtol=0, atol=1e-14)
assert np.array_equal(mesh.cell_data["index"][0], mesh.cell_data["GlobalElementId"][0])
print(len(tets))
