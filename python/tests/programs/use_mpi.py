"""Meshes on the processes of this job, right and wrong use: prints "passed" once.

    mpirun -n 3 python use_mpi.py FOLDER
"""

import os
import signal
import sys
import threading

import numpy as np
import tetmill
from mpi4py import MPI
from tetmill import _native
from tetmill._mpi import Processes

BALL = "algebraic3d solid ball = sphere (0, 0, 0; 1) -bc=3 -bcname=skin; tlo ball;"
comm = MPI.COMM_WORLD


def raises(kind, text, function):
    """The same exception in all processes, or one that tells what is wrong elsewhere."""
    try:
        function()
    except kind as error:
        assert text in str(error), str(error)
        return
    raise AssertionError(f"no {kind}")


def messages():
    """All operations, with messages in one piece and in many."""
    for chunk in (1 << 30, 64, 1000):
        _native.test_processes(Processes(comm, chunk))
    # Exchanges of two meshes in turns: a message of the next one is not taken for one of this.
    meshes = [Processes(comm), Processes(comm)]
    after, before = (comm.rank + 1) % comm.size, (comm.rank - 1) % comm.size
    for turn in range(400):
        received = meshes[turn % 2].exchange([(after, turn.to_bytes(2, "little"))] if comm.rank != turn % 3 else [])
        expected = [] if before == turn % 3 else [(before, turn.to_bytes(2, "little"))]
        assert received == expected, (turn, received)


def meshes(ball):
    alone = ball.generate(maxh=0.4, levels=2)
    for parts in (None, 1, 2, 7):
        mesh = ball.generate(maxh=0.4, levels=2, parts=parts, comm=comm)
        assert mesh.part_count == (parts or comm.size), mesh
        assert mesh.checksum == alone.checksum
        assert str(alone)[:-1] in str(mesh)
        assert mesh.face_names == {3: "skin"} and mesh.numbers_named("skin") == [3]
        assert mesh.report["mesh"]["checksum"] == alone.checksum and mesh.report["ranks"] == mesh.part_count
        assert mesh.check() == []
        assert comm.allreduce(sum(len(part.tets) for part in mesh.parts)) == len(alone.tets)
        for part in mesh.parts:
            assert (part.points == alone.points[part.global_ids]).all()
            assert (np.sort(part.global_ids[part.tets], axis=1) == np.sort(alone.tets[part.tet_ids], axis=1)).all()
        assert mesh.picture(width=60, height=40)[:4] == b"\x89PNG"
        written = mesh.write(os.path.join(folder, f"elmer{mesh.part_count}"), "elmer")
        assert written.files >= 4 * mesh.part_count
        ghosts = comm.allreduce(sum(len(of.tet_ids) for of in mesh.ghosts()))
        assert (ghosts > 0) == (mesh.part_count > 1)
    return alone


def arrays(ball, alone):
    mesh = ball.generate(maxh=0.4, levels=1, comm=comm)
    # Every vertex of the sphere, also where only another process has the faces.
    radius = np.linalg.norm(mesh.points, axis=1)
    assert (mesh.vertices_named("skin") == np.flatnonzero(radius > 1 - 1e-9)).all()
    owned = int(np.count_nonzero(mesh.parts[0].owners == comm.rank))
    assert comm.allreduce(owned) == mesh.report["mesh"]["vertices"]
    for level, before in zip(mesh.parts[0].levels()[1:], mesh.parts[0].levels()):
        middle = before.points[level.vertex_parents].mean(axis=1)
        assert np.linalg.norm(middle - level.points, axis=1).max() < 0.1
    three = ball.generate(maxh=0.4, parts=3 * comm.size, comm=comm)
    raises(RuntimeError, "has 3 parts", lambda: three.points) if comm.size > 1 else None


def wrong(ball):
    size, rank = comm.size, comm.rank
    raises(TypeError, "communicator of mpi4py", lambda: ball.generate(comm="world"))
    raises(ValueError, "COMM_NULL", lambda: ball.generate(comm=MPI.COMM_NULL))
    last = size - 1
    kinds = (ValueError, tetmill.RankError)
    raises(kinds, "levels cannot be 99", lambda: ball.generate(levels=99 if rank == last else 0, comm=comm))
    if size > 1:
        # Options that differ, and errors of one process only.
        raises(tetmill.InputError, "", lambda: ball.generate(maxh=0.4 + 0.1 * rank, comm=comm))
        raises((ZeroDivisionError, tetmill.Error), "", lambda: ball.generate(size=lambda _: 1 / 0, comm=comm))
    raises((tetmill.InputError, tetmill.RankError), "nowhere.geo",
           lambda: tetmill.Geometry.on_first(comm, lambda: tetmill.Geometry("nowhere.geo")))
    elsewhere = tetmill.Geometry.on_first(comm, lambda: tetmill.Geometry.from_text(BALL))
    if rank > 0:
        raises(RuntimeError, "only process 0", lambda: elsewhere.patches)
        raises(RuntimeError, "only process 0", lambda: elsewhere.generate())
        assert "process 0" in repr(elsewhere)
    assert elsewhere.generate(maxh=0.4, comm=comm).checksum == ball.generate(maxh=0.4).checksum
    # A file that cannot be written is an error in all processes.
    mesh = ball.generate(maxh=0.4, comm=comm)
    raises(tetmill.Error, "", lambda: mesh.write(os.path.join(__file__, "mesh.vtu")))
    # Groups of processes work on their own meshes.
    half = comm.Split(rank % 2, rank)
    assert ball.generate(maxh=0.5, levels=1, comm=half).part_count == half.size
    half.Free()


def interrupted(ball):
    """Ctrl-C in one process ends the run in all."""
    if comm.rank == 0:
        threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
    kind = KeyboardInterrupt if comm.rank == 0 else tetmill.Cancelled
    raises(kind, "", lambda: ball.generate(maxh=0.03, comm=comm))
    assert len(ball.generate(maxh=0.5, comm=comm).parts) == 1


folder = sys.argv[1]
given = tetmill.Geometry.from_text(BALL)
messages()
arrays(given, meshes(given))
wrong(given)
interrupted(given)
comm.Barrier()
if comm.rank == 0:
    print("passed")
