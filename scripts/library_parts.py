#!/usr/bin/env python3
"""Makes STEP files of parts of a CAD library: screws, nuts, bearings, gears, flanges and others, with and without threads.

    python3 scripts/library_parts.py FOLDER

Needs the Python packages build123d and bd_warehouse (measured with 0.13 and 0.4). Of each kind of fastener it takes the first type and a size in
the middle. Threads are solids that overlap the body of their screw. A part that the library cannot make is told and left out.
"""

import inspect
import os
import sys

import build123d as b3
from bd_warehouse import bearing, bushing, fastener, flange, gear, open_builds, retaining_ring, sprocket, thread

folder = sys.argv[1]
os.makedirs(folder, exist_ok=True)


def save(name, make):
    try:
        b3.export_step(make(), os.path.join(folder, name.replace("/", "_").replace(" ", "_") + ".step"))
    except Exception as error:
        print(f"{name}: {error!r}"[:200], flush=True)


def kinds(module, base):
    classes = (kind for _, kind in inspect.getmembers(module, inspect.isclass))
    return [kind for kind in classes if issubclass(kind, base) and kind is not base]


def usual(kind):
    """The first type of a kind of part, and a size in the middle."""
    first = sorted(kind.types())[0]
    sizes = sorted(kind.sizes(first))
    return first, sizes[len(sizes) // 2]


for kind in kinds(fastener, fastener.Screw):
    of, size = usual(kind)
    length = 3 * float(size.split("-")[0].lstrip("M")) if size.startswith("M") else 12
    for simple, name in ((True, "simple"), (False, "thread")):
        make = lambda: kind(size=size, length=length, fastener_type=of, simple=simple)
        save(f"{kind.__name__}_{size}_{name}", make)
for kind in kinds(fastener, fastener.Nut):
    of, size = usual(kind)
    for simple, name in ((True, "simple"), (False, "thread")):
        save(f"{kind.__name__}_{size}_{name}", lambda: kind(size=size, fastener_type=of, simple=simple))
for kind in kinds(fastener, fastener.Washer):
    of, size = usual(kind)
    save(kind.__name__, lambda: kind(size=size, fastener_type=of))
for kind in kinds(bearing, bearing.Bearing):
    of, size = usual(kind)
    save(kind.__name__, lambda: kind(size=size, bearing_type=of))

save("spur20", lambda: gear.SpurGear(module=2, tooth_count=20, pressure_angle=20, root_fillet=0.5, thickness=8))
save("spur12", lambda: gear.SpurGear(module=1, tooth_count=12, pressure_angle=14.5, thickness=5))
save("helical", lambda: gear.HelicalGear(module=2, tooth_count=18, pressure_angle=20, helix_angle=20, thickness=10))
save("rack", lambda: gear.RackGear(module=2, tooth_count=10, pressure_angle=20, thickness=8))
threads = [
    ("IsoThread_10", thread.IsoThread,
     dict(major_diameter=10, pitch=1.5, length=20, external=True, end_finishes=("square", "fade"))),
    ("IsoThread_6", thread.IsoThread,
     dict(major_diameter=6, pitch=1, length=8, external=False, end_finishes=("fade", "fade"))),
    ("AcmeThread_1_2", thread.AcmeThread, dict(size="1/2", length=25, external=True)),
    ("MetricTrapezoidalThread_8x1.5", thread.MetricTrapezoidalThread, dict(size="8x1.5", length=20, external=True)),
    ("PlasticBottleThread_M38SP444", thread.PlasticBottleThread, dict(size="M38SP444", external=True)),
]
for name, kind, how in threads:
    save(name, lambda: kind(**how))
for name in ("BlindFlange", "SlipOnFlange", "SocketWeldFlange", "WeldNeckFlange"):
    for how in (dict(nps="2", flange_class=300, face_type="Raised"), dict(nps="4", flange_class=150, face_type="Ring")):
        save(f"{name}_{how['nps']}_{how['face_type']}", lambda: getattr(flange, name)(**how))
save("sprocket32", lambda: sprocket.Sprocket(
    num_teeth=32, bolt_circle_diameter=80, num_mount_bolts=4, mount_bolt_diameter=8, bore_diameter=60))
for name in (
    "AcmeAntiBacklashNutBlock8mm", "AcmeAntiBacklashNutBlock8mmAssembly", "CBeamEndAssembly", "CBeamEndMount", "CBeamGantryPlate",
    "CBeamGantryPlateXLarge", "CBeamLinearRailProfile", "CBeamRiserPlate", "EccentricSpacer", "LBracket", "RouterSpindleMount",
    "SpacerBlock", "TNut", "VSlotLinearRailProfile", "XLargeCBeamGantry", "XtremeSolidVWheel", "_VSlotGroove", "_VSlotInternalCavity",
):  # fmt: skip
    save(f"ob_{name}", lambda: getattr(open_builds, name)())
save("vslot20x40", lambda: open_builds.VSlotLinearRail("20x40", 120))
save("leadscrew", lambda: open_builds.MetricLeadScrew(length=40))
save("eccbush", lambda: bushing.HexFlangedEccentricBushing(5, 7.1, 8, 2, 10, 0.79))
for size in sorted(retaining_ring.ExternalSnapRing.sizes())[:3]:
    save(f"ext_{size}", lambda: retaining_ring.ExternalSnapRing(size))


def cap():
    """Not valid: its offset fails."""
    with b3.BuildPart() as made:
        b3.Box(30, 20, 10)
        b3.fillet(made.edges().filter_by(b3.Axis.Z), 4)
        b3.fillet(made.faces().sort_by(b3.Axis.Z)[-1].edges(), 2)
        b3.offset(amount=-1.5, openings=made.faces().sort_by(b3.Axis.Z)[0])
    return made.part


def loft():
    with b3.BuildPart() as made:
        with b3.BuildSketch():
            b3.Rectangle(20, 20)
        with b3.BuildSketch(b3.Plane.XY.offset(15)):
            b3.Circle(6)
        b3.loft()
        b3.fillet(made.faces().sort_by(b3.Axis.Z)[-1].edges(), 1)
    return made.part


def spring():
    path = b3.Helix(4, 20, 8)
    return b3.sweep(b3.Plane(path @ 0, z_dir=path % 0) * b3.Circle(1.2), path)


def text():
    with b3.BuildPart() as made:
        b3.Box(60, 20, 3)
        with b3.BuildSketch(made.faces().sort_by(b3.Axis.Z)[-1]):
            b3.Text("tetmill", 12)
        b3.extrude(amount=-1, mode=b3.Mode.SUBTRACT)
    return made.part


def textraised():
    with b3.BuildPart() as made:
        b3.Cylinder(20, 4)
        with b3.BuildSketch(made.faces().sort_by(b3.Axis.Z)[-1]):
            b3.Text("R&8", 14)
        b3.extrude(amount=1)
    return made.part


def sphereholes():
    with b3.BuildPart() as made:
        b3.Sphere(10)
        with b3.GridLocations(5, 5, 5, 5):
            b3.Cylinder(1.2, 30, mode=b3.Mode.SUBTRACT)
    return made.part


for make in (cap, loft, spring, text, textraised, sphereholes):
    save(make.__name__, make)
