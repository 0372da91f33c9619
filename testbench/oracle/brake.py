#!/usr/bin/env python3
"""ARCH-COMP's Brake with a controller in real numbers, to forty digits.

Needs mpmath. Prints the figures that crates/plant/tests/all/transfer.rs and testbench/scenes/brake.toml expect: the
position after 0.1 s, at sample 1001 and after 0.5 s, the instant at which it passes 0.05 m, and its maximum; then a
bound of all later samples, by the modes of the map from sample to sample. The numbers of the model are those of
JuliaReach/ARCH2024_AFF_RE, models/EMBrake/embrake.jl at ace7237e.
"""

from mpmath import exp, findroot, log, matrix, mp, mpf

mp.dps = 40
L, KP, KI, R, K, DROT, RATIO = map(mpf, ("0.001", "10000", "1000", "0.5", "0.02", "0.1", "113.1167"))
TS, X0 = mpf("0.0001"), mpf("0.05")
RATE, SLIDE = (R + K * K / DROT) / L, K / RATIO / DROT


def flow(state, volts, seconds):
    """Returns current and position after a time under a constant voltage."""
    current, position = state
    still = volts / L / RATE
    decay = exp(-RATE * seconds)
    moved = still * seconds + (current - still) * (1 - decay) / RATE
    return still + (current - still) * decay, position + SLIDE * moved


def main():
    state, total, volts = (mpf(0), mpf(0)), mpf(0), mpf(0)
    passed = greatest = None
    for sample in range(1, 20001):
        before, held = state, volts
        state = flow(before, held, TS)
        if passed is None and state[1] >= X0:
            at = findroot(lambda t: flow(before, held, t)[1] - X0, TS / 2)
            passed = (sample - 1) * TS + at
        # The position turns where the current is 0.
        if before[0] > 0 >= state[0]:
            still = held / L / RATE
            at = log((before[0] - still) / -still) / RATE
            turn = flow(before, held, at)[1], (sample - 1) * TS + at
            greatest = max(greatest or turn, turn)
        if sample in (1000, 1001, 5000):
            print(f"sample {sample}: {mp.nstr(state[1], 16)} m")
        total += TS * (X0 - state[1])
        volts = KP * (X0 - state[1]) + KI * total
    print(f"passes 0.05 m at {mp.nstr(passed, 16)} s")
    print(f"greatest {mp.nstr(greatest[0], 16)} m at {mp.nstr(greatest[1], 12)} s")
    later(state, total)


def later(state, total):
    """Bounds all later samples by the moduli of the modes that are left."""
    decay = exp(-RATE * TS)
    hold = [(1 - decay) / RATE / L, SLIDE * (TS - (1 - decay) / RATE) / RATE / L]
    # Current, error and sum of errors just after a sample.
    gains = [mpf(0), KP, KI]
    after_current = [decay, hold[0] * gains[1], hold[0] * gains[2]]
    slide = SLIDE * (1 - decay) / RATE
    after_error = [-slide, 1 - hold[1] * gains[1], -hold[1] * gains[2]]
    after_sum = [TS * x for x in after_error]
    after_sum[2] += 1
    modes = matrix([after_current, after_error, after_sum])
    values, vectors = mp.eig(modes)
    print("modes", [mp.nstr(abs(value), 14) for value in values])
    parts = mp.lu_solve(vectors, matrix([state[0], X0 - state[1], total]))
    reach = sum(abs(vectors[1, mode] * parts[mode]) for mode in range(3))
    print(f"after 2 s every sample is within {mp.nstr(reach, 8)} m of 0.05 m")


if __name__ == "__main__":
    main()
