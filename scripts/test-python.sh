#!/usr/bin/env bash
# Builds the Python package, installs it in a fresh virtual environment, and runs its tests and type
# checks. Needs Rust, a C compiler and Python 3.10 or later with venv; pip installs everything else.
# Tests under mpirun with DOLFINx and PETSc run with the system's Python, if it has these.
set -euo pipefail
cd "$(dirname "$0")/../python"

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
export PATH="$folder/venv/bin:$PATH" VIRTUAL_ENV="$folder/venv"
pip=(python -m pip install --quiet --disable-pip-version-check)

"${pip[@]}" 'maturin>=1.9,<2' mypy pytest numpy
# Packages that tests solve with or convert to; the tests of one that cannot be installed are skipped.
for package in scikit-fem meshio pyvista ngsolve mfem mpi4py ipython gmsh; do
    "${pip[@]}" "$package" || echo "no $package: its tests will be skipped" >&2
done

# The tests' profile: it shares dependencies with them, and has overflow and debug checks.
maturin build --quiet --profile dev --out "$folder"
"${pip[@]}" "$folder"/tetmill-*.whl

mypy --config-file pyproject.toml python/tetmill
tetmill --version
# Not from this folder, whose package has no native library.
cd tests
python -m pytest -q -p no:cacheprovider "$@"

# DOLFINx and PETSc of Debian and Ubuntu do not bear pip's numpy 2: a second environment, with the same wheel.
if /usr/bin/python3 -c 'import dolfinx, petsc4py, mpi4py, pytest' 2>/dev/null; then
    /usr/bin/python3 -m zipfile -e "$folder"/tetmill-*.whl "$folder/system"
    PYTHONPATH=$folder/system /usr/bin/python3 -m pytest -q -p no:cacheprovider test_parallel.py
else
    echo "SKIPPED: /usr/bin/python3 has no dolfinx, petsc4py, mpi4py and pytest, so they do not solve across processes" >&2
fi
