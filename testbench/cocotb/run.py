"""run.py VECTORS.json HDL.vhd...: holds a block's VHDL against exported vectors, in cocotb on GHDL.

VECTORS.json comes from `hpu vectors BLOCK --format json`; the files are the block's VHDL, after those that it needs.
Exit codes: 0 every row agrees, 1 one differs.
"""

import json
import os
import sys
from pathlib import Path

from cocotb_tools.runner import get_results, get_runner

HERE = Path(__file__).resolve().parent
ARGS = ["--std=08", "-Wno-hide"]


def main(vectors, *sources):
    told = json.loads(Path(vectors).read_text())
    block = told["block"]
    generics = {name: str(value).lower() for name, value in told["generics"].items()}
    runner = get_runner("ghdl")
    runner.build(
        sources=[Path(source).resolve() for source in sources],
        hdl_toplevel=block,
        build_args=ARGS,
        build_dir=f"cocotb-{block}",
        always=True,
    )
    results = runner.test(
        hdl_toplevel=block,
        test_module="rows",
        test_args=ARGS,
        parameters=generics,
        plusargs=["--ieee-asserts=disable"],
        extra_env={
            "HPU_VECTORS": str(Path(vectors).resolve()),
            "PYTHONPATH": f"{HERE}{os.pathsep}{os.environ.get('PYTHONPATH', '')}",
        },
        build_dir=f"cocotb-{block}",
        results_xml="results.xml",
    )
    tests, failed = get_results(results)
    return int(tests == 0 or failed != 0)


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    sys.exit(main(*sys.argv[1:]))
