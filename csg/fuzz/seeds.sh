#!/usr/bin/env bash
# Collects seeds for the fuzzer: our geometries, and all .geo files of the given folders.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
mkdir -p "$here/corpus/parse"
for folder in "$here/../../geometries" "$@"; do
    for file in "$folder"/*.geo; do
        # Prefix the folder's name, because two folders may have files of the same name.
        cp "$file" "$here/corpus/parse/$(basename "$(dirname "$file")")-$(basename "$file")"
    done
done
ls "$here/corpus/parse" | wc -l
