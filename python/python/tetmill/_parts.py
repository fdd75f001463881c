"""Parts of a mesh, and their refinement levels."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import _arguments as arguments
from . import _native

Ints = NDArray[np.int32]
Ids = NDArray[np.int64]
Floats = NDArray[np.float64]

#: A block of tets as a small mesh of its own: see `Mesh.blocks`.
Block = _native.Block
#: The tets of other parts beside a part: see `Part.ghosts`.
Ghosts = _native.PartGhosts


#: The ends of the edges of a tet in the order of VTK.
VTK_TET_EDGES = [[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]]
#: Where VTK's nodes on the edges of a tet are in the order of the library: 01 02 03 12 13 23.
_VTK_EDGES = [0, 3, 1, 2, 4, 5]


def _with_edges(order: int, corners: Ints, edges: Ints) -> Ints:
    """The corners of elements and the nodes on their edges; the corners alone in a mesh of order 1."""
    if order == 1:
        return corners
    nodes = np.concatenate([corners, edges], axis=1)
    nodes.flags.writeable = False
    return nodes


class Label(NamedTuple):
    """The number of a body or patch, and its names."""

    number: int
    names: list[str]

    @property
    def name(self) -> str | None:
        """The main name, if any."""
        return self.names[0] if self.names else None


def labels(native: list[tuple[int, list[str]]]) -> list[Label]:
    """Labels of the library."""
    return [Label(number, names) for number, names in native]


class Layers:
    """The ghosts of all parts, made at the first use of any."""

    def __init__(self, native: _native.Mesh) -> None:
        self._native = native
        self._made: dict[str, list[Ghosts]] = {}

    def __call__(self, by: str) -> list[Ghosts]:
        by = arguments.one_of("by", by, ("faces", "vertices"))
        if by not in self._made:
            self._made[by] = self._native.ghosts(by)
        return self._made[by]


class _Local:
    """Arrays of a part, at the finest or another level.

    All arrays are read-only. They take over the memory of the library, without a copy, and are
    made at the first use.
    """

    def _make_arrays(self) -> _native.PartArrays:
        raise NotImplementedError

    def _make_sharing(self) -> _native.PartSharing:
        raise NotImplementedError

    @cached_property
    def _arrays(self) -> _native.PartArrays:
        return self._make_arrays()

    @cached_property
    def _sharing(self) -> _native.PartSharing:
        return self._make_sharing()

    @cached_property
    def points(self) -> Floats:
        """Coordinates, (n, 3)."""
        return self._arrays.points

    @cached_property
    def tets(self) -> Ints:
        """Indices of points, (m, 4); positively oriented: det(v1 - v0, v2 - v0, v3 - v0) > 0."""
        return self._arrays.tets

    @cached_property
    def tet_nodes(self) -> Ints:
        """All nodes of each tet, (m, 10) in a mesh of order 2: the corners, and then the nodes on the
        edges 01 12 02 03 13 23, the order of VTK, Abaqus and meshio. In order 1 the same as `tets`."""
        return _with_edges(self._arrays.order, self.tets, self._arrays.tet_edge_nodes[:, _VTK_EDGES])

    @cached_property
    def face_nodes(self) -> Ints:
        """All nodes of each face, (k, 6) in a mesh of order 2: the corners, and then the nodes on the
        edges 01 12 20. In order 1 the same as `faces`."""
        return _with_edges(self._arrays.order, self.faces, self._arrays.face_edge_nodes)

    @cached_property
    def bodies(self) -> Ints:
        """The body number of each tet, (m,)."""
        return self._arrays.bodies

    @cached_property
    def faces(self) -> Ints:
        """Triangles on patches, (k, 3); their right-hand normals point out of the inner body.

        A triangle between two parts is in the arrays of both.
        """
        return self._arrays.faces

    @cached_property
    def face_tags(self) -> Ints:
        """The boundary number of each face, (k,), as in files."""
        return self._arrays.face_tags

    @cached_property
    def face_patches(self) -> Ints:
        """The patch of each face, (k,), as an index of `Mesh.patches`."""
        return self._arrays.face_patches

    @cached_property
    def face_bodies(self) -> Ints:
        """Numbers of the bodies of this part behind and in front of each face, (k, 2); 0: none."""
        return self._arrays.face_bodies

    @cached_property
    def global_ids(self) -> Ids:
        """The id of each vertex in the whole mesh: from 0, without gaps."""
        return self._arrays.vertex_ids

    @cached_property
    def tet_ids(self) -> Ids:
        """The id of each tet in the whole mesh."""
        return self._arrays.tet_ids

    @cached_property
    def owners(self) -> Ints:
        """The rank that owns each vertex: one of those that share it."""
        return self._sharing.owners

    @cached_property
    def shared(self) -> Ints:
        """The vertices that other parts have too, ascending."""
        return self._sharing.vertices

    @property
    def holders(self) -> tuple[Ids, Ints]:
        """The ranks of each shared vertex: `ranks[offsets[i]:offsets[i + 1]]` those of `shared[i]`."""
        return self._sharing.offsets, self._sharing.ranks

    @property
    def neighbours(self) -> dict[int, Ints]:
        """By rank, the vertices shared with it; both ranks list them in the same order."""
        return dict(self._sharing.neighbours)


class Level(_Local):
    """One refinement level of a part, for multigrid.

    All levels are refined from the same coarse part, so the parents of vertices and tets are in
    the same part. All are on the geometry: vertices move when a level is refined.
    """

    def __init__(self, native: _native.Level) -> None:
        self._level = native

    def _make_arrays(self) -> _native.PartArrays:
        return self._level.arrays()

    def _make_sharing(self) -> _native.PartSharing:
        return self._level.sharing()

    @property
    def pieces(self) -> int:
        """Into how many each coarse edge is split."""
        return self._level.pieces()

    @cached_property
    def vertex_parents(self) -> Ints | None:
        """The two vertices of the level before that each vertex is between, (n, 2).

        Both are the same for a vertex of both levels. Linear interpolation is the mean of the
        values of both. None for the coarsest level.
        """
        return self._level.vertex_parents()

    @cached_property
    def tet_parents(self) -> Ids | None:
        """The tet of the level before that contains each tet, (m,).

        None for the coarsest level, and unless the mesh was made with `nested=True`.
        """
        return self._level.tet_parents()

    def __repr__(self) -> str:
        vertices, tets, faces = self._level.counts()
        return f"<tetmill.Level: {vertices:,} vertices, {tets:,} tets, {faces:,} faces>"


class Part(_Local):
    """One part of a mesh. Shared vertices are in the arrays of each part that has them."""

    def __init__(self, native: _native.Mesh, index: int, rank: int, layers: Layers) -> None:
        # Not the `Mesh`, whose memory a circle of references would keep until the next collection.
        self._native = native
        self._index = index
        self._layers = layers
        #: The rank that made it: its index among all parts of the mesh.
        self.rank = rank

    def _make_arrays(self) -> _native.PartArrays:
        return self._native.arrays(self._index)

    def _make_sharing(self) -> _native.PartSharing:
        return self._native.sharing(self._index)

    def levels(self) -> list[Level]:
        """The refinement levels of the part, from the coarsest to the mesh itself, for multigrid.

        Raises:
            ValueError: If the mesh was not made by the method "refine".
        """
        levels = self._native.levels(self._index)
        if levels is None:
            raise ValueError('only meshes of the method "refine" have levels')
        return [Level(level) for level in levels]

    def ghosts(self, by: Literal["faces", "vertices"] = "faces") -> Ghosts:
        """The tets of other parts that share a face or a vertex with this one.

        With MPI, *Collective* at the first use of each kind: all processes must call it.

        Their vertices are numbered as in this part, followed by `points` of the ghosts.
        """
        return self._layers(by)[self._index]

    def blocks(self, size: int = 1 << 16) -> Iterator[Block]:
        """The tets in blocks of `size` or somewhat more: see `Mesh.blocks`."""
        return self._native.blocks(self._index, arguments.whole("size", size, 1, 2**31 - 1))

    def __repr__(self) -> str:
        vertices, tets, faces = self._native.counts(self._index)
        return f"<tetmill.Part {self.rank}: {vertices:,} vertices, {tets:,} tets, {faces:,} faces>"
