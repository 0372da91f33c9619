#!/usr/bin/env python3
"""Writes the states of a motor and a hand's spring after so many clock edges, to 32 digits: the table of the test
`a_flow_has_thirty_digits` in crates/plant/src/device/tests.rs. It needs mpmath.

Each number is a pair of floats whose sum it is."""

from mpmath import expm, matrix, mp, mpf

mp.dps = 80
ohm = mpf(2.35) + 2 * mpf(0.01)
henry, torque, inertia, stiffness, volt, edge_s = (mpf(x) for x in (2.3e-4, 0.026, 1.1e-5, 0.3, 24.0, 20e-9))
drag = mpf(1.3e-6) + mpf(1e-4)
# Current, speed, angle, the hand's intent, 1.
rates = matrix([
    [-ohm / henry, -torque / henry, 0, 0, volt / henry],
    [torque / inertia, -drag / inertia, -stiffness / inertia, stiffness / inertia, 0],
    [0, 1, 0, 0, 0],
    [0, 0, 0, 0, 0],
    [0, 0, 0, 0, 0],
])
start = matrix([mpf(0.01), mpf(0.02), mpf(0.1), mpf(0.3), 1])
for edges in [1, 1000, 4096, 1_000_000, 12_800_000]:
    # The series of a short time, squared: it loses some ten of the eighty digits.
    squarings = max(0, edges.bit_length() - 10)
    flow = expm(rates * (edge_s * edges / 2**squarings), method="taylor")
    for _ in range(squarings):
        flow = flow * flow
    state = flow * start
    pairs = [(float(x), float(x - mpf(float(x)))) for x in state[:3]]
    print(f"({edges}, [{', '.join('(%r, %r)' % pair for pair in pairs)}]),")
