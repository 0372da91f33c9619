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
            motion = json.loads(Path(folder, "motion.json").read_text(encoding="ascii"))
        self.assertEqual(motion["edges"], run.summary["edges"])
        self.assertEqual(motion["energy"], run.summary["energy"])
        self.assertEqual(motion["states"], {state: last[state] for state in motion["states"]})
        self.assertGreater(run.contact, 0.5)
        self.assertGreater(run.summary["output_changes"], 10)
        print(f"cocotb {name}: {motion['edges_per_s']:.2e} clock edges a second of processor time")

    def test_a_design_in_vhdl_on_ghdl(self):
        self.moves_as_in_a_dut("rim.toml", "ghdl")

    def test_vhdl_93_in_ghdl(self):
        # The wall is a generic of this design.
        self.moves_as_in_a_dut("rim", OVERRIDES | {"dut.generics.WALL_AT": "65"})


if __name__ == "__main__":
    unittest.main()
