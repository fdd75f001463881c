#!/usr/bin/env python3
"""Ten-node tets of tetmill, NETGEN and Gmsh on the same geometries, judged by the same test.

  second_order.py --binary target/release/tetmill FOLDER_OF_GEO_FILES

tetmill and NETGEN mesh the .geo files at the same presets; NETGEN's mesh becomes one of second order by
SecondOrder(). Gmsh meshes a ball, a torus and a plate with holes of OpenCASCADE, with each of its
optimisers of curved elements. `tetmill quality` counts the tets that are not valid: whose Jacobian
determinant is not proved positive. Needs netgen-mesher and gmsh; runs one program after the other.
"""
import argparse, json, pathlib, subprocess, tempfile, time

PRESETS = ["very_coarse", "moderate"]


def quality(binary, path):
    read = subprocess.run([binary, "quality", "--json", path], capture_output=True, text=True)
    if not read.stdout:
        return {"tets": 0, "not_valid": None, "scaled_jacobian": None, "refused": read.stderr.strip()}
    return json.loads(read.stdout)["meshes"][0]


def row(name, preset, program, seconds, q):
    worst = "" if q.get("scaled_jacobian") is None else f"{q['scaled_jacobian']:.3f}"
    count = q.get("refused", q.get("not_valid"))
    print(f"| {name} | {preset} | {program} | {q['tets']} | {count} | {worst} | {seconds:.2f} |", flush=True)


def tetmill(binary, geo, preset, folder):
    path, start = folder / "t.vtu", time.time()
    command = [binary, "mesh", geo, "--order", "2", "--preset", preset.replace("_", "-"), "-o", path, "-q"]
    made = subprocess.run(command, capture_output=True, text=True)
    seconds = time.time() - start
    q = quality(binary, path) if made.returncode == 0 else {"tets": 0, "refused": f"status {made.returncode}"}
    row(geo.stem, preset, "tetmill", seconds, q)


def netgen(binary, geo, preset, folder):
    # In a process of its own: NETGEN may end it, or not end.
    path, start = folder / "n.vol", time.time()
    program = (
        "import sys; from netgen.csg import CSGeometry; from netgen.meshing import meshsize\n"
        "mesh = CSGeometry(sys.argv[1]).GenerateMesh(getattr(meshsize, sys.argv[2]))\n"
        "mesh.SecondOrder(); mesh.Save(sys.argv[3])\n"
    )
    try:
        made = subprocess.run(["python3", "-c", program, geo, preset, path], capture_output=True, timeout=300)
        state = made.returncode
    except subprocess.TimeoutExpired:
        state = "no end"
    seconds = time.time() - start
    q = quality(binary, path) if state == 0 else {"tets": 0, "refused": f"status {state}"}
    row(geo.stem, preset, "NETGEN", seconds, q)


def gmsh(binary, name, optimiser, folder):
    path, start = folder / "g.msh", time.time()
    program = f"""
import gmsh
gmsh.initialize(); gmsh.option.setNumber("General.Terminal", 0)
occ = gmsh.model.occ
if {name!r} == "ball": occ.addSphere(0, 0, 0, 1)
if {name!r} == "torus": occ.addTorus(0, 0, 0, 2, 0.7)
if {name!r} == "plate":
    holes = [(3, occ.addCylinder(x, y, -1, 0, 0, 2, 0.45)) for x in range(1, 5) for y in range(1, 5)]
    occ.cut([(3, occ.addBox(0, 0, 0, 5, 5, 0.3))], holes)
occ.synchronize()
gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", 8); gmsh.option.setNumber("Mesh.ElementOrder", 2)
gmsh.option.setNumber("Mesh.HighOrderOptimize", {optimiser}); gmsh.option.setNumber("Mesh.MshFileVersion", 2.2)
gmsh.model.mesh.generate(3); gmsh.write({str(path)!r})
"""
    made = subprocess.run(["python3", "-c", program], capture_output=True, timeout=300)
    seconds = time.time() - start
    q = quality(binary, path) if made.returncode == 0 else {"tets": 0, "refused": f"status {made.returncode}"}
    row(name, "8 elements a circle", f"Gmsh, HighOrderOptimize {optimiser}", seconds, q)


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--binary", required=True)
    arguments.add_argument("folder", type=pathlib.Path)
    given = arguments.parse_args()
    binary = str(pathlib.Path(given.binary).resolve())
    print("| geometry | preset | program | tets | not valid | scaled Jacobian at worst | s |\n|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for geo in sorted(given.folder.glob("*.geo")):
            for preset in PRESETS:
                tetmill(binary, geo, preset, folder)
                netgen(binary, geo, preset, folder)
        for name in ["ball", "torus", "plate"]:
            for optimiser in [0, 1, 2, 4]:
                gmsh(binary, name, optimiser, folder)


if __name__ == "__main__":
    main()
