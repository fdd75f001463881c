"""Writes meshes with Gmsh: two boxes with surfaces and volumes in several groups, and one end periodic to the other."""

import os
import sys

import gmsh

gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
boxes = [gmsh.model.occ.addBox(x, 0, 0, 1, 1, 1) for x in (0, 1)]
gmsh.model.occ.fragment([(3, boxes[0])], [(3, boxes[1])])
gmsh.model.occ.synchronize()


def at(low, high):
    return [tag for _, tag in gmsh.model.getEntitiesInBoundingBox(*[c - 1e-6 for c in low], *[c + 1e-6 for c in high], 2)]


surfaces = [tag for _, tag in gmsh.model.getEntities(2)]
volumes = [tag for _, tag in gmsh.model.getEntities(3)]
left, right, middle = at((0, 0, 0), (0, 1, 1)), at((2, 0, 0), (2, 1, 1)), at((1, 0, 0), (1, 1, 1))
outer = [tag for tag in surfaces if tag not in middle]
gmsh.model.mesh.setPeriodic(2, right, left, [1, 0, 0, 2, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1])
gmsh.model.addPhysicalGroup(2, outer, 10, "outer")
gmsh.model.addPhysicalGroup(2, left + right, 20, "ends")
gmsh.model.addPhysicalGroup(2, left, 30, "clamp")
gmsh.model.addPhysicalGroup(3, volumes, 5, "all")
gmsh.model.addPhysicalGroup(3, volumes[:1], 6, "first")
gmsh.option.setNumber("Mesh.MeshSizeMax", 0.4)
gmsh.model.mesh.generate(3)
for order in (1, 2):
    gmsh.model.mesh.setOrder(order)
    for version in (2.2, 4.1):
        for binary in (0, 1):
            gmsh.option.setNumber("Mesh.MshFileVersion", version)
            gmsh.option.setNumber("Mesh.Binary", binary)
            gmsh.write(os.path.join(sys.argv[1], f"{version}-{binary}-{order}.msh"))
