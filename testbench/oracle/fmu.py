"""Units of FMI, by FMPy: the description of every scene that has one, and the states of some against libhpu's.

Usage: fmu.py HPU LIBHPU: the command, and libhpu.so. Ends with what agrees; fails at the first that does not.
"""

import ctypes
import json
import random
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from fmpy import extract, read_model_description
from fmpy.fmi3 import FMU3Slave
from fmpy.validation import validate_fmu

HPU, LIBHPU = sys.argv[1:]
INPUT, OUTPUT, STATE = 0, 1, 2
# What both legs of a bridge may do: off, forward, backward, brake.
GATES = [(0, 0, 0, 0), (1, 0, 0, 1), (0, 1, 1, 0), (0, 1, 0, 1)]


def export(scene, out, *options):
    command = [HPU, "--quiet", "export", "fmu", scene, "-o", str(out), *options]
    return subprocess.run(command, capture_output=True, text=True, check=False)


class Unit:
    """A unit, instantiated and initialised, and its variables by name."""

    def __init__(self, folder, description, parameters=None, events=False):
        self.variables = {variable.name: variable for variable in description.modelVariables}
        self.slave = FMU3Slave(guid=description.guid, unzipDirectory=folder, modelIdentifier="hpu", instanceName="a")
        self.slave.instantiate(eventModeUsed=events, earlyReturnAllowed=events)
        self.slave.enterInitializationMode()
        for name, value in (parameters or {}).items():
            self.slave.setFloat64([self.variables[name].valueReference], [value])
        self.slave.exitInitializationMode()
        if events:
            self.slave.enterStepMode()
        outputs = [variable for variable in description.modelVariables if variable.causality == "output"]
        self.words = [variable.valueReference for variable in outputs if variable.type == "Int64"]
        self.reals = [variable.valueReference for variable in outputs if variable.type == "Float64"]

    def seen(self):
        return list(self.slave.getInt64(self.words)), list(self.slave.getFloat64(self.reals))

    def drive(self, gates):
        names = ["a_high", "a_low", "b_high", "b_low"]
        self.slave.setInt64([self.variables[name].valueReference for name in names], gates)

    def step(self, time, step):
        return self.slave.doStep(time, step)


class Plant:
    """A plant of libhpu."""

    def __init__(self, scene):
        self.library = ctypes.CDLL(LIBHPU)
        self.handle = ctypes.c_uint64()
        self.call("hpu_open", scene.encode(), None, ctypes.c_size_t(0), ctypes.byref(self.handle), None)
        counts = []
        for kind in (INPUT, STATE):
            count = ctypes.c_size_t()
            self.call("hpu_count", self.handle, ctypes.c_int32(kind), ctypes.byref(count), None)
            counts.append(count.value)
        self.inputs, self.states = counts
        self.edge = 0

    def call(self, name, *arguments):
        status = getattr(self.library, name)(*arguments)
        assert status == 0, (name, status)

    def drive(self, gates):
        self.call("hpu_drive", self.handle, (ctypes.c_int64 * 4)(*gates), ctypes.c_size_t(4), None)

    def advance(self, edge):
        self.call("hpu_advance", self.handle, ctypes.c_uint64(edge - self.edge), None)
        self.edge = edge

    def words(self):
        words = (ctypes.c_int64 * self.inputs)()
        self.call("hpu_read", self.handle, words, ctypes.c_size_t(self.inputs), None)
        return list(words)

    def reals(self):
        value = ctypes.c_double()
        found = []
        for index in range(self.states):
            self.call("hpu_state", self.handle, ctypes.c_size_t(index), ctypes.byref(value), None)
            found.append(value.value)
        return found


def descriptions(work):
    """Every scene that has a plant with a clock validates without a remark; the others say why they have no unit."""
    # The first bytes of a library for Linux: a unit of which a description alone is read.
    empty = work / "empty"
    empty.write_bytes(b"\x7fELF\x02\x01" + bytes(12) + b"\x3e\x00")
    listed = subprocess.run([HPU, "scenes", "--json"], capture_output=True, text=True, check=True).stdout
    names = [scene["name"] for scene in json.loads(listed)["scenes"]]
    units, refused = 0, []
    for name in names:
        for options in ([], ["--loop"]):
            out = work / "described.fmu"
            out.unlink(missing_ok=True)
            done = export(name, out, "--library", str(empty), *options)
            if done.returncode:
                assert done.returncode == 4 and done.stderr.startswith("error: ") and not out.exists(), done
                refused.append(name)
                continue
            remarks = validate_fmu(str(out))
            assert not remarks, (name, remarks)
            units += 1
    assert units > len(names) and len(refused) < len(names) / 2, (units, refused)
    return units, len(names)


def states(folder, description, frequency):
    """States and words at every communication point are libhpu's, to the bit; two units at once."""
    points = 0
    random.seed(3)
    for sizes in ([1e-6], [1e-5], [1e-3], [3e-7, 1.234567e-4, 2e-8, 5.5e-3]):
        one, two = Unit(folder, description), Unit(folder, description)
        plant = Plant("hybrid-wall")
        time = 0.0
        for index in range(60):
            if index % 7 == 0:
                gates = random.choice(GATES)
                for driven in (one, two, plant):
                    driven.drive(gates)
            step = sizes[index % len(sizes)]
            for unit in (one, two):
                unit.step(time, step)
            time += step
            plant.advance(round(time * frequency))
            words, reals = one.seen()
            assert two.seen() == (words, reals)
            assert words == plant.words(), (time, words, plant.words())
            assert reals[: plant.states] == plant.reals(), (time, reals, plant.reals())
            points += 1
        for unit in (one, two):
            unit.slave.terminate()
            unit.slave.freeInstance()
    return points


def early(folder, description, frequency):
    """With event mode a step ends at the clock edge at which a word changes: that of libhpu, edge by edge."""
    unit = Unit(folder, description, events=True)
    plant = Plant("hybrid-wall")
    for driven in (unit, plant):
        driven.drive(GATES[2])
    end, time, found = 4e-3, 0.0, []
    while time < end - 1e-12:
        event, terminate, is_early, reached = unit.step(time, end - time)
        assert not terminate and event == is_early or reached == end
        time = reached
        if event:
            found.append(round(time * frequency))
            unit.slave.enterEventMode()
            unit.slave.updateDiscreteStates()
            unit.slave.enterStepMode()
    changes, before = [], plant.words()
    for edge in range(1, round(end * frequency) + 1):
        plant.advance(edge)
        if plant.words() != before:
            changes.append(edge)
            before = plant.words()
    assert found == changes and len(changes) > 3, (found, changes)
    return len(changes)


def kept(folder, description):
    """A state that is kept and set goes on to the same bits; a stale one is an error."""
    unit = Unit(folder, description)
    drives = "a_high" in unit.variables and unit.variables["a_high"].causality == "input"
    if drives:
        unit.drive(GATES[1])
    unit.step(0.0, 3.3e-3)
    state = unit.slave.getFMUState()
    at = unit.seen()
    passes = []
    for _ in range(2):
        assert unit.seen() == at
        if drives:
            unit.drive(GATES[2])
        seen = []
        for index in range(20):
            unit.step(3.3e-3 + index * 1e-4, 1e-4)
            seen.append(unit.seen())
        passes.append(seen)
        unit.slave.setFMUState(state)
    assert passes[0] == passes[1] and passes[0][-1] != at
    unit.slave.freeFMUState(state)
    refused(lambda: unit.slave.setFMUState(state))
    return len(passes[0])


def tuned(folder, description):
    """A parameter that is set in mid-run: where it does not matter yet, as if it had been so from the start; the value
    that it has changes nothing; in the wall it changes the motion. States that are kept have it."""
    stiffness = description.modelVariables[[each.name for each in description.modelVariables].index("wall.stiffness")]
    assert stiffness.variability == "tunable"

    def stiff(unit, value):
        unit.slave.setFloat64([stiffness.valueReference], [value])

    # The hand comes to the wall between the first two of these times.
    free, inside, end = 0.1, 0.23, 0.24
    seen = {}
    for start, tuning in (
        (2.0, None), (1.0, None), (1.0, (free, 2.0)), (1.0, (inside, 1.0)), (1.0, (inside, 2.0)), (2.0, (inside, 1.0))
    ):
        unit = Unit(folder, description, {"wall.stiffness": start})
        time = 0.0
        if tuning:
            time, value = tuning
            unit.step(0.0, time)
            stiff(unit, value)
            assert unit.slave.getFloat64([stiffness.valueReference]) == [value]
            refused(lambda unit=unit: stiff(unit, -1.0))
        unit.step(time, end - time)
        seen[start, tuning] = unit.seen()
        if tuning:
            state = unit.slave.getFMUState()
            unit.step(end, 1e-2)
            after = unit.seen()
            unit.slave.setFMUState(state)
            assert unit.seen() == seen[start, tuning]
            unit.step(end, 1e-2)
            assert unit.seen() == after
    assert seen[1.0, (free, 2.0)] == seen[2.0, None] and seen[1.0, (inside, 1.0)] == seen[1.0, None]
    assert len({str(one) for one in seen.values()}) == 4


def drivers(work):
    """Loops that are tuned in mid-run are the same at each communication point, from event to event and by edges."""
    random.seed(7)
    points = 0
    for scene in ("hybrid-wall", "count-cycle", "fast-velocity", "impulse-engine"):
        units = []
        for solver in ("events", "clock"):
            out = work / f"{scene}-{solver}.fmu"
            done = export(scene, out, "--library", LIBHPU, "--loop", "--set", f"model.solver={solver}")
            assert done.returncode == 0, done.stderr
            units.append(Unit(extract(str(out), unzipdir=str(out.with_suffix(""))), read_model_description(str(out))))
        time = 0.0
        for _ in range(8):
            step = random.uniform(0.005, 0.02)
            for unit in units:
                unit.step(time, step)
            time += step
            assert units[0].seen() == units[1].seen(), (scene, time)
            points += 1
            reference = [units[0].variables["wall.stiffness"].valueReference]
            value = units[0].slave.getFloat64(reference)[0] * random.choice([0.9, 1.05, 1.1])
            for unit in units:
                unit.slave.setFloat64(reference, [value])
    return points


def refused(call):
    try:
        call()
    except Exception:  # FMPy raises its plain exception.
        return
    raise AssertionError("a call that is wrong was accepted")


def wrong(folder, description):
    """Steps of 0, backwards, from elsewhere, both switches of a leg, other types, another token."""
    unit = Unit(folder, description)
    unit.step(0.0, 1e-3)
    before = unit.seen()
    for step in (0.0, -1e-3, float("nan"), float("inf")):
        refused(lambda step=step: unit.step(1e-3, step))
    refused(lambda: unit.step(0.0, 1e-3))
    refused(lambda: unit.drive([1, 1, 0, 0]))
    refused(lambda: unit.slave.getFloat64([unit.words[0]]))
    refused(lambda: unit.slave.getInt64([99_999]))
    refused(lambda: unit.slave.setFloat64([unit.variables["wall.stiffness"].valueReference], [2.0]))
    refused(lambda: unit.slave.enterInitializationMode())
    assert unit.seen() == before
    unit.step(1e-3, 1e-3)
    other = FMU3Slave(guid="{0}", unzipDirectory=folder, modelIdentifier="hpu", instanceName="b")
    refused(lambda: other.instantiate())


def main():
    work = Path(tempfile.mkdtemp())
    try:
        units, scenes = descriptions(work)
        plant, loop = work / "plant.fmu", work / "loop.fmu"
        for out, options in ((plant, []), (loop, ["--loop"])):
            done = export("hybrid-wall", out, "--library", LIBHPU, *options)
            assert done.returncode == 0, done.stderr
        again = work / "again.fmu"
        export("hybrid-wall", again, "--library", LIBHPU)
        assert again.read_bytes() == plant.read_bytes(), "the same scene gives other bytes"
        description, whole = (read_model_description(str(path)) for path in (plant, loop))
        folder, whole_folder = (extract(str(path), unzipdir=str(work / path.stem)) for path in (plant, loop))
        points = states(folder, description, 50_000_000)
        changes = early(folder, description, 50_000_000)
        steps = kept(folder, description) + kept(whole_folder, whole)
        wrong(folder, description)
        tuned(whole_folder, whole)
        points += drivers(work)
        # A parameter of a unit is that key of the scene.
        stiff = Unit(whole_folder, whole, {"wall.stiffness": 2.0})
        stiff.step(0.0, 0.3)
        changed = work / "changed.fmu"
        export("hybrid-wall", changed, "--library", LIBHPU, "--loop", "--set", "wall.stiffness=2")
        set_folder = extract(str(changed), unzipdir=str(work / "changed"))
        other = Unit(set_folder, read_model_description(str(changed)))
        soft = Unit(whole_folder, whole)
        for unit in (other, soft):
            unit.step(0.0, 0.3)
        assert stiff.seen() == other.seen() and stiff.seen() != soft.seen()
        print(f"{units} units of {scenes} scenes validate; {points} communication points, {changes} early returns and "
              f"{steps} steps from states that were kept agree to the bit")
    finally:
        shutil.rmtree(work)


if __name__ == "__main__":
    main()
