"""STEP files: units, names, and vertices on the true surfaces."""

import pathlib
import subprocess
import sys

import numpy as np
import pytest
import tetmill

GEOMETRIES = pathlib.Path(__file__).parents[2] / "geometries" / "step"


@pytest.mark.parametrize(("unit", "millimetres"), [("file", 25.4), ("mm", 1), ("m", 1000)])
def test_an_assembly_has_its_size_in_the_wanted_unit(unit, millimetres):
    geometry = tetmill.Geometry(GEOMETRIES / "assembly.step", unit=unit)
    assert [label.names[0] for label in geometry.bodies] == ["plate"] + ["bolt"] * 4
    mesh = geometry.generate(levels=1)
    bolt = np.pi * (4 * 7 + 16 * 3)
    assert mesh.report["mesh"]["volume"] * millimetres**3 == pytest.approx(8000 + 4 * bolt, rel=0.02)


def test_an_unknown_unit_is_refused():
    with pytest.raises(ValueError, match="furlong"):
        tetmill.Geometry(GEOMETRIES / "assembly.step", unit="furlong")


def test_chosen_solids_are_meshed_alone():
    for solids, names in [("bolt", ["bolt"] * 4), (1, ["plate"]), (["plate", 3], ["plate", "bolt"])]:
        geometry = tetmill.Geometry(GEOMETRIES / "assembly.step", solids=solids)
        assert [label.names[0] for label in geometry.bodies] == names
    with pytest.raises(tetmill.InputError, match="no solid `nut`"):
        tetmill.Geometry(GEOMETRIES / "assembly.step", solids=["nut"])


def test_solids_that_overlap_are_cut_out_of_each_other():
    path = GEOMETRIES / "press_fit.step"
    with pytest.warns(tetmill.NoteWarning, match="solids overlap: cut "):
        geometry = tetmill.Geometry(path, unit="mm", overlap_to="smaller")
    mesh = geometry.generate(levels=1)
    assert mesh.report["mesh"]["volume"] == pytest.approx(18577.6, rel=5e-3)
    with pytest.raises(ValueError, match="overlap_to"):
        tetmill.Geometry(path, overlap_to="larger")


def test_solids_of_several_files_share_faces():
    with pytest.warns(tetmill.NoteWarning, match="2 common faces"):
        geometry = tetmill.Geometry(GEOMETRIES / "plate.step", GEOMETRIES / "bolt.step", unit="mm")
    assert [label.names[0] for label in geometry.bodies] == ["plate", "bolt"]
    mesh = geometry.generate(levels=1)
    exact = (40 * 30 - 25 * np.pi) * 6 + np.pi * (25 * 11 + 81 * 4)
    assert mesh.report["mesh"]["volume"] == pytest.approx(exact, rel=5e-3)


# In a process of its own: once OpenCASCADE has read a file in metres, it writes others in metres too.
MAKE = """
import gmsh, sys
gmsh.initialize(interruptible=False)
gmsh.model.occ.addCylinder(0, 0, 0, 0, 0, 2, 1)
gmsh.model.occ.synchronize()
gmsh.write(sys.argv[1])
"""


def test_vertices_of_a_part_of_opencascade_are_on_its_surfaces(tmp_path):
    pytest.importorskip("gmsh", reason="no package gmsh, which writes STEP")
    path = tmp_path / "cylinder.step"
    subprocess.run([sys.executable, "-c", MAKE, path], check=True, stdout=subprocess.DEVNULL)
    mesh = tetmill.Geometry(path).generate(maxh=0.5, levels=1)
    assert np.ptp(mesh.points[:, 2]) == pytest.approx(2, rel=1e-9)
    side = np.unique(mesh.faces)
    radii = np.linalg.norm(mesh.points[side, :2], axis=1)
    inner = (mesh.points[side, 2] > 0) & (mesh.points[side, 2] < 2)
    assert inner.any() and np.abs(radii[inner] - 1).max() < 1e-12


def test_damaged_files_are_told_with_the_line(tmp_path):
    path = tmp_path / "part.step"
    text = (GEOMETRIES / "assembly.step").read_text()
    path.write_text(text[:900])
    with pytest.raises(tetmill.InputError, match=r"part.step: line \d+: "):
        tetmill.Geometry(path)
