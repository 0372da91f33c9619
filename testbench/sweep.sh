#!/bin/bash
# Sweeps on farms: the same points by the engine of one machine, by Slurm and by GNU parallel, and with kills at random
# instants; the gathered files must be the same to the byte. Writes testbench/record/sweep.txt; with --kills it does the
# kills alone, of every part of `hpu sweep submit` and of GNU parallel too, and writes testbench/record/kills.txt.
#
# Starts a slurmctld and two slurmd of one core each on this host, with their own munged, and stops them. Installs what
# it needs where it may. SEED (1 unless told) gives the instants of the kills, KILLS (10) how many each victim gets. HPU
# names the program; without it a release build is made.
# Exit codes: 0 all is the same, 1 something differs, 3 a tool is missing.
set -euo pipefail
cd "$(dirname "$0")/.."
root=$PWD
RANDOM=${SEED:-1}
kills=${KILLS:-10}
only_kills=
[ "${1:-}" != --kills ] || only_kills=yes
record=$PWD/testbench/record/sweep.txt
[ -z "$only_kills" ] || record=$PWD/testbench/record/kills.txt

packages="slurm-wlm munge parallel time verilator"
export PATH=$PATH:/usr/sbin
if ! {
    command -v slurmctld && command -v slurmd && command -v munged && command -v parallel && command -v verilator &&
        [ -x /usr/bin/time ]
} >/dev/null; then
    if [ "$(id -u)" != 0 ] || ! command -v apt-get >/dev/null; then
        echo "error: Slurm, munge, GNU parallel, Verilator or GNU time is missing; install and run this again:" \
            "sudo apt-get install $packages" >&2
        exit 3
    fi
    apt-get update -qq
    # shellcheck disable=SC2086  # one word a package
    DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $packages
fi
[ -n "${HPU:-}" ] || cargo build --locked --release --quiet -p hpu
work=$(mktemp -d)
# A copy: a sweep is bound to the build that planned it.
cp "${HPU:-${CARGO_TARGET_DIR:-target}/release/hpu}" "$work/hpu"
hpu=$work/hpu
cd "$work"

# The farm. Its daemons run as this user, and listen on ports of their own.
host=$(hostname)
user=$(id -un)
mkdir state spool-n1 spool-n2 munge
chmod 700 munge
dd if=/dev/urandom of=munge/key bs=1024 count=1 status=none
chmod 400 munge/key
cat >slurm.conf <<CONF
ClusterName=hpu
SlurmctldHost=$host
SlurmUser=$user
SlurmdUser=$user
AuthType=auth/munge
AuthInfo=socket=$work/munge/socket
CredType=cred/munge
SlurmctldPort=26817
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool-%n
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd-%n.pid
SlurmctldLogFile=$work/slurmctld.log
SlurmdLogFile=$work/slurmd-%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
SwitchType=switch/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerParameters=batch_sched_delay=0,sched_min_interval=100000,sched_interval=2
SlurmdParameters=config_overrides
SlurmdTimeout=20
ReturnToService=2
JobRequeue=1
MaxArraySize=64
NodeName=n1 NodeHostname=$host Port=27001 CPUs=1
NodeName=n2 NodeHostname=$host Port=27002 CPUs=1
PartitionName=all Nodes=n1,n2 Default=YES MaxTime=INFINITE State=UP
CONF
export SLURM_CONF=$work/slurm.conf
declare -A pids=()
start() { # munged | slurmctld | n1 | n2, in the foreground of a job of this shell, so that its number is known
    case $1 in
        munged)
            munged --foreground --force --key-file=munge/key --socket=munge/socket --pid-file=munge/pid \
                --log-file=munge/log --seed-file=munge/seed >munge/out 2>&1 &
            ;;
        slurmctld) slurmctld -D >>slurmctld.out 2>&1 & ;;
        *) slurmd -D -N "$1" >>"slurmd-$1.out" 2>&1 & ;;
    esac
    pids[$1]=$!
}
stop() {
    scancel --user="$user" >/dev/null 2>&1 || true
    # Without the numbers, `wait` would wait for tee too, which ends with this shell.
    for name in n1 n2 slurmctld munged; do
        [ -n "${pids[$name]:-}" ] || continue
        kill "${pids[$name]}" 2>/dev/null || true
        wait "${pids[$name]}" 2>/dev/null || true
    done
    rm -rf "$work"
}
trap stop EXIT
start munged
until [ -S munge/socket ]; do sleep 0.1; done
start slurmctld
start n1
start n2
for _ in $(seq 300); do
    [ "$(sinfo --noheader --format=%D --states=idle 2>/dev/null)" = 2 ] && break
    sleep 0.2
done
if [ "$(sinfo --noheader --format=%D --states=idle)" != 2 ]; then
    echo "error: the farm does not start:" >&2
    tail -n 5 slurmctld.out slurmd-n1.out >&2
    exit 3
fi

# 10 000 cells of a map without a refinement, a map that is refined at a boundary, and a search over widths.
cat >map.toml <<'STUDY'
name = "map"
title = "10 000 cells"

[map]
scene = "free-motion"
x = "device.coulomb_friction=0.1..10 mN.m:100:log"
y = "device.initial_speed=100..300 rad/s:100"
set = "run.duration=20 ms"
full = true
STUDY
cat >waves.toml <<'STUDY'
name = "waves"
title = "A boundary"

[map]
scene = "hybrid-wall"
x = "wall.stiffness=0.5..6 N.m/rad:41"
y = "wall.damping=0..0.4 mN.m.s/rad:41"
set = ["run.duration=150 ms", "device.initial_angle=1.4 rad", 'hand.path=[["0 s", 1.4], ["20 ms", 1.8]]']
STUDY
cat >search.toml <<'STUDY'
name = "search"
title = "A search over two widths"

[widths]
scenes = "hybrid-wall"
search = true
vary = ["position_bits=11..12", "velocity_bits=9..10"]
STUDY

quiet() { "$hpu" --quiet "$@" >/dev/null; }
now() { date +%s.%N; }
since() { echo "$1 $(now)" | awk '{ printf "%.1f", $2 - $1 }'; }
queued() { # as soon as slurmctld answers
    local jobs
    until jobs=$(squeue --noheader --user="$user" --format=%i 2>/dev/null); do sleep 0.2; done
    wc -w <<<"$jobs"
}
done_shards() { find "$1" -name '*.parquet' | wc -l; }
# Waits until a sweep is complete and gathered, and submits what is left as often as it takes. A Slurm whose slurmctld
# was killed may take ended jobs for running ones: jobs under which nothing is done for 20 s are cancelled.
submissions=0
by_slurm() { # DIR
    local before=-1 still=0
    while :; do
        if "$hpu" --quiet sweep status "$1" --json | grep -q '"complete": true'; then
            # The next wave may be planned at this moment; the turn after this one sees it.
            if quiet sweep gather "$1" && "$hpu" --quiet sweep plan "$1" | grep -q 'no wave is left'; then
                quiet sweep submit "$1" --engine slurm --cancel
                while [ "$(queued)" != 0 ]; do sleep 0.3; done
                return
            fi
        fi
        if [ "$(queued)" = 0 ] || [ $still -gt 100 ]; then
            quiet sweep submit "$1" --engine slurm --cancel
            # A slurmctld that lost its last seconds gives the numbers of jobs twice, and drains the nodes that know
            # them.
            scontrol update nodename=n1,n2 state=resume 2>/dev/null || true
            quiet sweep submit "$1" --engine slurm
            submissions=$((submissions + 1))
            still=0
        fi
        sleep 0.2
        if [ "$(done_shards "$1")" = "$before" ]; then still=$((still + 1)); else still=0; fi
        before=$(done_shards "$1")
    done
}
differs=0
same() { # NAME DIR REFERENCE
    if cmp -s "$2/gathered.parquet" "$3/gathered.parquet"; then
        echo "$1: the same bytes"
    else
        echo "$1: differs"
        differs=1
    fi
}
shards="--shard-points 200"

exec > >(tee "$work/record")
echo "Sweeps, by testbench/sweep.sh${only_kills:+ --kills}: seed ${SEED:-1}, $kills kills of each"
echo "$("$hpu" --version), $(sinfo --version 2>/dev/null | head -n 1), $(parallel --version | head -n 1)," \
    "$(sed -n 's/^model name.*: //p' /proc/cpuinfo | head -n 1), $(nproc) cores," \
    "load $(cut -d ' ' -f 1 /proc/loadavg) at the start"
echo
# One machine, against the map that knows nothing of shards.
for study in map waves search; do
    begin=$(now)
    # shellcheck disable=SC2086
    quiet sweep run $study.toml -o local-$study $shards --jobs 2
    echo "$study, one machine:" \
        "$("$hpu" --quiet sweep gather local-$study --json | sed -n 's/.*"rows": \([0-9]*\).*/\1/p')" \
        "points, waves: $("$hpu" --quiet sweep status local-$study --json | grep -c '"wave":'), $(since "$begin") s"
done
engines() {
    quiet map free-motion --x 'device.coulomb_friction=0.1..10 mN.m:100:log' \
        --y 'device.initial_speed=100..300 rad/s:100' --set 'run.duration=20 ms' --full -o whole
    quiet map --from local-map -o drawn
    rows() { grep -v '^#' "$1/map.csv"; }
    if cmp -s <(rows whole) <(rows drawn); then
        echo "hpu map --from: the rows of hpu map"
    else
        echo "hpu map --from: differs from hpu map"
        differs=1
    fi
    # The other engines, each with other shards.
    for study in map waves search; do
        begin=$(now)
        quiet sweep plan $study.toml -o parallel-$study --shard-points 333
        quiet sweep submit parallel-$study --engine parallel --limit 2
        quiet sweep gather parallel-$study
        same "$study, GNU parallel, $(since "$begin") s" parallel-$study local-$study
        begin=$(now)
        quiet sweep plan $study.toml -o slurm-$study --shard-points 500
        quiet sweep submit slurm-$study --engine slurm
        by_slurm slurm-$study
        same "$study, Slurm, $(since "$begin") s" slurm-$study local-$study
    done
}
[ -n "$only_kills" ] || engines

# Kills. Of a shard's process half of them as its file is being written; of others at any instant.
pause() { sleep "$(awk -v r=$RANDOM -v most="$1" 'BEGIN { printf "%.3f", most * r / 32768 }')"; }
children() { pgrep -f "^$hpu --quiet sweep shard $work/$1 " || true; }
for victim in shard slurmd slurmctld submitter; do
    submissions=0
    dir=kill-$victim
    quiet sweep plan map.toml -o "$dir" --shard-points 100
    [ $victim = submitter ] || quiet sweep submit "$dir" --engine slurm
    killed=0
    while [ $killed -lt "$kills" ]; do
        pause 1.5
        if [ "$(queued)" = 0 ] && [ $victim != submitter ]; then
            # All is done: shards are taken away, so that there is something to kill.
            find "$dir" -name '*.parquet' | sort | head -n 60 | xargs -r rm -f
            quiet sweep submit "$dir" --engine slurm || true
            sleep 1
        fi
        case $victim in
            shard)
                if [ $((RANDOM % 2)) = 0 ]; then
                    for _ in $(seq 200000); do compgen -G "$dir/shards-1/.*.tmp" >/dev/null && break; done
                fi
                pid=$(children "$dir" | head -n 1)
                [ -n "$pid" ] && kill -9 "$pid" 2>/dev/null || continue
                ;;
            slurmd)
                node=n$((RANDOM % 2 + 1))
                kill -9 "${pids[$node]}"
                wait "${pids[$node]}" 2>/dev/null || true
                pause 1
                start $node
                ;;
            slurmctld)
                kill -9 "${pids[slurmctld]}"
                wait "${pids[slurmctld]}" 2>/dev/null || true
                pause 1
                start slurmctld
                ;;
            submitter)
                "$hpu" --quiet sweep submit "$dir" --engine slurm >/dev/null 2>&1 &
                pid=$!
                pause 0.1
                kill -9 $pid 2>/dev/null || true
                wait $pid 2>/dev/null || true
                ;;
        esac
        killed=$((killed + 1))
    done
    by_slurm "$dir"
    quiet sweep gather "$dir"
    same "$killed kills of a $victim, $submissions submissions afterwards" "$dir" local-map
    poison=$(grep -c poison "$dir/gathered.csv" || true)
    [ "$poison" = 0 ] || { echo "a healthy point was taken for poison"; differs=1; }
done
# Kills of the jobs that follow an array: nobody submits again, as a stand-in goes on.
killed=0
chains=0
while [ $killed -lt "$kills" ]; do
    chains=$((chains + 1))
    dir=kill-follower-$chains
    quiet sweep plan waves.toml -o "$dir" --shard-points 60
    quiet sweep submit "$dir" --engine slurm
    while [ "$(queued)" != 0 ]; do
        for pid in $(pgrep -f "^$hpu --quiet sweep submit $work/$dir " || true); do
            grep -qz 'SLURM_JOB_NAME=.*-follower$' "/proc/$pid/environ" 2>/dev/null || continue
            pause 0.2
            kill -9 "$pid" 2>/dev/null && killed=$((killed + 1))
        done
    done
    same "$killed kills of a job that follows, no submission afterwards" "$dir" local-waves
done
rm -f kill-shard/gathered.*
killed=0
while [ $killed -lt "$kills" ]; do
    "$hpu" --quiet sweep gather kill-shard >/dev/null 2>&1 &
    pid=$!
    pause 0.2
    kill -9 $pid 2>/dev/null || true
    wait $pid 2>/dev/null || true
    # A file that is there is whole.
    [ ! -e kill-shard/gathered.parquet ] || cmp -s kill-shard/gathered.parquet local-map/gathered.parquet || differs=1
    killed=$((killed + 1))
done
quiet sweep gather kill-shard
same "$killed kills of a gather" kill-shard local-map

# Kills of `hpu sweep submit` with GNU parallel, whose jobs end with it. A job that goes on would hold the lock of its
# shard, or die of the file that is taken away.
living() { pgrep -f "^$hpu --quiet sweep (task|shard) $work/$1 " | wc -l; }
killed=0
dir=kill-parallel
quiet sweep plan map.toml -o $dir --shard-points 100
while [ $killed -lt "$kills" ]; do
    "$hpu" --quiet sweep submit $dir --engine parallel --limit 2 >/dev/null 2>&1 &
    pid=$!
    for _ in $(seq 500); do [ "$(living $dir)" = 0 ] || break; sleep 0.01; done
    pause 0.5
    kill -9 $pid 2>/dev/null && killed=$((killed + 1))
    wait $pid 2>/dev/null || true
    for _ in $(seq 50); do [ "$(living $dir)" != 0 ] || break; sleep 0.1; done
    [ "$(living $dir)" = 0 ] || { echo "$(living $dir) jobs of GNU parallel live on"; differs=1; }
    [ "$(done_shards $dir)" -lt 90 ] || find $dir -name '*.parquet' -delete
done
quiet sweep submit $dir --engine parallel --limit 2
quiet sweep gather $dir
same "$killed kills of a submitter of GNU parallel, no job lives on" $dir local-map

finish() {
    if [ $differs = 0 ]; then echo "all engines agree"; else echo "engines differ"; fi
    if [ $differs != 0 ]; then exit 1; fi
    sleep 0.5 # until tee has written the last line
    cp "$work/record" "$record"
    exit
}
[ -z "$only_kills" ] || finish

# How fast this Slurm starts tasks that do nothing.
begin=$(now)
echo '#!/bin/sh' | sbatch --array=0-63 --output=/dev/null --parsable >/dev/null
while [ "$(queued)" != 0 ]; do sleep 0.1; done
took=$(since "$begin")
echo "64 empty tasks by Slurm on two cores: $took s, $(awk -v s="$took" 'BEGIN { printf "%.1f", 64 / s }') a second"

# The overhead of shards on two local workers, in wall time and in processor time of both workers: medians of turns.
cat >overhead.toml <<'STUDY'
name = "overhead"
title = "1000 cells"

[map]
scene = "hybrid-wall"
x = "wall.stiffness=0.1..6 N.m/rad:50"
y = "wall.damping=0.01..0.4 mN.m.s/rad:20"
full = true
STUDY
timed() { # NAME COMMAND...
    /usr/bin/time -a -o "$1" -f '%e %U %S' "${@:2}" >/dev/null
}
for _ in 1 2 3; do
    rm -rf overhead whole
    timed map-s "$hpu" --quiet map hybrid-wall --x 'wall.stiffness=0.1..6 N.m/rad:50' \
        --y 'wall.damping=0.01..0.4 mN.m.s/rad:20' --full --jobs 2 -o whole
    timed sweep-s sh -c "'$hpu' --quiet sweep run overhead.toml -o overhead --jobs 2 &&
        '$hpu' --quiet map --from overhead -o drawn"
done
cmp -s <(rows whole) <(rows drawn) || { echo "1000 cells: differ from hpu map"; differs=1; }
median() { awk -v cpu="$2" '{ print cpu ? $2 + $3 : $1 }' "$1" | sort -g | sed -n 2p; }
for cpu in 0 1; do
    [ $cpu = 0 ] && what="wall time" || what="processor time"
    echo "1000 cells of hybrid-wall with pictures, $what: hpu map $(median map-s $cpu) s, hpu sweep run and hpu map" \
        "--from $(median sweep-s $cpu) s:" \
        "$(echo "$(median map-s $cpu) $(median sweep-s $cpu)" | awk '{ printf "%+.1f %%", 100 * ($2 / $1 - 1) }')"
done

# What a point costs, by kind of scene: processor time of 64 cells on one core, without the start of the process.
cost() { # NAME SCENE X Y [SET]
    printf 'name = "cost"\ntitle = "cost"\n\n[map]\nscene = "%s"\nx = "%s:8"\ny = "%s:8"\nfull = true\n' \
        "$2" "$3" "$4" >cost.toml
    [ -z "${5:-}" ] || echo "set = ['$5']" >>cost.toml
    rm -rf cost
    quiet sweep plan cost.toml -o cost --shard-points 64
    rm -f cost-s
    timed cost-s "$hpu" --quiet sweep shard cost --index 0
    awk -v name="$1" '{
        s = ($2 + $3) / 64
        printf "%-52s %9.2f ms a point, %10.0f points a core-hour\n", name, 1e3 * s, 3600 / s
    }' cost-s
}
cost "free motion, 20 ms" free-motion 'device.coulomb_friction=0.1..10 mN.m' 'device.initial_speed=100..300 rad/s' \
    'run.duration=20 ms'
cost "a motor's hybrid wall, 2 s" hybrid-wall 'wall.stiffness=0.1..6 N.m/rad' 'wall.damping=0.01..0.4 mN.m.s/rad'
cost "a motor's wall with friction, 2 s" friction-wall 'wall.stiffness=0.5..2 N.m/rad' \
    'wall.damping=0.01..0.1 mN.m.s/rad'
cost "a motor's wall sampled at 1 kHz, 2 s" conventional-wall-1khz 'wall.stiffness=0.1..2 N.m/rad' \
    'wall.damping=0.01..0.4 mN.m.s/rad'
cost "a PHANToM's drop test" phantom-drop 'room.stiffness=0.5..2 kN/m' 'drop.weight=0.1..0.2 N'
cost "a design of others in Verilog, a wall of 1 s" "$root/testbench/dut/knee.toml" 'dut.ports.gain=20..300' \
    'hand.stiffness=0.2..0.4 N.m/rad'
cost "a segment on a gimbal, switched touch" gimbal-switch 'surface.stiffness=0.1..3 N/mm' 'method.force_gain=0..14'

# The gather of the same 10 000 rows by the number of shards.
for points in 1000 100 20; do
    rm -rf cut
    quiet sweep plan map.toml -o cut --shard-points $points
    quiet sweep run cut --jobs 2
    rm -f gather-s
    for _ in 1 2 3; do timed gather-s "$hpu" --quiet sweep gather cut; done
    echo "a gather of 10 000 rows in $((10000 / points)) shards: $(median gather-s 0) s"
    same "$((10000 / points)) shards" cut local-map
done

finish
