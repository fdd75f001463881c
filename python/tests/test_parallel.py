"""Meshes across the processes of MPI jobs, which `mpirun` starts."""

import importlib.util
import math
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

PROGRAMS = Path(__file__).parent / "programs"


def needs(*modules):
    missing = [module for module in modules if importlib.util.find_spec(module) is None]
    if shutil.which("mpirun") is None:
        missing.append("mpirun")
    return pytest.mark.skipif(bool(missing), reason=f"needs {', '.join(missing)}")


def run(ranks, program, *arguments, status=0):
    environment = {
        **os.environ,
        "OMPI_ALLOW_RUN_AS_ROOT": "1",
        "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
        "OMPI_MCA_rmaps_base_oversubscribe": "1",
        # FFCx reports each compiled form.
        "PYTHONWARNINGS": "ignore",
    }
    command = ["mpirun", "-n", str(ranks), sys.executable, str(PROGRAMS / program), *map(str, arguments)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=500, check=False)
    assert done.returncode == status, done.stdout + done.stderr
    return done.stdout


@needs("mpi4py")
@pytest.mark.parametrize("ranks", [1, 2, 4])
def test_meshes_across_processes(ranks, tmp_path):
    assert run(ranks, "use_mpi.py", tmp_path).strip() == "passed"


@needs("mpi4py")
def test_a_process_that_fails_in_an_operation_ends_the_job():
    run(3, "fail.py", status=5)


def errors(output):
    found = [float(error) for error in re.findall(r"error (\S+)", output)]
    assert len(found) == 3, output
    return found


def assert_same_second_order(outputs):
    """The error falls as h², and is the same within rounding for any number of processes."""
    for output in outputs:
        coarse, middle, fine = errors(output)
        assert coarse / middle > 2.5 and 3.2 < middle / fine < 4.8, output
        assert errors(output) == pytest.approx(errors(outputs[0]), rel=1e-8)


@needs("mpi4py", "petsc4py")
def test_poisson_with_dmplex():
    assert_same_second_order([run(ranks, "poisson_dmplex.py") for ranks in (1, 2, 4)])


@needs("mpi4py", "petsc4py", "dolfinx")
def test_heat_with_dolfinx():
    runs = [(1, "none"), (2, "none"), (4, "shared_facet")]
    outputs = [run(ranks, "poisson_dolfinx.py", ghost_mode) for ranks, ghost_mode in runs]
    assert_same_second_order(outputs)
    for output in outputs:
        # Boundaries by name: 4 pi r^2, from inside.
        interface, skin = map(float, re.findall(r"areas (\S+) (\S+)", output)[-1])
        assert 3.12 < interface < 3.1416 and 12.5 < skin < 12.5664, output


def volumes(output, levels):
    """The volumes that the solver integrates are those of the reports."""
    found = [(float(a), float(b)) for a, b in re.findall(r"volumes (\S+) (\S+)", output)]
    assert len(found) == levels, output
    for integrated, reported in found:
        assert integrated == pytest.approx(reported, abs=1e-10), output
    return found


@needs("mpi4py", "petsc4py")
def test_dmplex_has_curved_tets():
    outputs = [run(ranks, "second_order_dmplex.py") for ranks in (1, 2, 4)]
    for output in outputs:
        # The volume that is missing falls as h⁴, with straight edges as h².
        coarse, fine = (4 * math.pi / 3 - volume for volume, _ in volumes(output, 2))
        assert 0 < fine < coarse / 12 and coarse < 5e-3, output


@needs("mpi4py", "petsc4py", "dolfinx")
def test_dolfinx_has_curved_tets_and_its_error_falls_as_h3():
    for ranks, ghost_mode in [(1, "none"), (2, "none"), (3, "shared_facet")]:
        output = run(ranks, "second_order_dolfinx.py", ghost_mode)
        volumes(output, 3)
        errors_of_levels = errors(output)
        assert math.log2(errors_of_levels[1] / errors_of_levels[2]) > 2.8, output
        cores = [float(core) for core in re.findall(r"core (\S+)", output)]
        areas = [(float(a), float(b)) for a, b in re.findall(r"areas (\S+) (\S+)", output)]
        for core, (interface, skin) in zip(cores, areas, strict=True):
            assert core == pytest.approx(math.pi / 6, rel=2e-3), output
            assert (interface, skin) == pytest.approx((math.pi, 4 * math.pi), rel=2e-3), output
        assert areas[-1] == pytest.approx((math.pi, 4 * math.pi), rel=1e-5), output
