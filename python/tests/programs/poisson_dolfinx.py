"""Poisson's equation with DOLFINx on the processes of this job: prints the error on each level.

    mpirun -n 4 python poisson_dolfinx.py [ghost mode]
"""

import sys

import dolfinx
import numpy as np
import tetmill
import ufl
from dolfinx import fem
from dolfinx.fem.petsc import LinearProblem
from mpi4py import MPI

BODIES = """algebraic3d
solid core = sphere (0, 0, 0; 0.5) -bc=7 -bcname=interface;
solid ball = sphere (0, 0, 0; 1) -bc=3 -bcname=skin;
solid shell = ball and not core;
tlo core; tlo shell;"""


def solve(mesh, ghost_mode):
    """The error in the mean square: conductivity 5 in the core, 1 in the shell, a source of 1."""
    grid, cell_tags, facet_tags = mesh.to_dolfinx(ghost_mode)
    conductivity = fem.Function(fem.FunctionSpace(grid, ("DG", 0)))
    numbers = {name: number for number, name in mesh.body_names.items()}
    # All cells of the process, ghosts too.
    cells = np.concatenate([cell_tags.find(numbers["core"]), cell_tags.find(numbers["shell"])])
    values = np.repeat([5.0, 1.0], [len(cell_tags.find(numbers[name])) for name in ("core", "shell")])
    conductivity.x.array[cells] = values
    conductivity.x.scatter_forward()

    space = fem.FunctionSpace(grid, ("Lagrange", 1))
    skin = np.concatenate([facet_tags.find(number) for number in mesh.numbers_named("skin")])
    grid.topology.create_connectivity(2, 3)
    fixed = fem.dirichletbc(dolfinx.default_scalar_type(0) if hasattr(dolfinx, "default_scalar_type") else 0.0,
                            fem.locate_dofs_topological(space, 2, skin), space)
    u, v = ufl.TrialFunction(space), ufl.TestFunction(space)
    form = conductivity * ufl.dot(ufl.grad(u), ufl.grad(v)) * ufl.dx
    options = {"ksp_type": "cg", "pc_type": "jacobi", "ksp_rtol": 1e-12}
    problem = LinearProblem(form, fem.Constant(grid, 1.0) * v * ufl.dx, [fixed], petsc_options=options)
    solution = problem.solve()

    x = ufl.SpatialCoordinate(grid)
    square = ufl.dot(x, x)
    inside, outside = (1 - 0.25) / 6 + (0.25 - square) / 30, (1 - square) / 6
    exact = ufl.conditional(ufl.gt(conductivity, 2.0), inside, outside)
    error = grid.comm.allreduce(fem.assemble_scalar(fem.form((solution - exact) ** 2 * ufl.dx)), MPI.SUM)
    # The surfaces by their names, each face once.
    areas = ufl.Measure("dS", grid, subdomain_data=facet_tags)(mesh.numbers_named("interface")[0])
    skins = ufl.Measure("ds", grid, subdomain_data=facet_tags)(mesh.numbers_named("skin")[0])
    area = [grid.comm.allreduce(fem.assemble_scalar(fem.form(fem.Constant(grid, 1.0) * of)), MPI.SUM)
            for of in (areas, skins)]
    cells = grid.topology.index_map(3)
    assert cells.size_global == mesh.report["mesh"]["tets"]
    assert cells.size_local == len(mesh.tets), "each tet stays in its process"
    return float(np.sqrt(error)), area


def main():
    comm = MPI.COMM_WORLD
    ghost_mode = sys.argv[1] if len(sys.argv) > 1 else "shared_facet"
    # Only process 0 reads the geometry.
    geometry = tetmill.Geometry.on_first(comm, lambda: tetmill.Geometry.from_text(BODIES))
    for level in (0, 1, 2):
        mesh = geometry.generate(maxh=0.4, levels=level, comm=comm)
        error, (interface, skin) = solve(mesh, ghost_mode)
        if comm.rank == 0:
            print(f"level {level}: {mesh} error {error:.10e} areas {interface:.8f} {skin:.8f}", flush=True)


main()
