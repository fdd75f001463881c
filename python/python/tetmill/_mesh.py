"""Meshes: arrays, blocks, parts, files and pictures."""

from __future__ import annotations

import html
import os
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, Union

import numpy as np
from numpy.typing import NDArray

from . import _arguments as arguments
from . import _native
from ._parts import Block, Floats, Ghosts, Ids, Ints, Label, Layers, Part, labels

if TYPE_CHECKING:
    from IPython.display import Image
    from mpi4py import MPI

    from ._distributed import DolfinxMesh

_FORMATS = ("elmer", "vtu", "msh", "msh4", "msh4-parts", "medit", "vol", "inp", "mfem", "hdf5", "geomview")
_GMSH4 = ("msh4", "msh4-parts")
_ENDINGS = {
    ".vtu": "vtu",
    ".pvtu": "vtu",
    ".msh": "msh",
    ".mesh": "medit",
    ".vol": "vol",
    ".inp": "inp",
    ".off": "geomview",
}


class Written(NamedTuple):
    """What was written."""

    files: int
    bytes: int


def _names(of: list[Label]) -> dict[int, str]:
    """The main name of each number; the first one if patches of one number have several."""
    return {label.number: label.names[0] for label in reversed(of) if label.names}


class Mesh:
    """A checked tetrahedral mesh, with one part or several.

    The arrays of a mesh of one part are those of the part: made by the library, read-only, and
    not copied. Those of several parts are joined by global ids, which copies them.

    A mesh across processes (`comm`) has its own parts in each of them, and its arrays are those of
    the part of this process: local, with local indices. Counts, names, report and checksum are
    those of the whole mesh. `check`, `write`, `picture` and `plot` are *Collective* then: all
    processes must call them.
    """

    def __init__(self, native: _native.Mesh, comm: MPI.Intracomm | None = None) -> None:
        self._native = native
        self._layers = Layers(native)
        #: The communicator that the mesh was made on, if any.
        self.comm = comm

    @cached_property
    def parts(self) -> list[Part]:
        """The parts, by rank; those of this process if the mesh is across processes."""
        return [Part(self._native, index, rank, self._layers) for index, rank in enumerate(self._native.own())]

    def ghosts(self, by: Literal["faces", "vertices"] = "faces") -> list[Ghosts]:
        """The ghosts of each part of `parts`, see `Part.ghosts`. *Collective* at the first use of each kind."""
        return self._layers(by)

    @property
    def part_count(self) -> int:
        """The number of parts of the whole mesh."""
        return self._native.count()

    @property
    def _only(self) -> Part | None:
        """The part whose arrays are those of the mesh; None if parts must be joined."""
        if len(self.parts) == 1:
            return self.parts[0]
        if self.comm is not None and self.comm.size > 1:
            raise RuntimeError(f"this process has {len(self.parts)} parts: use the arrays of Mesh.parts")
        return None

    @cached_property
    def points(self) -> Floats:
        """Coordinates, (n, 3)."""
        if self._only is not None:
            return self._only.points
        points = np.empty((self._native.totals()[0], 3))
        for part in self.parts:
            points[part.global_ids] = part.points
        return _frozen(points)

    def _by_tet(self, values: Callable[[Part], NDArray[Any]], width: tuple[int, ...]) -> NDArray[Any]:
        """Joins values of tets by their ids."""
        dtype = values(self.parts[0]).dtype
        joined = np.empty((self._native.totals()[1], *width), dtype)
        for part in self.parts:
            joined[part.tet_ids] = values(part)
        return _frozen(joined)

    @cached_property
    def tets(self) -> Ints | Ids:
        """Indices of points, (m, 4); positively oriented: det(v1 - v0, v2 - v0, v3 - v0) > 0."""
        if self._only is not None:
            return self._only.tets
        ids = _index_type(len(self.points))
        return self._by_tet(lambda part: part.global_ids[part.tets].astype(ids, copy=False), (4,))

    @cached_property
    def order(self) -> int:
        """The order of the elements: 1, or 2 for tets of ten nodes."""
        return int(self.report["order"])

    @cached_property
    def tet_nodes(self) -> Ints | Ids:
        """All nodes of each tet, (m, 10) in a mesh of order 2: the corners, and then the nodes on the
        edges 01 12 02 03 13 23, the order of VTK, Abaqus and meshio. In order 1 the same as `tets`."""
        if self._only is not None:
            return self._only.tet_nodes
        if self.order == 1:
            return self.tets
        ids = _index_type(len(self.points))
        return self._by_tet(lambda part: part.global_ids[part.tet_nodes].astype(ids, copy=False), (10,))

    @cached_property
    def bodies(self) -> Ints:
        """The body number of each tet, (m,)."""
        return self._by_tet(lambda part: part.bodies, ()) if self._only is None else self._only.bodies

    @cached_property
    def _faces(self) -> tuple[NDArray[Any], Ints, Ints]:
        """The nodes of the triangles of all parts, each once, with tags and patches."""
        part = self._only
        if part is not None:
            return part.face_nodes, part.face_tags, part.face_patches
        ids = _index_type(len(self.points))
        faces = np.concatenate([part.global_ids[part.face_nodes] for part in self.parts])
        first = np.unique(np.sort(faces[:, :3], axis=1), axis=0, return_index=True)[1]
        first.sort()
        tags = np.concatenate([part.face_tags for part in self.parts])
        patches = np.concatenate([part.face_patches for part in self.parts])
        return _frozen(faces[first].astype(ids)), _frozen(tags[first]), _frozen(patches[first])

    @cached_property
    def faces(self) -> Ints | Ids:
        """Triangles on patches, (k, 3); their right-hand normals point out of the inner body."""
        return self._only.faces if self._only is not None else _frozen(np.ascontiguousarray(self._faces[0][:, :3]))

    @property
    def face_nodes(self) -> Ints | Ids:
        """All nodes of each face, (k, 6) in a mesh of order 2: the corners, and then the nodes on the
        edges 01 12 20. In order 1 the same as `faces`."""
        return self._faces[0]

    @property
    def face_tags(self) -> Ints:
        """The boundary number of each face, (k,), as in files."""
        return self._faces[1]

    @property
    def face_patches(self) -> Ints:
        """The patch of each face, (k,), as an index of `patches`."""
        return self._faces[2]

    @cached_property
    def patches(self) -> list[Label]:
        """Numbers and names of the patches. A name or number may belong to several patches."""
        return labels(self._native.patch_labels())

    @cached_property
    def body_names(self) -> dict[int, str]:
        """Names by body number."""
        return _names(labels(self._native.body_labels()))

    @cached_property
    def face_names(self) -> dict[int, str]:
        """Names by boundary number; `patches` has all names."""
        return _names(self.patches)

    def numbers_named(self, name: str) -> list[int]:
        """The boundary numbers of a name, as in `face_tags` and in files. Other names may have them, too.

        Raises:
            InputError: If no boundary has the name; the message lists the names.
        """
        return sorted({self.patches[patch].number for patch in self._native.patches_named(name)})

    def faces_named(self, name: str) -> NDArray[np.intp]:
        """The indices of the faces on a boundary.

        Raises:
            InputError: If no boundary has the name; the message lists the names.
        """
        return np.flatnonzero(np.isin(self.face_patches, self._native.patches_named(name)))

    def vertices_named(self, name: str) -> Ints | Ids:
        """The vertices on a boundary, ascending, for Dirichlet data.

        *Collective* if the mesh is across processes: a part may have vertices on a boundary of
        which only other parts have faces.
        """
        patches = self._native.patches_named(name)
        if self._only is None:
            return _frozen(np.unique(self.face_nodes[self.faces_named(name)]))
        return self._native.vertices_on(patches)[0]

    def tets_named(self, name: str) -> NDArray[np.intp]:
        """The indices of the tets of a body.

        Raises:
            InputError: If no body has the name; the message lists the names.
        """
        return np.flatnonzero(np.isin(self.bodies, self._native.bodies_named(name)))

    def blocks(self, size: int = 1 << 16) -> Iterator[Block]:
        """The tets of all parts in blocks of `size` or somewhat more, computed when they are read.

        For meshes that do not fit the memory as arrays. A block is a small mesh of its own: `tets`
        are positions in its `points`, whose numbers in the part are `vertices`. A vertex of
        several coarse tets is in it several times.
        """
        for part in self.parts:
            yield from part.blocks(size)

    @cached_property
    def report(self) -> dict[str, Any]:
        """The report of the command line (`--report`)."""
        return dict(arguments.as_dict(self._native.report()))

    @property
    def notes(self) -> list[str]:
        """Messages of the run."""
        return self._native.notes()

    @property
    def checksum(self) -> str:
        """Identifies the mesh, whatever the number of parts and threads."""
        return self._native.checksum()

    def quality(self) -> dict[str, Any]:
        """The shapes of all tets, with the keys of `tetmill quality --json`.

        If the mesh is across processes, of the tets of this one; `report` has those of all.
        """
        measured = dict(arguments.as_dict(self._native.quality()))
        del measured["mesh"], measured["notes"]
        return measured

    def check(self) -> list[str]:
        """Checks orientation, numbering and boundaries again; returns the faults, none as a rule.

        Every mesh was checked when it was made, also for its distance from the geometry.
        """
        count, faults = self._native.check()
        more = count - len(faults)
        return faults + ([f"and {more} more"] if more else [])

    def write(
        self,
        path: str | os.PathLike[str],
        format: Literal[
            "elmer", "vtu", "msh", "msh4", "msh4-parts", "medit", "vol", "inp", "mfem", "hdf5", "geomview"
        ]
        | None = None,
        *,
        boundary: Literal["beside", "in"] = "beside",
        halo: Literal["faces", "vertices"] | None = None,
        adjacency: bool = False,
        ascii: bool = False,
        progress: Callable[[str, float], object] | None = None,
    ) -> Written:
        """Writes the mesh. Existing files are replaced when all is written.

        Args:
            path: A file, whose ending selects the format: .vtu (also .pvtu), .msh (Gmsh), .mesh
                (Medit), .vol (NETGEN), .inp (Abaqus, CalculiX), .off (the boundary alone). A folder for "elmer". For "mfem" the files
                `path.000000` and so on, one for each part, which MFEM's `ParMesh` reads. For "hdf5" the files
                `path.h5` and `path.xdmf` with all parts. Gmsh 4.1 with partitions is a file for "msh4", and the files
                `path_1.msh` and so on, one for each part, for "msh4-parts".
            format: The format, whatever the ending.
            boundary: Where VTU stores boundary triangles: "beside" in files of their own, "in" the
                same file.
            halo: Write one layer of neighbouring tets with each part (Elmer, VTU and Gmsh 4.1).
            adjacency: Write edges, faces and the lists of what they and vertices belong to (HDF5).
            ascii: Write files of Gmsh 4.1 as text instead of binary.
            progress: Called with the name of a stage and its progress, 0 to 1.
        """
        from ._geometry import warn

        name = os.fspath(path)
        if format is None:
            ending = os.path.splitext(name)[1].lower()
            if ending not in _ENDINGS:
                known = ", ".join(_ENDINGS)
                raise ValueError(f"cannot tell the format of {name!r} by its ending; known are {known}; or set format")
            chosen = _ENDINGS[ending]
        else:
            chosen = arguments.one_of("format", format, _FORMATS)
        if halo is not None and chosen not in ("elmer", "vtu", *_GMSH4):
            raise ValueError(f"the format {chosen} has no halo elements; write elmer, vtu, msh4 or msh4-parts")
        if adjacency and chosen != "hdf5":
            raise ValueError(f"the format {chosen} holds no adjacency; write hdf5")
        if ascii and chosen not in _GMSH4:
            raise ValueError("ascii: only Gmsh 4.1 is text or binary; write msh4 or msh4-parts")
        target = {
            "path": name,
            "format": chosen,
            "inside": arguments.one_of("boundary", boundary, ("beside", "in")) == "in",
            "ascii": bool(ascii),
            "halo": None if halo is None else arguments.one_of("halo", halo, ("faces", "vertices")),
            "adjacency": bool(adjacency),
        }
        files, size, notes = self._native.write(target, progress)
        warn(notes)
        return Written(files, size)

    def picture(
        self,
        *,
        width: int = 1200,
        height: int = 900,
        azimuth: float | None = None,
        elevation: float | None = None,
        cut: Sequence[float] | None = None,
        color_by: Literal["patch", "part", "body"] | None = None,
    ) -> bytes:
        """Draws the surface of the mesh as PNG.

        Args:
            width: Pixels.
            height: Pixels.
            azimuth: Direction of the viewer about z, from the x axis (degrees).
            elevation: Of the viewer above the xy-plane (degrees).
            cut: Draw only the tets behind a plane: a point and a normal, six numbers.
            color_by: By default the part, or the patch if there is one part.
        """
        if cut is not None:
            plane = arguments.positions("cut", [list(cut)], 6)[0]
            if not plane[3:].any():
                raise ValueError("cut has a normal of length 0")
        chosen = color_by or ("part" if self.part_count > 1 else "patch")
        view = {
            "width": arguments.whole("width", width, 1, 20_000),
            "height": arguments.whole("height", height, 1, 20_000),
            "azimuth": azimuth,
            "elevation": elevation,
            "cut": None if cut is None else plane.tolist(),
            "color_by": arguments.one_of("color_by", chosen, ("patch", "part", "body")),
        }
        return self._native.picture(view)

    def plot(self, **view: Any) -> Union[Image, bytes]:
        """The picture as an image of a notebook; without IPython, the bytes of `picture`."""
        image = self.picture(**view)
        try:
            from IPython.display import Image
        except ImportError:
            return image
        return Image(data=image, format="png")

    def __repr__(self) -> str:
        vertices, tets, faces = self._native.totals()
        parts = "" if self.part_count == 1 else f" in {self.part_count} parts"
        return f"<tetmill.Mesh: {vertices:,} vertices, {tets:,} tets, {faces:,} faces{parts}>"

    def _repr_html_(self) -> str:
        mesh = self.report["mesh"]
        vertices, tets, faces = self._native.totals()
        rows = {
            "vertices": f"{vertices:,}",
            "tets": f"{tets:,}",
            "faces": f"{faces:,}",
            "parts": str(self.part_count),
            "volume": f"{mesh['volume']:.6g}",
            "dihedral angles": f"{mesh['smallest_dihedral']:.1f}° to {mesh['largest_dihedral']:.1f}°",
            "bodies": ", ".join(self.body_names.values()),
            "boundaries": ", ".join(dict.fromkeys(self.face_names.values())),
            "made in": f"{self.report['seconds']:.2f} s",
        }
        cells = (f"<tr><th>{name}</th><td>{html.escape(value)}</td></tr>" for name, value in rows.items() if value)
        return f"<table>{''.join(cells)}</table>"

    # Adapters; each needs its own package.

    def to_meshio(self) -> Any:
        """A `meshio.Mesh` with the tets, the faces, and their numbers and names."""
        from . import adapters

        return adapters.to_meshio(self)

    def to_skfem(self) -> Any:
        """A `skfem.MeshTet` with the names of boundaries and subdomains."""
        from . import adapters

        return adapters.to_skfem(self)

    def to_pyvista(self) -> Any:
        """A `pyvista.UnstructuredGrid` of the tets."""
        from . import adapters

        return adapters.to_pyvista(self)

    def to_ngsolve(self) -> Any:
        """An `ngsolve.Mesh` with the names of boundaries and materials."""
        from . import adapters

        return adapters.to_ngsolve(self)

    def to_mfem(self) -> Any:
        """An `mfem.ser.Mesh` with the numbers of bodies and boundaries."""
        from . import adapters

        return adapters.to_mfem(self)

    # Those that take a part from each process.

    def to_dolfinx(
        self, ghost_mode: Literal["none", "shared_facet", "shared_vertex"] = "none"
    ) -> DolfinxMesh:
        """A mesh of DOLFINx with its tags, on `comm` or in this process alone. *Collective.*

        Each tet stays in its process. Tags are the numbers of bodies and boundaries, which
        `numbers_named` finds. A mesh of order 2 has coordinate elements of degree 2. Versions 0.5
        and later.

        Args:
            ghost_mode: Which cells of other processes are ghosts, by DOLFINx's names.
        """
        from ._distributed import to_dolfinx

        return to_dolfinx(self, ghost_mode)

    def to_dmplex(self) -> Any:
        """An interpolated `petsc4py.PETSc.DMPlex`, on `comm` or in this process alone. *Collective.*

        Each tet stays in its process. The labels "Cell Sets" and "Face Sets" have the numbers of
        bodies and boundaries, which `numbers_named` finds. A face of a boundary has its label in
        each process that has the face; `DMPlex.labelComplete` adds edges and vertices.

        In a mesh of order 2 the vertices of the plex are the corners of the tets, in the sequence
        of `points`, and its coordinates are a field of degree 2 on vertices and edges.
        """
        from ._distributed import to_dmplex

        return to_dmplex(self)


def _index_type(count: int) -> type[np.int32] | type[np.int64]:
    return np.int32 if count <= np.iinfo(np.int32).max else np.int64


def _frozen(array: NDArray[Any]) -> NDArray[Any]:
    """The array, read-only like those of the library."""
    array.setflags(write=False)
    return array
