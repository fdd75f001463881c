#!/usr/bin/env python3
"""Ten million tets of a ball as numpy arrays: seconds and peak memory of tetmill, NETGEN and Gmsh in Python, side by side.

    pip install ./python netgen-mesher gmsh && python benches/arrays.py [RUNS]

Each makes a coarse mesh of about 20,000 tets and refines it three times; each run is a process of its own, the programs take turns.
The seconds are from the geometry to points and tets as arrays, without importing the package. NETGEN and Gmsh move
new vertices onto the sphere, too."""

import json
import resource
import subprocess
import sys
import time

LEVELS = 3


def tetmill():
    import tetmill

    yield
    ball = tetmill.Geometry.from_text("algebraic3d solid b = sphere (0, 0, 0; 1); tlo b;")
    mesh = ball.generate(maxh=0.12, levels=LEVELS)
    yield mesh.points, mesh.tets


def netgen():
    import numpy as np
    from netgen.csg import CSGeometry, Pnt, Sphere

    yield
    geometry = CSGeometry()
    geometry.Add(Sphere(Pnt(0, 0, 0), 1))
    mesh = geometry.GenerateMesh(maxh=0.085)
    for _ in range(LEVELS):
        mesh.Refine()
    tets = mesh.Elements3D().NumPy()["nodes"][:, :4]
    yield np.asarray(mesh.Coordinates()), tets


def gmsh():
    import gmsh

    yield
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setNumber("General.NumThreads", 2)
    gmsh.option.setNumber("Mesh.Algorithm3D", 10)
    gmsh.option.setNumber("Mesh.MeshSizeMax", 0.092)
    gmsh.model.occ.addSphere(0, 0, 0, 1)
    gmsh.model.occ.synchronize()
    gmsh.model.mesh.generate(3)
    for _ in range(LEVELS):
        gmsh.model.mesh.refine()
    points = gmsh.model.mesh.getNodes()[1].reshape(-1, 3)
    yield points, gmsh.model.mesh.getElementsByType(4)[1].reshape(-1, 4)


PROGRAMS = {"tetmill": tetmill, "netgen": netgen, "gmsh": gmsh}


def run(name):
    steps = PROGRAMS[name]()
    next(steps)
    start = time.perf_counter()
    points, tets = next(steps)
    seconds = time.perf_counter() - start
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    print(json.dumps({"tets": len(tets), "points": len(points), "seconds": seconds, "peak": peak}))


def main():
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 3
    found = {name: [] for name in PROGRAMS}
    for _ in range(runs):
        for name in PROGRAMS:
            command = [sys.executable, __file__, "--run", name]
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            if done.returncode != 0:
                print(f"{name} failed: {done.stderr.strip()[-300:]}", file=sys.stderr)
                continue
            found[name].append(json.loads(done.stdout.splitlines()[-1]))
            print(name, json.dumps(found[name][-1]), flush=True)
    print("\n| program | tets | seconds, least | million tets a second | peak memory, GB |\n|---|---|---|---|---|")
    for name, results in found.items():
        if results:
            best = min(results, key=lambda result: result["seconds"])
            rate = best["tets"] / best["seconds"] / 1e6
            print(f"| {name} | {best['tets']:,} | {best['seconds']:.1f} | {rate:.2f} | {best['peak'] / 1e9:.2f} |")


if __name__ == "__main__":
    if sys.argv[1:2] == ["--run"]:
        run(sys.argv[2])
    else:
        main()
