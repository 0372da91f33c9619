"""Cycle-accurate emulator of haptic FPGA datapaths.

A scene is a shipped name (see ``scenes()``), the path of a TOML file, or ``Scene(text)``. Each function that takes a
scene also takes overrides, which are those of the command's ``--set``: a dict whose keys have dots, and keywords in
which two underscores stand for a dot.

>>> import hpu
>>> run = hpu.run("hybrid-wall", {"wall.stiffness": 2}, wall__damping="0.2 mN.m.s/rad")
>>> run.verdict
'settled'
>>> run.trace["angle_rad"].shape
(20001,)
"""

from ._errors import ArgumentError, EndError, Error, HandleError, SceneError
from ._hpu import (
    Block,
    Column,
    Loop,
    Plant,
    Result,
    Scene,
    Signal,
    Study,
    Trace,
    blocks,
    fit,
    identify,
    keys,
    limits,
    map,
    run,
    scenes,
    widths,
)

__all__ = [
    "ArgumentError",
    "Block",
    "Column",
    "EndError",
    "Error",
    "HandleError",
    "Loop",
    "Plant",
    "Result",
    "Scene",
    "SceneError",
    "Signal",
    "Study",
    "Trace",
    "blocks",
    "fit",
    "identify",
    "keys",
    "limits",
    "map",
    "run",
    "scenes",
    "widths",
]
