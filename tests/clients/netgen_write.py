"""Writes periodic meshes of first and second order with NETGEN."""

import os
import sys

from netgen.csg import CSGeometry, Plane, Pnt, Vec

geometry = CSGeometry()
left = Plane(Pnt(0, 0, 0), Vec(-1, 0, 0)).bc("left")
right = Plane(Pnt(1, 0, 0), Vec(1, 0, 0)).bc("right")
sides = Plane(Pnt(0, 0, 0), Vec(0, -1, 0)) * Plane(Pnt(0, 1, 0), Vec(0, 1, 0))
sides = sides * Plane(Pnt(0, 0, 0), Vec(0, 0, -1)) * Plane(Pnt(0, 0, 1), Vec(0, 0, 1))
geometry.Add((left * right * sides.bc("side")).mat("block"))
geometry.PeriodicSurfaces(left, right)
mesh = geometry.GenerateMesh(maxh=0.3)
mesh.Save(os.path.join(sys.argv[1], "1.vol"))
mesh.SecondOrder()
mesh.Save(os.path.join(sys.argv[1], "2.vol"))
