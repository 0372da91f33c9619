"""Designs of others in cocotb, closed around a plant: their motion is that of `hpu run` on their `[dut]`, to the bit."""

import json
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path
from types import SimpleNamespace

import hpu
import hpu.cocotb
from common import options, told

ROOT = Path(__file__).parents[3]
EXAMPLE = ROOT / "crates/python/examples/cocotb/run.py"
# The hand comes to the wall within 10 ms, 100 000 clock edges.
OVERRIDES = {"run.duration": "10 ms", "wall.position": "0.05 rad"}


class Closed(unittest.TestCase):
    def moves_as_in_a_dut(self, scene, simulator):
        path = str(ROOT / "testbench/dut" / scene)
        command = [sys.executable, EXAMPLE, path, simulator, *(f"{key}={value}" for key, value in OVERRIDES.items())]
        with tempfile.TemporaryDirectory() as folder:
            ran = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        self.assertEqual(ran.returncode, 0, ran.stdout + ran.stderr)
        mine = next(json.loads(line) for line in ran.stdout.splitlines() if line.startswith('{"edge"'))
        whole = told("run", path, *options(OVERRIDES))
        self.assertEqual(mine["edge"], whole["edges"])
        energies = {name: whole[name] for name in mine["energy"]}
        self.assertEqual(mine["energy"], energies)
        self.assertGreater(mine["energy"]["supplied_j"], 0)

    def test_a_design_in_vhdl_on_ghdl(self):
        self.moves_as_in_a_dut("rim.toml", "ghdl")

    def test_a_design_in_verilog_on_icarus(self):
        self.moves_as_in_a_dut("knee.toml", "icarus")


class Refused(unittest.TestCase):
    def test_a_port_that_is_missing_is_named(self):
        dut = SimpleNamespace(_name="top", enc_a=0, ENC_B=0)
        signal = SimpleNamespace(name="enc_b", doc="encoder.b")
        with self.assertRaisesRegex(hpu.ArgumentError, "design top has no port `enc_b` .*ports={'enc_b': a handle}"):
            hpu.cocotb._port(dut, signal, {})
        self.assertEqual(hpu.cocotb._port(dut, signal, {"enc_b": 7}), 7)

    def test_an_unknown_bit_is_named_with_its_edge(self):
        from cocotb.types import Logic, LogicArray

        plant = SimpleNamespace(edge=5)
        bit = SimpleNamespace(name="pwm", min=0, max=1)
        with self.assertRaisesRegex(hpu.ArgumentError, "output `pwm` is X at clock edge 5"):
            hpu.cocotb._word(Logic("X"), bit, plant)
        self.assertEqual(hpu.cocotb._word(Logic("1"), bit, plant), 1)
        duty = SimpleNamespace(name="duty", min=-8, max=7)
        self.assertEqual([hpu.cocotb._word(LogicArray(bits), duty, plant) for bits in ("0111", "1000", "1111")], [7, -8, -1])
        with self.assertRaisesRegex(hpu.ArgumentError, "output `duty` is .*01Z1"):
            hpu.cocotb._word(LogicArray("01Z1"), duty, plant)


if __name__ == "__main__":
    unittest.main()
