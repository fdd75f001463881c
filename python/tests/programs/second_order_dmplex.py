"""A ball of second order with DMPlex of PETSc on the processes of this job: prints the volume on each level.

    mpirun -n 2 python second_order_dmplex.py

PETSc maps the tets by its coordinate field: the Jacobian determinants come from it.
"""

import ctypes
import sys

import numpy as np
import petsc4py

petsc4py.init(sys.argv)
import tetmill  # noqa: E402
from mpi4py import MPI  # noqa: E402
from petsc4py import PETSc  # noqa: E402

BALL = "algebraic3d solid ball = sphere (0, 0, 0; 1) -bc=3 -bcname=skin; tlo ball;"


def volumes(plex, quadrature):
    """The volume of each cell, by DMPlexComputeCellGeometryFEM, which petsc4py does not have."""
    compute = ctypes.CDLL(PETSc.__file__).DMPlexComputeCellGeometryFEM
    weights = quadrature.getData()[1]
    count = len(weights)
    places, jacobians, inverses, determinants = (np.empty(count * each) for each in (3, 9, 9, 1))
    found = []
    for cell in range(*plex.getHeightStratum(0)):
        pointers = (ctypes.c_void_p(array.ctypes.data) for array in (places, jacobians, inverses, determinants))
        code = compute(ctypes.c_void_p(plex.handle), cell, ctypes.c_void_p(quadrature.handle), *pointers)
        assert code == 0, code
        # The sign of each determinant says whether the tet is turned inside out somewhere.
        signs = np.linalg.det(jacobians.reshape(-1, 3, 3))
        assert (signs > 0).all() or (signs < 0).all()
        found.append(np.abs(determinants) @ weights)
    return np.array(found)


def main():
    comm = MPI.COMM_WORLD
    geometry = tetmill.Geometry.from_text(BALL)
    for level in (0, 1):
        mesh = geometry.generate(maxh=0.5, levels=level, order=2, comm=PETSc.COMM_WORLD)
        plex = mesh.to_dmplex()
        first, last = plex.getDepthStratum(0)
        corners = np.unique(mesh.tets)
        assert last - first == len(corners)
        # All nodes of the mesh are in the coordinates, once.
        section, x = plex.getCoordinateSection(), plex.getCoordinatesLocal().array.reshape(-1, 3)
        assert len(x) == len(mesh.points)
        assert (np.unique(x, axis=0) == np.unique(mesh.points, axis=0)).all()
        offsets = [section.getOffset(vertex) // 3 for vertex in range(first, last)]
        assert (x[offsets] == mesh.points[corners]).all()
        # Those of the faces of the sphere are on it.
        skin = plex.getLabel("Face Sets").getStratumIS(3).getIndices()
        assert len(skin) == len(mesh.faces)
        closure = {point for face in skin for point in plex.getTransitiveClosure(face)[0]}
        nodes = [section.getOffset(point) // 3 for point in closure if section.getDof(point)]
        assert len(nodes) == len(np.unique(mesh.face_nodes))
        assert np.allclose(np.linalg.norm(x[nodes], axis=1), 1, atol=1e-14)
        # The global coordinates have each node once in the whole job.
        assert plex.getCoordinates().getSize() == 3 * mesh.report["mesh"]["vertices"]

        # Exact for polynomials of degree 5.
        element = PETSc.FE().createLagrange(3, 1, True, 2, qorder=5, comm=MPI.COMM_SELF)
        quadrature = element.getQuadrature()
        # Old versions of petsc4py do not count this reference, and would free the element's own.
        quadrature.incRef()
        volume = comm.allreduce(volumes(plex, quadrature).sum())
        if comm.rank == 0:
            print(f"level {level}: {mesh} volumes {volume:.15g} {mesh.report['mesh']['volume']:.15g}", flush=True)


main()
