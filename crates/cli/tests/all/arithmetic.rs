//! Arithmetic of a design in VHDL on its way through synthesis to Verilog: the numbers are VHDL's.

use std::collections::BTreeMap;

use crate::common::{assert_refused, code, run, scratch, stderr};
use crate::ports::{scene, shown};

/// Operations whose Verilog GHDL 2.0 writes wrongly, beside some that it writes right. `d` goes through all words of 8
/// bits, `e` is an odd word that jumps.
const DESIGN: &str = "library ieee; use ieee.std_logic_1164.all; use ieee.numeric_std.all;
package numbers is constant C : integer := 9; subtype byte is signed(7 downto 0);
  type pair is record v : byte; end record; end package;
library ieee; use ieee.std_logic_1164.all; use ieee.numeric_std.all;
entity cut is port (w : in std_logic_vector(7 downto 0); s : out signed(4 downto 0)); end entity;
architecture rtl of cut is begin s <= resize(signed(w), 5); end architecture;
library ieee; use ieee.std_logic_1164.all; use ieee.numeric_std.all; use work.numbers.all;
entity arithmetic is
  port (clk, rst, a, b : in std_logic; d, e : out signed(7 downto 0); pwm, dir : out std_logic;
    quotient, by_4, remainder, modulo, mod_3, less, less_c, more, nested, field : out signed(7 downto 0);
    summed, doubled, called, sized, mixed : out signed(7 downto 0);
    whole, whole_rem, whole_mod : out signed(9 downto 0); short, sum, first : out signed(4 downto 0);
    low : out unsigned(4 downto 0); unsigned_less : out unsigned(7 downto 0));
end entity;
architecture rtl of arithmetic is
  function thrice(of_it : integer) return integer is begin return 3 * of_it; end;
  signal n : unsigned(7 downto 0) := (others => '0');
  type list is array (0 to 1) of byte; signal l : list;
  signal x, y : byte; signal p : pair; signal k : integer range 0 to 15;
begin
  process (clk) begin
    if rising_edge(clk) then n <= n + 1; if rst = '1' then n <= (others => '0'); end if; end if;
  end process;
  x <= signed(n); y <= signed(resize(n * 37, 8)) or \"00000001\"; p.v <= x; l <= (x, y); k <= to_integer(n(3 downto 0));
  d <= x; e <= y; pwm <= a; dir <= b;
  quotient <= x / y; by_4 <= x / 4; remainder <= x rem y; modulo <= x mod y; mod_3 <= x mod (-3);
  less <= 7 - x; less_c <= C - (x + 1); more <= x - 7; nested <= (k) - x when x /= 7 - y else k - x; field <= 5 - p.v;
  summed <= x + 1 - y; doubled <= resize(x * 2 - y, 8); called <= thrice(k) - x; sized <= x'length + 1 - x;
  mixed <= 3 - k + x - y;
  whole <= to_signed(to_integer(x) / 3, 10); whole_rem <= to_signed(to_integer(x) rem 5, 10);
  whole_mod <= to_signed(to_integer(x) mod 5, 10);
  short <= resize(l(0), 5); sum <= resize(p.v + y, 5); low <= resize(n, 5); unsigned_less <= 9 - n;
  first_port: entity work.cut port map (w => std_logic_vector(x), s => first);
end architecture;
";

#[test]
#[ignore = "testbench/long.sh runs it"]
fn signed_divisions_differences_and_short_words_are_those_of_vhdl() {
    let dir = scratch("arithmetic");
    let ports = "a = \"encoder.a\"\nb = \"encoder.b\"\npwm = \"bridge.pwm\"\ndir = \"bridge.direction\"\n";
    let path = scene(&dir, ("arithmetic.vhd", DESIGN), "engine = \"verilator\"", ports);
    let names = [
        "d",
        "e",
        "quotient",
        "by_4",
        "remainder",
        "modulo",
        "mod_3",
        "less",
        "less_c",
        "more",
        "nested",
        "field",
        "summed",
        "doubled",
        "called",
        "sized",
        "mixed",
        "whole",
        "whole_rem",
        "whole_mod",
        "short",
        "sum",
        "first",
        "low",
        "unsigned_less",
    ];
    let found = shown(&path, &[], names);
    let signed = |word: u64, bits: u32| (word << (64 - bits)).cast_signed() >> (64 - bits);
    // To fewer bits: the sign stays, and the bits at the right.
    let short = |word: i64| signed((word & 15).cast_unsigned() | u64::from(word < 0) << 4, 5);
    let row = |edge: usize| names.iter().zip(&found).map(move |(name, words)| (*name, words[edge]));
    for row in (0..found[0].len()).map(|edge| row(edge).collect::<BTreeMap<_, _>>()) {
        let at = |name: &str| row[name];
        let (x, y, n) = (signed(at("d"), 8), signed(at("e"), 8), at("d").cast_signed());
        let byte = |value: i64| signed(value.cast_unsigned(), 8);
        let modulo = |one: i64, other: i64| match one % other {
            rest if rest != 0 && (rest < 0) != (other < 0) => rest + other,
            rest => rest,
        };
        for (name, bits, expected) in [
            ("quotient", 8, byte(x / y)),
            ("by_4", 8, x / 4),
            ("remainder", 8, x % y),
            ("modulo", 8, modulo(x, y)),
            ("mod_3", 8, modulo(x, -3)),
            ("less", 8, byte(7 - x)),
            ("less_c", 8, byte(9 - byte(x + 1))),
            ("more", 8, byte(x - 7)),
            ("nested", 8, byte((n & 15) - x)),
            ("field", 8, byte(5 - x)),
            ("summed", 8, byte(x + 1 - y)),
            ("doubled", 8, (2 * x - y) & 127 | if 2 * x - y < 0 { -128 } else { 0 }),
            ("called", 8, byte(3 * (n & 15) - x)),
            ("sized", 8, byte(9 - x)),
            ("mixed", 8, byte(3 - (n & 15) + x - y)),
            ("whole", 10, x / 3),
            ("whole_rem", 10, x % 5),
            ("whole_mod", 10, x.rem_euclid(5)),
            ("short", 5, short(x)),
            ("sum", 5, short(byte(x + y))),
            ("first", 5, short(x)),
        ] {
            assert_eq!(signed(at(name), bits), expected, "{name} of {x} and {y}");
        }
        assert_eq!((at("low"), at("unsigned_less")), (at("d") & 31, (9 - n).cast_unsigned() & 255), "of {n}");
    }
    assert_eq!(shown(&path, &["--set", "dut.engine=ghdl"], names), found, "GHDL");
}

#[test]
fn a_word_whose_sign_the_text_does_not_tell_stays_with_ghdl() {
    let dir = scratch("untold_arithmetic");
    let source = DESIGN.replace("resize(p.v + y, 5)", "resize(like(x), 5)").replace(
        "architecture rtl of arithmetic is",
        "architecture rtl of arithmetic is
           function like(w : byte) return byte is begin return w; end;
           function like(w : byte) return std_logic_vector is begin return \"01\"; end;",
    );
    let ports = "a = \"encoder.a\"\nb = \"encoder.b\"\npwm = \"bridge.pwm\"\ndir = \"bridge.direction\"\n";
    let path = scene(&dir, ("arithmetic.vhd", &source), "engine = \"verilator\"", ports);
    let told = "the text does not tell the type of what is resized here";
    assert_refused(&run(&["run", &path]), 1, &[told]);
    let output = run(&["run", &path, "--set", "dut.engine=auto"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert!(stderr(&output).contains("note: GHDL simulates") && stderr(&output).contains(told), "{}", stderr(&output));
}
