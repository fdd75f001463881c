#!/usr/bin/env python3
"""Makes BREP and STEP files of many kinds with Gmsh's OpenCASCADE, and the volumes and areas of their parts.

    python3 scripts/brep_corpus.py FOLDER

Needs the Python package gmsh. `measures.json` in the folder has, for each file, the volumes of its
solids and the areas of its faces as OpenCASCADE computes them.
"""

import json
import math
import os
import sys

import gmsh

occ = gmsh.model.occ
parts = {}


def part(function):
    parts[function.__name__] = function
    return function


def box(x=0, y=0, z=0, a=1, b=1, c=1):
    return occ.addBox(x, y, z, a, b, c)


def fuse(a, *others):
    return occ.fuse([(3, a)], [(3, o) for o in others])[0]


def cut(a, *others):
    return occ.cut([(3, a)], [(3, o) for o in others])[0]


def edges_of(solid):
    occ.synchronize()
    return [tag for _, tag in gmsh.model.getBoundary([(3, solid)], combined=False, recursive=False)], sorted(
        {tag for _, tag in gmsh.model.getBoundary(
            gmsh.model.getBoundary([(3, solid)], combined=False, oriented=False),
            combined=False, oriented=False)})


def polygon(points, close=True):
    tags = [occ.addPoint(*p) for p in points]
    lines = [occ.addLine(a, b) for a, b in zip(tags, tags[1:] + tags[:1])]
    return occ.addCurveLoop(lines)


def circle_wire(radius, z, axis=(0, 0, 1), x=0, y=0):
    return occ.addWire([occ.addCircle(x, y, z, radius, zAxis=axis)])


@part
def plain_box(): box()
@part
def sphere(): occ.addSphere(0.1, 0.2, 0.3, 1)
@part
def half_sphere(): occ.addSphere(0, 0, 0, 1, angle1=0)
@part
def wedge_of_sphere(): occ.addSphere(0, 0, 0, 1, angle1=-0.5, angle2=1.0, angle3=2.0)
@part
def cylinder(): occ.addCylinder(0, 0, 0, 0, 0, 2, 0.5)
@part
def tilted_cylinder(): occ.addCylinder(1, 2, 3, 1, 1, 2, 0.5, angle=4)
@part
def cone(): occ.addCone(0, 0, 0, 0, 0, 2, 1, 0)
@part
def cone_frustum(): occ.addCone(0, 0, 0, 0, 1, 2, 1, 0.3)
@part
def torus(): occ.addTorus(0, 0, 0, 2, 0.5)
@part
def torus_sector(): occ.addTorus(0, 0, 0, 2, 0.5, angle=2)
@part
def wedge(): occ.addWedge(0, 0, 0, 1, 1, 1, ltx=0.3)


@part
def box_with_hole():
    cut(box(), occ.addCylinder(0.5, 0.5, -1, 0, 0, 3, 0.25))


@part
def cross_of_cylinders():
    fuse(occ.addCylinder(-2, 0, 0, 4, 0, 0, 0.7), occ.addCylinder(0, -2, 0, 0, 4, 0, 0.5))


@part
def common_of_cylinders():
    occ.intersect([(3, occ.addCylinder(-2, 0, 0, 4, 0, 0, 0.7))], [(3, occ.addCylinder(0, -2, 0, 0, 4, 0, 0.6))])


@part
def sphere_and_torus():
    fuse(occ.addSphere(0, 0, 0, 1.2), occ.addTorus(0, 0, 0, 1.2, 0.3))


@part
def box_less_sphere(): cut(box(), occ.addSphere(1, 1, 1, 0.6))


@part
def void_inside(): cut(box(), occ.addSphere(0.5, 0.5, 0.5, 0.3))


@part
def filleted_all():
    b = box(a=2, b=1.5, c=1)
    occ.fillet([b], edges_of(b)[1], [0.2])


@part
def filleted_some():
    b = box(a=2, b=1.5, c=1)
    occ.fillet([b], edges_of(b)[1][:5], [0.15])


@part
def filleted_variable():
    b = box(a=2, b=1.5, c=1)
    occ.fillet([b], [edges_of(b)[1][0]], [0.1, 0.4])


@part
def chamfered():
    b = box(a=2, b=1.5, c=1)
    surfaces, curves = edges_of(b)
    occ.chamfer([b], [curves[0]], [abs(surfaces[0])], [0.2])


@part
def filleted_union():
    out = fuse(box(a=2, b=2, c=0.5), occ.addCylinder(1, 1, 0, 0, 0, 1.5, 0.5))
    solid = out[0][1]
    occ.synchronize()
    chosen = []
    for c in edges_of(solid)[1]:
        x0, y0, z0, x1, y1, z1 = gmsh.model.getBoundingBox(1, c)
        if abs(z0 - 0.5) < 1e-3 and abs(z1 - 0.5) < 1e-3 and abs(x1 - x0 - 1) < 1e-3:
            chosen.append(c)
    occ.fillet([solid], chosen, [0.15])


@part
def loft():
    occ.addThruSections([circle_wire(1, 0), circle_wire(0.5, 1), circle_wire(0.8, 2)], makeSolid=True)


@part
def ruled_loft():
    occ.addThruSections([circle_wire(1, 0), circle_wire(0.5, 1), circle_wire(0.8, 2)], makeSolid=True, makeRuled=True)


@part
def loft_square_to_circle():
    square = polygon([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)])
    quarter = []
    center = occ.addPoint(0, 0, 2)
    ends = [occ.addPoint(0.6 * math.cos(a), 0.6 * math.sin(a), 2) for a in [math.pi * (k / 2 - 0.75) for k in range(4)]]
    for k in range(4):
        quarter.append(occ.addCircleArc(ends[k], center, ends[(k + 1) % 4]))
    occ.addThruSections([square, occ.addCurveLoop(quarter)], makeSolid=True)


@part
def pipe_along_spline():
    points = [occ.addPoint(*p) for p in [(0, 0, 0), (0, 0, 1), (1, 0.3, 2), (2, 1, 2)]]
    wire = occ.addWire([occ.addBSpline(points)])
    disk = occ.addDisk(0, 0, 0, 0.2, 0.2)
    occ.addPipe([(2, disk)], wire, "DiscreteTrihedron")


@part
def pipe_along_arc():
    a, c, b = occ.addPoint(0, 0, 0), occ.addPoint(1, 0, 0), occ.addPoint(1, 0, 1)
    wire = occ.addWire([occ.addCircleArc(a, c, b)])
    disk = occ.addDisk(0, 0, 0, 0.2, 0.2)
    occ.addPipe([(2, disk)], wire)


@part
def helix():
    turns, count = 2, 60
    points = [occ.addPoint(math.cos(t), math.sin(t), 0.5 * t / math.pi)
              for t in [2 * math.pi * turns * k / count for k in range(count + 1)]]
    wire = occ.addWire([occ.addBSpline(points)])
    disk = occ.addDisk(1, 0, 0, 0.15, 0.15)
    occ.rotate([(2, disk)], 1, 0, 0, 1, 0, 0, math.pi / 2)
    occ.addPipe([(2, disk)], wire, "Frenet")


@part
def thick_box():
    b = box()
    surfaces, _ = edges_of(b)
    occ.addThickSolid(b, [abs(surfaces[0])], -0.1)
    occ.remove([(3, b)])


@part
def thick_cylinder():
    b = occ.addCylinder(0, 0, 0, 0, 0, 2, 0.5)
    surfaces, _ = edges_of(b)
    occ.addThickSolid(b, [abs(surfaces[-1])], 0.1)
    occ.remove([(3, b)])


@part
def revolved_spline():
    points = [occ.addPoint(*p) for p in [(0.3, 0, 0), (0.8, 0, 0.5), (0.4, 0, 1.2), (0.6, 0, 2)]]
    spline = occ.addBSpline(points)
    a, b = occ.addPoint(0, 0, 0), occ.addPoint(0, 0, 2)
    lines = [occ.addLine(points[-1], b), occ.addLine(b, a), occ.addLine(a, points[0])]
    face = occ.addPlaneSurface([occ.addCurveLoop([spline] + lines)])
    occ.revolve([(2, face)], 0, 0, 0, 0, 0, 1, 2 * math.pi)


@part
def revolved_part():
    loop = polygon([(1, 0, 0), (1.5, 0, 0), (1.2, 0, 0.7)])
    occ.revolve([(2, occ.addPlaneSurface([loop]))], 0, 0, 0, 0, 0, 1, 4)


@part
def closed_spline_prism():
    points = [occ.addPoint(math.cos(a) * r, math.sin(a) * r, 0)
              for a, r in [(2 * math.pi * k / 8, 1 + 0.3 * (k % 2)) for k in range(8)]]
    spline = occ.addBSpline(points + points[:1])
    face = occ.addPlaneSurface([occ.addCurveLoop([spline])])
    occ.extrude([(2, face)], 0.2, 0.1, 1)


@part
def bezier_prism():
    p = [occ.addPoint(*x) for x in [(0, 0, 0), (0, 1, 0), (1, 1, 0), (1, 0, 0)]]
    face = occ.addPlaneSurface([occ.addCurveLoop([occ.addBezier(p), occ.addLine(p[3], p[0])])])
    occ.extrude([(2, face)], 0, 0, 0.7)


@part
def ellipse_prism():
    e = occ.addEllipse(0, 0, 0, 1, 0.4)
    occ.extrude([(2, occ.addPlaneSurface([occ.addCurveLoop([e])]))], 0, 0, 0.5)


def under_spline():
    """A column below a wavy B-spline surface."""
    points = []
    for i in range(5):
        for j in range(5):
            points.append(occ.addPoint(i / 4, j / 4, 1 + 0.15 * math.sin(2 * i) * math.cos(1.7 * j)))
    top = occ.addBSplineSurface(points, 5)
    return [t for d, t in occ.extrude([(2, top)], 0, 0, -1) if d == 3][0]


@part
def spline_top():
    under_spline()


@part
def spline_less_cylinder():
    cut(under_spline(), occ.addCylinder(0.5, 0.5, -1, 0.2, 0, 4, 0.2))


@part
def scaled_ellipsoid():
    s = occ.addSphere(0, 0, 0, 1)
    occ.dilate([(3, s)], 0, 0, 0, 1, 0.6, 0.4)


@part
def scaled_evenly():
    b = fuse(box(), occ.addCylinder(0.5, 0.5, 0, 0, 0, 2, 0.3))
    occ.dilate(b, 1, 0, 0, 25, 25, 25)


@part
def mirrored():
    b = fuse(box(), occ.addCylinder(0.5, 0.3, 0, 0, 0, 2, 0.2))
    occ.mirror(b, 1, 0.3, 0, 0.2)


@part
def rotated_copies():
    b = cut(box(), occ.addCylinder(0.5, 0.5, -1, 0, 0, 3, 0.25))
    for k in range(1, 3):
        c = occ.copy(b)
        occ.translate(c, 2 * k, 0, 0)
        occ.rotate(c, 2 * k, 0, 0, 0, 0, 1, 0.5 * k)


@part
def fragments():
    occ.fragment([(3, box())], [(3, occ.addSphere(1, 0.5, 0.5, 0.4)), (3, occ.addCylinder(0.5, 0.5, -0.5, 0, 0, 2, 0.2))])


@part
def stacked():
    occ.fragment([(3, box())], [(3, box(z=1)), (3, box(x=1, a=0.5, c=2))])


@part
def inclusion():
    occ.fragment([(3, box())], [(3, occ.addTorus(0.5, 0.5, 0.5, 0.3, 0.1))])


@part
def flange():
    out = fuse(occ.addCylinder(0, 0, 0, 0, 0, 0.3, 2), occ.addCylinder(0, 0, 0, 0, 0, 2, 0.8))
    holes = [occ.addCylinder(1.4 * math.cos(a), 1.4 * math.sin(a), -1, 0, 0, 4, 0.2)
             for a in [math.pi * k / 3 for k in range(6)]]
    cut(out[0][1], occ.addCylinder(0, 0, -1, 0, 0, 4, 0.5), *holes)


@part
def thin_plate(): cut(box(a=10, b=10, c=0.1), occ.addCylinder(5, 5, -1, 0, 0, 3, 2))


@part
def tangent_rounds():
    slot = fuse(box(a=2, b=1, c=0.5), occ.addCylinder(0, 0.5, 0, 0, 0, 0.5, 0.5), occ.addCylinder(2, 0.5, 0, 0, 0, 0.5, 0.5))
    return slot


@part
def capped_cylinder():
    fuse(occ.addCylinder(0, 0, 0, 0, 0, 2, 0.5), occ.addSphere(0, 0, 2, 0.5))


@part
def gear():
    points = []
    for k in range(12):
        for da, r in [(-0.18, 1), (-0.1, 1.25), (0.1, 1.25), (0.18, 1)]:
            a = 2 * math.pi * k / 12 + da
            points.append((r * math.cos(a), r * math.sin(a), 0))
    face = occ.addPlaneSurface([polygon(points)])
    solid = [t for d, t in occ.extrude([(2, face)], 0, 0, 0.4) if d == 3][0]
    cut(solid, occ.addCylinder(0, 0, -1, 0, 0, 3, 0.4))


@part
def twisted_loft():
    wires = []
    for k in range(4):
        a = 0.4 * k
        wires.append(polygon([(math.cos(a + b), math.sin(a + b), k * 0.7) for b in [0, math.pi / 2, math.pi, 1.5 * math.pi]]))
    occ.addThruSections(wires, makeSolid=True)


# OpenCASCADE integrates over these rational B-spline faces with an error of 10^-3.
DISK = math.pi * 0.2**2
EXACT = {"mirrored": {"volumes": [1 + DISK], "areas": [1.0] * 5 + [1 - DISK, DISK, 0.4 * math.pi]}}


def main():
    folder = sys.argv[1]
    os.makedirs(folder, exist_ok=True)
    gmsh.initialize()
    gmsh.option.setNumber("General.Verbosity", 1)
    measures = {}
    for name, make in parts.items():
        gmsh.clear()
        gmsh.model.add(name)
        try:
            make()
            occ.synchronize()
            # Surfaces and curves that were used to make the part are not wanted.
            for dimension in [2, 1, 0]:
                used = {e for s in gmsh.model.getEntities(3) for e in gmsh.model.getBoundary([s], recursive=False, oriented=False)}
                if dimension == 2:
                    loose = [e for e in gmsh.model.getEntities(2) if e not in used]
                    occ.remove(loose, recursive=True)
                    occ.synchronize()
            for dimension in [1, 0]:
                loose = [e for e in gmsh.model.getEntities(dimension) if not len(gmsh.model.getAdjacencies(*e)[0])]
                occ.remove(loose, recursive=True)
                occ.synchronize()
            solids = gmsh.model.getEntities(3)
            if not solids:
                raise RuntimeError("no solid")
            gmsh.write(f"{folder}/{name}.brep")
            gmsh.write(f"{folder}/{name}.step")
        except Exception as error:
            print(f"{name}: not made: {error}", file=sys.stderr)
            continue
        measures[name] = EXACT.get(name) or {
            "volumes": [occ.getMass(*s) for s in solids],
            "areas": [occ.getMass(*f) for f in gmsh.model.getEntities(2)],
        }
    with open(f"{folder}/measures.json", "w") as file:
        json.dump(measures, file, indent=1)
    gmsh.finalize()


if __name__ == "__main__":
    main()
