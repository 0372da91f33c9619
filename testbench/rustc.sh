#!/bin/sh
# The compiler of the test command, cargo's RUSTC_WRAPPER in tests.py: rustc as cargo calls it, except for the binaries
# of tests.
#
# Tests spend their time in libraries and tools, and those stay as they are released. The tests' own code is compiled
# once and run once; optimised in full, it takes many times as long to compile. Two binaries compute much themselves and
# stay as they are. The tests of hpu-datapath, hpu-plant and hpu-cosim compile generic circuits, motions and worlds, and
# those of hpu-prove within its library compile all of it: at level 1 they cost least in all. Those of hpu-leap judge
# millions of cells.
case "${CARGO_PKG_NAME-}: $* " in
*" --crate-name high_precision "* | *" --crate-name postures "*) exec "$@" ;;
hpu-datapath:*" --test "* | hpu-plant:*" --test "* | hpu-cosim:*" --test "*) exec "$@" -C opt-level=1 ;;
hpu-leap:*" --test "*) exec "$@" -C opt-level=1 ;;
hpu-prove:*" --test "*) exec "$@" -C opt-level=1 ;;
*" --test "*) exec "$@" -C opt-level=0 ;;
*) exec "$@" ;;
esac
