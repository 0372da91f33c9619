"""Designs in cocotb's simulators move as `hpu run` moves them in a `[dut]`, to the bit."""

import json
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import hpu
from common import ROOT, digest

# The hand is in the wall after 2 ms.
OVERRIDES = {"run.duration": "3 ms", "hand.path": '[["0 s", 0], ["2 ms", 1.8]]', "wall.position": "0.1 rad"}


class Designs(unittest.TestCase):
    def moves_as_in_a_dut(self, name, overrides):
        run = hpu.run(ROOT / f"testbench/dut/{name}.toml", overrides, trace=True)
        last = {column: run.trace[column][-1] for column in run.trace.keys()}
        with tempfile.TemporaryDirectory() as folder:
            words = [f"{key}={value}" for key, value in overrides.items()]
            command = [sys.executable, ROOT / "crates/python/examples/cocotb/run.py", name, "motion.json", *words]
            ran = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
            self.assertEqual(ran.returncode, 0, ran.stdout + ran.stderr)
            motion = json.loads(Path(folder, "motion.json").read_text(encoding="ascii"))
        self.assertEqual(motion["edges"], run.summary["edges"])
        self.assertEqual(motion["energy"], run.summary["energy"])
        self.assertEqual(motion["states"], {state: last[state] for state in motion["states"]})
        rows = list(zip(*(run.trace[state] for state in motion["states"]), strict=True))
        self.assertEqual(len(motion["rows"]), 31)
        self.assertEqual(digest(motion["rows"]), digest(rows))
        self.assertGreater(run.contact, 0.5)
        self.assertGreater(run.summary["output_changes"], 10)
        print(f"cocotb {name}: {motion['edges_per_s']:.2e} clock edges a second of processor time")

    def test_verilog_in_icarus(self):
        self.moves_as_in_a_dut("knee", OVERRIDES)

    def test_vhdl_93_in_ghdl(self):
        # The wall is a generic of this design.
        self.moves_as_in_a_dut("rim", OVERRIDES | {"dut.generics.WALL_AT": "65"})


if __name__ == "__main__":
    unittest.main()
