#!/bin/sh
# Ratios of speeds over machines: writes testbench/record/speed-ratios.txt from the records that testbench/speed.sh has
# written, which the history keeps. The arguments are the commits of these records; without arguments, they are those of
# the present record of ratios.
set -eu
cd "$(dirname "$0")/.."
record=testbench/record/speed-ratios.txt
# shellcheck disable=SC2046  # a word a commit
[ $# -gt 0 ] || set -- $(awk '$2 ~ /^[0-9]+-[0-9]+-[0-9]+$/ { print $1 }' "$record")
[ "$(git rev-parse --is-shallow-repository)" = false ] || {
    echo "error: this clone has no history, which keeps the records; fetch it: git fetch --unshallow" >&2
    exit 1
}
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

for commit; do
    git show "$commit:testbench/record/speed.txt" >"$scratch/$commit"
    # Its second line ends with the processor and the number of cores.
    sed -n '2{s/^.*([^()]*), //;p;q}' "$scratch/$commit" | {
        read -r processor
        printf '%-9s %-11s %s\n' "$commit" "$(git show -s --format=%cs "$commit")" "${processor%, 2 cores}"
    }
done >"$scratch/machines"

{
    echo "Clock edges per second of hpu run, over those of --driver clock on the same scene with a switching bridge"
    echo "By testbench/speed-ratios.sh, from the records of testbench/speed.sh in these commits"
    echo
    echo "commit    date        processor, 2 cores of a virtual machine"
    cat "$scratch/machines"
    echo
    (cd "$scratch" && awk '
        BEGIN {
            split("hybrid-wall,2s hybrid-wall,by-clock friction-wall,2s friction,by-clock" \
                " friction-wall,60s friction,by-clock contact,averaged friction,by-clock" \
                " contact,1kHz-rows friction,by-clock", pairs, " ")
        }
        FNR == 1 { files[++count] = FILENAME }
        # Edges over wall time: finer than the column of their quotient.
        $2 ~ /^[0-9]+$/ && $4 > 0 { rate[FILENAME, $1] = $2 / $4 }
        END {
            printf "%-21s %-20s", "run", "by clock"
            for (file = 1; file <= count; file++) printf " %9s", files[file]
            printf " %9s %9s\n", "least", "greatest"
            for (pair = 1; pair < 10; pair += 2) {
                printf "%-21s %-20s", pairs[pair], pairs[pair + 1]
                least = 0
                greatest = 0
                for (file = 1; file <= count; file++) {
                    if (!((files[file], pairs[pair]) in rate)) exit 1
                    ratio = rate[files[file], pairs[pair]] / rate[files[file], pairs[pair + 1]]
                    if (!least || ratio < least) least = ratio
                    if (ratio > greatest) greatest = ratio
                    printf " %9.0f", ratio
                }
                printf " %9.0f %9.0f\n", least, greatest
            }
        }' "$@")
} >"$scratch/record"
mv "$scratch/record" "$record"
cat "$record"
