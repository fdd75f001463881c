"""Prints the number of tets and the volume that PETSc's DMPlex finds in an HDF5 file of tetmill, as the first rank."""

import json
import sys

from mpi4py import MPI
from petsc4py import PETSc

viewer = PETSc.Viewer().createHDF5(sys.argv[1], "r", comm=MPI.COMM_WORLD)
viewer.pushFormat(PETSc.Viewer.Format.HDF5_XDMF)
plex = PETSc.DMPlex().create(comm=MPI.COMM_WORLD)
plex.load(viewer)
plex.interpolate()
first, end = plex.getHeightStratum(0)
volumes = [plex.computeCellGeometryFVM(cell)[0] for cell in range(first, end)]
found = {"tets": MPI.COMM_WORLD.allreduce(end - first), "volume": MPI.COMM_WORLD.allreduce(sum(volumes))}
if MPI.COMM_WORLD.rank == 0:
    print(json.dumps(found))
