#!/usr/bin/env python3
"""A motor of three phases on its inverter, beside motulator's: the same duties, compared and timed.

Usage: motulator_pmsm.py LIBHPU: libhpu.so. Needs motulator 0.5 from PyPI, which brings numpy and scipy, and the C
compiler `cc`. It takes some minutes. Prints what testbench/record/motulator.txt keeps; fails where the two differ by
more than 1e-6 relative. Neither hpu nor its tests need motulator.

motulator's model is used as it is: its Drive of VoltageSourceConverter, SynchronousMachine and StiffMechanicalSystem,
its CarrierComparison and its Simulation, which hands scipy's solve_ivp `max_step` alone. In the place of its control
stands a table of duties. hpu's plant is opened through libhpu without a design, and its three legs are driven at the
clock edges at which a counter of 2^12 steps, up and down, passes the same duties.

Compared are the currents along the rotor and across it, speed, angle and stored energy at the end of each half period
of the counter. libhpu tells all but the first as they are. The current along is computed from the words of two current
sensors of 24 bits, to the middle of a step of theirs; to more digits it is in the stored energy. That the comparison
can fail is shown by legs that switch one clock cycle late.

Timed are runs of 0.1 s without sensors. A stretch is the time between two switchings, or to the end of a half period.
hpu's loop reads current across, speed and angle at the end of each half period; motulator keeps all points of its
solution. Times are processor time without imports and set-up, the least of three by turns; hpu's are means of twenty
runs in a row, in Python of five.
"""

import ctypes
import subprocess
import sys
import tempfile
import time
from importlib.metadata import version
from pathlib import Path

import numpy as np
from motulator.drive import model
from motulator.drive.utils import SynchronousMachinePars

COUNTER = 2**12
DURATION_S, COMPARED_S, TIMED_S = 0.1, [25e-6, 250e-6], [12.5e-6, 25e-6, 50e-6, 125e-6, 250e-6]
PAIRS, OHM, FLUX, INERTIA, VISCOUS, LOAD, SUPPLY = 7, 0.5, 5e-3, 3e-5, 2e-4, 5e-3, 12.0
# Inductances along the magnets and across them.
CASES = {"surface": (3e-4, 3e-4), "salient": (2.5e-4, 4e-4)}
# All words of a current, and their bits.
RANGE_A, BITS = 12.5, 24
WORD_A = RANGE_A / 2**BITS
NAMES, UNITS = ["i_d", "i_q", "speed", "angle", "energy"], ["A", "A", "rad/s", "rad", "J"]
TOLERANCE, UNCHANGED = 1e-6, 1e-7
# The place of stored_j in hpu_energy.
STORED = 3

DRIVER = """
#include "hpu.h"
#include <time.h>
/* Drives legs at edges and reads three states after each half period. Returns seconds of processor time, or -1. */
double drive(hpu_handle plant, size_t count, const uint64_t *waits, const int64_t *legs, const uint8_t *ends,
             double *seen) {
    struct timespec from, to;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &from);
    for (size_t k = 0; k < count; k++, legs += 3) {
        if (waits[k] && hpu_advance(plant, waits[k], NULL) != HPU_OK) return -1;
        if (ends[k])
            for (size_t state = 0; state < 3; state++)
                if (hpu_state(plant, state, seen++, NULL) != HPU_OK) return -1;
        if (hpu_drive(plant, legs, 3, NULL) != HPU_OK) return -1;
    }
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &to);
    return (double)(to.tv_sec - from.tv_sec) + 1e-9 * (double)(to.tv_nsec - from.tv_nsec);
}
"""


class Duties:
    """A voltage that turns from 10 to 60 Hz, as steps of the counter for which each leg is high in each half period."""

    def __init__(self, half_s):
        self.half_s, self.halves, self.clock_hz = half_s, round(DURATION_S / half_s), round(COUNTER / half_s)
        t = np.arange(self.halves) * half_s
        turned = 2 * np.pi * (10 * t + 250 * t**2)
        volts = 2.0 + FLUX * 2 * np.pi * (10 + 500 * t)
        shares = [0.5 + volts / SUPPLY * np.cos(turned - x * 2 * np.pi / 3) for x in range(3)]
        self.steps = np.round(COUNTER * np.array(shares).T).astype(int)
        # motulator's delay of one sample begins with duties of 0.
        self.steps[0] = 0
        assert self.steps[1:].min() > 0 and self.steps.max() < COUNTER

    def switchings(self):
        """Edges with the legs from there on, and whether a half period ends there; rising halves first."""
        found = []
        for half, on in enumerate(self.steps.tolist()):
            rises = half % 2 == 0
            places = {0, *(COUNTER - high if rises else high for high in on)} - {COUNTER}
            for place in sorted(places):
                legs = [int(place >= COUNTER - high if rises else place < high) for high in on]
                found.append((half * COUNTER + place, legs, place == 0 and half > 0))
        found.append((self.halves * COUNTER, found[-1][1], True))
        return found


class Table:
    """Stands in the place of motulator's control: gives the duties, and keeps the states at the end of each half."""

    def __init__(self, duties):
        self.half_s, self.shares, self.seen = duties.half_s, duties.steps / COUNTER, []

    def __call__(self, drive):
        self.keep(drive)
        return self.half_s, self.shares[min(len(self.seen), len(self.shares) - 1)]

    def keep(self, drive):
        current, shaft = drive.machine.i_s, drive.mechanics.state
        self.seen.append([current.real, current.imag, np.real(shaft.w_M), np.angle(shaft.exp_j_theta_M)])

    def post_process(self):
        pass


def motulator(inductances, duties, max_step=None):
    """Returns the states at the end of each half period, the points of the solution, and seconds of processor time."""
    pars = SynchronousMachinePars(n_p=PAIRS, R_s=OHM, L_d=inductances[0], L_q=inductances[1], psi_f=FLUX)
    drive = model.Drive(
        model.VoltageSourceConverter(u_dc=SUPPLY),
        model.SynchronousMachine(pars),
        model.StiffMechanicalSystem(J=INERTIA, B_L=VISCOUS, tau_L=lambda t: LOAD),
    )
    drive.pwm = model.CarrierComparison(N=COUNTER)
    table = Table(duties)
    simulation = model.Simulation(drive, table)
    options = {} if max_step is None else {"max_step": max_step}
    start = time.process_time()
    simulation.simulate(t_stop=DURATION_S - 0.5 * duties.half_s, **options)
    seconds = time.process_time() - start
    table.keep(drive)
    seen = np.array(table.seen)[1:]
    assert len(seen) == duties.halves and abs(drive.t0 - DURATION_S) < 1e-12
    seen[:, 3] = np.unwrap(seen[:, 3])
    squares = seen[:, :3] ** 2
    energy = 0.75 * (squares[:, :2] @ np.array(inductances)) + 0.5 * INERTIA * squares[:, 2]
    return np.column_stack([seen, energy]), len(drive.sol_t), seconds


class Hpu:
    """libhpu, and the loop in C around it."""

    def __init__(self, path, work):
        header = Path(__file__).resolve().parents[2] / "crates/capi/include"
        (work / "drive.c").write_text(DRIVER)
        (work / "any.v").write_text("module any; endmodule\n")
        built = work / "drive.so"
        command = ["cc", "-O2", "-shared", "-fPIC", f"-I{header}", str(work / "drive.c"), path, "-o", str(built)]
        subprocess.run([*command, f"-Wl,-rpath,{Path(path).parent}"], check=True)
        self.library, self.work = ctypes.CDLL(path), work
        self.library.hpu_advance.argtypes = [ctypes.c_uint64, ctypes.c_uint64, ctypes.c_void_p]
        self.library.hpu_drive.argtypes = [ctypes.c_uint64, ctypes.c_void_p, ctypes.c_size_t, ctypes.c_void_p]
        self.library.hpu_read.argtypes = self.library.hpu_drive.argtypes
        self.library.hpu_state.argtypes = [ctypes.c_uint64, ctypes.c_size_t, ctypes.c_void_p, ctypes.c_void_p]
        self.library.hpu_energies.argtypes = [ctypes.c_uint64, ctypes.c_void_p, ctypes.c_void_p]
        self.library.hpu_close.argtypes = [ctypes.c_uint64, ctypes.c_void_p]
        self.in_c = ctypes.CDLL(str(built)).drive
        self.in_c.restype = ctypes.c_double
        self.in_c.argtypes = [ctypes.c_uint64, ctypes.c_size_t] + 4 * [ctypes.c_void_p]

    def version(self):
        number = self.library.hpu_version()
        return f"{number // 1_000_000}.{number // 1000 % 1000}.{number % 1000}"

    def open(self, inductances, duties, sensors=False):
        """Opens the plant, with the two current sensors or without."""
        sections, ports = "", ""
        if sensors:
            how = f'rate = "{1 / duties.half_s:.0f} Hz", bits = {BITS}, gain = "1 V/A", range = "{RANGE_A} V"'
            each = [f'{x} = {{ kind = "current", winding = "{x}", {how} }}\n' for x in "ab"]
            sections = "[device.sensors]\n" + "".join(each)
            ports = 'ia = "sensor.a.word"\nib = "sensor.b.word"\n'
        scene = f"""about = "A motor of three phases on ideal legs."
clock = {{ frequency = "{duties.clock_hz} Hz" }}
run = {{ duration = "{2 * DURATION_S} s" }}
[device]
kind = "pmsm"
pole_pairs = {PAIRS}
resistance = "{OHM} Ohm"
inductance_d = "{inductances[0]} H"
inductance_q = "{inductances[1]} H"
flux_linkage = "{FLUX} Wb"
rotor_inertia = "{INERTIA} kg.m2"
viscous_friction = "{VISCOUS} N.m.s/rad"
{sections}[bridge]
supply = "{SUPPLY} V"
on_resistance = 0
diode_drop = 0
[encoder]
lines = 16
[hand]
kind = "constant_torque"
torque = "{-LOAD} N.m"
[dut]
files = ["any.v"]
top = "any"
clock = "clk"
reset = {{ port = "rst" }}
[dut.ports]
{ports}a = "bridge.leg_a"
b = "bridge.leg_b"
c = "bridge.leg_c"
"""
        handle, error = ctypes.c_uint64(), ctypes.create_string_buffer(4096)
        folder, none = str(self.work).encode(), ctypes.c_size_t(0)
        opened = ctypes.byref(handle), error
        status = self.library.hpu_open_text(scene.encode(), b"motor.toml", folder, None, none, *opened)
        assert status == 0, error.raw[4:].split(b"\0")[0].decode()
        return handle.value

    def states(self, inductances, duties, late=0):
        """Returns the states at the end of each half period, i_d by the words of the sensors. Legs may switch late."""
        handle, at, seen = self.open(inductances, duties, sensors=True), 0, []
        value, words, energies = ctypes.c_double(), (ctypes.c_int64 * 2)(), (ctypes.c_double * 12)()
        for edge, legs, ends in duties.switchings():
            if ends:
                self.call("hpu_advance", handle, edge - at)
                at = edge
                self.call("hpu_read", handle, words, 2)
                self.call("hpu_energies", handle, energies)
                row = [*words]
                for state in range(3):
                    self.call("hpu_state", handle, state, ctypes.byref(value))
                    row.append(value.value)
                seen.append([*row, energies[STORED]])
            if edge + late > at:
                self.call("hpu_advance", handle, edge + late - at)
                at = edge + late
            self.call("hpu_drive", handle, (ctypes.c_int64 * 3)(*legs), 3)
        self.call("hpu_close", handle)
        seen = np.array(seen)
        assert np.abs(seen[:, :2]).max() < 2 ** (BITS - 1) - 1, "a current is out of the sensors' range"
        a, b = (seen[:, :2].T + 0.5) * WORD_A
        current = (a + 1j * (a + 2 * b) / np.sqrt(3)) * np.exp(-1j * PAIRS * seen[:, 4])
        # Both words off by half a step move the vector by a whole one at most.
        assert np.abs(current.imag - seen[:, 2]).max() < WORD_A, "the sensors are not those of this instant"
        return np.column_stack([current.real, seen[:, 2:]])

    def call(self, name, *arguments):
        status = getattr(self.library, name)(*arguments, None)
        assert status == 0, (name, status)

    def timed_in_c(self, inductances, duties, found):
        """Returns seconds of processor time with the loop in C, and the states of the last run."""
        waits = np.diff([edge for edge, *_ in found], prepend=0).astype(np.uint64)
        legs = np.array([legs for _, legs, _ in found], dtype=np.int64)
        ends = np.array([ends for *_, ends in found], dtype=np.uint8)
        seen, runs = np.zeros((duties.halves, 3)), []
        for _ in range(20):
            handle = self.open(inductances, duties)
            runs.append(self.in_c(handle, len(found), *(array.ctypes.data for array in (waits, legs, ends, seen))))
            assert runs[-1] > 0
            self.call("hpu_close", handle)
        return sum(runs) / len(runs), seen

    def timed_in_python(self, inductances, duties, found):
        """Returns seconds of processor time with the loop in Python, by ctypes."""
        at, plan = 0, []
        for edge, legs, ends in found:
            plan.append((edge - at, (ctypes.c_int64 * 3)(*legs), ends))
            at = edge
        library, value, runs = self.library, ctypes.c_double(), []
        at_value = ctypes.byref(value)
        for _ in range(5):
            handle, seen = self.open(inductances, duties), []
            start = time.process_time()
            for wait, legs, ends in plan:
                if wait:
                    library.hpu_advance(handle, wait, None)
                if ends:
                    for state in range(3):
                        library.hpu_state(handle, state, at_value, None)
                        seen.append(value.value)
                library.hpu_drive(handle, legs, 3, None)
            runs.append(time.process_time() - start)
            self.call("hpu_close", handle)
        return sum(runs) / len(runs)


def apart(one, other, scale):
    """The greatest difference of each quantity, relative to its greatest value."""
    return np.abs(one - other).max(axis=0) / scale


def columns(values, form="%8.1e"):
    return " ".join(form % value for value in values)


def compare(name, inductances, duties, hpu):
    ours = hpu.states(inductances, duties)
    scale = np.abs(ours).max(axis=0)
    d, q = (f"{1e3 * value:g}" for value in inductances)
    greatest = ", ".join(f"{key} {value:.4g} {unit}" for key, value, unit in zip(NAMES, scale, UNITS))
    print(f"\n{name} motor, L_d {d} mH, L_q {q} mH, half period {1e6 * duties.half_s:g} us")
    print(f"greatest {greatest}")
    heads = columns(NAMES, "%8s")
    print(f"{'':18}  {'change by the halving':44}  difference of hpu")
    print(f"max_step    points  {heads}  {heads}")
    before, max_step = None, None
    while True:
        seen, points, _ = motulator(inductances, duties, max_step)
        label = "default" if max_step is None else f"{1e6 * max_step:g} us"
        changed = None if before is None else apart(seen, before, scale)
        told = "" if changed is None else columns(changed)
        differs = apart(seen, ours, scale)
        print(f"{label:9} {points:>8}  {told:44}  {columns(differs)}")
        # Few stretches are longer than the first two, so that these say little.
        if max_step is not None and max_step < duties.half_s / 4 and changed.max() <= UNCHANGED:
            break
        before, max_step = seen, (duties.half_s if max_step is None else max_step) / 2
    late = apart(seen, hpu.states(inductances, duties, late=1), scale)
    print(f"{'legs one clock cycle late':64}  {columns(late)}")
    print(f"half a step of the sensors is {0.5 * WORD_A / scale[0]:.1e} of the greatest i_d")
    assert differs.max() <= TOLERANCE < late[1], (differs, late)


def timed(name, inductances, duties, hpu):
    found, runs = duties.switchings(), []
    for _ in range(3):
        *_, theirs = motulator(inductances, duties)
        in_c, seen = hpu.timed_in_c(inductances, duties, found)
        runs.append((theirs, in_c, hpu.timed_in_python(inductances, duties, found)))
    if duties.half_s in COMPARED_S:
        assert np.array_equal(seen, hpu.states(inductances, duties)[:, 1:4]), "not the motion that was compared"
    theirs, in_c, in_python = (min(times) for times in zip(*runs))
    stretches = len(found) - 1
    half = f"{1e6 * duties.half_s:g} us"
    print(
        f"{half:>11} {name:7} {stretches:>9}  {theirs:>9.3f} {1e6 * theirs / stretches:>10.0f}  "
        f"{1e3 * in_c:>7.2f} {1e6 * in_c / stretches:>10.2f} {theirs / in_c:>6.0f}  "
        f"{1e3 * in_python:>7.2f} {theirs / in_python:>6.0f}"
    )


def main():
    versions = ", ".join(f"{name} {version(name)}" for name in ("motulator", "numpy", "scipy"))
    print(f"{versions}, Python {sys.version.split()[0]}")
    with tempfile.TemporaryDirectory() as folder:
        hpu = Hpu(str(Path(sys.argv[1]).resolve()), Path(folder))
        print(f"hpu {hpu.version()}")
        for half_s in COMPARED_S:
            for name, inductances in CASES.items():
                compare(name, inductances, Duties(half_s), hpu)
        print(f"\n{'0.1 s, default max_step':30} {'motulator':20}  {'hpu, from C':25}  hpu, from Python")
        print("half period motor   stretches      cpu_s us/stretch   cpu_ms us/stretch  times   cpu_ms  times")
        for half_s in TIMED_S:
            for name, inductances in CASES.items():
                timed(name, inductances, Duties(half_s), hpu)


if __name__ == "__main__":
    main()
