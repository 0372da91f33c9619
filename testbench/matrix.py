#!/usr/bin/env python3
"""Eighty designs of one feature each, as people write them, run in two simulators: VHDL by hpu in Verilator and in
GHDL, Verilog by hpu in Verilator and by Icarus Verilog in a bench of its own, which gives it the inputs of hpu's
waveform. The words of all outputs are compared after every clock edge. A line a design: alike, refused (with the line
of the scene), or what is wrong; the counts last. Writes testbench/record/matrix.txt.

    testbench/matrix.py [--hpu target/debug/hpu] [name…]
"""

import argparse, re, shutil, subprocess, sys, tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parent

SCENE = """about = "matrix"
device = {{ kind = "motor", motor = "vasudevan_2007", wheel_ratio = 7 }}
clock = {{ frequency = "1 MHz" }}
run = {{ duration = "2 ms" }}
[dut]
files = [{files}]
top = "t"
clock = "clk"
{reset}{keys}
[dut.ports]
{ports}
[hand]
kind = "prescribed"
path = [["0 s", 0], ["1 ms", 0.2], ["2 ms", 0.1]]
"""
LINES = 'a = "encoder.a"\nb = "encoder.b"\n'
DRIVES = LINES + 'pwm = "bridge.pwm"\ndir = "bridge.direction"\n'
RESET = 'reset = { port = "rst" }\n'

# Verilog: a module with a counter `c`; the feature gives `n`, a byte.
V = """module t {params} (input clk, input rst, input a, input b, output pwm, output dir, output [7:0] n);
  reg [7:0] c; always @(posedge clk) if (rst) c <= 0; else c <= c + 1 + a;
  assign pwm = c[3]; assign dir = b;
  {body}
endmodule
"""
# VHDL: the same.
D = """library ieee; use ieee.std_logic_1164.all; use ieee.numeric_std.all; {context}
entity t is {generic} port (clk, rst, a, b : in std_logic; pwm, dir : out std_logic;
  n : out std_logic_vector(7 downto 0)); end;
architecture r of t is signal c : unsigned(7 downto 0) := (others => '0'); {declare}
begin
  process (clk) begin if rising_edge(clk) then if rst = '1' then c <= x"00"; elsif a = '1' then c <= c + 2;
    else c <= c + 1; end if; end if; end process;
  pwm <= c(3); dir <= b; {body}
end;
"""

designs = []


def add(point, standard, name, files, ports=DRIVES, keys="", reset=RESET, ends=0, refused=None):
    """A design: its files by their names, the keys of the scene, how hpu ends (0, or 1 with a message of the
    design), and words of the message if it may be refused."""
    designs.append((point, standard, name, files, ports, keys, reset, ends, refused))


def verilog(point, name, body, params="", standard="Verilog-2001", more=None, head="", **rest):
    source = head + V.format(params=params, body=body)
    ending = "sv" if standard.startswith("System") else "v"
    add(point, standard, name, {f"t.{ending}": source, **(more or {})}, **rest)


def vhdl(
    point, name, body, declare="", context="", generic="", standard="VHDL-2008", more=None, before="", **rest
):
    source = before + D.format(body=body, declare=declare, context=context, generic=generic)
    keys = rest.pop("keys", "") + ('standard = "93"\n' if standard == "VHDL-93" else "")
    add(point, standard, name, {**(more or {}), "t.vhd": source}, keys=keys, **rest)


def whole(point, standard, name, source, **rest):
    ending = "vhd" if standard.startswith("VHDL") else "sv" if standard.startswith("System") else "v"
    add(point, standard, name, {f"t.{ending}": source}, **rest)


IEEE = "library ieee; use ieee.std_logic_1164.all; use ieee.numeric_std.all;\n"
COUNT = "process (clk) begin if rising_edge(clk) then c <= c + 1; end if; end process;"


def ports_of_vhdl(name, ports, body, scene, standard="VHDL-2008", context="", before="", **rest):
    """A design that is about its ports alone."""
    source = (
        before + IEEE + context + f"entity t is port (clk : in std_logic; {ports}); end;\n"
        f'architecture r of t is signal c : unsigned(7 downto 0) := x"00"; begin {COUNT} {body} end;\n'
    )
    whole(1, standard, name, source, ports=scene, reset="", **rest)


def ports_of_verilog(name, ports, body, scene, standard="Verilog-2001", **rest):
    source = (
        f"module t (input clk, {ports}); reg [7:0] c = 0; always @(posedge clk) c <= c + 1; {body}"
        " endmodule\n"
    )
    whole(1, standard, name, source, ports=scene, reset="", **rest)


# 1. Bits of ports.
OUT = "pwm, dir : out std_logic"
PD = 'pwm = "bridge.pwm"\ndir = "bridge.direction"\n'
ports_of_vhdl(
    "lines in a vector",
    f"ab : in std_logic_vector(1 downto 0); {OUT}",
    "pwm <= c(3) and ab(1); dir <= ab(0);",
    'ab = ["encoder.a", "encoder.b"]\n' + PD,
)
ports_of_vhdl(
    "lines by index",
    f"ab : in std_logic_vector(0 to 1); {OUT}",
    "pwm <= c(3) and ab(0); dir <= ab(1);",
    '"ab(0)" = "encoder.a"\n"ab(1)" = "encoder.b"\n' + PD,
    standard="VHDL-93",
)
ports_of_vhdl(
    "pulse and direction in a vector",
    "a, b : in std_logic; o : out std_logic_vector(3 downto 0)",
    "o <= a & b & c(3) & c(7);",
    LINES + '"o(1)" = "bridge.pwm"\n"o(0)" = "bridge.direction"\n',
)
ports_of_vhdl(
    "record",
    f"e : in pair; {OUT}",
    "pwm <= c(3) and e.a; dir <= e.b;",
    '"e.a" = "encoder.a"\n"e.b" = "encoder.b"\n' + PD,
    context="use work.pairs.all;\n",
    before=(
        "library ieee; use ieee.std_logic_1164.all;\npackage pairs is type pair is record a, b : std_logic; "
        "end record; end;\n"
    ),
    refused="record|pair",
)
ports_of_vhdl(
    "sfixed",
    f"a, b : in std_logic; u : out sfixed(1 downto -6); {OUT}",
    "u <= to_sfixed(std_logic_vector(c), 1, -6); pwm <= c(3); dir <= a xor b;",
    DRIVES,
    context="use ieee.fixed_pkg.all;\n",
    refused="sfixed",
)
ports_of_vhdl(
    "enumeration",
    f"a, b : in std_logic; s : out std_logic_vector(1 downto 0); m : in mode; {OUT}",
    'pwm <= c(3) when m = fast else c(4); dir <= a xor b; s <= "10" when m = fast else "01";',
    DRIVES + "m = 1\n",
    context="use work.modes.all;\n",
    before="package modes is type mode is (slow, fast); end;\n",
    refused="mode",
)
ports_of_vhdl(
    "integer in a range",
    f"a, b : in std_logic; k : in integer range 0 to 9; {OUT}",
    "pwm <= '1' when c(3 downto 0) < k else '0'; dir <= a xor b;",
    DRIVES + "k = 5\n",
    standard="VHDL-93",
)
ports_of_vhdl(
    "boolean and bit",
    "a : in bit; b : in boolean; pwm : out std_logic; dir : out bit",
    "pwm <= c(3) when b else c(4); dir <= a;",
    DRIVES,
    standard="VHDL-93",
)
ports_of_verilog(
    "bundle",
    "input [7:0] ui_in, output [7:0] uo_out",
    "assign uo_out = {c[5:0], ui_in[1] & c[3], ui_in[0]};",
    '"ui_in[0]" = "encoder.a"\n"ui_in[1]" = "encoder.b"\n"ui_in[7:2]" = 0\n"uo_out[1]" = "bridge.pwm"\n'
    '"uo_out[0]" = "bridge.direction"\n',
)
ports_of_verilog(
    "list of bits",
    "input [3:0] i, output [1:0] o",
    "assign o = {c[3] & i[3], i[2] ^ i[0]};",
    'i = ["encoder.a", "encoder.b", 0, 1]\no = ["bridge.pwm", "bridge.direction"]\n',
)
ports_of_verilog(
    "ascending vector",
    "input [0:1] ab, output pwm, dir",
    "assign pwm = c[3] & ab[0]; assign dir = ab[1];",
    '"ab[0]" = "encoder.a"\n"ab[1]" = "encoder.b"\n' + PD,
)
ports_of_verilog(
    "packed structure",
    "input pair e, output pwm, dir",
    "assign pwm = c[3] & e.a; assign dir = e.b;",
    'e = ["encoder.a", "encoder.b"]\n' + PD,
    standard="SystemVerilog",
    refused="pair|e",
)
ports_of_verilog(
    "unpacked array",
    "input a, b, output pwm, dir, output [3:0] o [0:1]",
    "assign pwm = c[3]; assign dir = a ^ b; assign o[0] = c[3:0]; assign o[1] = c[7:4];",
    DRIVES,
    standard="SystemVerilog",
    refused="array|`o`",
)
ports_of_verilog(
    "inout",
    "input a, b, output pwm, dir, inout io",
    "assign pwm = c[3]; assign dir = a ^ b; assign io = c[7] ? 1'b0 : 1'bz;",
    DRIVES,
    refused="io",
)
designs[11][3]["t.sv"] = "typedef struct packed { logic a, b; } pair;\n" + designs[11][3]["t.sv"]

# 2. Legacy Verilog and VHDL.
verilog(
    2,
    "unit delays",
    "reg [7:0] m; always @(posedge clk) if (rst) m <= #1 0; else m <= #1 m + c; assign #1 n = m;",
    head="`timescale 1ns/1ps\n",
)
verilog(
    2,
    "initial with a delay",
    "reg [7:0] m; initial #1 m = 7; reg [7:0] k; always @(posedge clk) k <= m; assign n = k;",
    head="`timescale 1ns/1ps\n",
)
verilog(
    2,
    "blocking in a reset",
    "reg [7:0] m; reg f; always @(posedge clk or posedge rst) if (rst) begin f = 0; m <= 0; end "
    "else begin f <= a; m <= m + f; end assign n = m;",
    standard="Verilog-95",
)
verilog(
    2,
    "an included file",
    "assign n = c ^ `MASK;",
    head='`include "mask.vh"\n',
    more={"mask.vh": "`define MASK 8'h5a\n"},
    keys="",
)
verilog(
    2,
    "memory in hexadecimal",
    'reg [7:0] m [0:15]; initial $readmemh("m.hex", m); assign n = m[c[3:0]];',
    more={"m.hex": " ".join(f"{7 * i % 256:02x}" for i in range(16)) + "\n"},
)
verilog(
    2,
    "memory in binary",
    'reg [7:0] m [0:3]; initial $readmemb("m.bin", m); assign n = m[c[1:0]];',
    more={"m.bin": "00000001\n00000100\n00010000\n01000000\n"},
    standard="Verilog-95",
)
verilog(2, "ports of 1995", "", standard="Verilog-95")
designs[-1][3][
    "t.v"
] = """module t (clk, rst, a, b, pwm, dir, n); input clk, rst, a, b; output pwm, dir; output [7:0] n;
reg [7:0] n; wire pwm = n[3]; wire dir = a ^ b; always @(posedge clk) if (rst) n <= 0; else n <= n + 3; endmodule
"""
verilog(
    2,
    "functions and tasks",
    "reg [7:0] m; function [7:0] twice; input [7:0] x; twice = x << 1; endfunction task step; input [7:0] x;"
    " begin m = m + x; end endtask always @(posedge clk) if (rst) m = 0; else step(twice(c)); assign n = m;",
    standard="Verilog-95",
)
verilog(
    2,
    "casex and casez",
    "reg [7:0] m; always @* casez (c[3:0]) 4'b1???: m = 1; 4'b01??: m = 2; default: m = 3; endcase "
    "assign n = m;",
    standard="Verilog-95",
)
verilog(
    2,
    "parameters",
    "assign n = (c > LIMIT) ? 8'd1 : STEP;",
    params="#(parameter LIMIT = 9, parameter [7:0] STEP = 2)",
    keys="parameters = { LIMIT = 40, STEP = 5 }\n",
)
verilog(
    2,
    "a real parameter",
    "localparam integer K = SCALE * 10.0; assign n = K;",
    params="#(parameter real SCALE = 1.5)",
    keys="parameters = { SCALE = 2.5 }\n",
)
verilog(
    2,
    "generated instances",
    "genvar i; generate for (i = 0; i < 8; i = i + 1) begin : g assign n[i] = c[7 - i]; end endgenerate",
)
verilog(
    2,
    "signed arithmetic",
    "reg signed [7:0] m; always @(posedge clk) if (rst) m <= 0; else m <= m + ($signed(c) >>> 2); assign n"
    " = m;",
)
vhdl(
    2,
    "a memory from a file",
    "n <= rom(to_integer(c(1 downto 0)));",
    declare=(
        "type mem is array (0 to 3) of std_logic_vector(7 downto 0); impure function load return mem is file"
        ' f : text open read_mode is "m.txt"; variable l : line; variable w : bit_vector(7 downto 0);'
        " variable m : mem; begin for i in mem'range loop readline(f, l); read(l, w); m(i) :="
        " to_stdlogicvector(w); end loop; return m; end; signal rom : mem := load;"
    ),
    context="use std.textio.all;",
    more={"m.txt": "00000011\n00001100\n00110000\n11000000\n"},
)
vhdl(
    2,
    "two libraries",
    "n <= std_logic_vector(c xor MASK);",
    context="library lib; use lib.p.all;",
    more={"p.vhd": IEEE + 'package p is constant MASK : unsigned(7 downto 0) := x"a5"; end;\n'},
)
vhdl(
    2,
    "files in any order",
    "u : entity work.inner port map (c, n);",
    more={
        "z.vhd": IEEE + "package z is constant K : integer := 3; end;\n",
        "inner.vhd": (
            IEEE
            + "use work.z.all; entity inner is port (c : in unsigned(7 downto 0); n : out std_logic_vector(7 "
            "downto 0)); end; architecture r of inner is begin n <= std_logic_vector(c + K); end;\n"
        ),
    },
    standard="VHDL-93",
)
vhdl(
    2,
    "a real generic",
    "n <= std_logic_vector(c) when K > 1.0 else not std_logic_vector(c);",
    generic="generic (K : real := 1.5);",
    keys="generics = { K = 0.5 }\n",
)
vhdl(
    2,
    "a time generic",
    'n <= x"01" when T > 2 us else x"02";',
    generic="generic (T : time := 1 us);",
    keys='generics = { T = "5 us" }\n',
    standard="VHDL-93",
)
vhdl(
    2,
    "a vector generic",
    "n <= std_logic_vector(c) xor M;",
    generic='generic (M : std_logic_vector(7 downto 0) := x"00");',
    keys='generics = { M = "00110101" }\n',
)
vhdl(2, "a delay", "n(7 downto 1) <= (others => '0'); n(0) <= transport c(3) after 5 us;", standard="VHDL-93")

# 3. VHDL names that are keywords of Verilog.
WORDS = [
    "reg",
    "input",
    "output",
    "wire",
    "edge",
    "table",
    "int",
    "ref",
    "module",
    "logic",
    "assign",
    "always",
]
for word in WORDS[:8]:
    vhdl(
        3,
        f"signal {word}",
        f"process (clk) begin if rising_edge(clk) then {word} <= {word} xor std_logic_vector(c); end if; end "
        f"process; n <= {word};",
        declare=f'signal {word} : std_logic_vector(7 downto 0) := x"00";',
        standard="VHDL-93" if word in ("reg", "wire", "table", "ref") else "VHDL-2008",
    )
for word in WORDS[8:]:
    vhdl(
        3,
        f"entity {word}",
        f"u : entity work.{word} port map (c, n);",
        before=IEEE
        + f"entity {word} is port (int : in unsigned(7 downto 0); reg : out std_logic_vector(7 downto 0));"
        f" end; architecture r of {word} is begin reg <= std_logic_vector(int + 1); end;\n",
    )

whole(
    3,
    "VHDL-93",
    "ports input and output",
    IEEE + f"entity t is port (clk, input, wire : in std_logic; output, reg : out "
    f'std_logic); end; architecture r of t is signal c : unsigned(7 downto 0) := x"00"; begin {COUNT} output'
    " <= c(3) and "
    "input; reg <= wire; end;\n",
    reset="",
    ports='input = "encoder.a"\nwire = "encoder.b"\noutput = "bridge.pwm"\nreg = "bridge.direction"\n',
)
vhdl(
    3,
    "generic localparam",
    "n <= std_logic_vector(c + localparam);",
    generic="generic (localparam : integer := 3);",
    keys="generics = { localparam = 5 }\n",
)

# 4. Values that nothing has set.
verilog(4, "a reset that rises", "reg f = 0; always @(posedge rst) f <= 1; assign n = f;")
verilog(
    4,
    "a divided clock",
    "reg h; reg [7:0] m; always @(posedge clk or posedge rst) if (rst) h <= 0; else h <= ~h; "
    "always @(posedge h or posedge rst) if (rst) m <= 0; else m <= m + 1; assign n = m;",
)
verilog(
    4,
    "registers that begin at 0",
    "reg [7:0] m; always @(posedge clk) m <= m + 1; assign n = m;\n"
    "`ifdef __ICARUS__\n  initial m = 0;\n`endif",
    keys='registers = "zero"\n',
    params="",
    reset=RESET,
)
verilog(
    4,
    "a pipeline that fills",
    "reg [7:0] x, y; always @(posedge clk) begin x <= c; y <= x; end assign n = y;",
    standard="Verilog-95",
)
verilog(
    4,
    "an active-low reset",
    "wire r = ~rst; reg [7:0] m; always @(posedge clk or negedge r) if (!r) m <= 9; else m <= m + 1; "
    "assign n = m;",
)
verilog(
    4,
    "logic with an initial value",
    "logic [7:0] m = 8'h3c; always_ff @(posedge clk) m <= {m[6:0], m[7]}; assign n = m;",
    standard="SystemVerilog",
)
vhdl(
    4,
    "when others takes U",
    'process (clk) begin if rising_edge(clk) then now <= b & a; old <= now; case now & old is when "0001" |'
    ' "0111" | "1110" | "1000" => m <= m + 1; when "0010" | "1011" | "1101" | "0100" => m <= m - 1; when'
    " others => null; end case; end if; end process; n <= std_logic_vector(m);",
    declare='signal m : unsigned(7 downto 0) := x"00"; signal old, now : std_logic_vector(1 downto 0);',
    ports=DRIVES.replace("pwm = ", '"n(1)" = ').replace("dir = ", '"n(2)" = '),
)
vhdl(
    4,
    "an enumeration without a value",
    "process (clk) begin if rising_edge(clk) then case s is when one => s <= two; when two => "
    's <= three; when three => s <= one; end case; end if; end process; n <= x"01" when s = one else x"02";',
    declare="type kind is (one, two, three); signal s : kind;",
    ports=DRIVES.replace("pwm = ", '"n(0)" = ').replace("dir = ", '"n(1)" = '),
)
whole(
    4,
    "VHDL-2008",
    "a reset that acts low",
    IEEE
    + "entity t is port (clk, rst_n : in std_logic; pwm, dir : out std_logic; n : out unsigned(7 downto 0));"
    ' end; architecture r of t is signal falls : unsigned(7 downto 0) := x"00"; begin process (all) begin'
    ' if not rst_n then n <= x"07"; elsif rising_edge(clk) then n <= n + 1; end if; if falling_edge(rst_n)'
    " then falls <= falls + 1; end if; end process; pwm <= n(3); dir <= falls(0); end;\n",
    ports=PD,
    reset='reset = { port = "rst_n", active = "low" }\n',
)
vhdl(
    4,
    "rising_edge of the reset",
    "process (rst) begin if rising_edge(rst) then m <= m + 1; end if; end process; n <= std_logic_vector(m);",
    declare='signal m : unsigned(7 downto 0) := x"00";',
)
vhdl(
    4,
    "an integer with a value",
    "process (clk) begin if rising_edge(clk) then if k = 9 then k <= 0; else k <= k + 1; end if; end if; "
    "end process; n <= std_logic_vector(to_unsigned(k, 8));",
    declare="signal k : integer range 0 to 9 := 4;",
    standard="VHDL-93",
)

# 5. A part alone.
whole(
    5,
    "Verilog-95",
    "a decoder alone",
    "module t (clk, a, b, n); input clk, a, b; output [7:0] n; reg [7:0] n; reg [1:0] o; initial begin n = 0;"
    " o = 0; end always @(posedge clk) begin o <= {a, b}; if (o[0] != o[1] ^ a ^ b) n <= n + 1; end"
    " endmodule\n",
    ports=LINES,
    reset="",
)
whole(
    5,
    "Verilog-2001",
    "a pulse alone",
    "module t (input clk, output reg pwm); reg [7:0] c = 0; initial pwm = 0; always @(posedge clk) "
    "begin c <= c + 1; pwm <= c < 77; end endmodule\n",
    ports='pwm = "bridge.pwm"\n',
    reset="",
)
whole(
    5,
    "SystemVerilog",
    "a filter alone",
    "module t (input logic clk, rst, input logic signed [15:0] x, output logic signed [15:0] y); "
    "always_ff @(posedge clk) if (rst) y <= 0; else y <= y + ((x - y) >>> 3); endmodule\n",
    ports='x = "encoder.count"\n',
)
whole(
    5,
    "SystemVerilog",
    "a decoder with a signed count",
    "module t (input logic clk, rst, a, b, output logic signed [11:0] n); logic [1:0] o; always_ff @(posedge"
    " clk) if (rst) begin n <= 0; o <= {a, b}; end else begin o <= {a, b}; if (o != {a, b}) n <= (o[1] ^ b) ?"
    " n + 12'sd1 : n - 12'sd1; end endmodule\n",
    ports=LINES,
)
whole(
    5,
    "VHDL-93",
    "a decoder in VHDL alone",
    IEEE
    + "entity t is port (clk, a, b : in std_logic; n : out std_logic_vector(7 downto 0)); end; architecture r"
    " of t is signal m : unsigned(7 downto 0) := x\"00\"; signal o : std_logic := '0'; begin process (clk)"
    " begin if clk'event and clk = '1' then o <= a; if o /= a then m <= m + 1; end if; end if; end process;"
    " n <= std_logic_vector(m); end;\n",
    ports=LINES,
    reset="",
)
whole(
    5,
    "VHDL-2008",
    "a filter in VHDL alone",
    IEEE
    + "entity t is port (clk, rst : in std_logic; x : in signed(11 downto 0); y : out signed(11 downto 0));"
    " end; architecture r of t is begin process (all) begin if rising_edge(clk) then if rst = '1' then y <="
    " (others => '0'); else y <= y + shift_right(x - y, 2); end if; end if; end process; end;\n",
    ports='x = "encoder.count"\n',
)
whole(
    5,
    "VHDL-93",
    "a pulse and no encoder",
    IEEE + "entity t is port (clk, rst : in std_logic; pwm, dir : out std_logic); end; architecture r of t is"
    " signal c : unsigned(5 downto 0); begin process (clk) begin if rising_edge(clk) then if rst = '1' then"
    " c <= (others => '0'); else c <= c + 1; end if; end if; end process; pwm <= '1' when c < 20 else '0';"
    " dir <= c(5); end;\n",
    ports=PD,
)
whole(
    5,
    "VHDL-2008",
    "gates of a bridge alone",
    IEEE
    + "entity t is port (clk, rst : in std_logic; g : out std_logic_vector(3 downto 0)); end; architecture r"
    " of t is signal c : unsigned(5 downto 0); begin process (clk) begin if rising_edge(clk) then if rst"
    " then c <= (others => '0'); else c <= c + 1; end if; end if; end process; g <= \"1001\" when c < 20"
    ' else "0000"; end;\n',
    ports='g = ["bridge.plus_high", "bridge.plus_low", "bridge.minus_high", "bridge.minus_low"]\n',
)

# 6. Assertions, and the end of a simulation.
verilog(
    6,
    "an assertion that holds",
    "assign n = c; always @(posedge clk) if (!rst) assert (c <= 255);",
    standard="SystemVerilog",
)
verilog(
    6,
    "an assertion that fails",
    'assign n = c; always @(posedge clk) if (!rst) assert (c != 99) else $error("at 99");',
    standard="SystemVerilog",
    ends="at 99",
)
verilog(
    6,
    "$fatal",
    'assign n = c; always @(posedge clk) if (!rst && c == 99) $fatal(1, "at 99");',
    standard="SystemVerilog",
    ends="at 99",
)
verilog(
    6,
    "a concurrent assertion that holds",
    "assign n = c; assert property (@(posedge clk) disable iff (rst) c <= 8'd255);",
    standard="SystemVerilog",
)
verilog(
    6,
    "a concurrent assertion that fails",
    'assign n = c; assert property (@(posedge clk) disable iff (rst) c != 8\'d99) else $error("at 99");',
    standard="SystemVerilog",
    ends="at 99",
)
verilog(6, "$display", 'assign n = c; always @(posedge clk) if (c == 99) $display("at %0d", c);')
verilog(6, "$finish", "assign n = c; always @(posedge clk) if (!rst && c == 200) $finish;", ends="$finish")
for severity, ends in (("note", 0), ("warning", 0), ("error", "at 99"), ("failure", "at 99")):
    vhdl(
        6,
        f"severity {severity}",
        f"n <= std_logic_vector(c); process (clk) begin if rising_edge(clk) then assert c /= 99 report "
        f'"at 99" severity {severity}; end if; end process;',
        ends=ends,
        standard="VHDL-93" if ends else "VHDL-2008",
    )
vhdl(
    6,
    "an assertion of the elaboration",
    'n <= std_logic_vector(c); assert K > 1 report "K is small" severity failure;',
    generic="generic (K : integer := 4);",
)
vhdl(
    6,
    "report in a function",
    "n <= f(c); ",
    declare=(
        "function f(x : unsigned) return std_logic_vector is begin if x = 99 then report "
        '"at 99" severity note; end if; return std_logic_vector(x); end;'
    ),
    standard="VHDL-93",
)


def execute(command, folder, **options):
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300, **options)


def waveform(path):
    """The changes of each signal of the top, by edges: name -> [(edge, word)], a cycle being ten steps."""
    names, found, time, depth = {}, {}, 0, 0
    for line in path.read_text().splitlines():
        part = line.split()
        if not part:
            continue
        if part[0] == "$scope":
            depth += 1
            inside = depth == 1 and part[2] == "t"
            names_open = inside
        elif part[0] == "$upscope":
            depth -= 1
            names_open = depth == 1 and False
        elif part[0] == "$var" and depth == 1 and names_open:
            names[part[3]] = part[4].split("[")[0]
        elif line[0] == "#":
            time = int(line[1:])
        elif line[0] in "01xXzZuU" and line[1:] in names:
            found.setdefault(names[line[1:]], []).append((time // 10, line[0]))
        elif line[0] == "b" and part[1] in names:
            found.setdefault(names[part[1]], []).append((time // 10, part[0][1:]))
    return found


def at(changes, edge):
    return next((word for when, word in reversed(changes) if when <= edge), "x")


def same(one, two):
    """Whether two words are equal as far as both are known."""
    width = max(len(one), len(two))
    one, two = one.rjust(width, "0"), two.rjust(width, "0")
    return (
        "x" in (one + two).lower() or "z" in (one + two).lower() or "u" in (one + two).lower() or one == two
    )


def difference(one, two, names, edges):
    for name in names:
        known = 0
        for edge in range(edges + 1):
            words = at(one[name], edge), at(two[name], edge)
            if not same(*words):
                return f"`{name}` is {words[0]} and {words[1]} after clock {edge}"
            known += not set(words[0] + words[1]) - set("01")
        if known < edges // 2:
            return f"`{name}` is not known"
    return None


def by_hpu(hpu, folder, design, engine):
    point, standard, name, files, ports, keys, reset, ends, refused = design
    listed = [file for file in files if file.endswith((".v", ".sv", ".vhd"))]
    quoted = [
        (
            f'{{ file = "{file}", library = "lib" }}'
            if name == "two libraries" and file == "p.vhd"
            else f'"{file}"'
        )
        for file in listed
    ]
    scene = SCENE.format(
        files=", ".join(quoted), reset=reset, keys=keys + f'engine = "{engine}"\n', ports=ports
    )
    (folder / f"{engine}.toml").write_text(scene)
    out = folder / engine
    ran = execute([hpu, "run", f"{engine}.toml", "--vcd", "--no-plot", "-o", str(out)], folder)
    return ran.returncode, ran.stdout + ran.stderr, waveform(out / "wave.vcd") if ran.returncode == 0 else {}


def by_icarus(folder, design, given):
    """The outputs by Icarus Verilog, of the inputs that hpu's waveform has."""
    point, standard, name, files, ports, keys, reset, ends, refused = design
    top = next(file for file in files if file.startswith("t."))
    head = re.search(r"module t\b(.*?)\);(.*)", files[top], re.S)
    text = head[1].split("(", 1)[-1] if "#" not in head[1] else head[1].rsplit("(", 1)[-1]
    if standard == "Verilog-95" and "input" not in text:
        text = ", ".join(re.findall(r"((?:input|output)[^;]*)", head[2]))
    items, kind = [], None
    for item in text.split(","):
        way = re.match(
            r"\s*(input|output|inout)?\s*(?:wire|reg|logic|pair)?\s*(signed)?\s*(\[[^]]*\])?\s*(\w+)", item
        )
        kind = (way[1], way[3] or "") if way[1] else (kind[0], way[3] or kind[1])
        if "pair e" in item:
            kind = (kind[0], "[1:0]")
        items.append((way[4], *kind))
    values = dict(re.findall(r"(\w+) = ([\d.]+)", keys)) if "parameters" in keys else {}
    assign = "".join(f", .{name}({value})" for name, value in values.items())
    inputs = [(name, bits) for name, way, bits in items if way == "input" and name not in ("clk", "rst")]
    outputs = [(name, bits) for name, way, bits in items if way == "output"]
    regs = "".join(f"  reg {bits} {name};\n" for name, bits in inputs)
    wires = "".join(f"  wire {bits} {name};\n" for name, bits in outputs)
    rows = {}
    for name, bits in inputs:
        for edge, word in given.get(name, []):
            rows.setdefault(edge, []).append(f"{name} = {len(word)}'b{word};")
    # A word after an edge is the one that the edge sampled.
    steps = "".join(f"      {edge}: begin {' '.join(sets)} end\n" for edge, sets in sorted(rows.items()))
    shown = "".join(f'    $display("HPU {name} %b", {name});\n' for name, bits in outputs)
    ports = ", ".join(f".{name}({name})" for name, way, bits in items)
    resets = (
        "rst = 0; #10 rst = 1; #10 repeat (4) begin #5 clk = 1; #5 clk = 0; end #5 rst = 0; #5"
        if reset
        else "#10"
    )
    (folder / "bench.sv").write_text(f"""`timescale 1ns / 1ps
module bench;
  reg clk = 0, rst = 0;
  integer edges = 0;
{regs}{wires}  t {'#(' + assign[2:] + ') ' if assign else ''}dut ({ports});
  task show; begin
{shown}  end endtask
  task give; case (edges)
{steps}      default: ;
    endcase endtask
  initial begin
    give;
    {resets} show;
    repeat (1999) begin edges = edges + 1; #2 give; #3 clk = 1; #4 show; #1 clk = 0; end
    $finish;
  end
endmodule
""")
    sources = [file for file in files if file.endswith((".v", ".sv"))]
    made = execute(
        ["iverilog", "-g2012", "-gno-assertions", "-s", "bench", "-o", "bench.vvp", *sources, "bench.sv"],
        folder,
    )
    if made.returncode:
        return None, made.stderr
    said = execute(["vvp", "-n", "bench.vvp"], folder)
    found, edges = {}, {}
    for line in said.stdout.splitlines():
        if line.startswith("HPU "):
            _, name, word = line.split()
            edge = edges[name] = edges.get(name, -1) + 1
            found.setdefault(name, []).append((edge, word))
    return found, said.stdout + said.stderr


def judged(hpu, design):
    point, standard, name, files, ports, keys, reset, ends, refused = design
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        for file, text in files.items():
            (folder / file).write_text(text)
        is_vhdl = standard.startswith("VHDL")
        code, said, words = by_hpu(hpu, folder, design, "auto" if is_vhdl else "verilator")
        reason = next((line for line in said.splitlines() if line.startswith("error")), said.strip()[-200:])
        if ends and code == (ends != "$finish") and ends in said:
            other = by_hpu(hpu, folder, design, "ghdl") if is_vhdl else (1, ends, {})
            return (
                "alike" if other[0] == 1 and ends in other[1] else f"GHDL does not end: {other[1][-160:]!r}"
            )
        if ends:
            return f"does not end with `{ends}`: code {code}, {reason}"
        if code:
            at_line = re.search(r"\.toml:\d+", said) and refused and re.search(refused, said)
            return f"refused at its line: {reason}" if at_line else f"error: {reason}"
        if is_vhdl:
            code, said, others = by_hpu(hpu, folder, design, "ghdl")
            if code:
                return f"GHDL: {said.strip()[-200:]}"
            by = "hpu in Verilator and GHDL"
        else:
            others, said = by_icarus(folder, design, words)
            if others is None:
                return f"Icarus refuses it: {said.strip()[:160]}"
            by = "Verilator and Icarus"
        names = [name for name in others if name in words]
        if not names:
            return "no outputs"
        return difference(words, others, names, 1990) or "alike"


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--hpu", default=str(ROOT.parent / "target/debug/hpu"))
    parser.add_argument("names", nargs="*")
    arguments = parser.parse_args()
    hpu = Path(arguments.hpu).resolve()
    chosen = [
        design
        for design in designs
        if not arguments.names or any(part in design[2] for part in arguments.names)
    ]
    with ThreadPoolExecutor(2) as pool:
        rows = []
        for design, result in zip(chosen, pool.map(lambda design: judged(hpu, design), chosen)):
            rows.append((design, result))
            print(f"{design[0]} {design[1]:<13} {design[2]:<34} {result}", flush=True)
    alike = sum(result == "alike" for _, result in rows)
    refused = sum(result.startswith("refused at its line") for _, result in rows)
    total = (
        f"{len(rows)} designs: {alike} alike, {refused} refused at their line, {len(rows) - alike - refused}"
        " wrong"
    )
    print(total)
    if not arguments.names:
        lines = [f"{d[0]} {d[1]:<13} {d[2]:<34} {' '.join(r.split())[:140]}".rstrip() for d, r in rows]
        (ROOT / "record/matrix.txt").write_text("# testbench/matrix.py\n" + "\n".join(lines + [total]) + "\n")
    return 0 if alike + refused == len(rows) else 1


if __name__ == "__main__":
    sys.exit(main())
