#!/bin/bash
# Runs scenes one after the other. Of each, OUT gets NAME.xml (JUnit), NAME.html (its page), and a folder NAME with
# pictures and waveforms. KEY=VALUE changes a key of all of them.
# Usage: scenes.sh OUT SCENE... [-- KEY=VALUE...]
# Exit codes: 0 all expectations are met, 1 one is not, 2 a usage that cannot be, else that of the first that failed.
set -euo pipefail
[ $# -gt 0 ] || { echo "error: write scenes.sh OUT SCENE... [-- KEY=VALUE...]" >&2 && exit 2; }
out=$1
shift
scenes=()
while [ $# -gt 0 ] && [ "$1" != -- ]; do
    scenes+=("$1")
    shift
done
[ $# -eq 0 ] || shift
changes=()
for change in "$@"; do
    changes+=(--set "$change")
done
[ "${#scenes[@]}" -gt 0 ] || { echo "error: no scene; is the pattern right?" >&2 && exit 2; }

failed=0
declare -A seen
for scene in "${scenes[@]}"; do
    name=$(basename "$scene" .toml)
    # Two folders may have a scene of one name.
    seen[$name]=$((${seen[$name]:-0} + 1))
    [ "${seen[$name]}" = 1 ] || name=$name-${seen[$name]}
    mkdir -p "$out/$name"
    code=0
    hpu run "$scene" -o "$out/$name" --junit "$out/$name.xml" "${changes[@]}" || code=$?
    hpu report "$scene" -o "$out/$name.html" "${changes[@]}" || { [ "$code" != 0 ] || code=$?; }
    [ "$code" = 0 ] || [ "$failed" != 0 ] || failed=$code
done
exit "$failed"
