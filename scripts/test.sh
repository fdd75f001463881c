#!/usr/bin/env bash
# Installs what the tests need and runs all of them: in-process ranks and MPI, TetGen beside our mesher.
set -euo pipefail
cd "$(dirname "$0")/.."
scripts/install-test-needs.sh

# Open MPI refuses root and more ranks than cores unless told otherwise.
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 OMPI_MCA_rmaps_base_oversubscribe=1

if cargo nextest --version >/dev/null 2>&1; then
    run() { cargo nextest run --no-fail-fast "$@"; }
else
    run() { cargo test --no-fail-fast --lib --bins --tests "$@"; }
fi

run --workspace --features tetmill/mpi
cargo test --workspace --features tetmill/mpi --doc
# Without the feature the twin module takes the place of MPI: what is about MPI is run again.
run -p tetmill mpi
