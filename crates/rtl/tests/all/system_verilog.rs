//! Designs that Yosys does not read, or reads otherwise, leap as Verilator has read them.

use std::fmt::Write as _;

use hpu_cosim::dut::{Designs, Inside};

use crate::leap::{around_file, same_answers_of, simulators};

/// Clocks a design by leaps and in Verilator, with the same words at random times.
fn same(code: &str, requests: u32) {
    let scene = |engine: &str| {
        around_file(("t.sv", code), ("t", "clk"), "reset = { port = \"rst\", active = \"high\" }\n", engine)
    };
    let engine = same_answers_of(&scene, "leap", code, (requests, false));
    assert!(engine.starts_with("hpu's leaps"), "{engine}\n{code}");
}

const FORMS: [&str; 7] = [
    // A package with an enumeration, a structure and a function; a memory cleared by a loop; `unique case`, `inside`.
    "package own;
       typedef enum logic [1:0] {IDLE, RUN = 2'd2, STOP} state_t;
       typedef struct packed { logic [3:0] high; logic signed [4:0] low; } pair_t;
       function automatic logic [7:0] twice(input logic [6:0] x); twice = {x, 1'b0}; endfunction
     endpackage
     module t import own::*; #(parameter int DEPTH = 4) (input logic clk, rst, input logic signed [7:0] u,
         input logic [1:0] k, output logic signed [9:0] y, output state_t s, output logic [8:0] z);
       pair_t p; state_t state; logic [7:0] memory [DEPTH];
       function automatic logic signed [9:0] scaled(input logic signed [7:0] v);
         logic signed [9:0] w; w = v * 3; scaled = w + 1;
       endfunction
       always_ff @(posedge clk or posedge rst)
         if (rst) begin state <= IDLE; p <= '0; for (int i = 0; i < DEPTH; i++) memory[i] <= '0; end
         else begin
           unique case (state) IDLE: state <= RUN; RUN: if (u > 3) state <= STOP; default: state <= IDLE; endcase
           p.high <= u[3:0]; p.low <= 5'(u >>> 2); memory[k] <= u;
         end
       always_comb begin
         y = scaled(u); s = state; z = p;
         if (k inside {1, 2}) z = twice(u[6:0]) + memory[k];
       end
     endmodule",
    // Types of casts, an instance with parameters of a generated block, packed arrays of two dimensions.
    "module part #(parameter int W = 4, parameter logic signed [7:0] GAIN = -3)
         (input logic clk, rst, input logic signed [W-1:0] x, output logic signed [W+7:0] y);
       typedef logic signed [W+7:0] wide_t;
       localparam wide_t MOST = wide_t'(1 << W);
       wide_t next;
       always_comb begin next = wide_t'(x) * wide_t'(GAIN); if (next > MOST) next = MOST;
         else if (next < -MOST) next = -MOST; end
       always_ff @(posedge clk) if (rst) y <= '0; else y <= next;
     endmodule
     module t(input logic clk, rst, input logic signed [5:0] a, input logic [2:0] n, output logic signed [13:0] y0,
         output logic signed [10:0] y1, output logic [3:0][2:0] lanes, output logic any);
       part #(.W(6)) one(.clk, .rst, .x(a), .y(y0));
       part #(.W(3), .GAIN(8'sd9)) two(.clk, .rst, .x(3'(a >>> 1)), .y(y1));
       for (genvar g = 0; g < 4; g++) begin : lane
         always_ff @(posedge clk) lanes[g] <= n + 3'(g);
       end
       assign any = |lanes[1] & ^a;
     endmodule",
    // Choices by signed words, and a choice without a default.
    "module t(input logic clk, rst, input logic signed [3:0] s, input logic [7:0] a, output logic [7:0] q,
         output logic [7:0] y);
       always_comb begin y = 8'd7; case (s) 4'sd1: y = a; -4'sd3, 4'sd5: y = ~a; endcase end
       always_ff @(posedge clk) case (s + 1) -2: q <= a; 3: q <= 8'(s); default: q <= q ^ y; endcase
     endmodule",
    // Shifts by signed words, a signed word to a moving part, a loop by a narrow variable's copy.
    "module t(input logic clk, rst, input logic signed [3:0] s, input logic [7:0] a, output logic [15:0] q,
         output logic signed [15:0] y, output logic [7:0] z, output logic [7:0] v);
       always_comb begin
         v = '0; for (int i = 7; i >= 0; i--) v[i] = a[7 - i] & (i > s); for (int i = 1; i < 8; i = i * 2) v[i] = s[2];
       end
       assign y = $signed(a) >>> s; assign z = a << s;
       always_ff @(posedge clk) if (rst) q <= '0; else begin
         q[a[3:0] & 4'd7] <= s >>> 1;
         for (int i = 8; i < 16; i++) q[i] <= a[i - 8] ^ (s > 0);
       end
     endmodule",
    // Words that a synthesiser sees, and comments that it believes.
    "`ifdef SYNTHESIS
       `define WORD 8'd1
     `else
       `define WORD 8'd2
     `endif
     module t(input logic clk, rst, input logic [1:0] n, input logic [7:0] a, output logic [7:0] q,
         output logic [7:0] y);
       assign y = a + `WORD;
       always_ff @(posedge clk) (* full_case, parallel_case *) case (n)
         2'd0: q <= a; 2'd1: q <= y; 2'd2: q <= 8'd0; default: q <= q; endcase
     endmodule",
    // Structures inside each other, and parts of them as targets.
    "module t(input logic clk, rst, input logic [7:0] a, input logic b, output logic [11:0] y, output logic [3:0] z);
       typedef struct packed { logic flag; logic [2:0] level; } in_t;
       typedef struct packed { in_t first; logic [3:0] middle; in_t last; } out_t;
       out_t w, v;
       always_comb begin v = w; v.last.level = a[2:0]; v.middle[1 +: 2] = {b, ~b}; end
       always_ff @(posedge clk) if (rst) w <= '0; else begin
         w <= v; w.first.level <= w.first.level + 3'd1; {w.first.flag, w.last.flag} <= a[7:6]; end
       assign y = w; assign z = b ? v.first : v.last;
     endmodule",
    // Functions of the same name in two modules, and connections by their places.
    "module sub #(parameter int K = 1)(input logic [7:0] u, output logic [7:0] y);
       function automatic logic [7:0] f(input logic [7:0] x); f = x * 8'(K); endfunction
       assign y = f(u); endmodule
     module t(input logic clk, rst, input logic [7:0] u, output logic [7:0] y, w, z);
       typedef struct packed {logic [3:0] a; logic [3:0] b;} s_t; s_t s; logic [7:0] p, q;
       sub #(3) one(u, p); sub #(5) two(u, q);
       function automatic logic [7:0] f(input logic [7:0] x); f = x - 8'd1; endfunction
       always_ff @(posedge clk) begin s <= s_t'(u); y <= p; w <= q; z <= f(u) + s.a; end
     endmodule",
];

#[test]
fn forms_of_system_verilog_answer_as_in_verilator() {
    FORMS.iter().for_each(|code| same(code, 200));
}

#[test]
fn what_verilator_tells_of_and_is_not_known_is_refused_by_name() {
    for (body, why) in [
        (
            "always_ff @(posedge clk) begin p.x <= a[0]; casez (a) 4'b1???: q <= p.x; default: q <= ~p.x; endcase end",
            "the constant 4'b1zzz",
        ),
        ("real r; always_ff @(posedge clk) begin r = a; p.x <= r > 2.5; q <= p.x; end", "the type `real`"),
        (
            "int i; always_ff @(posedge clk) begin i = 0; p.x <= a[0]; while (i < a) i = i + 2; q <= i[1] ^ p.x; end",
            "is not known here",
        ),
        (
            "logic m [2][2]; always_ff @(posedge clk) begin m[a[0]][a[1]] <= a[2]; p.x <= m[a[2]][a[3]]; q <= p.x; end",
            "a memory of memories",
        ),
    ] {
        let code = format!(
            "module t(input logic clk, rst, input logic [3:0] a, output logic q);
             struct packed {{ logic x; }} p; {body} endmodule"
        );
        let code = &*code;
        let scene = around_file(("t.sv", code), ("t", "clk"), "", "leap");
        let said = simulators().build(&scene, Inside::Nothing).err().map(|error| error.to_string()).unwrap_or_default();
        assert!(!said.is_empty() && said.contains(why), "{code}\n{said}");
    }
}

/// The XML has names without their scopes: where two may be meant, the design does not leap.
#[test]
fn names_that_two_scopes_have_are_refused() {
    for (code, why) in [
        (
            "package p; function automatic logic [7:0] f(input logic [7:0] x); f = x + 8'd1; endfunction endpackage
         module t(input logic clk, rst, input logic [7:0] u, output logic [7:0] y, z);
           typedef struct packed {logic [3:0] a; logic [3:0] b;} s_t; s_t s;
           function automatic logic [7:0] f(input logic [7:0] x); f = x + 8'd100; endfunction
           always_ff @(posedge clk) begin s <= s_t'(u); y <= p::f(s); z <= f(u); end
         endmodule",
            "the function `f`",
        ),
        (
            "module t(input logic clk, rst, input logic [7:0] u, output logic [7:0] y, w, v);
           typedef struct packed {logic [3:0] a; logic [3:0] b;} s_t; s_t s;
           for (genvar g = 0; g < 2; g++) begin : lane
             function automatic logic [7:0] h(input logic [7:0] x); h = x + 8'(g) * 8'd17; endfunction
             logic [7:0] o; always_comb o = h(u);
             if (g == 0) assign w = o; else assign v = o;
           end
           always_ff @(posedge clk) begin s <= s_t'(u); y <= s.a + u; end
         endmodule",
            "the function `h`",
        ),
        (
            "module t(input logic clk, rst, input logic [7:0] u, output logic [7:0] y, w, v);
           typedef struct packed {logic [3:0] a; logic [3:0] b;} s_t; s_t s;
           logic [7:0] k; 
           function automatic logic [7:0] h(input logic [7:0] x); h = x + k; endfunction
           always_ff @(posedge clk) begin s <= s_t'(u); k <= u; y <= s.a + u; end
           if (1) begin : g
             logic [7:0] k; always_ff @(posedge clk) k <= ~u;
             function automatic logic [7:0] q(input logic [7:0] x); q = x + k; endfunction
             assign w = h(u); assign v = q(u);
           end
         endmodule",
            "the function `q`",
        ),
        (
            "package p; logic [7:0] k = 8'd5;
           function automatic logic [7:0] f(input logic [7:0] x); f = x + k; endfunction endpackage
         module t(input logic clk, rst, input logic [7:0] u, output logic [7:0] y, w);
           typedef struct packed {logic [3:0] a; logic [3:0] b;} s_t; s_t s; logic [7:0] k;
           always_ff @(posedge clk) begin s <= s_t'(u); k <= ~u; y <= p::f(u); w <= p::k ^ s; end
         endmodule",
            "`k`, a name of a package",
        ),
    ] {
        let scene = around_file(("t.sv", code), ("t", "clk"), "", "leap");
        let said = simulators().build(&scene, Inside::Nothing).err().map(|error| error.to_string()).unwrap_or_default();
        assert!(said.contains(why), "{code}\n{said}");
    }
}

/// Returns a module with random expressions over words with and without sign, of odd widths, through casts.
fn random(seed: u64) -> String {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let mut next = move |limit: u64| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 11) % limit
    };
    fn expression(depth: u32, next: &mut dyn FnMut(u64) -> u64) -> String {
        let leaf = depth == 0 || next(6) == 0;
        if leaf {
            return match next(8) {
                0 => format!("{}'d{}", 9, next(512)),
                1 => format!("-{}'sd{}", 6, next(31)),
                2 => next(40).to_string(),
                at => ["a", "s", "w", "b", "r0", "r1", "p.low"][at as usize % 7].to_string(),
            };
        }
        let one = |next: &mut dyn FnMut(u64) -> u64| expression(depth - 1, next);
        let (x, y) = (one(next), one(next));
        match next(17) {
            0..=3 => format!("({x} {} {y})", ["+", "-", "*", "^"][next(4) as usize]),
            4 => format!("({x} {} {y})", ["&", "|"][next(2) as usize]),
            5 | 6 => format!("({x} {} {y})", ["<", ">=", "==", "!=", ">", "<="][next(6) as usize]),
            7 => format!("({x} ? {y} : {})", one(next)),
            8 => format!("({x} {} {}[1:0])", ["<<", ">>", ">>>"][next(3) as usize], ["a", "w"][next(2) as usize]),
            9 => format!("({x} {} s)", ["<<", ">>", ">>>"][next(3) as usize]),
            10 => format!("t{}_t'({x})", next(3)),
            11 => format!("{}'({x})", 1 + next(20)),
            12 => format!("{}'({x})", ["signed", "unsigned"][next(2) as usize]),
            13 => format!("{{2'({x}), 5'({y})}}"),
            14 => format!("({} {x})", ["~", "-", "!", "^", "|"][next(5) as usize]),
            15 => format!("scaled({x}, {y})"),
            _ => format!("({x} inside {{3, {}}})", next(20)),
        }
    }
    let (mut outputs, mut body, mut clocked) = (String::new(), String::new(), String::new());
    for at in 0..10 {
        let (width, sign) = (1 + next(24), ["", "signed "][next(2) as usize]);
        write!(outputs, ", output logic {sign}[{}:0] y{at}", width - 1).expect("memory");
        let value = expression(3, &mut next);
        match next(3) {
            0 => writeln!(clocked, "y{at} <= {value};"),
            1 => writeln!(body, "assign y{at} = {value};"),
            _ => writeln!(
                body,
                "always_comb begin y{at} = {}; if ({}) y{at} = {value}; end",
                next(9),
                expression(1, &mut next)
            ),
        }
        .expect("memory");
    }
    format!(
        "module t(input logic clk, rst, input logic [7:0] a, input logic signed [5:0] s,
         input logic [12:0] w, input logic b{outputs});
         typedef logic [4:0] t0_t; typedef logic signed [10:0] t1_t; typedef logic signed [16:0] t2_t;
         struct packed {{ logic [2:0] high; logic signed [3:0] low; }} p; t0_t r0; t1_t r1;
         function automatic logic signed [14:0] scaled(input logic signed [9:0] x, input logic [3:0] y);
           scaled = x * y - 3; endfunction
         always_ff @(posedge clk or posedge b) if (b) begin p <= '0; r0 <= '0; r1 <= 11'd3; end else begin
           p.high <= a[2:0]; p.low <= s[4:1]; r0 <= t0_t'(w) + 1; r1 <= {}; end
         always_ff @(posedge clk) begin {clocked} end\n{body}endmodule\n",
        expression(2, &mut next)
    )
}

#[test]
fn expressions_at_random_answer_as_in_verilator() {
    (1..5).for_each(|seed| same(&random(seed), 120));
}

/// As many as take ten minutes. A few have a form that is not known.
#[test]
#[ignore = "testbench/long.sh runs it"]
fn many_expressions_at_random_answer_as_in_verilator() {
    let leaps = |code: &str| {
        simulators().build(&around_file(("t.sv", code), ("t", "clk"), "", "leap"), Inside::Nothing).is_ok()
    };
    let all: Vec<_> = (100..400).map(random).filter(|code| leaps(code)).collect();
    assert!(all.len() > 270, "{} leap", all.len());
    all.iter().for_each(|code| same(code, 120));
}
