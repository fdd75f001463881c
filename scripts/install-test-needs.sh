#!/usr/bin/env bash
# Installs the programs that the tests need besides Rust: MPI, libclang (for its bindings), TetGen,
# CalculiX, CMake and PETSc for the C interface, DOLFINx and PETSc for the system's Python, and Python modules
# that read our files: numpy, Gmsh, NGSolve with NETGEN, meshio, scikit-fem, MFEM, h5py, VTK; Chromium and its
# driver Playwright for the viewer. Uses apt on Debian and Ubuntu; elsewhere it
# lists the missing packages. Does nothing if all are installed.
#
#   install-test-needs.sh            all
#   install-test-needs.sh system     what the tests need to be compiled, and the programs they run
#   install-test-needs.sh modules    Python modules
set -euo pipefail
what=${1:-all}
case $what in all | system | modules) ;; *)
    echo "usage: $0 [system | modules]" >&2
    exit 2
    ;;
esac

install_system() {
    local missing=() module libraries library sudo
    command -v mpicc >/dev/null && command -v mpirun >/dev/null || missing+=(libopenmpi-dev openmpi-bin)
    # libclang-cpp, a dependency of other packages, is a different library.
    compgen -G '/usr/lib/llvm-*/lib/libclang[.-][s0-9]*' >/dev/null || compgen -G '/usr/lib/*/libclang[.-][s0-9]*' >/dev/null \
        || missing+=(libclang-dev)
    [ -e /usr/include/tetgen.h ] || missing+=(libtet1.5-dev)
    command -v cc >/dev/null && command -v c++ >/dev/null || missing+=(build-essential)
    command -v pkg-config >/dev/null || missing+=(pkg-config)
    command -v python3 >/dev/null || missing+=(python3 python3-numpy)
    # Tests that need these are skipped with a message, so a system without apt is no error.
    if command -v apt-get >/dev/null; then
        command -v tetgen >/dev/null || missing+=(tetgen)
        command -v cmake >/dev/null || missing+=(cmake)
        command -v chromium >/dev/null || command -v chromium-browser >/dev/null || missing+=(chromium)
        command -v ccx >/dev/null || missing+=(calculix-ccx)
        pkg-config --exists PETSc 2>/dev/null || missing+=(petsc-dev)
        # Python of the system: pip's numpy is too new for its DOLFINx.
        for module in dolfinx petsc4py mpi4py pytest; do
            /usr/bin/python3 -c "import $module" 2>/dev/null || missing+=("python3-$module")
        done
        python3 -m pip --version >/dev/null 2>&1 || missing+=(python3-pip)
        # System libraries of the wheels of Gmsh and NETGEN.
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
}

install_modules() {
    local module package
    # Module and package.
    for module in numpy:numpy gmsh:gmsh ngsolve:ngsolve netgen.csg:netgen-mesher meshio:meshio skfem:scikit-fem mfem.ser:mfem h5py:h5py \
        vtkmodules:vtk playwright:playwright; do
        python3 -c "import ${module%%:*}" 2>/dev/null && continue
        package=${module##*:}
        python3 -m pip install --quiet "$package" 2>/dev/null \
            || python3 -m pip install --quiet --break-system-packages "$package" \
            || echo "no $package: tests that need it will be skipped" >&2
    done
}

[ "$what" = modules ] || install_system
[ "$what" = system ] || install_modules
