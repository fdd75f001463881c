#!/usr/bin/env python3
"""NETGEN's tutorial geometries at all presets, compared with NETGEN's meshes: a table in Markdown.

  tutorials.py target/release/tetmill ../shared/netgen-tutorials [--spec ../shared/spec/netgen-meshing.md] [--only NAME,NAME]
  tutorials.py … --netgen ENVIRONMENT/bin/python --presets moderate        # pip install netgen-mesher in a separate environment

The folder has the .geo files and reference.json (NETGEN's counts, angles and seconds, measured on another day on a similar machine); the
specification's section 11 has NETGEN's total badness at three presets. Each geometry is meshed by one thread, from the file to the
checked mesh in a file, for at most 600 seconds. Manyholes and shell are omitted at the two finest presets.
With --netgen, NETGEN's seconds are measured in the same run, from the file to the mesh, without start and output.
"""
import argparse, json, pathlib, re, subprocess, tempfile, time

PRESETS = ["very-coarse", "coarse", "moderate", "fine", "very-fine"]
LARGE = {"manyholes", "shell"}
COLUMNS = ["tets", "smallest dihedral", "1st percentile", "mean badness", "seconds"]


def badness_of_netgen(spec):
    """{(geometry, preset): mean badness} from the rows `| name | default | very_coarse | moderate | very_fine |`."""
    rows = re.findall(r"^\| (\w+) \|(.+)\|$", spec.read_text(), re.M) if spec else []
    found = {}
    for name, cells in rows:
        for preset, cell in zip([None, "very-coarse", "moderate", "very-fine"], cells.split("|")):
            numbers = re.fullmatch(r"\s*\d+/\d+/(\d+)/(\d+)\s*", cell)
            if preset and numbers:
                found[name, preset] = int(numbers[2]) / int(numbers[1])
    return found


def measure(binary, geometry, preset, folder):
    """The five columns of tetmill, or the first line of the error."""
    mesh = folder / "mesh.vol"
    began = time.perf_counter()
    try:
        made = subprocess.run([binary, "mesh", geometry, "-o", mesh, "--preset", preset, "-t", "1", "-q"],
                              capture_output=True, text=True, timeout=600)
    except subprocess.TimeoutExpired:
        return "no end after 600 s"
    seconds = time.perf_counter() - began
    if made.returncode:
        return made.stderr.splitlines()[0]
    output = subprocess.run([binary, "quality", "--json", mesh], capture_output=True, text=True, check=True).stdout
    quality = json.loads(output)["meshes"][0]
    assert quality["inverted"] == 0, geometry
    keys = ["tets", "smallest_dihedral", "first_percentile_dihedral", "mean_badness"]
    return [quality[key] for key in keys] + [seconds]


NETGEN = """
import sys, time
from netgen.csg import CSGeometry
from netgen.meshing import meshsize
began = time.perf_counter()
mesh = CSGeometry(sys.argv[1]).GenerateMesh(getattr(meshsize, sys.argv[2]))
print("seconds", time.perf_counter() - began)
"""


def seconds_of_netgen(python, geometry, preset):
    """None if it fails or exceeds the time limit."""
    try:
        made = subprocess.run([python, "-c", NETGEN, geometry, preset.replace("-", "_")],
                              capture_output=True, text=True, timeout=600)
    except subprocess.TimeoutExpired:
        return None
    found = re.search(r"seconds (\S+)$", made.stdout, re.M)
    return float(found[1]) if found else None


def shown(values):
    """The five columns as text."""
    digits = [0, 1, 1, 2, 2]
    return ["" if v is None else f"{v:.{d}f}" for v, d in zip(values, digits)]


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("binary")
    options.add_argument("tutorials", type=pathlib.Path)
    options.add_argument("--spec", type=pathlib.Path)
    options.add_argument("--only", default="")
    options.add_argument("--presets", default=",".join(PRESETS))
    options.add_argument("--netgen", help="a Python with NETGEN")
    given = options.parse_args()
    reference = json.loads((given.tutorials / "reference.json").read_text())
    badness = badness_of_netgen(given.spec)
    only = set(filter(None, given.only.split(",")))
    print("| geometry | preset | " + " | ".join(f"{column} | NETGEN" for column in COLUMNS) + " |")
    print("|---|---|" + "--:|" * (2 * len(COLUMNS)))
    ours, theirs = dict.fromkeys(PRESETS, 0.0), dict.fromkeys(PRESETS, 0.0)
    with tempfile.TemporaryDirectory() as folder:
        for geometry in sorted(given.tutorials.glob("*.geo")):
            name = geometry.stem
            if only and name not in only:
                continue
            for preset in given.presets.split(","):
                if name in LARGE and preset in PRESETS[3:]:
                    continue
                found = measure(given.binary, geometry, preset, pathlib.Path(folder))
                if isinstance(found, str):
                    print(f"| {name} | {preset} | {found} |", flush=True)
                    continue
                netgen = reference.get(name, {}).get(preset.replace("-", "_"), {})
                other = [netgen.get(key) for key in ["tets", "min_dihedral", "p1_min_dihedral"]]
                seconds = netgen.get("seconds")
                if given.netgen:
                    seconds = seconds_of_netgen(given.netgen, geometry, preset)
                other += [badness.get((name, preset)), seconds]
                if other[-1] is not None:
                    ours[preset] += found[-1]
                    theirs[preset] += other[-1]
                cells = [cell for pair in zip(shown(found), shown(other)) for cell in pair]
                print(f"| {name} | {preset} | " + " | ".join(cells) + " |", flush=True)
    print("\nTotal seconds where both have a time: " +
          "; ".join(f"{preset} {ours[preset]:.1f}, NETGEN {theirs[preset]:.1f}" for preset in given.presets.split(",")) + ".")


if __name__ == "__main__":
    main()
