"""Opens STEM.msh and STEM_1.msh, STEM_2.msh, … with Gmsh. Checks that the files of parts have the elements and ghosts
of the joined file, and prints what that has: partitions, ghosts by part, and groups as gmsh_groups.py does."""

import json
import sys

import gmsh
import numpy as np


def elements(dimension, entity):
    """The nodes of each element of an entity, by tag."""
    found = {}
    _, tags, nodes = gmsh.model.mesh.getElements(dimension, entity)
    for of_type, nodes_of_type in zip(tags, nodes):
        found.update(zip(of_type.tolist(), nodes_of_type.reshape(len(of_type), -1).tolist()))
    return found


def load(path):
    """Number of partitions; groups with the nodes of their elements; ghosts with owners by part; points by tag."""
    gmsh.clear()
    gmsh.logger.start()
    gmsh.open(path)
    complaints = [line for line in gmsh.logger.get() if line.startswith(("Warning", "Error"))]
    gmsh.logger.stop()
    assert not complaints, complaints
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    points = dict(zip(tags.tolist(), coordinates.reshape(-1, 3)))
    groups = {}
    for dimension, tag in gmsh.model.getPhysicalGroups():
        name = gmsh.model.getPhysicalName(dimension, tag) or f"#{tag}"
        entities = gmsh.model.getEntitiesForPhysicalGroup(dimension, tag)
        groups[dimension, name] = {}
        for entity in entities:
            groups[dimension, name].update(elements(dimension, entity))
    ghosts = {}
    for dimension, entity in gmsh.model.getEntities(3):
        if gmsh.model.getType(dimension, entity) == "Ghost volume":
            (part,) = gmsh.model.getPartitions(dimension, entity)
            tags, owners = gmsh.model.mesh.getGhostElements(dimension, entity)
            nodes = elements(dimension, entity)
            assert set(nodes) == set(tags.tolist())
            ghosts[int(part)] = {tag: (owner, nodes[tag]) for tag, owner in zip(tags.tolist(), owners.tolist())}
    return gmsh.model.getNumberOfPartitions(), groups, ghosts, points


def measure(dimension, of_group, points):
    corners = np.array([[points[node] for node in nodes[: dimension + 1]] for nodes in of_group.values()])
    edges = corners[:, 1:] - corners[:, :1]
    if dimension == 2:
        return np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1).sum() / 2
    return np.linalg.det(edges).sum() / 6


def expect_middles(groups, points):
    """Nodes on the edges of flat elements are their middles."""
    edges = {6: [(0, 1), (1, 2), (2, 0)], 10: [(0, 1), (1, 2), (2, 0), (0, 3), (2, 3), (1, 3)]}
    for of_group in groups.values():
        for nodes in of_group.values():
            for node, (i, j) in zip(nodes[len(nodes) // 3 + 1 :], edges.get(len(nodes), [])):
                assert np.abs((points[nodes[i]] + points[nodes[j]]) / 2 - points[node]).max() < 1e-12


gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
stem = sys.argv[1]
partitions, groups, ghosts, points = load(f"{stem}.msh")
if "flat" in sys.argv[2:]:
    expect_middles(groups, points)
covered = {key: {} for key in groups}
for part in range(1, max(partitions, 1) + 1):
    of_part = load(f"{stem}_{part}.msh")
    assert of_part[0] == partitions
    assert of_part[2].get(part, {}) == ghosts.get(part, {}), f"the ghosts of part {part}"
    assert all((points[node] == point).all() for node, point in of_part[3].items())
    for key, of_group in of_part[1].items():
        assert not covered[key].keys() & of_group.keys(), "an element is in two parts"
        covered[key].update(of_group)
assert covered == groups
found = {"partitions": partitions, "ghosts": [len(ghosts[part]) for part in sorted(ghosts)]}
for key, dimension in (("boundaries", 2), ("bodies", 3)):
    of_dimension = {name: group for (d, name), group in groups.items() if d == dimension and group}
    found[key] = {name: [len(group), measure(dimension, group, points)] for name, group in of_dimension.items()}
print(json.dumps(found))
