"""cocotb_run.py HDL...: builds hybrid_loop of these files in GHDL and runs loop.py on it, here."""

import os
import sys
from pathlib import Path

from cocotb_tools.runner import get_results, get_runner

ARGS = ["--std=08", "-Wno-hide"]
HERE = Path(__file__).resolve().parent

runner = get_runner("ghdl")
runner.build(sources=sys.argv[1:], hdl_toplevel="hybrid_loop", build_args=ARGS, build_dir="cocotb", always=True)
results = runner.test(
    hdl_toplevel="hybrid_loop",
    test_module="loop",
    test_args=ARGS,
    parameters={"DAMPING_FRAC": 4},
    plusargs=["--ieee-asserts=disable"],
    extra_env={"PYTHONPATH": f"{HERE}{os.pathsep}{os.environ.get('PYTHONPATH', '')}"},
    build_dir="cocotb",
    results_xml="results.xml",
)
sys.exit(get_results(results)[1] != 0)
