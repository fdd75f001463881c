#!/usr/bin/env python3
"""Checksums of meshes of the repository's geometries by all three methods, to verify that a change of the code changes no mesh.

  checksums.py target/release/tetmill                     # a table in Markdown
  checksums.py target/release/tetmill --base OLD/tetmill  # the same, and exit status 1 if any checksum differs from that of OLD

Each mesh is made on 4 ranks at preset `coarse`, with one level of refinement where the method refines.
"""
import argparse, json, pathlib, subprocess, sys, tempfile

GEOMETRIES = ("bearing bracket capsule crankshaft dome equal_pipes fibres flange gear half_egg heat_sink hydraulic_block "
              "layers lens linked_rings needle_valve pipe_bend tee twisted_bar valve_body").split()
METHODS = {"refine": ["-m", "refine", "--levels", "1"], "surface": ["-m", "surface", "--levels", "1"], "decompose": ["-m", "decompose", "--levels", "1"]}
FOLDER = pathlib.Path(__file__).parent.parent / "geometries"


def made(binary, geometry, options):
    """Tets and checksum, or the reason for a missing mesh."""
    with tempfile.TemporaryDirectory() as folder:
        report = pathlib.Path(folder) / "report.json"
        run = subprocess.run([binary, "generate", FOLDER / f"{geometry}.geo", "-n", "4", "-f", "none", "-q", "--preset", "coarse",
                              "--report", report, *options], capture_output=True, text=True)
        if run.returncode != 0:
            return 0, f"status {run.returncode}"
        mesh = json.loads(report.read_text())["mesh"]
        return mesh["tets"], mesh["checksum"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("binary")
    parser.add_argument("--base", help="another binary, whose checksums must be equal")
    arguments = parser.parse_args()
    differences = 0
    print("| geometry | method | tets | checksum |\n|---|---|---|---|")
    for geometry in GEOMETRIES:
        for method, options in METHODS.items():
            tets, checksum = made(arguments.binary, geometry, options)
            print(f"| {geometry} | {method} | {tets} | {checksum} |", flush=True)
            if arguments.base and made(arguments.base, geometry, options) != (tets, checksum):
                differences += 1
                print(f"{geometry}, {method}: differs from {arguments.base}", file=sys.stderr)
    if arguments.base:
        print(f"\n{differences} of {len(GEOMETRIES) * len(METHODS)} differ from the base.")
    sys.exit(differences > 0)


main()
