"""run.py VECTORS.json HDL.vhd... [VUNIT ARGUMENT...]: holds a block's VHDL against exported vectors, in VUnit on GHDL.

VECTORS.json comes from `hpu vectors BLOCK --format json`; the files are the VHDL of the block and of all that it needs.
The testbench is written from the ports that VECTORS.json names, so that any block will do. Words go to VHDL as the
integers that VUnit's load_csv reads, in parts of at most 30 bits. Exit codes are VUnit's.
"""

import json
import sys
from pathlib import Path

from vunit import VUnit

PART_BITS = 30


class Column:
    """A port: its name, its direction, its width."""

    def __init__(self, told):
        self.name, self.is_input, self.width = told["name"], told["direction"] == "in", sum(told["format"])
        # Widths of its parts, the upper one first.
        whole, rest = divmod(self.width, PART_BITS)
        self.parts = ([rest] if rest else []) + [PART_BITS] * whole

    def numbers(self, value):
        """The parts of a word."""
        bits = f"{value % (1 << self.width):0{self.width}b}"
        ends = [sum(self.parts[: index + 1]) for index in range(len(self.parts))]
        return [int(bits[end - part : end], 2) for end, part in zip(ends, self.parts)]

    def kind(self):
        """Its type in VHDL."""
        return "std_logic" if self.width == 1 else f"std_logic_vector({self.width - 1} downto 0)"

    def word(self, first):
        """The word of a row in VHDL, whose parts begin at this column of the table."""
        parts = [f"part(row, {first + index}, {part})" for index, part in enumerate(self.parts)]
        return f"{parts[0]}(0)" if self.width == 1 else " & ".join(parts)


def literal(value):
    """A generic's value in VHDL."""
    return str(value).lower()


def testbench(told, columns, path):
    """The testbench: a row is one edge, or one settling of a block without a clock."""
    signals = [f"  signal {column.name} : {column.kind()};" for column in columns]
    ports = [f"{column.name} => {column.name}" for column in columns]
    if told["clocked"]:
        signals.append("  signal clk : std_logic := '0';")
        ports.append("clk => clk")
    generics = ", ".join(f"{name} => {literal(value)}" for name, value in told["generics"].items())
    generics = f"\n    generic map ({generics})" if generics else ""
    drive, check, first = [], [], 0
    for column in columns:
        word = column.word(first)
        if column.is_input:
            drive.append(f"        {column.name} <= {word};")
        else:
            message = f'"{column.name} in row " & to_string(row + 1)'
            typed = "" if column.width == 1 else "std_logic_vector'"
            check.append(f"        check_equal({column.name}, {typed}({word}), {message});")
        first += len(column.parts)
    tick = ["        clk <= '1';", "        wait for 5 ns;"] if told["clocked"] else []
    fall = ["        clk <= '0';"] if told["clocked"] else []
    body = "\n".join(drive + ["        wait for 5 ns;"] + tick + check + fall)
    declarations = "\n".join(signals)
    return f"""library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library vunit_lib;
context vunit_lib.vunit_context;
use vunit_lib.integer_array_pkg.all;

entity tb_rows is
  generic (runner_cfg : string);
end entity;

architecture test of tb_rows is
{declarations}
begin

  dut : entity work.{told["block"]}{generics}
    port map ({", ".join(ports)});

  main : process
    variable rows : integer_array_t;

    -- A cell of the table as bits: VUnit counts columns first.
    impure function part(row, column, width : natural) return std_logic_vector is
    begin
      return std_logic_vector(to_unsigned(get(rows, column, row), width));
    end function;
  begin
    test_runner_setup(runner, runner_cfg);
    while test_suite loop
      if run("{told["block"]}") then
        rows := load_csv("{path}");
        check_equal(width(rows), {first}, "columns");
        check_equal(height(rows), {len(told["rows"])}, "rows");
        for row in 0 to height(rows) - 1 loop
{body}
        end loop;
        info(to_string(height(rows)) & " rows agree");
      end if;
    end loop;
    test_runner_cleanup(runner);
  end process;

end architecture;
"""


def main(vectors, *arguments):
    told = json.loads(Path(vectors).read_text())
    columns = [Column(column) for column in told["columns"]]
    options = next((index for index, argument in enumerate(arguments) if argument.startswith("-")), len(arguments))
    sources, options = arguments[:options], arguments[options:]

    made = Path(f"vunit-{told['block']}").resolve()
    made.mkdir(exist_ok=True)
    table = made / "rows.csv"
    lines = [[part for column, value in zip(columns, row) for part in column.numbers(value)] for row in told["rows"]]
    table.write_text("".join(",".join(map(str, line)) + "\n" for line in lines))
    bench = made / "tb_rows.vhd"
    bench.write_text(testbench(told, columns, table))

    # Always compiled anew: what VUnit finds compiled may be another file of the same entity.
    options = ["--output-path", str(made / "out"), "--clean", *options]
    unit = VUnit.from_argv(argv=options, compile_builtins=False)
    unit.add_vhdl_builtins()
    library = unit.add_library("hpu")
    for source in [*sources, bench]:
        library.add_source_file(Path(source).resolve())
    unit.set_sim_option("ghdl.sim_flags", ["--ieee-asserts=disable"])
    unit.main()


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
