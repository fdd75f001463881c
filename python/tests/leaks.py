"""Prints how much the memory of this process grows while it makes meshes: bytes.

A program of its own, with one arena of the allocator (MALLOC_ARENA_MAX=1): several of them keep
different amounts of free memory from run to run.
"""

import gc
import os

import numpy as np
import tetmill
from conftest import BALL


def resident():
    gc.collect()
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def once(ball):
    mesh = ball.generate(maxh=0.2, levels=2, parts=2)
    assert mesh.points.size and mesh.tets.size and mesh.faces.size and mesh.parts[0].ghosts().tets.size
    for _ in mesh.blocks():
        pass
    mesh.picture(width=100, height=100)
    ball.generate(size=lambda points: np.full(len(points), 0.5))
    for refused in (lambda: ball.generate(size=lambda _: 1 / 0), lambda: tetmill.Geometry.from_text("nonsense")):
        try:
            refused()
        except (ZeroDivisionError, tetmill.Error):
            continue
        raise AssertionError("no exception")


def main():
    ball = tetmill.Geometry.from_text(BALL)
    for _ in range(5):
        once(ball)
    before = resident()
    for _ in range(20):
        once(ball)
    print(resident() - before, ball.generate(maxh=0.2, levels=2).tets.nbytes)


if __name__ == "__main__":
    main()
