//! Ports that are no single word: records, arrays, enumerations and fixed-point numbers.

use std::fs;
use std::path::Path;

use crate::common::{assert_refused, code, json, run, scratch, stderr, text};
use crate::dut::words;

/// Clock edges of a run.
const EDGES: usize = 300;

/// Writes a design and a scene at 1 MHz with these connections.
pub(crate) fn scene(dir: &Path, (file, source): (&str, &str), more: &str, ports: &str) -> String {
    let (name, _) = file.split_once('.').expect("an extension");
    fs::write(dir.join(file), source).expect("a design");
    let toml = format!(
        "about = \"ports\"\ndevice = {{ kind = \"motor\", motor = \"vasudevan_2007\" }}\nclock = {{ frequency = \"1 \
         MHz\" }}\nhand = {{ kind = \"prescribed\", path = [[0, 0], [0.0003, 0.3]] }}\nrun = {{ duration = \"{EDGES} \
         us\" }}\n[dut]\nfiles = [\"{file}\"]\ntop = \"{name}\"\nclock = \"clk\"\nreset = {{ port = \
         \"rst\" }}\n{more}\n[dut.ports]\n{ports}\n"
    );
    let path = dir.join(format!("{name}.toml"));
    fs::write(&path, toml).expect("a scene");
    text(&path).to_string()
}

/// Runs a scene. Returns the words of each of these ports, without a sign, after each clock edge from the first one on.
pub(crate) fn shown<const N: usize>(scene: &str, more: &[&str], ports: [&str; N]) -> [Vec<u64>; N] {
    let out = Path::new(scene).with_extension("out");
    let output = run(&[&["run", scene, "--vcd", "--no-plot", "-o", text(&out)], more].concat());
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let words = words(&out.join("wave.vcd"));
    ports.map(|port| {
        let all = || words.keys().cloned().collect::<Vec<_>>().join(", ");
        let found = words.iter().find(|(name, _)| name.ends_with(&format!(".{port}")));
        let (_, changes) = found.unwrap_or_else(|| panic!("no {port} among {}", all()));
        // The waveform has ten units of time in a clock cycle.
        let at = |edge: usize| changes.iter().rfind(|(time, _)| *time <= 10 * edge as u64).expect("a word");
        let word = |edge| u64::from_str_radix(&format!("0{}", at(edge).1), 2).expect("bits");
        (1..EDGES).map(word).collect()
    })
}

const COMPOSITE: &str = "library ieee; use ieee.std_logic_1164.all; use ieee.numeric_std.all;
package parts is
  type line_t is record a, b : std_logic; end record;
  type mode_t is (idle, drive, brake);
  type gains_t is array (natural range <>) of signed(7 downto 0);
  type told_t is record mode : mode_t; sum : signed(9 downto 0); count : std_logic_vector(4 to 11); end record;
end package;
library ieee; use ieee.std_logic_1164.all; use ieee.numeric_std.all; use ieee.fixed_pkg.all; use work.parts.all;
entity composite is
  generic (LAST : positive := 2);
  port (clk, rst : in std_logic; enc : in line_t; mode : in mode_t; gains : in gains_t(1 to LAST);
    pos : in sfixed(3 downto -12); duty : out sfixed(0 downto -11); told : out told_t; both : out std_logic);
end entity;
architecture rtl of composite is
  signal n : unsigned(7 downto 0) := (others => '0');
begin
  process (clk) begin
    if rising_edge(clk) then
      n <= n + 1;
      if rst = '1' then n <= (others => '0'); end if;
    end if;
  end process;
  both <= enc.a and not enc.b;
  duty <= resize(-pos, 0, -11);
  told.mode <= mode;
  told.sum <= resize(gains(1), 10) + gains(2) + gains(LAST);
  told.count <= std_logic_vector(n);
end architecture;
";

#[test]
fn records_arrays_enumerations_and_fixed_point_ports_are_connected_by_word() {
    let dir = scratch("composite_ports");
    let ports = "\"enc.a\" = \"encoder.a\"\n\"enc.b\" = \"encoder.b\"\nmode = 2\n\"gains(1)\" = 5\n\"gains(2)\" = -7\n\
                 \"gains(3)\" = 100\npos = { is = \"encoder.angle\", format = \"(1,3,12)\" }\n\
                 duty = { is = \"bridge.duty\", format = \"(1,0,11)\" }\n";
    let path = scene(&dir, ("composite.vhd", COMPOSITE), "generics = { LAST = 3 }", ports);
    let names = ["enc.a", "enc.b", "both", "told.mode", "told.sum", "told.count", "pos", "duty"];
    let found = shown(&path, &[], names);
    let [a, b, both, mode, sum, count, pos, duty] = &found;
    assert!(mode.iter().all(|&word| word == 2), "the third literal");
    assert!(sum.iter().all(|&word| word == 5 + 100 - 7), "of gains");
    // The counter is 1 after the first edge. The vector's left index is its highest bit.
    assert!(count.iter().zip(1..).all(|(&word, edge)| word == edge % 256), "{count:?}");
    assert!(a.iter().zip(b).zip(both).all(|((a, b), both)| *both == u64::from(*a == 1 && *b == 0)));
    assert!(both.contains(&1) && both.contains(&0), "the encoder has not moved");
    // The angle has one bit more behind the point than the duty.
    let signed = |word: u64, bits: u32| (word << (64 - bits)).cast_signed() >> (64 - bits);
    for (pos, duty) in pos.iter().zip(duty) {
        assert!((signed(*pos, 16) + 2 * signed(*duty, 12)).abs() <= 1, "{pos} {duty}");
    }
    assert!(signed(pos[EDGES - 2], 16) > 1000, "0.3 rad are 1229 steps of 2^-12");
    assert_eq!(shown(&path, &["--set", "dut.engine=ghdl"], names), found, "GHDL");
    let whole = scene(&dir, ("composite.vhd", COMPOSITE), "", &ports.replace("\"enc.a\"", "enc"));
    let output = run(&["run", &whole]);
    let told = "dut.ports.enc: port `enc` is connected by its words: enc.a (in, 1 bit), enc.b (in, 1 bit)";
    assert_refused(&output, 4, &["composite.toml:", told]);
}

#[test]
fn unpacked_arrays_of_systemverilog_are_connected_by_element() {
    let dir = scratch("unpacked_ports");
    let source = "module unpacked(input logic clk, rst, input logic signed [7:0] g [2:4], input logic a,
      output logic [9:0] sum, output logic [7:0] last [0:1], output logic pwm);
      assign sum = 10'(g[2]) + 10'(g[3]); assign last[0] = g[4]; assign last[1] = 8'd9; assign pwm = a; endmodule\n";
    let ports = "\"g[2]\" = 5\n\"g[3]\" = 6\n\"g[4]\" = 7\na = \"encoder.a\"\npwm = \"bridge.pwm\"\n";
    let path = scene(&dir, ("unpacked.sv", source), "", ports);
    let value = json(&run(&["run", &path, "--json"]));
    let range = |name: &str| {
        let signal = value["signals"].as_array().expect("signals").iter().find(|signal| signal["name"] == name);
        let signal = signal.unwrap_or_else(|| panic!("no {name} in {}", value["signals"]));
        [&signal["min"], &signal["max"]].map(|end| end.as_f64().expect("a number"))
    };
    assert_eq!([range("sum"), range("last[0]"), range("last[1]")], [[11.0; 2], [7.0; 2], [9.0; 2]]);
    let whole = scene(&dir, ("unpacked.sv", source), "", &ports.replace("\"g[2]\"", "g"));
    let told = "dut.ports.g: port `g` is connected by its words: g[2] (in, 8 bits), g[3] (in, 8 bits)";
    assert_refused(&run(&["run", &whole]), 4, &["unpacked.toml:", told]);
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn parts_of_packed_types_of_systemverilog_are_connected_by_their_names() {
    let dir = scratch("packed_ports");
    // Each output is a part of an input as SystemVerilog reads it.
    let source = "`timescale 1ns/1ps
      package p; typedef enum logic [1:0] { idle, run = 2, stop } mode_t;
      typedef struct packed { logic a; logic [2:0] n; logic [1:0][3:0] q; } enc_t;
      typedef union packed { logic [7:0] w; struct packed { logic [3:0] h, l; } f; } both_t;
      typedef struct packed { logic pwm; logic [1:0] dir; } legs_t; endpackage
      module packed_parts import p::*; #(parameter W = 8, parameter mode_t K = idle) (
      input logic clk, rst, input enc_t enc,
      input logic [1:0][W-1:0] m, input logic [0:7] asc, input logic [8:1] off, input enc_t [2:1] es, input both_t u,
      input logic x, output logic ea, output logic [2:0] en, output logic [3:0] eq1, eq0, output logic [7:0] m1, m0,
      output logic a0, output logic [6:0] a1, o8, output logic o1, output logic [11:0] e2, e1, output logic [7:0] uw,
      output legs_t legs, output logic [1:0] k, output logic [15:0] ns, output logic asked);
      logic [63:0] last; always @(posedge clk) begin last <= $time; ns <= rst ? 1000 : 16'($time - last); end
      initial asked = $test$plusargs(\"what\"); assign k = K;
      assign ea = enc.a; assign en = enc.n; assign eq1 = enc.q[1]; assign eq0 = enc.q[0];
      assign m1 = m[1]; assign m0 = m[0]; assign a0 = asc[0]; assign a1 = asc[1:7]; assign o8 = off[8:2];
      assign o1 = off[1]; assign e2 = es[2]; assign e1 = es[1]; assign uw = u.w;
      assign legs.pwm = x; assign legs.dir = 2'b10; endmodule\n";
    let es = |index: u32, words: [u32; 4]| {
        let parts = ["a", "n", "q[1]", "q[0]"].into_iter().zip(words);
        parts.map(|(part, word)| format!("\"es[{index}].{part}\" = {word}\n")).collect::<String>()
    };
    let ports = "\"enc.a\" = 1\n\"enc.n\" = 5\n\"enc.q[1]\" = 9\n\"enc.q[0][3]\" = 0\n\"enc.q[0][2:0]\" = 3\n\
                 \"m[1]\" = 170\n\"m[0][7:4]\" = 12\n\"m[0][3:0]\" = 5\n\"asc[0]\" = 1\n\"asc[1:7]\" = 77\n\
                 \"off[8:2]\" = 33\n\"off[1]\" = 1\n\"u.f.h\" = 6\n\"u.f.l\" = 11\nx = \"encoder.a\"\n\
                 \"legs.pwm\" = \"bridge.pwm\"\n\"legs.dir[1]\" = \"bridge.direction\"\n"
        .to_string()
        + &es(2, [0, 6, 2, 13])
        + &es(1, [1, 3, 4, 7]);
    let path = scene(&dir, ("packed_parts.sv", source), "parameters = { K = 2 }", &ports);
    let value = json(&run(&["run", &path, "--json"]));
    let word = |name: &str| {
        let signal = value["signals"].as_array().expect("signals").iter().find(|signal| signal["name"] == name);
        let signal = signal.unwrap_or_else(|| panic!("no {name} in {}", value["signals"]));
        let [min, max] = ["min", "max"].map(|end| signal[end].as_f64().expect("a number"));
        assert!((min - max).abs() < 0.5, "{name} changes");
        max
    };
    let names = ["ea", "en", "eq1", "eq0", "m1", "m0", "a0", "a1", "o8", "o1", "e2", "e1", "uw"];
    let read = [1.0, 5.0, 9.0, 3.0, 170.0, 197.0, 1.0, 77.0, 33.0, 1.0, 1581.0, 2887.0, 107.0];
    assert_eq!(names.map(word), read);
    // The second value of an enumeration, a period of 1 MHz, and no argument.
    assert_eq!(["k", "ns", "asked"].map(word), [2.0, 1000.0, 0.0]);
    let shown = String::from_utf8(run(&["run", &path]).stdout).expect("text");
    assert!(shown.contains("[0] 1, [1:7] 77") && shown.contains(".dir[1] bridge.direction"), "{shown}");
    let named = scene(&dir, ("packed_parts.sv", source), "parameters = { K = \"run\" }", &ports);
    let told = "dut.parameters.K: its type is an enumeration; write the number of the value";
    assert_refused(&run(&["run", &named]), 4, &["packed_parts.toml:", told]);
    for (key, reason) in [
        ("m[2]", "m (in, 16 bits) has no such bits; it is [1:0][7:0]"),
        ("asc[8]", "has no such bits; it is [0:7]"),
        ("enc.b", "has no such bits; it is {a[0:0],n[2:0],q[1:0][3:0]}"),
    ] {
        let wrong = scene(&dir, ("packed_parts.sv", source), "", &format!("\"{key}\" = 1\n{ports}"));
        assert_refused(&run(&["run", &wrong]), 4, &["packed_parts.toml:", &format!("dut.ports.{key}: "), reason]);
    }
}

#[test]
fn ports_that_no_word_is_are_refused_with_their_type() {
    let dir = scratch("refused_ports");
    let vhdl = |kind: &str| {
        format!(
            "library ieee; use ieee.std_logic_1164.all;
            package kinds is type pointers is array (0 to 1, 0 to 1) of bit; end package;
            library ieee; use ieee.std_logic_1164.all; use work.kinds.all;
            entity kind is port (clk, rst, a : in std_logic; x : {kind}); end entity;
            architecture rtl of kind is begin end architecture;"
        )
    };
    let verilog = |kind: &str| format!("module kind(input clk, rst, a, {kind}); endmodule\n");
    for (file, source, told) in [
        ("kind.vhd", vhdl("inout std_logic"), "port `x` is inout std_logic; hpu takes in and out"),
        ("kind.vhd", vhdl("in pointers"), "port `x` is of the type pointers; hpu takes bits"),
        ("kind.vhd", vhdl("in real"), "port `x` is of the type real; hpu takes bits"),
        (
            "kind.vhd",
            vhdl("in std_logic_vector"),
            "port `x` is of the type std_logic_vector, without a range: an entity",
        ),
        (
            "kind.vhd",
            vhdl("in bit_vector(-1 downto 0)"),
            "port `x` is of the type bit_vector(-1 downto 0), which has no",
        ),
        ("kind.vhd", vhdl("in time"), "port `x` is of the type time; hpu takes bits"),
        ("kind.sv", verilog("inout x"), "port `x` is inout; hpu takes in and out"),
        ("kind.sv", verilog("input real x"), "port `x` is real; hpu takes in and out"),
        ("kind.sv", verilog("input logic x [0:1][0:1]"), "port `x` is an array of arrays"),
    ] {
        let path = scene(&dir, (file, &source), "", "a = \"encoder.a\"\nx = \"encoder.b\"\n");
        assert_refused(&run(&["run", &path]), 4, &["kind.toml:", &format!("dut.ports.x: {told}")]);
    }
}

#[test]
fn bits_of_vectors_of_vhdl_are_connected_by_the_indices_of_the_design() {
    let dir = scratch("vhdl_indices");
    // Each output is a part of an input as VHDL reads it.
    let source = "library ieee; use ieee.std_logic_1164.all;
package marks is subtype nibble is bit_vector(8 downto 5);
  type pair is record v : std_logic_vector(4 to 7); end record; end package;
library ieee; use ieee.std_logic_1164.all; use work.marks.all;
entity indices is
  generic (FIRST : natural := 3);
  port (clk, rst : in std_logic; up : in std_logic_vector(0 to 7); off : in std_logic_vector(FIRST+3 downto FIRST);
    n : in nibble; p : in pair; plain : in std_logic_vector(3 downto 0); u0, o3 : out std_logic; n8 : out bit;
    u17 : out std_logic_vector(1 to 7); p46 : out std_logic_vector(4 to 6); word : out std_logic_vector(3 downto 0);
    legs : out std_logic_vector(1 to 2);
    en : in std_logic := '1'; given : in std_logic_vector(3 downto 0) := x\"A\"; all_set : in nibble := (others => '1');
    known : out std_logic_vector(5 downto 0));
end entity;
architecture rtl of indices is begin
  u0 <= up(0); u17 <= up(1 to 7); o3 <= off(FIRST); n8 <= n(8); p46 <= p.v(4 to 6); word <= plain;
  legs <= up(0) & '1'; known <= en & given & to_stdulogic(all_set(8));
end architecture;
";
    let ports = "\"up(0)\" = \"encoder.a\"\n\"up(1 to 7)\" = 77\n\"off(3)\" = 1\n\"off(6 downto 4)\" = 2\n\
                 \"n(8)\" = 1\n\"n(7 downto 5)\" = 2\n\"p.v(4 to 6)\" = 6\n\"p.v(7)\" = 0\n\"plain(3)\" = 1\n\
                 \"plain(2 downto 0)\" = 2\n\"legs(1)\" = \"bridge.pwm\"\n\"legs(2)\" = \"bridge.direction\"\n";
    // The ending is that of another system; inputs that have a default are left open.
    let path = scene(&dir, ("indices.VHD", source), "generics = { FIRST = 3 }", ports);
    let names = ["u0", "legs", "o3", "n8", "u17", "p46", "word", "off", "plain", "known"];
    let found = shown(&path, &[], names);
    let [u0, legs, still @ ..] = &found;
    assert!(u0.contains(&1) && u0.contains(&0), "the encoder has not moved");
    assert!(u0.iter().zip(legs).all(|(u0, legs)| *legs == 2 * u0 + 1));
    for ((name, words), expected) in names[2..].iter().zip(still).zip([1, 1, 77, 6, 10, 5, 10, 0b11_0101]) {
        assert!(words.iter().all(|word| *word == expected), "{name}: {words:?}");
    }
    assert_eq!(shown(&path, &["--set", "dut.engine=ghdl"], names), found, "GHDL");
    let wrong = scene(&dir, ("indices.VHD", source), "", &ports.replace("p.v(7)", "p.v(0)"));
    let told = "dut.ports.p.v(0): p.v (in, 4 bits) has no such bits; it is [4:7]";
    assert_refused(&run(&["run", &wrong]), 4, &["indices.toml:", told]);
}

#[test]
fn bits_of_vectors_are_connected_by_names_of_the_scene() {
    let dir = scratch("bundles");
    let source = "module bundles(input clk, rst, ena, input [7:0] ui_in, output [7:0] uo_out);
      reg [7:0] n; always @(posedge clk) if (rst) n <= 0; else n <= n + 1;
      assign uo_out = {n[3:0], ena, ui_in[7], n[7], ui_in[0] & ~ui_in[1]}; endmodule\n";
    let pins = "pins = { a = 'ui_in[0]', b = 'ui_in[1]', mode = 'ui_in[7:2]', pwm = 'uo_out[1]', way = 'uo_out[2]' }";
    let ports = "mode = 33\nway = 'bridge.direction'\nena = 1\n";
    let path = scene(&dir, ("bundles.v", source), pins, ports);
    let [given, told] = shown(&path, &[], ["ui_in", "uo_out"]);
    for ((given, told), edge) in given.iter().zip(&told).zip(1..) {
        assert_eq!(given >> 2, 33, "the mode");
        assert_eq!(told & 1, given & 1 & !(given >> 1), "of the lines");
        assert_eq!(told >> 1, (edge & 15) << 3 | 4 | 2 | (edge >> 7 & 1), "after edge {edge}");
    }
    for bit in [1, 2] {
        assert!(given.iter().any(|word| word & bit == 0) && given.iter().any(|word| word & bit != 0));
    }
    let value = json(&run(&["run", &path, "--json"]));
    let connections = value["dut"].to_string();
    assert!(connections.contains("[2] bridge.direction, [1] bridge.pwm"), "{connections}");
    for (wrong, told) in [
        (pins.replace("way", "stray"), "dut.pins.stray: connect `stray` in [dut.ports], or call it as its line: a, b"),
        (pins.replace("uo_out[2]", "uo_out[8]"), "dut.ports.way: uo_out (out, 8 bits) has no such bits"),
        (pins.replace("uo_out[1]", "uo[1]"), "dut.pins.pwm: `bundles` has no port `uo`"),
        (pins.replace("uo_out[1]", "uo-out[1]"), "dut.pins.pwm: `uo-out[1]` is no name of a port"),
    ] {
        let path = scene(&dir, ("bundles.v", source), &wrong, ports);
        assert_refused(&run(&["run", &path]), 4, &["bundles.toml:", told]);
    }
}
