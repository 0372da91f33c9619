#!/usr/bin/env python3
"""How designs start up: the outputs of testbench/dut/startup after the reset and after each of 20 clocks, by Icarus
Verilog and by GHDL, from benches that know nothing of hpu. Writes testbench/record/startup.txt, which
crates/cli/tests/all/startup.rs holds both engines of hpu to.

The benches begin as most do: clocks and reset low, then the reset rises, four clocks, and the reset falls while the
clock is low. A word is hexadecimal, xx if one of its bits is not known."""

import re, subprocess, sys, tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent
CLOCKS = 20


def outputs(text, pattern):
    """The names of the output ports of the topmost unit."""
    return re.findall(r"\w+", re.sub(pattern, " ", text))


def run(*command, **options):
    return subprocess.run(command, check=True, capture_output=True, text=True, **options).stdout


def icarus(folder):
    source = ROOT / "dut/startup/startup.v"
    head = source.read_text().split("module startup (")[1].split(");")[0]
    names = outputs(head, r"input clk, rst, a|output|\[7:0\]")
    wires = "".join(f"  wire [7:0] {name};\n" for name in names)
    ports = ", ".join(f".{name}({name})" for name in names)
    shown = "".join(f'    $display("{name} %b", {name});\n' for name in names)
    bench = folder / "bench.v"
    bench.write_text(f"""`timescale 1ns / 1ns
module bench;
  reg clk = 0, rst = 0;
{wires}  startup dut (.clk(clk), .rst(rst), .a(1'b0), {ports});
  task show; begin
{shown}  end endtask
  initial begin
    #10 rst = 1;
    #10 repeat (4) begin #5 clk = 1; #5 clk = 0; end
    #5 rst = 0;
    #5 show;
    repeat ({CLOCKS}) begin #5 clk = 1; #4 show; #1 clk = 0; end
    $finish;
  end
endmodule
""")
    run("iverilog", "-g2012", "-s", "bench", "-o", str(folder / "bench.vvp"), str(source), str(bench))
    return run("vvp", "-n", str(folder / "bench.vvp"))


def ghdl(folder):
    source = ROOT / "dut/startup/startup.vhd"
    head = source.read_text().split("port (")[1].split(");")[0]
    names = outputs(head, r"clk, rst, a : in std_logic|: out unsigned\(7 downto 0")
    signals = "".join(f"  signal {name} : unsigned(7 downto 0);\n" for name in names)
    ports = ", ".join(f"{name} => {name}" for name in names)
    shown = "".join(f'    write(l, string\'("{name} ")); write(l, std_logic_vector({name})); writeline(output, l);\n'
                    for name in names)
    bench = folder / "bench.vhd"
    bench.write_text(f"""library ieee; use ieee.std_logic_1164.all; use ieee.numeric_std.all; use std.textio.all;
entity bench is end;
architecture test of bench is
  signal clk, rst : std_logic := '0';
{signals}begin
  dut : entity work.startup port map (clk => clk, rst => rst, a => '0', {ports});
  process
    procedure show is variable l : line; begin
{shown}    end;
  begin
    wait for 10 ns; rst <= '1'; wait for 10 ns;
    for i in 1 to 4 loop wait for 5 ns; clk <= '1'; wait for 5 ns; clk <= '0'; end loop;
    wait for 5 ns; rst <= '0'; wait for 5 ns;
    show;
    for i in 1 to {CLOCKS} loop wait for 5 ns; clk <= '1'; wait for 4 ns; show; wait for 1 ns; clk <= '0'; end loop;
    wait;
  end process;
end;
""")
    run("ghdl", "-a", "--std=08", str(source), str(bench), cwd=folder)
    run("ghdl", "-e", "--std=08", "bench", cwd=folder)
    return run("ghdl", "-r", "--std=08", "bench", cwd=folder)


def main():
    rows = []
    for tool, simulate in (("icarus", icarus), ("ghdl", ghdl)):
        with tempfile.TemporaryDirectory() as folder:
            words = {}
            for line in simulate(Path(folder)).splitlines():
                name, word = line.split()
                known = set(word) <= set("01")
                words.setdefault(name, []).append(f"{int(word, 2):02x}" if known else "xx")
        for name, all_words in words.items():
            assert len(all_words) == CLOCKS + 1, name
            rows.append(f"{tool} {name} {' '.join(all_words)}")
    text = "# Outputs at the reset's end and after each of 20 clocks (testbench/startup.py).\n" + "\n".join(rows) + "\n"
    (ROOT / "record/startup.txt").write_text(text)
    print(f"{len(rows)} designs in testbench/record/startup.txt")


if __name__ == "__main__":
    sys.exit(main())
