"""Closes a design in cocotb around a plant, whatever simulator runs it.

In a test of your own, after the reset and while the clock is low::

    import hpu.cocotb

    with hpu.Plant("knob.toml") as plant:
        await hpu.cocotb.join(dut, plant, dut.clk)

The ports are those of the scene's ``[dut.ports]``, connected as the scene says; with a scene of a ``[method]`` they have
the names of that method's VHDL. At each rising edge the design samples the plant's pins as they are at that instant, and
its outputs drive the plant from that edge on: the motion is that of ``hpu run`` on the same ``[dut]``, to the bit.
"""

from collections.abc import Callable, Mapping
from typing import Any

from cocotb.triggers import FallingEdge

from . import Plant, Signal
from ._errors import ArgumentError, EndError

# What a plant tells beside the pins of the logic.
_BESIDE = ("index", "count", "contact")


async def join(
    dut: Any,
    plant: Plant,
    clock: Any,
    ports: Mapping[str, Any] | None = None,
    each: Callable[[Plant], object] | None = None,
) -> None:
    """Closes the loop from the present clock edge of the plant to the end of its scene.

    ``dut`` is the design's top and ``clock`` the handle of its clock, which somebody else drives and which is low now;
    its rising edges are the clock edges of the plant. ``ports`` gives the handle of a port whose name is not that of the
    signal. ``each`` is called after every clock edge, when the outputs of that edge drive the plant; if it returns
    False, the loop ends there.

    Raises ``hpu.ArgumentError`` when the design lacks a port, when an output that drives the plant has an unknown bit, or
    when both switches of a leg are closed.
    """
    ports = ports or {}
    names = [signal.name for signal in plant.inputs]
    count = len(names) - len(_BESIDE) if tuple(names[-len(_BESIDE) :]) == _BESIDE else len(names)
    inputs = [(_port(dut, signal, ports), signal) for signal in plant.inputs[:count]]
    outputs = [(_port(dut, signal, ports), signal) for signal in plant.outputs]
    masks = [(1 << len(handle)) - 1 if _is_wide(handle) else 1 for handle, _ in inputs]
    falling = FallingEdge(clock)
    given: list[int | None] = [None] * count
    taken: list[Any] = [None] * len(outputs)
    words: tuple[int, ...] = ()
    while True:
        values = [handle.value for handle, _ in outputs]
        if values != taken:
            taken = values
            words = tuple(_word(value, signal, plant) for value, (_, signal) in zip(values, outputs, strict=True))
            plant.drive(*words)
        if each is not None and each(plant) is False:
            return
        try:
            plant.advance()
        except EndError:
            return
        now = plant.read()
        for index in range(count):
            if now[index] != given[index]:
                given[index] = now[index]
                inputs[index][0].value = now[index] & masks[index]
        await falling


def _port(dut: Any, signal: Signal, ports: Mapping[str, Any]) -> Any:
    """The handle of a signal's port. VHDL's names have small letters in a simulator."""
    if signal.name in ports:
        return ports[signal.name]
    for name in (signal.name, signal.name.lower()):
        try:
            return getattr(dut, name)
        except AttributeError:
            pass
    raise ArgumentError(
        f"the design {dut._name} has no port `{signal.name}` ({signal.doc}); accepted: ports={{{signal.name!r}: a handle}}"
    )


def _is_wide(handle: Any) -> bool:
    """Whether a port is a vector."""
    try:
        len(handle)
    except TypeError:
        return False
    return True


def _word(value: Any, signal: Signal, plant: Plant) -> int:
    """The word of an output, from its bits."""
    if not value.is_resolvable:
        raise ArgumentError(
            f"output `{signal.name}` is {value} at clock edge {plant.edge}, where it drives the plant; let the reset or an "
            "initial value set it"
        )
    word = value.to_unsigned() if hasattr(value, "to_unsigned") else int(value)
    return word - (signal.max - signal.min + 1) if word > signal.max else word
