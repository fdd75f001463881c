#!/usr/bin/env python3
"""Gmsh's HXT and TetGen on the surfaces of benches/volume.rs, with the same columns.

  pip install gmsh tetgen numpy      # in a separate environment; both programs are GPL or AGPL and only run here
  peers.py FOLDER [SURFACE...]       # FOLDER has the PLY files; each case runs in its own process

Times are of meshing and optimisation without reading. NumPy measures the angles afterwards.
"""
import os, pathlib, resource, subprocess, sys, time

SURFACES = ["cube_100k", "shaft_100k", "torus_100k", "cube_1M", "shaft_1M", "torus_1M"]
PROGRAMS = ["hxt", "hxt-2", "tetgen"]


def read_ply(path):
    import numpy as np
    data = path.read_bytes()
    body = data.index(b"end_header\n") + 11
    count = {l.split()[1]: int(l.split()[2]) for l in data[:body].decode().splitlines() if l.startswith("element")}
    points = np.frombuffer(data, "<f8", 3 * count["vertex"], body).reshape(-1, 3)
    faces = np.frombuffer(data, [("n", "u1"), ("v", "<i4", 3)], count["face"], body + points.nbytes)["v"]
    return points, faces


def hxt(points, faces, threads):
    import gmsh, numpy as np
    gmsh.initialize(interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setNumber("Mesh.Algorithm3D", 10)
    for option in ["General.NumThreads", "Mesh.MaxNumThreads3D"]:
        gmsh.option.setNumber(option, threads)
    gmsh.model.addDiscreteEntity(2, 1)
    gmsh.model.mesh.addNodes(2, 1, np.arange(1, len(points) + 1), points.ravel())
    gmsh.model.mesh.addElementsByType(1, 2, [], faces.ravel().astype("u8") + 1)
    gmsh.model.geo.addSurfaceLoop([1], 1)
    gmsh.model.geo.addVolume([1], 1)
    gmsh.model.geo.synchronize()
    began = time.perf_counter(), time.process_time()
    gmsh.model.mesh.generate(3)
    took = time.perf_counter() - began[0], time.process_time() - began[1]
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    place = np.zeros(int(tags.max()) + 1, int)
    place[tags] = np.arange(len(tags))
    tets = gmsh.model.mesh.getElementsByType(4)[1]
    return took, peak, coordinates.reshape(-1, 3), place[tets].reshape(-1, 4)


def tetgen(points, faces):
    import numpy as np, tetgen
    mesher = tetgen.TetGen(np.ascontiguousarray(points), np.ascontiguousarray(faces.astype("i4")))
    edges = np.linalg.norm(points[faces] - points[np.roll(faces, 1, axis=1)], axis=2)
    volume = edges.mean() ** 3 * 0.4  # near the tets that HXT makes
    began = time.perf_counter(), time.process_time()
    stdout = os.dup(1)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # it prints, whatever the switches say
    out = mesher.tetrahedralize(switches=f"pYq1.4a{volume:.12f}Q")
    took = time.perf_counter() - began[0], time.process_time() - began[1]
    os.dup2(stdout, 1)
    return took, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, out[0], out[1][:, :4]


def shapes(points, tets):
    """Smallest dihedral angle, its 1st percentile and median over tets, mean of the mean ratios."""
    import numpy as np
    p = points[tets]
    faces = [(1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1)]
    normals = [np.cross(p[:, b] - p[:, a], p[:, c] - p[:, a]) for a, b, c in faces]
    volume6 = np.einsum("ij,ij->i", normals[0], p[:, 1] - p[:, 0])
    normals = [n / np.linalg.norm(n, axis=1)[:, None] for n in normals]
    pairs = [(i, j) for i in range(4) for j in range(i)]
    largest = np.max([-np.einsum("ij,ij->i", normals[i], normals[j]) for i, j in pairs], axis=0)
    angles = np.degrees(np.arccos(np.clip(largest, -1, 1)))
    squares = sum(((p[:, i] - p[:, j]) ** 2).sum(1) for i, j in pairs)
    ratio = 12 * np.cbrt(0.5 * np.abs(volume6)) ** 2 / squares
    return angles.min(), np.percentile(angles, 1), np.median(angles), ratio.mean()


def run(folder, program, surface):
    points, faces = read_ply(folder / f"{surface}.ply")
    threads = 2 if program.endswith("-2") else 1
    (wall, cpu), peak, points, tets = tetgen(points, faces) if program == "tetgen" else hxt(points, faces, threads)
    least, first, median, ratio = shapes(points, tets)
    megabytes = peak * 1024 / 1e6
    print(f"{surface:10} {program:>7} {threads:>7} {len(tets):>9} {wall:>7.2f} {cpu:>7.2f} {len(tets) / wall:>9.0f} "
          f"{len(tets) / cpu:>9.0f}  {least:>7.2f} {first:>5.1f} {median:>6.1f} {ratio:>6.3f} {megabytes:>7.0f}", flush=True)


def main():
    folder, words = pathlib.Path(sys.argv[1]), sys.argv[2:]
    if words and words[0] == "one":
        return run(folder, *words[1:])
    print(f"{'surface':10} {'program':>7} {'threads':>7} {'tets':>9} {'s':>7} {'cpu s':>7} {'tets/s':>9} {'/cpu s':>9}  "
          f"{'min dih':>7} {'p1':>5} {'median':>6} {'ratio':>6} {'peak MB':>7}", flush=True)
    for surface in words or SURFACES:
        for program in PROGRAMS:
            subprocess.run([sys.executable, __file__, str(folder), "one", program, surface], timeout=600)


main()
