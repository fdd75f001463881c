"""Meshes of second order: nodes, adapters, files, and the order of convergence that curved tets give."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest

import tetmill

BALL = "algebraic3d\nsolid ball = sphere (0, 0, 0; 1) -bcname=skin;\ntlo ball;\n"
#: Ends of the edges of a tet, in the order of the nodes on them.
EDGES = np.array([[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]])


@pytest.fixture(scope="module")
def ball() -> tetmill.Geometry:
    return tetmill.Geometry.from_text(BALL)


def test_nodes_are_in_the_order_of_vtk_and_those_of_the_boundary_on_the_sphere(ball: tetmill.Geometry) -> None:
    for parts in (1, 3):
        mesh = ball.generate(maxh=0.6, levels=1, order=2, parts=parts)
        assert mesh.order == 2 and mesh.report["mesh"]["scaled_jacobian"] > 0.3
        assert mesh.tet_nodes.shape == (len(mesh.tets), 10) and mesh.face_nodes.shape == (len(mesh.faces), 6)
        assert (mesh.tet_nodes[:, :4] == mesh.tets).all() and (mesh.face_nodes[:, :3] == mesh.faces).all()
        corners = mesh.points[mesh.tets]
        middles = corners[:, EDGES].mean(axis=2)
        lengths = np.linalg.norm(corners[:, EDGES[:, 0]] - corners[:, EDGES[:, 1]], axis=2)
        off = np.linalg.norm(mesh.points[mesh.tet_nodes[:, 4:]] - middles, axis=2)
        assert (off < 0.2 * lengths).all() and off.max() > 1e-3
        on_skin = mesh.vertices_named("skin")
        assert len(on_skin) == len(np.unique(mesh.face_nodes))
        assert np.allclose(np.linalg.norm(mesh.points[on_skin], axis=1), 1, atol=1e-14)


def test_the_nodes_of_order_1_are_the_corners(ball: tetmill.Geometry) -> None:
    mesh = ball.generate(maxh=0.6)
    assert mesh.order == 1 and mesh.tet_nodes is mesh.tets and (mesh.face_nodes == mesh.faces).all()
    with pytest.raises(ValueError, match="order"):
        ball.generate(order=3)


def test_parts_without_faces_have_six_nodes_for_each_of_none(ball: tetmill.Geometry) -> None:
    mesh = ball.generate(maxh=0.2, order=2, parts=32)
    assert any(len(part.faces) == 0 for part in mesh.parts), "a part inside the ball"
    for part in mesh.parts:
        assert part.face_nodes.shape == (len(part.faces), 6) and part.tet_nodes.shape == (len(part.tets), 10)
    assert np.allclose(np.linalg.norm(mesh.points[mesh.face_nodes], axis=2), 1, atol=1e-14)


@pytest.mark.parametrize("more", [{}, {"ascii": True}, {"halo": "vertices"}])
def test_gmsh_4_files_have_the_curved_tets(ball: tetmill.Geometry, tmp_path, more) -> None:  # type: ignore[no-untyped-def]
    mesh = ball.generate(maxh=0.5, order=2, parts=3)
    assert mesh.write(tmp_path / "all.msh", "msh4", **more).files == 1
    assert mesh.write(tmp_path / "part", "msh4-parts", **more).files == 3
    assert (tmp_path / "all.msh").read_bytes().startswith(b"$MeshFormat\n4.1 %d 8\n" % ("ascii" not in more))
    command = [os.path.join(os.path.dirname(sys.executable), "tetmill"), "quality", "--json"]
    files = [str(tmp_path / name) for name in ("all.msh", "part_1.msh", "part_2.msh", "part_3.msh")]
    done = subprocess.run([*command, *files], capture_output=True, text=True, check=True)
    whole, *parts = json.loads(done.stdout)["meshes"]
    assert all(of["order"] == 2 and of["not_valid"] == 0 for of in (whole, *parts))
    # Ghosts are left out.
    assert [of["tets"] for of in parts] == [len(part.tets) for part in mesh.parts]
    assert whole["tets"] == len(mesh.tets)
    volume = mesh.report["mesh"]["volume"]
    assert whole["volume"] == pytest.approx(volume, rel=1e-12)
    assert sum(of["volume"] for of in parts) == pytest.approx(volume, rel=1e-12)


def test_only_gmsh_4_is_text_or_binary(ball: tetmill.Geometry, tmp_path) -> None:  # type: ignore[no-untyped-def]
    mesh = ball.generate(maxh=0.6)
    with pytest.raises(ValueError, match="msh4"):
        mesh.write(tmp_path / "a.msh", ascii=True)


def test_adapters_take_the_nodes(ball: tetmill.Geometry) -> None:
    mesh = ball.generate(maxh=0.6, order=2)
    volume = mesh.report["mesh"]["volume"]
    meshio = pytest.importorskip("meshio")
    cells = meshio.Mesh.cells_dict.fget(mesh.to_meshio())
    assert cells["tetra10"].shape == mesh.tet_nodes.shape and cells["triangle6"].shape == mesh.face_nodes.shape
    mfem = pytest.importorskip("mfem.ser")
    curved = mesh.to_mfem()
    elements = mfem.H1_FECollection(1, 3)
    space = mfem.FiniteElementSpace(curved, elements)
    form = mfem.LinearForm(space)
    one = mfem.ConstantCoefficient(1.0)
    form.AddDomainIntegrator(mfem.DomainLFIntegrator(one, 4, 4))
    form.Assemble()
    assert form.Sum() == pytest.approx(volume, abs=1e-10)


def solved(mesh) -> float:  # type: ignore[no-untyped-def]
    """The error in the mean square of -Δu = 1, u = 0 on the boundary, with quadratic elements; on the
    ball u = (1 - r²)/6."""
    import skfem
    from skfem.models.poisson import laplace, unit_load

    basis = skfem.Basis(mesh, skfem.ElementTetP2(), intorder=6)
    system = skfem.condense(laplace.assemble(basis), unit_load.assemble(basis), D=basis.get_dofs())
    u = basis.interpolate(skfem.solve(*system))
    r2 = (basis.global_coordinates() ** 2).sum(axis=0)
    return float(np.sqrt((((u - (1 - r2) / 6) ** 2) * basis.dx).sum()))


def test_the_error_falls_as_h3_on_curved_tets_and_as_h2_on_straight_ones(ball: tetmill.Geometry) -> None:
    skfem = pytest.importorskip("skfem")
    curved, straight = [], []
    for levels in range(3):
        mesh = ball.generate(maxh=0.7, levels=levels, order=2)
        curved.append(solved(mesh.to_skfem()))
        # The same corners with nodes in the middles of edges: what snapping is good for.
        flat = skfem.MeshTet2.from_mesh(ball.generate(maxh=0.7, levels=levels).to_skfem())
        straight.append(solved(flat))
    rates = [np.log2(np.array(errors[:-1]) / errors[1:]) for errors in (curved, straight)]
    assert (rates[0] > 2.8).all(), (curved, rates)
    assert (rates[1] < 2.2).all(), (straight, rates)


def solved_by_mfem(mesh) -> float:  # type: ignore[no-untyped-def]
    """As `solved`, with quadratic elements of MFEM."""
    import mfem.ser as mfem

    class Exact(mfem.PyCoefficient):
        def EvalValue(self, x):  # type: ignore[no-untyped-def]
            return (1 - x @ x) / 6

    exact, source = Exact(), mfem.ConstantCoefficient(1.0)
    elements = mfem.H1_FECollection(2, 3)
    space = mfem.FiniteElementSpace(mesh, elements)
    marked = mfem.intArray([1] * mesh.bdr_attributes.Max())
    fixed = mfem.intArray()
    space.GetEssentialTrueDofs(marked, fixed)
    right, form = mfem.LinearForm(space), mfem.BilinearForm(space)
    right.AddDomainIntegrator(mfem.DomainLFIntegrator(source, 2, 4))
    right.Assemble()
    form.AddDomainIntegrator(mfem.DiffusionIntegrator())
    form.Assemble()
    solution = mfem.GridFunction(space)
    solution.Assign(0.0)
    matrix, load, unknowns = mfem.SparseMatrix(), mfem.Vector(), mfem.Vector()
    form.FormLinearSystem(fixed, solution, right, matrix, unknowns, load)
    smoother = mfem.GSSmoother(matrix)
    mfem.PCG(matrix, smoother, load, unknowns, 0, 2000, 1e-24, 0.0)
    form.RecoverFEMSolution(unknowns, right, solution)
    return float(solution.ComputeL2Error(exact))


@pytest.mark.parametrize("by", ["file", "adapter"])
def test_mfem_reads_curved_tets_and_its_error_falls_as_h3(  # type: ignore[no-untyped-def]
    ball: tetmill.Geometry, tmp_path, by: str
) -> None:
    mfem = pytest.importorskip("mfem.ser")
    curved, straight = [], []
    for levels in range(3):
        mesh = ball.generate(maxh=0.7, levels=levels, order=2)
        if by == "adapter":
            made = mesh.to_mfem()
        else:
            # A part alone is a mesh of its own.
            mesh.write(tmp_path / f"ball{levels}", "mfem")
            made = mfem.Mesh(str(tmp_path / f"ball{levels}.000000"), 1, 0)
        assert (made.GetNE(), made.GetNBE()) == (len(mesh.tets), len(mesh.faces))
        curved.append(solved_by_mfem(made))
        straight.append(solved_by_mfem(ball.generate(maxh=0.7, levels=levels).to_mfem()))
    rates = [np.log2(np.array(errors[:-1]) / errors[1:]) for errors in (curved, straight)]
    print(f"errors {curved}, rates {rates[0]}; straight tets {straight}, rates {rates[1]}")
    assert (rates[0] > 2.8).all(), (curved, rates)
    assert (rates[1] < 2.2).all(), (straight, rates)
