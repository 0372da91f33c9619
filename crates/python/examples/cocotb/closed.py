"""A cocotb test of a design of one's own, closed around the plant of a scene: three lines are hpu's.

CLOSED has the scene, CLOSED_RESET the reset's port and its active level.
"""

import json
import os

import cocotb
import hpu.cocotb
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge


@cocotb.test()
async def the_wall_is_touched(dut):
    port, level = os.environ["CLOSED_RESET"].split("=")
    reset = getattr(dut, port)
    Clock(dut.clk, 100, unit="ns").start(start_high=False)
    reset.value = int(level)
    await FallingEdge(dut.clk)
    await FallingEdge(dut.clk)
    reset.value = 1 - int(level)

    with hpu.Plant(os.environ["CLOSED"], json.loads(os.environ["CLOSED_SET"])) as plant:
        await hpu.cocotb.join(dut, plant, dut.clk)
        assert plant["contact"], "the hand has not come to the wall"
        print(json.dumps({"edge": plant.edge, "states": plant.states, "energy": plant.energy}))
