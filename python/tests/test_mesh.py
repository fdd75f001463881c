"""Arrays, blocks, parts, files and pictures of meshes."""

import gc
import json
import os
import subprocess
import sys
import tracemalloc
import weakref

import numpy as np
import pytest
import tetmill
from conftest import BALL
from tetmill import _native


def volumes(points, tets):
    a, b, c, d = (points[tets[:, k]] for k in range(4))
    return np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) / 6


def test_arrays_have_the_documented_shapes_and_types(ball):
    mesh = ball.generate(maxh=0.5, levels=1)
    vertices, tets, faces = (mesh.report["mesh"][key] for key in ("vertices", "tets", "boundary"))
    expected = {
        "points": (np.float64, (vertices, 3)),
        "tets": (np.int32, (tets, 4)),
        "bodies": (np.int32, (tets,)),
        "faces": (np.int32, (faces, 3)),
        "face_tags": (np.int32, (faces,)),
        "face_patches": (np.int32, (faces,)),
    }
    for name, (dtype, shape) in expected.items():
        array = getattr(mesh, name)
        assert (array.dtype, array.shape) == (dtype, shape), name
        assert array.flags.c_contiguous and not array.flags.writeable, name
    assert (volumes(mesh.points, mesh.tets) > 0).all()
    assert np.isclose(volumes(mesh.points, mesh.tets).sum(), mesh.report["mesh"]["volume"])
    assert np.allclose(np.linalg.norm(mesh.points[mesh.faces], axis=2), 1)
    # Normals point out of the body.
    a, b, c = (mesh.points[mesh.faces[:, k]] for k in range(3))
    assert (np.einsum("ij,ij->i", np.cross(b - a, c - a), a) > 0).all()
    assert set(mesh.bodies) == {1} and mesh.body_names == {1: "ball"} and mesh.face_names == {1: "skin"}
    assert len(mesh.faces_named("skin")) == faces and len(mesh.tets_named("ball")) == tets
    assert np.array_equal(mesh.vertices_named("skin"), np.unique(mesh.faces))


def test_arrays_take_over_the_memory_of_the_library(ball):
    mesh = ball.generate(maxh=0.2, levels=2)
    tracemalloc.start()
    try:
        size = mesh.points.nbytes + mesh.tets.nbytes + mesh.bodies.nbytes
        # numpy reports what it allocates, and vectors of the library are not among that.
        assert size > 5e6 and tracemalloc.get_traced_memory()[1] < 0.01 * size
    finally:
        tracemalloc.stop()
    assert mesh.points is mesh.points and mesh.tets is mesh.tets
    part = mesh.parts[0]
    assert np.shares_memory(mesh.points, part.points) and np.shares_memory(mesh.tets, part.tets)
    # The array of rows is a view of the vector, at the same address.
    assert mesh.tets.base.ctypes.data == mesh.tets.ctypes.data


def test_arrays_outlive_their_mesh(ball):
    points, tets = (lambda mesh: (mesh.points, mesh.tets))(ball.generate(maxh=0.4))
    ball.generate(maxh=0.3)
    assert (volumes(points, tets) > 0).all()


def test_memory_is_freed_with_the_last_reference(ball):
    mesh = ball.generate(maxh=0.4, parts=2)
    assert mesh.tets.size and mesh.parts[0].ghosts().tets.size and mesh.parts[0].owners.size
    references = [weakref.ref(mesh), weakref.ref(mesh.parts[0])]
    gc.disable()
    try:
        del mesh
        assert [reference() for reference in references] == [None, None]
    finally:
        gc.enable()


def test_parts_fit_together(ball):
    whole = ball.generate(maxh=0.4, levels=1)
    mesh = ball.generate(maxh=0.4, levels=1, parts=3)
    assert mesh.checksum == whole.checksum and len(mesh.parts) == 3
    assert np.array_equal(np.sort(np.concatenate([part.tet_ids for part in mesh.parts])), np.arange(len(whole.tets)))
    assert mesh.points.shape == whole.points.shape and mesh.faces.shape == whole.faces.shape
    assert np.isclose(volumes(mesh.points, mesh.tets).sum(), volumes(whole.points, whole.tets).sum())
    owned = 0
    for part in mesh.parts:
        owned += np.count_nonzero(part.owners == part.rank)
        offsets, ranks = part.holders
        assert len(offsets) == len(part.shared) + 1
        for place, vertex in enumerate(part.shared):
            holders = ranks[offsets[place] : offsets[place + 1]]
            assert part.rank in holders and part.owners[vertex] in holders and len(holders) > 1
        for rank, vertices in part.neighbours.items():
            other = mesh.parts[rank]
            mine, theirs = part.global_ids[vertices], other.global_ids[other.neighbours[part.rank]]
            assert np.array_equal(mine, theirs)
    assert owned == len(whole.points)


def test_ghosts_are_tets_of_other_parts(ball):
    mesh = ball.generate(maxh=0.4, levels=1, parts=3)
    for part in mesh.parts:
        few, many = part.ghosts("faces"), part.ghosts("vertices")
        assert 0 < len(few.tets) < len(many.tets)
        points = np.concatenate([part.points, many.points])
        ids = np.concatenate([part.global_ids, many.vertex_ids])
        assert (volumes(points, many.tets) > 0).all() and part.rank not in many.owners
        assert np.array_equal(np.sort(ids[many.tets]), np.sort(mesh.tets[many.tet_ids]))
    with pytest.raises(ValueError, match="faces, vertices"):
        mesh.parts[0].ghosts("edges")


def test_blocks_have_all_tets_once(ball):
    mesh = ball.generate(maxh=0.4, levels=2, parts=2)
    seen, volume = [], 0.0
    for block in mesh.blocks(5000):
        assert (block.bodies == 1).all() and len(block.tets) < 6000
        seen.append(block.tet_ids)
        volume += volumes(block.points, block.tets).sum()
    assert np.array_equal(np.sort(np.concatenate(seen)), np.arange(len(mesh.tets)))
    assert np.isclose(volume, mesh.report["mesh"]["volume"])
    part = mesh.parts[1]
    block = next(iter(part.blocks(1)))
    assert np.array_equal(part.points[block.vertices], block.points)


def test_the_command_line_makes_the_same_mesh(ball, tmp_path):
    (tmp_path / "ball.geo").write_text(BALL)
    options = ["--maxh", "0.4", "--levels", "1", "--grading", "0.2", "-n", "2", "--format", "none"]
    command = [os.path.join(os.path.dirname(sys.executable), "tetmill"), "generate", "ball.geo", "-q", *options]
    subprocess.run([*command, "--report", "report.json"], cwd=tmp_path, check=True)
    theirs = json.loads((tmp_path / "report.json").read_text())
    mine = tetmill.Geometry(tmp_path / "ball.geo").generate(maxh=0.4, levels=1, grading=0.2, parts=2)
    assert theirs["mesh"] == mine.report["mesh"] and theirs["mesh"]["checksum"] == mine.checksum
    assert theirs.keys() == mine.report.keys()
    missing = subprocess.run([*command[:2], "none.geo"], cwd=tmp_path, capture_output=True, text=True)
    assert missing.returncode == 2 and "none.geo" in missing.stderr


@pytest.mark.parametrize("method", ["surface", "decompose"])
def test_parts_can_be_meshed_separately(ball, method):
    mesh = ball.generate(maxh=0.4, levels=1, parts=2, method=method)
    assert len(mesh.parts) == 2 and mesh.check() == []
    assert abs(volumes(mesh.points, mesh.tets).sum() - 4.19) < 0.2


def test_a_number_of_tets_is_reached(ball):
    mesh = ball.generate(tets=2e4)
    assert 2e4 <= len(mesh.tets) <= 2.6e4 and mesh.report["wanted"] == "reached"


def test_quality_and_check(ball):
    mesh = ball.generate(maxh=0.4)
    quality = mesh.quality()
    assert quality["tets"] == len(mesh.tets) and quality["vertices"] == len(mesh.points)
    assert quality["inverted"] == 0 and quality["smallest_dihedral"] > 10
    assert mesh.check() == []


@pytest.mark.parametrize("name", ["a.vtu", "a.msh", "a.mesh", "a.vol"])
@pytest.mark.parametrize("parts", [1, 2])
def test_files_are_read_back(ball, tmp_path, name, parts):
    mesh = ball.generate(maxh=0.5, parts=parts)
    written = mesh.write(tmp_path / name)
    assert written.files >= 1 and written.bytes > 1000
    path = tmp_path / ("a.pvtu" if name == "a.vtu" and parts == 2 else name)
    again = tetmill.Geometry(path)
    assert again.is_mesh and len(again.generate().tets) == len(mesh.tets)


def test_hdf5_files_hold_the_adjacency(ball, tmp_path):
    h5py = pytest.importorskip("h5py")
    mesh = ball.generate(maxh=0.5)
    mesh.write(tmp_path / "with", "hdf5", adjacency=True)
    mesh.write(tmp_path / "without", "hdf5")
    with h5py.File(tmp_path / "with.h5") as file:
        group = file["adjacency"]
        counts = len(mesh.points), len(group["edges"]), len(group["faces"]), len(mesh.tets)
        assert counts[0] - counts[1] + counts[2] - counts[3] == 1
        assert group["tet_edges"].shape == (len(mesh.tets), 6)
    with h5py.File(tmp_path / "without.h5") as file:
        assert "adjacency" not in file
    with pytest.raises(ValueError, match="adjacency"):
        mesh.write(tmp_path / "a.vtu", adjacency=True)


def test_folders_and_halos_are_written(ball, tmp_path):
    mesh = ball.generate(maxh=0.5, parts=2)
    mesh.write(tmp_path / "elmer", "elmer", halo="faces")
    assert (tmp_path / "elmer" / "partitioning.2" / "part.1.header").exists()
    with pytest.raises(ValueError, match="halo"):
        mesh.write(tmp_path / "a.msh", halo="faces")
    with pytest.raises(ValueError, match="ending"):
        mesh.write(tmp_path / "a.stl")
    (tmp_path / "file").touch()
    with pytest.raises(tetmill.Error):
        mesh.write(tmp_path / "file" / "a.vol")


def test_pictures_are_png(ball):
    mesh = ball.generate(maxh=0.5, parts=2)
    for view in ({}, {"cut": (0, 0, 0, 1, 0, 0), "color_by": "body", "azimuth": 10, "elevation": 20}):
        image = mesh.picture(width=200, height=100, **view)
        assert image.startswith(b"\x89PNG") and len(image) > 500
    assert "<td>ball</td>" in mesh._repr_html_() and "2 parts" in repr(mesh)
    with pytest.raises(ValueError, match="normal"):
        mesh.picture(cut=(0, 0, 0, 0, 0, 0))


def test_progress_reports_each_stage_in_order(ball):
    seen = []
    ball.generate(maxh=0.3, levels=2, progress=lambda stage, fraction: seen.append((stage, fraction)))
    stages = list(dict.fromkeys(stage for stage, _ in seen))
    assert stages[0] == "mesh" and "refine" in stages and "check" in stages
    for stage in stages:
        fractions = [fraction for of, fraction in seen if of == stage]
        assert fractions == sorted(fractions) and fractions[0] == 0 and fractions[-1] == 1


def test_levels_lead_to_the_coarse_mesh(ball):
    mesh = ball.generate(maxh=0.5, levels=3, parts=2, nested=True)
    for part in mesh.parts:
        levels = part.levels()
        assert [level.pieces for level in levels] == [1, 2, 4, 8]
        assert levels[0].vertex_parents is None and levels[0].tet_parents is None
        for coarse, fine in zip(levels, levels[1:]):
            # Interpolation of a linear function, up to the curvature of the ball.
            middle = coarse.points[fine.vertex_parents].mean(axis=1)
            assert np.linalg.norm(middle - fine.points, axis=1).max() < 0.3 / coarse.pieces**2
            assert (np.bincount(fine.tet_parents, minlength=len(coarse.tets)) == 8).all()
            assert set(fine.neighbours) == set(part.neighbours)
        assert (levels[-1].points == part.points).all() and (levels[-1].tets == part.tets).all()
        assert (levels[-1].owners == part.owners).all()


def test_only_refined_meshes_have_levels(ball):
    mesh = ball.generate(maxh=0.5, levels=1, parts=2, method="surface")
    with pytest.raises(ValueError, match="refine"):
        mesh.parts[0].levels()
    assert ball.generate(maxh=0.5, levels=1).parts[0].levels()[1].tet_parents is None


def test_numbers_of_names(core_and_shell):
    mesh = core_and_shell.generate(maxh=0.5, parts=2)
    (number,) = mesh.numbers_named("outside")
    assert mesh.face_names[number] == "outside"
    assert mesh.part_count == 2 and len(mesh.ghosts()) == 2
    on_sphere = np.flatnonzero(np.linalg.norm(mesh.points, axis=1) > 1 - 1e-9)
    assert (mesh.vertices_named("outside") == on_sphere).all()


def test_sizes_on_the_mesh_before(ball):
    """As in a loop of adaptive refinement: fine at one pole, by sizes for each point or each tet."""
    before = ball.generate(maxh=0.4)

    def wanted(points):
        return 0.06 + 0.3 * np.linalg.norm(points - [0, 0, 1], axis=1)

    centroids = before.points[before.tets].mean(axis=1)
    for sizes in (wanted(before.points), wanted(centroids)):
        background = tetmill.Background.of(before, sizes)
        mesh = ball.generate(size=background)
        edges = mesh.points[mesh.tets[:, :2]]
        lengths, middles = np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1), edges.mean(axis=1)
        near, far = middles[:, 2] > 0.9, middles[:, 2] < -0.5
        assert 2 * lengths[near].mean() < lengths[far].mean()
        assert np.median(lengths / background(middles)) < 1.2
    assert np.allclose(tetmill.Background.of(before, wanted(before.points))(before.points), wanted(before.points))


def test_arrays_are_the_memory_of_the_library(ball):
    mesh = ball.generate(maxh=0.4, levels=1)
    given, arrays = _native.test_addresses(mesh._native)
    assert given == arrays
    assert mesh.points is mesh.parts[0].points and mesh.tets is mesh.parts[0].tets
