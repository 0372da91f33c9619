//! What is inside a design of the user's own: the types of its signals, their ranges, and waveforms of some of them.
//!
//! Each signal is a counter, so its word after an edge is known in closed form.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use crate::common::{assert_refused, code, hpu, json as parsed, run, scratch, stderr, stdout, text};
use crate::dut::words;

/// Two modules with a signal of one name, signed in the first and unsigned in the second; and an encoder's line after
/// one to four registers.
const VERILOG: &str = "module fall (input clk, input rst, output reg signed [15:0] vel);
  typedef enum logic [1:0] {IDLE, RUN, STOP} state_t;
  reg signed [15:0] vel_r;
  state_t state;
  always @(posedge clk)
    if (rst) begin vel_r <= 0; vel <= 0; state <= IDLE; end
    else begin vel_r <= vel_r - 16'sd3; vel <= vel_r; state <= RUN; end
endmodule
module rise (input clk, input rst, output [9:0] low);
  reg [15:0] vel_r;
  reg [9:0] count;
  always @(posedge clk) if (rst) begin vel_r <= 0; count <= 0; end
    else begin vel_r <= vel_r + 16'd1; count <= count + 10'd1; end
  assign low = count;
endmodule
module late (input clk, input a, output last);
  reg [3:0] r;
  wire third = r[2];
  wire fourth = r[3];
  always @(posedge clk) r <= {r[2:0], a};
  assign last = fourth;
endmodule
module inner (input clk, input rst, input a, output signed [15:0] vel, output [9:0] low, output last,
              output [1:0] lanes);
  fall u_vel (.clk(clk), .rst(rst), .vel(vel));
  rise u_rise (.clk(clk), .rst(rst), .low(low));
  late u_late (.clk(clk), .a(a), .last(last));
  genvar i;
  generate
    for (i = 0; i < 2; i = i + 1) begin : lane
      reg signed [4:0] acc;
      always @(posedge clk) acc <= rst ? 5'sd0 : acc - 5'sd1;
      assign lanes[i] = acc[i];
    end
  endgenerate
endmodule
";

/// The same falling word in VHDL, beside a rising one, a number with a range, and bits.
const VHDL: &str = "library ieee; use ieee.std_logic_1164.all; use ieee.numeric_std.all;
entity fall is port (clk, rst : in std_logic; vel : out signed(15 downto 0); bits : out std_logic_vector(7 downto 0));
end;
architecture rtl of fall is
  subtype speed is signed(15 downto 0);
  signal vel_r : speed := (others => '0');
  signal up : unsigned(9 downto 0) := (others => '0');
  signal n : integer range -5 to 100 := 0;
  signal plain : std_logic_vector(7 downto 0) := (others => '0');
begin
  vel <= vel_r;
  bits <= plain xor std_logic_vector(to_signed(n, 8)) xor std_logic_vector(up(7 downto 0));
  process (clk) begin
    if rising_edge(clk) then
      if rst = '1' then
        vel_r <= (others => '0'); up <= (others => '0'); n <= 0; plain <= (others => '0');
      else
        vel_r <= vel_r - 3; up <= up + 1; plain <= not plain;
        if n > -5 then n <= n - 1; end if;
      end if;
    end if;
  end process;
end;
library ieee; use ieee.std_logic_1164.all; use ieee.numeric_std.all;
entity inner is port (clk, rst, a : in std_logic; vel : out signed(15 downto 0);
  bits : out std_logic_vector(7 downto 0)); end;
architecture rtl of inner is begin
  u_vel : entity work.fall port map (clk, rst, vel, bits);
end;
";

/// Writes a scene of 1 ms at 1 MHz with a design that drives nothing, and lines of its own at the end.
fn scene(dir: &Path, design: &str, more: &str) -> PathBuf {
    // By Verilator: a netlist leaves out what reaches no output.
    let (file, code, engine) =
        if design == "vhdl" { ("inner.vhd", VHDL, "auto") } else { ("inner.sv", VERILOG, "verilator") };
    fs::write(dir.join(file), code).expect("a design");
    let toml = format!(
        "about = 'Counters.'\ndevice = {{ kind = 'motor', motor = 'vasudevan_2007', wheel_ratio = 7 }}\n\
         clock = {{ frequency = '1 MHz' }}\nrun = {{ duration = '1 ms' }}\nhand = {{ kind = 'none' }}\n\
         [dut]\nfiles = ['{file}']\ntop = 'inner'\nclock = 'clk'\nengine = '{engine}'\nreset = {{ port = 'rst' }}\n\
         [dut.ports]\na = 'encoder.a'\n{more}\n"
    );
    let path = dir.join(format!("{design}.toml"));
    fs::write(&path, toml).expect("a scene");
    path
}

/// Returns the row of a signal on the page of widths.
fn row<'v>(page: &'v Value, name: &str) -> &'v Value {
    let rows = page["signals"].as_array().expect("signals");
    rows.iter().find(|row| row["name"] == name).unwrap_or_else(|| panic!("no {name}: {page:#}"))
}

#[test]
fn widths_of_a_design_are_those_of_its_counters() {
    let dir = scratch("inside_widths");
    let output = run(&["widths", text(&scene(&dir, "verilog", "")), "--json"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let page = parsed(&output);
    // 1000 edges: -3 a clock needs 13 bits of 16, 10 bits are all that 1000 needs.
    for (name, format, words, idle, wraps) in [
        ("u_vel.vel_r", [1, 15, 0], [-3000, 0], 3, 0),
        ("vel", [1, 15, 0], [-2997, 0], 3, 0),
        ("u_rise.vel_r", [0, 16, 0], [0, 1000], 6, 0),
        // Nine bits hold up to 511.
        ("u_rise.count", [0, 10, 0], [0, 1000], 0, 1000 - 511),
        ("u_vel.state", [0, 2, 0], [0, 1], 1, 0),
        // Four bits hold down to -8, of which a turn of 32 clocks has 16 more words; 31 turns and 8 clocks.
        ("lane[0].acc", [1, 4, 0], [-16, 15], 0, 31 * 16),
    ] {
        let row = row(&page, name);
        assert_eq!(row["format"], json!(format), "{name}");
        assert_eq!((&row["words"], &row["idle_bits"]), (&json!(words), &json!(idle)), "{name}");
        assert_eq!(row["one_bit_less_edges"], json!(wraps), "{name}");
    }
    let first = row(&page, "u_rise.count")["one_bit_less_first_s"].as_f64().expect("a time");
    assert!((first - 512e-6).abs() < 1e-12, "{first}");
    assert_eq!(row(&page, "u_vel.vel_r")["inside"], true);
    assert_eq!(row(&page, "vel")["inside"], false);
    let refused = run(&["widths", text(&dir.join("verilog.toml")), "--no-trials"]);
    assert_refused(&refused, 2, &["--no-trials", "of one run"]);
}

#[test]
fn formats_that_nobody_can_know_stand_in_the_scene() {
    let dir = scratch("inside_formats");
    let with = |formats: &str| scene(&dir, "verilog", &format!("[dut.formats]\n{formats}"));
    let path = with("'u_vel.vel_r' = 's7.8'\n'low' = 'UQ2.8'\n'lane[1].acc' = '(0,3,2)'");
    let page = parsed(&run(&["widths", text(&path), "--json"]));
    let measured = |name: &str| row(&page, name)["measured"].clone();
    assert_eq!(measured("u_vel.vel_r"), json!([-3000.0 / 256.0, 0.0]));
    assert_eq!(measured("low"), json!([0.0, 1000.0 / 256.0]));
    assert_eq!(measured("lane[1].acc"), json!([0.0, 31.0 / 4.0]));
    // Wrong ones are told at their line, also in a run that shows nothing of the inside.
    for (formats, said) in [
        ("'u_rise.coun' = 'u2.8'", &["verilog.toml:15:", "dut.formats.u_rise.coun", "did you mean u_rise.count"][..]),
        ("'u_vel.vel_r' = 's7.7'", &["verilog.toml:15:", "16 bit(s)", "(1,7,7) has 15"]),
        ("low = 10", &["verilog.toml:15:", "write a format"]),
        ("low = 'seven'", &["verilog.toml:15:", "`seven` is not a format"]),
    ] {
        assert_refused(&run(&["run", text(&with(formats))]), 4, said);
    }
}

#[test]
fn both_ways_of_vhdl_keep_the_types_of_its_signals() {
    let dir = scratch("inside_vhdl");
    let path = scene(&dir, "vhdl", "");
    for engine in ["verilator", "ghdl"] {
        let set = format!("dut.engine={engine}");
        let output = run(&["widths", text(&path), "--json", "--set", &set]);
        assert_eq!(code(&output), 0, "{}", stderr(&output));
        let page = parsed(&output);
        for (name, format, words) in [
            ("vel", [1, 15, 0], [-3000, 0]),
            ("u_vel.vel_r", [1, 15, 0], [-3000, 0]),
            ("u_vel.up", [0, 10, 0], [0, 1000]),
            // From -5 to 100.
            ("u_vel.n", [1, 7, 0], [-5, 0]),
            ("u_vel.plain", [0, 8, 0], [0, 255]),
        ] {
            let row = row(&page, name);
            assert_eq!((&row["format"], &row["words"]), (&json!(format), &json!(words)), "{engine}: {name}");
        }
    }
    // Words that are numbers are curves in GTKWave (flags 0x88420 and 0x88024), bits are hexadecimal (0x22).
    let out = dir.join("out");
    let output = run(&["run", text(&path), "--no-plot", "-o", text(&out)]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let save = fs::read_to_string(out.join("wave.fst.gtkw")).expect("a save file");
    for trace in [
        "-Ports\n",
        "-u_vel\n",
        "@88420\ninner.u_vel.vel_r[15:0]\n",
        "@88024\ninner.u_vel.up[9:0]\n",
        "@22\ninner.u_vel.plain[7:0]\n",
    ] {
        assert!(save.contains(trace), "{trace}: {save}");
    }
}

#[test]
fn a_waveform_shows_the_nets_and_the_time_that_are_chosen() {
    let dir = scratch("inside_waves");
    let path = scene(&dir, "verilog", "");
    let shown = |name: &str, options: &[&str]| {
        let out = dir.join(name);
        let scene = ["run", text(&path), "--vcd", "--no-plot", "-o", text(&out)];
        let output = run(&[&scene, options].concat());
        assert_eq!(code(&output), 0, "{}", stderr(&output));
        let mut all = words(&out.join("wave.vcd"));
        all.retain(|name, _| name.starts_with("inner.") && name != "inner.rst" && !name.ends_with(".rst"));
        all
    };
    let all = shown("part", &["--wave", "u_vel/*_r", "u_rise/count", "--from", "100us", "--to", "200us"]);
    assert_eq!(all.keys().collect::<Vec<_>>(), ["inner.u_rise.count", "inner.u_vel.vel_r"]);
    let count = &all["inner.u_rise.count"];
    // A time of 1 us is 1000 ns or 1000000 ps, whatever the unit of the file.
    let unit = count[1].0 - count[0].0;
    let expected: Vec<_> = (100..=200).map(|edge| (unit * edge, format!("{edge:b}"))).collect();
    assert_eq!(*count, expected);
    let falls = &all["inner.u_vel.vel_r"];
    let expected: Vec<_> =
        (100..=200).map(|edge| (unit * edge, format!("{:b}", (-3 * edge as i16).cast_unsigned()))).collect();
    assert_eq!(*falls, expected);
    let ports = shown("ports", &["--wave", "ports"]);
    let names: Vec<_> = ports.keys().map(|name| name.trim_start_matches("inner.")).collect();
    assert_eq!(names, ["a", "lanes", "last", "low", "vel", "wall_contact"]);
    let near = shown("near", &["--wave", "u_vel", "--depth", "1"]);
    assert!(near.keys().all(|name| name.starts_with("inner.u_vel.")), "{:?}", near.keys());
    let refused = |options: &[&str], said: &[&str]| {
        let out = dir.join("refused");
        let output = run(&[&["run", text(&path), "-o", text(&out)], options].concat());
        assert_refused(&output, 2, said);
    };
    refused(&["--wave", "u_val/vel_r"], &["--wave u_val/vel_r", "did you mean u_vel.vel_r"]);
    refused(&["--wave", "nothing/*"], &["it has the instances", "u_rise"]);
    refused(&["--from", "2ms"], &["--from 2 ms", "the run ends at 1 ms"]);
    refused(&["--from", "200us", "--to", "100us"], &["--to is not after --from"]);
    assert_refused(&run(&["run", text(&path), "--wave", "ports"]), 2, &["--out"]);
}

#[test]
fn a_signal_inside_is_compared_and_an_offset_in_time_is_told_as_one() {
    let dir = scratch("inside_compared");
    let path = scene(&dir, "verilog", "");
    let toml = fs::read_to_string(&path).expect("the scene");
    // The hand turns the shaft as in the shipped scene, whatever drives it.
    let toml = toml
        .replace("'1 MHz'", "'50 MHz'")
        .replace("{ kind = 'none' }", "{ kind = 'prescribed', path = [['0 s', 1.4], ['500 ms', 1.9], ['1 s', 1.4]] }");
    fs::write(&path, toml.replace("'1 ms'", "'6 ms'")).expect("a scene");
    let compared = |pair: &str, more: &[&str]| {
        let scene = ["run", text(&path), "--json", "--beside", "prescribed-sweep", "--compare", pair];
        let output = hpu().args(scene).args(more).output().expect("starts");
        let told = parsed(&output);
        (code(&output), told["compared"].clone())
    };
    // The first register shows after an edge what stood before it, as the pin itself is shown there.
    for (pair, latency, offset) in [
        ("u_late.third=a_pin", "0", json!(2)),
        ("u_late.fourth=a_pin", "0", json!(3)),
        ("u_late.fourth=a_pin", "1", json!(2)),
        ("last=a_pin", "4", json!(-1)),
    ] {
        let (exit, found) = compared(pair, &["--latency", latency]);
        assert_eq!((exit, &found["offset_edges"]), (1, &offset), "{pair} {latency}: {found}");
        assert!(found["mismatches"].as_u64().is_some_and(|count| count > 0), "{found}");
    }
    for (pair, latency) in [("u_late.third=a_pin", "2"), ("u_late.fourth=a_pin", "3"), ("a=a_pin", "0")] {
        let (exit, found) = compared(pair, &["--latency", latency]);
        assert_eq!((exit, &found["mismatches"]), (0, &json!(0)), "{pair} {latency}: {found}");
    }
    let scene = ["run", text(&path), "--beside", "prescribed-sweep", "--compare", "u_late.fourth=a_pin"];
    let said = stdout(&run(&scene));
    assert!(said.contains("equal when shifted by 3 edges: --latency 3"), "{said}");
    let wrong = ["run", text(&path), "--beside", "prescribed-sweep", "--compare", "u_late.fouth=a_pin"];
    assert_refused(&run(&wrong), 2, &["no port `u_late.fouth`", "did you mean u_late.fourth"]);
}
