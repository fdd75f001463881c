#!/usr/bin/env python3
"""Makes STEP files of random solids that touch, with Gmsh's OpenCASCADE, and the areas where they do.

    python3 scripts/touching_solids.py FOLDER [COUNT]

Each has two to four rotated primitives. From each one those before it are cut away, so its faces lie on theirs, with other edges. Seeds
are 0 to COUNT - 1 (200); a seed for which a Boolean fails, or that leaves no two solids, gives no file. `measures.json` has the volumes of
the solids and the area of their interfaces, after OpenCASCADE imprinted them on each other.
"""

import gmsh

from random_solids import primitive, write_all

occ = gmsh.model.occ


def solids(r):
    """Solids that do not overlap, with nothing shared between them."""
    made = []
    for _ in range(r.randint(2, 4)):
        new = [(3, primitive(r))]
        if made:
            new, _ = occ.cut(new, made, removeTool=False)
        made += [entity for entity in new if entity[0] == 3]
    occ.synchronize()
    entities = gmsh.model.getEntities(3)
    if len(entities) < 2:
        raise RuntimeError("fewer than two solids")
    return entities


def measured(entities):
    """Volumes and the area of interfaces of solids that are imprinted on each other."""
    occ.fragment(entities, [])
    occ.synchronize()
    shared = [face for face in gmsh.model.getEntities(2) if len(gmsh.model.getAdjacencies(*face)[0]) == 2]
    return {
        "volumes": [occ.getMass(*entity) for entity in gmsh.model.getEntities(3)],
        "interface": sum(occ.getMass(*face) for face in shared),
    }


if __name__ == "__main__":
    write_all("touch", solids, measured)
