#!/usr/bin/env python3
"""Records what every block costs in its default configuration: testbench/record/costs.csv.

usage: testbench/costs.py [BLOCK...]
Runs `hpu cost BLOCK --variant default` for each block, or for these; other rows of the record stay. Needs a release
build, GHDL, Yosys and nextpnr. Small blocks take seconds the first time, the largest loops ten minutes to half an hour.
"""

import csv
import json
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
HPU = ROOT / "target/release/hpu"
RECORD = ROOT / "testbench/record/costs.csv"
COLUMNS = ["block", "variant", "target", "lut4", "ff", "carry", "bram", "dsp", "fmax_mhz", "path_ns"]


def hpu(*words):
    return json.loads(subprocess.run([HPU, *words, "--json"], check=True, stdout=subprocess.PIPE).stdout)


def tools():
    said = {tool: subprocess.run([tool, option], check=True, capture_output=True, text=True)
            for tool, option in (("ghdl", "--version"), ("yosys", "-V"), ("nextpnr-ice40", "--version"))}
    words = {tool: (done.stdout + done.stderr).split() for tool, done in said.items()}
    nextpnr = words["nextpnr-ice40"][-1].strip("()")
    return f"ghdl {words['ghdl'][1]}, yosys {words['yosys'][1]}, nextpnr-ice40 {nextpnr}"


def main(wanted):
    blocks = [block["name"] for block in hpu("block")["blocks"]]
    rows = {}
    if RECORD.exists():
        with RECORD.open(newline="") as file:
            next(file)
            rows = {row["block"]: row for row in csv.DictReader(file)}
    for name in wanted or blocks:
        [found] = hpu("cost", name, "--variant", "default", "--quiet")["variants"]
        if found["failure"]:
            sys.exit(f"{name}: {found['failure']}")
        told = {"block": name, "variant": found["name"], **found}
        rows[name] = {column: "" if told[column] is None else told[column] for column in COLUMNS}
        print(name, rows[name]["lut4"], rows[name]["fmax_mhz"] or rows[name]["path_ns"], flush=True)
        with RECORD.open("w", newline="") as file:
            file.write(f"# {tools()}; testbench/costs.py\n")
            table = csv.DictWriter(file, COLUMNS, lineterminator="\n")
            table.writeheader()
            table.writerows(rows[block] for block in blocks if block in rows)


main(sys.argv[1:])
