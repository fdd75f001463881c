"""Geometries from files, arrays and solids, and sizes by place."""

import numpy as np
import pytest
import tetmill
from tetmill import csg

CUBE = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
# Counterclockwise from outside: -x, +x, -y, +y, -z, +z.
QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
TRIANGLES = np.array([t for a, b, c, d in QUADS for t in ((a, b, c), (a, c, d))])


def test_a_surface_in_memory_is_meshed():
    groups = np.repeat([1, 1, 2, 2, 2, 7], 2)
    cube = tetmill.Geometry.from_surface(CUBE, TRIANGLES, groups, names={1: "ends", 7: "lid"})
    mesh = cube.generate(maxh=0.5)
    assert np.isclose(mesh.report["mesh"]["volume"], 1)
    assert set(mesh.face_tags) == {1, 2, 7} and mesh.face_names[7] == "lid"
    assert np.allclose(mesh.points[mesh.vertices_named("lid")][:, 2], 1)
    plain = tetmill.Geometry.from_surface(CUBE, TRIANGLES)
    assert plain.entities == (1, 6, 12, 8)


def test_a_mesh_in_memory_is_refined():
    source = tetmill.Geometry.from_surface(CUBE, TRIANGLES).generate()
    given = tetmill.Geometry.from_mesh(
        source.points, source.tets, source.bodies, source.faces, source.face_tags, body_names={1: "steel"}
    )
    mesh = given.generate(levels=1, parts=2)
    assert given.is_mesh and len(mesh.tets) == 8 * len(source.tets)
    assert mesh.body_names == {1: "steel"} and set(mesh.face_tags) == set(source.face_tags)
    with pytest.raises(ValueError, match="mesh already"):
        given.generate(maxh=0.1)


def test_solids_make_the_geometry_of_their_text():
    hole = csg.Cylinder((1, 1, 0), (1, 1, 1), 0.4).bc("hole")
    plate = (csg.Brick((4, 2, 0.5), (0, 0, 0)) - hole).named("steel")
    text = """algebraic3d
    solid block = orthobrick (0, 0, 0; 4, 2, 0.5);
    solid hole = cylinder (1, 1, 0; 1, 1, 1; 0.4) -bcname=hole;
    solid steel = block and not hole;
    tlo steel;"""
    mine, theirs = plate.geometry().generate(maxh=0.3), tetmill.Geometry.from_text(text).generate(maxh=0.3)
    assert mine.checksum == theirs.checksum and mine.body_names == theirs.body_names == {1: "steel"}
    assert len(mine.faces_named("hole")) == len(theirs.faces_named("hole")) > 0


def test_operators_nest():
    a, b, c = (csg.Sphere((x, 0, 0), 1) for x in (0, 1.1, 0.3))
    for solid, same in (
        (a | b, a + b),
        (a & b, a * b),
        (a - b, a & ~b),
        ((a | b) - c, ~(~a & ~b) & ~c),
    ):
        one, other = solid.geometry().generate(maxh=0.6), same.geometry().generate(maxh=0.6)
        assert np.isclose(one.report["mesh"]["volume"], other.report["mesh"]["volume"], rtol=1e-3)


def test_all_primitives_are_meshed():
    slab = csg.Plane((0, 0, 0), (0, 0, -1)) & csg.Plane((0, 0, 1), (0, 0, 1))
    solids = [
        csg.Torus((0, 0, 0), (0, 0, 1), 2, 0.5),
        csg.Ellipsoid((0, 0, 0), (2, 0, 0), (0, 1, 0), (0, 0, 1)),
        csg.Cone((0, 0, 0), 1, (0, 0, 1), 0.5) & slab,
        csg.EllipticCylinder((0, 0, 0), (1, 0, 0), (0, 0.5, 0)) & slab,
        csg.Box((0, 0, 0), (1, 2, 3), maxh=0.8, bc=3).move((1, 0, 0)).rotate((0.3, 0, 0)),
    ]
    for solid in solids:
        with pytest.warns() if "rotate" in solid._text else np.errstate():
            assert solid.geometry().generate().report["mesh"]["volume"] > 0


def test_shared_solids_are_one_interface(two_blocks):
    mesh = two_blocks.generate(maxh=0.7)
    seam = mesh.faces_named("seam")
    assert mesh.body_names == {1: "left", 2: "right"} and np.allclose(mesh.points[mesh.faces[seam]][..., 0], 0)
    sides = mesh.parts[0].face_bodies[seam]
    assert (np.sort(sides, axis=1) == [1, 2]).all()


def test_a_surface_has_another_name_at_each_body():
    floor = csg.Plane((0, 0, 0), (0, 0, -1), bc="floor")
    core = (csg.Sphere((0, 0, 0), 0.5, bc="joint") & floor).named("core")
    shell = ((csg.Sphere((0, 0, 0), 1, bc="top") & floor) - core).named("shell")
    mesh = tetmill.Geometry.from_solids(core, shell, boundaries=[(floor, core, "chip")]).generate(maxh=0.3)
    assert set(mesh.face_names.values()) == {"floor", "joint", "top", "chip"}
    assert np.linalg.norm(mesh.points[mesh.vertices_named("chip")], axis=1).max() < 0.5 + 1e-9
    with pytest.raises(ValueError, match="no body"):
        csg.geo_text(core, boundaries=[(floor, shell, "chip")])


def test_wrong_solids_are_refused():
    with pytest.raises(ValueError, match="letters"):
        csg.Sphere((0, 0, 0), 1).named("two words")
    with pytest.raises(ValueError, match="finite"):
        csg.Sphere((0, 0, float("nan")), 1)
    with pytest.raises(ValueError, match="three coordinates"):
        csg.Sphere((0, 0), 1)
    with pytest.raises(TypeError):
        csg.Sphere((0, 0, 0), 1) | 3
    with pytest.raises(tetmill.InputError, match="radius"):
        csg.Sphere((0, 0, 0), -1).geometry()


def test_sizes_follow_a_function_and_its_grid(ball):
    def size(points):
        assert points.shape[1:] == (3,) and points.dtype == np.float64
        return 0.1 + 0.3 * np.abs(points[:, 0])

    def length(mesh, near):
        edges = mesh.points[mesh.tets[:, 1]] - mesh.points[mesh.tets[:, 0]]
        middle = np.abs(mesh.points[mesh.tets].mean(axis=1)[:, 0])
        return np.linalg.norm(edges, axis=1)[middle < 0.2 if near else middle > 0.7].mean()

    by_function = ball.generate(size=size)
    grid = tetmill.Grid.sample(size, (-1, -1, -1), (1, 1, 1), (21, 5, 5))
    by_grid = ball.generate(size=grid)
    for mesh in (by_function, by_grid):
        assert length(mesh, True) < 0.6 * length(mesh, False)
    assert abs(len(by_grid.tets) / len(by_function.tets) - 1) < 0.2
    assert np.allclose(grid([[0.5, 0, 0], [9, 9, 9]]), [0.25, 0.4])


def test_sizes_grow_from_sources(ball):
    plain, fine = ball.generate(), ball.generate(sources=[[0, 0, 0, 0.02]])
    assert len(fine.tets) > 2 * len(plain.tets)


def test_notes_are_warnings():
    with pytest.warns(tetmill.NoteWarning, match="colour"):
        geometry = tetmill.Geometry.from_text("algebraic3d solid b = sphere (0, 0, 0; 1) -colour=3; tlo b;")
    assert len(geometry.notes) == 1


def test_a_geometry_describes_itself(two_blocks):
    assert two_blocks.entities.bodies == 2 and "2 bodies" in repr(two_blocks)
    assert [label.name for label in two_blocks.bodies] == ["left", "right"]
    assert "seam" in {label.name for label in two_blocks.patches}
    assert len(two_blocks.inspect()["bodies"]) == 2
