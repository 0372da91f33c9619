"""hybrid_loop in cocotb, closed around the plant of the scene hybrid-wall in plain Python.

HPU_EDGES, HPU_WORDS (reference, stiffness, damping, period, scale) and HPU_OUT come by the environment. With HPU_NETS
every net goes to HPU_OUT, a line for each edge after which any has changed; otherwise the processor seconds do.
"""

import os
import time
from math import floor, pi

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge, RisingEdge

# hybrid-wall.toml, and what scenes have where they are silent.
EDGE_S, SUPPLY_V = 20e-9, 24.0
RESISTANCE_OHM, INDUCTANCE_H = 25.9e-3 * 24.0 / 0.265, 0.226e-3
TORQUE_CONSTANT, INERTIA_KG_M2, FRICTION_NM_S = 25.9e-3, 1.37e-6, 1.3e-6
HAND_NM, HAND_NM_S = 0.3, 0.1e-3
COUNT_RAD = 2.0 * pi / 4096
PATH = [(0, 0.0), (7_500_000, 1.4), (12_500_000, 1.9), (20_000_000, 1.2), (25_000_000, 1.8)]

WORDS = "reference stiffness damping period scale".split()
NETS = (
    "a_pin b_pin reference stiffness damping period scale a_high a_low b_high b_low a b step error position delta"
    " contact penetration spring velocity drag torque command"
).split()


def one_edge(driven):
    """e^{A dt} - I by its series; states current, speed, angle, intent, then intent's speed and voltage."""
    a = [[0.0] * 6 for _ in range(6)]
    if driven:
        a[0] = [-RESISTANCE_OHM / INDUCTANCE_H, -TORQUE_CONSTANT / INDUCTANCE_H, 0.0, 0.0, 0.0, 1.0 / INDUCTANCE_H]
    torques = [TORQUE_CONSTANT, -(FRICTION_NM_S + HAND_NM_S), -HAND_NM, HAND_NM, HAND_NM_S, 0.0]
    a[1] = [torque / INERTIA_KG_M2 for torque in torques]
    a[2][1] = a[3][4] = 1.0
    total = [[0.0] * 6 for _ in range(6)]
    term = [[float(i == j) for j in range(6)] for i in range(6)]
    for order in range(1, 13):
        term = [[sum(term[i][k] * a[k][j] for k in range(6)) * (EDGE_S / order) for j in range(6)] for i in range(6)]
        total = [[total[i][j] + term[i][j] for j in range(6)] for i in range(6)]
    return total


class Plant:
    """Motor, hand and encoder, one clock edge at a time."""

    def __init__(self):
        self.steps = [one_edge(False), one_edge(True)]
        self.edge = self.knot = 0
        self.current = self.speed = self.angle = self.voltage = 0.0
        self.step = self.steps[False]
        self.take_knot()
        self.count(0.0)

    def take_knot(self):
        edge, self.intent = PATH[self.knot]
        self.knot += 1
        self.intent_speed, self.knot_edge = 0.0, None
        if self.knot < len(PATH):
            self.knot_edge, angle = PATH[self.knot]
            self.intent_speed = (angle - self.intent) / ((self.knot_edge - edge) * EDGE_S)

    def count(self, angle):
        count = floor(angle / COUNT_RAD)
        self.low, self.high = count * COUNT_RAD, (count + 1) * COUNT_RAD
        self.a, self.b = count >> 1 & 1, (count >> 1 ^ count) & 1

    def drive(self, a_high, a_low, b_high, b_low):
        self.step = self.steps[(a_high or a_low) and (b_high or b_low)]
        self.voltage = SUPPLY_V * (b_high - a_high)

    def flow(self):
        """To the next edge; whether the pins have changed."""
        i, w, q, p, v, u = self.current, self.speed, self.angle, self.intent, self.intent_speed, self.voltage
        (i0, i1, i2, i3, i4, i5), (w0, w1, w2, w3, w4, w5), (q0, q1, q2, q3, q4, q5) = self.step[:3]
        self.current = i + (i0 * i + i1 * w + i2 * q + i3 * p + i4 * v + i5 * u)
        self.speed = w + (w0 * i + w1 * w + w2 * q + w3 * p + w4 * v + w5 * u)
        self.angle = q + (q0 * i + q1 * w + q2 * q + q3 * p + q4 * v + q5 * u)
        self.intent = p + self.step[3][4] * v
        self.edge += 1
        if self.edge == self.knot_edge:
            self.take_knot()
        if self.low <= self.angle < self.high:
            return False
        self.count(self.angle)
        return True


@cocotb.test()
async def closed_loop(dut):
    edges = int(os.environ["HPU_EDGES"])
    for name, word in zip(WORDS, os.environ["HPU_WORDS"].split()):
        getattr(dut, name).value = int(word)
    nets = [getattr(dut, name) for name in NETS] if "HPU_NETS" in os.environ else []
    gates = dut.a_high, dut.a_low, dut.b_high, dut.b_low
    plant = Plant()
    dut.rst.value = 1
    dut.a_pin.value = dut.b_pin.value = 0
    falling = FallingEdge(dut.clk)
    Clock(dut.clk, 20, unit="ns").start(start_high=False)
    await RisingEdge(dut.clk)
    await falling
    dut.rst.value = 0
    shown, lines = None, []
    begin = time.process_time()
    for edge in range(1, edges + 1):
        if plant.flow():
            dut.a_pin.value, dut.b_pin.value = plant.a, plant.b
        await falling
        plant.drive(*[int(gate.value) for gate in gates])
        if nets and (now := [int(net.value) for net in nets]) != shown:
            shown = now
            lines.append(",".join(map(str, [edge, *now])))
    took = time.process_time() - begin
    with open(os.environ["HPU_OUT"], "w") as out:
        out.write("".join(line + "\n" for line in lines) if nets else f"{took:.6f}\n")
