"""The input of the mesher, and its options."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _arguments as arguments
from . import _native
from ._errors import NoteWarning
from ._mesh import Mesh
from ._mpi import Processes, agreed, communicator
from ._parts import Label, labels
from ._sizes import Background, Grid, Interpolated

if TYPE_CHECKING:
    from mpi4py import MPI

    from .csg import Solid

#: Sizes at points: (n, 3) coordinates to (n,) positive numbers.
SizeFunction = Callable[[NDArray[np.float64]], Union[NDArray[np.float64], float]]
#: Receives the name of a stage and its progress, 0 to 1.
ProgressFunction = Callable[[str, float], object]
Path = Union[str, "os.PathLike[str]"]

_PRESETS = ("very-coarse", "coarse", "moderate", "fine", "very-fine")
_EFFORTS = ("quick", "standard", "careful", "thorough")
_OVERLAP_TO = ("first", "last", "smaller")
_UNITS = ("file", "m", "cm", "mm", "um", "km", "in", "ft")
_METHODS = ("refine", "surface", "decompose")
_PLANES = ("best", "axes", "principal", "random", "median")
_MOST_LEVELS = 10
_MOST_PIECES = 1024
_MOST_PARTS = 8192


class Entities(NamedTuple):
    """Numbers of geometric entities."""

    bodies: int
    patches: int
    curves: int
    corners: int


class _Bar:
    """Prints one line for each stage to the standard error."""

    def __init__(self) -> None:
        self._shown = ""

    def __call__(self, stage: str, fraction: float) -> None:
        line = f"\r{stage:<12} {round(100 * fraction):3d} %"
        if line != self._shown:
            self._shown = line
            print(line, end="\n" if fraction == 1 else "", file=sys.stderr, flush=True)


def _progress(progress: bool | ProgressFunction | None) -> ProgressFunction | None:
    if progress is True:
        return _Bar()
    if progress is False or progress is None:
        return None
    if not callable(progress):
        raise TypeError(f"progress must be a function or a bool, not {progress!r}")
    return progress


def warn(notes: Iterable[str]) -> None:
    """Shows messages of the library as warnings, at the line that called this package."""
    for note in notes:
        warnings.warn(note, NoteWarning, stacklevel=3)


def _input(
    keep_surface: bool,
    merge: float | None,
    feature_angle: float | None,
    unit: str = "file",
    keep_small: bool = False,
    solids: str | int | Iterable[str | int] = (),
    overlap_to: str | None = None,
) -> dict[str, Any]:
    angle = arguments.length("feature_angle", feature_angle)
    if angle is not None and angle > 180:
        raise ValueError(f"feature_angle cannot be {angle}: expected an angle of at most 180 degrees")
    return {
        "keep_surface": bool(keep_surface),
        "keep_small": bool(keep_small),
        "merge": arguments.length("merge", merge),
        "feature_angle": angle,
        "unit": arguments.one_of("unit", unit, _UNITS),
        "solids": [str(solid) for solid in ([solids] if isinstance(solids, (str, int)) else solids)],
        "overlap_to": overlap_to and arguments.one_of("overlap_to", overlap_to, _OVERLAP_TO),
    }


class Geometry:
    """Solids to be meshed, surfaces that bound them, or a mesh to be refined and partitioned.

    `Geometry(path)` reads a file: a geometry in NETGEN's language (.geo), CAD parts (.step, .brep
    of OpenCASCADE), surfaces (.stl, .off, .obj, .ply, .poly, .smesh), or a mesh, used unchanged
    (.msh, .vol, .mesh, .meshb, .vtu, .pvtu, .ele, an Elmer folder). Several CAD files or surfaces,
    `Geometry("plate.step", "bolt.step")`, are one geometry.

    Args:
        paths: The file or files.
        keep_surface: Keep the triangles of input surfaces; by default they are remeshed.
        merge: Take surfaces of a .geo file that are of one kind and at most this far apart as one
            (length); by default 1e-8 of the size of the geometry.
        feature_angle: Angle between facets that separates two patches of an input surface
            (degrees); by default 40.
        unit: Unit of lengths for a STEP file: "m", "cm", "mm", "um", "km", "in", "ft", or "file".
        keep_small: Keep edges and faces of CAD files that are far smaller than the elements; by
            default they are merged into their neighbours, with a warning.
        solids: Names or numbers of the solids of a CAD file that are meshed; by default all. Numbers
            count from 1 in the order of the file.
        overlap_to: Give the common part of solids of a CAD file that overlap to the "first" or "last"
            in the file or the "smaller", and cut it out of the others; by default they are refused.
    """

    def __init__(
        self,
        *paths: Path,
        keep_surface: bool = False,
        merge: float | None = None,
        feature_angle: float | None = None,
        unit: str = "file",
        keep_small: bool = False,
        solids: str | int | Iterable[str | int] = (),
        overlap_to: str | None = None,
    ) -> None:
        if not paths:
            raise TypeError("Geometry needs a file; see also from_text, from_surface and from_mesh")
        given = _input(keep_surface, merge, feature_angle, unit, keep_small, solids, overlap_to)
        files = [os.fspath(path) for path in paths]
        # None in a process that only takes part in the meshing.
        self._native: _native.Geometry | None = _native.Geometry.from_files(files, given)
        warn(self.notes)

    @classmethod
    def _of(cls, native: _native.Geometry | None) -> Geometry:
        geometry = cls.__new__(cls)
        geometry._native = native
        return geometry

    @classmethod
    def from_text(cls, text: str) -> Geometry:
        """Reads the text of a .geo file."""
        geometry = cls._of(_native.Geometry.from_text(text))
        warn(geometry.notes)
        return geometry

    @classmethod
    def from_solids(
        cls, *solids: Solid, boundaries: Iterable[tuple[Solid, Solid, str | int]] = ()
    ) -> Geometry:
        """Makes each solid of `tetmill.csg` a body.

        Args:
            solids: The bodies, which must not overlap.
            boundaries: (solid, body, boundary): a name or number for all surfaces of a solid where
                they bound a body.
        """
        from .csg import geo_text

        geometry = cls._of(_native.Geometry.from_text(geo_text(*solids, boundaries=boundaries)))
        warn(geometry.notes)
        return geometry

    @classmethod
    def from_surface(
        cls,
        points: ArrayLike,
        triangles: ArrayLike,
        groups: ArrayLike | None = None,
        *,
        names: dict[int, str] | None = None,
        keep_surface: bool = False,
        feature_angle: float | None = None,
    ) -> Geometry:
        """Takes closed triangulated surfaces.

        Args:
            points: Coordinates, (n, 3). Equal points are merged.
            triangles: Indices of points, (m, 3), counterclockwise seen from outside.
            groups: The boundary number of each triangle, (m,), from 1; by default boundaries are
                found from sharp edges.
            names: Names of boundary numbers.
            keep_surface: Keep the triangles; by default the surface is remeshed.
            feature_angle: Angle between triangles that separates two patches (degrees); by
                default 40.
        """
        given = arguments.positions("points", points)
        faces = arguments.indices("triangles", triangles, 3, len(given))
        numbers = arguments.numbers("groups", groups, len(faces))
        settings = _input(keep_surface, None, feature_angle)
        called = arguments.names("names", names)
        geometry = cls._of(_native.Geometry.from_surface(given, faces, numbers, called, settings))
        warn(geometry.notes)
        return geometry

    @classmethod
    def from_mesh(
        cls,
        points: ArrayLike,
        tets: ArrayLike,
        bodies: ArrayLike | None = None,
        faces: ArrayLike | None = None,
        face_tags: ArrayLike | None = None,
        *,
        body_names: dict[int, str] | None = None,
        face_names: dict[int, str] | None = None,
    ) -> Geometry:
        """Takes a tetrahedral mesh, which can be partitioned and refined; boundaries stay flat.

        Args:
            points: Coordinates, (n, 3).
            tets: Indices of points, (m, 4), all with the same orientation.
            bodies: The body number of each tet, (m,), from 1; by default there is one body.
            faces: Triangles on boundaries and between bodies, (k, 3). Other faces there become
                boundaries of their own.
            face_tags: The boundary number of each of these, (k,), from 1.
            body_names: Names of body numbers.
            face_names: Names of boundary numbers.
        """
        given = arguments.positions("points", points)
        cells = arguments.indices("tets", tets, 4, len(given))
        triangles = arguments.indices("faces", [] if faces is None else faces, 3, len(given))
        geometry = cls._of(
            _native.Geometry.from_mesh(
                given,
                cells,
                arguments.numbers("bodies", bodies, len(cells)),
                triangles,
                arguments.numbers("face_tags", face_tags, len(triangles)),
                arguments.names("body_names", body_names),
                arguments.names("face_names", face_names),
            )
        )
        warn(geometry.notes)
        return geometry

    @classmethod
    def on_first(cls, comm: MPI.Intracomm, make: Callable[[], Geometry]) -> Geometry:
        """*Collective.* The geometry that `make` returns in process 0, where alone it is called.

        For files that only process 0 can read, or that are large. The result of other processes
        has no properties; it can only be meshed, together with process 0.

        Args:
            comm: A communicator of mpi4py.
            make: Such as `lambda: Geometry("part.geo")`.
        """
        processes = communicator(comm)
        made = agreed(processes, lambda: make() if processes.rank == 0 else None)
        return cls._of(None) if made is None else made

    @property
    def _here(self) -> _native.Geometry:
        if self._native is None:
            raise RuntimeError("only process 0 has this geometry")
        return self._native

    @property
    def notes(self) -> list[str]:
        """Warnings about the text, repairs, additions and omissions while reading."""
        return self._here.notes()

    @property
    def entities(self) -> Entities:
        """The numbers of bodies, patches, curves and corners."""
        found = arguments.as_dict(self._here.entities())
        return Entities(**{name: found[name] for name in Entities._fields})

    @property
    def bodies(self) -> list[Label]:
        """Numbers and names of the bodies."""
        return labels(self._here.bodies())

    @property
    def patches(self) -> list[Label]:
        """Numbers and names of the patches."""
        return labels(self._here.patches())

    @property
    def is_mesh(self) -> bool:
        """Whether it is a tetrahedral mesh."""
        return self._here.is_mesh()

    def inspect(self) -> dict[str, Any] | None:
        """Its bodies, patches, curves and corners in detail; None for a tetrahedral mesh."""
        text = self._here.inspect()
        return None if text is None else dict(arguments.as_dict(text))

    def __repr__(self) -> str:
        if self._native is None:
            return "<tetmill.Geometry of process 0>"
        bodies, patches, curves, corners = self.entities
        return f"<tetmill.Geometry: {bodies} bodies, {patches} patches, {curves} curves, {corners} corners>"

    def generate(
        self,
        *,
        levels: int = 0,
        tets: float | None = None,
        method: Literal["refine", "surface", "decompose"] = "refine",
        parts: int | None = None,
        preset: Literal["very-coarse", "coarse", "moderate", "fine", "very-fine"] | None = None,
        maxh: float | None = None,
        minh: float | None = None,
        grading: float | None = None,
        closeness: float | None = None,
        size: SizeFunction | Grid | Background | None = None,
        sources: ArrayLike | None = None,
        mesh_size_file: Path | None = None,
        coarse: float | None = None,
        pieces: int | None = None,
        nested: bool = False,
        refine: int = 0,
        order: Literal[1, 2] = 1,
        allow_off_surface: bool = False,
        effort: Literal["quick", "standard", "careful", "thorough"] | None = None,
        planes: Literal["best", "axes", "principal", "random", "median"] = "best",
        planes_from: ArrayLike | None = None,
        memory: float | None = None,
        progress: bool | ProgressFunction | None = None,
        comm: MPI.Intracomm | None = None,
    ) -> Mesh:
        """Makes a mesh. Options have the names and defaults of the command line.

        Ctrl-C stops the run. Other threads of Python run meanwhile.

        Args:
            levels: Levels of uniform refinement; each splits a tet into eight.
            tets: Total number of tets, such as 1e9: gives this number to 1.3 times as many
                (`--elements`). Replaces `levels`, `pieces` and `coarse`.
            method: "refine": partition the coarse mesh and refine it uniformly; "surface": refine
                the surface of each part and mesh its inside; "decompose": cut the geometry by
                planes and mesh each piece.
            parts: Number of parts: 1, or one in each process of `comm`. They are made by as many
                threads.
            preset: Fineness, by default "moderate".
            maxh: Largest element size (length).
            minh: Smallest element size due to curvature and short curves (length).
            grading: Growth of the size per unit of distance; by default set by the preset.
            closeness: Largest element size in thin regions, relative to their thickness; by
                default set by the preset.
            size: Largest element size of the coarse mesh by place: a `Grid`, a `Background`, or a
                function of points of shape (n, 3) that returns (n,) sizes. The mesher needs sizes one by one,
                so it calls the function with (1, 3) points, from several threads, three or four
                times for each coarse tet; `Grid.sample` calls it once.
            sources: Points with sizes, (n, 4), from which sizes grow by the grading.
            mesh_size_file: Mesh-size file of NETGEN.
            coarse: Number of coarse tets, to 1.5 times as many.
            pieces: Split each coarse edge into this many, so each coarse tet into its cube.
            nested: Make the tets of each level lie in those of the level before.
            refine: Levels of refinement of the tets that the ranks made (methods "surface" and
                "decompose"); all sizes are those before.
            order: 2 for tets of ten nodes, curved along the geometry; each is proved valid.
            allow_off_surface: With order 2, leave edges straight where the tets beside them would
                not be valid otherwise; `report` lists them.
            effort: Effort of mesh improvement; by default "careful" up to 100,000 tets, then
                "standard".
            planes: Candidate planes of the method "decompose".
            planes_from: Cut by these planes instead: a point and a normal in each row, (n, 6).
            memory: Memory for the fine mesh (bytes); by default the free memory.
            progress: True prints the stages to the standard error. A function is called in this
                thread with the name of a stage and its progress, 0 to 1.
            comm: *Collective.* Make the mesh across the processes of this communicator of mpi4py;
                each gets its parts. Process 0 gives the geometry, `size`, `sources`,
                `mesh_size_file` and `progress`; those of others are ignored
                (`Geometry.on_first` reads it there only). All other options must be the same in all processes.

        Raises:
            Error: By kind, `InputError`, `NoMeshError`, `ResourceError`, ....
            Exception: Those of the functions `size` and `progress`.
        """

        def options() -> dict[str, Any]:
            if tets is not None and (levels or pieces is not None or coarse is not None):
                raise ValueError("tets chooses the sizes and the refinement: leave out levels, pieces and coarse")
            if pieces is not None and levels:
                raise ValueError("levels and pieces exclude each other")
            if size is not None and not callable(size):
                raise TypeError(
                    f"size must be a function, a Grid or a Background, not {size!r}; a constant size is maxh"
                )
            exponent = arguments.whole("levels", levels, 0, _MOST_LEVELS)
            return {
                "method": arguments.one_of("method", method, _METHODS),
                "parts": 0 if parts is None else arguments.whole("parts", parts, 1, _MOST_PARTS),
                "elements": arguments.count("tets", tets),
                "pieces": 2**exponent if pieces is None else arguments.whole("pieces", pieces, 1, _MOST_PIECES),
                "nested": bool(nested),
                "refine": arguments.whole("refine", refine, 0, _MOST_LEVELS),
                "order": arguments.whole("order", order, 1, 2),
                "allow_off_surface": bool(allow_off_surface),
                "planes": arguments.one_of("planes", planes, _PLANES),
                "planes_from": _rows("planes_from", planes_from, 6),
                "memory": arguments.count("memory", memory),
                "preset": None if preset is None else arguments.one_of("preset", preset, _PRESETS),
                "maxh": arguments.length("maxh", maxh),
                "minh": arguments.length("minh", minh),
                "grading": arguments.length("grading", grading),
                "closeness": arguments.length("closeness", closeness, zero=True),
                "mesh_size_file": None if mesh_size_file is None else os.fspath(mesh_size_file),
                "sources": _rows("sources", sources, 4),
                "effort": None if effort is None else arguments.one_of("effort", effort, _EFFORTS),
                "coarse": arguments.count("coarse", coarse),
                "size": size._native if isinstance(size, Interpolated) else size,
                "progress": _progress(progress),
            }

        if comm is None:
            mesh = Mesh(_native.generate(self._here, {**options(), "processes": None}))
        else:
            processes = communicator(comm)
            given = {**agreed(processes, options), "processes": Processes(processes)}
            mesh = Mesh(_native.generate(self._native, given), processes)
        warn(mesh.notes)
        return mesh


def _rows(name: str, values: ArrayLike | None, width: int) -> NDArray[np.float64] | None:
    if values is None:
        return None
    rows = arguments.positions(name, values, width)
    if name == "sources" and not (rows[:, 3] > 0).all():
        row = int(np.flatnonzero(~(rows[:, 3] > 0))[0])
        raise ValueError(f"{name}[{row}] has the size {rows[row, 3]}: sizes are positive")
    return rows
