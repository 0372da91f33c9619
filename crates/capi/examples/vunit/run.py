"""run.py [VUNIT OPTIONS]: the tests of tb_wall.vhd, in VUnit on GHDL.

GHDL finds libhpu_sim.so and libhpu.so by LD_LIBRARY_PATH; the page beside `examples` has the commands.
"""

from pathlib import Path

from vunit import VUnit

HERE = Path(__file__).resolve().parent
CAPI = HERE.parent.parent

vu = VUnit.from_argv()
vu.add_vhdl_builtins()
library = vu.add_library("walls")
library.add_source_files(CAPI.parent.parent / "hdl" / "*.vhd")
library.add_source_files(CAPI / "simulators" / "hpu_plant.vhd")
library.add_source_files(HERE / "tb_wall.vhd")
vu.set_sim_option("disable_ieee_warnings", True)
vu.main()
