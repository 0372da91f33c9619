#!/bin/bash
# What is too long for the test command: every test with checks of overflow and debug assertions, the tests marked
# `ignore`, the whole `hpu check`, the explorer in Chromium and Firefox, libhpu and the Python package under valgrind,
# stable sets of 1000 random loops against numpy, the wheel and the archive of a release, words against APyTypes,
# networks against 60 decimal places, then commands at random, on all cores. Its record is record/long.txt.
# One command in five is given files of somebody else (crates/cli/tests/all/fuzz/foreign.rs).
# Usage: testbench/long.sh [COMMANDS [SEED]]: so many commands [100000] of a seed [1]; --update writes the record.
# Exit codes: 0 every test passed and every command ended as the contract says, 1 one did not.
set -euo pipefail
cd "$(dirname "$0")/.."

update=
if [ "${1:-}" = --update ]; then
    update=yes
    shift
fi
commands=${1:-100000}
seed=${2:-1}
cores=$(nproc)
checked=${CARGO_TARGET_DIR:-target}/checked
share=$(((commands + cores - 1) / cores))
# The solvers that testbench/test.sh has installed.
PATH=$PATH:${XDG_CACHE_HOME:-$HOME/.cache}/hpu/solvers-venv/bin

binary=$(cargo test --locked --profile checked --workspace --tests --no-run --message-format=json-render-diagnostics |
    grep '"manifest_path":"[^"]*/crates/cli/Cargo.toml"' | sed -n 's/.*"name":"all".*"executable":"\([^"]*\)".*/\1/p')
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

failed=0
cargo test --locked --profile checked --workspace --tests --no-fail-fast -- --include-ignored \
    >"$scratch/tests" 2>&1 || failed=1
[ $failed = 0 ] || cat "$scratch/tests"

# The VHDL on all random rows, of which the test command takes a twentieth.
"$checked/hpu" check >"$scratch/checked" || failed=1
tail -n 1 "$scratch/checked"

# A gimbal's loop in contact and over many switches: 1.2 million edges in VHDL, 12 million events against clock.
gimbal=(gimbal-switch --set clock.frequency="2 MHz")
"$checked/hpu" check --scene "${gimbal[@]}" --edges 1200000 >"$scratch/switched" || failed=1
tail -n 1 "$scratch/switched"
"$checked/hpu" run "${gimbal[@]}" --set run.duration="6 s" --compare >"$scratch/compared" || failed=1
tail -n 1 "$scratch/compared"

# The explorer in two browsers.
testbench/browser.sh --firefox >"$scratch/browsers" || { failed=1 && cat "$scratch/browsers"; }
firefox=$(tail -n 1 "$scratch/browsers")
echo "$firefox"

# The library in C: no error, no leak. The second program is refused at every turn, in two threads. The tables of named
# parts are read once a process and stay.
cargo build --locked --release --quiet -p hpu-capi
for program in crates/capi/examples/motor.c crates/capi/tests/c/refused.c; do
    cc -O2 -g -pthread -Icrates/capi/include -o "$scratch/program" "$program" -Ltarget/release -lhpu
    clean="no error, no leak"
    LD_LIBRARY_PATH=target/release valgrind --quiet --leak-check=full --error-exitcode=1 \
        --show-leak-kinds=definite,indirect --errors-for-leak-kinds=definite,indirect \
        "$scratch/program" hybrid-wall "run.duration=20 ms" >"$scratch/said" || { failed=1 && clean="errors"; }
    echo "valgrind $program: $clean" >>"$scratch/valgrind"
done
cat "$scratch/valgrind"

# The wheel of the Python package by README's command, its tests, and every public name under valgrind. Python's own
# memory at exit is not the package's: records count that have a frame of the extension.
python3 -m venv "$scratch/venv"
"$scratch/venv/bin/pip" install --quiet numpy==2.4.6 mpmath==1.4.1 polars==2.1.0 pandas==3.1.1 cocotb==2.1.0 \
    apytypes==0.5.1
"$scratch/venv/bin/pip" wheel --quiet ./crates/python --no-deps -w "$scratch/dist"
"$scratch/venv/bin/pip" install --quiet "$scratch"/dist/*.whl
cargo build --locked --release --quiet -p hpu
HPU_MILLIONS=10 HPU=$PWD/target/release/hpu LIBHPU=$PWD/target/release "$scratch/venv/bin/python" -B \
    -m unittest discover -s crates/python/tests >"$scratch/python" 2>&1 || { failed=1 && cat "$scratch/python"; }
echo "wheel of the Python package: $(grep -E '^Ran ' "$scratch/python")" >"$scratch/wheel"
# The library of the tests. In the release build `Characteristic::at` and `on` of hpu-prove, which are safe Rust,
# compare the index in `Of::Slope` before they ask whether it is that variant; valgrind then reports an uninitialised
# value. PyO3 makes a table of methods for each class, once a process, and keeps it.
cargo build --locked --profile checked --quiet --workspace --lib
mkdir "$scratch/package"
cp -r crates/python/python/hpu "$scratch/package/"
cp "$checked/lib_hpu.so" "$scratch/package/hpu/_hpu.abi3.so"
PYTHONPATH=$scratch/package PYTHONMALLOC=malloc valgrind --leak-check=full --show-leak-kinds=definite --num-callers=40 \
    --log-file="$scratch/memory" "$scratch/venv/bin/python" crates/python/tests/every_call.py \
    >"$scratch/called" || failed=1
clean=$(awk -v RS='\n==[0-9]*== \n' '
    /_hpu\.abi3/ && !/possibly lost|still reachable|pyclass::create_type_object/ { errors++ }
    END { print errors ? errors " errors" : "no error, no leak" }' "$scratch/memory")
[ "$clean" = "no error, no leak" ] || { failed=1 && cat "$scratch/memory"; }
echo "valgrind Python: $(cat "$scratch/called"), $clean" >>"$scratch/wheel"
cat "$scratch/wheel"

# What a release has: the wheel and the archive, each on a machine of its own as far as can be.
{ testbench/wheel.sh "$scratch/dist" && testbench/release.sh "$scratch/dist"; } >"$scratch/released" || failed=1
cat "$scratch/released"

# Stable sets against eigenvalues by numpy, of 1000 random loops.
"$scratch/venv/bin/python" testbench/oracle/stable_set.py target/release/hpu 1000 "$seed" >"$scratch/sets" || failed=1
cat "$scratch/sets"

# Rounding and overflow against APyTypes, in four times as many formats as the test command takes.
cargo build --locked --release --quiet -p hpu-signal --example narrow
"$scratch/venv/bin/python" testbench/oracle/narrowing.py target/release/examples/narrow 1 160 >"$scratch/narrowed" ||
    failed=1
cat "$scratch/narrowed"

# Networks against an integration of their own, 10^8 clock edges each.
"$scratch/venv/bin/python" testbench/oracle/network.py target/release/hpu >"$scratch/networks" || failed=1
cat "$scratch/networks"

pids=()
for ((core = 0; core < cores; core++)); do
    (
        cd crates/cli
        HPU_FUZZ=$share HPU_FUZZ_SEED=$seed HPU_FUZZ_FIRST=$((core * share)) HPU_FUZZ_FOLDER=fuzz-$core \
            "$binary" --exact fuzz::commands_at_random_end_as_the_contract_says --nocapture \
            >"$scratch/$core" 2>"$scratch/$core.err"
    ) &
    pids+=($!)
done
for pid in "${pids[@]}"; do
    wait "$pid" || failed=1
done
grep -h "HPU_FUZZ_SEED" -A3 "$scratch"/*.err || true

{
    echo "# testbench/long.sh $commands $seed: $(rustc -V), $cores cores, commit $(git rev-parse --short HEAD)"
    echo "# seconds of wall time, other work on the machine included; a command that computes for more than 20 s fails"
    awk '/^test result:/ { passed += $4; failed += $6 }
        END {
            printf "tests with checks of overflow, and those that the test command leaves out: "
            printf "%d passed, %d failed\n", passed, failed
        }' "$scratch/tests"
    tail -n 1 "$scratch/checked"
    tail -n 1 "$scratch/switched"
    tail -n 1 "$scratch/compared"
    echo "explorer in $firefox"
    cat "$scratch/valgrind" "$scratch/wheel" "$scratch/released"
    tail -n 1 "$scratch/sets"
    head -n 1 "$scratch/narrowed"
    cat "$scratch/networks"
    # The same verb and exit of all shares in one line.
    awk '
        # A verb of 18 characters, which may have blanks, then its exit.
        / exit / {
            key = substr($0, 1, 34)
            split(substr($0, 35), field, " ")
            count[key] += field[1] + 0
            seconds[key] += field[2] + 0
            if (field[6] + 0 > longest[key]) longest[key] = field[6] + 0
        }
        / past reading, / { all += $1; past += $3; ours += $5; rate += $11; failures += $(NF - 1) }
        END {
            for (key in count)
                printf "%s %7d, %6.0f s, the longest %.2f s\n", key, count[key], seconds[key], longest[key] | "sort"
            close("sort")
            printf "%d commands, %d of %d of our own past reading, %.1f a second, %d failures\n",
                all, past, ours, rate, failures
        }' "$scratch"/[0-9]
} | tee "$scratch/record"
[ -z "$update" ] || mv "$scratch/record" testbench/record/long.txt
exit $failed
