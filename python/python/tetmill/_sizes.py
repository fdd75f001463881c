"""Sizes on a background grid or mesh."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _arguments as arguments
from . import _native

if TYPE_CHECKING:
    from ._mesh import Mesh


class Interpolated:
    """Sizes that the library interpolates itself, without calls of Python."""

    _native: _native.Background | _native.Grid

    def __call__(self, points: ArrayLike) -> NDArray[np.float64]:
        """The sizes at points."""
        return np.array([self._native.at(point) for point in arguments.positions("points", points).tolist()])


class Background(Interpolated):
    """Element sizes on a tetrahedral mesh, for `Geometry.generate(size=...)`.

    Such as the sizes that an error estimate of the last solution asks for, on its mesh. Sizes are
    linear in each tet; outside the mesh those of its nearest point continue.

    Args:
        points: Coordinates, (n, 3).
        tets: Indices of points, (m, 4).
        sizes: One for each point, (n,), or for each tet, (m,): a point then gets the smallest of
            its tets. As many tets as points have one for each point.
    """

    def __init__(self, points: ArrayLike, tets: ArrayLike, sizes: ArrayLike) -> None:
        given = arguments.positions("points", points)
        cells = arguments.indices("tets", tets, 4, len(given))
        values = np.ascontiguousarray(sizes, dtype=np.float64)
        if values.shape == (len(cells),) and len(cells) != len(given):
            # Points without tets have no influence.
            smallest = np.full(len(given), values.max(initial=1.0))
            np.minimum.at(smallest, cells.ravel(), np.repeat(values, 4))
            values = smallest
        elif values.shape != (len(given),):
            raise ValueError(f"sizes must have the shape ({len(given)},) or ({len(cells)},), not {values.shape}")
        self._native = _native.Background(given, cells, values)

    @classmethod
    def of(cls, mesh: Mesh, sizes: ArrayLike) -> Background:
        """Sizes at the points or tets of a mesh of this package."""
        return cls(mesh.points, mesh.tets, sizes)


def _triple(name: str, values: Sequence[float], least: float = -np.inf) -> NDArray[np.float64]:
    array = np.asarray(values, dtype=np.float64)
    if array.shape != (3,) or not np.isfinite(array).all() or not (array > least).all():
        kind = "numbers" if least < 0 else "positive numbers"
        raise ValueError(f"{name} must be three {kind}, not {values!r}")
    return array


class Grid(Interpolated):
    """Element sizes on a regular grid, for `Geometry.generate(size=...)`.

    `values[i, j, k]` is the size at `origin + (i, j, k) * spacing`. Sizes are interpolated
    linearly in each direction; outside the grid those of its surface continue.
    """

    def __init__(self, origin: Sequence[float], spacing: Sequence[float], values: ArrayLike) -> None:
        array = np.ascontiguousarray(values, dtype=np.float64)
        if array.ndim != 3 or array.size == 0:
            raise ValueError(f"values must have three dimensions, not the shape {array.shape}")
        if not (array > 0).all():
            place = tuple(int(k) for k in np.argwhere(~(array > 0))[0])
            raise ValueError(f"values{list(place)} is {array[place]}: sizes are positive")
        first, step = _triple("origin", origin), _triple("spacing", spacing, 0.0)
        self._native = _native.Grid(first.tolist(), step.tolist(), array)

    @classmethod
    def sample(
        cls,
        function: Callable[[NDArray[np.float64]], ArrayLike],
        lower: Sequence[float],
        upper: Sequence[float],
        shape: Sequence[int] = (32, 32, 32),
    ) -> Grid:
        """The values of a function on a grid of `shape` points over a box.

        The function is called once, with an array of all points of shape (n, 3), and returns (n,)
        sizes. The mesher then reads the grid, which is much faster than to call a Python function
        for each point.
        """
        low, high = _triple("lower", lower), _triple("upper", upper)
        counts = [arguments.whole("shape", count, 2, 10_000) for count in shape]
        if len(counts) != 3 or not (high > low).all():
            raise ValueError("upper must be above lower in each coordinate, and shape have three numbers")
        axes = [np.linspace(a, b, n) for a, b, n in zip(low, high, counts)]
        points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        values = np.asarray(function(points), dtype=np.float64)
        if values.shape != (len(points),):
            raise ValueError(f"the function returned the shape {values.shape} for {len(points)} points")
        spacing = (high - low) / (np.array(counts) - 1)
        return cls(low.tolist(), spacing.tolist(), values.reshape(counts))
