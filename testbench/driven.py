#!/usr/bin/env python3
"""Records whether the linear loop as driven is the one that runs: testbench/record/driven.txt.

usage: testbench/driven.py [HPU]
For walls with several modulators, hands and delays: the limit of `hpu limits` as driven, with the stiffness from which
on the PWM's ripple alone has one count where that is less; the highest stiffness that its words were seen to settle at;
and the two stiffnesses, of twelve around the limit, between which the amplitude leaps most with an encoder and gains so
fine that words play no part. Needs a release build; takes some minutes.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
HPU = sys.argv[1] if sys.argv[1:] else ROOT / "target/release/hpu"
RECORD = ROOT / "testbench/record/driven.txt"
# A motor behind a current amplifier: a winding of a thousand times the resistance.
KNOB = """about = "A knob behind a current amplifier, whose command settles in 0 to 64 clocks."
clock.frequency = "256 kHz"
run.duration = "1 s"
[device]
kind = "motor"
resistance = "1100 Ohm"
inductance = "87.5 mH"
torque_constant = "23 mN.m/A"
rotor_inertia = "50 g.cm2"
coulomb_friction = "0 N.m"
wheel_ratio = 10
wheel_inertia = "360 g.cm2"
[encoder]
lines = 2000
[bridge]
supply = "11 kV"
[model]
bridge = "averaged"
[method]
kind = "conventional"
sample_rate = "4 kHz"
position_bits = 16
velocity_bits = 16
stiffness_format = "(0,10,8)"
damping_format = "(0,10,8)"
[method.pwm]
bits = 12
duty = "immediate"
[wall]
position = "1 rad"
stiffness = "0.5 N.m/rad"
damping = "0.5 mN.m.s/rad"
[hand]
kind = "spring_damper"
stiffness = "0.05 N.m/rad"
damping = "1 mN.m.s/rad"
path = [["0 s", 0], ["200 ms", 2]]
"""
PATH = 'hand.path=[["0 s", 0], ["150 ms", 1.4], ["250 ms", 1.9], ["400 ms", 1.2], ["500 ms", {}]]'
# Scene, keys, and the seconds of its runs: loops that grow slowly beyond the limit take longer to show it.
ROWS = [
    ("hybrid-wall", [], 8),
    ("hybrid-wall", ["model.bridge=averaged"], 24),
    ("hybrid-wall", ["method.pwm.duty=immediate"], 8),
    ("hybrid-wall", ["method.pwm.mode=locked_antiphase"], 8),
    ("conventional-wall-10khz", [], 8),
    ("conventional-wall-1khz", [], 8),
    ("slow-pwm", [], 8),
    *[("knob", [f"method.settling={clocks}"], 8) for clocks in (0, 32, 64)],
    *[("hybrid-wall", [PATH.format(end)], seconds) for end, seconds in ((1.6, 8), (1.7, 8), (2.1, 24), (2.4, 24))],
]
FINE = ["method.stiffness_format=(0,8,24)", "method.damping_format=(0,8,24)"]
FINE += ["method.position_bits=20", "method.velocity_bits=20"]


def hpu(verb, scene, keys):
    words = [word for key in keys for word in ("--set", key)]
    done = subprocess.run([HPU, verb, scene, "--quiet", "--json", *words], stdout=subprocess.PIPE)
    return json.loads(done.stdout)


def row(name, scene, keys, seconds):
    told = hpu("limits", scene, keys)
    limit = told["as_driven"]["stable"][0]["to"]["at"]
    ripple = told["ripple"]["one_count_or_more"] if told["ripple"] else []
    least = min(limit, ripple[0][0]) if ripple else limit
    # Where the command at rest is nearly a full one, the loop is almost open, and words settle again.
    seen = [look["stiffness"] for look in told["words"]["seen"] if look["settled"]]
    words = max(stiffness for stiffness in seen if stiffness < 2 * limit)
    fine = [*keys, *FINE, f"run.duration={seconds} s", f"encoder.lines={32000 if name == 'knob' else 16384}"]
    grid = [limit * (1 + 0.0025 * step) for step in range(-5, 7)]
    outcomes = [hpu("run", scene, [*fine, f"wall.stiffness={stiffness}"])["outcome"] for stiffness in grid]
    rms = [outcome.get("rms_rad") for outcome in outcomes]
    leaps = [(high / low if low and high else 0, index) for index, (low, high) in enumerate(zip(rms, rms[1:]))]
    leap, at = max(leaps)
    low, high = grid[at], grid[at + 1]
    away = 100 * max(low / limit - 1, 1 - high / limit, 0)
    said = keys[0].split("=", 1)[-1] if keys else ""
    if "path" in "".join(keys):
        said = "hand to " + keys[0].rsplit(" ", 1)[-1].strip("]")
    elif name == "knob":
        said = "settling " + said
    return (f"{name:<24} {said:<16} {limit:<9.5g} {least if ripple else '-':<9.4} {words:<8.4g}"
            f" {100 * (least / words - 1):+5.1f} %   {low:.5g} .. {high:.5g}  x{leap:<6.2f} {away:.2f} %")


def main():
    head = """# What `hpu limits` tells of the linear loop as driven, beside the loop that runs; by testbench/driven.py.
# limit: as driven, N.m/rad; ripple: from which on it alone has one count; words: highest seen to settle below twice the
# limit, and by how much limit or ripple, whichever is less, is above it; jump: where the amplitude leaps with fine
# counts, by how much, and how far the limit is outside of it.
"""
    head += f"{'scene':<24} {'with':<16} {'limit':<9} {'ripple':<9} {'words':<8} {'off':>7}   jump\n"
    with tempfile.TemporaryDirectory() as scratch:
        knob = Path(scratch) / "knob.toml"
        knob.write_text(KNOB)
        text = head
        for name, keys, seconds in ROWS:
            text += row(name, knob if name == "knob" else name, keys, seconds) + "\n"
            print(text.splitlines()[-1], flush=True)
    RECORD.write_text(text)


if __name__ == "__main__":
    main()
