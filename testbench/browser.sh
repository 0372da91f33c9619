#!/bin/bash
# The explorer's page in headless Chromium (testbench/browser/test.mjs): the bits of every shipped scene against the
# native engine, pace, controls, refusals. Makes the page (testbench/explorer.sh) and installs what it needs where it
# may.
# SLACK=N allows N times the time where cores are busy.
# With --firefox, the bits, the slider and the map in headless Firefox too (testbench/browser/firefox.mjs).
# Exit codes: 0 all passed, 1 a test failed, 3 a tool is missing.
set -euo pipefail
cd "$(dirname "$0")/.."

# Only what is missing: a Node.js that is not Debian's brings its own npm, and conflicts with Debian's.
packages=
firefox=
browser=$(command -v chromium || command -v chromium-browser || command -v google-chrome || true)
[ -n "$browser" ] || packages="chromium"
command -v node >/dev/null || packages="$packages nodejs"
command -v npm >/dev/null || packages="$packages npm"
if [ "${1:-}" = --firefox ]; then
    firefox=$(command -v firefox-esr || command -v firefox || echo missing)
    [ "$firefox" != missing ] || packages="$packages firefox-esr"
fi
if [ -n "$packages" ]; then
    if [ "$(id -u)" != 0 ] || ! command -v apt-get >/dev/null; then
        echo "error: a browser, Node.js or npm is missing; install and run this again:" \
            "sudo apt-get install $packages" >&2
        exit 3
    fi
    apt-get update -qq
    # shellcheck disable=SC2086  # one word a package
    DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $packages
    [ -n "$browser" ] || browser=$(command -v chromium)
    [ "$firefox" != missing ] || firefox=$(command -v firefox-esr)
fi
modules=${XDG_CACHE_HOME:-$HOME/.cache}/hpu/browser
if ! cmp -s testbench/browser/package-lock.json "$modules/installed"; then
    mkdir -p "$modules"
    cp testbench/browser/package.json testbench/browser/package-lock.json "$modules"
    if ! npm ci --prefix "$modules" --silent --no-audit --no-fund; then
        echo "error: playwright-core could not be installed from npm into $modules" >&2
        exit 3
    fi
    cp testbench/browser/package-lock.json "$modules/installed"
fi

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
