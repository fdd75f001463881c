"""STEP files, converted by the package gmsh."""

import subprocess
import sys

import numpy as np
import pytest
import tetmill

gmsh = pytest.importorskip("gmsh", reason="no package gmsh, which reads STEP")


# In a process of its own: once OpenCASCADE has read a file in metres, it writes others in metres too.
MAKE = """
import gmsh, sys
gmsh.initialize(interruptible=False)
gmsh.model.occ.addCylinder(0, 0, 0, 0, 0, 2, 1)
gmsh.model.occ.synchronize()
gmsh.write(sys.argv[1])
"""


@pytest.fixture
def cylinder(tmp_path):
    """A STEP file of a cylinder of radius 1 and height 2, in millimetres."""
    path = tmp_path / "cylinder.step"
    subprocess.run([sys.executable, "-c", MAKE, path], check=True, stdout=subprocess.DEVNULL)
    return path


@pytest.mark.parametrize("unit", [".MILLI.", "$", ".CENTI."])
def test_a_part_has_its_size_in_the_unit_of_its_file(cylinder, unit):
    text = cylinder.read_text()
    assert ".MILLI.,.METRE." in text
    cylinder.write_text(text.replace(".MILLI.,.METRE.", f"{unit},.METRE."))
    mesh = tetmill.Geometry(cylinder).generate(maxh=0.5, levels=1)
    assert np.ptp(mesh.points[:, 2]) == pytest.approx(2, rel=1e-9)
    assert mesh.report["mesh"]["volume"] == pytest.approx(2 * np.pi, rel=0.02)
    # On the true cylinder, also after refinement.
    side = np.unique(mesh.faces[np.isin(mesh.face_tags, [1, 2, 3])])
    radii = np.linalg.norm(mesh.points[side, :2], axis=1)
    inner = (mesh.points[side, 2] > 0) & (mesh.points[side, 2] < 2)
    assert inner.any() and np.abs(radii[inner] - 1).max() < 1e-12


def test_a_session_of_gmsh_goes_on(cylinder):
    gmsh.initialize(interruptible=False)
    try:
        gmsh.model.add("mine")
        tetmill.Geometry(cylinder)
        assert gmsh.model.getCurrent() == "mine" and gmsh.model.list() == ["", "mine"]
    finally:
        gmsh.finalize()


def test_damaged_files_and_a_missing_package_are_told(cylinder, monkeypatch):
    with pytest.raises(tetmill.InputError, match="none.step"):
        tetmill.Geometry(cylinder.with_name("none.step"))
    cylinder.write_text(cylinder.read_text()[:900])
    with pytest.raises(tetmill.InputError, match="cylinder.step cannot be read by OpenCASCADE"):
        tetmill.Geometry(cylinder)
    monkeypatch.setitem(sys.modules, "gmsh", None)
    with pytest.raises(tetmill.InputError, match="needs OpenCASCADE") as refused:
        tetmill.Geometry(cylinder)
    assert "pip install gmsh" in refused.value.hint
