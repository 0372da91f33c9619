#!/bin/bash
# What other tools make of hpu: APyTypes of its rounding and overflow, cocotb and VUnit of its vectors, on the VHDL in
# GHDL; what the Python package makes of runs, studies, blocks and plants, against the command; and what polars and
# DuckDB read of a gathered sweep; and what FMPy makes of scenes as units.
# Each is seen to fail on something broken first. Installs what it needs where it may; ends with what agrees. With
# --tools it only does the former.
# Exit codes: 0 all agree, 1 something differs, 3 a tool is missing.
set -euo pipefail
cd "$(dirname "$0")/.."

# shellcheck source=testbench/tools.sh
. testbench/tools.sh

need "ghdl iverilog cc python3" "ghdl-mcode iverilog python3 python3-venv gcc"
venv=$(need_python outside-venv "apytypes==0.5.1 cocotb==2.1.0 vunit_hdl==4.7.1 numpy==2.4.6 polars==2.1.0 \
pandas==3.1.1 duckdb==2.0.1 fmpy==0.3.32")
[ "${1:-}" != --tools ] || exit 0
python=$venv/bin/python

# Of the whole workspace, so that the crates have the features that they have in the tests, and are not built once more.
cargo build --locked --release --quiet --workspace --lib --bin hpu --example narrow
built=$(cd "${CARGO_TARGET_DIR:-target}/release" && pwd)
testbench=$PWD/testbench
hdl=$PWD/hdl
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"

# Vectors of a block without a clock, and of one with; and VHDL with a broken line.
blocks="displacement position_counter"
for block in $blocks; do
    "$built/hpu" vectors "$block" --set-kind random --count 2000 --format json >"$block.json"
done
mkdir broken
sed 's/ - unsigned(/ + unsigned(/' "$hdl/displacement.vhd" >broken/displacement.vhd
if cmp -s "$hdl/displacement.vhd" broken/displacement.vhd; then
    echo "error: the line of displacement.vhd that this script breaks is no more" >&2
    exit 1
fi

differs=0
agrees() { # NAME COMMAND...: its log, if it fails
    if "${@:2}" >"log" 2>&1; then return; fi
    cat log
    echo "$1: differs"
    differs=1
}
fails() { # NAME TEXT COMMAND...: as long as it says so
    if ! "${@:3}" >"log" 2>&1 && grep -q "$2" log; then return; fi
    cat log
    echo "$1: does not see what is broken"
    differs=1
}
cocotb() { "$python" "$testbench/cocotb/run.py" "$1.json" "$2/$1.vhd"; }
vunit() { "$python" "$testbench/vunit/run.py" "$1.json" "$2/$1.vhd" --no-color; }

fails cocotb "row 1: delta expected" cocotb displacement broken
for block in $blocks; do
    agrees "cocotb $block" cocotb "$block" "$hdl"
done
fails VUnit "delta in row 1" vunit displacement broken
for block in $blocks; do
    agrees "VUnit $block" vunit "$block" "$hdl"
done
printf '#!/bin/sh\n"%s" | sed "1000y/01/10/"\n' "$built/examples/narrow" >wrong
chmod +x wrong
fails APyTypes "APyTypes (" "$python" "$testbench/oracle/narrowing.py" ./wrong
agrees APyTypes "$python" "$testbench/oracle/narrowing.py" "$built/examples/narrow"
[ $differs = 0 ] || exit 1
narrowed=$(cat log)

# The package as its wheel has it. Maturin would build the crates once more; long.sh makes the wheel.
mkdir package
cp -r "$testbench/../crates/python/python/hpu" package/
cp "$built/lib_hpu.so" package/hpu/_hpu.abi3.so
package() { # HPU TEST...
    HPU=$1 LIBHPU=$built PYTHONPATH=$work/package:$testbench/../crates/python/tests "$python" -B -m unittest "${@:2}"
}
printf '#!/bin/sh\n"%s" "$@" | sed "s/edges.: /&1/"\n' "$built/hpu" >wrong
fails "Python package" "AssertionError" package "$work/wrong" test_run.Runs.test_overrides_are_those_of_set
agrees "Python package" package "$built/hpu" \
    test_block test_cocotb test_command test_notebook test_plant test_readme test_run test_stubs test_studies
[ $differs = 0 ] || exit 1
packaged=$(cat log)

# The project for users of VUnit, around the plant in C; it fails where the hand never comes to the wall.
mkdir -p vunit/crates/capi
ln -s "$hdl" vunit/hdl
ln -s "$testbench/../crates/capi/simulators" vunit/crates/capi/simulators
cp -r "$testbench/../crates/capi/examples" vunit/crates/capi/
cc -O2 -shared -fPIC -I"$testbench/../crates/capi/include" -o libhpu_sim.so \
    "$testbench/../crates/capi/simulators/hpu_sim.c" -L"$built" -lhpu
walls() { (cd vunit && LD_LIBRARY_PATH=$work:$built "$python" crates/capi/examples/vunit/run.py --no-color); }
agrees "VUnit around a plant" walls
sed -i 's/0.0016 rad/1 rad/' vunit/crates/capi/examples/vunit/tb_wall.vhd
fails "VUnit around a plant" "the wall is not reached" walls
[ $differs = 0 ] || exit 1

# Units of FMI in FMPy, against libhpu; it sees a library that is not whole.
head -c 40 "$built/libhpu.so" >wrong
fails FMPy "file too short" "$python" "$testbench/oracle/fmu.py" "$built/hpu" "$PWD/wrong"
agrees FMPy "$python" "$testbench/oracle/fmu.py" "$built/hpu" "$built/libhpu.so"
[ $differs = 0 ] || exit 1
units=$(tail -n 1 log)

# A gathered sweep, read by polars and by DuckDB: as many settled cells as in the CSV.
"$built/hpu" --quiet sweep run "$testbench/studies/example.toml" --section map -o sweep >sweep.log
settled=$(grep -c '^[0-9]*,made,.*,settled,' sweep/gathered.csv)
reads() { # READER
    "$python" "$1" sweep | tee read | awk -v wanted="$settled" '{ n += $(NF - 1) }
        END { if (n != wanted) { print "settled: " n; exit 1 } }'
}
for reader in polars duckdb; do
    example=$testbench/../crates/python/examples/sweep/by_$reader.py
    sed "s/'settled'/'diverged'/; s/\"settled\")/\"diverged\")/" "$example" >wrong.py
    fails $reader "settled: " reads wrong.py
    agrees $reader reads "$example"
    mv read "by-$reader"
done
agrees "polars and DuckDB" cmp by-polars by-duckdb
[ $differs = 0 ] || exit 1
echo "$narrowed"
grep -o -e "hpu.run beyond .*" -e "cocotb .*a second.*" <<<"$packaged"
echo "Python package: $(sed -n 's/^Ran \([0-9]* tests\).*/\1/p' <<<"$packaged") agree with the command"
echo "cocotb: 2 blocks agree, 2000 rows each; VUnit: the same"
echo "FMPy: $units"
echo "polars and DuckDB: $settled settled cells of a gathered sweep each"
