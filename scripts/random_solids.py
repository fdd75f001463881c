#!/usr/bin/env python3
"""Makes STEP files of random solids with Gmsh's OpenCASCADE, and their volumes.

    python3 scripts/random_solids.py FOLDER [COUNT]

Each is a Boolean of two to four rotated primitives, some with rounded or cut edges. Seeds are 0 to COUNT - 1 (200); a seed whose
Boolean fails, or leaves no solid, gives no file. `measures.json` has the volumes and areas that OpenCASCADE computes.
"""

import json
import math
import os
import random
import sys

import gmsh

occ = gmsh.model.occ


def primitive(r):
    """A primitive of about unit size near the origin, rotated."""
    at = [r.uniform(-0.6, 0.6) for _ in range(3)]
    size = [r.uniform(0.5, 1.4) for _ in range(3)]
    kind = r.choice(["box", "box", "cylinder", "cylinder", "cone", "sphere", "torus", "wedge"])
    if kind == "box":
        tag = occ.addBox(*at, *size)
    elif kind == "cylinder":
        tag = occ.addCylinder(*at, 0, 0, 1.5 * size[2], 0.5 * size[0])
    elif kind == "cone":
        tag = occ.addCone(*at, 0, 0, 1.5 * size[2], 0.6 * size[0], r.choice([0, 0.3 * size[1]]))
    elif kind == "sphere":
        tag = occ.addSphere(*at, 0.6 * size[0])
    elif kind == "torus":
        tag = occ.addTorus(*at, 0.8 * size[0], 0.3 * size[0] * size[1])
    else:
        tag = occ.addWedge(*at, *size, ltx=r.uniform(0, 0.8) * size[0])
    for _ in range(r.choice([0, 1, 2])):
        axis = [r.uniform(-1, 1) for _ in range(3)]
        occ.rotate([(3, tag)], *at, *axis, r.uniform(0, math.pi))
    return tag


def solids(r):
    result = [(3, primitive(r))]
    for _ in range(r.randint(1, 3)):
        other = [(3, primitive(r))]
        result, _ = r.choice([occ.fuse, occ.fuse, occ.cut, occ.cut, occ.intersect, occ.fragment])(result, other)
        result = [entity for entity in result if entity[0] == 3]
        if not result:
            raise RuntimeError("nothing is left")
    if r.random() < 0.5 and len(result) == 1:
        occ.synchronize()
        edges = [tag for _, tag in gmsh.model.getBoundary(gmsh.model.getBoundary(result, oriented=False), combined=False, oriented=False)]
        chosen = r.sample(sorted(set(edges)), min(r.randint(1, 3), len(set(edges))))
        if r.random() < 0.7:
            result = occ.fillet([result[0][1]], chosen, [r.uniform(0.03, 0.12)])
        else:
            faces = [gmsh.model.getAdjacencies(1, edge)[0][0] for edge in chosen]
            result = occ.chamfer([result[0][1]], chosen, faces, [r.uniform(0.03, 0.1)])
    occ.synchronize()
    entities = gmsh.model.getEntities(3)
    if not entities or min(occ.getMass(*entity) for entity in entities) < 1e-9:
        raise RuntimeError("no solid")
    return entities


def measured(entities):
    """Volumes of solids and areas of faces."""
    return {
        "volumes": [occ.getMass(*entity) for entity in entities],
        "areas": [occ.getMass(*face) for face in gmsh.model.getEntities(2)],
    }


def write_all(name, solids, measured):
    """Writes a file for each seed, and the measures of all."""
    folder, count = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 200
    os.makedirs(folder, exist_ok=True)
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    measures = {}
    for seed in range(count):
        gmsh.clear()
        gmsh.model.add(f"{name}{seed:03}")
        try:
            entities = solids(random.Random(seed))
            gmsh.write(f"{folder}/{name}{seed:03}.step")
            measures[f"{name}{seed:03}"] = measured(entities)
        except Exception as error:
            print(f"seed {seed}: not made: {error}", file=sys.stderr)
    with open(f"{folder}/measures.json", "w") as file:
        json.dump(measures, file, indent=1)
    gmsh.finalize()


if __name__ == "__main__":
    write_all("seed", solids, measured)
