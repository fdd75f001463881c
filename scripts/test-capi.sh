#!/usr/bin/env bash
# Tests the C interface: header, installation, examples and wrong use, with address sanitiser, and MPI and PETSc if they are there.
# MFEM_DIR may name a folder with a parallel build of MFEM, 4.8 or later.
set -euo pipefail
cd "$(dirname "$0")/.."
root=$PWD
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 OMPI_MCA_rmaps_base_oversubscribe=1
export PATH=$PATH:$HOME/.cargo/bin
passed=0
ok() { passed=$((passed + 1)); echo "ok: $*"; }
skipped() { echo "SKIPPED: $*"; }
warnings=(-Wall -Wextra -Werror)

# Compiles SOURCE to PROGRAM against the installation in PREFIX, with further arguments.
compile() { # compiler standard prefix source program arguments...
    local compiler=$1 standard=$2 prefix=$3 source=$4 program=$5
    shift 5
    # shellcheck disable=SC2046
    PKG_CONFIG_PATH=$prefix/lib/pkgconfig "$compiler" "-std=$standard" "${warnings[@]}" -O1 -g "$source" -o "$program" \
        $(PKG_CONFIG_PATH=$prefix/lib/pkgconfig pkg-config --cflags --libs tetmill) -Wl,-rpath,"$prefix/lib" "$@" -lm
}

# The errors that an example prints must agree to eight digits, whatever the number of parts.
same_errors() { # file of one run, file of another
    python3 - "$1" "$2" <<'PYTHON'
import re, sys
a, b = ([float(x) for x in re.findall(r"error (\S+)", open(name).read())] for name in sys.argv[1:])
assert len(a) >= 3 and len(a) == len(b) and all(abs(x - y) <= 1e-8 * abs(x) for x, y in zip(a, b)), (a, b)
PYTHON
}

# Runs an example on 1, 2 and 4 ranks; its errors must be those of the output EXPECTED.
solve_on_ranks() { # example expected
    for ranks in 1 2 4; do
        mpirun -n $ranks "$work/$1" > "$work/$1.$ranks"
        same_errors "$work/$2" "$work/$1.$ranks"
    done
    cat "$work/$1.4"
}

# The committed header is what cbindgen generates.
if command -v cbindgen >/dev/null; then
    (cd capi && cbindgen --quiet --config cbindgen.toml --output "$work/tetmill.h")
    diff -u capi/include/tetmill.h "$work/tetmill.h" || {
        echo "capi/include/tetmill.h is stale: cd capi && cbindgen --config cbindgen.toml --output include/tetmill.h" >&2
        exit 1
    }
    ok "header"
else
    skipped "no cbindgen (cargo install cbindgen), so the header is not compared"
fi

capi/install.sh --prefix "$work/threads" --profile dev --workspace >/dev/null
sanitised=(-fsanitize=address,undefined -fno-sanitize-recover=all)

# Header alone, as C and as C++.
echo '#include <tetmill.h>' > "$work/header.c"
cp "$work/header.c" "$work/header.cc"
cc -std=c99 "${warnings[@]}" -pedantic -I"$work/threads/include" -fsyntax-only "$work/header.c"
c++ -std=c++11 "${warnings[@]}" -pedantic -I"$work/threads/include" -fsyntax-only "$work/header.cc"
ok "header in C99 and C++11"

compile cc c99 "$work/threads" capi/tests/wrong_use.c "$work/wrong_use" "${sanitised[@]}"
(cd "$work" && ./wrong_use)
ok "wrong use, with address sanitiser and leak check"

compile cc c99 "$work/threads" capi/tests/second_order.c "$work/second_order" "${sanitised[@]}"
"$work/second_order"
ok "second order on 1, 3 and 5 parts, with address sanitiser and leak check"

compile cc c99 "$work/threads" capi/examples/poisson.c "$work/poisson" "${sanitised[@]}"
for parts in 1 4 7; do
    "$work/poisson" $parts > "$work/poisson.$parts"
done
same_errors "$work/poisson.1" "$work/poisson.4"
same_errors "$work/poisson.1" "$work/poisson.7"
cat "$work/poisson.7"
ok "Poisson's equation on 1, 4 and 7 parts, with address sanitiser and leak check"

# MFEM's text, by an independent checker, and by MFEM itself where its Python module is there (one part).
compile cc c99 "$work/threads" capi/examples/mfem_text.c "$work/mfem_text" "${sanitised[@]}"
checker=${TETMILL_SHARED:-../shared}/tools/check_mfem.py
for geometry in geometries/dome.geo geometries/layers.geo; do
    for parts in 1 2 4 7; do
        "$work/mfem_text" $geometry $parts "$work/text.$parts"
        if [ -e "$checker" ]; then
            python3 "$checker" "$work/text.$parts"
            ok "MFEM's text of $geometry in $parts parts"
        fi
    done
done
[ -e "$checker" ] || skipped "there is no $checker, so MFEM's text is not checked"
if python3 -c 'import mfem.ser' 2>/dev/null; then
    python3 - "$work/text.1.000000" <<'PYTHON'
import sys, mfem.ser as mfem
mesh = mfem.Mesh(sys.argv[1], 1, 0)
assert mesh.GetNE() > 100 and mesh.GetNBE() > 100, (mesh.GetNE(), mesh.GetNBE())
assert mesh.CheckElementOrientation(False) == 0 and mesh.CheckBdrElementOrientation(False) == 0
volume = sum(mesh.GetElementVolume(k) for k in range(mesh.GetNE()))
print(f"MFEM reads {mesh.GetNE()} tets, {mesh.GetNBE()} triangles, volume {volume:.9g}")
PYTHON
    ok "MFEM reads one part"
else
    skipped "no Python module mfem (pip install mfem), so MFEM does not read its text"
fi

# The static library, by its own list of system libraries.
private=$(PKG_CONFIG_PATH=$work/threads/lib/pkgconfig pkg-config --libs --static tetmill | sed 's/.*-ltetmill//')
# shellcheck disable=SC2086
cc -std=c99 "${warnings[@]}" -O1 capi/examples/poisson.c -I"$work/threads/include" "$work/threads/lib/libtetmill.a" $private -lm \
    -o "$work/static"
"$work/static" 2 > "$work/poisson.static"
same_errors "$work/poisson.1" "$work/poisson.static"
ok "static library"

if command -v cmake >/dev/null; then
    mkdir "$work/cmake"
    cat > "$work/cmake/CMakeLists.txt" <<CMAKE
cmake_minimum_required(VERSION 3.13)
project(poisson C)
find_package(tetmill 0.1 REQUIRED)
foreach(library tetmill static)
    add_executable(with_\${library} "$root/capi/examples/poisson.c")
    target_link_libraries(with_\${library} tetmill::\${library} m)
endforeach()
CMAKE
    cmake -S "$work/cmake" -B "$work/cmake/build" -DCMAKE_PREFIX_PATH="$work/threads" >/dev/null
    cmake --build "$work/cmake/build" >/dev/null
    "$work/cmake/build/with_tetmill" 3 > "$work/poisson.cmake"
    "$work/cmake/build/with_static" 3 >/dev/null
    same_errors "$work/poisson.1" "$work/poisson.cmake"
    ok "CMake"
else
    skipped "no cmake, so tetmill-config.cmake is not tried"
fi

# Across processes: the same errors on 1, 2 and 4 ranks, and with several parts in a process.
if command -v mpicc >/dev/null && command -v mpirun >/dev/null; then
    capi/install.sh --prefix "$work/mpi" --profile dev --workspace --mpi >/dev/null
    compile mpicc c99 "$work/mpi" capi/examples/poisson.c "$work/poisson_mpi"
    compile mpicc c99 "$work/mpi" capi/tests/mpi_use.c "$work/mpi_use"
    for ranks in 1 2 4; do
        mpirun -n $ranks "$work/poisson_mpi" > "$work/poisson.mpi.$ranks"
        same_errors "$work/poisson.1" "$work/poisson.mpi.$ranks"
        mpirun -n $ranks "$work/mpi_use" "$work/text.mpi.$ranks"
    done
    mpirun -n 2 "$work/poisson_mpi" 5 > "$work/poisson.mpi.5"
    same_errors "$work/poisson.1" "$work/poisson.mpi.5"
    mpirun -n 3 "$work/poisson_mpi" 2 > "$work/poisson.mpi.idle"
    same_errors "$work/poisson.1" "$work/poisson.mpi.idle"
    ok "Poisson's equation on 1, 2 and 4 MPI ranks, 5 parts on 2, 2 parts on 3; wrong use with MPI"
    if [ -e "$checker" ]; then
        python3 "$checker" "$work/text.mpi.4"
        ok "MFEM's text on 4 MPI ranks"
    fi
    if pkg-config --exists PETSc; then
        # shellcheck disable=SC2046
        compile mpicc gnu99 "$work/mpi" capi/examples/dmplex.c "$work/dmplex" $(pkg-config --cflags --libs PETSc)
        solve_on_ranks dmplex poisson.1
        ok "DMPlex of PETSc on 1, 2 and 4 ranks"
    else
        skipped "no PETSc (apt install petsc-dev), so no DMPlex"
    fi
    if [ -e "${MFEM_DIR:-}/config/config.mk" ]; then
        mfem() { printf 'include %s\nprint:\n\t@echo $(MFEM_%s)\n' "$MFEM_DIR/config/config.mk" "$1" | make -s -f - print; }
        # shellcheck disable=SC2046
        compile mpicxx c++17 "$work/mpi" capi/examples/mfem_poisson.cpp "$work/mfem_poisson" -isystem "$MFEM_DIR" \
            $(mfem TPLFLAGS | sed 's/-I/-isystem /g') -L"$MFEM_DIR" -lmfem $(mfem EXT_LIBS)
        solve_on_ranks mfem_poisson mfem_poisson.1
        ok "ParMesh of MFEM on 1, 2 and 4 ranks"
    else
        skipped "MFEM_DIR does not name a build of MFEM, so ParMesh does not read the text on several ranks"
    fi
else
    skipped "no MPI, so nothing runs across processes"
fi

echo "$passed passed, 0 failed"
