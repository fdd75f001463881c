"""Meshes as those of solvers and viewers. Each function imports the package that it is for."""

from __future__ import annotations

import os
import tempfile
from typing import TYPE_CHECKING, Any

import numpy as np

from ._faces import positions

if TYPE_CHECKING:
    from ._mesh import Mesh


def to_skfem(mesh: Mesh) -> Any:
    """A `skfem.MeshTet`, or `skfem.MeshTet2` for order 2: boundaries and subdomains by name.

    Boundaries are oriented: their normals point out of the inner body. Names of several patches
    have the faces of all of them.
    """
    import skfem

    # scikit-fem sorts the vertices of each tet, in place: it gets an array of its own.
    made = (skfem.MeshTet if mesh.order == 1 else skfem.MeshTet2)(
        np.ascontiguousarray(mesh.points.T),
        np.array(mesh.tet_nodes.T, dtype=np.int64, order="C"),
        validate=False,
    )
    names = dict.fromkeys(name for label in mesh.patches for name in label.names)
    # MeshTet2 numbers the corners first, in their order.
    faces = mesh.faces if mesh.order == 1 else np.searchsorted(np.unique(mesh.tets), mesh.faces)
    # The facet of scikit-fem that each face is.
    of_faces = positions(faces, made.facets.T, len(mesh.points))
    boundaries = {name: of_faces[mesh.faces_named(name)] for name in names}
    bodies = {name: mesh.tets_named(name) for name in mesh.body_names.values()}
    return made.with_boundaries(boundaries).with_subdomains(bodies)


def to_meshio(mesh: Mesh) -> Any:
    """A `meshio.Mesh`: tets and triangles with their numbers as `gmsh:physical`, and the names."""
    import meshio

    tet, triangle = ("tetra", "triangle") if mesh.order == 1 else ("tetra10", "triangle6")
    cells = [(tet, mesh.tet_nodes), (triangle, mesh.face_nodes)]
    names = {name: np.array([number, 3]) for number, name in mesh.body_names.items()}
    names.update({name: np.array([number, 2]) for number, name in mesh.face_names.items()})
    tags = [mesh.bodies, mesh.face_tags]
    data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
    return meshio.Mesh(mesh.points, cells, cell_data=data, field_data=names)


def to_pyvista(mesh: Mesh) -> Any:
    """A `pyvista.UnstructuredGrid` of the tets, with the body number of each as `body`."""
    import pyvista

    kind = pyvista.CellType.TETRA if mesh.order == 1 else pyvista.CellType.QUADRATIC_TETRA
    grid = pyvista.UnstructuredGrid({kind: mesh.tet_nodes}, np.array(mesh.points))
    grid.cell_data["body"] = mesh.bodies
    if len(mesh.parts) > 1:
        part = np.empty(len(mesh.tets), dtype=np.int32)
        for of in mesh.parts:
            part[of.tet_ids] = of.rank
        grid.cell_data["part"] = part
    return grid


def to_ngsolve(mesh: Mesh) -> Any:
    """An `ngsolve.Mesh`, by NETGEN's .vol format: names of materials and boundaries are kept."""
    import ngsolve

    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "mesh.vol")
        mesh.write(path)
        return ngsolve.Mesh(path)


def to_mfem(mesh: Mesh) -> Any:
    """An `mfem.ser.Mesh`; attributes are the numbers of bodies and boundaries.

    Faces between bodies are boundary elements, too.
    """
    import mfem.ser as mfem

    if mesh.order == 2:
        # MFEM makes the grid function of the nodes.
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "mesh.msh")
            mesh.write(path)
            return mfem.Mesh(path, 1, 0)

    made = mfem.Mesh(3, len(mesh.points), len(mesh.tets), len(mesh.faces), 3)
    for point in mesh.points.tolist():
        made.AddVertex(point)
    for tet, body in zip(mesh.tets.tolist(), mesh.bodies.tolist()):
        made.AddTet(tet, body)
    for face, tag in zip(mesh.faces.tolist(), mesh.face_tags.tolist()):
        made.AddBdrTriangle(face, tag)
    made.FinalizeTetMesh(1, 0, True)
    return made
