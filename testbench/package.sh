#!/bin/sh
# Packages every crate as `cargo publish` would, with the explorer's page in `hpu`, and compiles each from its package.
# Usage: testbench/package.sh [OPTION...]: options of `cargo package`.
# Exit codes: 0 all made, 1 or 101 one was not, 3 the target of WebAssembly is missing.
set -eu
cd "$(dirname "$0")/.."

testbench/assets.sh
testbench/explorer.sh
page=crates/cli/explorer.html
cp "${CARGO_TARGET_DIR:-target}/explorer.html" $page
trap 'rm -f $page' EXIT
# The page is in no commit.
cargo package --locked --workspace --allow-dirty "$@"
