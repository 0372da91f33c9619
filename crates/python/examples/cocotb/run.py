"""run.py SCENE SIMULATOR [KEY=VALUE...]: runs closed.py on the design of a scene, here.

SCENE is a TOML file with a [dut]; SIMULATOR is ghdl, icarus or verilator. Prints the plant's states and energies at the
end, which are those of `hpu run SCENE --set KEY=VALUE`.
"""

import json
import os
import sys
import tomllib
from pathlib import Path

from cocotb_tools.runner import get_results, get_runner

HERE = Path(__file__).resolve().parent


def main(scene, simulator, *overrides):
    path = Path(scene).resolve()
    dut = tomllib.loads(path.read_text())["dut"]
    reset = dut["reset"]
    arguments = ["--std=" + dut.get("standard", "08")] if simulator == "ghdl" else []
    runner = get_runner(simulator)
    runner.build(
        sources=[path.parent / file for file in dut["files"]],
        hdl_toplevel=dut["top"].lower() if simulator == "ghdl" else dut["top"],
        build_args=arguments,
        build_dir=f"cocotb-{simulator}",
        always=True,
        timescale=("1ns", "1ps"),
    )
    results = runner.test(
        hdl_toplevel=dut["top"].lower() if simulator == "ghdl" else dut["top"],
        test_module="closed",
        test_args=arguments,
        extra_env={
            "PYTHONPATH": f"{HERE}{os.pathsep}{os.environ.get('PYTHONPATH', '')}",
            "CLOSED": str(path),
            "CLOSED_RESET": f"{reset['port']}={0 if reset.get('active') == 'low' else 1}",
            "CLOSED_SET": json.dumps(dict(pair.split("=", 1) for pair in overrides)),
        },
        build_dir=f"cocotb-{simulator}",
        results_xml="results.xml",
    )
    return get_results(results)[1] != 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
