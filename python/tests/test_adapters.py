"""Meshes of other packages. Each test needs its package."""

import numpy as np
import pytest


def test_scikit_fem_has_all_names(two_blocks):
    pytest.importorskip("skfem")
    mesh = two_blocks.generate(maxh=0.7)
    made = mesh.to_skfem()
    assert set(made.boundaries) == {"cold", "hot", "sides", "seam"} and set(made.subdomains) == {"left", "right"}
    for name, facets in made.boundaries.items():
        mine = np.sort(np.sort(mesh.faces[mesh.faces_named(name)], axis=1), axis=0)
        theirs = np.sort(np.sort(made.facets[:, facets].T, axis=1), axis=0)
        assert np.array_equal(mine, theirs), name
    assert np.allclose(made.p[0, made.facets[:, made.boundaries["seam"]]], 0)


def test_meshio_has_tags_and_names(two_blocks, tmp_path):
    meshio = pytest.importorskip("meshio")
    mesh = two_blocks.generate(maxh=0.7)
    made = mesh.to_meshio()
    meshio.write(tmp_path / "a.msh", made, file_format="gmsh22", binary=False)
    again = meshio.read(tmp_path / "a.msh")
    assert len(again.cells_dict["tetra"]) == len(mesh.tets)
    assert again.field_data["seam"][1] == 2 and again.field_data["left"][1] == 3


def test_pyvista_measures_the_same_volume(two_blocks):
    pytest.importorskip("pyvista")
    mesh = two_blocks.generate(maxh=0.7, parts=2)
    made = mesh.to_pyvista()
    assert np.isclose(made.volume, 6) and set(made["body"]) == {1, 2} and set(made["part"]) == {0, 1}


def test_ngsolve_integrates_over_bodies_and_boundaries(two_blocks):
    ngsolve = pytest.importorskip("ngsolve")
    made = two_blocks.generate(maxh=0.7).to_ngsolve()
    assert set(made.GetMaterials()) == {"left", "right"} and "hot" in made.GetBoundaries()
    assert np.isclose(ngsolve.Integrate(1, made, definedon=made.Materials("left")), 3)
    assert np.isclose(ngsolve.Integrate(1, made, definedon=made.Boundaries("hot")), 3)


def test_mfem_has_the_attributes(two_blocks):
    mfem = pytest.importorskip("mfem.ser")
    mesh = two_blocks.generate(maxh=0.7)
    made = mesh.to_mfem()
    assert (made.GetNV(), made.GetNE(), made.GetNBE()) == tuple(map(len, (mesh.points, mesh.tets, mesh.faces)))
    assert set(made.GetBdrAttributeArray()) == set(mesh.face_tags)
    assert isinstance(made, mfem.Mesh) and np.isclose(sum(made.GetElementVolume(i) for i in range(made.GetNE())), 6)
