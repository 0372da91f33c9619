//! Designs as they are found: legacy Verilog with delays and files beside it, VHDL with names that Verilog keeps for
//! itself, and VHDL with delays. Icarus Verilog and GHDL say by runs of their own what is right.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::Command;

use crate::common::{assert_refused, code, json, run, scratch, stderr, text};
use crate::dut::{told, words};

/// Clock edges of a run.
const EDGES: usize = 300;

/// Writes a scene, at 1 MHz, with these files and connections beside `a` and `b`.
fn scene(dir: &Path, files: &str, top: &str, ports: &str, more: &str) -> String {
    let path = dir.join(format!("{top}.toml"));
    let toml = format!(
        "about = \"found\"\n[device]\nkind = \"motor\"\nmotor = \"vasudevan_2007\"\n[clock]\nfrequency = \"1 MHz\"\n\
         [dut]\nfiles = [{files}]\ntop = \"{top}\"\nclock = \"clk\"\nreset = {{ port = \"rst\" }}\n{more}\n\
         [dut.ports]\n{ports}\n[hand]\nkind = \"prescribed\"\npath = [[0, 0], [0.0001, 0.3]]\n\
         [run]\nduration = \"{EDGES} us\"\n"
    );
    fs::write(&path, toml).expect("a scene");
    text(&path).to_string()
}

/// Runs a scene. Returns stderr, and the bits of a port after each clock edge from the first one on.
fn shown(dir: &Path, scene: &str, ports: &[&str]) -> (String, Vec<Vec<u64>>) {
    let out = dir.join("out");
    let output = run(&["run", scene, "--vcd", "--no-plot", "-o", text(&out)]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let words = words(&out.join("wave.vcd"));
    let of = |port: &&str| {
        let changes = words.iter().find(|(name, _)| name.ends_with(&format!(".{port}"))).expect("a port").1;
        // The waveform has ten units of time in a clock cycle.
        let at = |edge: usize| changes.iter().rev().find(|(time, _)| *time <= 10 * edge as u64);
        (1..EDGES)
            .map(|edge| u64::from_str_radix(&format!("0{}", at(edge).expect("a word").1), 2).expect("bits"))
            .collect()
    };
    (stderr(&output), ports.iter().map(of).collect())
}

/// Returns what Icarus Verilog shows of the port `out` after each edge, for these bits at `a` and `b`.
fn by_icarus(dir: &Path, top: &str, (a, b): (&[u64], &[u64])) -> Vec<String> {
    let mut steps = String::new();
    for (a, b) in a.iter().zip(b) {
        let _ = writeln!(steps, "a = {a}; b = {b}; #500 clk = 1; #499.999 $display(\"HPU %b\", out); #0.001 clk = 0;");
    }
    let bench = format!(
        "`timescale 1ns / 1ps\nmodule bench;\nreg clk = 0, rst = 0, a = 0, b = 0;\nwire [15:0] out;\n\
         {top} dut (.clk(clk), .rst(rst), .a(a), .b(b), .missing(1'b0), .out(out));\ninitial begin\n\
         #500 rst = 1; #500 repeat (4) begin clk = 1; #500 clk = 0; #500; end\nrst = 0; #500\n\
         {steps}$finish;\nend\nendmodule\n"
    );
    fs::write(dir.join("bench.v"), bench).expect("a bench");
    let icarus = |program: &str, arguments: &[&str]| {
        let output = Command::new(program).args(arguments).current_dir(dir).output().expect("Icarus Verilog");
        assert!(output.status.success(), "{}", stderr(&output));
        String::from_utf8(output.stdout).expect("text")
    };
    icarus("iverilog", &["-g2005", "-o", "bench.vvp", "-s", "bench", "bench.v", &format!("{top}.v")]);
    let said = icarus("vvp", &["-n", "bench.vvp"]);
    said.lines().filter_map(|line| line.strip_prefix("HPU ")).map(str::to_string).collect()
}

/// Holds a design's port `out` against Icarus Verilog in the folder of its sources, and asserts that each of its lowest
/// `bits` moves.
fn agrees((dir, sources): (&Path, &Path), scene: &str, top: &str, bits: u32) -> String {
    let (said, words) = shown(dir, scene, &["a", "b", "out"]);
    let theirs = by_icarus(sources, top, (&words[0], &words[1]));
    assert_eq!(theirs.len(), EDGES - 1);
    for (edge, (ours, theirs)) in words[2].iter().zip(&theirs).enumerate() {
        assert_eq!(&format!("{ours:016b}"), theirs, "after edge {}", edge + 1);
    }
    for bit in 0..bits {
        let is_set = |word: &u64| word >> bit & 1 == 1;
        assert!(words[2].iter().any(is_set) && !words[2].iter().all(is_set), "bit {bit} stands still");
    }
    said
}

/// Each bit of `out` is a feature: delays of registers, by number, parameter and macro, and of wires and gates;
/// blocking and non-blocking assignments of one register; an included header, which includes another; memories read
/// from files in two folders; `casex`; `defparam`; three-state nets; a function; a register with two processes.
const LEGACY: &str = "`timescale 1ns / 1ps
`include \"defs.vh\"
module legacy (clk, rst, a, b, missing, out);
  input clk, rst, a, b, missing;
  output [15:0] out;
  parameter TCQ = 2;
  parameter IMAGE = \"../data/wave.mem\";
  reg [7:0] n, m, k; reg f; reg wave [0:15]; reg [3:0] table_4 [0:3]; reg twice; reg x;
  wire g, h; tri t; wire [4:0] c;
  initial begin
    $readmemb(IMAGE, wave);
    $readmemh(\"table.hex\", table_4);
    if (missing) $readmemh(\"nowhere.hex\", table_4);
  end
  always @(posedge clk) if (rst) n <= #1 0; else n <= #1 n + 1;
  always @(posedge clk) if (rst) m <= #TCQ 0; else m <= #(TCQ) m + n;
  always @(posedge clk) if (rst) k <= `DLY 1; else k <= `DLY rotated(k);
  always @(posedge clk or posedge rst) if (rst) begin f = 0; end else begin f <= a ^ n[0]; end
  assign #3 h = n[`TOPBIT];
  and #1 gate (g, a, n[1]);
  counter u (.clk(clk), .rst(rst), .q(c)); defparam u.WIDTH = 5;
  assign t = n[2] ? a : 1'bz; assign t = n[2] ? 1'bz : ~b;
  always @(posedge clk) if (n[3]) twice <= 1;
  always @(posedge clk) if (rst | ~n[3]) twice <= 0;
  always @(n or a) casex ({n[1:0], a}) 3'b1x1: x = 1; 3'b01?: x = 0; default: x = n[0]; endcase
  function [7:0] rotated; input [7:0] w; rotated = {w[6:0], w[7]}; endfunction
  assign out = {4'b0, x, twice, c[4], t, table_4[n[1:0]][1], wave[n[3:0]], g, h, f, k[0], m[6], n[4]};
endmodule
module counter (clk, rst, q);
  parameter WIDTH = 2; input clk, rst; output [WIDTH-1:0] q; reg [WIDTH-1:0] q;
  always @(posedge clk) if (rst) q <= 0; else q <= q + 1;
endmodule
";

#[test]
fn legacy_verilog_does_what_icarus_does_and_its_short_delays_are_told() {
    let dir = scratch("legacy_verilog");
    for folder in ["rtl/more", "data"] {
        fs::create_dir_all(dir.join(folder)).expect("a folder");
    }
    let write = |name: &str, content: &str| fs::write(dir.join(name), content).expect("a file");
    write("rtl/legacy.v", LEGACY);
    write("rtl/defs.vh", "`include \"more/dly.vh\"\n`define TOPBIT 5\n");
    write("rtl/more/dly.vh", "`define DLY #1.5\n");
    write("data/wave.mem", "0 0 1 0 1 1 1 0 0 1 0 1 1 0 0 1\n");
    write("rtl/table.hex", "1 2 0 3\n");
    let ports = "a = \"encoder.a\"\nb = \"encoder.b\"\nmissing = 0\nout = \"open\"";
    let scene = scene(&dir, "\"rtl/legacy.v\"", "legacy", ports, "parameters = { TCQ = 4 }");
    // Icarus looks for data where it runs.
    let said = agrees((&dir, &dir.join("rtl")), &scene, "legacy", 12);
    assert!(said.contains("note: rtl/legacy.v:15: `#1` and ") && said.contains("left out"), "{said}");
    let missing = run(&["run", &scene, "--set", "dut.ports.missing=1"]);
    assert_eq!(code(&missing), 1, "{}", stderr(&missing));
    for words in ["error: ", "the design reads `nowhere.hex` ($readmem), and no such file is beside its files"] {
        assert!(stderr(&missing).contains(words), "{}", stderr(&missing));
    }
    // The header and the data are part of the design.
    write("data/wave.mem", "1 1 1 0 1 1 1 0 0 1 0 1 1 0 0 1\n");
    let again = run(&["run", &scene, "--set", "run.duration=1 us", "--no-dut"]);
    assert_refused(&again, 2, &["not simulated"]);
}

/// Each bit of `out` waits: at the start, in a process, for a level, for edges, in a fork, by an oscillator of its own,
/// and longer than a clock cycle.
const WAITS: &str = "`timescale 1ns / 1ps
module waits (input clk, input rst, input a, input b, input missing, output [15:0] out);
  reg e, w, r, o, q, s, u; reg [7:0] n, p; reg late;
  initial begin e = 0; #2300 e = 1; end
  always @(posedge clk) if (rst | ~e) n <= 0; else n <= n + 1;
  initial p = 0;
  always @(posedge clk) begin #1 p = p + 1; #1 if (p == 9) p = 0; end
  initial begin w = 0; wait (n == 5); w = 1; end
  initial begin r = 0; repeat (40) @(posedge clk); r = 1; end
  initial begin q = 0; s = 0; fork #70_000 q = 1; #30_000 s = 1; join u = 1; end
  initial begin u = 0; o = 0; end
  always #1300 o = ~o;
  initial late = 0;
  always @(posedge clk) late <= #3200 a;
  assign out = {7'b0, late, u, o, s, q, r, w, p[1], n[2]};
endmodule
";

#[test]
#[ignore = "testbench/long.sh runs it"]
fn a_design_that_waits_does_what_icarus_does_and_is_told() {
    let dir = scratch("waiting_verilog");
    fs::write(dir.join("waits.v"), WAITS).expect("a design");
    let ports = "a = \"encoder.a\"\nb = \"encoder.b\"\nmissing = 0\nout = \"open\"";
    let scene = scene(&dir, "\"waits.v\"", "waits", ports, "");
    let said = agrees((&dir, &dir), &scene, "waits", 9);
    assert!(said.contains("note: waits.v:") && said.contains("waits for a time or an event"), "{said}");
}

/// Each bit of `out` depends on a short delay: words of a clock that a register divides, of a clock that is delayed
/// itself, and of one that is a pulse as long as a delay. Names are keywords of SystemVerilog; an output is wider than
/// the words of a scene.
const DIVIDED: &str = "`timescale 1ns / 1ps
module divided (input clk, input rst, input a, input b, input missing, output [15:0] out, output [99:0] debug);
  reg [7:0] n, held, do, taken, final, pulses; reg half;
  wire later, edge_of_n;
  initial begin half = 0; held = 0; do = 0; taken = 0; final = 0; pulses = 0; end
  always @(posedge clk) if (rst) n <= #1 0; else n <= #1 n + 1;
  always @(posedge clk) half <= ~half;
  always @(posedge clk) held <= #1 n;
  always @(posedge half) do <= held;
  assign #1 later = clk;
  always @(posedge clk) taken <= n;
  always @(posedge later) final <= taken;
  assign #1 edge_of_n = n[0];
  wire priority = edge_of_n ^ n[0];
  always @(posedge priority) pulses <= pulses + a;
  assign debug = {92'b0, n};
  assign out = {4'b0, pulses[2:0], final[3:0], do[4:0]};
endmodule
";

#[test]
#[ignore = "testbench/long.sh runs it"]
fn a_short_delay_stays_where_another_clock_than_the_ports_may_see_it() {
    let dir = scratch("divided_verilog");
    fs::write(dir.join("divided.v"), DIVIDED).expect("a design");
    let ports = "a = \"encoder.a\"\nb = \"encoder.b\"\nmissing = 0\nout = \"open\"";
    let file = scene(&dir, "\"divided.v\"", "divided", ports, "");
    let said = agrees((&dir, &dir), &file, "divided", 12);
    assert!(
        said.contains("note: divided.v:") && said.contains("is no input of the design, clocks registers"),
        "{said}"
    );
    // Of two modules of one name, the first is simulated, and told.
    fs::write(dir.join("again.v"), "module divided (input clk); endmodule\n").expect("a design");
    let both = scene(&dir, "\"divided.v\", \"again.v\"", "divided", ports, "");
    let said = agrees((&dir, &dir), &both, "divided", 12);
    let told = "note: again.v:1: module 'divided' is declared at divided.v:2 too; the latter is simulated";
    assert!(said.contains(told), "{said}");
    let file = scene(&dir, "\"divided.v\"", "divided", ports, "");
    // An output that is connected has to fit a word.
    let wide = run(&["run", &file, "--set", "dut.ports.debug=open"]);
    assert_refused(&wide, 4, &["dut.ports.debug: port `debug` has 100 bits; hpu takes ports of at most 64"]);
    // Verilator has one unit of time for all modules.
    fs::write(dir.join("more.v"), "`timescale 1us / 1ps\nmodule more; endmodule\n").expect("a design");
    let file = scene(&dir, "\"divided.v\", \"more.v\"", "divided", ports, "");
    assert_refused(&run(&["run", &file]), 1, &["more.v: `timescale 1us / 1ps beside that of divided.v"]);
}

/// GHDL 2.0 has an error of its own when it synthesises the real number.
const REAL: &str = "library ieee; use ieee.std_logic_1164.all; use ieee.numeric_std.all;
entity real_sum is port (clk, rst, a, b, missing : in std_logic; out_w : out std_logic_vector(7 downto 0)); end;
architecture r of real_sum is begin
  process (clk) variable sum : real := 0.0; begin if rising_edge(clk) then
    sum := sum + 1.0; if rst = '1' or sum > 200.0 then sum := 0.0; end if;
    out_w <= std_logic_vector(to_unsigned(integer(sum), 8));
  end if; end process;
end;
";

#[test]
fn ghdl_simulates_what_its_synthesis_cannot_end() {
    let dir = scratch("real_vhdl");
    fs::write(dir.join("real_sum.vhd"), REAL).expect("a design");
    let ports = "a = \"encoder.a\"\nb = \"encoder.b\"\nmissing = 0\nout_w = \"open\"";
    let file = scene(&dir, "\"real_sum.vhd\"", "real_sum", ports, "");
    let (said, words) = shown(&dir, &file, &["out_w"]);
    assert!(
        said.contains("GHDL simulates `real_sum`") && said.contains("synthesis ends by an error of its own"),
        "{said}"
    );
    assert_eq!(words[0], (1..EDGES as u64).map(|edge| edge % 201).collect::<Vec<_>>());
    assert_refused(&run(&["run", &file, "--set", "dut.engine=verilator"]), 4, &["GHDL Bug occurred"]);
}

/// Signals, ports, units and labels with names that Verilog, SystemVerilog or Verilator keeps for itself, beside
/// extended identifiers and a short delay.
const KEYWORDS: &str = "library ieee; use ieee.std_logic_1164.all; use ieee.numeric_std.all;
entity table is generic (W : integer := 4);
  port (posedge : in std_logic; reg : in unsigned(W-1 downto 0); wire : out unsigned(W-1 downto 0)); end;
architecture r of table is begin
  process (posedge) begin if rising_edge(posedge) then wire <= reg + 1; end if; end process; end;
library ieee; use ieee.std_logic_1164.all; use ieee.numeric_std.all;
entity interface is port (clk, rst : in std_logic; input, \\edge-b\\ : in std_logic; output, int : out std_logic); end;
architecture r of interface is
  signal module, this, ref, reg, wire : unsigned(3 downto 0) := (others => '0');
  signal assign, always, initial, logic, bit, byte, event, name : std_logic := '0';
begin
  process (clk) begin if rising_edge(clk) then
    if rst = '1' then module <= (others => '0'); always <= '0';
    else module <= ref + reg after 1 ns; always <= \\edge-b\\; end if;
    logic <= always xor input;
  end if; end process;
  table : entity work.table port map (posedge => clk, reg => module, wire => wire);
  \\my-inst\\ : entity work.table generic map (W => 2)
    port map (posedge => clk, reg => module(1 downto 0), wire => ref(1 downto 0));
  ref(3 downto 2) <= wire(1 downto 0);
  with module select assign <= '1' when \"0001\" | \"0101\", \\edge-b\\ when \"0011\", input when others;
  process (all) begin
    case wire is when \"0000\" => initial <= module(0); when \"0010\" => initial <= ref(1);
      when others => initial <= assign; end case;
  end process;
  reg <= shift_right(module, to_integer(ref(1 downto 0)));
  this <= ref; bit <= this(0) xor wire(2); byte <= bit; event <= byte xor name; name <= logic;
  output <= initial xor event; int <= wire(3) xor logic;
end;
";

#[test]
fn names_of_vhdl_that_verilog_keeps_for_itself_run_in_verilator_as_in_ghdl() {
    let dir = scratch("names_of_verilog");
    fs::write(dir.join("names.vhd"), KEYWORDS).expect("a design");
    let ports = "input = \"encoder.a\"\n\"\\\\edge-b\\\\\" = \"encoder.b\"\noutput = \"bridge.pwm\"\n\
                 int = \"bridge.direction\"";
    let scene = scene(&dir, "\"names.vhd\"", "interface", ports, "");
    let with = |engine: &str| {
        let output = run(&["run", &scene, "--json", "--set", &format!("dut.engine={engine}")]);
        assert_eq!(code(&output), 0, "{}", stderr(&output));
        (json(&output), stderr(&output))
    };
    let ((verilator, said), (ghdl, silent)) = (with("verilator"), with("ghdl"));
    assert!(verilator["dut"]["engine"].as_str().is_some_and(|engine| engine.starts_with("Verilator")));
    assert!(said.contains("names.vhd:14: `after 1 ns`: left out") && !silent.contains("note"), "{said}{silent}");
    assert!(
        verilator["output_changes"].as_u64().is_some_and(|changes| changes > 30),
        "{}",
        verilator["output_changes"]
    );
    assert_eq!(told(verilator), told(ghdl));
}

#[test]
fn a_delay_of_vhdl_stays_or_is_refused_at_its_line() {
    let dir = scratch("delays_of_vhdl");
    let design = "library ieee; use ieee.std_logic_1164.all; use ieee.numeric_std.all;
entity late is port (clk, rst : in std_logic; a, b : in std_logic; pwm, dir : out std_logic); end;
architecture r of late is signal n : unsigned(7 downto 0) := (others => '0'); constant D : time := 5 us; begin
  process (clk) begin if rising_edge(clk) then if rst = '1' then n <= (others => '0'); else n <= n + 1; end if;
  end if; end process;
  pwm <= transport n(3) after D;
  dir <= a;
end;";
    fs::write(dir.join("late.vhd"), design).expect("a design");
    let ports = "a = \"encoder.a\"\nb = \"encoder.b\"\npwm = \"bridge.pwm\"\ndir = \"bridge.direction\"";
    let scene = scene(&dir, "\"late.vhd\"", "late", ports, "");
    let (said, words) = shown(&dir, &scene, &["pwm"]);
    let place = "late.vhd:6: `after D`";
    for words in ["GHDL simulates `late`", "50 to 400 times more slowly", place, "leave that delay out"] {
        assert!(said.contains(words), "{words}: {said}");
    }
    // Bit 3 of the counter changes every 8 clocks, and 5 clocks later at the port.
    let expected: Vec<_> = (1..EDGES as u64).map(|edge| edge.saturating_sub(5) >> 3 & 1).collect();
    assert_eq!(words[0], expected);
    let refused = run(&["run", &scene, "--set", "dut.engine=verilator"]);
    assert_refused(&refused, 4, &["dut.engine", place, "write \"ghdl\" or \"auto\""]);
}
