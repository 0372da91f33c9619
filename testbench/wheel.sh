#!/bin/bash
# Makes the wheel that a release has: module and command, the explorer's page, and on x86-64 Linux the library of units
# of FMI. For Linux, zig links it for glibc 2.17 (manylinux2014).
# For this machine, it is then installed where no Rust is found. Module, command, page and unit are tried, the files of
# a run and the page are held against those of the release, and the notebook is run once more.
# Usage: testbench/wheel.sh [OUT [TARGET]]: the folder of the wheel [dist], one of Rust's targets [this machine's];
# --update before them writes the record and the notebook's outputs.
# HPU=FILE is the command to hold it against [the release, which is built]. SLACK=N allows N times 30 s for
# installation, import and first run.
# Exit codes: 0 made, and all agrees; 1 or 101 it could not be made, or differs; 3 a tool is missing.
set -euo pipefail
cd "$(dirname "$0")/.."

# shellcheck source=testbench/tools.sh
. testbench/tools.sh

update=
if [ "${1:-}" = --update ]; then
    update=yes
    shift
fi
mkdir -p "${1:-dist}"
dist=$(cd "${1:-dist}" && pwd)
own=$(rustc -vV | sed -n 's/^host: //p')
target=${2:-$own}
work=$(mktemp -d)
package=crates/python/python/hpu
trap 'rm -rf "$work"; rm -f crates/cli/explorer.html crates/python/LICENSE-* "$package"/libhpu.*' EXIT

need python3 "python3 python3-venv"
builder=$(need_python wheel-venv "$WHEEL_TOOLS")
PATH=$(bin_of "$builder"):$PATH

# The page, and the copies of the licences that the wheel has, are in no commit.
cp LICENSE-MIT LICENSE-APACHE crates/python
testbench/explorer.sh
cp "${CARGO_TARGET_DIR:-target}/explorer.html" crates/cli/explorer.html
linux=()
case $target in
*-linux-*) linux=(--zig --compatibility manylinux2014) ;;
esac
# The library of units is built with the extension, and packed by a second call. Units have no library but this.
make_wheel() {
    rm -rf "$work/wheel"
    maturin build --quiet --release --locked --manifest-path crates/python/Cargo.toml --features explorer \
        --target "$target" ${linux[@]+"${linux[@]}"} -o "$work/wheel" >&2
}
make_wheel
if [ "$target" = x86_64-unknown-linux-gnu ]; then
    cp "${CARGO_TARGET_DIR:-target}/$target/release/deps/libhpu.so" "$package"
    make_wheel
fi
made=$(echo "$work"/wheel/*.whl)
cp "$made" "$dist"
wheel=$dist/$(basename "$made")
bytes=$(wc -c <"$wheel")
echo "$(basename "$wheel"): $((bytes / 1000)) kB"
[ "$bytes" -le 25000000 ] || { echo "error: a wheel has at most 25 MB" >&2 && exit 1; }
[ "$target" = "$own" ] || exit 0

# As on a machine without Rust: of all programs, only those of a fresh environment are found.
mkdir "$work/there"
python3 -m venv "$work/venv"
venv=$(bin_of "$work/venv")
there() { (cd "$work/there" && env -i HOME="$work" SYSTEMROOT="${SYSTEMROOT:-}" PATH="$venv" "$@"); }
now() { python3 -c "import time; print(time.time())"; }
there "$venv/python" -c "import shutil; assert not shutil.which('cargo') and not shutil.which('rustc')"
begun=$(now)
there "$venv/pip" install --quiet --disable-pip-version-check "$wheel"
installed=$(now)
there "$venv/python" -c "import hpu; hpu.Block('pwm')"
there "$venv/hpu" --quiet run hybrid-wall -o out >"$work/said" 2>&1
ended=$(now)
seconds() { awk -v a="$1" -v b="$2" 'BEGIN { printf "%.1f", b - a }'; }
times="installed in $(seconds "$begun" "$installed") s with NumPy, imported and hybrid-wall run in"
times="$times $(seconds "$installed" "$ended") s"
echo "$times"
awk -v s="$(seconds "$begun" "$ended")" -v most=$((30 * ${SLACK:-1})) 'BEGIN { exit s > most }' ||
    { echo "error: it takes more than $((30 * ${SLACK:-1})) s" >&2 && exit 1; }

# The command of the release writes the same files, but for the times of the runs.
if [ -z "${HPU:-}" ]; then
    # Of the whole workspace, so that the crates have the features that they have in the tests.
    cargo build --locked --release --quiet --workspace --lib --bin hpu
    HPU=$(cd "${CARGO_TARGET_DIR:-target}/release" && pwd)/hpu
fi
mkdir "$work/released"
(cd "$work/released" && "$HPU" --quiet run hybrid-wall -o out >/dev/null)
sed -i.times '/"wall_s":/d; /"edges_per_s":/d' "$work"/{there,released}/out/summary.json
rm "$work"/{there,released}/out/summary.json.times
diff -r "$work/released/out" "$work/there/out"
files=$(find "$work/there/out" -type f | wc -l)

# The page that the wheel carries is the one that was made, with a scene to begin with.
there "$venv/hpu" explore hybrid-wall -o page.html >/dev/null
(cd "$work/released" && "$HPU" explore hybrid-wall -o page.html --page "$OLDPWD/crates/cli/explorer.html" >/dev/null)
cmp "$work/there/page.html" "$work/released/page.html"
agree="$files files of a run, and the page of the explorer, are those of the release"
echo "$agree"

# Exit codes, and an interrupt.
there "$venv/hpu" run no-such-scene >/dev/null 2>&1 && code=0 || code=$?
[ "$code" = 4 ] || { echo "error: a scene that does not exist ends with $code" >&2 && exit 1; }
there "$venv/python" - "$venv/hpu" <<'PY'
import os, signal, subprocess, sys, time

if os.name == "posix":
    # A hand that has a plan to the end: without one the motion repeats, and the rest is over at once.
    hand = 'hand.path=[["0 s", 0], ["150 ms", 1.4], ["250 ms", 1.9], ["100000 s", 1.8]]'
    words = ["--quiet", "run", "hybrid-wall", "--set", "run.duration=100000 s", "--set", hand]
    run = subprocess.Popen([sys.argv[1], *words], stdout=subprocess.DEVNULL)
    time.sleep(3)
    run.send_signal(signal.SIGINT)
    assert run.wait(timeout=10) == 130, run.returncode
PY

# Units with the wheel's library, in FMPy.
units=
if [ "$target" = x86_64-unknown-linux-gnu ]; then
    auditwheel show "$wheel" | tr '\n' ' ' | grep -q 'constrains the platform tag to "manylinux_2_17_x86_64"' ||
        { auditwheel show "$wheel" && exit 1; }
    fmpy=$(need_python fmpy-venv "fmpy==0.3.32")
    library=$(there "$venv/python" -c "import hpu, pathlib; print(pathlib.Path(hpu.__file__).with_name('libhpu.so'))")
    units=$("$(bin_of "$fmpy")/python" testbench/oracle/fmu.py "$venv/hpu" "$library" | tail -n 1)
    echo "FMPy: $units"
fi

# The notebook, whose outputs are in the repository.
"$venv/pip" install --quiet --disable-pip-version-check nbclient==0.11.0 ipykernel==7.4.0 pillow==13.0.0
"$venv/python" testbench/notebook.py ${update:+--update} crates/python/examples/stable.ipynb

if [ -n "$update" ]; then
    {
        echo "# testbench/wheel.sh: $(rustc -V), $(nproc) cores, commit $(git rev-parse --short HEAD)"
        echo "# seconds of wall time, other work on the machine and the download of NumPy included"
        echo "$(basename "$wheel"): $((bytes / 1000)) kB"
        echo "$times"
        echo "$agree"
        echo "FMPy: $units"
    } >testbench/record/wheel.txt
fi
