"""Poisson's equation with DMPlex of PETSc on the processes of this job: prints the error on each level.

    mpirun -n 4 python poisson_dmplex.py

Linear elements are assembled by hand on the vertices of the plex.
"""

import sys

import numpy as np
import petsc4py

petsc4py.init(sys.argv)
import tetmill  # noqa: E402
from mpi4py import MPI  # noqa: E402
from petsc4py import PETSc  # noqa: E402

BALL = "algebraic3d solid ball = sphere (0, 0, 0; 1) -bc=3 -bcname=skin; tlo ball;"


def exact(x):
    return np.sin(2 * x[..., 0]) * np.cos(x[..., 1]) + x[..., 2] ** 2


def source(x):
    return 5 * np.sin(2 * x[..., 0]) * np.cos(x[..., 1]) - 2


def solve(mesh):
    plex = mesh.to_dmplex()
    plex.setNumFields(1)
    plex.setSection(plex.createSection([1], [1, 0, 0, 0]))
    first, last = plex.getDepthStratum(0)
    assert last - first == len(mesh.points)
    section, numbering = plex.getSection(), plex.getLGMap().getIndices()

    # Tets as PETSc has them: their vertices must be those that were given.
    cells = range(*plex.getHeightStratum(0))
    closures = [plex.getTransitiveClosure(cell)[0] for cell in cells]
    tets = np.array([closure[(closure >= first) & (closure < last)] - first for closure in closures])
    assert (np.sort(tets, axis=1) == np.sort(mesh.tets, axis=1)).all()
    assert all(plex.computeCellGeometryFVM(cell)[0] > 0 for cell in cells)
    x = plex.getCoordinatesLocal().array.reshape(-1, 3)
    assert (x == mesh.points).all()

    corners = x[tets]
    edges = corners[:, 1:] - corners[:, :1]
    volumes = np.abs(np.linalg.det(edges)) / 6
    gradients = np.linalg.inv(edges).transpose(0, 2, 1)
    gradients = np.concatenate([-gradients.sum(axis=1, keepdims=True), gradients], axis=1)
    stiffness = np.einsum("tid,tjd,t->tij", gradients, gradients, volumes)
    load = np.einsum("tj,ij,t->ti", source(corners), (np.ones((4, 4)) + np.eye(4)) / 20, volumes)

    unknowns = np.array([section.getOffset(first + vertex) for vertex in range(len(x))])
    numbers = numbering[unknowns].astype(PETSc.IntType)
    matrix, right, solution = plex.createMatrix(), plex.createGlobalVec(), plex.createGlobalVec()
    for tet, element, values in zip(numbers[tets], stiffness, load):
        matrix.setValues(tet, tet, element, addv=PETSc.InsertMode.ADD)
        right.setValues(tet, values, addv=PETSc.InsertMode.ADD)
    matrix.assemble()
    right.assemble()

    # The boundary by its name: faces, completed by their vertices in all processes.
    plex.createLabel("skin")
    skin = plex.getLabel("skin")
    for number in mesh.numbers_named("skin"):
        for point in plex.getStratumIS("Face Sets", number).getIndices():
            skin.setValue(point, 1)
    plex.labelComplete(skin)
    points = plex.getStratumIS("skin", 1).getIndices()
    vertices = points[(points >= first) & (points < last)] - first
    assert (np.sort(vertices) == mesh.vertices_named("skin")).all()
    fixed = plex.createGlobalVec()
    fixed.setValues(numbers[vertices], exact(x[vertices]))
    fixed.assemble()
    matrix.zeroRowsColumns(numbers[vertices], 1.0, fixed, right)

    solver = PETSc.KSP().create(plex.comm)
    solver.setOperators(matrix)
    solver.setType("cg")
    solver.getPC().setType("jacobi")
    solver.setTolerances(rtol=1e-12)
    solver.solve(right, solution)
    local = plex.createLocalVec()
    plex.globalToLocal(solution, local)
    off = (local.array[unknowns] - exact(x))[tets]
    square = float(np.einsum("ti,ij,tj,t->", off, (np.ones((4, 4)) + np.eye(4)) / 20, off, volumes))
    return np.sqrt(MPI.COMM_WORLD.allreduce(square))


def main():
    comm = MPI.COMM_WORLD
    geometry = tetmill.Geometry.from_text(BALL)
    for level in (0, 1, 2):
        # A communicator of petsc4py does as well.
        mesh = geometry.generate(maxh=0.5, levels=level, comm=PETSc.COMM_WORLD)
        error = solve(mesh)
        if comm.rank == 0:
            print(f"level {level}: {mesh} error {error:.10e}", flush=True)


main()
