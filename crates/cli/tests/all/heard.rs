//! What designs say: assertions that fail, `$error`, `$fatal`, `$finish` and messages, by each simulator. The expected
//! edges follow from a counter: clock edge k after the reset samples k - 1.

use std::fs;
use std::path::Path;

use serde_json::{Value, json as value};

use crate::common::{code, json, run, scratch, stderr, stdout, text};

/// A counter whose assertions fail: that on line 7 from the 201st edge on, that on line 11 at the 51st, and `$fatal` at
/// the 241st. No Verilator reads the one on line 12.
const VERILOG: &str = "module heard(input logic clk, rst, enc_a, enc_b, output logic pwm, dir);
  logic [7:0] n;
  always_ff @(posedge clk)
    if (rst) n <= '0;
    else begin
      n <= n + 8'd1;
      assert (n < 8'd200) else $error(\"n is %0d\", n);
      if (n == 8'd10) begin $warning(\"ten\"); $display(\"n: %0d\", n); end
      if (n == 8'd240) $fatal(1, \"over\");
    end
  late: assert property (@(posedge clk) disable iff (rst) n != 8'd50) else $error(\"fifty\");
  beyond: assert property (@(posedge clk) enc_a |-> ##1 enc_b);
  assign pwm = n[7];
  assign dir = enc_a ^ enc_b;
endmodule
";

/// The same counter in VHDL.
const VHDL: &str = "library ieee; use ieee.std_logic_1164.all; use ieee.numeric_std.all;
entity heard is port (clk, rst, enc_a, enc_b : in std_logic; pwm, dir : out std_logic); end;
architecture a of heard is
  signal n : unsigned(7 downto 0) := (others => '0');
begin
  process (clk) begin
    if rising_edge(clk) then
      if rst = '1' then n <= (others => '0');
      else
        n <= n + 1;
        assert n < 200 report \"n is \"\"large\"\"\" & \"!\" severity error;
        if n = 50 then report \"fifty\" severity error; end if;
        assert n /= 10 report \"ten\" severity warning;
        assert n /= 240 report \"over\" severity failure;
      end if;
    end if;
  end process;
  pwm <= n(7);
  dir <= enc_a xor enc_b;
end;
";

/// A counter that ends the simulation at the 100th edge.
const FINISH: &str = "module heard(input clk, rst, enc_a, enc_b, output pwm, dir);
  reg [7:0] n;
  always @(posedge clk) if (rst) n <= 0; else begin n <= n + 1; if (n == 99) $finish; end
  assign pwm = enc_a;
  assign dir = enc_b;
endmodule
";

/// Writes a scene of 1 ms at 1 MHz around a design.
fn scene(dir: &Path, file: &str, design: &str) -> String {
    fs::write(dir.join(file), design).expect("a design");
    let path = dir.join(format!("{file}.toml"));
    let toml = format!(
        "about = \"heard\"\n[device]\nkind = \"motor\"\nmotor = \"vasudevan_2007\"\n[clock]\nfrequency = \"1 MHz\"\n\
         [dut]\nfiles = [\"{file}\"]\ntop = \"heard\"\nclock = \"clk\"\nreset = {{ port = \"rst\" }}\n[dut.ports]\n\
         enc_a = \"encoder.a\"\nenc_b = \"encoder.b\"\npwm = \"bridge.pwm\"\ndir = \"bridge.direction\"\n[wall]\n\
         position = \"1 rad\"\n[hand]\nkind = \"prescribed\"\npath = [[0, 0], [0.001, 0.1]]\n[run]\nduration = \"1 \
         ms\"\n"
    );
    fs::write(&path, toml).expect("a scene");
    text(&path).to_string()
}

/// Returns edge, line, severity, text and times of each failed assertion, by their lines.
fn failed(run: &Value) -> Vec<Value> {
    let first = run["assertions"]["first"].as_array().expect("a list");
    let told = |one: &Value| value!([one["line"], one["edge"], one["severity"], one["text"], one["times"]]);
    let mut all: Vec<_> = first.iter().map(told).collect();
    all.sort_by_key(|one| one[0].as_u64());
    all
}

#[test]
fn assertions_of_verilog_end_the_run_with_1_and_are_told_with_time_and_place() {
    let dir = scratch("heard_verilog");
    let (path, out) = (scene(&dir, "heard.sv", VERILOG), dir.join("out"));
    let ran = run(&["run", &path, "--no-plot", "-o", text(&out)]);
    let said = stdout(&ran);
    assert_eq!(code(&ran), 1, "{said}{}", stderr(&ran));
    for line in [
        "FAILED, 41 times, first at 201 us: n is 200 (heard.sv:7, severity error)",
        "FAILED at 51 us: fifty (heard.sv:11, severity error)",
        "by the design itself at 241 us: $fatal, heard.sv:9",
        "assertions are not checked: heard.sv:12: ",
        "not judged: the design ended the run after 241 us of 1 ms",
    ] {
        assert!(said.contains(line), "`{line}` is not in:\n{said}");
    }
    let summary: Value =
        serde_json::from_str(&fs::read_to_string(out.join("summary.json")).expect("a summary")).expect("JSON");
    let expected = [
        value!([7, 201, "error", "n is 200", 41]),
        value!([9, 241, "failure", "over", 1]),
        value!([11, 51, "error", "fifty", 1]),
    ];
    assert_eq!(failed(&summary), expected);
    assert_eq!(summary["edges"], 241);
    assert_eq!(summary["outcome"], Value::Null);
    let messages = fs::read_to_string(out.join("messages.txt")).expect("messages");
    assert!(messages.contains("   0.000011000  warning: heard.sv:8: ten\n   0.000011000  n: 10\n"), "{messages}");
    let save = fs::read_to_string(out.join("wave.fst.gtkw")).expect("a save file");
    assert!(save.contains("assertion failed: fifty") && save.contains("assertion failed: n is 200"), "{save}");
    // A study has no result of such a run.
    let map = run(&["map", &path, "--x", "run.duration=0.9..1 ms:2", "--y", "wall.position=1..1.1 rad:2"]);
    let why = "failed     4 times: an assertion of the design failed at clock edge 51 (5.1e-5 s): heard.sv:11: fifty";
    assert!(stdout(&map).contains(why), "{}", stdout(&map));
}

#[test]
fn assertions_of_vhdl_are_heard_alike_by_verilator_and_by_ghdl() {
    let dir = scratch("heard_vhdl");
    let path = scene(&dir, "heard.vhd", VHDL);
    for (engine, name) in [("ghdl", "GHDL"), ("verilator", "Verilator")] {
        let ran = run(&["run", &path, "--json", "--set", &format!("dut.engine={engine}")]);
        assert_eq!(code(&ran), 1, "{engine}: {}", stderr(&ran));
        let told: Value = serde_json::from_str(&stdout(&ran)).expect("JSON");
        let expected = [
            value!([11, 201, "error", "n is \"large\"!", 41]),
            value!([12, 51, "error", "fifty", 1]),
            value!([14, 241, "failure", "over", 1]),
        ];
        assert_eq!(failed(&told), expected, "{engine}");
        assert_eq!(told["ended_by_design"]["by"], "severity failure", "{engine}");
        assert_eq!(told["edges"], 241, "{engine}");
        assert!(told["dut"]["engine"].as_str().expect("a text").starts_with(name), "{engine}");
    }
}

#[test]
fn finish_ends_the_run_and_is_no_error() {
    let dir = scratch("heard_finish");
    let path = scene(&dir, "finish.v", FINISH);
    let told = json(&run(&["run", &path, "--json"]));
    let ended = value!({ "edge": 100, "at_s": 1e-4, "by": "$finish", "file": "finish.v", "line": 3 });
    assert_eq!(told["ended_by_design"], ended);
    assert_eq!(
        (&told["edges"], &told["outcome"], &told["assertions"]["failed"]),
        (&value!(100), &Value::Null, &value!(0))
    );
    // Its outcome is not known, so an expected one is not met.
    assert_eq!(code(&run(&["run", &path, "--set", "expect.outcome=settled"])), 1);
}
