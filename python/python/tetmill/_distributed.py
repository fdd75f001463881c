"""Meshes as those of solvers that take them in parallel: each process gives its part."""

from __future__ import annotations

import ctypes
import inspect
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from . import _arguments as arguments
from ._faces import edge_keys, positions
from ._mpi import Processes
from ._parts import VTK_TET_EDGES, Floats, Ids, Ints, Part

if TYPE_CHECKING:
    from mpi4py import MPI

    from ._mesh import Mesh

_GHOSTS: dict[str, Literal["faces", "vertices"]] = {"shared_facet": "faces", "shared_vertex": "vertices"}


class DolfinxMesh(NamedTuple):
    """A mesh of DOLFINx, with the numbers of bodies and boundaries as mesh tags."""

    mesh: Any
    cell_tags: Any
    facet_tags: Any


def _part(mesh: Mesh) -> Part | None:
    """The part of this process; None if all parts are here, which are one for the solver then."""
    if mesh.comm is None:
        return mesh.parts[0] if len(mesh.parts) == 1 else None
    if mesh.comm.size != mesh.part_count:
        raise ValueError(
            f"the mesh has {mesh.part_count} parts on {mesh.comm.size} processes: make it without parts=, one part in each"
        )
    return mesh.parts[0]


def _from_owners(part: Part, comm: MPI.Intracomm, values: Ids) -> Ids:
    """*Collective.* The values of vertices, right where this process owns them, right everywhere."""
    neighbours = part.neighbours
    messages = [(rank, values[vertices].tobytes()) for rank, vertices in neighbours.items()]
    values = values.copy()
    for rank, message in Processes(comm).exchange(messages):
        vertices = neighbours[rank]
        own = part.owners[vertices] == rank
        values[vertices[own]] = np.frombuffer(message, np.int64)[own]
    return values


def _by_owner(mesh: Mesh, part: Part | None, comm: MPI.Intracomm) -> tuple[Ids, Floats]:
    """The global number of each vertex, where each process owns successive ones, and their coordinates."""
    if part is None or comm.size == 1:
        return np.arange(len(mesh.points)), mesh.points
    own = part.owners == part.rank
    count = int(np.count_nonzero(own))
    first = comm.scan(count) - count
    numbers = np.full(len(own), -1)
    numbers[own] = np.arange(first, first + count)
    return _from_owners(part, comm, numbers), part.points[own]


def _destinations(part: Part | None, comm: MPI.Intracomm, count: int, by: str) -> tuple[Ints, Ints]:
    """The ranks that get each cell as a list in CSR form: first this one, then those with it as a ghost."""
    cells, ranks = [np.arange(count)], [np.full(count, comm.rank)]
    if part is not None and by in _GHOSTS and comm.size > 1:
        # Each process tells the owners which of their cells it has as ghosts.
        ghosts = part.ghosts(_GHOSTS[by])
        wanted = [ghosts.tet_ids[ghosts.owners == rank] for rank in range(comm.size)]
        order = np.argsort(part.tet_ids)
        for rank, ids in enumerate(comm.alltoall(wanted)):
            cells.append(order[np.searchsorted(part.tet_ids, ids, sorter=order)])
            ranks.append(np.full(len(ids), rank))
    of_cells = np.concatenate(cells)
    order = np.argsort(of_cells, kind="stable")
    offsets = np.searchsorted(of_cells[order], np.arange(count + 1))
    return np.concatenate(ranks)[order].astype(np.int32), offsets.astype(np.int32)


def _coordinate_element(order: int) -> Any:
    """The domain of tets of an order, in the words of the installed version of FEniCS."""
    import ufl

    try:
        from basix.ufl import element
    except ImportError:
        return ufl.Mesh(ufl.VectorElement("Lagrange", "tetrahedron", order))
    return ufl.Mesh(element("Lagrange", "tetrahedron", order, shape=(3,)))


def _dolfinx_nodes(cell: str, nodes: Ints | Ids) -> Ids:
    """The nodes of elements in the order of DOLFINx, from that of VTK."""
    import dolfinx

    kind = getattr(dolfinx.mesh.CellType, cell)
    permutation = dolfinx.cpp.io.perm_vtk(kind, nodes.shape[1])
    return np.ascontiguousarray(nodes[:, permutation], dtype=np.int64)


def _lists(values: Ints | Ids, *offsets: Ints) -> Any:
    """An adjacency list of DOLFINx, by its name in the installed version."""
    from dolfinx import graph

    make = getattr(graph, "adjacencylist", None) or graph.create_adjacencylist
    return make(values, *offsets)


def _dolfinx_tags(made: Any, dimension: int, entities: Ids, values: Ints, name: str) -> Any:
    """Mesh tags from entities by the numbers of their nodes."""
    import dolfinx

    distribute = dolfinx.io.distribute_entity_data
    # Before version 0.7 that was a function of C++, for a mesh of C++.
    of = made if inspect.isfunction(distribute) else getattr(made, "_cpp_object", None) or made._mesh
    entities, values = distribute(of, dimension, entities, values)
    made.topology.create_connectivity(dimension, 0)
    made.topology.create_connectivity(dimension, 3)
    tags = dolfinx.mesh.meshtags_from_entities(made, dimension, _lists(entities), values.astype(np.int32))
    tags.name = name
    return tags


def to_dolfinx(mesh: Mesh, ghost_mode: str = "none") -> DolfinxMesh:
    """See `Mesh.to_dolfinx`."""
    import dolfinx
    from mpi4py import MPI

    by = arguments.one_of("ghost_mode", ghost_mode, ("none", *_GHOSTS))
    comm = MPI.COMM_SELF if mesh.comm is None else mesh.comm
    part = _part(mesh)
    numbers, points = _by_owner(mesh, part, comm)
    known = inspect.signature(dolfinx.mesh.create_mesh).parameters
    # Old versions always need the ghosts beside faces, and remove them if they are not wanted.
    ghosts = "shared_facet" if "ghost_mode" in known else by
    ranks, offsets = _destinations(part, comm, len(mesh.tets), ghosts)

    def keep(*_: Any) -> Any:
        """Each cell stays in its process."""
        destinations = _lists(ranks, offsets)
        return getattr(destinations, "_cpp_object", destinations)

    given = {"x": points, "partitioner": keep, "e" if "e" in known else "domain": _coordinate_element(mesh.order)}
    if "ghost_mode" in known:
        given["ghost_mode"] = getattr(dolfinx.mesh.GhostMode, by)
    cells = _dolfinx_nodes("tetrahedron", numbers[mesh.tet_nodes])
    made = dolfinx.mesh.create_mesh(comm, cells, **given)
    cell_tags = _dolfinx_tags(made, 3, cells, mesh.bodies, "bodies")
    # A face between two parts is in both; it is given by the part that is behind it.
    once = slice(None) if part is None else part.face_bodies[:, 0] != 0
    faces = _dolfinx_nodes("triangle", numbers[mesh.face_nodes[once]])
    return DolfinxMesh(made, cell_tags, _dolfinx_tags(made, 2, faces, mesh.face_tags[once], "boundaries"))


def to_dmplex(mesh: Mesh) -> Any:
    """See `Mesh.to_dmplex`."""
    from petsc4py import PETSc

    comm = PETSc.COMM_SELF if mesh.comm is None else mesh.comm
    part = _part(mesh)
    plex = PETSc.DMPlex().create(comm)
    plex.setDimension(3)
    # Vertices of the plex are corners; nodes on edges are coordinates only.
    corners = np.arange(len(mesh.points)) if mesh.order == 1 else np.unique(mesh.tets)
    vertices = np.full(len(mesh.points), -1)
    vertices[corners] = np.arange(len(corners))
    # PETSc's tets have the other orientation.
    cells = np.ascontiguousarray(vertices[mesh.tets[:, [0, 2, 1, 3]]], dtype=PETSc.IntType)
    points = np.ascontiguousarray(mesh.points[corners], dtype=PETSc.RealType)
    counts = [_petsc_int(count) for count in (len(cells), len(points), 4)]
    _petsc("DMPlexBuildFromCellList", plex, *counts, ctypes.c_void_p(cells.ctypes.data))
    _petsc("DMPlexBuildCoordinatesFromCellList", plex, _petsc_int(3), ctypes.c_void_p(points.ctypes.data))
    if part is not None and mesh.comm is not None:
        # Points of the plex are the cells, then the vertices: each shared one refers to its owner's.
        numbers = len(cells) + vertices
        remote = _from_owners(part, mesh.comm, numbers)
        leaves = corners[part.owners[corners] != part.rank]
        pairs = np.stack([part.owners[leaves], remote[leaves]], axis=1)
        forest = PETSc.SF().create(comm)
        local, pairs = numbers[leaves].astype(PETSc.IntType), pairs.ravel().astype(PETSc.IntType)
        forest.setGraph(len(cells) + len(points), local, pairs)
        plex.setPointSF(forest)
    plex.interpolate()
    edges, faces = _plex_edges_and_faces(plex, len(cells))
    _label(plex, "Cell Sets", np.arange(len(cells)), mesh.bodies)
    first_face = plex.getDepthStratum(2)[0]
    of_faces = first_face + positions(vertices[mesh.faces], faces, len(points))
    _label(plex, "Face Sets", of_faces, mesh.face_tags)
    if mesh.order == 2:
        _set_edge_nodes(plex, mesh, vertices, edges)
    return plex


def _set_edge_nodes(plex: Any, mesh: Mesh, vertices: Ints | Ids, edges: Ints) -> None:
    """*Collective.* Makes the coordinates a field of degree 2, with the nodes on edges where they are.

    Args:
        plex: An interpolated plex of the corners.
        mesh: Its mesh.
        vertices: The vertex of the plex of each point of the mesh that is a corner.
        edges: The vertices at the ends of each edge of the plex.
    """
    from petsc4py import PETSc

    # Projects the linear coordinates, so that nodes on edges are in their middles at first.
    element = PETSc.FE().createLagrange(3, 3, True, 2, PETSc.DETERMINE, comm=plex.comm)
    # The name and the arguments changed between versions 3.18 and 3.25.
    if hasattr(plex, "projectCoordinates"):
        plex.projectCoordinates(element)
    else:
        try:
            plex.setCoordinateDisc(element, localized=False, project=True)
        except TypeError:
            plex.setCoordinateDisc(element, project=True)
    element.destroy()
    section, coordinates = plex.getCoordinateSection(), plex.getCoordinatesLocal()
    count = int(vertices.max(initial=-1)) + 1
    nodes = np.empty(len(edges), dtype=np.int64)
    keys = edge_keys(edges, count)
    order = np.argsort(keys)
    for place, ends in enumerate(VTK_TET_EDGES):
        wanted = edge_keys(vertices[mesh.tets[:, ends]], count)
        nodes[order[np.searchsorted(keys[order], wanted)]] = mesh.tet_nodes[:, 4 + place]
    first = plex.getDepthStratum(1)[0]
    offsets = np.array([section.getOffset(first + edge) for edge in range(len(edges))], dtype=np.int64)
    values = coordinates.array.reshape(-1, 3)
    values[offsets // 3] = mesh.points[nodes]
    coordinates.array = values.ravel()
    # The global coordinates are made again from the local ones.
    plex.setCoordinatesLocal(coordinates)


def _petsc_int(value: int) -> Any:
    from petsc4py import PETSc

    return np.ctypeslib.as_ctypes_type(PETSc.IntType)(value)


def _petsc(function: str, plex: Any, *arguments: Any) -> None:
    """Calls a function of PETSc that petsc4py does not have."""
    from petsc4py import PETSc

    code = getattr(ctypes.CDLL(PETSc.__file__), function)(ctypes.c_void_p(plex.handle), *arguments)
    if code:
        raise PETSc.Error(code)


def _plex_edges_and_faces(plex: Any, cells: int) -> tuple[Ints, Ints]:
    """The vertices of all edges and faces of an interpolated plex, in its order; vertices follow the cells."""
    from petsc4py import PETSc

    # The points of all cones, in the order of the points that have them.
    sizes = {1: 2, 2: 3, 3: 4}
    strata = sorted((*plex.getDepthStratum(depth), depth) for depth in sizes)
    lengths = [sizes[depth] * (last - first) for first, last, depth in strata]
    pointer = ctypes.POINTER(np.ctypeslib.as_ctypes_type(PETSc.IntType))()
    _petsc("DMPlexGetCones", plex, ctypes.byref(pointer))
    cones = np.ctypeslib.as_array(pointer, (sum(lengths),)) if sum(lengths) else np.empty(0, PETSc.IntType)
    split = np.split(cones, np.cumsum(lengths)[:-1])
    by_depth = {depth: part.reshape(-1, sizes[depth]) for part, (_, _, depth) in zip(split, strata)}
    edges = by_depth[1] - cells
    # The edges of a face have each vertex twice.
    ends = edges[by_depth[2] - plex.getDepthStratum(1)[0]].reshape(-1, 6)
    return edges, np.sort(ends, axis=1)[:, ::2]


def _label(plex: Any, name: str, points: Ids, values: Ints) -> None:
    from petsc4py import PETSc

    plex.createLabel(name)
    label = plex.getLabel(name)
    for value in np.unique(values).tolist():
        chosen = np.sort(points[values == value]).astype(PETSc.IntType)
        label.setStratumIS(value, PETSc.IS().createGeneral(chosen, comm=PETSc.COMM_SELF))
