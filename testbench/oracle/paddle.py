#!/usr/bin/env python3
"""The firmware of EPFL's haptic paddle with its motor, written apart from hpu: the oracle of `epfl_paddle_loop`.

The firmware computes in its own order, in float32 or in doubles. The winding flows by exact exponentials between
events, whose times are whole clocks of 168 MHz: ADC samples, PWM edges, ticks of the current loop and of the haptic
loop, in this order where they fall together.

Usage: testbench/oracle/paddle.py [locked | steps [switched] | cycle]. Needs numpy.
  locked   (also without an argument) constants and two rows of currents with a locked rotor, held against figures that
           were computed with 40 digits elsewhere; exit code 1 if one differs
  steps    the steps of the encoder logs: peak, time from 1 to 10 degrees, place at rest
  cycle    the limit cycle on the Hall sensor: amplitude and period
"""

import math
import sys

import numpy as np

CLOCK_HZ = 168_000_000
STEP, ADC, PERIOD, CURRENT, HAPTIC = 5, 320, 5120, 8568, 58_968
R, L, KT, GEAR, B, M_GL = 10.6, 1.25e-3, 0.0538, 15.0, 7.9e-7 * 225, 0.01464
J, F = 5.346e-4, 0.690e-3
SUPPLY, SAMPLES, DUTY = 24.0, 33, 0.98
ADC_A = 2.5 / (0.025 * 30 * 4095)
CLAMP_NM = 0.0323
# Figures with 40 digits: of each bridge the first 24 codes, then at tick 10 and 99 filter, integrator and current, the
# code of tick 99, and the current after 5100 us.
KNOWN = {
    "averaged": (
        "1011 1011 1011 1011 1011 872 661 441 249 114 64 140 296 476 670 849 974 1011 997 896 740 555 379 244 171 172 "
        "248 386 550 714",
        (0.492430091678, -4.04687158515, 0.384289644355),
        (0.350699165303, -4.00584887052, -0.00396306877018, 417),
        -0.14956137365156,
    ),
    "switched": (
        "1011 1011 1011 1011 1011 869 657 426 225 87 46 147 312 496 688 860 982 1011 1007 908 748 551 359 214 138 148 "
        "249 396 566 731",
        (0.499631899733, -4.59259805855, 0.304040110107),
        (0.369746310316, -4.86284387553, -0.0998776726987, 358),
        -0.17225700570437,
    ),
}


class Firmware:
    """The two loops of the firmware in numbers of one type; positive currents push towards positive angles."""

    def __init__(self, number=np.float32, gains=(0.05, 0.0, 0.0003), zero_a=0.0, angle=0.0):
        self.f = number
        self.kp, self.ki, self.kd = map(number, gains)
        self.zero = number(zero_a)
        self.filtered = self.sum = self.target_a = number(0)
        self.angle = self.before = number(angle)
        self.share = number(350e-6) * number(2 * math.pi * 100)
        self.accumulated = number(0)

    def current(self, codes):
        """A tick of the current loop with the newest codes of the ADC; returns the code of the bridge."""
        f = self.f
        mean = f(sum(codes)) / f(SAMPLES) * f(ADC_A) - self.zero
        self.filtered = f(0.95) * self.filtered + f(0.05) * mean
        error = self.target_a - self.filtered
        self.sum = min(max(self.sum + f(5e5) * error * f(50e-6), f(-10)), f(10))
        volts = f(15.6) * self.target_a + f(100) * error + self.sum
        duty = min(max(volts / f(SUPPLY), f(-DUTY)), f(DUTY))
        return math.floor((duty + f(1)) * f(511))

    def haptic(self, reading, target):
        """A tick of the haptic loop with angles in degrees; sets the target of the current."""
        f = self.f
        self.before, self.angle = self.angle, self.share * f(reading) + (f(1) - self.share) * self.angle
        error = f(target) - self.angle
        self.accumulated += error
        rate = (self.before - self.angle) / f(350e-6)
        torque = (self.kp * error + self.ki * self.accumulated + self.kd * rate) / f(GEAR)
        self.target_a = min(max(torque, f(-CLAMP_NM)), f(CLAMP_NM)) / f(KT)


def volts(code, phase):
    """The bridge at a place of its period in clocks, which is averaged if that is None."""
    return SUPPLY * (2 * code / 1024 - 1) if phase is None else SUPPLY if phase < STEP * code else -SUPPLY


def locked(switched, number=float, target_a=0.3, ticks=100, rounds=True):
    """Returns of each tick the code, filter, integrator and current, and the current 5100 us after the step."""
    firmware = Firmware(number)
    firmware.target_a = number(target_a)
    codes, wanted, code, now, current = [0.0] * SAMPLES, 511, 511, 0, 0.0
    rows = []
    end = ticks * CURRENT
    times = set(range(ADC, end + 1, ADC)) | set(range(0, end + 1, PERIOD)) | set(range(CURRENT, end + 1, CURRENT))
    last = None
    for edge in sorted(times | {857_000 - 200}):
        while now < edge:
            phase = now % PERIOD
            upto = edge
            if switched and phase < STEP * code:
                upto = min(edge, now - phase + STEP * code)
            v = volts(code, phase if switched else None)
            current = v / R + (current - v / R) * math.exp(-R / L * (upto - now) / CLOCK_HZ)
            now = upto
        if edge % PERIOD == 0:
            code = wanted
        if edge % ADC == 0 and edge:
            reading = current / ADC_A
            codes = codes[1:] + [math.floor(reading + 0.5) if rounds else reading]
        if edge % CURRENT == 0 and edge:
            wanted = firmware.current(codes)
            rows.append((wanted, firmware.filtered, firmware.sum, current))
        if edge == 856_800:
            last = current
    return rows, last


class Paddle:
    """Motor, gear and paddle: x = (current, speed, angle, 1), with Coulomb friction, between events of whole clocks."""

    def __init__(self, angle, friction_nm=F, inertia=J):
        self.x = np.array([0.0, 0.0, angle, 1.0])
        self.friction = GEAR * friction_nm
        self.inertia, self.kept, self.sign = inertia, {}, 0

    def flow(self, v, sign, seconds):
        a = np.zeros((4, 4))
        a[0] = [-R / L, -KT * GEAR / L, 0, v / L]
        if sign:
            a[1] = [GEAR * KT / self.inertia, -B / self.inertia, -M_GL / self.inertia,
                    -sign * self.friction / self.inertia]
            a[2, 1] = 1
        a *= seconds
        total, term, order = np.eye(4), np.eye(4), 1
        while np.abs(term).max() > 1e-19:
            term = term @ a / order
            total = total + term
            order += 1
        return total

    def drive(self, x):
        return GEAR * KT * x[0] - M_GL * x[2]

    def move(self, v, clocks):
        left = clocks
        while left > 0:
            if self.sign == 0 and abs(self.drive(self.x)) > self.friction:
                self.sign = 1 if self.drive(self.x) > 0 else -1
            key = (v, self.sign, left)
            if key not in self.kept:
                self.kept[key] = self.flow(v, self.sign, left / CLOCK_HZ)
            new = self.kept[key] @ self.x
            if self.sign == 0:
                ends = abs(self.drive(new)) > self.friction
            else:
                ends = new[1] * self.sign < 0
            if not ends:
                self.x = new
                return
            low, high = 0.0, left
            for _ in range(50):
                middle = (low + high) / 2
                at = self.flow(v, self.sign, middle / CLOCK_HZ) @ self.x
                ended = abs(self.drive(at)) > self.friction if self.sign == 0 else at[1] * self.sign < 0
                low, high = (low, middle) if ended else (middle, high)
            self.x = self.flow(v, self.sign, high / CLOCK_HZ) @ self.x
            left -= high
            if self.sign != 0:
                self.x[1], self.sign = 0.0, 0
            else:
                self.sign = 1 if self.drive(self.x) > 0 else -1


def run(gains, seconds, *, hall=None, friction_nm=F, switched=False, start=-0.186, target=10.0, enable_s=0.02,
        number=np.float32, phase=(0, 0), adc=252):
    """Returns the filtered angle in degrees at each tick of the haptic loop, and the true one.

    The converter's samples begin `adc` clocks after a period of the modulator does.
    """
    degree, quantum = math.pi / 180, 0.012
    paddle = Paddle(start * degree, friction_nm)
    zero = SUPPLY * (2 * 511 / 1024 - 1) / R
    paddle.x[0] = zero
    first = start if hall else math.floor(start / quantum) * quantum
    firmware = Firmware(number, gains, zero, first)
    firmware.before = firmware.angle
    random, lagged = np.random.default_rng(1), start / hall["gain"] if hall else 0.0
    codes, wanted, code, now = [round(zero / ADC_A)] * SAMPLES, 511, 511, 0
    end = round(seconds * CLOCK_HZ)
    rows, next_current, next_haptic = [], CURRENT - phase[0], HAPTIC - phase[1]
    enabled = False
    while now < end:
        sample, period = ((now - adc) // ADC + 1) * ADC + adc, (now // PERIOD + 1) * PERIOD
        edge = min(sample, period, next_current, next_haptic)
        if switched and now % PERIOD < STEP * code:
            edge = min(edge, now - now % PERIOD + STEP * code)
        before = paddle.x[2]
        paddle.move(volts(code, now % PERIOD if switched else None), edge - now)
        if hall:
            share = math.exp(-(edge - now) / CLOCK_HZ / hall["lag"])
            held = (before + paddle.x[2]) / 2 / degree / hall["gain"]
            lagged = held + (lagged - held) * share
        now = edge
        if now % PERIOD == 0:
            code = wanted
        if now % ADC == adc:
            # Where the converter's codes end is written nowhere; none does here.
            codes = codes[1:] + [math.floor(paddle.x[0] / ADC_A + 0.5)]
        if now == next_current:
            next_current += CURRENT
            wanted = firmware.current(codes)
        if now == next_haptic:
            next_haptic += HAPTIC
            degrees = paddle.x[2] / degree
            if hall:
                step = 0.03663
                reading = math.floor((lagged + random.normal(0, hall["noise"])) / step) * step
            else:
                reading = math.floor(degrees / quantum) * quantum
            enabled = now >= enable_s * CLOCK_HZ
            firmware.haptic(reading, target if enabled else firmware.angle)
            if not enabled:
                firmware.target_a, firmware.accumulated = firmware.f(0), firmware.f(0)
            rows.append((float(firmware.angle), degrees))
    return rows


def check_locked():
    wrong = 0
    for name, (codes, at_10, at_99, last) in KNOWN.items():
        rows, after = locked(name == "switched")
        shown = [row[0] for row in rows]
        known = [int(code) for code in codes.split()]
        pairs = list(zip(rows[9][1:], at_10)) + list(zip(rows[98][1:], at_99[:3])) + [(after, last)]
        worst = max(abs(one - other) / max(1, abs(other)) for one, other in pairs)
        agrees = shown[: len(known)] == known and rows[98][0] == at_99[3] and worst < 1e-10
        wrong += not agrees
        single = [row[0] for row in locked(name == "switched", np.float32)[0]]
        apart = sum(one != other for one, other in zip(shown, single))
        print(f"{name}: {'agrees' if agrees else 'DIFFERS'}, worst {worst:.1e}; float32 has {apart} other codes of 100")
    return wrong


def steps(switched):
    print("gains                     peak deg  tick  1 to 10 deg, log ms  at rest deg")
    for gains in [(0.05, 0, 0.0003), (0.05, 0, 0.0008), (0.01, 0, 0.0003), (0.05, 0.0001, 0.0008)]:
        angles = np.array([row[0] for row in run(gains, 0.52, switched=switched)])
        peak = int(angles.argmax())
        up, over = np.argmax(angles > 1), np.argmax(angles > 10)
        rise = f"{(over - up) * 0.35:.2f}" if over else "never"
        print(f"{str(gains):25} {angles[peak]:8.3f}  {peak + 1:4}  {rise:>19}  {angles[-1]:11.3f}")


def cycle():
    hall = {"gain": 0.8807, "lag": 445e-6, "noise": 0.026}
    rows = run((0.05, 0, 0), 3.0, hall=hall, friction_nm=1.3e-3, start=0.0)
    angles = np.array([row[0] for row in rows[4000:]])
    middle = (angles.max() + angles.min()) / 2
    above = angles > middle
    ups = [n - (angles[n] - middle) / (angles[n] - angles[n - 1]) for n in range(1, len(angles))
           if above[n] and not above[n - 1]]
    first_harmonic = np.diff(ups).mean() * 0.35
    print(f"amplitude {(angles.max() - angles.min()) / 2:.3f} deg, period {first_harmonic:.3f} log ms")


if __name__ == "__main__":
    asked = sys.argv[1:] or ["locked"]
    if asked[0] == "locked":
        sys.exit(1 if check_locked() else 0)
    elif asked[0] == "steps":
        steps("switched" in asked)
    else:
        cycle()
