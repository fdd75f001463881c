"""Finite elements with known solutions: the error falls as the square of the element size."""

import numpy as np
import pytest

skfem = pytest.importorskip("skfem")

from skfem.helpers import dot, grad  # noqa: E402


def solve(mesh, conductivity, source, exact, fixed):
    """Solves -div(k grad u) = f by linear elements; returns the error in the mean square."""
    grid = mesh.to_skfem()
    basis = skfem.Basis(grid, skfem.ElementTetP1())
    constant = basis.with_element(skfem.ElementTetP0())
    k = constant.zeros()
    for body, value in conductivity.items():
        k[grid.subdomains[body]] = value
    given = constant.interpolate(k)

    @skfem.BilinearForm
    def stiffness(u, v, w):
        return w.k * dot(grad(u), grad(v))

    @skfem.LinearForm
    def load(v, w):
        return source(w.x, w.k) * v

    matrix, right = stiffness.assemble(basis, k=given), load.assemble(basis, k=given)
    dofs = basis.get_dofs(fixed)
    prescribed = basis.zeros()
    # Every body has the same values on the fixed boundaries.
    prescribed[dofs] = exact(basis.doflocs[:, dofs.flatten()], None)
    solution = skfem.solve(*skfem.condense(matrix, right, x=prescribed, D=dofs))

    @skfem.Functional
    def square(w):
        return (w.u - exact(w.x, w.k)) ** 2

    return np.sqrt(square.assemble(basis, u=basis.interpolate(solution), k=given))


def assert_second_order(errors):
    ratios = np.array(errors[:-1]) / np.array(errors[1:])
    assert (ratios > 3.3).all() and (ratios < 4.7).all(), (errors, ratios)


def test_poisson_on_a_ball(ball):
    def exact(x, _):
        return np.sin(2 * x[0]) * np.cos(x[1]) + x[2] ** 2

    def source(x, _):
        return 5 * np.sin(2 * x[0]) * np.cos(x[1]) - 2

    levels = [ball.generate(maxh=0.5, levels=level) for level in (0, 1, 2)]
    assert_second_order([solve(mesh, {"ball": 1.0}, source, exact, "skin") for mesh in levels])


def test_heat_through_two_blocks(two_blocks):
    """The flux is continuous at the seam, and zero at the sides."""
    period = np.pi / 3

    def exact(x, k):
        if k is None:
            k = np.where(x[0] < 0, 1.0, 4.0)
        return np.sin(x[0]) / k + np.cos(period * x[1])

    def source(x, k):
        return np.sin(x[0]) + k * period**2 * np.cos(period * x[1])

    levels = [two_blocks.generate(maxh=0.6, levels=level, parts=2) for level in (0, 1, 2)]
    conductivity = {"left": 1.0, "right": 4.0}
    assert_second_order([solve(mesh, conductivity, source, exact, ["cold", "hot"]) for mesh in levels])


def test_heat_through_a_curved_interface(core_and_shell):
    """A source of 1, and 0 outside; the interface has radius 0.5."""

    def exact(x, k):
        square = (x**2).sum(axis=0)
        if k is None:
            return (1 - square) / 6
        return np.where(k == 5.0, (1 - 0.25) / 6 + (0.25 - square) / 30, (1 - square) / 6)

    levels = [core_and_shell.generate(maxh=0.4, levels=level) for level in (0, 1, 2)]
    conductivity = {"core": 5.0, "shell": 1.0}
    assert_second_order([solve(mesh, conductivity, lambda x, k: 1.0, exact, "outside") for mesh in levels])


def test_elasticity_of_two_blocks(two_blocks):
    """Two materials with the same displacement: its stress is continuous at the seam."""
    first = {"left": (2.0, 1.0), "right": (5.0, 3.0)}

    # u = (s(x), 0, 0) with s' = 0 at the seam, so the traction there is 0 on both sides.
    def displacement(x):
        return np.array([1 - np.cos(x[0]), 0 * x[0], 0 * x[0]])

    def solve_elasticity(mesh):
        grid = mesh.to_skfem()
        basis = skfem.Basis(grid, skfem.ElementVector(skfem.ElementTetP1()))
        constant = basis.with_element(skfem.ElementTetP0())
        lame = []
        for k in range(2):
            values = constant.zeros()
            for body, parameters in first.items():
                values[grid.subdomains[body]] = parameters[k]
            lame.append(constant.interpolate(values))

        @skfem.BilinearForm
        def stiffness(u, v, w):
            def strain(of):
                return 0.5 * (of.grad + np.swapaxes(of.grad, 0, 1))

            shear = 2 * w.mu * np.einsum("ij...,ij...->...", strain(u), strain(v))
            return w.lam * np.einsum("ii...", u.grad) * np.einsum("ii...", v.grad) + shear

        @skfem.LinearForm
        def load(v, w):
            return -(w.lam + 2 * w.mu) * np.cos(w.x[0]) * v[0]

        matrix = stiffness.assemble(basis, lam=lame[0], mu=lame[1])
        right = load.assemble(basis, lam=lame[0], mu=lame[1])
        dofs = basis.get_dofs(["cold", "hot", "sides"])
        prescribed = basis.project(displacement)
        solution = skfem.solve(*skfem.condense(matrix, right, x=prescribed, D=dofs))

        @skfem.Functional
        def square(w):
            return ((w.u - displacement(w.x)) ** 2).sum(axis=0)

        return np.sqrt(square.assemble(basis, u=basis.interpolate(solution)))

    levels = [two_blocks.generate(maxh=0.6, levels=level) for level in (0, 1, 2)]
    assert_second_order([solve_elasticity(mesh) for mesh in levels])
