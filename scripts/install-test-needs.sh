#!/usr/bin/env bash
# Installs what the tests need beside Rust: MPI, libclang (for its bindings), TetGen, Python with numpy, and the programs that read our
# files, as modules of Python: Gmsh, NGSolve with NETGEN, meshio, scikit-fem, MFEM.
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
# Without these tests are skipped, aloud: they are no reason to give up where there is no apt.
if command -v apt-get >/dev/null; then
    command -v tetgen >/dev/null || missing+=(tetgen)
    python3 -m pip --version >/dev/null 2>&1 || missing+=(python3-pip)
    # What the wheels of Gmsh and NETGEN need of the system.
    libraries=$(PATH=$PATH:/sbin:/usr/sbin ldconfig -p)
    for library in GL.so.1:libgl1 GLU.so.1:libglu1-mesa Xrender.so.1:libxrender1 Xcursor.so.1:libxcursor1 Xft.so.2:libxft2 \
        Xinerama.so.1:libxinerama1 Xfixes.so.3:libxfixes3 fontconfig.so.1:libfontconfig1 gomp.so.1:libgomp1; do
        [[ $libraries == *"lib${library%%:*}"* ]] || missing+=("${library##*:}")
    done
fi

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

# The module and the package that has it.
for module in numpy:numpy gmsh:gmsh ngsolve:ngsolve netgen.csg:netgen-mesher meshio:meshio skfem:scikit-fem mfem.ser:mfem; do
    python3 -c "import ${module%%:*}" 2>/dev/null && continue
    package=${module##*:}
    python3 -m pip install --quiet "$package" 2>/dev/null \
        || python3 -m pip install --quiet --break-system-packages "$package" \
        || echo "no $package: tests that need it are skipped" >&2
done
