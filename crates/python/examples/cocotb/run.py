"""run.py knee|rim OUT.json [KEY=VALUE]...: holds a design of testbench/dut in the loop around its scene's plant.

`knee` is Verilog in Icarus, `rim` VHDL-93 in GHDL; both are as their authors wrote them. The motion goes to OUT.json.
It needs the package hpu and cocotb. Exit codes: 0 the scene has come to its end, 1 it has not.
"""

import json
import sys
import tomllib
from pathlib import Path

from cocotb_tools.runner import get_results, get_runner

HERE = Path(__file__).resolve().parent
DESIGNS = HERE.parents[3] / "testbench/dut"
# Simulator and the options that it builds and runs with.
SIMULATORS = {"knee": ("icarus", [], []), "rim": ("ghdl", ["--std=93"], ["--ieee-asserts=disable"])}


def main(name, out, *overrides):
    scene = DESIGNS / f"{name}.toml"
    dut = tomllib.loads(scene.read_text(encoding="utf-8"))["dut"]
    simulator, build_args, plusargs = SIMULATORS[name]
    told = {
        "scene": str(scene),
        "overrides": dict(pair.split("=", 1) for pair in overrides),
        "clock": dut["clock"],
        "reset": dut["reset"]["port"],
        "active": 0 if dut["reset"].get("active") == "low" else 1,
        "clocks": dut["reset"].get("clocks", 4),
        "out": str(Path(out).resolve()),
        # Clock cycles between rows: 10 MHz over the 10 kHz of record.plant_rate.
        "stride": 1000,
    }
    prefix = "dut.generics."
    generics = {key.removeprefix(prefix): value for key, value in told["overrides"].items() if key.startswith(prefix)}
    # Icarus takes parameters when it builds, GHDL generics when it runs.
    parameters = dut.get("generics", {}) | generics
    runner = get_runner(simulator)
    build = f"cocotb-{name}"
    files = [DESIGNS / file for file in dut["files"]]
    runner.build(
        sources=files,
        hdl_toplevel=dut["top"],
        build_args=build_args,
        build_dir=build,
        parameters=parameters,
        timescale=("1ns", "1ns"),
        always=True,
    )
    results = runner.test(
        hdl_toplevel=dut["top"],
        test_module="in_loop",
        test_args=build_args,
        plusargs=plusargs,
        parameters=parameters,
        extra_env={"HPU_LOOP": json.dumps(told)},
        build_dir=build,
        results_xml="results.xml",
    )
    sys.exit(get_results(results)[1] != 0)


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
