"""every_call.py: calls every public function, method and property once, for valgrind in testbench/long.sh.

Runs are short, for valgrind is slow. Ends with the number of names called, and fails if a public name was not called.
"""

import contextlib
import inspect
import tempfile
from pathlib import Path

import numpy as np

import hpu

SHORT = {"run.duration": "4 ms", "hand.path": [["0 s", 0], ["1 ms", 1.8]], "wall.position": "0.1 rad"}
called = set()


def use(thing, *members, **arguments):
    """Calls or reads members of a thing, and returns what the last one gave."""
    kind, value = type(thing).__name__, None
    for member in members:
        called.add(f"{kind}.{member}")
        value = getattr(thing, member)
        if callable(value):
            value = value(**arguments)
    return value


def made(name, *words, **keywords):
    """Calls a public function or class."""
    called.add(name)
    return getattr(hpu, name)(*words, **keywords)


def refused(kind, call):
    """Calls what must raise this exception."""
    called.add(kind.__name__)
    with contextlib.suppress(kind):
        call()
        raise AssertionError(f"{kind} is expected")


def main():
    scene = made("Scene", "about = 1")
    use(scene, "text", "name")
    refused(hpu.SceneError, lambda: hpu.run(scene))
    refused(hpu.Error, lambda: hpu.run("nowhere"))

    run = made("run", "hybrid-wall", SHORT, trace=True, progress=lambda done, total: None)
    use(run, "verdict", "contact", "summary", "trace", "pictures")
    run._repr_html_(), run._repr_png_(), repr(run), str(run)
    with tempfile.TemporaryDirectory() as folder:
        for ending in ("fst", "vcd"):
            use(run, "save_wave", path=f"{folder}/wave.{ending}")
    trace = hpu.run("hybrid-wall", SHORT).trace
    called.add("Trace")
    use(trace, "rows", "about", "keys")
    assert all(np.isfinite(trace[name]).any() for name in trace.keys()) and "time_s" in trace and len(trace)
    trace.__arrow_c_schema__(), trace.__arrow_c_array__(), trace.__arrow_c_stream__(), repr(trace)
    called.update(["Result", "Study", "Column"])

    few = {"x": "wall.stiffness=1..2:2", "y": "wall.damping=0..1e-4:2"}
    studies = [
        made("map", "hybrid-wall", SHORT, **few),
        made("limits", "hybrid-wall", SHORT, range="1..2", phases=1, words=2),
        made("widths", "hybrid-wall", SHORT, no_trials=True),
        made("fit", "conventional-wall-100hz", {"run.duration": "20 ms"}, within=0.5),
    ]
    with tempfile.TemporaryDirectory() as folder:
        (log := Path(folder) / "log.csv").write_text("time_ms,angle_deg\n0,0\n1,20\n2,60\n3,100\n")
        studies.append(made("identify", "hybrid-wall", [log], SHORT, free="device.rotor_inertia", held=[log]))
    for study in studies:
        use(study, "summary", "pictures")
        study._repr_html_(), study._repr_png_(), repr(study), str(study)
    made("keys", "wall"), made("scenes"), made("blocks")

    block = made("Block", "truncating_multiplier", SATURATE=True)
    for signal in use(block, "inputs") + use(block, "outputs"):
        called.add("Signal")
        use(signal, "name", "format", "min", "max", "unit", "doc")
        repr(signal)
    use(block, "reset")
    called.add("Block.tick")
    block.tick(1, 2), block.tick(np.arange(5000) % 4096, 3), repr(block)
    refused(hpu.ArgumentError, lambda: block.tick(1.5, 2))

    with made("Plant", "hybrid-wall", SHORT) as plant:
        use(plant, "inputs", "outputs", "clock_hz", "edges", "edge", "seconds", "pins", "states", "energy", "contact")
        use(plant, "read"), use(plant, "state", name="angle_rad"), use(plant, "drive", a_high=1, b_low=1)
        use(plant, "advance"), plant.advance(5000), plant.advance(ns=10_000), plant["a_pin"], repr(plant)
        refused(hpu.EndError, lambda: plant.advance(10**9))
        use(plant, "close")
        refused(hpu.HandleError, plant.read)
    with made("Loop", "hybrid-wall", SHORT) as loop:
        use(loop, "nets", "clock_hz", "edges", "edge", "words", "states", "energy")
        use(loop, "step"), loop.step(5000), loop["position"], repr(loop)
        use(loop, "close")

    public = set(hpu.__all__)
    for name in hpu.__all__:
        kind = getattr(hpu, name)
        if inspect.isclass(kind) and not issubclass(kind, Exception):
            public |= {f"{name}.{member}" for member in vars(kind) if not member.startswith("_")}
    assert public <= called, f"not called: {sorted(public - called)}"
    print(f"{len(public)} public names called")


main()
