#!/usr/bin/env bash
# Installs the programs that the tests need and runs all tests: in-process ranks, MPI, comparison
# with TetGen.
set -euo pipefail
cd "$(dirname "$0")/.."
scripts/install-test-needs.sh system
# The compiler needs no Python modules: they are downloaded while it runs.
scripts/install-test-needs.sh modules &
modules=$!
# Open MPI removes its folder for the sessions of a user when it finds it empty, and another `mpirun`, about to put its own
# there, fails ("unable to create the desired directory"): seen once in 600 runs. The folder of this run is never empty.
sessions="$(mktemp -d)"
export OMPI_MCA_orte_tmpdir_base="$sessions"
mkdir -p "$sessions/ompi.$(uname -n).$(id -u)/kept"
trap 'kill "$modules" 2>/dev/null || true; rm -rf "$sessions"' EXIT

# By default Open MPI refuses to run as root or with more ranks than cores.
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 OMPI_MCA_rmaps_base_oversubscribe=1

if cargo nextest --version >/dev/null 2>&1; then
    tests=(cargo nextest run)
else
    tests=(cargo test)
fi

# Each build is of the whole workspace: with fewer packages, other crates get other features, and all is compiled again.
# `mpi` is a feature of the library and of the program; both have tests that depend on it.
"${tests[@]}" --no-run --workspace --features mpi --lib --bins --tests
wait "$modules"
"${tests[@]}" --no-fail-fast --workspace --features mpi --lib --bins --tests
scripts/test-viewer.sh
cargo test --workspace --features mpi --doc
# Each example checks its own result.
cargo build --quiet --workspace --features mpi --examples
built="${CARGO_TARGET_DIR:-target}/debug/examples"
for example in examples/*.rs; do
    "$built/$(basename "$example" .rs)" >/dev/null
done
mpirun -n 3 "$built/conduction_mpi" >/dev/null
# Without the feature a replacement module is compiled: run the program's tests about MPI again.
"${tests[@]}" --no-fail-fast --workspace --test command mpi
