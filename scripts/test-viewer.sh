#!/usr/bin/env bash
# Tests the viewer in headless Chromium with software WebGL. Needs Playwright for Python and Chromium
# (scripts/install-test-needs.sh installs both); without them it is skipped with a message.
set -euo pipefail
cd "$(dirname "$0")/.."
python=${VIEWER_PYTHON:-python3}
if ! "$python" -c "import playwright" 2>/dev/null || ! { command -v chromium || command -v chromium-browser; } >/dev/null; then
    echo "no Playwright or no Chromium: the tests of the viewer are skipped" >&2
    exit 0
fi
# With the features of scripts/test.sh, so that nothing is compiled twice.
cargo build --quiet --workspace --features mpi --bin tetmill
[ $# -gt 0 ] || set -- discover -s tests/viewer
export PYTHONPATH=tests/viewer PYTHONDONTWRITEBYTECODE=1
TETMILL="$(cd "${CARGO_TARGET_DIR:-target}" && pwd)/debug/tetmill" "$python" -m unittest "$@"
