"""Prints the areas and volumes by number that DOLFINx 0.5 finds in an XDMF file of tetmill, as the first rank."""

import json
import sys

from dolfinx.fem import Constant, assemble_scalar, form
from dolfinx.io import XDMFFile
from mpi4py import MPI
from ufl import Measure

with XDMFFile(MPI.COMM_WORLD, sys.argv[1], "r") as file:
    mesh = file.read_mesh(name="mesh")
    bodies = file.read_meshtags(mesh, "mesh")
    mesh.topology.create_connectivity(2, 0)
    mesh.topology.create_connectivity(2, 3)
    boundaries = file.read_meshtags(mesh, "boundary")
total = lambda value: mesh.comm.allreduce(value)
one = Constant(mesh, 1.0)
integral = lambda measure: total(assemble_scalar(form(one * measure)))
dx = Measure("dx", domain=mesh, subdomain_data=bodies)
ds = Measure("ds", domain=mesh, subdomain_data=boundaries)
dS = Measure("dS", domain=mesh, subdomain_data=boundaries)
numbers = lambda tags: sorted(set().union(*mesh.comm.allgather(set(map(int, tags.values)))))
found = {
    "tets": mesh.topology.index_map(3).size_global,
    "volumes": {k: integral(dx(k)) for k in numbers(bodies)},
    "areas": {k: integral(ds(k)) + integral(dS(k)) for k in numbers(boundaries)},
}
if mesh.comm.rank == 0:
    print(json.dumps(found))
