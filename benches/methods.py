#!/usr/bin/env python3
"""Methods 1 and 3 on many geometries and numbers of ranks, compared with one rank; or all three methods. A table in Markdown.

  methods.py target/release/tetmill ../shared/netgen-tutorials            each geometry with each method on 2 … 64 ranks
  methods.py target/release/tetmill ../shared/netgen-tutorials --table    table 6.1 of the thesis: cube, torus, sphere; 16, 32, 64 ranks
    --ranks 2,4 --methods surface --only cube,tee      a selection
    --judge ../shared/tools/check_partition.py         writes Elmer parts and runs another checker on them
    --mpi 4                                            the same ranks under mpirun (a binary with the feature mpi); checksums must agree

Sizes are those of the preset `coarse` (where that is less than 640 tets, `--coarse 640`) with enough subdivisions of an edge for about 64,000 tets or more on one rank. Ranks are in-process.
"Pieces" counts the components of all parts connected by faces: the number of ranks if each part is connected. "Volume" is the relative
difference from the mesh on one rank, "over serial" the ratio of the numbers of tets. A row ends with its faults: an angle below 10° if one rank has more,
a 1st percentile more than 2° below that of one rank, more than 30 % more or fewer tets, or an invalid mesh.
"""
import argparse, json, math, os, pathlib, subprocess, sys, tempfile

TUTORIALS = ["shaft", "torus", "sphere", "cube", "sculpture", "matrix", "trafo"]
OWN = ["nozzle", "fibres", "tee", "boss_fillet", "ice_cream", "gear", "probe_tank", "layers", "vase", "dome"]
RANKS = [2, 4, 8, 16, 32, 64]
STAGES = ["mesh", "cut", "surface", "distribute", "fill", "number", "interfaces", "even out", "check"]


def run(binary, arguments, folder, mpi=None):
    """The report of a run, or the first line of its message."""
    report = folder / "report.json"
    report.unlink(missing_ok=True)
    start = ["mpirun", "-n", str(mpi)] if mpi else []
    made = subprocess.run([*start, binary, "generate", *map(str, arguments), "-q", "--report", report],
                          capture_output=True, text=True)
    if made.returncode:
        return next(iter(made.stderr.splitlines()), f"status {made.returncode}")
    return json.loads(report.read_text())


def sizes(binary, geometry, folder, tets):
    """Arguments for about this number of tets on one rank, with a coarse mesh large enough for 64 parts."""
    for given in ["--preset", "coarse"], ["--coarse", 640]:
        coarse = run(binary, [geometry, *given, "-f", "none"], folder)["mesh"]["tets"]
        if coarse >= 640:
            break
    return [*given, "--pieces", max(1, math.ceil((tets / coarse) ** (1 / 3)))]


def faults(mesh, serial):
    """Faults of a mesh compared with that of one rank."""
    angle, p1 = "smallest_dihedral", "first_percentile_dihedral"
    if mesh[angle] < min(10, serial[angle]):
        yield f"angle {mesh[angle]:.1f}"
    if mesh[p1] < serial[p1] - 2:
        yield f"p1 {mesh[p1] - serial[p1]:.1f}"
    if not 0.7 < mesh["tets"] / serial["tets"] < 1.3:
        yield f"tets {mesh['tets'] / serial['tets']:.2f}"


def judged(given, folder, ranks):
    """Faults that the other checker finds in a written mesh."""
    parts = folder / "out" / f"partitioning.{ranks}"
    result = subprocess.run([sys.executable, given.judge, parts], capture_output=True, text=True)
    return [] if result.returncode == 0 else ["check_partition.py: " + result.stdout.splitlines()[-1]]


def matrix(given, geometries, folder):
    """Each geometry on one rank, and with each method on many."""
    print("| geometry | method | ranks | tets | over serial | min dih | serial | p1 | serial | volume | pieces | imbalance | s | interfaces: s, tets, angle before | |")
    print("|---|---|" + "--:|" * 11 + "---|---|")
    rows = wrong = 0
    for geometry in geometries:
        size = sizes(given.binary, geometry, folder, given.tets)
        for method in given.methods:
            serial = run(given.binary, [geometry, *size, "-m", method, "-f", "none"], folder)
            for ranks in given.ranks:
                rows += 1
                name = f"| {geometry.stem} | {method} | {ranks} |"
                out = ["-f", "elmer", "-o", folder / "out"] if given.judge else ["-f", "none"]
                report = run(given.binary, [geometry, *size, "-m", method, "-n", ranks, *out], folder)
                if isinstance(report, str) or isinstance(serial, str):
                    wrong += 1
                    print(name, f" | | | | | | | | | | | {report if isinstance(report, str) else serial} |", flush=True)
                    continue
                mesh, one, across = report["mesh"], serial["mesh"], report["across"]
                bad = list(faults(mesh, one))
                bad += judged(given, folder, ranks) if given.judge else []
                if ranks == given.mpi:
                    bad += against_mpi(given, [geometry, *size, "-m", method, "-f", "none"], mesh, folder)
                wrong += bool(bad)
                seconds = {stage["name"]: stage["seconds"] for stage in report["stages"]}
                before = f"{seconds['interfaces']:.1f}, {across['tets']}, {across['smallest_before']:.1f}" if across else ""
                part = report["partition"]
                print(name, f"{mesh['tets']} | {mesh['tets'] / one['tets']:.2f} | {mesh['smallest_dihedral']:.1f} | "
                      f"{one['smallest_dihedral']:.1f} | {mesh['first_percentile_dihedral']:.1f} | {one['first_percentile_dihedral']:.1f} | "
                      f"{mesh['volume'] / one['volume'] - 1:.0e} | {part['pieces']} | {part['imbalance']:.2f} | {report['seconds']:.1f} | {before} | {', '.join(bad)} |", flush=True)
    print(f"\n{rows} rows, {wrong} with faults.")


def against_mpi(given, arguments, mesh, folder):
    """Differences under mpirun."""
    report = run(given.binary, [*arguments, "--parts", given.mpi], folder, mpi=given.mpi)
    if isinstance(report, str):
        return [f"mpirun: {report}"]
    return [] if report["mesh"]["checksum"] == mesh["checksum"] else ["mpirun: another checksum"]


def table(given, geometries, folder):
    """Compares the three methods."""
    print("| geometry | ranks | method | tets | " + " | ".join(STAGES) + " | all | tets/s a core | imbalance | min dih | p1 | peak MB |")
    print("|---|--:|---|" + "--:|" * (len(STAGES) + 7))
    cores = os.cpu_count()
    for geometry in geometries:
        size = ["--preset", "moderate"] if geometry.stem == "torus" else ["--coarse", "2000"]
        for ranks in given.ranks:
            for method in ["decompose", "refine", "surface"]:
                arguments = [geometry, *size, "--pieces", given.pieces, "-m", method, "-n", ranks, "-f", "none"]
                report = run(given.binary, arguments, folder)
                if isinstance(report, str):
                    print(f"| {geometry.stem} | {ranks} | {method} | {report} |", flush=True)
                    continue
                mesh, seconds = report["mesh"], {s["name"]: s["seconds"] for s in report["stages"]}
                work = seconds.get("fill", 0) + seconds.get("levels", 0) + seconds.get("refine", 0)
                seconds["fill"] = work
                cells = [f"{seconds.get(stage, 0):.2f}" for stage in STAGES] + [f"{report['seconds']:.2f}"]
                cells += [f"{mesh['tets'] / work / cores:,.0f}", f"{report['partition']['imbalance']:.3f}"]
                cells += [f"{mesh['smallest_dihedral']:.1f}", f"{mesh['first_percentile_dihedral']:.1f}"]
                print(f"| {geometry.stem} | {ranks} | {method} | {mesh['tets']:,} | " + " | ".join(cells) +
                      f" | {report['peak_memory'] / 1e6:.0f} |", flush=True)


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("binary")
    options.add_argument("tutorials", type=pathlib.Path)
    options.add_argument("--own", type=pathlib.Path, default=pathlib.Path(__file__).parent.parent / "geometries")
    options.add_argument("--table", action="store_true")
    options.add_argument("--pieces", type=int, default=8, help="subdivisions of an edge, for --table")
    options.add_argument("--tets", type=float, default=64_000, help="approximate tets on one rank, without --table")
    options.add_argument("--ranks", type=lambda text: [int(n) for n in text.split(",")])
    options.add_argument("--methods", type=lambda text: text.split(","), default=["decompose", "surface"])
    options.add_argument("--only", type=lambda text: text.split(","))
    options.add_argument("--judge", type=pathlib.Path)
    options.add_argument("--mpi", type=int)
    given = options.parse_args()
    given.ranks = given.ranks or ([16, 32, 64] if given.table else RANKS)
    names = ["cube", "torus", "sphere"] if given.table else TUTORIALS + OWN
    of = lambda name: (given.tutorials if name in TUTORIALS else given.own) / f"{name}.geo"
    geometries = [of(name) for name in names if not given.only or name in given.only]
    with tempfile.TemporaryDirectory() as folder:
        (table if given.table else matrix)(given, geometries, pathlib.Path(folder))


if __name__ == "__main__":
    main()
