"""Geometries that several tests mesh."""

import pytest
import tetmill
from tetmill.csg import Brick, Plane, Sphere

BALL = "algebraic3d solid ball = sphere (0, 0, 0; 1) -bcname=skin; tlo ball;"


@pytest.fixture(scope="session")
def ball() -> tetmill.Geometry:
    return tetmill.Geometry.from_text(BALL)


@pytest.fixture(scope="session")
def core_and_shell() -> tetmill.Geometry:
    """A ball of radius 0.5 inside one of radius 1."""
    core = Sphere((0, 0, 0), 0.5, bc="interface").named("core")
    shell = (Sphere((0, 0, 0), 1, bc="outside") - core).named("shell")
    return tetmill.Geometry.from_solids(core, shell)


@pytest.fixture(scope="session")
def two_blocks() -> tetmill.Geometry:
    """Two blocks that meet at x = 0."""
    seam = Plane((0, 0, 0), (1, 0, 0), bc="seam")
    ends = Plane((-1, 0, 0), (-1, 0, 0), bc="cold") & Plane((1, 0, 0), (1, 0, 0), bc="hot")
    bar = Brick((-2, 0, 0), (2, 3, 1), bc="sides") & ends
    return tetmill.Geometry.from_solids((bar & seam).named("left"), (bar - seam).named("right"))
