#!/usr/bin/env python3
"""Makes STEP files of random solids that overlap, with Gmsh's OpenCASCADE, and what is left of each.

    python3 scripts/overlapping_solids.py FOLDER [COUNT]

Each has two to four rotated primitives. Seeds are 0 to COUNT - 1 (200); a seed for which a Boolean fails gives no file. `measures.json` has
the volumes of the solids if each keeps what it has in common with later ones, and the area of their interfaces; solids of which nothing is
left have a volume of 0.
"""

import gmsh

from random_solids import primitive, write_all

occ = gmsh.model.occ


def solids(r):
    """Primitives."""
    made = [(3, primitive(r)) for _ in range(r.randint(2, 4))]
    occ.synchronize()
    return made


def measured(entities):
    """Volumes and the area of interfaces after each solid is cut out of all later ones."""
    left = []
    volumes = []
    for k, entity in enumerate(entities):
        rest = occ.copy([entity])
        if k > 0:
            rest, _ = occ.cut(rest, occ.copy(entities[:k]))
        volumes.append(sum(occ.getMass(*part) for part in rest if part[0] == 3))
        left += [part for part in rest if part[0] == 3]
    occ.remove(entities, recursive=True)
    occ.fragment(left, [])
    occ.synchronize()
    shared = [face for face in gmsh.model.getEntities(2) if len(gmsh.model.getAdjacencies(*face)[0]) == 2]
    # Parts of one solid that touch each other have no face in common.
    return {"volumes": volumes, "interface": sum(occ.getMass(*face) for face in shared)}


if __name__ == "__main__":
    write_all("overlap", solids, measured)
