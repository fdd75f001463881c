"""Meshes of second order: nodes, adapters, and the order of convergence that curved tets give."""

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
