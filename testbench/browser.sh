#!/bin/bash
# The explorer's page in headless Chromium (testbench/browser/test.mjs): the bits of every shipped scene against the
# native engine, pace, controls, refusals. Makes the page (testbench/explorer.sh) and installs what it needs where it
# may.
# With --tools it only installs.
# SLACK=N allows N times the time where cores are busy.
# With --firefox, the bits, the slider and the map in headless Firefox too (testbench/browser/firefox.mjs).
# Exit codes: 0 all passed, 1 a test failed, 3 a tool is missing.
set -euo pipefail
cd "$(dirname "$0")/.."

# shellcheck source=testbench/tools.sh
. testbench/tools.sh

# Only what is missing: a Node.js that is not Debian's brings its own npm, and conflicts with Debian's.
tools="node npm"
packages=
found() { command -v "$1" || command -v "$2" || command -v "${3:-$2}" || true; }
[ -n "$(found chromium chromium-browser google-chrome)" ] || { tools="$tools chromium" && packages=" chromium"; }
command -v node >/dev/null || packages="$packages nodejs"
command -v npm >/dev/null || packages="$packages npm"
if [ "${1:-}" = --firefox ] && [ -z "$(found firefox-esr firefox)" ]; then
    tools="$tools firefox-esr" && packages="$packages firefox-esr"
fi
need "$tools" "${packages# }"
browser=$(found chromium chromium-browser google-chrome)
firefox=
[ "${1:-}" != --firefox ] || firefox=$(found firefox-esr firefox)
modules=${XDG_CACHE_HOME:-$HOME/.cache}/hpu/browser
if ! cmp -s testbench/browser/package-lock.json "$modules/installed"; then
    mkdir -p "$modules"
    cp testbench/browser/package.json testbench/browser/package-lock.json "$modules"
    if ! may_install playwright-core "from npm into $modules" ||
        ! npm ci --prefix "$modules" --silent --no-audit --no-fund; then
        echo "error: playwright-core could not be installed from npm into $modules" >&2
        exit 3
    fi
    cp testbench/browser/package-lock.json "$modules/installed"
fi

[ "${1:-}" != --tools ] || exit 0

testbench/explorer.sh
# Of the whole workspace, so that the crates have the features that they have in the tests, and are not built once more.
cargo build --locked --release --quiet --workspace --lib --bin hpu --example narrow --example hashes
target=${CARGO_TARGET_DIR:-target}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$target/release/examples/hashes" >"$work/hashes"
# The page as the command writes it.
"$target/release/hpu" explore -o "$work/explore.html" >"$work/said"
BROWSER=$browser node testbench/browser/test.mjs "$work/explore.html" "$work/hashes" "$modules"
if [ -n "$firefox" ]; then
    FIREFOX=$firefox node --experimental-websocket testbench/browser/firefox.mjs "$work/explore.html" "$work/hashes"
fi
