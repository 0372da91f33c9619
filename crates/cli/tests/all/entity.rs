//! Blocks by others, written from a data sheet alone, compared with ours: `testbench/dut/blocks` and the blocks below.

use std::fs;
use std::path::Path;
use std::process::Output;

use crate::common::{ROOT, assert_refused, code, json, run, scratch, stderr, stdout, text};

const VELOCITY: [&str; 14] = [
    "--as=velocity_register",
    "--entity=my_vel",
    "--port=pos_i=position",
    "--port=every_i=period",
    "--port=vel_o=velocity",
    "--generic=W=WIDTH",
    "--generic=T=PERIOD_WIDTH",
    "--clock=ck_i",
    "--reset=nrst_i=low",
    "--standard=93",
    "--set=OUT_WIDTH=12",
    "--set=WIDTH=12",
    "--latency=0",
    "--library=work",
];
const PRODUCT: [&str; 9] = [
    "--as=truncating_multiplier",
    "--entity=fast_mul",
    "--port=x=a",
    "--port=y=b",
    "--port=p=product",
    "--generic=N=A_WIDTH",
    "--generic=KEEP=OUT_WIDTH",
    "--generic=SATURATING=SATURATE",
    "--clock=clock",
];
/// Their registers that equal registers of ours.
const VELOCITY_STATE: [&str; 2] = ["--state=last=previous", "--state=left=countdown"];
const DECODER_STATE: [&str; 2] = ["--state=was=previous", "--state=wait_for=settling"];
const DECODER: [&str; 9] = [
    "--as=quadrature_decoder",
    "--entity=quad_x4",
    "--port=ch_a=a",
    "--port=ch_b=b",
    "--port=move=step",
    "--port=lost=error",
    "--generic=WAIT=SETTLE",
    "--clock=c",
    "--reset=clear",
];

fn refused(output: &Output, expected: i32, says: &str) {
    assert_refused(output, expected, &[says]);
}

fn shipped(file: &str) -> String {
    fs::read_to_string(Path::new(ROOT).join("testbench/dut/blocks").join(file)).expect("a file")
}

/// Returns the exit code and the report of a check of this HDL.
fn checked(dir: &Path, file: &str, hdl: &str, args: &[&str]) -> (i32, serde_json::Value) {
    let path = dir.join(file);
    fs::write(&path, hdl).expect("a file");
    let output = run(&[&["check", "--json"], args, &[text(&path)]].concat());
    let ended = code(&output);
    assert!(ended <= 1, "{}", stderr(&output));
    (ended, json(&output))
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn blocks_that_follow_a_data_sheet_are_equal_in_every_configuration_that_they_have() {
    let dir = scratch("equal_blocks");
    let variants = |value: &serde_json::Value| {
        let rows = value["blocks"][0]["variants"].as_array().expect("variants");
        rows.iter().map(|row| row["name"].as_str().expect("a name").to_string()).collect::<Vec<_>>()
    };
    let (ended, value) = checked(&dir, "my_vel.vhd", &shipped("my_vel.vhd"), &VELOCITY);
    assert_eq!((ended, variants(&value)), (0, vec!["OUT_WIDTH=12,WIDTH=12".to_string()]), "{value}");
    // A width that is in no listed configuration.
    let odd = VELOCITY.map(|arg| arg.replace("WIDTH=12", "WIDTH=19"));
    let odd: Vec<_> = odd.iter().map(String::as_str).collect();
    assert_eq!(checked(&dir, "my_vel.vhd", &shipped("my_vel.vhd"), &odd).0, 0);
    // Two clocks later, in every listed configuration of unsigned factors whose lower bits are kept.
    let (ended, value) =
        checked(&dir, "fast_mul.vhd", &shipped("fast_mul.vhd"), &[&PRODUCT[..], &["--latency=2"]].concat());
    assert_eq!((ended, variants(&value)), (0, vec!["default".into(), "full".into(), "drop_upper".into()]), "{value}");
    assert!(value["vectors"].is_null() && value["blocks"][0]["vectors"].as_u64() > Some(1 << 16), "{value}");
    let (ended, value) = checked(&dir, "quad_x4.v", &shipped("quad_x4.v"), &DECODER);
    assert_eq!((ended, variants(&value)), (0, vec!["default".into(), "settle_0".into()]), "{value}");
    assert!(value["hdl"].as_str().expect("a text").starts_with("Verilator"), "{value}");
}

/// Errors for each of the three blocks: the text that is replaced, and its replacement.
type Errors = &'static [(&'static str, &'static str)];
const VELOCITY_ERRORS: Errors = &[
    ("every_i > 1", "every_i > 2"),
    ("pos_i - last", "last - pos_i"),
    ("        last  <= pos_i;\n", ""),
    ("      vel_o <= (others => '0');\n", ""),
];
const PRODUCT_ERRORS: Errors = &[("if SATURATING", "if not SATURATING"), ("(full, KEEP)", "(full + 1, KEEP)")];
const DECODER_ERRORS: Errors = &[
    ("4'b0001, 4'b0111", "4'b0010, 4'b0111"),
    ("wait_for <= WAIT", "wait_for <= WAIT + 1"),
    (" 4'b0110, 4'b1001", " 4'b0110"),
];

#[test]
#[ignore = "testbench/long.sh runs it"]
fn each_error_that_is_sown_is_found_in_the_signal_that_it_spoils() {
    let dir = scratch("sown_blocks");
    let one = [&DECODER[..], &["--variant=default"]].concat();
    let latency = [&PRODUCT[..], &["--variant=default", "--latency=2"]].concat();
    let finds = |file: &str, args: &[&str], errors: Errors, signals: &[&str]| {
        for (right, wrong) in errors {
            let hdl = shipped(file);
            assert_eq!(hdl.matches(right).count(), 1, "{file}: {right}");
            let (ended, value) = checked(&dir, file, &hdl.replace(right, wrong), args);
            let first = &value["blocks"][0]["variants"][0]["first"];
            let signal = first["signal"].as_str().unwrap_or_else(|| panic!("{file} with {wrong}: {value}"));
            let found = signals.iter().any(|name| signal.starts_with(name));
            assert!(ended == 1 && found && first["expected"] != first["got"], "{file} with {wrong}: {first}");
        }
    };
    finds("my_vel.vhd", &VELOCITY, VELOCITY_ERRORS, &["velocity"]);
    finds("fast_mul.vhd", &latency, PRODUCT_ERRORS, &["product"]);
    finds("quad_x4.v", &one, DECODER_ERRORS, &["step", "error"]);
    // A latency that is not theirs is also an error.
    let early = [&PRODUCT[..], &["--variant=default", "--latency=1"]].concat();
    assert_eq!(checked(&dir, "fast_mul.vhd", &shipped("fast_mul.vhd"), &early).0, 1);
    // The report shows the rows before the mismatch, and a waveform of them.
    let hdl = dir.join("my_vel.vhd");
    fs::write(&hdl, shipped("my_vel.vhd").replace("every_i > 1", "every_i > 2")).expect("a file");
    let out = dir.join("out");
    let output = run(&[&["check"], &VELOCITY[..], &["-o", text(&out), text(&hdl)]].concat());
    let said = stdout(&output);
    assert!(said.contains("velocity (their vel_o) expected") && said.contains("velocity(vhdl)"), "{said}");
    let vcd = fs::read_to_string(out.join("my_vel-OUT_WIDTH=12,WIDTH=12.vcd")).expect("a waveform");
    assert!(vcd.contains("$var") && vcd.contains("velocity"), "{vcd}");
}

/// Tries to prove this HDL. Returns the exit code, the verdict in each configuration, and the whole report.
fn proved(dir: &Path, file: &str, hdl: &str, args: &[&[&str]]) -> (i32, Vec<String>, serde_json::Value) {
    let (ended, value) = checked(dir, file, hdl, &[&["--formal"], &args.concat()[..]].concat());
    let rows = value["rows"].as_array().expect("rows");
    let verdicts = rows.iter().map(|row| row["verdict"].as_str().expect("a verdict").to_string()).collect();
    (ended, verdicts, value)
}

#[test]
fn blocks_of_somebody_else_s_are_proved_for_all_inputs_and_states() {
    let dir = scratch("proved_blocks");
    let proves = |file: &str, args: &[&[&str]], expected: &[&str]| {
        let (ended, verdicts, value) = proved(&dir, file, &shipped(file), args);
        assert_eq!(verdicts, expected, "{value}");
        assert_eq!(ended == 0, expected.iter().all(|verdict| *verdict == "proved"), "{value}");
        value
    };
    proves("my_vel.vhd", &[&VELOCITY, &VELOCITY_STATE], &["proved"]);
    // This is a pipeline, and our block has no registers, so its states need no description.
    proves("fast_mul.vhd", &[&PRODUCT, &["--latency=2"]], &["proved"; 3]);
    // Without a pause its counter is not needed, but the proof must be told that the counter stays 0.
    let decoder = [&DECODER[..], &DECODER_STATE];
    proves("quad_x4.v", &[&DECODER, &DECODER_STATE, &["--variant=default"]], &["proved"]);
    let still = [&["--variant=settle_0"][..], &decoder.concat()].concat();
    proves("quad_x4.v", &[&still, &["--invariant=wait_for == 0"]], &["proved"]);
    // The block is neither proved nor refuted, and the report names the unknown register.
    let value = proves("quad_x4.v", &[&still], &["open"]);
    let why = value["rows"][0]["why"].as_str().expect("a reason");
    for part in
        ["from a state that it need not come to", "of `quad_x4`, that it does not name: wait_for", "--invariant"]
    {
        assert!(why.contains(part), "{why}");
    }
    let value = proves("my_vel.vhd", &[&VELOCITY, &VELOCITY_STATE[..1]], &["open"]);
    let why = value["rows"][0]["why"].as_str().expect("a reason");
    assert!(why.contains("registers of velocity_register that --state names none for: countdown;"), "{why}");
    // An invariant that does not hold proves nothing.
    let value = proves("quad_x4.v", &[&still, &["--invariant=wait_for == 1"]], &["open"]);
    assert!(value["rows"][0]["why"].as_str().is_some_and(|why| why.contains("invariant")), "{value}");
    // A latency that is not theirs is refuted, without an assumption about states.
    assert_eq!(proved(&dir, "fast_mul.vhd", &shipped("fast_mul.vhd"), &[&PRODUCT, &["--latency=3"]]).1, ["refuted"; 3]);
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn each_error_that_is_sown_is_refuted_by_edges_from_the_reset() {
    let dir = scratch("refuted_blocks");
    let refutes = |file: &str, args: &[&[&str]], errors: &[(&str, &str)], signals: &[&str]| {
        for (right, wrong) in errors {
            let (ended, verdicts, value) = proved(&dir, file, &shipped(file).replace(right, wrong), args);
            assert!(ended == 1 && verdicts[0] == "refuted", "{file} with {wrong}: {value}");
            let why = &value["rows"][0]["why"];
            let about = why["about"].as_str().expect("what was asked");
            assert!(about.contains("edge"), "{about}");
            let columns = why["columns"].as_array().expect("columns");
            let found = columns.iter().any(|column| {
                let name = column.as_str().expect("a name");
                signals.iter().any(|signal| name == format!("{signal}(vhdl)"))
            });
            assert!(found, "{file} with {wrong}: {why}");
        }
    };
    let [first, swapped, held, forgotten] = *VELOCITY_ERRORS else { panic!("four errors") };
    refutes("my_vel.vhd", &[&VELOCITY, &VELOCITY_STATE], &[first, swapped, forgotten], &["velocity"]);
    // A register that only an asynchronous reset sets is a latch, which synthesis refuses.
    fs::write(dir.join("my_vel.vhd"), shipped("my_vel.vhd").replace(held.0, held.1)).expect("a file");
    let file = dir.join("my_vel.vhd");
    let output = run(&[&["check", "--formal"], &VELOCITY[..], &VELOCITY_STATE, &[text(&file)]].concat());
    refused(&output, 1, "latch");
    refutes("fast_mul.vhd", &[&PRODUCT, &["--latency=2"]], PRODUCT_ERRORS, &["product"]);
    refutes("quad_x4.v", &[&DECODER, &DECODER_STATE, &["--variant=default"]], DECODER_ERRORS, &["step", "error"]);
    // One pair of words of 2^24 is wrong. Rows of vectors need not contain it.
    let hdl = shipped("fast_mul.vhd")
        .replace("full <= x * y;", "full <= x * y; if x = 2741 and y = 1003 then full <= (others => '0'); end if;");
    let (ended, verdicts, value) = proved(&dir, "fast_mul.vhd", &hdl, &[&PRODUCT, &["--latency=2", "--variant=full"]]);
    assert_eq!((ended, &verdicts[..]), (1, &["refuted".to_string()][..]), "{value}");
    assert!(value["rows"][0]["why"]["history"][0].as_array().is_some_and(|row| row.iter().any(|word| word == "ab5")));
    // Ours is clocked by the rising edge.
    let other = shipped("my_vel.vhd").replace("ck_i'event and ck_i = '1'", "ck_i'event and ck_i = '0'");
    let (ended, verdicts, value) = proved(&dir, "my_vel.vhd", &other, &[&VELOCITY, &VELOCITY_STATE]);
    assert_eq!((ended, &verdicts[..]), (1, &["refused".to_string()][..]), "{value}");
    let why = value["rows"][0]["why"].as_str().expect("a reason");
    assert!(why.ends_with("is clocked by the falling edge of ck_i, not by its rising edge"), "{why}");
}

#[test]
fn what_a_proof_of_somebody_else_s_block_cannot_take_is_refused() {
    let file = "testbench/dut/blocks/quad_x4.v";
    let base = [&["check", "--formal", file], &DECODER[..]].concat();
    refused(
        &run(&[&base[..], &["--state=wos=previous"]].concat()),
        2,
        "`quad_x4` has no register or signal `wos`; lost, move, wait_for, was",
    );
    refused(
        &run(&[&base[..], &["--state=was=before"]].concat()),
        2,
        "quadrature_decoder has no register `before`; error, previous, settling, step",
    );
    refused(
        &run(&[&base[..], &["--invariant=waitfor == 0"]].concat()),
        1,
        "Identifier `\\waitfor' is implicitly declared",
    );
    refused(&run(&["check", "--state=a=b", "displacement"]), 2, "--entity");
    let dir = scratch("two_clocks");
    let hdl = shipped("quad_x4.v")
        .replace("always @(posedge c)\n", "reg other; always @(posedge ch_a) other <= ch_b;\n  always @(posedge c)\n");
    let hdl = hdl.replace("{was, ch_a, ch_b}", "{was, ch_a, ch_b ^ other}");
    let (ended, verdicts, value) = proved(&dir, "quad_x4.v", &hdl, &[&DECODER, &DECODER_STATE, &["--variant=default"]]);
    assert_eq!((ended, &verdicts[..]), (1, &["refused".to_string()][..]), "{value}");
    assert_eq!(value["rows"][0]["why"], "register other is clocked by ch_a, not by c itself");
    let hdl = shipped("quad_x4.v")
        .replace("always @(posedge c)\n", "reg other; always @(negedge c) other <= ch_b;\n  always @(posedge c)\n");
    let hdl = hdl.replace("{was, ch_a, ch_b}", "{was, ch_a, ch_b ^ other}");
    let (_, _, value) = proved(&dir, "quad_x4.v", &hdl, &[&DECODER, &DECODER_STATE, &["--variant=default"]]);
    let why = "register other is clocked by the falling edge of c, not by its rising edge";
    assert_eq!(value["rows"][0]["why"], why);
}

/// Returns a unilateral wall in Verilog with this body.
fn wall(body: &str) -> String {
    format!(
        "module wall #(parameter W = 12) (input [W-1:0] delta, output contact, output [W-1:0] penetration);\n  \
         wire [W-1:0] p = delta[W-1] ? {{W{{1'b0}}}} : delta;\n  wire least = delta == {{1'b1, {{(W-1){{1'b0}}}}}};\n  \
         {body}\nendmodule\n"
    )
}

const WALL: [&str; 4] = ["--as=unilateral", "--entity=wall", "--generic=W=WIDTH", "--variant=default"];

/// Walls that are right but for X and Z, each with the signal that is unknown.
const UNKNOWN: [(&str, &str, &str); 11] = [
    ("z", "penetration", "assign contact = ~delta[W-1]; assign penetration = least ? {W{1'bz}} : p;"),
    ("x", "penetration", "assign contact = ~delta[W-1]; assign penetration = least ? {W{1'bx}} : p;"),
    ("one bit of x", "contact", "assign contact = least ? 1'bx : ~delta[W-1]; assign penetration = p;"),
    (
        "z in a process",
        "penetration",
        "assign contact = ~delta[W-1]; reg [W-1:0] q; assign penetration = q; always @* q = least ? 'bz : p;",
    ),
    // This bit is always 0, as in a simulator that knows 0 and 1 only.
    ("an undriven bit", "penetration", "assign contact = ~delta[W-1]; assign penetration[W-2:0] = p[W-2:0];"),
    ("an undriven output", "contact", "assign penetration = p;"),
    ("a read of nothing", "penetration", "assign contact = ~delta[W-1]; wire [W-1:0] n; assign penetration = p | n;"),
    (
        "z inside",
        "penetration",
        "wire n; assign n = least ? 1'bz : 1'b0; assign contact = ~delta[W-1]; assign penetration = p | n;",
    ),
    // Where a solver's shift gives 0, Verilog gives X.
    (
        "a bit beside the word",
        "contact",
        "wire [4:0] t = {5{~delta[W-1]}}; assign contact = t[delta[W-1] ? delta[2:0] : 3'd0]; assign penetration = p;",
    ),
    (
        "a remainder by 0",
        "penetration",
        "assign contact = ~delta[W-1]; wire [W-1:0] one = least ? 0 : 1; assign penetration = p % one | p;",
    ),
    ("a choice by X", "penetration", "assign contact = ~delta[W-1]; assign penetration = delta == 'bx ? 5 : p;"),
];

#[test]
fn parts_of_ports_are_compared_and_their_errors_found() {
    let dir = scratch("packed_blocks");
    let hdl = shipped("quad_x4.v")
        + "module packed_x4 #(parameter WAIT = 3) (input c, clear, input [3:0] pins, output [7:0] told);
             wire [1:0] move; wire lost; assign told = {3'b101, move, ~lost, lost, 1'b0};
             quad_x4 #(.WAIT(WAIT)) u (.c(c), .clear(clear), .ch_a(pins[2]), .ch_b(pins[1]), .move(move), .lost(lost));
           endmodule\n";
    let parts = [
        "--as=quadrature_decoder",
        "--entity=packed_x4",
        "--port=pins[2]=a",
        "--port=pins[1]=b",
        "--port=pins[0]=1",
        "--port=pins[3]=0",
        "--port=told[4:3]=step",
        "--port=told(1)=error",
        "--generic=WAIT=SETTLE",
        "--clock=c",
        "--reset=clear",
        "--variant=default",
    ];
    let (ended, value) = checked(&dir, "packed.v", &hdl, &parts);
    assert_eq!((ended, &value["blocks"][0]["variants"][0]["first"]), (0, &serde_json::Value::Null), "{value}");
    let swapped = parts.map(|arg| arg.replace("pins[2]=a", "pins[1]=a").replace("pins[1]=b", "pins[2]=b"));
    let swapped: Vec<_> = swapped.iter().map(String::as_str).collect();
    assert_eq!(checked(&dir, "packed.v", &hdl, &swapped).0, 1, "the lines are swapped");
    let inverted = parts.map(|arg| if arg == "--port=told(1)=error" { "--port=told[2]=error" } else { arg });
    let (ended, value) = checked(&dir, "packed.v", &hdl, &inverted);
    let signal = value["blocks"][0]["variants"][0]["first"]["signal"].as_str().expect("a difference");
    assert_eq!((ended, signal), (1, "error (their told[2])"));
    let path = dir.join("packed.v");
    let with = |from: &str, to: &str| {
        let args: Vec<_> =
            parts.iter().map(|arg| if *arg == from { to } else { arg }).filter(|arg| !arg.is_empty()).collect();
        run(&[&["check"], &args[..], &[text(&path)]].concat())
    };
    refused(&with("--port=pins[3]=0", "--port=pins[1]=0"), 2, "some bits of `pins` are connected twice");
    refused(&with("--port=pins[3]=0", ""), 2, "not all bits of input `pins` are connected");
    refused(&with("--port=pins[3]=0", "--port=pins[4]=0"), 2, "`pins` of `packed_x4` is [3:0]");
    let output = with("--variant=default", "--formal");
    assert!((stdout(&output) + &stderr(&output)).contains("is a part of a port, which is compared by vectors alone"));
    // An index is that of the design. Its left bit is the highest one.
    let ascends = "library ieee; use ieee.std_logic_1164.all;
entity ascends is port (delta : in std_logic_vector(1 to 12); told : out std_logic_vector(0 to 12)); end;
architecture r of ascends is begin
  told(0) <= not delta(1); told(1 to 12) <= delta when delta(1) = '0' else (others => '0');
end;\n";
    let parts = ["--port=told(0)=contact", "--port=told(1 to 12)=penetration", "--port=delta(1 to 12)=delta"];
    let args = ["--as=unilateral", "--entity=ascends", "--variant=default", parts[0], parts[1], parts[2]];
    let (ended, value) = checked(&dir, "ascends.vhd", ascends, &args);
    assert_eq!((ended, &value["blocks"][0]["variants"][0]["first"]), (0, &serde_json::Value::Null), "{value}");
    let (ended, value) = checked(&dir, "ascends.vhd", &ascends.replace("not delta(1)", "not delta(12)"), &args);
    let signal = value["blocks"][0]["variants"][0]["first"]["signal"].as_str().expect("a difference");
    assert_eq!((ended, signal), (1, "contact (their told[0])"));
}

/// Proves that each of these walls may be unknown, and finds it by vectors in every `nth` of them.
fn tell_unknown(folder: &str, nth: usize) {
    let dir = scratch(folder);
    let right = wall("assign contact = ~delta[W-1]; assign penetration = p;");
    assert_eq!(proved(&dir, "wall.v", &right, &[&WALL]).1, ["proved"]);
    let (ended, value) = checked(&dir, "wall.v", &right, &WALL);
    assert_eq!(ended, 0, "{value}");
    let engine = value["hdl"].as_str().expect("a text");
    assert!(engine.starts_with("Verilator") && engine.contains(" and Icarus Verilog"), "{engine}");
    for (index, (what, signal, body)) in UNKNOWN.into_iter().enumerate() {
        let (ended, verdicts, value) = proved(&dir, "wall.v", &wall(body), &[&WALL]);
        assert_eq!((ended, &verdicts[..]), (1, &["refuted".to_string()][..]), "{what}: {value}");
        let about = value["rows"][0]["why"]["about"].as_str().expect("what was asked");
        let says = format!("its inputs, where output {signal} is unknown (X, Z or driven by nothing)");
        assert_eq!(about, says, "{what}");
        if !index.is_multiple_of(nth) {
            continue;
        }
        let (ended, value) = checked(&dir, "wall.v", &wall(body), &WALL);
        let first = &value["blocks"][0]["variants"][0]["first"];
        let is_unknown = first["got"].as_str().is_some_and(|got| got.starts_with("unknown bits"));
        assert!(ended == 1 && first["signal"] == signal && is_unknown, "{what}: {value}");
    }
}

/// A check by vectors builds a wall for two simulators, so it is of every sixth wall here.
#[test]
#[ignore = "testbench/long.sh runs it"]
fn an_output_that_may_be_unknown_is_no_more_equal_by_vectors_than_by_a_proof() {
    tell_unknown("unknown_blocks", 6);
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn no_output_that_may_be_unknown_is_equal_by_vectors_or_by_a_proof() {
    tell_unknown("all_unknown_blocks", 1);
}

#[test]
fn latches_drivers_that_fight_and_assumptions_of_theirs_are_not_proved() {
    let dir = scratch("unfit_blocks");
    let refuses = |body: &str, says: &str| {
        let (ended, verdicts, value) = proved(&dir, "wall.v", &wall(body), &[&WALL]);
        assert_eq!((ended, &verdicts[..]), (1, &["refused".to_string()][..]), "{body}: {value}");
        let why = value["rows"][0]["why"].as_str().expect("a reason");
        assert!(why.contains(says), "{body}: {why}");
    };
    let latch = "assign contact = ~delta[W-1]; reg [W-1:0] q; assign penetration = q; always @* if (!least) q = p;";
    refuses(latch, "latch q changes between clock edges");
    assert_eq!(checked(&dir, "wall.v", &wall(latch), &WALL).0, 1);
    refuses(
        "assign contact = ~delta[W-1]; assign penetration = p; assign penetration[0] = p[0] | least;",
        "drive the same net: where they differ, it is unknown (X)",
    );
    // Two gates that hold each other, and a choice that holds itself.
    refuses(
        "wire n; nor a(contact, delta[W-1], n); nor b(n, ~delta[W-1], contact); assign penetration = p;",
        "is made of itself through logic ($not, $or) and no register, as a latch is",
    );
    refuses(
        "assign contact = ~delta[W-1]; wire [W-1:0] own = least ? own : p; assign penetration = own;",
        "net own is made of itself through logic ($mux) and no register, as a latch is",
    );
    refuses(
        "assign contact = ~delta[W-1]; wire n; assign penetration = n === 1'bx ? 5 : p;",
        "logic asks whether a net is X or Z that may be X or Z",
    );
    // Both buffers drive the bus, or none does.
    for (one, other) in [("least | ~delta[W-1]", "delta[W-1]"), ("~delta[W-1]", "delta[W-1] & ~least")] {
        let bus = format!(
            "assign contact = ~delta[W-1]; tri [W-1:0] bus; assign bus = ({one}) ? delta : {{W{{1'bz}}}}; \
             assign bus = ({other}) ? {{W{{1'b0}}}} : {{W{{1'bz}}}}; assign penetration = bus;"
        );
        let (ended, verdicts, value) = proved(&dir, "wall.v", &wall(&bus), &[&WALL]);
        assert_eq!((ended, &verdicts[..]), (1, &["refuted".to_string()][..]), "{bus}: {value}");
    }
    // Synthesis may take any of the choices that this promises not to make at once.
    let parallel = "assign contact = ~delta[W-1]; reg [W-1:0] q; assign penetration = q; \
                    always @* (* parallel_case *) casez (delta) 12'b1???????????: q = 0; \
                    12'b???????????1: q = {delta[W-1:1], 1'b1}; default: q = delta; endcase";
    assert_eq!(proved(&dir, "wall.v", &wall(parallel), &[&WALL]).1, ["refuted"]);
    // What theirs assumes of its inputs would be assumed of all inputs.
    let assumes = "assign contact = ~delta[W-1]; assign penetration = least ? 1 : p; always @* assume (!least);";
    fs::write(dir.join("wall.v"), wall(assumes)).expect("a file");
    let output = run(&[&["check", "--formal"], &WALL[..], &[text(&dir.join("wall.v"))]].concat());
    assert!(code(&output) != 0, "{}", stdout(&output));
    assert!(format!("{}{}", stdout(&output), stderr(&output)).contains("has the type $assume, which no proof knows"));
}

/// Walls that are right although they name X or Z, or make a word of its own other bits.
const RIGHT: [&str; 5] = [
    "assign penetration = ^delta === 1'bx ? 5 : delta[0] !== 1'bz ? p : 6;",
    "reg [W-1:0] q; assign penetration = q; \
     always @* casez (delta) 12'bx00000000001: q = 5; 12'b1zzzzzzzzzzz: q = 0; default: q = delta; endcase",
    // A bus inside, which one of two buffers drives.
    "tri [W-1:0] bus; assign bus = delta[W-1] ? {W{1'b0}} : {W{1'bz}}; assign bus = delta[W-1] ? {W{1'bz}} : delta; \
     assign penetration = bus;",
    // Gray code and back, once by a shift.
    "wire [W-1:0] gray = p ^ (p >> 1), once, again; assign once = gray ^ {1'b0, once[W-1:1]}; \
     assign again = gray ^ (again >> 1); assign penetration = once & again;",
    // A carry through a word.
    "wire [W:0] sum; assign sum = {1'b0, p} + {1'b0, sum[W-2:0] & 11'd0, 1'b0}; assign penetration = sum[W-1:0];",
];

#[test]
fn walls_that_name_x_or_z_or_make_a_word_of_its_own_bits_are_proved_where_they_are_right() {
    let dir = scratch("right_blocks");
    for body in RIGHT {
        let body = format!("assign contact = ~delta[W-1]; {body}");
        assert_eq!(proved(&dir, "wall.v", &wall(&body), &[&WALL]).1, ["proved"], "{body}");
    }
}

/// A position counter in Verilog with this clocked statement.
fn counter(always: &str) -> String {
    format!(
        "module counter #(parameter W = 12) (input clk, rst, input [1:0] step, output reg [W-1:0] position);\n  \
         wire [W-1:0] next = position + {{{{(W-2){{step[1]}}}}, step}};\n  {always}\nendmodule\n"
    )
}

#[test]
fn a_counter_of_somebody_else_s_is_proved_on_the_rising_edge_of_the_clock_itself_alone() {
    let dir = scratch("clocked_blocks");
    let args = ["--as=position_counter", "--entity=counter", "--generic=W=WIDTH", "--variant=default"];
    let says = |always: &str| {
        let (ended, verdicts, value) = proved(&dir, "counter.v", &counter(always), &[&args]);
        let why = value["rows"][0]["why"].as_str().unwrap_or_default();
        assert_eq!(ended == 0, verdicts == ["proved"], "{value}");
        format!("{} {why}", verdicts[0])
    };
    let clocked = |by: &str| format!("always @({by}) if (rst) position <= 0; else position <= next;");
    assert_eq!(says(&clocked("posedge clk")), "proved ");
    for clock in ["wire c = clk;", "wire c = +clk;", "wire n, c; buf one(n, clk); buf other(c, n);"] {
        assert_eq!(says(&format!("{clock} {}", clocked("posedge c"))), "proved ");
    }
    let falls = "refused register position is clocked by the falling edge of clk, not by its rising edge";
    assert_eq!(says(&clocked("negedge clk")), falls);
    let guarded = "always @(posedge clk) if (rst) position <= 0; else position <= ^position === 1'bx ? 7 : next;";
    assert_eq!(says(guarded), "proved ");
    for (wires, by) in [("wire c = clk & step[0];", "$and"), ("wire n = ~clk; wire c = ~n;", "$not")] {
        let expected = format!("refused register position is clocked by logic ({by}), not by clk itself");
        assert_eq!(says(&format!("{wires} {}", clocked("posedge c"))), expected);
    }
    let data = "refused register position is clocked by step[0], not by clk itself";
    assert_eq!(says(&clocked("posedge step[0]")), data);
    let at_once = "its reset acts at once: equal outside resets, if each of them lasts over a clock edge";
    assert_eq!(says(&clocked("posedge clk or posedge rst")), format!("proved {at_once}"));
    let set = "always @(posedge clk or posedge step[0]) if (step[0]) position <= 0; else position <= next;";
    assert_eq!(says(set), "refused register position is set or reset at once by step[0], not at clock edges");
}

#[test]
fn an_output_that_nobody_has_set_is_told_as_unknown() {
    let dir = scratch("unset_block");
    let hdl =
        shipped("my_vel.vhd").replace("vel_o <= pos_i - last", "if every_i /= 7 then vel_o <= pos_i - last; end if");
    let hdl = hdl.replace("      vel_o <= (others => '0');\n", "");
    let (ended, value) = checked(&dir, "my_vel.vhd", &hdl, &VELOCITY);
    let first = &value["blocks"][0]["variants"][0]["first"];
    assert!(ended == 1 && first["got"].as_str().expect("a text").starts_with("unknown bits"), "{first}");
}

/// A counter of plain VHDL numbers, without a reset.
const TICKS: &str = "entity ticks is
  port (clk : in bit; delta : in integer range -2 to 1; place : out natural range 0 to 255 := 0);
end;
architecture a of ticks is
  signal n : natural range 0 to 255 := 0;
begin
  process (clk) begin
    if clk'event and clk = '1' then n <= (n + delta) mod 256; end if;
  end process;
  place <= n;
end;
";

/// A limiter of one expression, without a clock.
const CLAMP: &str = "library ieee; use ieee.numeric_std.all;
entity clamp is
  generic (TOP : natural);
  port (x : in signed; y : out signed);
end;
architecture a of clamp is
begin
  y <= to_signed(TOP, y'length) when x > TOP else to_signed(-TOP, y'length) when x < -TOP else resize(x, y'length);
end;
";

#[test]
fn numbers_power_up_and_answers_that_come_earlier_are_compared() {
    let dir = scratch("number_blocks");
    let counter =
        ["--entity=ticks", "--as=position_counter", "--port=delta=step", "--port=place=position", "--set=WIDTH=8"];
    let (ended, value) = checked(&dir, "ticks.vhd", TICKS, &counter);
    assert_eq!(ended, 0, "{value}");
    let (ended, value) = checked(&dir, "ticks.vhd", &TICKS.replace("mod 256", "mod 255"), &counter);
    assert_eq!(ended, 1, "{value}");
    let clamp = CLAMP.replace("x : in signed;", "x : in signed(9 + 8 downto 8);");
    let clamp = clamp.replace("y : out signed)", "y : out signed(8 downto 0))");
    let limiter = [
        "--entity=clamp",
        "--as=command_limiter",
        "--variant=settling_1",
        "--port=x=value",
        "--port=y=limited",
        "--generic=TOP=LIMIT",
    ];
    let (ended, value) = checked(&dir, "clamp.vhd", &clamp, &[&limiter[..], &["--latency=-1"]].concat());
    assert_eq!(ended, 0, "{value}");
    let path = dir.join("clamp.vhd");
    refused(
        &run(&[&["check"], &limiter[..], &[text(&path)]].concat()),
        2,
        "no port of `clamp` is a clock: name it (--clock), or say by how many clocks its answers come earlier",
    );
}

#[test]
fn what_does_not_fit_is_refused_with_the_names_there_are() {
    let file = "testbench/dut/blocks/fast_mul.vhd";
    let widths = ["--generic=N=A_WIDTH", "--generic=KEEP=OUT_WIDTH"];
    let base = ["check", "--entity=fast_mul", "--as=truncating_multiplier", file];
    let ports = ["--port=x=a", "--port=y=b", "--port=p=product"];
    let cases: [(&[&str], &[&str], &str); 12] = [
        (
            &widths,
            &["--clock=clock", "--latency=2", "--port=x=a", "--port=p=product"],
            "input `y` of `fast_mul` is connected to nothing; write --port y=..., a number or one of a, b",
        ),
        (
            &widths,
            &["--clock=clock", "--latency=2", "--port=x=a", "--port=y=c", "--port=p=product"],
            "has no input `c`; it has a, b",
        ),
        (
            &widths,
            &["--clock=clock", "--latency=2", "--port=x=a", "--port=y=b"],
            "output `p` of `fast_mul` is none of truncating_multiplier; write --port p=..., open or one of product",
        ),
        (
            &widths,
            &["--clock=clock", "--latency=2", "--port=x=a", "--port=y=b", "--port=p=open"],
            "no output of `fast_mul` is product of truncating_multiplier; write --port ...=product, \
             or --port open=product",
        ),
        (
            &widths,
            &["--clock=nope", "--port=clock=0", "--port=x=a", "--port=y=b", "--port=p=product"],
            "`fast_mul` has no clock `nope`; there are clock (in, bits: 1), x (in",
        ),
        (
            &widths,
            &["--clock=clock", "--port=x=a", "--port=y=b", "--port=p=product", "--port=q=open"],
            "`fast_mul` has no port `q`; there are",
        ),
        (
            &widths,
            &["--clock=clock", "--port=x=a", "--port=y=b", "--port=p=product"],
            "comes 1 clock later, or more (--latency)",
        ),
        (
            &widths,
            &["--clock=clock", "--latency=2", "--port=x=5000", "--port=y=b", "--port=p=product"],
            "5000 does not fit input `x` of 12 bits",
        ),
        (
            &[],
            &["--clock=clock", "--latency=2", "--port=x=a", "--port=y=b", "--port=p=product"],
            "input `x` of `fast_mul` has 8 bits, a of truncating_multiplier has 12; map a generic (--generic)",
        ),
        (&widths, &["--clock=clock", "--set=OUT_WIDTH=1", "--port=x=a"], "OUT_WIDTH is 1; accepted: 2 to 64"),
        (
            &widths,
            &["--clock=clock", "--set=WIDTH=9", "--port=x=a"],
            "truncating_multiplier: generic WIDTH; accepted: A_WIDTH, B_WIDTH",
        ),
        (
            &widths,
            &["--clock=clock", "--variant=8_bit", "--port=x=a"],
            "truncating_multiplier has no variant `8_bit`; there are default, full",
        ),
    ];
    for (generics, args, says) in cases {
        refused(&run(&[&base[..], generics, args].concat()), 2, says);
    }
    refused(&run(&["check", "--entity=e", "--as=nothing", file]), 2, "no block `nothing`; there are synchronizer");
    refused(&run(&["check", "--entity=e", "--as=pwm", "pwm"]), 2, "`pwm` is no file of HDL");
    refused(&run(&["check", "--entity=e", "--as=pwm", "missing.vhd"]), 4, "missing.vhd: No such file");
    refused(&run(&["check", "--entity=e", "--as=pwm", file, file]), 2, "have one name");
    refused(
        &run(&[&base[..], &ports, &["--generic=M=1", "--clock=clock"]].concat()),
        1,
        "has no generic `M`; it has N, KEEP, SATURATING",
    );
    refused(
        &run(&["check", "--entity=slow_mul", "--as=pwm", file]),
        1,
        "no file declares the entity `slow_mul`; there are fast_mul",
    );
}
