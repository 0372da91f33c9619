"""Closes a design in cocotb around a plant, whatever simulator runs it.

In a test of your own, after the reset and while the clock is low::

    import hpu.cocotb

    plant = hpu.Plant("mine.toml")                  # the scene has a [dut] that names the ports
    hpu.cocotb.put(dut, plant)                      # before the reset
    await hpu.cocotb.close(dut, plant, dut.clk)     # after the reset, at a falling edge

The motion is that of ``hpu run mine.toml``, to the bit, if the reset takes as many clock cycles.
"""

from collections.abc import Callable, Mapping
from typing import Any

from cocotb.triggers import FallingEdge

from . import Plant, Signal
from ._errors import ArgumentError, EndError

__all__ = ["close", "put"]


# What an axis tells beside the pins. A signal of this name inside a design is no port for it.
_BESIDE = ["index", "count", "contact"]


def _pins(dut, plant):
    """Returns the number and the port of each of the plant's inputs that the design has."""
    names = [pin.name for pin in plant.inputs]
    if names[-3:] == _BESIDE:
        del names[-3:]
    return [(number, getattr(dut, name)) for number, name in enumerate(names) if hasattr(dut, name)]


def put(dut, plant):
    """Puts the plant's words at the inputs of the same name, so that they are known while the reset is active."""
    words = plant.read()
    for number, port in _pins(dut, plant):
        port.value = words[number]


async def join(
    dut: Any,
    plant: Plant,
    clock: Any,
    ports: Mapping[str, Any] | None = None,
    each: Callable[[Plant], object] | None = None,
) -> None:
    """Closes the loop from the present clock edge of the plant to the end of its scene.

    Inputs and outputs of the plant are joined to the ports of the same name. A scene with a ``[dut]`` names them as the
    design does; index, count and contact, which an axis tells beside them, are left out. The clock is the caller's. Call it
    between a falling and a rising edge of ``clk``, when the reset is over: each rising edge from then on is one of the
    plant's. The plant moves before it, the outputs are read at the falling edge after it.

    Raises ``hpu.ArgumentError`` when the design lacks a port, when an output that drives the plant has an unknown bit, or
    when both switches of a leg are closed.
    """
    pins = _pins(dut, plant)
    missing = [gate.name for gate in plant.outputs if not hasattr(dut, gate.name)]
    if missing:
        names = ", ".join(gate.name for gate in plant.outputs)
        raise ArgumentError(f"the design has no port {', '.join(missing)}; accepted: one for each of {names}")
    gates = [(getattr(dut, gate.name), gate.format[0] and sum(gate.format) > 1) for gate in plant.outputs]
    shown = (None,) * len(plant.inputs)

    def show():
        nonlocal shown
        words = plant.read()
        if words != shown:
            for number, port in pins:
                if words[number] != shown[number]:
                    port.value = words[number]
            shown = words

    driven = None

    def drive():
        nonlocal driven
        try:
            words = [port.value.to_signed() if is_signed else int(port.value) for port, is_signed in gates]
        except ValueError as unknown:
            raise ArgumentError(f"an output at clock edge {plant.edge}: {unknown}; accepted: 0 and 1") from None
        if words != driven:
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
