#!/usr/bin/env bash
# Installs what the tests need beside Rust: MPI, libclang (for its bindings), TetGen, Python with numpy.
# Debian and Ubuntu by apt; elsewhere it says what is missing. Does nothing where all is there.
set -euo pipefail

missing=()
command -v mpicc >/dev/null && command -v mpirun >/dev/null || missing+=(libopenmpi-dev openmpi-bin)
# libclang-cpp, which other packages bring along, is another library.
compgen -G '/usr/lib/llvm-*/lib/libclang[.-][s0-9]*' >/dev/null || compgen -G '/usr/lib/*/libclang[.-][s0-9]*' >/dev/null \
    || missing+=(libclang-dev)
[ -e /usr/include/tetgen.h ] || missing+=(libtet1.5-dev)
command -v cc >/dev/null && command -v c++ >/dev/null || missing+=(build-essential)
command -v pkg-config >/dev/null || missing+=(pkg-config)
command -v python3 >/dev/null || missing+=(python3 python3-numpy)

if [ ${#missing[@]} -gt 0 ]; then
    if ! command -v apt-get >/dev/null; then
        echo "please install the equivalents of: ${missing[*]}" >&2
        exit 1
    fi
    sudo=()
    [ "$(id -u)" = 0 ] || sudo=(sudo)
    export DEBIAN_FRONTEND=noninteractive
    "${sudo[@]}" apt-get update -qq
    "${sudo[@]}" apt-get install -y -qq --no-install-recommends "${missing[@]}"
fi

if ! python3 -c 'import numpy' 2>/dev/null; then
    python3 -m pip install --quiet numpy 2>/dev/null \
        || python3 -m pip install --quiet --break-system-packages numpy
fi
