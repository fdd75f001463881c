"""Ends the job: one process cannot read a message."""

import tetmill
from mpi4py import MPI
from tetmill import _mpi

if MPI.COMM_WORLD.rank == 1:
    _mpi.Processes._receive = lambda *_: 1 / 0

ball = tetmill.Geometry.from_text("algebraic3d solid ball = sphere (0, 0, 0; 1); tlo ball;")
ball.generate(maxh=0.5, comm=MPI.COMM_WORLD)
