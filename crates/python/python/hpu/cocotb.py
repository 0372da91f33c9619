"""cocotb: the plant of a scene in the loop of a design, in any simulator that cocotb drives.

A test of your own holds its design in the loop with three lines more::

    import hpu.cocotb

    plant = hpu.Plant("mine.toml")                  # the scene has a [dut] that names the ports
    hpu.cocotb.put(dut, plant)                      # before the reset
    await hpu.cocotb.close(dut, plant, dut.clk)     # after the reset, at a falling edge

The motion is that of ``hpu run mine.toml``, to the bit, if the reset takes as many clock cycles.
"""

from cocotb.triggers import FallingEdge, Timer

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


async def close(dut, plant, clk, edges=None):
    """Closes the loop of a design around a plant, from the present clock edge on, and returns the edge of its end.

    Inputs and outputs of the plant are joined to the ports of the same name. A scene with a ``[dut]`` names them as the
    design does; index, count and contact, which an axis tells beside them, are left out. The clock is the caller's.
    Call it between a falling and a rising edge of ``clk``, when the reset is over: each rising edge from then on is one
    of the plant's. The plant moves before it, the outputs are read at the falling edge after it.

    Args:
        dut: the design, as cocotb gives it.
        plant: an ``hpu.Plant``.
        clk: the signal of the clock, which rises once for each edge of the plant.
        edges: the number of clock edges; None goes on to the end of the scene.

    Raises:
        hpu.ArgumentError: an output of the plant is no port of the design, or a word of it is unknown (X) or refused.
        hpu.EndError: the device cannot go on.
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
            driven = words

    show()
    await Timer(1, "step")
    drive()
    falling = FallingEdge(clk)
    done = 0
    while edges is None or done < edges:
        try:
            plant.advance()
        except EndError:
            if plant.edge == plant.edges:
                break
            raise
        show()
        await falling
        drive()
        done += 1
    return plant.edge
