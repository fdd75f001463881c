"""Two bodies of second order with DOLFINx on the processes of this job: prints volume, areas and error.

    mpirun -n 2 python second_order_dolfinx.py [ghost mode]
"""

import inspect
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


# Names of DOLFINx that changed between 0.5 and 0.11.
function_space = getattr(fem, "functionspace", None) or fem.FunctionSpace
PREFIX = {"petsc_options_prefix": "ball_"} if "petsc_options_prefix" in inspect.signature(LinearProblem).parameters else {}


def integral(grid, form):
    return grid.comm.allreduce(fem.assemble_scalar(fem.form(form)), MPI.SUM)


def main():
    comm = MPI.COMM_WORLD
    ghost_mode = sys.argv[1] if len(sys.argv) > 1 else "none"
    geometry = tetmill.Geometry.on_first(comm, lambda: tetmill.Geometry.from_text(BODIES))
    for level in (0, 1, 2):
        mesh = geometry.generate(maxh=0.5, levels=level, order=2, comm=comm)
        grid, cell_tags, facet_tags = mesh.to_dolfinx(ghost_mode)
        cells = grid.topology.index_map(3)
        assert cells.size_global == mesh.report["mesh"]["tets"]
        assert cells.size_local == len(mesh.tets), "each tet stays in its process"
        assert grid.geometry.index_map().size_global == mesh.report["mesh"]["vertices"], "all nodes"

        one = fem.Constant(grid, 1.0)
        of_bodies = ufl.Measure("dx", grid, subdomain_data=cell_tags)
        numbers = {name: number for number, name in mesh.body_names.items()}
        volume = integral(grid, one * ufl.dx)
        core = integral(grid, one * of_bodies(numbers["core"]))
        interface = integral(grid, one * ufl.Measure("dS", grid, subdomain_data=facet_tags)(mesh.numbers_named("interface")[0]))
        skin = integral(grid, one * ufl.Measure("ds", grid, subdomain_data=facet_tags)(mesh.numbers_named("skin")[0]))

        # -Δu = 1 with quadratic elements, u = 0 on the boundary: u = (1 - r²) / 6.
        space = function_space(grid, ("Lagrange", 2))
        grid.topology.create_connectivity(2, 3)
        outer = np.concatenate([facet_tags.find(number) for number in mesh.numbers_named("skin")])
        zero = dolfinx.default_scalar_type(0) if hasattr(dolfinx, "default_scalar_type") else 0.0
        fixed = fem.dirichletbc(zero, fem.locate_dofs_topological(space, 2, outer), space)
        u, v = ufl.TrialFunction(space), ufl.TestFunction(space)
        options = {"ksp_type": "cg", "pc_type": "jacobi", "ksp_rtol": 1e-12}
        form = ufl.dot(ufl.grad(u), ufl.grad(v)) * ufl.dx
        problem = LinearProblem(form, one * v * ufl.dx, bcs=[fixed], petsc_options=options, **PREFIX)
        x = ufl.SpatialCoordinate(grid)
        square = integral(grid, (problem.solve() - (1 - ufl.dot(x, x)) / 6) ** 2 * ufl.dx)
        if comm.rank == 0:
            print(f"level {level}: {mesh} volumes {volume:.15g} {mesh.report['mesh']['volume']:.15g} core {core:.12g} "
                  f"areas {interface:.12g} {skin:.12g} error {np.sqrt(square):.10e}", flush=True)


main()
