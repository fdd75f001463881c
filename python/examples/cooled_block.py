"""Heat from a copper core through a finned block: geometry, mesh, sizes, solution, pictures."""

import numpy as np
import skfem
import tetmill
from skfem.helpers import dot, grad
from tetmill.csg import Brick, Cylinder, Plane

# Geometry: a block with three slots, a copper core in its base, and a bore for the coolant.
bottom = Plane((0, 0, 0), (0, 0, -1)).bc("base")
fins = Brick((0, 0, -1), (7, 4, 3), bc="air")
for x in (1, 3, 5):
    fins = fins - Brick((x, -1, 1.2), (x + 1, 5, 4), bc="air")
bore = Cylinder((0, 3, 0.6), (7, 3, 0.6), 0.3, bc="coolant")
core = (Cylinder((3.5, 1.3, 0), (3.5, 1.3, 1), 0.6, bc="joint") & bottom & Plane((0, 0, 0.8), (0, 0, 1), bc="joint"))
core = core.named("copper")
body = (fins & bottom - bore - core).named("aluminium")
# The chip heats the copper from below.
geometry = tetmill.Geometry.from_solids(body, core, boundaries=[(bottom, core, "chip")])


def size(points):
    """Fine at the core, coarse far from it."""
    return 0.12 + 0.15 * np.linalg.norm(points - [3.5, 1.3, 0.4], axis=1)


# Mesh: sizes on a grid, then one level of refinement with curved boundaries on the geometry.
mesh = geometry.generate(size=tetmill.Grid.sample(size, (0, 0, 0), (7, 4, 3)), maxh=0.5, levels=1)
print(mesh, "smallest angle", round(mesh.quality()["smallest_dihedral"], 1))

# Solution: -div(k grad T) = 0, a heat flux of 100 from the chip, T = 20 at the coolant.
grid = mesh.to_skfem()
basis = skfem.Basis(grid, skfem.ElementTetP1())
k = basis.with_element(skfem.ElementTetP0()).zeros()
k[grid.subdomains["copper"]], k[grid.subdomains["aluminium"]] = 4.0, 2.4
stiffness = skfem.BilinearForm(lambda u, v, w: w.k * dot(grad(u), grad(v)))
conductivity = basis.with_element(skfem.ElementTetP0()).interpolate(k)
chip = skfem.FacetBasis(grid, skfem.ElementTetP1(), facets="chip")
flux = skfem.LinearForm(lambda v, w: 100.0 * v).assemble(chip)
cold = basis.get_dofs("coolant")
system = skfem.condense(stiffness.assemble(basis, k=conductivity), flux, x=basis.zeros() + 20, D=cold)
temperature = skfem.solve(*system)
print(f"{len(temperature):,} unknowns, {temperature.min():.1f} to {temperature.max():.1f} degrees")

# Pictures: the mesh, cut through the core; the temperature in a file for ParaView.
with open("cooled_block.png", "wb") as file:
    file.write(mesh.picture(cut=(0, 1.3, 0, 0, -1, 0), color_by="body"))
field = mesh.to_pyvista()
field["temperature"] = temperature
field.save("cooled_block.vtu")
