#!/usr/bin/env python3
"""Holds the encoder of networks against an integration with 60 decimal places, over 10^8 clock edges each.

The command's words are those of a run of `hpu`. Delay, converter, amplifier, joints, stops, friction and hand are
written here once more, from their equations, in integers of 2^-220: exp(A t) and its integral by powers of two of a
clock edge; slip, stick and the modes of a stop end at instants inside an edge, by a Taylor series. At each change of
the encoder's lines, the angle must have the count before at the edge before, and the count after at the edge itself;
between two events the speed must have kept its sign, or the angle at its turn must have the same count.
Beside it, a body whose inertia is off by a millionth must be found wrong.

Usage: testbench/oracle/network.py HPU [EDGES [SCENE...]]. Needs mpmath. Exit codes: 0 all edges agree, 1 one does not.
"""

import subprocess
import sys
import tempfile
from fractions import Fraction
from pathlib import Path

import mpmath

BITS = 220
ONE, HALF = 1 << BITS, 1 << (BITS - 1)
# A check may be off by this much, of rounding: 2^-170.
LEAST = -(1 << 50)
mpmath.mp.prec = BITS + 40
PI = Fraction(int(mpmath.pi * (1 << 240)), 1 << 240)


def fixed(value):
    return round(Fraction(value) * ONE)


def part(value, share, order):
    """value * share / order, to the nearest."""
    return (value * share // order + HALF) >> BITS


def product(matrix, vector):
    return [sum(m * x for m, x in zip(row, vector) if m and x) >> BITS for row in matrix]


def times(one, two):
    columns = list(zip(*two))
    return [[sum(a * b for a, b in zip(row, column)) >> BITS for column in columns] for row in one]


class Flow:
    """x' = A x + f: A, and exp(A t) with its integral for 2^k clock edges."""

    def __init__(self, a, edge_s):
        n = len(a)
        self.a, self.edge = [[fixed(v) for v in row] for row in a], fixed(edge_s)
        unit = [[ONE if i == j else 0 for j in range(n)] for i in range(n)]
        # The series of exp(A T) and of its integral.
        term, power, whole, order = unit, unit, [[part(v, self.edge, 1) for v in row] for row in unit], 1
        while any(abs(value) > 4 for row in term for value in row):
            term = [[part(v, self.edge, order) for v in row] for row in times(term, self.a)]
            power = [[p + t for p, t in zip(*rows)] for rows in zip(power, term)]
            order += 1
            whole = [[w + part(t, self.edge, order) for w, t in zip(*rows)] for rows in zip(whole, term)]
        self.tables = [(power, whole)]
        for _ in range(26):
            power, whole = self.tables[-1]
            twice = [[w + v for w, v in zip(*rows)] for rows in zip(whole, times(power, whole))]
            self.tables.append((times(power, power), twice))

    def leap(self, x, f, edges):
        for power, whole in self.tables:
            if edges & 1:
                x = [p + w for p, w in zip(product(power, x), product(whole, f))]
            edges >>= 1
            if not edges:
                return x
        assert not edges
        return x

    def within(self, x, f, share):
        """The state a share of an edge later, as a Taylor series."""
        step, term = self.edge * share >> BITS, [v + w for v, w in zip(product(self.a, x), f)]
        order, total = 1, list(x)
        while any(abs(value) > 4 for value in term):
            term = [part(v, step, order) for v in term]
            total = [t + v for t, v in zip(total, term)]
            term, order = product(self.a, term), order + 1
        return total


class Network:
    """State: current, then place and speed of each body, then the hand's intention."""

    def __init__(self, bodies, joints, drive, hand, edge_s):
        self.bodies, self.joints, self.drive, self.hand, self.edge_s = bodies, joints, drive, hand, edge_s
        self.flows, self.n = {}, 2 + 2 * len(bodies)

    def flow(self, stuck, pressed):
        key = (stuck, pressed)
        if key not in self.flows:
            n, a = self.n, [[Fraction(0)] * self.n for _ in range(self.n)]
            for index, body in enumerate(self.bodies):
                place, speed = 1 + 2 * index, 2 + 2 * index
                a[place][speed] = Fraction(1)
                a[speed][place] -= body.get("spring", 0)
                a[speed][speed] -= body.get("viscous", 0)
                if pressed and "stop" in body:
                    _, stiffness, damping = body["stop"]
                    a[speed][place] -= stiffness
                    a[speed][speed] -= damping
            for one, two, ratio, stiffness, damping in self.joints:
                for target, sign in ((one, -ratio), (two, 1)):
                    for source, way in ((one, ratio), (two, -1)):
                        a[2 + 2 * target][1 + 2 * source] += sign * way * stiffness
                        a[2 + 2 * target][2 + 2 * source] += sign * way * damping
            for body, stiffness, damping in self.hand:
                a[2 + 2 * body][n - 1] += stiffness
                a[2 + 2 * body][1 + 2 * body] -= stiffness
                a[2 + 2 * body][2 + 2 * body] -= damping
            body, constant, rate = self.drive
            a[2 + 2 * body][0] += constant
            a[0][0] = -rate
            for index, body in enumerate(self.bodies):
                a[2 + 2 * index] = [v / body["inertia"] for v in a[2 + 2 * index]]
            self.net = a[2]
            if stuck:
                a[1] = a[2] = [Fraction(0)] * n
            self.flows[key] = Flow(a, self.edge_s)
        return self.flows[key]

    def forces(self, stuck, way, side, current, slope):
        """f: friction against the way of body 0, a stop that presses body 0, the demand and the hand's slope."""
        f = [Fraction(0)] * self.n
        f[0] = self.drive[2] * current
        for body, _, damping in self.hand:
            f[2 + 2 * body] += damping * slope / self.bodies[body]["inertia"]
        body = self.bodies[0]
        if side:
            f[2] += body["stop"][1] * side * body["stop"][0] / body["inertia"]
        f[2] = Fraction(0) if stuck else f[2] - way * body.get("coulomb", 0) / body["inertia"]
        f[-1] = slope
        return [fixed(v) for v in f]


class Motion:
    """The motion from event to event, with the modes of body 0: slip and stick, and a stop."""

    def __init__(self, network):
        self.net, self.x, self.edge = network, [0] * network.n, 0
        self.tau = network.bodies[0].get("coulomb", 0)
        self.stop = network.bodies[0].get("stop")
        self.stuck, self.way, self.side, self.lifted, self.ends = bool(self.tau), 0, 0, False, 0
        self.current = self.slope = Fraction(0)
        self.prepare()

    def prepare(self):
        pressed = 0 if self.lifted else self.side
        self.flow = self.net.flow(self.stuck, pressed != 0)
        self.f = self.net.forces(self.stuck, self.way, pressed, self.current, self.slope)

    def asked(self, current=None, slope=None):
        """A new demand or slope. A hand's damper makes a step of the force, so a shaft that is stuck may let go."""
        self.current = self.current if current is None else current
        self.slope = self.slope if slope is None else slope
        self.prepare()
        if self.stuck and any(value < LEAST for value, _ in self.checks(self.x)):
            self.change(min(self.checks(self.x))[1])

    def push(self, x):
        """The acceleration of body 0 without friction, from the rows of a shaft that slips."""
        flow = self.net.flow(False, self.side != 0)
        f = self.net.forces(False, 0, self.side, self.current, self.slope)
        return product([flow.a[2]], x)[0] + f[2]

    def checks(self, x):
        """Functions that are not negative in this mode, and what becomes of it where one is."""
        found = []
        if self.tau:
            limit = fixed(self.tau / self.net.bodies[0]["inertia"])
            if self.stuck:
                push = self.push(x)
                found += [(limit - push, "forward"), (limit + push, "backward")]
            else:
                found.append((self.way * x[2], "turn"))
        if self.stop:
            place, stiffness, damping = self.stop
            beyond = [side * x[1] - fixed(place) for side in (1, -1)]
            if self.side == 0:
                found += [(-beyond[0], "high"), (-beyond[1], "low")]
            else:
                at = 0 if self.side == 1 else 1
                force = (fixed(stiffness) * beyond[at] + fixed(damping) * self.side * x[2]) >> BITS
                # A stop never pulls. Where it lets go beyond its place, the body is free of it until it is back.
                if self.lifted:
                    found += [(beyond[at], "out"), (-force, "pressed")]
                else:
                    found.append((force, "lifted"))
        return found

    def change(self, what):
        self.ends += 1
        if what == "turn":
            limit, push = fixed(self.tau / self.net.bodies[0]["inertia"]), self.push(self.x)
            self.stuck = abs(push) <= limit
            self.x[2] = 0
            self.way = 0 if self.stuck else (1 if push > 0 else -1)
        elif what in ("forward", "backward"):
            self.stuck, self.way = False, 1 if what == "forward" else -1
        elif what in ("high", "low"):
            self.side = 1 if what == "high" else -1
        elif what == "out":
            self.side, self.lifted = 0, False
        else:
            self.lifted = what == "lifted"
        self.prepare()

    def upto(self, edge, look):
        """Moves on to an edge, and through the ends of modes before it."""
        while self.edge < edge:
            length = edge - self.edge
            there = self.flow.leap(self.x, self.f, length)
            if all(value >= LEAST for value, _ in self.checks(there)):
                look(self.x, there, self, length)
                self.x, self.edge = there, edge
                return
            # The last edge at which the mode holds still: its checks are monotone over so short a time.
            low = 0
            while length - low > 1:
                middle = (low + length) // 2
                x = self.flow.leap(self.x, self.f, middle)
                low, length = (middle, length) if all(v >= LEAST for v, _ in self.checks(x)) else (low, middle)
            x = self.flow.leap(self.x, self.f, low)
            look(self.x, x, self, low)
            self.x, self.edge = x, self.edge + low
            left = ONE
            while left > 0:
                there = self.flow.within(self.x, self.f, left)
                wrong = [i for i, (value, _) in enumerate(self.checks(there)) if value < LEAST]
                if not wrong:
                    self.x, left = there, 0
                    continue
                first, share = None, None
                for index in wrong:
                    inside, outside = 0, left
                    while outside - inside > 1 << 30:
                        middle = (inside + outside) // 2
                        value = self.checks(self.flow.within(self.x, self.f, middle))[index][0]
                        inside, outside = (middle, outside) if value >= LEAST else (inside, middle)
                    if share is None or outside < share:
                        first, share = index, outside
                self.x = self.flow.within(self.x, self.f, share)
                left -= share
                self.change(self.checks(self.x)[first][1])
            self.edge += 1


def waves(path, clock):
    """Changes of the lines and of the command in a VCD, by clock edge; its unit of time is 1 ps or 1 fs."""
    names, changes, edge, unit = {}, [], 0, None
    for line in path.open():
        if line.startswith("$timescale"):
            unit = {"ps": 10**12, "fs": 10**15}[line.split()[2]]
        elif line.startswith("$var"):
            _, _, _, code, name, *_ = line.split()
            names.setdefault(code, name.split("[")[0])
        elif line[0] == "#":
            edge = round(Fraction(int(line[1:]) * clock, unit))
        elif line[0] in "01" and names.get(line[1:].strip()) in ("a_pin", "b_pin"):
            changes.append((edge, names[line[1:].strip()], int(line[0])))
        elif line[0] == "b" and names.get(line.split()[1]) == "command":
            bits = line[1:].split()[0]
            changes.append((edge, "command", int(bits, 2)))
    return changes


def scene_of(name):
    """The devices as their scenes have them, and the way of the hand there and back, in SI."""
    q = Fraction
    ratio = q(6, 1000)
    reduced = 1 / (ratio**2 / q(50, 10**7) + 1 / q(3, 100))
    stiffness = q(20000)
    root = mpmath.sqrt(mpmath.mpf(20000) * reduced.numerator / reduced.denominator)
    damping = q(4, 100) * q(int(root * 2**230), 2**230)
    cable = [(0, 1, ratio, stiffness, damping)]
    rotor, handle = {"inertia": q(50, 10**7)}, {"inertia": q(3, 100)}
    knob = {
        "clock": 16384000,
        "drive": (0, q(23, 1000), 4000 * PI),
        "count": 2 * PI / 8000,
        "dac": (10, 12, 12),
        "late": 4096,
        "peak": q(12, 1000),
        "half": q(1, 5),
    }
    if name == "cable-knob":
        bodies = [{**rotor, "coulomb": q(3, 1000)}, handle]
        return {**knob, "bodies": bodies, "joints": cable, "hand": [(1, q(13889, 10), q(2778, 100))]}
    if name == "heavy-hand":
        hand = {"inertia": q(554, 1000)}
        grip = [(1, 2, q(1), q(13889, 10), q(2778, 100))]
        bodies = [rotor, handle, hand]
        return {**knob, "bodies": bodies, "joints": cable + grip, "hand": [(2, q(135), q(645, 100))], "peak": q(3, 50)}
    button = {
        "inertia": q(12, 10000),
        "spring": q(145083, 100),
        "viscous": q(66, 1000),
        "stop": (q(4, 10000), q(20000), q(2)),
    }
    return {
        "clock": 16384000,
        "bodies": [button],
        "joints": [],
        "drive": (0, q(12, 10), 6000 * PI),
        "hand": [(0, q(800), q(2))],
        "count": q(5, 10**7),
        "dac": (1, 12, 12),
        "late": 0,
        "peak": q(25, 10000),
        "half": q(1, 10),
    }


def compare(hpu, name, edges, told=True):
    scene = scene_of(name)
    if not told:
        scene["bodies"][0]["inertia"] *= 1 + Fraction(1, 10**6)
    clock, half, peak = scene["clock"], scene["half"], scene["peak"]
    turns = int(edges / (clock * half)) + 1
    path = [[f"{float(half * n):g} s", f"{float(peak * (n % 2) * 1000):g} mm"] for n in range(turns + 1)]
    written = "[" + ", ".join(f'["{at}", "{place}"]' for at, place in path) + "]"
    with tempfile.TemporaryDirectory() as folder:
        seconds = float(turns * half)
        sets = [f"hand.path={written}", f"run.duration={seconds:g} s"]
        words = [w for one in sets for w in ("--set", one)]
        command = [hpu, "-q", "run", name, *words, "--vcd", "--no-plot", "-o", f"{folder}/out"]
        ran = subprocess.run(command, capture_output=True)
        assert ran.returncode in (0, 1), ran.stderr.decode()
        changes = waves(Path(folder) / "out" / "wave.vcd", clock)
    network = Network(scene["bodies"], scene["joints"], scene["drive"], scene["hand"], Fraction(1, clock))
    motion, wrong, crossings, turned = Motion(network), 0, 0, 0
    count_size, count = fixed(scene["count"]), 0
    full, bits, width = scene["dac"]

    def current(word):
        word = word - (1 << (width + 1)) if word >> width else word
        step, most = 1 << (width + 1 - bits), 1 << (bits - 1)
        rounded = min(max((word + step // 2) // step, -most), most - 1)
        return Fraction(-step * rounded * full, 1 << width)

    events = [(int(n * half * clock), 0, "slope", (peak if n % 2 == 0 else -peak) / half) for n in range(turns)]
    for edge, what, value in changes:
        kind = 2 if what == "command" else 1
        events.append((edge + (scene["late"] if what == "command" else 0), kind, what, value))
    # Lines that change at one edge are one event.
    events.sort(key=lambda event: event[:2])
    lines, gray = {"a_pin": 0, "b_pin": 0}, {(0, 0): 0, (0, 1): 1, (1, 1): 2, (1, 0): 3}
    index, last = 0, int(turns * half * clock)

    def look(before, after, here, length):
        nonlocal wrong, turned
        if length and (before[2] < 0) != (after[2] < 0) and before[2] and after[2]:
            # The angle turns in between: at its turn, too, it has this count.
            low, high = 0, length
            while high - low > 1:
                middle = (low + high) // 2
                same = (here.flow.leap(before, here.f, middle)[2] < 0) == (before[2] < 0)
                low, high = (middle, high) if same else (low, middle)
            turned += 1
            for at in (low, high):
                wrong += here.flow.leap(before, here.f, at)[1] // count_size != count

    started = False
    while index < len(events):
        edge, kind, what, value = events[index]
        if edge > last:
            break
        index += 1
        if what == "slope":
            motion.upto(edge, look)
            motion.asked(slope=value)
        elif what == "command":
            motion.upto(edge, look)
            motion.asked(current=current(value))
        else:
            lines[what] = value
            while index < len(events) and events[index][:2] == (edge, kind):
                lines[events[index][2]] = events[index][3]
                index += 1
            phase = gray[(lines["a_pin"], lines["b_pin"])]
            if not started:
                zero, started = phase, True
                continue
            step = (phase - zero - count + 1) % 4 - 1
            if step == 0:
                continue
            motion.upto(edge - 1, look)
            before = motion.x[1] // count_size
            count += step
            # The new count may begin within this edge.
            motion.upto(edge, lambda *_: None)
            after = motion.x[1] // count_size
            crossings += 1
            if (before, after) != (count - step, count):
                wrong += 1
                if told and wrong < 5:
                    print(f"{name}: edge {edge}: counts {before}, {after}, told {count - step}, {count}")
    if told:
        told_of = f"{crossings} counts, {motion.ends} ends of modes, {turned} turns"
        print(f"{name:20} {last:>12} edges, {told_of}: {wrong} off")
    return wrong


def main():
    hpu, edges = sys.argv[1], int(float(sys.argv[2])) if len(sys.argv) > 2 else 10**8
    names = sys.argv[3:] or ["cable-knob", "heavy-hand", "voice-coil-button"]
    off = sum(compare(hpu, name, edges) for name in names)
    unseen = [name for name in names if not compare(hpu, name, edges // 20, told=False)]
    for name in unseen:
        print(f"{name}: an inertia that is off by a millionth is not found")
    sys.exit(1 if off or unseen else 0)


main()
