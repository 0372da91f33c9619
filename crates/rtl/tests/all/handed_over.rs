//! Designs that leap for as long as that pays, and that Verilator takes over where it does not.

use crate::leap::{around, ran, same_answers_by, scene};

/// A design that changes at every edge, after a stretch in which it leaps.
const BUSY: &str =
    "module t(input clk, input rst, input [3:0] a, output reg pulse, output reg [7:0] sum, output [3:0] b);
     reg [15:0] lfsr;
     reg [9:0] n;
     assign b = a ^ lfsr[3:0];
     always @(posedge clk)
       if (rst) begin lfsr <= 16'hace1; sum <= 0; pulse <= 0; n <= 0; end
       else begin
         n <= n + 1;
         lfsr <= {lfsr[14:0], lfsr[15] ^ lfsr[13] ^ lfsr[12] ^ lfsr[10]};
         if (n == 0) {pulse, sum} <= {1'b0, sum} + {5'b0, a} + lfsr[0];
       end
     endmodule\n";

/// Verilator takes over after 2^16 edges, with the words that it would have had.
#[test]
fn a_design_that_does_not_leap_is_handed_over_with_the_same_words_at_every_edge() {
    let reset = "reset = { port = \"rst\" }\n";
    let held = BUSY.replace("assign b = a ^ lfsr[3:0]", "assign b = n[9:6]");
    for (verilog, requests, drives) in [(BUSY, 700, false), (&*held, 3000, true)] {
        let engine = same_answers_by("auto", verilog, reset, (requests, drives));
        assert!(engine.starts_with("Verilator") && engine.contains("(from clock edge 65536 on"), "{engine}");
        assert!(engine.contains("register `lfsr` changes at every edge"), "{engine}");
    }
    let calm = BUSY.replace("lfsr <= {", "if (a == 16) lfsr <= {");
    let engine = same_answers_by("auto", &calm, reset, (700, true));
    assert!(engine.starts_with("hpu's leaps") && engine.contains("% of the clock edges leapt over"), "{engine}");
}

#[test]
fn a_value_that_nothing_has_set_is_told_by_verilator_with_its_register() {
    let verilog = "module t(input clk, input rst, input [1:0] a, output y, output z);
         reg [3:0] phase;
         reg [9:0] n;
         assign z = n[5];
         assign y = n[9] & phase[0];
         always @(posedge clk) begin n <= rst ? 10'd0 : n + 10'd1; if (a == 2) phase <= phase + 1; end
         endmodule\n";
    let said = same_answers_by("auto", verilog, "reset = { port = \"rst\" }\n", (200, true));
    assert!(said.contains("register `phase`"), "{said}");
}

/// The designs whose counters are no plain ones: an eye on what `auto` does with them. Verilator, another process,
/// is asked at each change of an output; in the wall that of the sigma-delta modulator changes at most edges.
#[test]
fn designs_that_do_not_leap_well_run_in_verilator_unless_it_is_asked_too_often() {
    let (far, near) = ("position = \"1.5 rad\"", "position = \"0.1 rad\"");
    for (name, wall, starts, why) in [
        ("sigma", far, "Verilator", "register `lfsr` changes at every edge"),
        ("sigma", near, "hpu's leaps", "0.0 % of the clock edges leapt over"),
        ("prescaled", near, "hpu's leaps", "% of the clock edges leapt over"),
        ("paddle", near, "hpu's leaps", "% of the clock edges leapt over"),
    ] {
        let brief =
            [("run = { duration = \"1 s\" }", "run = { duration = \"30 ms\" }"), ("1.4]", "1.6]"), ("150 ms", "20 ms")];
        let changes = [&brief[..], &[(far, wall)]].concat();
        let ((one, by_auto, engine), (other, by_verilator, _)) =
            (ran(&scene(name, &changes, "auto")), ran(&scene(name, &changes, "verilator")));
        assert!(engine.starts_with(starts) && engine.contains(why), "{name}: {engine}");
        assert!(one == other && one.0.len() > 400, "{name}: {} changes", one.0.len());
        assert_eq!(by_auto.energy, by_verilator.energy, "{name}");
    }
}

/// A design that waits for 65536 edges and then changes a register at every edge: its beginning does not decide.
#[test]
fn a_design_that_leaps_until_it_has_started_is_handed_over_then() {
    let verilog = "module t(input clk, output reg pwm);
         reg [16:0] n = 0;
         reg [15:0] lfsr = 1;
         initial pwm = 0;
         always @(posedge clk) begin
           if (!n[16]) n <= n + 1; else lfsr <= {lfsr[14:0], lfsr[15] ^ lfsr[13] ^ lfsr[12] ^ lfsr[10]};
           pwm <= n[16] && lfsr[9:0] == 10'h155;
         end
         endmodule\n";
    let ran_by = |engine: &str| {
        let mut scene = around(verilog, "[dut.ports]\npwm = \"bridge.pwm\"\n", engine);
        scene.head.run.duration_s = 0.03;
        ran(&scene)
    };
    let ((one, by_auto, engine), (other, by_verilator, _)) = (ran_by("auto"), ran_by("verilator"));
    let said = "Verilator 5.006 (from clock edge 131072 on; before, leaps come to";
    assert!(engine.starts_with(said) && engine.contains("`lfsr` changes at every edge"), "{engine}");
    assert!(one == other && one.0.len() > 100, "{} changes", one.0.len());
    assert_eq!(by_auto.energy, by_verilator.energy);
}
