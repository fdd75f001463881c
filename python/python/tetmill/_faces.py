"""Triangles and edges found among others by their vertices."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


def _keys(triangles: NDArray[Any], vertices: int) -> NDArray[Any]:
    """One value for each triangle, whatever the order of its vertices."""
    a, b, c = np.sort(triangles.astype(np.int64), axis=1).T
    # Two vertices as one number; three would overflow.
    return np.rec.fromarrays([a * vertices + b, c])


def edge_keys(edges: NDArray[Any], vertices: int) -> NDArray[np.int64]:
    """One number for each edge, whatever the order of its ends."""
    first, second = np.sort(edges.astype(np.int64), axis=1).T
    keys: NDArray[np.int64] = first * vertices + second
    return keys


def positions(wanted: NDArray[Any], among: NDArray[Any], vertices: int) -> NDArray[np.intp]:
    """Where each wanted triangle is among others, (k,). All must be there.

    Args:
        wanted: Vertices of triangles, (k, 3).
        among: Vertices of triangles, (n, 3).
        vertices: Their number.
    """
    keys = _keys(among, vertices)
    order = np.argsort(keys)
    return order[np.searchsorted(keys[order], _keys(wanted, vertices))]
