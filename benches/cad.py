#!/usr/bin/env python3
"""tetmill, NETGEN and Gmsh on CAD parts, each with its usual sizes, in one run.

  python3 scripts/brep_corpus.py FOLDER       # makes parts, and their volumes by OpenCASCADE
  python3 benches/cad.py FOLDER [--binary target/release/tetmill] [--format step] [--only NAME...]

Needs the Python packages numpy, gmsh and netgen-mesher (GPL and LGPL: they only run here). Each mesh is made in a process of
its own, with at most --limit seconds. Sizes: tetmill and NETGEN at `moderate`; Gmsh with 12 elements a turn (Mesh.MeshSizeFromCurvature) and
HXT. Seconds are of reading and meshing: those of tetmill's whole process, of the others without the start of Python and their libraries. Angles are
measured by NumPy. The error of the volume is relative to OpenCASCADE's, if `measures.json` has it.

With --imprint, as for the solids that scripts/touching_solids.py makes, Gmsh imprints solids that touch by OpenCASCADE's fragments, and
NETGEN by its Glue; tetmill does so by itself. With --overlap-to, as for those of scripts/overlapping_solids.py, tetmill gives what solids have
in common to one of them; fragments and glue make a solid of its own of it.
"""
import argparse, json, os, pathlib, signal, subprocess, sys, tempfile, time

import numpy as np

HERE = pathlib.Path(__file__).resolve()


def shapes(points, tets):
    """Smallest dihedral angle, its 1st percentile over tets, and the volume."""
    p = points[tets]
    faces = [(1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1)]
    normals = [np.cross(p[:, b] - p[:, a], p[:, c] - p[:, a]) for a, b, c in faces]
    volume6 = np.einsum("ij,ij->i", normals[0], p[:, 1] - p[:, 0])
    normals = [n / np.maximum(np.linalg.norm(n, axis=1), 1e-300)[:, None] for n in normals]
    pairs = [(i, j) for i in range(4) for j in range(i)]
    largest = np.max([-np.einsum("ij,ij->i", normals[i], normals[j]) for i, j in pairs], axis=0)
    angles = np.degrees(np.arccos(np.clip(largest, -1, 1)))
    return [len(tets), float(angles.min()), float(np.percentile(angles, 1)), float(np.abs(volume6).sum() / 6)]


def netgen(path, imprints):
    from netgen.meshing import MeshingParameters, meshsize
    from netgen.occ import Glue, OCCGeometry
    start = time.perf_counter()
    geometry = OCCGeometry(str(path))
    if imprints:
        geometry = OCCGeometry(Glue(list(geometry.shape.solids)))
    mesh = geometry.GenerateMesh(mp=MeshingParameters(meshsize.moderate))
    seconds = time.perf_counter() - start
    tets = np.array([[v.nr - 1 for v in element.vertices] for element in mesh.Elements3D()]).reshape(-1, 4)
    return [seconds, *shapes(np.array(mesh.Coordinates()), tets)]


def gmsh(path, imprints):
    import gmsh
    gmsh.initialize(interruptible=False)
    for option, value in [
        ("General.Terminal", 0), ("General.NumThreads", 2), ("Mesh.Algorithm3D", 10), ("Mesh.MeshSizeFromCurvature", 12),
    ]:
        gmsh.option.setNumber(option, value)
    start = time.perf_counter()
    gmsh.model.occ.importShapes(str(path))
    if imprints:
        gmsh.model.occ.fragment(gmsh.model.occ.getEntities(3), [])
    gmsh.model.occ.synchronize()
    gmsh.model.mesh.generate(3)
    seconds = time.perf_counter() - start
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    place = np.zeros(int(tags.max()) + 1, int)
    place[tags] = np.arange(len(tags))
    return [seconds, *shapes(coordinates.reshape(-1, 3), place[gmsh.model.mesh.getElementsByType(4)[1]].reshape(-1, 4))]


def tetmill(path, binary, overlap_to):
    with tempfile.TemporaryDirectory() as folder:
        # The others convert lengths to millimetres.
        unit = [] if path.endswith(".brep") else ["--unit", "mm"]
        overlap = ["--overlap-to", overlap_to] if overlap_to else []
        output = ["-n", "1", "--levels", "0", "-f", "medit", "-o", folder, "-q"]
        command = [binary, "generate", path, *unit, *overlap, *output]
        start = time.perf_counter()
        done = subprocess.run(command, capture_output=True, text=True)
        seconds = time.perf_counter() - start
        out = list(pathlib.Path(folder).glob("*.mesh"))
        if not out:
            raise SystemExit(f"status {done.returncode}: {(done.stderr.strip().splitlines() or [''])[-1]}")
        blocks = out[0].read_text().split()
        return [seconds, *shapes(medit(blocks, "Vertices", 4)[:, :3], medit(blocks, "Tetrahedra", 5)[:, :4].astype(int) - 1)]


def medit(words, name, columns):
    first = words.index(name) + 2
    return np.array(words[first : first + int(words[first - 1]) * columns], float).reshape(-1, columns)


def one(program, path, options):
    """The result of a program in a process of its own, or why there is none."""
    try:
        given = ["--imprint"] if options.imprint else []
        given += ["--overlap-to", options.overlap_to] if options.overlap_to else []
        command = [sys.executable, HERE, *given, "--worker", program, path, "--binary", options.binary]
        # With a session of its own, so that programs that it started end with it.
        pipe = subprocess.PIPE
        worker = subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True, start_new_session=True)
        stdout, stderr = worker.communicate(timeout=options.limit)
        last = (stdout.strip().splitlines() or [""])[-1]
        if worker.returncode == 0 and last.startswith("["):
            return json.loads(last), ""
        why = (stderr.strip().splitlines() or [f"status {worker.returncode}"])[-1]
        return None, why[:150]
    except subprocess.TimeoutExpired:
        os.killpg(worker.pid, signal.SIGKILL)
        worker.communicate()
        return None, f"more than {options.limit:g} s"


def cell(result, volume):
    if result is None:
        return "– | – | – | – | –"
    seconds, tets, least, percentile, found = result
    error = f"{abs(found / volume - 1):.1e}" if volume else "–"
    return f"{seconds:.2f} | {tets} | {least:.1f} | {percentile:.1f} | {error}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--binary", default="target/release/tetmill")
    parser.add_argument("--format", choices=["brep", "step"], default="brep")
    parser.add_argument("--only", nargs="*")
    parser.add_argument("--limit", type=float, default=120, help="seconds for each mesh")
    parser.add_argument("--imprint", action="store_true", help="imprint solids that touch on each other")
    parser.add_argument("--overlap-to", choices=["first", "last", "smaller"], help="cut solids that overlap")
    parser.add_argument("--worker", help=argparse.SUPPRESS)
    if "--worker" in sys.argv:
        at = sys.argv.index("--worker")
        program, path, binary = sys.argv[at + 1], sys.argv[at + 2], sys.argv[-1]
        imprints = "--imprint" in sys.argv
        overlap_to = sys.argv[sys.argv.index("--overlap-to") + 1] if "--overlap-to" in sys.argv else None
        made = {
            "tetmill": lambda: tetmill(path, binary, overlap_to),
            "netgen": lambda: netgen(path, imprints),
            "gmsh": lambda: gmsh(path, imprints),
        }
        print("\n" + json.dumps(made[program]()), flush=True)
        return
    options = parser.parse_args()
    measures = options.folder / "measures.json"
    measures = json.loads(measures.read_text()) if measures.exists() else {}
    programs = ["tetmill", "netgen", "gmsh"]
    columns = "s | tets | smallest | 1st % | volume"
    print(f"| part | {' | '.join(f'{p}: {columns}' for p in programs)} |\n|{'---|' * (1 + 5 * len(programs))}")
    all_of, failures = {p: [] for p in programs}, []
    for path in sorted(options.folder.glob(f"*.{options.format}")):
        if options.only and path.stem not in options.only:
            continue
        volume = sum(measures.get(path.stem, {}).get("volumes", []))
        cells = []
        for program in programs:
            result, why = one(program, path, options)
            if result is not None and result[1] == 0:
                result, why = None, "no tets"
            cells.append(cell(result, volume))
            all_of[program].append(result)
            if result is None:
                failures.append(f"{path.stem}, {program}: {why}")
        print(f"| {path.stem} | {' | '.join(cells)} |", flush=True)
    both = [i for i in range(len(all_of["tetmill"])) if all(all_of[p][i] for p in programs)]
    for program in programs:
        rows = all_of[program]
        made = sum(result is not None for result in rows)
        seconds = sum(rows[i][0] for i in both)
        best = sum(rows[i][2] >= max(all_of[p][i][2] for p in programs) for i in both)
        print(f"{program}: {made} of {len(rows)} meshed; {seconds:.1f} s for the {len(both)} that all mesh; largest smallest angle in {best}")
    print("\n".join(failures))


main()
