#!/bin/bash
# The scene hybrid-wall in hpu and in the tools that one would take instead, on the same VHDL and with the same plant:
# every register compared, then all of them timed, one after another. Writes record/compare.txt and compare.csv.
# Sources are in compare/. Exit codes: 0 fine, 1 a register differs, 3 a tool is missing.
set -euo pipefail
cd "$(dirname "$0")/.."

packages="g++ ghdl-llvm ghdl-mcode iverilog make python3 python3-venv verilator"
tools="g++ ghdl-llvm ghdl-mcode iverilog make python3 verilator"
cocotb="cocotb==2.1.0"

missing=$(for tool in $tools; do command -v "$tool" >/dev/null || echo "$tool"; done)
if [ -n "$missing" ]; then
    if [ "$(id -u)" != 0 ] || ! command -v apt-get >/dev/null; then
        echo "error: no ${missing//$'\n'/, no }; install and run this again: sudo apt-get install $packages" >&2
        exit 3
    fi
    apt-get update -qq
    # shellcheck disable=SC2086  # one word a package
    DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $packages
fi
venv=${XDG_CACHE_HOME:-$HOME/.cache}/hpu/compare-venv
if ! "$venv/bin/python" -m pip show -q "${cocotb%%=*}" 2>/dev/null; then
    if ! { python3 -m venv --clear "$venv" && "$venv/bin/python" -m pip install -q "$cocotb"; }; then
        echo "error: $cocotb could not be installed from PyPI into $venv, which takes python3-venv too" >&2
        exit 3
    fi
fi

cargo build --locked --release --quiet -p hpu
hpu=$PWD/target/release/hpu
sources=$PWD/testbench/compare
record=$PWD/testbench/record
hdl=$PWD/hdl
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"

# How far each goes. All nets over the first number of edges, the clock over the second.
all=100000000
ghdl_compared=10000000 ghdl_timed=2000000
icarus_compared=10000000 icarus_timed=1000000
cocotb_compared=300000 cocotb_timed=300000

files=()
for block in synchronizer quadrature_decoder position_counter displacement unilateral rounding_pkg \
    truncating_multiplier velocity_register torque_sum command_limiter pwm hybrid_loop; do
    files+=("$hdl/$block.vhd")
done
# What the scene changes of the wiring's defaults.
generics=(-gDAMPING_FRAC=4)
std=(--std=08 -Wno-hide)

echo "building" >&2

# hpu's every change of every net, and the words of the scene.
trace() { # NAME EDGES [ARGUMENT...]: NAME.csv
    "$hpu" run hybrid-wall --edges "$2" --no-plot --vcd -o "$1" "${@:3}" >/dev/null
    awk -v period_ps=20000 -f "$sources/trace.awk" "$1/wave.vcd" >"$1.csv"
}
words_of() { awk -F, 'NR == 2 { print $4, $5, $6, $7, $8 }' "$1.csv"; }
trace hpu $all
read -ra words <<<"$(words_of hpu)"

# GHDL, and from it Verilog: the wiring, and a copy that shows its nets. What GHDL 2.0 gets wrong there is put right as
# in crates/rtl/src/cost/verilog.rs: words of no bits, and an arithmetic shift written as a logical one.
for backend in mcode llvm; do
    mkdir $backend
    g++ -O3 -std=c++17 -ffp-contract=off -shared -fPIC -o $backend/libplant.so "$sources/foreign.cpp"
    (cd $backend && "ghdl-$backend" -a "${std[@]}" "${files[@]}" "$sources/bench.vhd")
done
awk -f "$sources/exposed.awk" "$hdl/hybrid_loop.vhd" "$hdl/hybrid_loop.vhd" >mcode/hybrid_nets.vhd
(cd mcode && ghdl-mcode -a "${std[@]}" hybrid_nets.vhd)
for top in hybrid_loop hybrid_nets; do
    # shellcheck disable=SC2016  # $signed is Verilog's
    (cd mcode && ghdl-mcode --synth "${std[@]}" --out=verilog "${generics[@]}" $top) |
        sed -e "s/{0'b, /{/" -e 's/\(\$signed([^)]*)\) >> /\1 >>> /' >$top.v
done

verilate() { # TOP PROGRAM
    verilator --cc --exe --build -O3 --x-assign fast --noassert -Wno-lint -Wno-fatal --top-module "$1" --Mdir "$2" \
        -MAKEFLAGS "OPT_FAST=-O3 OPT_SLOW=-O3 OPT_GLOBAL=-O3" \
        -CFLAGS "-std=c++17 -O3 -ffp-contract=off -I$sources" -o "$2" "$1.v" "$sources/$2.cpp" >"$2.log" 2>&1 ||
        { cat "$2.log" >&2; return 1; }
}
verilate hybrid_loop time &
verilate hybrid_nets trace
wait $!
g++ -O3 -std=c++17 -ffp-contract=off -shared -fPIC -I/usr/include/iverilog -o plant.vpi "$sources/vpi.cpp"
iverilog -g2005-sv -s bench -o icarus_time hybrid_loop.v "$sources/bench.v"
iverilog -g2005-sv -s bench -DNETS -o icarus_trace hybrid_nets.v "$sources/bench.v"

# The ways to run each.
in_dut() { "$hpu" run "$sources/foreign.toml" --edges "$1"; }
in_verilator() { ./time/time "$1" "${words[@]}"; }
in_ghdl() { # BACKEND EDGES
    (cd "$1" && "ghdl-$1" --elab-run "${std[@]}" bench --ieee-asserts=disable -gEDGES="$2" -gREFERENCE="${words[0]}" \
        -gSTIFFNESS="${words[1]}" -gDAMPING="${words[2]}" -gPERIOD="${words[3]}" -gSCALE="${words[4]}")
}
in_hpu_check() { GHDL_BACKEND=$1 "$hpu" check --scene hybrid-wall --edges "$2" --hdl "$hdl"; }
in_icarus() { # PROGRAM EDGES [ARGUMENT...]
    vvp -n -M. -mplant "$1" +edges="$2" +reference="${words[0]}" +stiffness="${words[1]}" +damping="${words[2]}" \
        +period="${words[3]}" +scale="${words[4]}" "${@:3}"
}
in_cocotb() { # FOLDER EDGES WORDS [nets]: FOLDER/out
    mkdir -p "$1"
    rm -f "$1/out"
    (cd "$1" && GHDL_BACKEND=mcode HPU_EDGES=$2 HPU_WORDS=$3 HPU_OUT=$PWD/out ${4:+env HPU_NETS=1} \
        "$venv/bin/python" "$sources/cocotb_run.py" "${files[@]}") >"$1.log" 2>&1 || { cat "$1.log" >&2; return 1; }
}

# Processor seconds of a command, and of the least of so many runs those that its edges take beyond the first.
cpu_s() {
    local TIMEFORMAT='%U %S' said
    said=$(mktemp -p .)
    { time "$@" >"$said" 2>&1; } 2>&1 | awk '{ printf "%.3f\n", $1 + $2 }' || { cat "$said" >&2; return 1; }
    rm "$said"
}
least() { sort -g | head -n 1; }
cpu_s_of_edges() { # RUNS EDGES COMMAND...: the command takes the edges last
    local first
    first=$(cpu_s "${@:3}" 1)
    for _ in $(seq "$1"); do cpu_s "${@:3}" "$2"; done | least | awk -v first="$first" '{ printf "%.3f\n", $1 - first }'
}

echo "comparing every net" >&2

# The first difference of a trace from hpu's, or "none".
differs() { # HPU_CSV CSV EDGES
    local found
    found=$(awk -v edges="$3" -f "$sources/differ.awk" "$1" "$2")
    echo "${found:-none}"
}
# How many of the encoder's edges fall on another clock than hpu's.
moved() {
    awk -F, 'FNR == 1 { n = 0; pins = "" }
             $1 + 0 > 0 && $2 "," $3 != pins {
                 pins = $2 "," $3; n++; if (NR == FNR) at[n] = $1; else moved += at[n] != $1
             }
             END { print moved + 0, "of", n - 1 }' hpu.csv "$1"
}
# Cocotb does not come as far as the wall; with the wall nearer it does.
trace near $cocotb_compared --set "wall.position=4 mrad"
{
    cpu_s_of_edges 1 $ghdl_compared in_hpu_check mcode >mcode.check_s
    in_cocotb free $cocotb_compared "${words[*]}" nets
    differs hpu.csv free/out $cocotb_compared >free.differs
    in_cocotb near_wall $cocotb_compared "$(words_of near)" nets
    differs near.csv near_wall/out $cocotb_compared >near.differs
} &
{
    cpu_s_of_edges 1 $ghdl_compared in_hpu_check llvm >llvm.check_s
    for world in hpu.csv f64 extended; do
        ./trace/trace $all "${words[@]}" "$world" >verilator.csv
        differs hpu.csv verilator.csv $all >"$world.differs"
        moved verilator.csv >"$world.moved"
    done
    in_icarus icarus_trace $icarus_compared +pins=hpu.csv >icarus.csv
    "$hpu" run hybrid-wall --compare --edges $all >compared.log || { cat compared.log >&2; false; }
    # The ports of the same VHDL as a design of the user's own, against the nets of ours.
    pairs=()
    for port in a_pin b_pin reference stiffness damping period a_high a_low b_high b_low; do
        pairs+=("$port=$port")
    done
    "$hpu" run "$sources/foreign.toml" --compare "${pairs[@]}" --beside hybrid-wall --edges $all >dut.log ||
        { cat dut.log >&2; false; }
    differs hpu.csv icarus.csv $icarus_compared >icarus.differs
}
wait $!

echo "timing" >&2

# A run by events is short: fifty in a row.
by_events() { for _ in {1..50}; do "$hpu" run hybrid-wall --edges "$1"; done; }
by_clock() { "$hpu" run hybrid-wall --driver clock --edges "$1"; }
# By turns, so that what else the machine does meets all of them.
for _ in 1 2 3; do
    cpu_s_of_edges 1 $all by_events | awk '{ print $1 / 50 }' >>events_s.all
    cpu_s_of_edges 1 $all by_clock >>clock_s.all
    cpu_s_of_edges 1 $all in_verilator >>verilator_s.all
    cpu_s_of_edges 1 $all in_dut >>dut_s.all
    seconds() { local TIMEFORMAT=%R; { time "$@" >/dev/null 2>&1; } 2>&1; }
    paste <(seconds in_verilator $all) <(seconds in_dut $all) >>elapsed.all
done
for name in events clock verilator dut; do least <${name}_s.all >${name}_s; done
for backend in mcode llvm; do cpu_s_of_edges 3 $ghdl_timed in_ghdl $backend >$backend.bench_s; done
cpu_s_of_edges 3 $icarus_timed in_icarus icarus_time >icarus_s
for _ in 1 2 3; do in_cocotb timed $cocotb_timed "${words[*]}" && cat timed/out; done | least >cocotb_s

version() { "$@" 2>/dev/null | awk 'NR == 1 && match($0, /[0-9]+(\.[0-9]+)+/) { print substr($0, RSTART, RLENGTH) }'; }
ghdl_version=$(version ghdl-mcode --version)
events_s=$(<events_s)
row() { # TOOL VERSION PLANT EDGES SECONDS COMPARED
    awk -v tool="$1" -v version="$2" -v plant="$3" -v edges="$4" -v s="$5" -v compared="$6" -v events="$all/$events_s" \
        'BEGIN { split(events, e, "/"); rate = edges / s
                 printf "%s,%s,%s,%d,%.4g,%.4g,%.4g,%d\n", tool, version, plant, edges, s, rate, e[1] / e[2] / rate,
                     compared }'
}
hpu_version=$(version "$hpu" --version)
{
    echo "tool,version,plant,edges,cpu_s,edges_per_s,events_faster_by,compared_edges"
    row "hpu events" "$hpu_version" "closed form" $all "$events_s" $all
    row "hpu clock" "$hpu_version" "closed form" $all "$(<clock_s)" $all
    row "Verilator" "$(version verilator --version)" "C++" $all "$(<verilator_s)" $all
    row "hpu run of a [dut]" "$hpu_version" "closed form" $all "$(<dut_s)" $all
    row "GHDL LLVM" "$ghdl_version" "C++ by VHPIDIRECT" $ghdl_timed "$(<llvm.bench_s)" $ghdl_compared
    row "GHDL mcode" "$ghdl_version" "C++ by VHPIDIRECT" $ghdl_timed "$(<mcode.bench_s)" $ghdl_compared
    row "GHDL LLVM in hpu check" "$ghdl_version" "hpu by VHPIDIRECT" $ghdl_compared "$(<llvm.check_s)" $ghdl_compared
    row "GHDL mcode in hpu check" "$ghdl_version" "hpu by VHPIDIRECT" $ghdl_compared "$(<mcode.check_s)" $ghdl_compared
    row "Icarus" "$(version iverilog -V)" "C++ by VPI" $icarus_timed "$(<icarus_s)" $icarus_compared
    row "cocotb on GHDL mcode" "${cocotb##*=}" "Python" $cocotb_timed "$(<cocotb_s)" $cocotb_compared
} >compare.csv
{
    echo "The scene hybrid-wall, switching bridge at 50 MHz, beside the tools that one would take instead"
    echo "\$ testbench/compare.sh"
    echo
    awk -F, '{ printf "%-24s %-8s %-18s %10s %9s %12s %17s %15s\n", $1, $2, $3, $4, $5, $6, $7, $8 }' compare.csv
    slower="The [dut] takes $(awk '{ a += $1; b += $2 } END { printf "%.2f", b / a }' elapsed.all) times as long as"
    slower+=" the loop in Verilator above it, by the clock on the wall: a mean of three by turns."
    rounded="With the plant stepped in double $(<f64.moved) encoder edges fall on another clock than hpu's; in long"
    rounded+=" double, $(<extended.moved)."
    cat <<EOF

Every net, at every edge                                                edges      first difference
hpu events and clock, the plant's states too                            $all  none
hpu run of a [dut] by Verilator, its ports                              $all  none
GHDL LLVM and mcode, closed around hpu's plant                          $ghdl_compared   none
Verilator, hpu's pins replayed                                          $all  $(<hpu.csv.differs)
Verilator, closed around the plant stepped in long double               $all  $(<extended.differs)
Verilator, closed around the plant stepped in double                    $all  $(<f64.differs)
Icarus, hpu's pins replayed                                             $icarus_compared   $(<icarus.differs)
cocotb, closed around the plant stepped in Python's double              $cocotb_compared     $(<free.differs)
cocotb, the same with the wall at 4 mrad, which it reaches              $cocotb_compared     $(<near.differs)

$slower

$rounded

EOF
    cat "$sources/notes.txt"
    echo
    echo "Compilers: $(g++ --version | head -n 1); Python $(version "$venv/bin/python" --version)."
} >compare.txt
mkdir -p "$record"
cp compare.csv compare.txt "$record/"
cat compare.txt
for replayed in hpu.csv icarus free near; do
    [ "$(<$replayed.differs)" = none ] || { echo "error: a register differs" >&2; exit 1; }
done
