#!/usr/bin/env bash
# Installs the programs that the tests need and runs all tests: in-process ranks, MPI, comparison
# with TetGen.
set -euo pipefail
cd "$(dirname "$0")/.."
scripts/install-test-needs.sh

# By default Open MPI refuses to run as root or with more ranks than cores.
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 OMPI_MCA_rmaps_base_oversubscribe=1

if cargo nextest --version >/dev/null 2>&1; then
    run() { cargo nextest run --no-fail-fast "$@"; }
else
    run() { cargo test --no-fail-fast --lib --bins --tests "$@"; }
fi

# `mpi` is a feature of the library and of the program; both have tests that depend on it.
run --workspace --features mpi
scripts/test-viewer.sh
cargo test --workspace --features mpi --doc
# Each example checks its own result.
for example in examples/*.rs; do
    cargo run --quiet --features mpi --example "$(basename "$example" .rs)" >/dev/null
done
mpirun -n 3 "${CARGO_TARGET_DIR:-target}/debug/examples/conduction_mpi" >/dev/null
# Without the feature a replacement module is compiled: run the program's tests about MPI again.
run -p tetmill-cli mpi
