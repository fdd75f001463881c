"""From solid geometry to very large, partitioned tetrahedral meshes, in parallel.

    import tetmill

    geometry = tetmill.Geometry("part.geo")
    mesh = geometry.generate(levels=2)
    mesh.points, mesh.tets, mesh.faces_named("inlet")

A geometry is read from a file, from text or from arrays, or built from solids (`tetmill.csg`). It
consists of bodies, which are meshed, and patches, the faces around and between them. Both have
numbers and names.
"""

from . import csg
from ._errors import Cancelled, Error, InputError, NoMeshError, NoteWarning, RankError, ResourceError
from ._geometry import Entities, Geometry, SizeFunction
from ._mesh import Mesh, Written
from ._native import __version__, set_threads
from ._parts import Block, Ghosts, Label, Level, Part
from ._sizes import Background, Grid

__all__ = [
    "Background",
    "Block",
    "Cancelled",
    "Entities",
    "Error",
    "Geometry",
    "Ghosts",
    "Grid",
    "InputError",
    "Label",
    "Level",
    "Mesh",
    "NoMeshError",
    "NoteWarning",
    "Part",
    "RankError",
    "ResourceError",
    "SizeFunction",
    "Written",
    "__version__",
    "csg",
    "set_threads",
]
