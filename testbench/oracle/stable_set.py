#!/usr/bin/env python3
"""The stable sets that `hpu limits` proves, against eigenvalues by numpy on a dense scan of stiffnesses.

Random linear loops, sampled and hybrid, motors and masses, with and without hand, damping and delay. For each the map
from sample to sample is built here, apart from the emulator, and its eigenvalues taken at 4000 stiffnesses over the
range. Every change of the verdict between neighbours is bisected. Each has to be an end of the set within 1e-9, and
each end of the set has to be such a change, or to lie with another between two neighbours of the scan. Where the radius
hardly changes with the stiffness doubles place a change no better than to 1e-8 or so: where numpy's is 1e-9 to 1e-6 off
an end, it is bisected again by mpmath with 40 digits, and that counts.

Usage: testbench/oracle/stable_set.py HPU [CASES [SEED]]
Exit codes: 0 all agree, 1 something differs.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import mpmath
import numpy as np

POINTS = 4000
WITHIN = 1e-9

# The published motor: ohm, henry, N.m/A, kg.m2 at the wheel.
MOTOR = {"ohm": 2.346, "henry": 0.226e-3, "constant": 25.9e-3}


def exponential(a):
    """e^a for a stack of matrices: Taylor's series of a / 2^s, squared s times."""
    norm = np.abs(a).sum(axis=-1).max()
    squarings = max(0, int(np.ceil(np.log2(max(norm, 1e-300)))) + 3)
    a = a / 2.0**squarings
    term = np.broadcast_to(np.eye(a.shape[-1]), a.shape).copy()
    total = term.copy()
    for k in range(1, 19):
        term = term @ a / k
        total = total + term
    for _ in range(squarings):
        total = total @ total
    return total


def radius(case, stiffnesses):
    """Spectral radius of the map from sample to sample, for each stiffness."""
    count = len(stiffnesses)
    grip, grip_damping = case["hand"] or (0.0, 0.0)
    if case["kind"] == "motor":
        r, l, k = MOTOR["ohm"], MOTOR["henry"], MOTOR["constant"]
        j, b = case["inertia"], case["viscous"] + grip_damping
        plant = np.array([[-r / l, -k / l, 0], [k / j, -b / j, -grip / j], [0, 1, 0]])
        push = np.array([r / (k * l), 0, 0])
    else:
        m, b = case["inertia"], case["viscous"] + grip_damping
        plant = np.array([[-b / m, -grip / m], [1, 0]])
        push = np.array([1 / m, 0])
    n = len(plant)
    a = np.zeros((count, n + 1, n + 1))
    a[:, :n, :n] = plant
    a[:, :n, n] = push
    spring = stiffnesses.copy()
    if case["live"]:
        a[:, :n, n - 1] -= push[None, :] * stiffnesses[:, None]
        spring[:] = 0.0
    period, clock = case["clocks"], case["clock"]
    whole, late = divmod(case["delay"], period)
    before, after = exponential(a * (late / clock)), exponential(a * ((period - late) / clock))
    # The plant, the position before, the efforts of this and earlier samples, the oldest last.
    size = n + 2 + whole
    previous, first, oldest = n, n + 1, n + 1 + whole
    damper = case["damping"] * clock / period
    effort = np.zeros((count, size))
    effort[:, n - 1] = -(spring + damper)
    effort[:, previous] = damper
    taking = effort.copy()
    if whole:
        taking[:] = 0.0
        taking[:, oldest - 1] = 1.0
    change = np.zeros((count, size, size))
    change[:, :n, :n] = after[:, :n, :n] @ before[:, :n, :n]
    change[:, :n, oldest] += (after[:, :n, :n] @ before[:, :n, n : n + 1])[:, :, 0]
    change[:, :n, :] += after[:, :n, n][:, :, None] * taking[:, None, :]
    change[:, previous, n - 1] = 1.0
    change[:, first, :] = effort
    for at in range(first + 1, oldest + 1):
        change[:, at, at - 1] = 1.0
    return np.abs(np.linalg.eigvals(change)).max(axis=1)


def placed(case, near):
    """A change of the verdict near a stiffness, by 40 decimal digits; of loops without delay."""
    with mpmath.workdps(40):
        grip, grip_damping = (mpmath.mpf(x) for x in case["hand"] or (0, 0))
        j, b = mpmath.mpf(case["inertia"]), mpmath.mpf(case["viscous"]) + grip_damping
        period_s = mpmath.mpf(case["clocks"]) / case["clock"]
        if case["kind"] == "motor":
            r, l, k = (mpmath.mpf(MOTOR[key]) for key in ("ohm", "henry", "constant"))
            rows = [[-r / l, -k / l, 0, r / (k * l)], [k / j, -b / j, -grip / j, 0], [0, 1, 0, 0], [0, 0, 0, 0]]
        else:
            rows = [[-b / j, -grip / j, 1 / j], [1, 0, 0], [0, 0, 0]]
        n = len(rows) - 1

        def stable(stiffness):
            a = mpmath.matrix(rows)
            if case["live"]:
                for row in range(n):
                    a[row, n - 1] -= a[row, n] * stiffness
            flow = mpmath.expm(a * period_s)
            spring, damper = 0 if case["live"] else stiffness, mpmath.mpf(case["damping"]) / period_s
            change = mpmath.matrix(n + 1, n + 1)
            for row in range(n):
                for column in range(n):
                    change[row, column] = flow[row, column]
                change[row, n - 1] -= (spring + damper) * flow[row, n]
                change[row, n] = damper * flow[row, n]
            change[n, n - 1] = 1
            return max(abs(x) for x in mpmath.eig(change, left=False, right=False)) < 1

        low, high = mpmath.mpf(near) * (1 - mpmath.mpf("1e-6")), mpmath.mpf(near) * (1 + mpmath.mpf("1e-6"))
        below = stable(low)
        if below == stable(high):
            return None
        while high - low > 1e-13 * high:
            middle = (low + high) / 2
            low, high = (middle, high) if stable(middle) == below else (low, middle)
        return float(low)


def drawn(random):
    """A random loop."""
    live = bool(random.integers(2))
    kind = "motor" if random.random() < 0.7 else "mass"
    rate = float(random.choice([100, 200, 250, 300, 400, 500, 800, 1000, 2000, 5000, 10000]))
    clock = 1_000_000
    case = {"live": live, "kind": kind, "clock": clock, "clocks": round(clock / rate)}
    if kind == "motor":
        case["inertia"] = float(10 ** random.uniform(-5.5, -4.3))
        case["viscous"] = float(10 ** random.uniform(-6.5, -4))
        scale = 1e-3
    else:
        case["inertia"] = float(10 ** random.uniform(-2, 0))
        case["viscous"] = float(10 ** random.uniform(-1.5, 1))
        scale = 3.0
    case["damping"] = 0.0 if random.random() < 0.15 else float(scale * 10 ** random.uniform(-1.5, 0.3))
    case["hand"] = None
    if random.random() < 0.4:
        case["hand"] = (float(300 * scale * 10 ** random.uniform(-1, 1)), float(scale * 10 ** random.uniform(-2, 0)))
    case["delay"] = int(random.choice([0, 0, 0, 1, 2, 3])) * case["clocks"] // int(random.choice([1, 2, 4]))
    case["range"] = [1e-3, 20.0] if kind == "motor" else [1.0, 1e5]
    return case


def scene(case):
    """The same as a scene."""
    unit = case["kind"] == "motor"
    if unit:
        # A wheel of no ratio and no inertia of its own.
        device = (
            f'kind = "motor"\nresistance = {MOTOR["ohm"]!r}\ninductance = {MOTOR["henry"]!r}\n'
            f'torque_constant = {MOTOR["constant"]!r}\nrotor_inertia = {case["inertia"]!r}\n'
            f'viscous_friction = {case["viscous"]!r}\n'
        )
    else:
        device = f'kind = "mass"\nmass = {case["inertia"]!r}\ndamping = {case["viscous"]!r}\n'
    hand = 'kind = "none"'
    if case["hand"]:
        k, b = case["hand"]
        hand = f'kind = "spring_damper"\nstiffness = {k!r}\ndamping = {b!r}\npath = [[0, 0]]'
    clock, clocks = case["clock"], case["clocks"]
    return (
        f'about = "A random loop."\n[device]\n{device}[clock]\nfrequency = "{clock} Hz"\n'
        f'[method]\nkind = "{"hybrid" if case["live"] else "conventional"}"\nsample_rate = {clock / clocks!r}\n'
        f'[wall]\nposition = 0\nstiffness = {case["range"][0]!r}\ndamping = {case["damping"]!r}\n[hand]\n{hand}\n'
        f'[model]\ndatapath = "linear"\ndelay = {case["delay"] / clock!r}\n[run]\nduration = "1 s"\n'
    )


def scanned(case):
    """Places where the verdict changes, from a dense scan; and the scan."""
    low, high = case["range"]
    half = POINTS // 2
    grid = np.unique(np.concatenate([np.geomspace(low, high, half), np.linspace(low, high, half)]))
    stable = radius(case, grid) < 1
    edges = []
    for at in np.flatnonzero(stable[1:] != stable[:-1]):
        a, b = grid[at], grid[at + 1]
        while b - a > 1e-12 * b:
            points = np.linspace(a, b, 33)
            inside = radius(case, points) < 1
            turn = int(np.flatnonzero(inside != stable[at])[0])
            a, b = points[turn - 1], points[turn]
            if turn == 0:
                break
        edges.append(0.5 * (a + b))
    return grid, edges


def compared(hpu, folder, case):
    """What differs, whether the set has a hole, and the farthest end."""
    path = folder / "loop.toml"
    path.write_text(scene(case))
    command = [hpu, "limits", str(path), "--json", "--quiet", "--range", f'{case["range"][0]}..{case["range"][1]}']
    ran = subprocess.run(command, capture_output=True, text=True, check=False)
    if ran.returncode != 0:
        return [f"exit {ran.returncode}: {ran.stderr.strip()}"], False, 0.0, 0
    said = json.loads(ran.stdout)["linear"]
    if said is None or said["open"]:
        return [f"not told: {said}"], False, 0.0, 0
    ends = [
        0.5 * (end["at"] + end["beyond"])
        for stretch in said["stable"]
        for end in (stretch["from"], stretch["to"])
        if end["beyond"] is not None
    ]
    grid, edges = scanned(case)
    wrong, worst, far = [], 0.0, list(ends)
    for edge in edges:
        nearest = min(ends, key=lambda end: abs(end - edge), default=np.inf)
        off = abs(nearest - edge) / edge
        if WITHIN < off < 1e-6 and not case["delay"]:
            placed_at = placed(case, edge)
            off = abs(nearest - placed_at) / placed_at if placed_at else off
        if off > WITHIN:
            wrong.append(f"crossing missed or misplaced: {edge!r}, nearest end {nearest!r}")
        else:
            worst = max(worst, off)
            far.remove(nearest)
    # An island or a gap between two neighbours of the scan has two ends there.
    cells = np.searchsorted(grid, far)
    for cell in np.unique(cells):
        within = [end for end, at in zip(far, cells) if at == cell]
        if len(within) % 2:
            wrong.append(f"an end that the scan does not have: {within}")
    return wrong, len(said["stable"]) > 1 or (bool(edges) and len(edges) > 1), worst, len(edges)


def main():
    hpu, cases = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 1000
    seed = int(sys.argv[3]) if len(sys.argv) > 3 else 1
    random = np.random.default_rng(seed)
    failed = holes = crossings = live = 0
    worst = 0.0
    with tempfile.TemporaryDirectory() as folder:
        for index in range(cases):
            case = drawn(random)
            wrong, hole, off, edges = compared(hpu, Path(folder), case)
            for line in wrong:
                print(f"case {index}: {line}: {case}", flush=True)
            failed, holes, live = failed + bool(wrong), holes + hole, live + case["live"]
            crossings, worst = crossings + edges, max(worst, off)
    print(
        f"{cases} loops of seed {seed}, {live} of them hybrid: {crossings} crossings in scans of {POINTS} stiffnesses, "
        f"{holes} loops with more than one; {failed} loops differ; the farthest end is {worst:.1e} off"
    )
    sys.exit(failed > 0)


if __name__ == "__main__":
    main()
