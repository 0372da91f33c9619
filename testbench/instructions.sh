#!/bin/sh
# Instructions of a few short runs, counted by callgrind, held to those on record within 2 %. With --update, writes the
# record.
#
# Counts depend on the compiler and on what the processor offers to code that asks, so the record names both. Where they
# are others, the record's numbers say nothing: the commit that last changed the record is then built and counted here,
# and the comparison is with that. Without its history (a shallow clone) nothing can be said, and the script fails.
set -eu
cd "$(dirname "$0")/.."
record=testbench/record/instructions.txt
margin_percent=2

command -v valgrind >/dev/null 2>&1 || {
    echo "error: valgrind is missing; install it: sudo apt-get install valgrind" >&2
    exit 3
}

# Release build in the tree $1, into the target directory $2; then a line a run: its name and its instructions.
count() {
    # Of the whole workspace: the crates then have the features that they have in the tests, and are not built again.
    for example in wave/examples/instructions rtl/examples/leaping; do
        # A commit of the past may have fewer.
        [ -e "$1/crates/$example.rs" ] || continue
        name=${example##*/}
        (cd "$1" && CARGO_TARGET_DIR="$2" cargo build --locked --quiet --release --workspace --example "$name")
        counted "$1" "$2/release/examples/$name" || return 1
    done
}

# The same lines of a program, in the tree $1.
counted() {
    program=$2
    for run in $("$program" | awk '{ print $1 }'); do
        (cd "$1" && exec valgrind --tool=callgrind --callgrind-out-file=/dev/null --toggle-collect='*::counted*' \
            "$program" "$run" 2>&1) |
            awk -v run="$run" '/Collected/ { count = $NF } END { if (count > 0) print run, count; else exit 1 }' ||
            { echo "error: nothing was counted of $run" >&2; return 1; }
    done
}

offers=$(grep -m1 '^flags' /proc/cpuinfo 2>/dev/null | tr ' ' '\n' | grep -xE 'avx2|bmi2|fma' | sort | tr '\n' ' ')
here="$(rustc -V), $(rustc -vV | sed -n 's/^host: //p'), ${offers:-no extensions}"
here=${here% }
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
target=${CARGO_TARGET_DIR:-$PWD/target}

count "$PWD" "$target" >"$scratch/now"
if [ "${1:-}" = --update ]; then
    {
        echo "# Instructions of the runs of crates/wave/examples/instructions.rs and crates/rtl/examples/leaping.rs," \
            "by testbench/instructions.sh --update."
        echo "# $here"
        cat "$scratch/now"
    } >"$scratch/record"
    mv "$scratch/record" "$record"
    cat "$record"
    exit
fi

if [ "$(sed -n 2p "$record")" = "# $here" ]; then
    echo "against $record"
    grep -v '^#' "$record" >"$scratch/before"
else
    echo "the record is of another compiler or processor: $(sed -n '2s/^# //p' "$record")"
    echo "this is                                         $here"
    base=$(git log -1 --format=%H -- "$record" 2>/dev/null || true)
    if [ -z "$base" ] || [ "$(git rev-parse --is-shallow-repository)" = true ]; then
        echo "error: its commit is not in this clone; fetch the history, or run testbench/instructions.sh --update" \
            "there and here and commit the record" >&2
        exit 1
    fi
    echo "against commit $base, built and counted here"
    mkdir "$scratch/tree"
    git archive "$base" | tar -x -C "$scratch/tree"
    count "$scratch/tree" "$target/instructions-base" >"$scratch/before"
fi

# Runs on one side only fail as well: a new run wants its record.
awk -v margin="$margin_percent" '
    NR == FNR { before[$1] = $2; next }
    !($1 in before) { printf "%-11s %12s  not on record\n", $1, $2; failed++; next }
    {
        change = 100 * ($2 - before[$1]) / before[$1]
        far = change > margin || change < -margin
        failed += far
        printf "%-11s %12s  %+6.2f %%%s\n", $1, $2, change, far ? "  beyond " margin " %" : ""
        delete before[$1]
    }
    END {
        for (run in before) { printf "%-11s on record, but not run\n", run; failed++ }
        if (failed) print "if this is meant: testbench/instructions.sh --update, and say why in the commit"
        exit failed > 0
    }' "$scratch/before" "$scratch/now"
