#!/bin/sh
# Copies what the program carries into crates/assets/files, from where a published crate takes it. A test of hpu-assets
# fails where a copy differs. The packages of `hdl/generated` stay out: they are generated where they are needed.
set -eu
cd "$(dirname "$0")/.."

rm -rf crates/assets/files
for file in hdl/*.vhd hdl/generated/*.vhd testbench/scenes/* testbench/parts/*/* testbench/recordings/qube/[aLR]* \
    testbench/recordings/epfl-paddle/*.csv \
    testbench/studies/*.toml testbench/hands.toml testbench/vhdl/vector_reader.vhd testbench/vhdl/hpu_dut_bridge.vhd \
    testbench/dut/begin.vhd testbench/dut/ci.yml; do
    case $file in hdl/generated/*_pkg.vhd) continue ;; esac
    mkdir -p "crates/assets/files/$(dirname "$file")"
    cp "$file" "crates/assets/files/$file"
done
