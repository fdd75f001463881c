#!/usr/bin/env bash
# Collects seeds for the fuzzer: our geometries, and whatever .geo files the given folders have.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
mkdir -p "$here/corpus/parse"
for folder in "$here/../../geometries" "$@"; do
    for file in "$folder"/*.geo; do
        # The folder's name goes along: two may have a file of one name.
        cp "$file" "$here/corpus/parse/$(basename "$(dirname "$file")")-$(basename "$file")"
    done
done
ls "$here/corpus/parse" | wc -l
