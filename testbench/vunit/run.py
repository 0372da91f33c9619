"""run.py HDL VECTORS [VUNIT ARGUMENT...]: holds two blocks' VHDL against exported vectors, in VUnit on GHDL.

HDL is the folder of the VHDL, VECTORS one with position_counter.csv and displacement.csv, each from
`hpu vectors BLOCK --format vunit`.
"""

import sys
from pathlib import Path

from vunit import VUnit

HERE = Path(__file__).resolve().parent


def main(hdl, vectors, *arguments):
    unit = VUnit.from_argv(argv=list(arguments), compile_builtins=False)
    unit.add_vhdl_builtins()
    library = unit.add_library("hpu")
    for block in ("position_counter", "displacement"):
        library.add_source_file(Path(hdl) / f"{block}.vhd")
    library.add_source_file(HERE / "tb_rows.vhd")
    library.test_bench("tb_rows").set_generic("VECTORS", str(Path(vectors).resolve()))
    unit.set_sim_option("ghdl.sim_flags", ["--ieee-asserts=disable"])
    unit.main()


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
