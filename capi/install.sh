#!/usr/bin/env bash
# Builds the C interface and installs header, shared and static library, pkg-config file and CMake configuration.
#
#   capi/install.sh --prefix DIR [--mpi] [--profile NAME] [--workspace]
#
# --mpi builds with MPI (tetmill_generate_comm); --profile is that of cargo, by default release; --workspace builds all packages,
# as the tests do, which then compile nothing twice. Linux and other ELF systems.
set -euo pipefail
cd "$(dirname "$0")/.."

prefix="" features=() mpi="" profile=release packages=(-p tetmill -p tetmill-capi)
while [ $# -gt 0 ]; do
    case $1 in
        --prefix) prefix=${2:?--prefix needs a folder}; shift 2 ;;
        --profile) profile=${2:?--profile needs a name}; shift 2 ;;
        --workspace) packages=(--workspace); shift ;;
        --mpi) features=(--features mpi); mpi=1; shift ;;
        *) echo "unknown argument $1; see the top of $0" >&2; exit 2 ;;
    esac
done
[ -n "$prefix" ] || { echo "--prefix DIR is missing" >&2; exit 2; }
mkdir -p "$prefix"
prefix=$(cd "$prefix" && pwd)

# With the library beside it, both are built with the same features.
cargo build --quiet --profile "$profile" "${packages[@]}" "${features[@]}"
built=${CARGO_TARGET_DIR:-target}/$([ "$profile" = dev ] && echo debug || echo "$profile")
version=$(sed -n '/^\[workspace.package\]/,/^\[/s/^version = "\(.*\)"/\1/p' Cargo.toml)
soname=libtetmill.so.${version%.*}

install -d "$prefix/include" "$prefix/lib/pkgconfig" "$prefix/lib/cmake/tetmill"
install -m 644 capi/include/tetmill.h "$prefix/include/"
install -m 644 "$built/libtetmill_c.a" "$prefix/lib/libtetmill.a"
install -m 755 "$built/libtetmill_c.so" "$prefix/lib/libtetmill.so.$version"
ln -sf "libtetmill.so.$version" "$prefix/lib/$soname"
ln -sf "$soname" "$prefix/lib/libtetmill.so"

# The system libraries that a program with the static library needs, as Rust names them.
scratch=$(mktemp -d)
private=$(echo | rustc --crate-type staticlib --crate-name none --print native-static-libs -o "$scratch/none" - 2>&1 \
    | sed -n 's/^note: native-static-libs: //p')
rm -r "$scratch"
[[ $private == *-lm* ]] || private+=" -lm"
for file in tetmill.pc:pkgconfig tetmill-config.cmake:cmake/tetmill tetmill-config-version.cmake:cmake/tetmill; do
    sed -e "s|@PREFIX@|$prefix|; s|@VERSION@|$version|; s|@PRIVATE@|$private|; s|@MPI@|$mpi|; s|@SONAME@|$soname|" \
        -e "s|@DEFINE@|${mpi:+-DTETMILL_MPI}|" "capi/install/${file%%:*}.in" > "$prefix/lib/${file##*:}/${file%%:*}"
done
echo "tetmill $version${mpi:+ with MPI} is in $prefix"
