"""Prints the regions that NGSolve reads from a mesh, with number of elements and measure, and checks that names select them."""

import json
import re
import sys
from collections import Counter

from ngsolve import BND, CF, H1, VOL, Integrate, Mesh

mesh = Mesh(sys.argv[1])
found = {}
for key, kind, names in (("boundaries", BND, mesh.GetBoundaries()), ("bodies", VOL, mesh.GetMaterials())):
    counts = Counter(element.mat for element in mesh.Elements(kind))
    sizes = Counter()
    for name, size in zip(names, Integrate(CF(1), mesh, kind, region_wise=True)):
        sizes[name] += size
    # Materials with unused numbers have no elements.
    found[key] = {name: [counts[name], sizes[name]] for name in sizes if counts[name]}

# Typical use: a region by name, and a Dirichlet condition on it.
for name, (_, area) in list(found["boundaries"].items())[:20]:
    region = Integrate(CF(1), mesh, definedon=mesh.Boundaries(re.escape(name)))
    assert abs(region - area) < 1e-9, (name, region, area)
    space = H1(mesh, order=1, dirichlet=re.escape(name))
    assert 0 < space.ndof - sum(space.FreeDofs()), f"nothing is fixed on {name}"
print(json.dumps(found))
