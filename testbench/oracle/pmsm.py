#!/usr/bin/env python3
"""Writes the record of a motor of three phases on its inverter, integrated with 40 decimal places.

Cases are the same as in crates/plant/tests/all/pmsm_record.rs, which holds the program against the record: random
gate sequences with dead time, periods with one leg or all legs off, friction, cogging, salience and a hand. The
equations are written here once more and in another form: in the rotor's frame with voltages of terminals where three
phases conduct, as a loop of two phases where one floats. One case has a knob on a compliant joint, with stops. Which
diodes conduct is found by opening the one whose terminal is farthest beyond its range, again and again. A segment is
at most 6 us long; its series go on until their terms are below 10^-40.

Usage: testbench/oracle/pmsm.py [CASE...] > testbench/record/pmsm.txt. Needs mpmath. All cases take some 25 minutes.
"""

import sys
from mpmath import mp, mpf, fdot, cos, sin, pi, floor, ceil, sqrt

mp.dps = 45
# Edges of 2^-43 s.
EDGE = mpf(2) ** -43
SECOND = 1 << 43
STEP_S = mpf(6) / 10**6
ORDER = 26
PHI = [mpf(0), 2 * pi / 3, 4 * pi / 3]
COS3, SIN3 = [cos(a) for a in PHI], [sin(a) for a in PHI]

HIGH, LOW, OPEN = "H", "L", "O"


def number(text):
    """The f64 of a decimal number."""
    return mpf(float(text))


class Case:
    def __init__(self, name, seed, periods, speed, angle, **given):
        self.name, self.seed, self.periods = name, seed, periods
        self.speed, self.angle = number(speed), number(angle)
        plain = dict(
            p=7, r="0.8", d="0.4e-3", q="0.4e-3", psi="6e-3", inertia="2e-5", viscous="1e-5", coulomb="0", stiction="0",
            supply="24", rs="0", ron="0", drop="0", cogging=[], stiffness="0", damping="0", intent="0",
            # A knob: its inertia (0: none), viscous friction and speed, the knob's turns for one of the rotor, the
            # joint, a torque on it, and stops on both sides.
            knob="0", drag="0", start="0", ratio="0", joint="0", damper="0", push="0", end="0", stop="0", cushion="0",
        )
        for key, value in {**plain, **given}.items():
            if key == "cogging":
                value = [(order, number(size), number(phase)) for order, size, phase in value]
            elif key != "p":
                value = number(value)
            setattr(self, key, value)


CASES = [
    Case("surface", 1, 400, "20", "0.3", drop="0.7", ron="0.02", rs="0.05"),
    Case(
        "salient", 2, 400, "-15", "1.2", d="0.3e-3", q="0.5e-3", drop="0.7", ron="0.03", rs="0.1", coulomb="2e-3",
        stiction="3e-3", cogging=[(42, "1e-3", "0.5"), (84, "-0.5e-3", "1.0"), (14, "0.2e-3", "0")],
    ),
    Case("spun", 3, 400, "520", "0", d="0.5e-3", q="0.4e-3", drop="0.6", rs="0.02", inertia="1e-4"),
    Case(
        "held", 4, 400, "0.5", "-0.2", drop="0.5", ron="0.01", coulomb="4e-3", stiction="6e-3", inertia="4e-6",
        stiffness="0.3", damping="2e-4", intent="-0.1", cogging=[(12, "3e-3", "0.2")],
    ),
    Case(
        "knob", 5, 240, "6", "0", d="0.3e-3", drop="0.7", ron="0.02", rs="0.05", inertia="4e-6", coulomb="1e-3",
        stiction="2e-3", cogging=[(42, "1e-3", "0.5")], knob="8e-6", drag="1e-5", start="3", ratio="0.5", joint="2",
        damper="1e-4", push="2e-2", end="0.02", stop="15", cushion="5e-4",
    ),
]


class SplitMix:
    def __init__(self, seed):
        self.state = seed

    def next(self):
        mask = (1 << 64) - 1
        self.state = (self.state + 0x9E3779B97F4A7C15) & mask
        z = self.state
        z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & mask
        z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & mask
        return z ^ (z >> 31)

    def below(self, bound):
        return (self.next() * bound) >> 64


PERIOD = SECOND // 20000
DEAD = SECOND // 1000000


def switchings(case):
    """Edges and legs: complementary gates around the middle of each period, with dead time; one period in eight all
    legs are off, one in eight a leg is."""
    random, legs, given = SplitMix(case.seed), [LOW] * 3, [(0, (LOW, LOW, LOW))]
    for period in range(case.periods):
        begin, kind, changes = period * PERIOD, random.below(8), []
        for x in range(3):
            on = PERIOD // 10 + random.below(PERIOD // 10 * 8)
            rise = begin + (PERIOD - on) // 2
            fall = rise + on
            if kind == 0 or kind == 1 + x:
                changes += [(begin + 1 + x, x, OPEN)]
                continue
            if legs[x] == OPEN:
                changes += [(begin + 1 + x, x, LOW)]
            changes += [(rise, x, OPEN), (rise + DEAD, x, HIGH), (fall, x, OPEN), (fall + DEAD, x, LOW)]
        for edge, x, leg in sorted(changes):
            legs[x] = leg
            given.append((edge, tuple(legs)))
    return given


class Motion:
    """State, paths and series."""

    def __init__(self, case):
        self.case = case
        self.t = mpf(0)
        self.current = [mpf(0), mpf(0)]  # d, q
        self.speed, self.angle = case.speed, case.angle
        self.legs = (LOW, LOW, LOW)
        self.paths = [LOW] * 3
        self.resting = [True] * 3
        self.hold = 0
        # The knob, which presses the stop at `touch` times its end, or has left it without being inside again.
        self.turning, self.place = case.start, mpf(0)
        self.touch, self.lifted = 0, False
        self.log = []

    # Paths are H, L, U (upper diode), D (lower diode), O (floating).
    def pull(self, x):
        c, path = self.case, self.paths[x]
        return {"H": c.supply, "L": mpf(0), "U": c.supply + c.drop, "D": -c.drop}[path]

    def series(self):
        """Writes the series of all quantities from now on."""
        c, n = self.case, ORDER
        paths, p = self.paths, c.p
        joined = [x for x in range(3) if paths[x] != OPEN]
        on = [c.ron if paths[x] in "HL" else mpf(0) for x in range(3)]
        rail = [mpf(1) if paths[x] in "HU" else mpf(0) for x in range(3)]
        w, th = [self.speed], [self.angle]
        cs, sn = [cos(p * self.angle)], [sin(p * self.angle)]
        waves = [[[cos(o * self.angle + f)], [sin(o * self.angle + f)]] for o, _, f in c.cogging]
        d, q = [self.current[0]], [self.current[1]]
        torque = []
        kw, kth, force = [self.turning], [self.place], []
        phase = [[], [], []]
        volts = [[], [], []]
        psis = [[], [], []]
        loop = None
        if len(joined) == 2:
            y, z = joined
            loop = [None]
        if len(joined) < 2:
            d, q = [mpf(0)], [mpf(0)]
        mul = lambda a, b, k: fdot(zip(a[: k + 1], b[k::-1]))
        # cos(pθ - φ) and sin(pθ - φ) of each phase.
        cx, sx = [[], [], []], [[], [], []]
        ld, lq = [], []
        if len(joined) == 2:
            big, small, square, other, mass, flux, j = [], [], [], [], [], [], []
        for k in range(n):
            for x in range(3):
                cx[x].append(cs[k] * COS3[x] + sn[k] * SIN3[x])
                sx[x].append(sn[k] * COS3[x] - cs[k] * SIN3[x])
            if len(joined) == 2:
                big.append(cx[y][k] - cx[z][k])
                small.append(sx[y][k] - sx[z][k])
                square.append(mul(big, big, k))
                other.append(mul(small, small, k))
                mass.append(mpf(2) / 3 * (c.d * square[k] + c.q * other[k]))
                if k == 0:
                    j.append(d[0] * cx[y][0] - q[0] * sx[y][0])
                    flux.append(mass[0] * j[0] + c.psi * big[0])
                else:
                    # flux[k] was made below.
                    known = flux[k] - c.psi * big[k] - fdot(zip(mass[1 : k + 1], j[k - 1 :: -1]))
                    j.append(known / mass[0])
                d_k, q_k = mpf(2) / 3 * mul(j, big, k), -mpf(2) / 3 * mul(j, small, k)
                if k:
                    d.append(d_k)
                    q.append(q_k)
            i_k = [mul(cx[x], d, k) - mul(sx[x], q, k) for x in range(3)]
            if len(joined) == 2:
                i_k = [mpf(0)] * 3
                i_k[y], i_k[z] = j[k], -j[k]
            for x in range(3):
                phase[x].append(i_k[x])
            supply = sum(rail[x] * i_k[x] for x in range(3))
            v_k = [
                (self.pull(x) if k == 0 else mpf(0)) - on[x] * i_k[x] - rail[x] * c.rs * supply if x in joined else None
                for x in range(3)
            ]
            for x in joined:
                volts[x].append(v_k[x])
            ld.append(c.d * d[k] + (c.psi if k == 0 else 0))
            lq.append(c.q * q[k])
            for x in range(3):
                psis[x].append(mul(cx[x], ld, k) - mul(sx[x], lq, k))
            # The shaft.
            sum_k = mpf(3) / 2 * p * (c.psi * q[k] + (c.d - c.q) * mul(d, q, k))
            for (o, size, _), wave in zip(c.cogging, waves):
                sum_k -= size * wave[1][k]
            if c.stiffness:
                sum_k += c.stiffness * ((c.intent if k == 0 else 0) - th[k]) - c.damping * w[k]
            if c.knob:
                bend = c.joint * (c.ratio * th[k] - kth[k]) + c.damper * (c.ratio * w[k] - kw[k])
                sum_k -= c.ratio * bend
                side = self.touch
                force.append(c.stop * (side * kth[k] - (c.end if k == 0 else 0)) + side * c.cushion * kw[k])
                moves = bend - c.drag * kw[k] + (c.push if k == 0 else 0)
                if side and not self.lifted:
                    moves -= side * force[k]
                kw.append(moves / c.knob / (k + 1))
                kth.append(kw[k] / (k + 1))
            torque.append(sum_k)
            net = sum_k - c.viscous * w[k] - (self.hold * c.coulomb if k == 0 and self.hold != "stuck" else 0)
            w.append(mpf(0) if self.hold == "stuck" else net / c.inertia / (k + 1))
            th.append(w[k] / (k + 1))
            cs.append(-p * mul(w, sn, k) / (k + 1))
            sn.append(p * mul(w, cs, k) / (k + 1))
            for (o, _, _), wave in zip(c.cogging, waves):
                a, b = mul(w, wave[1], k), mul(w, wave[0], k)
                wave[0].append(-o * a / (k + 1))
                wave[1].append(o * b / (k + 1))
            if len(joined) == 3:
                vd = mpf(2) / 3 * sum(mul(volts[x], cx[x], k) for x in range(3))
                vq = -mpf(2) / 3 * sum(mul(volts[x], sx[x], k) for x in range(3))
                d.append((vd - c.r * d[k] + p * mul(w, lq, k)) / c.d / (k + 1))
                q.append((vq - c.r * q[k] - p * mul(w, ld, k)) / c.q / (k + 1))
            elif len(joined) == 2:
                flux.append((v_k[y] - v_k[z] - 2 * c.r * j[k]) / (k + 1))
            else:
                d.append(mpf(0))
                q.append(mpf(0))
        slope = [[(k + 1) * psis[x][k + 1] for k in range(n - 1)] for x in range(3)]
        terminal = [None] * 3
        for x in range(3):
            if x in joined:
                terminal[x] = volts[x]
            elif joined:
                y = joined[0]
                # The star point by one phase that conducts.
                terminal[x] = [
                    volts[y][k] - c.r * phase[y][k] - slope[y][k] + slope[x][k] for k in range(n - 1)
                ]
        self.now = dict(d=d, q=q, w=w, th=th, phase=phase, torque=torque, terminal=terminal, slope=slope, rail=rail,
                        kw=kw, kth=kth, force=force)

    def conditions(self):
        """Series that stay positive while the paths last, with what happens at their ends."""
        c, now, n = self.case, self.now, ORDER - 1
        found = []
        for x in range(3):
            if self.paths[x] in "UD":
                sign = 1 if self.paths[x] == "D" else -1
                found.append(([sign * v for v in now["phase"][x]], ("zero", x)))
        if self.paths == [OPEN] * 3:
            for x in range(3):
                for y in range(3):
                    if x != y:
                        apart = [b - a for a, b in zip(now["slope"][x], now["slope"][y])]
                        apart[0] += c.supply + 2 * c.drop
                        found.append((apart, ("both", x, y)))
        else:
            supply = [sum(now["rail"][x] * now["phase"][x][k] for x in range(3)) for k in range(n)]
            for x in range(3):
                if self.paths[x] == OPEN:
                    v = now["terminal"][x][:n]
                    low = [v[0] + c.drop] + v[1:]
                    high = [(c.supply + c.drop if k == 0 else 0) - c.rs * supply[k] - v[k] for k in range(n)]
                    found += [(low, ("opens", x, "D")), (high, ("opens", x, "U"))]
        if c.knob:
            place, force = now["kth"][:n], now["force"][:n]
            beyond = lambda side: [side * v - (c.end if k == 0 else 0) for k, v in enumerate(place)]
            if not self.touch:
                found += [([-v for v in beyond(side)], ("touch", side)) for side in (1, -1)]
            elif self.lifted:
                found += [(beyond(self.touch), ("out",)), ([-v for v in force], ("press",))]
            else:
                found.append((force, ("lift",)))
        if self.hold == "stuck":
            found.append(([c.stiction - now["torque"][0]] + [-v for v in now["torque"][1:]], ("break", 1)))
            found.append(([c.stiction + now["torque"][0]] + now["torque"][1:], ("break", -1)))
        elif self.hold:
            found.append(([self.hold * v for v in now["w"]], ("stop",)))
        return found

    def settle(self, begins=None):
        """Finds the paths of all terminals."""
        c = self.case
        cx = [cos(c.p * self.angle - f) for f in PHI]
        sx = [sin(c.p * self.angle - f) for f in PHI]
        i = [self.current[0] * cx[x] - self.current[1] * sx[x] for x in range(3)]
        if sum(self.resting) > 1:
            self.resting = [True] * 3
            self.current = [mpf(0), mpf(0)]
        for x in range(3):
            if self.legs[x] != OPEN:
                self.paths[x] = self.legs[x]
            elif self.resting[x]:
                self.paths[x] = OPEN
            else:
                self.paths[x] = "D" if i[x] > 0 else "U"
        for x, path in begins or []:
            self.paths[x] = path
        for _ in range(4):
            if OPEN not in self.paths:
                return
            self.series()
            worst, chosen = mpf(-1) / 10**30, None
            for terms, what in self.conditions():
                if what[0] in ("opens", "both") and terms[0] < worst:
                    worst, chosen = terms[0], what
            if chosen is None:
                return
            if chosen[0] == "opens":
                self.paths[chosen[1]] = chosen[2]
            else:
                self.paths[chosen[1]], self.paths[chosen[2]] = "U", "D"

    def rub(self, begins=0):
        c = self.case
        if not c.stiction:
            self.hold = 0
        elif self.speed:
            self.hold = 1 if self.speed > 0 else -1
        elif begins:
            self.hold = begins
        else:
            self.hold = "stuck"
            self.series()
            torque = self.now["torque"][0]
            if abs(torque) > c.stiction:
                self.hold = 1 if torque > 0 else -1

    def go(self, until):
        """Moves to a time."""
        while self.t < until:
            self.series()
            step = min(until - self.t, STEP_S)
            first, reason = step, None
            for terms, what in self.conditions():
                at = self.crossing(terms, first, what)
                if at is not None and at < first:
                    first, reason = at, what
            self.move(first)
            if reason is None:
                continue
            if reason[0] in ("touch", "out", "press", "lift"):
                if reason[0] == "touch":
                    self.touch = reason[1]
                if reason[0] in ("touch", "out"):
                    self.place = self.touch * self.case.end
                if reason[0] == "out":
                    self.touch = 0
                self.lifted = reason[0] == "lift"
                continue
            if reason[0] != "stop" and reason[0] != "break":
                self.log.append((self.t, reason[0]))
            begins, breaks = None, 0
            self.resting = [path == OPEN for path in self.paths]
            if reason[0] == "zero":
                self.resting[reason[1]] = True
            elif reason[0] == "opens":
                begins = [(reason[1], reason[2])]
            elif reason[0] == "both":
                begins = [(reason[1], "U"), (reason[2], "D")]
            elif reason[0] == "stop":
                self.speed = mpf(0)
            else:
                breaks = reason[1]
            if reason[0] in ("zero", "opens", "both"):
                self.settle(begins)
            self.rub(breaks)

    def crossing(self, terms, most, what):
        """The first time at which a series becomes negative, or None."""
        terms = terms[: ORDER - 1]
        at = lambda t: mp.polyval(terms[::-1], t)
        rest = sum(abs(v) * most ** (k + 1) for k, v in enumerate(terms[1:]))
        small = abs(terms[0]) < mpf(10) ** -28
        if terms[0] > rest and not small:
            return None
        start = most * mpf(10) ** -6 if small else mpf(0)
        samples = [start + (most - start) * k / 24 for k in range(25)]
        if at(samples[0]) < 0:
            return mpf(0)
        for a, b in zip(samples, samples[1:]):
            if at(b) < 0:
                for _ in range(20):
                    middle = (a + b) / 2
                    a, b = (a, middle) if at(middle) < 0 else (middle, b)
                slopes = [k * v for k, v in enumerate(terms)][1:]
                t = b
                for _ in range(8):
                    t -= at(t) / mp.polyval(slopes[::-1], t)
                return t
        return None

    def move(self, t):
        at = lambda name: mp.polyval(self.now[name][:ORDER][::-1], t)
        self.current = [at("d"), at("q")]
        self.speed, self.angle = at("w"), at("th")
        if self.case.knob:
            self.turning, self.place = at("kw"), at("kth")
        self.t += t

    def switch(self, legs):
        self.resting = [path == OPEN for path in self.paths]
        if self.current == [0, 0]:
            self.resting = [True] * 3
        self.legs = legs
        self.settle()
        self.rub()


def main():
    print("# testbench/oracle/pmsm.py > testbench/record/pmsm.txt")
    state = "state PERIOD i_d i_q speed angle, and a knob's angle"
    print(f"# case NAME; then: {state}; change EDGE of 2^-43 s from 0, the first at or after")
    only = sys.argv[1:]
    for case in CASES:
        if only and case.name not in only:
            continue
        print("case", case.name)
        motion, told = Motion(case), 0
        shown = 0
        for edge, legs in switchings(case) + [(case.periods * PERIOD, None)]:
            while (shown + 1) * 20 * PERIOD <= edge:
                shown += 1
                motion.go(shown * 20 * PERIOD * EDGE)
                knob = [motion.place] if case.knob else []
                numbers = " ".join(mp.nstr(v, 25) for v in [*motion.current, motion.speed, motion.angle, *knob])
                print("state", shown * 20, numbers)
            motion.go(edge * EDGE)
            if legs is not None:
                motion.switch(legs)
            for t, _ in motion.log:
                print("change", int(ceil(t / EDGE)))
            motion.log = []
            sys.stdout.flush()


main()
