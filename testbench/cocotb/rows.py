"""The cocotb test: every row of the vectors that HPU_VECTORS names, against the VHDL.

A row is one edge: its inputs stand before it, its outputs after it. A combinational block settles instead.
"""

import hashlib
import json
import os
from pathlib import Path

import cocotb
from cocotb.triggers import Timer


def read(path):
    """The vectors; a file that was changed since it was written is refused."""
    lines = Path(path).read_bytes().splitlines(keepends=True)
    digest = hashlib.sha256(b"".join(line for line in lines if b'"sha256"' not in line)).hexdigest()
    vectors = json.loads(b"".join(lines))
    assert digest == vectors["sha256"], f"{path} was changed since it was written"
    return vectors


def bits(value, column):
    """The word's bits, from a value in units of its least significant bit."""
    return f"{value % (1 << sum(column['format'])):0{sum(column['format'])}b}"


@cocotb.test()
async def every_row_agrees(dut):
    vectors = read(os.environ["HPU_VECTORS"])
    columns = vectors["columns"]
    for number, row in enumerate(vectors["rows"], start=1):
        cells = [(getattr(dut, column["name"]), column, value) for column, value in zip(columns, row, strict=True)]
        for port, column, value in cells:
            if column["direction"] == "in":
                port.value = int(bits(value, column), 2)
        for level in (0, 1) if vectors["clocked"] else ():
            dut.clk.value = level
            await Timer(5, "ns")
        await Timer(5, "ns")
        for port, column, value in cells:
            if column["direction"] == "out":
                expected, got = bits(value, column), str(port.value)
                assert got == expected, f"row {number}: {column['name']} expected {expected} ({value}), got {got}"
    dut._log.info("%d rows agree", len(vectors["rows"]))
