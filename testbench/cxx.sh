#!/bin/bash
# The compiler of Verilator's designs in the test command, OBJCACHE in tests.py: as hpu calls it, at level 1. A design
# that a test simulates runs for milliseconds; at level 3 it takes twice as long to compile.
#
# A third of that time goes into headers of Verilator and of C++, which are precompiled by the options of the first
# model. Where other options make that useless, g++ reads the headers themselves.
case " $* " in
*" -O0 "*) exec ccache "$@" ;;
*"Vdut__ALL.cpp "*) ;;
*) exec ccache "$@" -O1 ;;
esac
compiler=$1
shift
kept=${CCACHE_DIR:?}/headers
if ! [ -e "$kept/model.h.gch" ]; then
    mkdir -p "$kept"
    # Many begin at once; each makes its own, and the last one stays.
    own=$(mktemp -d "$kept/XXXXXX")
    printf '#include <%s>\n' verilated.h algorithm chrono memory string utility vector >"$own/model.h"
    options=()
    for option in "$@"; do
        case $option in
        -c | -MMD | -o | *.o | *.cpp) ;;
        *) options+=("$option") ;;
        esac
    done
    "$compiler" "${options[@]}" -O1 -x c++-header -o "$own/model.h.gch" "$own/model.h" &&
        mv "$own/model.h" "$own/model.h.gch" "$kept"
    rm -r "$own"
fi
[ -e "$kept/model.h" ] || exec ccache "$compiler" "$@" -O1
export CCACHE_SLOPPINESS=pch_defines,time_macros
exec ccache "$compiler" -include "$kept/model.h" -fpch-preprocess "$@" -O1
