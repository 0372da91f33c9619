#!/bin/sh
# The compiler of Verilator's designs in the test command, OBJCACHE in tests.py: as hpu calls it, at level 1. A design
# that a test simulates runs for milliseconds; at level 3 it takes twice as long to compile.
case " $* " in
*" -O0 "*) exec ccache "$@" ;;
*) exec ccache "$@" -O1 ;;
esac
