"""Prints the groups that Gmsh reads from a mesh: name, or `#tag` without one, number of elements and their measure."""

import json
import sys

import gmsh
import numpy as np


def measure(dimension, entity, points):
    """The number of triangles or tets of an entity and their measure."""
    count, total = 0, 0.0
    for nodes in gmsh.model.mesh.getElements(dimension, entity)[2]:
        corners = points[nodes.astype(int).reshape(-1, dimension + 1)]
        edges = corners[:, 1:] - corners[:, :1]
        if dimension == 2:
            total += np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1).sum() / 2
        else:
            total += np.linalg.det(edges).sum() / 6
        count += len(corners)
    return count, total


gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
gmsh.open(sys.argv[1])
tags, coordinates, _ = gmsh.model.mesh.getNodes()
points = np.zeros((int(tags.max()) + 1, 3))
points[tags.astype(int)] = coordinates.reshape(-1, 3)
found = {}
for key, dimension in (("boundaries", 2), ("bodies", 3)):
    found[key] = {}
    for _, tag in gmsh.model.getPhysicalGroups(dimension):
        parts = [measure(dimension, e, points) for e in gmsh.model.getEntitiesForPhysicalGroup(dimension, tag)]
        name = gmsh.model.getPhysicalName(dimension, tag) or f"#{tag}"
        assert name not in found[key], f"two groups are called {name}"
        found[key][name] = [sum(count for count, _ in parts), sum(size for _, size in parts)]
print(json.dumps(found))
