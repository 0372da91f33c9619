#!/bin/sh
# How fast scenes run, and how sweeps spread over cores: writes testbench/record/speed.txt.
#
# Wall times of this machine, one run after another, all settings in turn and that RUNS times (7 unless told); of each
# the median. Ratios are of medians of the same turns: they say more than the times do. Nothing else should be running.
# What recording costs is measured by crates/wave/examples/recording.rs, which says what its columns are.
set -eu
cd "$(dirname "$0")/.."
runs=${RUNS:-7}
record=testbench/record/speed.txt
[ -x /usr/bin/time ] || { echo "error: GNU time is missing; install it: sudo apt-get install time" >&2; exit 3; }

cargo build --locked --quiet --release -p hpu
cargo build --locked --quiet --release -p hpu-wave --example recording
hpu=${CARGO_TARGET_DIR:-target}/release/hpu
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

# A line a setting: its name, then what hpu run is given. PWM counters as wide as keep their period near 82 us. The
# first contact is the same motion at every clock, but for a few counts; later on the wheel of hybrid-wall wanders
# between two counts, in another rhythm at each. In friction-wall it rests. The runs of 10 s and more that switch come
# back to a state before their end (hpu run tells when); periods after that are not computed. A row of the trace is of
# 10 kHz unless told.
cat >"$scratch/settings" <<'SETTINGS'
first-contact,10MHz hybrid-wall --set run.duration=400ms --set clock.frequency=10MHz --set method.pwm.bits=10
first-contact,25MHz hybrid-wall --set run.duration=400ms --set clock.frequency=25MHz --set method.pwm.bits=11
first-contact,50MHz hybrid-wall --set run.duration=400ms
first-contact,100MHz hybrid-wall --set run.duration=400ms --set clock.frequency=100MHz --set method.pwm.bits=13
first-contact,200MHz hybrid-wall --set run.duration=400ms --set clock.frequency=200MHz --set method.pwm.bits=14
hybrid-wall,2s hybrid-wall
hybrid-wall,10s hybrid-wall --set run.duration=10s
wandering,averaged hybrid-wall --set model.bridge=averaged --set run.duration=10s
contact,averaged friction-wall --set model.bridge=averaged --set run.duration=10s
contact,1kHz-rows friction-wall --set model.bridge=averaged --set run.duration=10s --set record.plant_rate=1kHz
friction-wall,2s friction-wall
friction-wall,10s friction-wall --set run.duration=10s
friction-wall,60s friction-wall --set run.duration=60s
limit-cycle conventional-wall-1khz
rail-drop rail-drop
phantom-drop phantom-drop
hybrid-wall,by-clock hybrid-wall --driver clock --set run.duration=50ms
friction,by-clock friction-wall --driver clock --set run.duration=50ms
SETTINGS

# Value of a key in what hpu run --json prints.
value() { sed -n "s/^ *\"$1\": \([0-9.e+-]*\),*$/\1/p" "$2" | head -n 1; }
# Median of the numbers on standard input.
median() { sort -g | awk '{ all[NR] = $1 } END { print all[int((NR + 1) / 2)] }'; }

turn=0
while [ "$turn" -lt "$runs" ]; do
    while read -r name arguments; do
        # shellcheck disable=SC2086  # one word an argument
        "$hpu" run --json $arguments >"$scratch/json" || [ $? = 1 ]
        value wall_s "$scratch/json" >>"$scratch/wall,$name"
        for key in edges encoder_edges motion_s; do value "$key" "$scratch/json" >"$scratch/$key,$name"; done
    done <"$scratch/settings"
    turn=$((turn + 1))
done

# Name, edges, encoder edges, seconds of motion, median of the wall time.
while read -r name _; do
    echo "$name" "$(cat "$scratch/edges,$name")" "$(cat "$scratch/encoder_edges,$name")" \
        "$(cat "$scratch/motion_s,$name")" "$(median <"$scratch/wall,$name")"
done <"$scratch/settings" >"$scratch/rows"

# A sweep of costly cells by 1 and 2 threads, over keys of which no criterion has a limit, and one of cheap cells for
# what a cell leaves in memory.
sweep="map hybrid-wall --x hand.stiffness=0.1..3N.m/rad:16:log --y hand.damping=0.01..1mN.m.s/rad:16:log --full"
turn=0
while [ "$turn" -lt "$runs" ]; do
    for jobs in 1 2; do
        # shellcheck disable=SC2086
        /usr/bin/time -o "$scratch/time" -f '%e %U %S' "$hpu" $sweep --jobs "$jobs" >/dev/null
        awk '{ print $1 }' "$scratch/time" >>"$scratch/elapsed,$jobs"
        awk '{ print $2 + $3 }' "$scratch/time" >>"$scratch/busy,$jobs"
    done
    # What the machine itself makes of two cores: the same sweep twice, in processes that know nothing of each other.
    # shellcheck disable=SC2086,SC2016
    /usr/bin/time -o "$scratch/time" -f '%e' sh -c '"$@" & "$@"; wait' two "$hpu" $sweep --jobs 1 >/dev/null
    cat "$scratch/time" >>"$scratch/elapsed,apart"
    turn=$((turn + 1))
done
"${hpu%/hpu}/examples/recording" >"$scratch/recording"
for side in 10 32 100; do
    rm -rf "$scratch/map"
    /usr/bin/time -o "$scratch/time" -f '%M' "$hpu" map free-motion \
        --x "device.coulomb_friction=0.1..10mN.m:$side:log" --y "device.initial_speed=100..300rad/s:$side" \
        --set run.duration=1ms --full --jobs 2 -o "$scratch/map" >/dev/null
    echo "$((side * side))" "$(cat "$scratch/time")" >>"$scratch/memory"
done

{
    echo "Speed, by testbench/speed.sh: medians of $runs runs"
    echo "$("$hpu" --version), $(rustc -V), $(sed -n 's/^model name.*: //p' /proc/cpuinfo | head -n 1), $(nproc) cores"
    echo
    awk '
        BEGIN {
            printf "%-22s %12s %10s %10s %10s %12s %10s\n", "run", "edges", "of encoder", "wall ms", "ms/s", "edges/s",
                "us/of enc."
        }
        {
            printf "%-22s %12s %10s %10.2f %10.3f %12.3g %10.2f\n", $1, $2, $3, 1e3 * $5, 1e3 * $5 / $4, $2 / $5,
                1e6 * $5 / $3
            rate[$1] = $2 / $5
            if ($1 ~ /MHz$/) {
                cost = $5 / $4; event = $5 / $3
                if (!most || cost > most) most = cost
                if (!least || cost < least) least = cost
                if (!dear || event > dear) dear = event
                if (!cheap || event < cheap) cheap = event
            }
        }
        END {
            printf "\ncost of a second of motion, 10 to 200 MHz: dearest over cheapest %.2f\n", most / least
            printf "cost of an encoder edge, over the same: %.2f\n", dear / cheap
            printf "events over clock, in cycles a second: hybrid-wall %.0f (2 s), %.0f (10 s);",
                rate["hybrid-wall,2s"] / rate["hybrid-wall,by-clock"],
                rate["hybrid-wall,10s"] / rate["hybrid-wall,by-clock"]
            printf " friction-wall %.0f (2 s), %.0f (10 s), %.0f (60 s)\n",
                rate["friction-wall,2s"] / rate["friction,by-clock"],
                rate["friction-wall,10s"] / rate["friction,by-clock"],
                rate["friction-wall,60s"] / rate["friction,by-clock"]
        }' "$scratch/rows"
    one=$(median <"$scratch/elapsed,1")
    two=$(median <"$scratch/elapsed,2")
    echo
    echo "a sweep of 256 cells of hybrid-wall: 1 thread $one s, 2 threads $two s:" \
        "$(echo "$one $two" | awk '{ printf "%.1f %%", 50 * $1 / $2 }') of perfect scaling on 2 cores"
    apart=$(median <"$scratch/elapsed,apart")
    echo "the same sweep twice, in two processes side by side: $apart s; of the speed that this leaves to two threads" \
        "they reach $(echo "$apart $two" | awk '{ printf "%.1f %%", 50 * $1 / $2 }')"
    busy=$(median <"$scratch/busy,2")
    echo "processor time of both: $(median <"$scratch/busy,1") s and $busy s; the cores were busy" \
        "$(echo "$busy $two" | awk '{ printf "%.1f %%", 50 * $1 / $2 }') of the time with 2 threads"
    awk '{ printf "a map of %5d cells, tables and pictures written: at most %6d KiB in memory\n", $1, $2 }' \
        "$scratch/memory"
    echo
    cat "$scratch/recording"
} >"$scratch/record"
mv "$scratch/record" "$record"
cat "$record"
