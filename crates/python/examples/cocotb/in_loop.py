"""A cocotb test: a design of `testbench/dut` in the loop around the plant of its scene, to the scene's end.

`run.py` gives the scene and its overrides, the names of clock and reset, and a file for the motion. In a test of your
own, these are known: the lines for the loop are the three with `plant`. The states are kept at each row of `hpu run`.
"""

import json
import os
import time

import cocotb
import hpu
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge
from hpu.cocotb import close, put


@cocotb.test()
async def the_wall_is_touched(dut):
    told = json.loads(os.environ["HPU_LOOP"])
    clk, reset = getattr(dut, told["clock"]), getattr(dut, told["reset"])
    plant = hpu.Plant(told["scene"], told["overrides"])
    put(dut, plant)
    reset.value = told["active"]
    Clock(clk, 100, unit="ns").start(start_high=False)
    for _ in range(told["clocks"]):
        await FallingEdge(clk)
    reset.value = 1 - told["active"]
    begin = time.process_time()
    rows, edges = [list(plant.states.values())], 0
    while edges < plant.edges:
        edges = await close(dut, plant, clk, told["stride"])
        rows.append(list(plant.states.values()))
    took = time.process_time() - begin
    motion = {"edges": edges, "rows": rows, "states": plant.states, "energy": plant.energy, "edges_per_s": edges / took}
    with open(told["out"], "w", encoding="ascii") as file:
        json.dump(motion, file)
