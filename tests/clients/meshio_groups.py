"""Prints the groups that meshio reads from a Gmsh mesh: name, or `#tag` without one, number of elements and their measure."""

import json
import sys

import meshio
import numpy as np


def sizes(kind, cells, points):
    corners = points[cells]
    edges = corners[:, 1:] - corners[:, :1]
    if kind == "triangle":
        return np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1) / 2
    return np.linalg.det(edges) / 6


mesh = meshio.read(sys.argv[1])
names = {(int(tag), int(dimension)): name for name, (tag, dimension) in mesh.field_data.items()}
found = {"boundaries": {}, "bodies": {}}


def add(key, name, count, size):
    entry = found[key].setdefault(name, [0, 0.0])
    entry[0] += int(count)
    entry[1] += float(size)


for block, cells in enumerate(mesh.cells):
    key, dimension = ("boundaries", 2) if cells.type == "triangle" else ("bodies", 3)
    size = sizes(cells.type, cells.data, mesh.points)
    sets = {name: places[block].astype(int) for name, places in mesh.cell_sets.items() if not name.startswith("gmsh:")}
    if sets:
        for name, places in sets.items():
            if len(places):
                add(key, name, len(places), size[places].sum())
    else:
        tags = mesh.cell_data["gmsh:physical"][block]
        for tag in np.unique(tags):
            add(key, names.get((int(tag), dimension), f"#{tag}"), (tags == tag).sum(), size[tags == tag].sum())
print(json.dumps(found))
