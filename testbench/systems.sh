#!/bin/bash
# hpu on other systems than x86-64 Linux: builds the command, the library and the program of hashes for Windows (under
# Wine) and for aarch64 Linux (under QEMU), runs them, and holds what they compute and write against this system, to the
# bit. For macOS, and for Windows by Microsoft's linker, the sources are only checked: nothing here links or runs those.
# Writes testbench/record/systems.txt.
# Usage: testbench/systems.sh [--update]: --update first writes testbench/record/hashes.txt by this system's build.
# Exit codes: 0 all is the same, 1 something differs or does not build, 3 a tool is missing.
set -euo pipefail
cd "$(dirname "$0")/.."
# shellcheck source=testbench/tools.sh
. testbench/tools.sh
root=$PWD
record=$root/testbench/record/systems.txt
hashes=$root/testbench/record/hashes.txt
target=${CARGO_TARGET_DIR:-$root/target}
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

need "x86_64-w64-mingw32-gcc wine aarch64-linux-gnu-gcc qemu-aarch64" \
    "gcc-mingw-w64-x86-64 wine wine64 gcc-aarch64-linux-gnu libc6-dev-arm64-cross qemu-user"
windows=x86_64-pc-windows-gnu
arm=aarch64-unknown-linux-gnu
checked="aarch64-apple-darwin x86_64-apple-darwin x86_64-pc-windows-msvc"
# shellcheck disable=SC2086  # one word a target
rustup --quiet target add $windows $arm $checked 2>/dev/null ||
    { echo "error: rustup is missing, or has not the standard library of $windows $arm $checked" >&2 && exit 3; }
export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER=aarch64-linux-gnu-gcc

failed=0
{
    echo "hpu on other systems, by testbench/systems.sh"
    echo "$(rustc -V); $(wine --version 2>/dev/null); $(qemu-aarch64 --version | head -n 1)"
    echo
} >"$scratch/record"
# Notes a line of the record; the second word is its result.
# note WHAT RESULT
note() {
    printf '%-58s %s\n' "$1" "$2" | tee -a "$scratch/record"
    [ "$2" != differs ] && [ "$2" != fails ] || failed=1
}

# This system.
cargo build --locked --release --quiet --workspace --lib --bins --example bits
"$target/release/examples/bits" >"$scratch/bits"
[ "${1:-}" != --update ] || cp "$scratch/bits" "$hashes"
scenes=$(grep -vc '^#' "$hashes")
if cmp -s "$scratch/bits" "$hashes"; then same="$scenes scenes, the same"; else same=differs; fi
note "x86-64 Linux: hashes against record/hashes.txt" "$same"

# Debian's Wine lacks a library of Windows 10 that Rust's standard library takes random numbers from.
mkdir "$scratch/wine" "$scratch/prefix"
cat >"$scratch/random.c" <<'C'
#include <windows.h>
BOOLEAN WINAPI SystemFunction036(PVOID bytes, ULONG length);
__declspec(dllexport) BOOL WINAPI ProcessPrng(PBYTE bytes, SIZE_T length) { return SystemFunction036(bytes, length); }
C
x86_64-w64-mingw32-gcc -shared -o "$scratch/wine/bcryptprimitives.dll" "$scratch/random.c" -ladvapi32
export WINEPREFIX=$scratch/prefix WINEDEBUG=-all

# Runs a command, and says its exit code if there is one.
hpu() {
    echo "== hpu $*"
    "${program[@]}" --quiet "$@" || echo "code $?"
}

# The commands whose files, standard output and exit codes are compared.
commands() {
    hpu run hybrid-wall -o run
    hpu run phantom-drop --vcd --parquet --no-plot -o drop
    hpu run gimbal-texture --set "run.duration=100 ms" -o gimbal
    hpu run replay-motion -o replay
    hpu limits hybrid-wall
    hpu map hybrid-wall --x "wall.stiffness=0.1..4:6" --y "wall.damping=0..0.4 mN.m.s/rad:4" -o map
    hpu widths hybrid-wall -o widths
    hpu vectors pwm --count 500 -o vectors
    hpu report hybrid-wall -o report.html
    hpu keys --markdown
    hpu scenes show hybrid-wall
    hpu export fmu hybrid-wall --library "$scratch/libhpu.so" --library "$scratch/hpu.dll" -o x.fmu
}

# A command that starts itself for each shard. QEMU runs one program, and none that the program starts.
sweep() {
    hpu sweep run sweep.toml -o sweep --shard-points 2
}

cat >"$scratch/sweep.toml" <<'TOML'
name = "corner"
title = "A corner of a map"

[map]
scene = "hybrid-wall"
x = "wall.stiffness=1..2:3"
y = "wall.damping=0..0.1 mN.m.s/rad:2"
full = true
set = ["run.duration=100 ms"]
TOML

# Removes what may differ: times of the run, the program's build, and the separators in the names of files.
# plain FOLDER
plain() {
    find "$1" \( -name journal.txt -o -name 'manifest-*.json' -o -name '*.parquet' \) -delete
    find "$1" -type f \( -name '*.json' -o -name '*.html' -o -name said \) -print0 | xargs -0 sed -i -E \
        -e '/"(wall_s|edges_per_s|seconds)":/d; /<dt>(hpu|edges)</d; /^(edges|file|SHA-256)  |^wrote /d' \
        -e '/^    "[a-z]+\\\\/s:\\\\:/:g' -e 's:^([a-z]+)\\:\1/:' -e 's/ in [0-9.]+ [mu]?s$//'
}

# Builds for a system, runs its programs, and compares.
# system NAME TARGET SUFFIX RUNNER...
system() {
    local name=$1 triple=$2 suffix=$3 folder=$target/$2/release
    shift 3
    cargo build --locked --release --quiet --target "$triple" -p hpu -p hpu-capi -p hpu-cosim --lib --bins \
        --example bits || { note "$name: builds" fails && return; }
    note "$name: builds the command, libhpu and the hashes" yes
    cp "$folder/hpu$suffix" "$folder/examples/bits$suffix" "$scratch/wine"
    "$@" "$scratch/wine/bits$suffix" >"$scratch/$triple" || true
    if cmp -s "$scratch/$triple" "$hashes"; then same="$scenes scenes, the same"; else same=differs; fi
    diff "$hashes" "$scratch/$triple" | sed -n 's/^> \([^ ]*\).*/  other bits: \1/p' || true
    note "$name: hashes against record/hashes.txt" "$same"
}

# Runs the commands, or the sweep, in a folder of their own, by a program.
# ran WHAT FOLDER PROGRAM...
ran() {
    local what=$1 folder=$scratch/$1-$2
    shift 2
    program=("$@")
    mkdir "$folder"
    cp "$scratch/sweep.toml" "$folder"
    (cd "$folder" && "$what" >said 2>errors)
    if grep "^code " "$folder/said"; then cat "$folder/errors"; fi
    rm "$folder/errors"
    plain "$folder"
}

# Compares the files of the commands, or of the sweep, with this system's.
# compared NAME WHAT FOLDER
compared() {
    local files count
    files=$(find "$scratch/$2-$3" -type f | wc -l)
    count=$(grep -c '^== hpu' "$scratch/$2-here/said")
    if diff -rq "$scratch/$2-here" "$scratch/$2-$3"; then
        note "$1: $2 of hpu ($count)" "$files files, the same"
    else
        note "$1: $2 of hpu ($count)" differs
    fi
}

system "x86-64 Windows" $windows .exe wine
cp "$target/$windows/release/hpu.dll" "$target/release/libhpu.so" "$scratch"
for what in commands sweep; do
    ran $what here "$target/release/hpu"
    ran $what windows wine "$scratch/wine/hpu.exe"
    compared "x86-64 Windows" $what windows
done

# What is refused there.
# refused CODE TEXT ARGUMENT...
refused() {
    local code=$1 text=$2 found=0
    shift 2
    wine "$scratch/wine/hpu.exe" "$@" >"$scratch/refused" 2>&1 || found=$?
    [ "$found" = "$code" ] && grep -qF -- "$text" "$scratch/refused" && return
    echo "hpu $*: $found, not $code with: $text" && cat "$scratch/refused" && return 1
}
none="hpu starts simulators, synthesis and solvers on Linux and macOS, and none on Windows"
sed 's/replay-motion.csv/\\\\\\\\host\\\\share\\\\motion.csv/' testbench/scenes/replay-motion.toml >"$scratch/host.toml"
sed 's/replay-motion.csv/NUL/' testbench/scenes/replay-motion.toml >"$scratch/device.toml"
elsewhere="not on a disk of this machine"
if refused 3 "$none" check saturator && refused 3 "$none" run hybrid-wall --driver rtl --edges 100 &&
    refused 3 "$none" run testbench/dut/knee.toml && refused 3 "$none" cost saturator &&
    refused 4 "$elsewhere" run "$scratch/host.toml" && refused 4 "$elsewhere" run "$scratch/device.toml" &&
    refused 2 "a plain name" new con; then
    note "x86-64 Windows: tools, devices and other machines" "refused, each with its reason"
else
    note "x86-64 Windows: refusals" fails
fi

system "aarch64 Linux" $arm "" qemu-aarch64 -L /usr/aarch64-linux-gnu
ran commands arm qemu-aarch64 -L /usr/aarch64-linux-gnu "$scratch/wine/hpu"
compared "aarch64 Linux" commands arm

# A linker that links nothing, for the library that hpu-vhpi compiles while it is built.
cat >"$scratch/linker" <<'SH'
#!/bin/sh
while [ $# -gt 0 ]; do [ "$1" != -o ] || : >"$2"; shift; done
SH
chmod +x "$scratch/linker"
for triple in $checked; do
    linker=CARGO_TARGET_$(echo "$triple" | tr a-z- A-Z_)_LINKER
    if env "$linker=$scratch/linker" CARGO_TARGET_DIR="$target/check" \
        cargo check --locked --profile quick --quiet --target "$triple" -p hpu -p hpu-capi; then
        note "$triple: sources of the command and libhpu" "compile; not linked, not run"
    else
        note "$triple: sources of the command and libhpu" fails
    fi
done
[ $failed = 0 ] || exit 1
cp "$scratch/record" "$record"
