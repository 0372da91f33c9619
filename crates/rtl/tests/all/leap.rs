//! Designs by others as netlists that leap: known answers of Verilator, and whole runs beside Verilator.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use hpu_cosim::dut::{Asked, Change, Design, Designs, DutSimulation, Inside};
use hpu_cosim::scene::{DutScene, Experiment, SceneFile};
use hpu_cosim::{Beyond, Control, Forever, Simulation, Summary};
use hpu_rtl::dut::Simulators;
use hpu_rtl::{CacheFolder, Hdl, Setup};
use hpu_signal::{Cycle, Observe};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).expect("the project")
}

pub(crate) fn simulators() -> Simulators {
    let cache = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("leap");
    Simulators { cache: CacheFolder::new(Some(cache), "built models").with_programs(), setup: Setup::new(Hdl::Carried) }
}

/// Returns a scene of `testbench/dut` whose text is changed in these places, with an engine.
pub(crate) fn scene(name: &str, changes: &[(&str, &str)], engine: &str) -> DutScene {
    let path = root().join(format!("testbench/dut/{name}.toml"));
    let mut file = SceneFile::find(&path.to_string_lossy()).expect("a scene");
    for (before, after) in changes {
        assert!(file.text.contains(before), "{name}: {before}");
        file.text = file.text.replace(before, after);
    }
    let set = [("dut.engine".to_string(), engine.to_string())];
    match file.parse(&set).unwrap_or_else(|error| panic!("{error}")) {
        Experiment::Dut(scene) => scene,
        _ => panic!("{name} has a design"),
    }
}

fn built(scene: &DutScene) -> Arc<dyn Design> {
    simulators().build(scene, Inside::Nothing).unwrap_or_else(|error| panic!("{error}"))
}

/// Returns the polynomial remainder of CRC-32 (IEEE 802.3).
fn crc32(text: &str) -> u32 {
    let step = |crc: u32, _| if crc & 1 == 1 { crc >> 1 ^ 0xedb8_8320 } else { crc >> 1 };
    !text.bytes().fold(!0, |crc, byte| (0..8).fold(crc ^ u32::from(byte), step))
}

/// Clocks a design for two million edges: the reset is active for eight of them; then the lines of an encoder, `enc_a`
/// and `enc_b`, step forward 1100 times, every 1000 edges. Returns a line for each change of an output; all outputs
/// count as 0 before edge 1.
fn stimulated(design: &dyn Design, reset: (&str, u64), constants: &[(&str, u64)]) -> String {
    const EDGES: u64 = 2_000_000;
    let ports: Vec<_> = design.ports().iter().filter(|port| port.name != "clk").collect();
    let mut words = vec![0; ports.len()];
    let place = |name: &str| ports.iter().position(|port| port.name == name).expect("a port");
    for (name, word) in constants {
        words[place(name)] = *word;
    }
    let (a, b, rst) = (place("enc_a"), place("enc_b"), place(reset.0));
    words[rst] = reset.1;
    let mut running = design.start(&words, &vec![false; ports.len()], &mut Vec::new()).expect("a simulation");
    let (mut shown, mut text, mut edge) = (vec![0; ports.len()], String::new(), 0);
    let mut next = |words: &[u64], until: u64| {
        let mut changes = Vec::new();
        while edge < until {
            let done = running.clock(words, until - edge, Asked::Outputs, &mut changes).expect("edges");
            for Change { edge: at, port, bits } in changes.drain(..) {
                let bits = bits.expect("known bits");
                if std::mem::replace(&mut shown[port], bits) != bits {
                    writeln!(text, "{} {} {bits}", edge + at, ports[port].name).expect("memory");
                }
            }
            edge += done;
        }
    };
    next(&words, 8);
    words[rst] = 1 - reset.1;
    for step in 1..=1100 {
        next(&words, 1000 * (step + 1) + 16);
        let phase = step % 4;
        (words[a], words[b]) = (u64::from(phase >= 2), u64::from(phase == 1 || phase == 2));
    }
    next(&words, EDGES);
    text
}

/// The figures are those of Verilator 5.006.
#[test]
fn two_designs_have_the_outputs_that_verilator_has_told() {
    let zero = ("[dut]\n", "[dut]\nregisters = \"zero\"\n");
    let knee = [zero, ("reset = { port = \"rst\" }\n", ""), ("gain = 95\n", "gain = 95\nrst = 0\n")];
    let knee = stimulated(&*built(&scene("knee", &knee, "leap")), ("rst", 1), &[("gain", 95), ("wall", 978)]);
    assert_eq!(knee.lines().take(2).collect::<Vec<_>>(), ["1 dir 1", "2019 position 1"]);
    assert_eq!(knee.lines().rev().take(2).collect::<Vec<_>>(), ["1999974 pwm 1", "1999675 pwm 0"]);
    assert_eq!((knee.lines().count(), crc32(&knee)), (3098, 0x4cbb_80c4));
    let rim =
        [zero, ("reset = { port = \"rst_n\", active = \"low\" }\n", ""), ("[dut.ports]\n", "[dut.ports]\nrst_n = 1\n")];
    let rim = stimulated(&*built(&scene("rim", &rim, "leap")), ("rst_n", 0), &[]);
    assert_eq!(rim.lines().next(), Some("15 gate_al 1"));
    assert_eq!(rim.lines().rev().take(2).collect::<Vec<_>>(), ["1999889 gate_bh 1", "1999884 gate_bl 0"]);
    assert_eq!((rim.lines().count(), crc32(&rim)), (4020, 0xdecc_16f6));
}

/// Every word that an observer is shown, edge by edge.
#[derive(Default, PartialEq)]
pub(crate) struct Shown(pub(crate) Vec<(u64, Vec<i64>)>);

impl Observe for Shown {
    fn nets(&mut self, cycle: Cycle, words: &[i64]) {
        if self.0.last().is_none_or(|(_, last)| last != words) {
            self.0.push((cycle.0, words.to_vec()));
        }
    }

    fn reals(&mut self, _: Cycle, _: &[f64]) {}
}

pub(crate) fn ran(scene: &DutScene) -> (Shown, Summary, String) {
    let simulators = simulators();
    let simulation = DutSimulation::new(scene, &simulators, Inside::Nothing).unwrap_or_else(|error| panic!("{error}"));
    let (mut trace, mut shown) = (simulation.brief_trace(), Shown::default());
    let summary =
        simulation.run(true, &mut trace, &mut shown, &Control::default()).unwrap_or_else(|error| panic!("{error}"));
    (shown, summary, simulation.engine().to_string())
}

/// Holds a run by leaps against one by Verilator: every word of every port at every edge, and the energies to the bit.
fn same_as_verilator(name: &str, changes: &[(&str, &str)], least: usize) -> Summary {
    let ((leapt, by_leaps, one), (clocked, by_verilator, other)) =
        (ran(&scene(name, changes, "leap")), ran(&scene(name, changes, "verilator")));
    assert!(one.starts_with("hpu's leaps") && other.starts_with("Verilator"), "{one}, {other}");
    assert_eq!(leapt.0.len(), clocked.0.len(), "{name}");
    for (own, other) in leapt.0.iter().zip(&clocked.0) {
        assert_eq!(own, other, "{name}");
    }
    assert!(leapt.0.len() > least, "{name}: {} changes", leapt.0.len());
    assert_eq!(by_leaps.energy, by_verilator.energy, "{name}");
    let counts = |summary: &Summary| (summary.edges, summary.encoder_edges, summary.output_changes);
    assert_eq!(counts(&by_leaps), counts(&by_verilator), "{name}");
    by_leaps
}

/// The energies are those of Verilator 5.006 when the designs came into the repository.
#[test]
#[ignore = "testbench/long.sh runs it"]
fn whole_runs_are_those_of_verilator_to_the_last_bit() {
    let energy = |summary: Summary| (summary.energy.source_j, summary.energy.copper_j);
    same_as_verilator("prescaled", &[], 1000);
    same_as_verilator("prescaled", &[("1.5 rad", "0.1 rad")], 10_000);
    same_as_verilator("paddle", &[], 10_000);
    same_as_verilator("paddle", &[("1.5 rad", "0.1 rad")], 1000);
    let knee = energy(same_as_verilator("knee", &[], 10_000));
    assert_eq!(knee, (10.797_218_678_279_638, 10.803_402_102_578_916));
    let rim = energy(same_as_verilator("rim", &[], 20_000));
    assert_eq!(rim, (10.773_356_039_689_741, 10.767_953_388_357_42));
}

/// A motor with three phases: converters that the design starts, a chip on SPI, Hall switches; the wall is touched.
#[test]
fn runs_of_three_phases_are_those_of_verilator_to_the_last_bit() {
    let near = |duration| {
        let path = "[[\"0 s\", 0], [\"150 ms\", 0.25], [\"250 ms\", 0.6]]";
        [("600 ms", duration), ("0.3 rad", "2 mrad"), (path, "[[0, 0], [0.02, 0.3]]")]
    };
    let foc = same_as_verilator("foc", &near("10 ms"), 5_000);
    assert!(foc.starts.iter().all(|(_, starts)| starts.taken == 200 && starts.missed == 0), "{:?}", foc.starts);
    assert!(foc.frames.iter().all(|(_, frames)| frames.all == 200 && frames.wrong + frames.fast == 0));
    let hall = same_as_verilator("hall", &near("20 ms"), 500);
    assert!(foc.energy.copper_j > 0.0 && hall.energy.copper_j > 0.0);
}

/// A chip on I2C: a frame of two bytes lasts for 29 bits of 124 clocks and the quarters of start and stop, 20 ms for
/// some 270 of them after the one that sets the pointer.
#[test]
fn a_run_with_a_chip_on_i2c_is_that_of_verilator_to_the_last_bit() {
    let angle = same_as_verilator("angle", &[], 10_000);
    let [(0, frames)] = angle.frames[..] else { panic!("{:?}", angle.frames) };
    assert_eq!((frames.wrong, frames.fast), (0, 0));
    let clocks = 124 * (27 + 2);
    assert_eq!(frames.all, 1 + (1_000_000 - 124 * 19) / clocks);
}

/// Returns a scene around Verilog of its own, with the clock `clk` and inputs at 0.
pub(crate) fn around(verilog: &str, more: &str, engine: &str) -> DutScene {
    around_file(("t.v", verilog), ("t", "clk"), more, engine)
}

/// Returns a scene around a file, with this top and this clock.
pub(crate) fn around_file(
    (file, code): (&str, &str),
    (top, clock): (&str, &str),
    more: &str,
    engine: &str,
) -> DutScene {
    let folder = hpu_rtl::temporary::Temporary::folder().expect("a folder");
    std::fs::write(folder.path().join(file), code).expect("a file");
    let clocks = match clock.contains('=') {
        true => format!("clocks = {{ {clock} }}"),
        false => format!("clock = \"{clock}\""),
    };
    let text = format!(
        "about = \"a design\"\ndevice = {{ kind = \"motor\", motor = \"vasudevan_2007\", wheel_ratio = 7 }}\n\
         clock = {{ frequency = \"10 MHz\" }}\nrun = {{ duration = \"1 ms\" }}\n\
         hand = {{ kind = \"spring_damper\", stiffness = \"0.3 N.m/rad\", damping = 0, path = [[0, 0], [1, 1]] }}\n\
         [dut]\nfiles = [\"{file}\"]\ntop = \"{top}\"\n{clocks}\nengine = \"{engine}\"\n{more}"
    );
    let file = SceneFile { name: "t.toml".to_string(), text, data: folder.path().to_path_buf(), is_shipped: false };
    match file.parse(&[]).unwrap_or_else(|error| panic!("{error}")) {
        Experiment::Dut(scene) => scene,
        _ => panic!("a design"),
    }
}

#[test]
fn designs_that_no_netlist_represents_are_refused_by_name() {
    let module =
        |ports: &str, body: &str| format!("module t(input clk, input a, input b, {ports});\n{body}\nendmodule\n");
    let q = "output reg q";
    for (verilog, why) in [
        (module(q, "always @* if (a) q = b;"), "`q` is a latch"),
        (module("output y", "wire z = ~(y & a); assign y = z | b;"), "is in a combinational loop"),
        (module(q, "wire g = clk & a; always @(posedge g) q <= b;"), "`g` clocks register `q`"),
        (
            module(
                q,
                "reg c, d; always @(posedge clk) c <= a; always @(posedge c) d <= b; always @(posedge d) q <= a;",
            ),
            "`d` clocks register `q`",
        ),
        (
            module(
                q,
                "reg c, r; always @(posedge clk) r <= a; always @(posedge clk, posedge r) if (r) c <= 1; else c <= ~c;
                 always @(posedge c) q <= b;",
            ),
            "`c` clocks register `q`",
        ),
        (module(q, "always @(negedge clk) q <= b;"), "register `q` takes its word at the falling edge of the clock"),
        (module(q, "always @(posedge clk) begin q <= b; if (a) $display(\"a\"); end"), "`$display`"),
        (module(q, "always @(posedge clk) case (a) 1'b0: q <= b; default: q <= 1'bx; endcase"), "may take a value x"),
        (module("output y", "assign y = clk ^ a;"), "the clock `clk` is read as a signal"),
        (
            module(q, "always @(posedge clk or posedge a) if (a) q <= b; else q <= 1'b0;"),
            "register `q` has an asynchronous set or load",
        ),
        (
            module(q, "reg [69:0] p; always @(posedge clk) begin p <= p * {70{a}} + b; q <= p[69]; end"),
            "in 70 bits; at most 64 are taken",
        ),
        (
            module(q, "reg m [0:127]; reg [6:0] n; always @(posedge clk) begin n <= n + 1; m[n] <= a; q <= m[~n]; end"),
            "has more than 64 words",
        ),
    ] {
        let refused = simulators().build(&around(&verilog, "", "leap"), Inside::Nothing).err();
        let said = refused.map(|error| error.to_string()).unwrap_or_default();
        assert!(said.contains(why) && said.contains("dut.engine"), "{verilog}{said}");
    }
    let slower = "[dut.clocks]\nclk = 1\nb = 2\n";
    let two = around(&module(q, "always @(posedge clk) q <= a;"), "", "leap");
    assert!(simulators().build(&two, Inside::Nothing).is_ok());
    let text = module(q, "always @(posedge clk) q <= a;");
    let slow = std::panic::catch_unwind(|| around(&text, slower, "leap"));
    if let Ok(slow) = slow {
        let said = simulators().build(&slow, Inside::Nothing).err().expect("two clocks").to_string();
        assert!(said.contains("several clocks"), "{said}");
    }
}

/// Clocks a design by both engines with the same words at random times, and compares every answer.
fn same_answers(verilog: &str, more: &str, of: (u32, bool)) {
    same_answers_by("leap", verilog, more, of);
}

/// The same by an engine. Returns its name at the end.
pub(crate) fn same_answers_by(engine: &str, verilog: &str, more: &str, (requests, drives): (u32, bool)) -> String {
    same_answers_of(&|engine| around(verilog, more, engine), engine, verilog, (requests, drives))
}

/// The same of the design of any scene.
pub(crate) fn same_answers_of(
    scene: &dyn Fn(&str) -> DutScene,
    engine: &str,
    verilog: &str,
    (requests, drives): (u32, bool),
) -> String {
    let engines = [engine, "verilator"].map(|engine| built(&scene(engine)));
    let [own, other] = &engines;
    assert_eq!(own.ports(), other.ports());
    let is_given = |port: &&hpu_cosim::dut::Port| !port.name.starts_with("clk") && port.name != "rst";
    let ports: Vec<_> = own.ports().iter().filter(is_given).collect();
    let driving: Vec<_> = ports.iter().map(|port| drives && !port.is_input).collect();
    let mut seed = 0x1234_5678_9abc_def1u64;
    let mut random = |limit: u64| {
        seed ^= seed << 13;
        seed ^= seed >> 7;
        seed ^= seed << 17;
        (seed.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 11) % limit
    };
    let mut word = |ports: &[&hpu_cosim::dut::Port]| -> Vec<u64> {
        let width = |port: &&hpu_cosim::dut::Port| port.format.width();
        ports.iter().map(|port| random(1 << width(port).min(50)) & (u64::MAX >> (64 - width(port)))).collect()
    };
    let (mut words, mut changes) = (word(&ports), [Vec::new(), Vec::new()]);
    let mut running: Vec<_> = engines
        .iter()
        .zip(&mut changes)
        .map(|(design, changes)| design.start(&words, &driving, changes).expect("a simulation"))
        .collect();
    let (mut told, mut last) = (0, [vec![Some(0); ports.len()], vec![Some(0); ports.len()]]);
    for request in 0..requests {
        // Verilator's program tells an unknown word anew when the word of one of its models changes.
        for (changes, last) in changes.iter_mut().zip(&mut last) {
            changes.retain(|change| std::mem::replace(&mut last[change.port], change.bits) != change.bits);
        }
        assert_eq!(changes[0], changes[1], "before request {request}\n{verilog}");
        told += changes[0].len();
        changes.iter_mut().for_each(Vec::clear);
        if request % 3 != 1 {
            words = word(&ports);
        }
        let edges = [1, 2, 5, 100, 700][request as usize % 5];
        let asked = if request % 4 == 3 { Asked::Driving } else { Asked::Outputs };
        let done = running.iter_mut().zip(&mut changes).map(|(one, changes)| one.clock(&words, edges, asked, changes));
        let done: Vec<_> = done.map(|done| done.map_err(|fault| fault.to_string())).collect();
        match &done[..] {
            [Ok(own), Ok(other)] => assert_eq!(own, other, "request {request}\n{verilog}"),
            [Err(own), Err(other)] => {
                let head = |said: &str| said.split(&[':', ';'][..]).next().unwrap_or_default().to_string();
                assert_eq!(head(own), head(other));
                assert!(own.contains("depends on a value that nothing has set"), "{own}");
                return own.clone();
            }
            _ => panic!("{done:?}"),
        }
    }
    assert!(told > 20, "{told} changes\n{verilog}");
    running.iter_mut().for_each(|one| drop(one.heard()));
    own.engine().to_string()
}

#[test]
fn cells_of_every_kind_answer_as_in_verilator() {
    let reset = "reset = { port = \"rst\" }\n";
    same_answers(
        "module t(input clk, input rst, input signed [6:0] a, input [6:0] b, input [2:0] n,
           output reg signed [12:0] product, output reg [6:0] shifted, output reg signed [6:0] rotated,
           output reg [6:0] quotient, output reg signed [6:0] rest, output reg [3:0] order, output reg picked,
           output reg [1:0] part, output reg [4:0] flags, output [7:0] through, output reg [15:0] ramp);
         reg [6:0] m [0:7];
         reg [2:0] at;
         assign through = {a ^ b, ~&b};
         always @(posedge clk or posedge rst)
           if (rst) begin
             product <= 0; shifted <= 0; rotated <= 0; quotient <= 0; rest <= 0; order <= 0; picked <= 0; part <= 0;
             flags <= 0; ramp <= 0; at <= 0;
           end else begin
             ramp <= ramp + 3; at <= at + 1;
             product <= a * $signed(b); shifted <= n[0] ? b << n : b >> n; rotated <= n[0] ? a >>> n : -a;
             quotient <= b == 0 ? 7'd0 : b / (b % 7'd5 + 7'd1);
             rest <= b == 0 ? 7'sd0 : a % $signed({1'b0, b[3:0]} + 7'sd1);
             order <= {a < $signed(b), a <= 3, $unsigned(a) > b, a >= -5};
             picked <= b[n[1:0]]; part <= {b[n[1:0]], b[{1'b0, n[1:0]}]};
             flags <= {^a, |b, &a, !b, a && b};
           end
         always @(posedge clk) begin m[at] <= b; end
         endmodule\n",
        reset,
        (300, false),
    );
}

/// Yosys 0.23 takes a constant amount of 32 bits for a signed number, and shifts to the other side by a negative one.
#[test]
fn shifts_that_yosys_turns_to_the_other_side_do_not_leap() {
    let verilog = |width: u32, more: &str, by: &str| {
        format!(
            "module t #(parameter W = {width})(input clk, input rst, input [7:0] a, output reg [7:0] left,
               output reg [7:0] right, output reg [7:0] kept, output reg [7:0] up, output reg [7:0] n);
             {more}
             always @(posedge clk) if (rst) begin left <= 0; right <= 0; kept <= 0; up <= 0; n <= 0; end
               else begin n <= n + 1; left <= n << {by}; right <= n >> {by}; kept <= a >>> {by}; up <= a <<< {by}; end
             endmodule\n"
        )
    };
    let reset = "reset = { port = \"rst\" }\n";
    for (width, more, by) in [(4, "", "(W-8)"), (4, "", "(W-6+1)"), (4, "wire [31:0] s = W - 8;", "s")] {
        let scene = around(&verilog(width, more, by), reset, "leap");
        let simulators = simulators();
        let refused = simulators.build(&scene, Inside::Nothing).err().map(|error| error.to_string());
        assert!(refused.as_ref().is_some_and(|why| why.contains("a shift by")), "{by}: {refused:?}");
        // By themselves they run in Verilator.
        let engine = same_answers_by("auto", &verilog(width, more, by), reset, (200, false));
        assert!(engine.starts_with("Verilator"), "{by}: {engine}");
    }
    // Of the last one Verilator has told that its words are 0.
    let good =
        [(12, "", "(W-8)"), (8, "", "(W-8)"), (4, "wire [2:0] s = W - 1;", "s"), (4, "localparam S = W - 8;", "(S)")];
    for (width, more, by) in good {
        same_answers(&verilog(width, more, by), reset, (200, false));
    }
}

#[test]
fn wide_words_and_tables_answer_as_in_verilator() {
    let reset = "reset = { port = \"rst\", active = \"low\" }\n";
    same_answers(
        "module t(input clk, input rst, input [7:0] a, input [2:0] n, output [7:0] y, output reg [7:0] z,
           output reg all, output reg some);
         reg [99:0] line;
         reg [7:0] m [0:7];
         reg [2:0] at;
         assign y = line[99:92];
         always @(posedge clk)
           if (!rst) begin line <= 0; z <= 0; all <= 0; some <= 0; at <= 0; end
           else begin
             line <= a[0] ? {line[91:0], a} : line ^ {92'b0, a};
             at <= at + 1; m[at] <= a; z <= m[n];
             all <= line == {100{a[1]}}; some <= |line[98:3];
             case (n[1:0]) 2'd0: z[7] <= 1; 2'd1: z[7] <= a[2]; 2'd2: z[7] <= 0; 2'd3: z[7] <= ~a[2]; endcase
           end
         integer i;
         initial for (i = 0; i < 7; i = i + 1) m[i] = 8'h18 + i;
         initial m[7] = 8'hff;
         endmodule\n",
        reset,
        (300, false),
    );
}

/// A table of 256 words, as of a sine, which nothing writes, by an index that moves and by one that is an input; and
/// one whose length is no power of two, within its length.
#[test]
fn tables_that_nothing_writes_answer_as_in_verilator() {
    let words: Vec<_> =
        (0..256).map(|at: u32| format!("sine[{at}] = 12'h{:03x};", (at * at * 7 + 5 * at) & 0xfff)).collect();
    let few: Vec<_> = (0..100).map(|at: u32| format!("few[{at}] = 8'h{:02x};", (at * 37) & 0xff)).collect();
    let verilog = format!(
        "module t(input clk, input rst, input [7:0] a, output [11:0] y, output reg [11:0] z, output reg [7:0] w);
         reg [11:0] sine [0:255];
         reg [7:0] few [0:99];
         reg [7:0] at;
         initial begin {} {} end
         assign y = sine[a];
         always @(posedge clk)
           if (!rst) begin at <= 0; z <= 0; w <= 0; end
           else begin at <= at + 3; z <= sine[at] + {{11'b0, a[0]}}; w <= few[at[5:0]]; end
         endmodule\n",
        words.join(" "),
        few.join(" ")
    );
    same_answers(
        &verilog,
        "reset = {{ port = \"rst\", active = \"low\" }}\n".replace("{{", "{").replace("}}", "}").as_str(),
        (300, false),
    );
}

/// Functions with words of their own, called under a condition: elsewhere these are unknown, and nothing sees them.
/// GHDL 2.0's synthesis writes the name of the topmost entity as it is declared and all others in small letters, and
/// loses the sign of a word that `resize` makes shorter; here it is the entity's first port.
#[test]
fn capitals_and_a_shorter_first_port_of_vhdl_are_taken_as_they_are() {
    let vhdl = "library IEEE; use IEEE.std_logic_1164.all; use IEEE.numeric_std.all;
        entity Up_Counter is port (
          X : in std_logic_vector(7 downto 0); CLK : in std_logic; Short : out std_logic_vector(3 downto 0);
          Count : out unsigned(7 downto 0));
        end Up_Counter;
        architecture Rtl of Up_Counter is signal n : unsigned(7 downto 0) := x\"05\"; begin
          Count <= n;
          Short <= std_logic_vector(resize(signed(X), 4));
          process(CLK) begin if rising_edge(CLK) then n <= n + 3; end if; end process;
        end Rtl;";
    let design = built(&around_file(("t.vhd", vhdl), ("UP_COUNTER", "clk"), "", "leap"));
    let mut running = design.start(&[0; 3], &[false; 3], &mut Vec::new()).expect("a simulation");
    let mut shown = [0, 0, 5];
    for x in 0..256u64 {
        let mut changes = Vec::new();
        running.clock(&[x, 0, 0], 1, Asked::Outputs, &mut changes).expect("edges");
        changes.iter().for_each(|change| shown[change.port] = change.bits.expect("known bits"));
        assert_eq!(shown[1..], [x >> 7 << 3 | x & 7, (5 + 3 * (x + 1)) % 256], "{x}");
    }
}

#[test]
fn functions_under_a_condition_answer_as_in_verilator() {
    same_answers(
        "module t(input clk, input rst, input en, input signed [7:0] a, input [1:0] n, output reg signed [15:0] sum,
           output reg [7:0] low);
         function signed [15:0] limited;
           input signed [15:0] x, y;
           reg signed [16:0] z;
         begin
           z = x + y;
           if (z > 17'sd3000) limited = 16'sd3000;
           else if (z < -17'sd3000) limited = -16'sd3000;
           else limited = z[15:0];
         end
         endfunction
         function integer digits;
           input integer v;
           for (digits = 0; v > 0; digits = digits + 1) v = v >> 1;
         endfunction
         localparam MOST = digits(9);
         reg signed [15:0] turned;
         always @(posedge clk or negedge rst)
           if (!rst) begin sum <= 0; low <= MOST; end
           else begin
             if (en) begin
               sum <= limited(sum, a);
               if (n == 2) low <= limited(sum, -a) >>> 4;
             end
             if (n[0]) begin turned = -a; low <= turned[7:0]; end
           end
         endmodule\n",
        "reset = { port = \"rst\", active = \"low\" }\n",
        (300, false),
    );
}

/// Clocks that registers make: both of their edges, logic before the registers, registers on either side, and resets,
/// which are edges too. A reset that is active from the start has had no edge.
#[test]
fn clocks_that_a_design_makes_answer_as_in_verilator() {
    same_answers(
        "module t(input clk, input clear, input en, input [7:0] a, output reg [7:0] slow, output [7:0] sum,
           output reg [15:0] count, output reg [7:0] turned, output reg [3:0] low, output reg old,
           output reg [7:0] back);
         reg half, set;
         reg [7:0] mixed;
         assign sum = slow + turned + count[7:0];
         always @(posedge clk) begin half <= en ^ half; count <= count + 1; old <= slow[0]; mixed <= sum ^ a; end
         always @(posedge clk or posedge clear) if (clear) set <= 1; else set <= a[0] & ~set;
         always @(posedge half or negedge clear) if (!clear) slow <= 3; else slow <= slow + sum + mixed + half;
         always @(negedge count[4]) begin turned <= turned + a + count[3:0]; low <= {low[2:0], half}; end
         always @(posedge set) back <= back + count[7:0] + turned;
         initial begin half = 1; set = 0; count = 0; slow = 0; turned = 0; low = 0; old = 0; back = 0; mixed = 0; end
         endmodule\n",
        "",
        (400, false),
    );
}

/// A word of a divider that nothing but a register on a clock of the design takes: it has to be that of now there.
#[test]
fn what_a_register_on_a_clock_of_the_design_takes_is_the_word_of_now() {
    same_answers(
        "module t(input clk, input [3:0] a, output reg caught, output reg [4:0] late, output high);
         reg [10:0] count; reg [5:0] turns; reg [4:0] noise; reg [9:0] ramp;
         assign high = ramp[9];
         always @(posedge clk) begin
           count <= count + 3; turns <= turns + 1; noise <= {noise[3:0], noise[4] ^ noise[2]};
           ramp <= ramp + 1 + a[0];
         end
         always @(negedge count[9]) caught <= turns[5];
         always @(posedge count[9]) late <= noise;
         initial begin count = 377; turns = 0; noise = 1; ramp = 0; caught = 0; late = 0; end
         endmodule\n",
        "",
        (400, false),
    );
}

/// Registers that the reset does not set: their outputs are unknown up to the edge at which they are known.
#[test]
fn words_that_nothing_has_set_are_unknown_as_in_verilator() {
    let verilog = "module t(input clk, input rst, input [1:0] a, output reg [3:0] q, output y, output reg [9:0] n);
         reg [3:0] r;
         assign y = ^r;
         always @(posedge clk) begin
           if (a == 2) q <= {q[2:0], a[0]};
           if (a == 1) r <= 5; else if (a == 3) r <= r + 1;
           n <= rst ? 10'd0 : n + 10'd1;
         end
         endmodule\n";
    same_answers(verilog, "reset = { port = \"rst\" }\n", (200, false));
    same_answers(verilog, "reset = { port = \"rst\" }\n", (200, true));
    same_answers(verilog, "reset = { port = \"rst\" }\nregisters = \"zero\"\n", (200, true));
}

/// Verilator runs what Yosys may read otherwise and cannot be written out for it, and the engine's name says why.
#[test]
fn verilog_that_two_tools_may_read_otherwise_does_not_leap() {
    let module = |body: &str| {
        format!(
            "module t(input clk, input [7:0] a, input signed [3:0] s, output reg [7:0] q, output [7:0] y);\n{body}\n\
             endmodule\n"
        )
    };
    let loops = "reg [7:0] m [0:7]; reg [2:0] at; assign y = m[a[2:0]]; always @(posedge clk) q <= y;
         initial for (at = 0; at < 7; at = at + 1) m[at] = {5'd3, at};";
    for (body, why) in [
        (loops, "the variable of the loop `for (at = 0"),
        ("assign y = 0; always @(posedge clk) casez (1'b0) 1'b?: q <= a; default: q <= 1; endcase", "open bits"),
        (
            "reg [7:0] c; assign y = 0; always @(posedge clk) c = a; always @(posedge clk) q <= c;",
            "assigns `c` at once",
        ),
        ("reg [7:0] c; assign y = c; always @(a) c = a + s; always @(posedge clk) q <= a;", "does not wait for it"),
    ] {
        let scene = |engine: &str| around(&module(body), "registers = \"zero\"\n", engine);
        let refused = simulators().build(&scene("leap"), Inside::Nothing).err();
        let said = refused.map(|error| error.to_string()).unwrap_or_default();
        assert!(said.contains(why), "{body}: {said}");
        let engine = built(&scene("auto")).engine().to_string();
        assert!(
            engine.starts_with("Verilator 5") && engine.contains("(no leaps: ") && engine.contains(why),
            "{engine}"
        );
    }
    // These leap as Verilator has read them.
    for body in [
        "assign y = a << s; always @(posedge clk) q <= a;",
        "localparam LEFT = -2; assign y = a >> LEFT; always @(posedge clk) q <= a;",
        "assign y = 0; always @(posedge clk) q[a[2:0]] <= s >>> 1;",
        "assign y = 0; always @(posedge clk) case (s) 4'd1: q <= a; 4'd12: q <= 1; endcase",
        "`ifdef SYNTHESIS\nassign y = a;\n`else\nassign y = 0;\n`endif\nalways @(posedge clk) q <= a;",
        "(* full_case *) wire w; assign y = 0; always @(posedge clk) case (a[1:0]) 1: q <= a; 2: q <= 7; endcase",
    ] {
        same_answers(&module(body), "registers = \"zero\"\n", (300, false));
    }
    // The everyday forms of the same leap.
    for body in [
        "assign y = a >> a[2:0]; always @(posedge clk) q[a[2:0]] <= a[7];",
        "localparam IDLE = 0, RUN = 1; reg [1:0] state; assign y = state;
         always @(posedge clk) case (state) IDLE: if (a[0]) state <= RUN; RUN: begin q <= a; state <= 2; end
         default: state <= IDLE; endcase",
        "integer i; assign y = 0; always @(posedge clk) for (i = 0; i < 8; i = i + 1) q[i] <= a[7 - i] ^ (a > i);",
        "reg [7:0] c; always @* begin c = a; if (s < 0) c = a + 1; end assign y = c; always @(posedge clk) q <= c;",
        "assign y = 0; always @(posedge clk) casez (a[3:0]) 4'b1???: q <= 7; 4'b01??: q <= 6; default: q <= 0; endcase",
        "reg [7:0] t; assign y = 0; always @(posedge clk) begin t = a + 1; q <= t; end",
    ] {
        let engine = built(&around(&module(body), "registers = \"zero\"\n", "auto")).engine().to_string();
        assert!(engine.starts_with("hpu's leaps"), "{body}: {engine}");
    }
}

/// The sign of a parameter's value is kept.
#[test]
fn values_of_parameters_are_those_of_verilator() {
    let verilog =
        "module t #(parameter LIMIT = 5, parameter [3:0] STEP = 1)(input clk, input rst, input signed [7:0] a,
           output reg below, output reg [9:0] n);
         always @(posedge clk) if (rst) begin below <= 0; n <= 0; end
           else begin below <= a < LIMIT; n <= n + {STEP, 1'b1}; end
         endmodule\n";
    for values in ["LIMIT = -12\nSTEP = 9", "LIMIT = 12", "LIMIT = \"8'hf0\"\nSTEP = 17"] {
        same_answers(verilog, &format!("reset = {{ port = \"rst\" }}\n[dut.parameters]\n{values}\n"), (100, true));
    }
}

/// Two clocks of the scene that are slower than its own, with registers on either side, and a reset at once.
#[test]
fn slower_clocks_of_a_scene_answer_as_in_verilator() {
    let verilog = "module t(input clk, input clk_b, input clk_c, input rst, input [7:0] a, output reg [7:0] fast,
           output reg [7:0] slow, output reg [11:0] slower, output [7:0] sum, output reg pulse);
         reg set = 0;
         assign sum = slow + fast;
         always @(posedge clk) if (rst) fast <= 0; else fast <= fast + slow[2:0];
         always @(posedge clk_b or posedge rst) if (rst) slow <= 5; else slow <= slow + {7'b0, fast[0]} + a[0];
         always @(posedge clk_c) if (rst) {slower, pulse} <= 0;
           else begin slower <= slower + 1 + (slow == a); pulse <= slower[5:0] < a[5:0]; set <= ~set; end
         endmodule\n";
    for clocks in ["clk = 1, clk_b = 4, clk_c = 6", "clk_b = 1, clk = 3, clk_c = 1", "clk_c = 1, clk_b = 2, clk = 64"] {
        let of = |engine: &str| around_file(("t.v", verilog), ("t", clocks), "reset = { port = \"rst\" }\n", engine);
        for drives in [false, true] {
            let engine = same_answers_of(&of, "leap", verilog, (400, drives));
            assert!(engine.starts_with("hpu's leaps"), "{engine}");
        }
    }
}

/// Returns Verilog of a design whose counters wait for prescalers, dividers, random bits and clocks that it makes, by a
/// seed.
fn prescaled(seed: u64) -> String {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let mut random = |limit: u64| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 11) % limit
    };
    let (mut declared, mut clocked, mut outputs) = (String::new(), String::new(), String::new());
    let mut enables = vec!["half".to_string()];
    for at in 0..1 + random(2) {
        let last = 1 + random(20);
        let wait = if random(3) == 0 { enables[enables.len() - 1].clone() } else { "1'b1".to_string() };
        let name = format!("p{at}");
        writeln!(declared, "reg [4:0] {name} = 0; wire e{at} = {wait} && {name} == {last};").expect("memory");
        writeln!(clocked, "if ({wait}) {name} <= e{at} ? 0 : {name} + 1;").expect("memory");
        enables.push(format!("e{at}"));
    }
    // A generator of random bits that counters see while a bit of the input is 1, and which another may hold.
    let (top, taps, held) = (2 + random(7), 1 + random(7), ["", "if (!b) ", "if (!a[6]) "][random(3) as usize]);
    writeln!(declared, "reg [{top}:0] r = 1; wire g = r[0] && a[7];").expect("memory");
    writeln!(clocked, "{held}r <= {{r[{}:0], ^(r & {taps}) ^ r[{top}]}};", top - 1).expect("memory");
    enables.push("g".to_string());
    let makes = random(3) == 0;
    let count = 2 + random(3);
    for at in 0..count {
        let (width, step) = (4 + random(9), 1 + random(3));
        let step = match random(5) {
            0 => "a[1:0]".to_string(),
            1 => format!("n{}[1:0]", random(count)),
            2 => "{1'b1, g}".to_string(),
            _ => step.to_string(),
        };
        let (sign, limit) = (["+", "-"][random(2) as usize], random(1 << width.min(8)));
        let limit = if random(2) == 0 { format!("{width}'d{limit}") } else { format!("a[{}:0]", random(8)) };
        let is_it = ["==", "<", ">="][random(3) as usize];
        let wrap = if random(2) == 0 { format!("n{at} == {limit} ? {} : ", random(8)) } else { String::new() };
        let enable = enables[random(enables.len() as u64) as usize].clone();
        writeln!(declared, "reg [{}:0] n{at} = 0; reg o{at} = 0;", width - 1).expect("memory");
        let next = format!("n{at} <= {wrap}n{at} {sign} {step}; o{at} <= n{at} {is_it} {limit};");
        match (makes, random(4)) {
            (true, 0) => {
                writeln!(declared, "always @({} half) begin {next} end", ["posedge", "negedge"][random(2) as usize])
            }
            (_, 1) => {
                writeln!(
                    declared,
                    "always @(posedge clk or posedge b) if (b) n{at} <= 1; else if ({enable}) begin {next} end"
                )
            }
            _ => writeln!(clocked, "if ({enable}) begin {next} end"),
        }
        .expect("memory");
        write!(outputs, ", output [{}:0] y{at}, output z{at}", width - 1).expect("memory");
        writeln!(declared, "assign y{at} = n{at}; assign z{at} = o{at};").expect("memory");
    }
    format!(
        "module t(input clk, input [7:0] a, input b{outputs});\nreg half = 0;\n{declared}always @(posedge clk) begin\n\
         half <= ~half;\n{clocked}end\nendmodule\n"
    )
}

/// Designs at random with prescalers, dividers and clocks of their own; outputs of one bit end the requests.
fn random_prescalers(seeds: std::ops::Range<u64>) {
    let mut leapt = 0;
    for seed in seeds {
        let verilog = prescaled(seed);
        let scene = |engine: &str| around(&verilog, "", engine);
        let [own, other] = ["leap", "verilator"].map(|engine| built(&scene(engine)));
        let ports: Vec<_> = own.ports().iter().filter(|port| port.name != "clk").cloned().collect();
        let drives: Vec<_> = ports.iter().map(|port| port.name.starts_with('z')).collect();
        let [a, b] = ["a", "b"].map(|name| ports.iter().position(|port| port.name == name).expect("a port"));
        let (mut words, mut state) = (vec![0; ports.len()], seed | 1);
        let start = |design: &Arc<dyn Design>| design.start(&words, &drives, &mut Vec::new()).expect("a simulation");
        let mut running = [start(&own), start(&other)];
        let mut longest = 0;
        for request in 0..600u64 {
            state = state.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(0x1405_7b7e_f767_814f);
            if request % 40 == 0 {
                (words[a], words[b]) = (state >> 56, u64::from(state >> 40 & 7 == 0));
            }
            let edges = [7, 300, 5000, 20_000][(state >> 33) as usize % 4];
            let asked = if request % 3 == 0 { Asked::Outputs } else { Asked::Driving };
            let mut changes = [Vec::new(), Vec::new()];
            let done = [0, 1].map(|at| running[at].clock(&words, edges, asked, &mut changes[at]).expect("edges"));
            assert_eq!(done[0], done[1], "seed {seed}, request {request}\n{verilog}");
            assert_eq!(changes[0], changes[1], "seed {seed}, request {request}\n{verilog}");
            longest = longest.max(done[0]);
        }
        leapt += u32::from(longest >= 5000);
    }
    assert!(leapt > 0);
}

#[test]
fn prescalers_at_random_answer_as_in_verilator() {
    random_prescalers(1..5);
}

/// As many as take half an hour.
#[test]
#[ignore = "testbench/long.sh runs it"]
fn many_prescalers_at_random_answer_as_in_verilator() {
    random_prescalers(100..500);
}

/// The words that an observer is shown of each net: its changes, and a number that depends on each of their edges and
/// words (FNV-1a).
#[derive(Default)]
struct Hashed(Vec<(Option<i64>, u64, u64)>);

impl Observe for Hashed {
    fn nets(&mut self, cycle: Cycle, words: &[i64]) {
        self.0.resize(words.len(), (None, 0, 0xcbf2_9ce4_8422_2325));
        for ((last, changes, hash), word) in self.0.iter_mut().zip(words) {
            if *last != Some(*word) {
                (*last, *changes) = (Some(*word), *changes + 1);
                for part in [cycle.0, word.cast_unsigned()] {
                    *hash = (*hash ^ part).wrapping_mul(0x0100_0000_01b3);
                }
            }
        }
    }

    fn reals(&mut self, _: Cycle, _: &[f64]) {}
}

/// Runs a scene whose signals inside are shown. Returns each net with its format, its changes and their hash, and the
/// names of the signals that are not shown.
fn shown_inside(scene: &DutScene) -> (Vec<(String, String)>, u64, Vec<String>) {
    let simulators = simulators();
    let simulation = DutSimulation::new(scene, &simulators, Inside::All).unwrap_or_else(|error| panic!("{error}"));
    let (mut trace, mut hashed) = (simulation.brief_trace(), Hashed::default());
    let ran = simulation.run(true, &mut trace, &mut hashed, &Control::default());
    let summary = ran.unwrap_or_else(|error| panic!("{error}"));
    let used = summary.nets.iter().zip(&hashed.0);
    let told = used.map(|(net, (_, changes, hash))| {
        let range = (net.usage.min, net.usage.max);
        (net.signal.name.to_string(), format!("{} {changes} changes, {hash:016x}, {range:?}", net.signal.format))
    });
    let hidden = simulation.hidden().iter().map(|port| port.name.clone()).collect();
    (told.collect(), hashed.0.iter().map(|net| net.1).sum(), hidden)
}

/// Returns a scene around this project's own VHDL of a wall.
fn hybrid_loop(engine: &str) -> DutScene {
    let names = "hybrid_loop command_limiter displacement position_counter pwm quadrature_decoder synchronizer \
                 torque_sum truncating_multiplier unilateral velocity_register rounding_pkg";
    let files: Vec<_> = names.split(' ').map(|name| format!("\"{name}.vhd\"")).collect();
    let text = format!(
        "about = \"a wall\"\ndevice = {{ kind = \"motor\", motor = \"vasudevan_2007\", wheel_ratio = 7 }}\n\
         clock = {{ frequency = \"50 MHz\" }}\nrun = {{ duration = \"20 ms\" }}\n\
         hand = {{ kind = \"spring_damper\", stiffness = \"0.3 N.m/rad\", damping = 0, \
         path = [[0, 0], [0.01, 0.3]] }}\n[dut]\nfiles = [{}]\ntop = \"hybrid_loop\"\nclock = \"clk\"\n\
         reset = {{ port = \"rst\" }}\n\
         engine = \"{engine}\"\n[dut.ports]\na_pin = \"encoder.a\"\nb_pin = \"encoder.b\"\nreference = 5\n\
         stiffness = 18\ndamping = 3\nperiod = 5000\nscale = 256\na_high = \"bridge.plus_high\"\n\
         a_low = \"bridge.plus_low\"\nb_high = \"bridge.minus_high\"\nb_low = \"bridge.minus_low\"\n",
        files.join(", ")
    );
    let file = SceneFile { name: "t.toml".to_string(), text, data: root().join("hdl"), is_shipped: false };
    match file.parse(&[]).unwrap_or_else(|error| panic!("{error}")) {
        Experiment::Dut(scene) => scene,
        _ => panic!("a design"),
    }
}

/// Waves of signals inside have every word at every edge that Verilator's have, under the same names and formats; of
/// the counters too, which end no jump. What the netlist has not is hidden. Ranges are those of Verilator.
#[test]
fn signals_inside_have_the_words_of_verilator_at_every_edge() {
    let near = ("position = \"1.5 rad\"", "position = \"0.05 rad\"");
    let brief = |path: &'static str| [near, ("duration = \"1 s\"", "duration = \"30 ms\""), (path, "\"20 ms\", 0.3]")];
    let knob = [("800 ms", "2 ms"), ("[\"50 ms\", 0], [\"450 ms\", 0.6]", "[0, 0], [0.002, 0.1]")];
    for (name, changes, least, lost) in [
        ("knee", &brief("\"150 ms\", 1.4]")[..], 300_000, 0),
        ("rim", &brief("\"150 ms\", 1.4]"), 300_000, 0),
        ("foc-knob", &knob, 100_000, 20),
        ("hybrid_loop", &[], 1_000_000, 6),
    ] {
        let of = |engine: &str| match name {
            "hybrid_loop" => hybrid_loop(engine),
            _ => scene(name, changes, engine),
        };
        let (own, changed, hidden) = shown_inside(&of("leap"));
        let (others, _, known) = shown_inside(&of("verilator"));
        assert!(changed > least, "{name}: {changed} changes");
        assert_eq!(others.len() - own.len(), lost, "{name}");
        let (mut left, mut missing) = (own.iter(), Vec::new());
        let mut next = left.next();
        for other in &others {
            match next {
                Some(own) if own.0 == other.0 => {
                    assert_eq!(own, other, "{name}");
                    next = left.next();
                }
                _ => missing.push(&other.0),
            }
        }
        assert!(next.is_none(), "{name}: {next:?}");
        assert!(missing.iter().all(|name| hidden.contains(name) && !known.contains(name)), "{name}: {missing:?}");
    }
}

/// A state that is told to come back, of the registers that matter and of the device, to the last bit: in Verilator the
/// words of all ports repeat from there on with that period.
#[test]
fn a_state_that_comes_back_repeats_in_verilator() {
    // The modulators have 1023 and 1024 clocks a period; the speeds, on which the outputs depend, have their own.
    for (name, longest) in [("knee", 2_046_000), ("rim", 384_000)] {
        let (scene_by_leaps, simulators) = (scene(name, &[], "auto"), simulators());
        let simulation = DutSimulation::new(&scene_by_leaps, &simulators, Inside::Nothing);
        let simulation = simulation.unwrap_or_else(|error| panic!("{error}"));
        let beyond = Beyond {
            edges: 100_000_000,
            live: &|_, _, wanted| wanted,
            prove: &|_| Err("nothing is proved here".to_string()),
            until_read: &|_| Err("nothing is proved here".to_string()),
            window: &|_| Err("nothing is proved here".to_string()),
            follow: &|_| Err("nothing is proved here"),
            words: &|_| Err("no words".to_string()),
        };
        let (mut trace, control) = (simulation.brief_trace(), Control::default());
        let summary = simulation.run_beyond(false, &mut trace, &mut (), &control, Some(&beyond)).expect("a run");
        let Some(Ok(Forever::Recurs { recurrence, .. })) = summary.forever else { panic!("{:?}", summary.forever) };
        assert!(recurrence.from >= summary.edges && recurrence.period <= longest, "{name}: {recurrence:?}");
        let mut longer = scene(name, &[], "verilator");
        let end = recurrence.from + (80_000 / recurrence.period).max(2) * recurrence.period;
        longer.head.run.duration_s = end as f64 * longer.clock.period_s();
        let (shown, ..) = ran(&longer);
        let period = recurrence.period;
        let later: Vec<_> = shown.0.iter().filter(|(edge, _)| *edge > recurrence.from && *edge < end).collect();
        let first = later.iter().filter(|(edge, _)| *edge <= recurrence.from + period).count();
        assert!(first >= 2, "{name}: {first} changes a period");
        for (now, then) in later[first..].iter().zip(&later) {
            assert_eq!((now.0 - period, &now.1), (then.0, &then.1), "{name}");
        }
    }
}
