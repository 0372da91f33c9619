// Small designs, one way of starting up each; see testbench/startup.py. Each answers with a byte.

module posedge_reset (input clk, rst, a, output [7:0] q);
  reg seen = 0;
  always @(posedge rst) seen <= 1;
  assign q = seen;
endmodule

module negedge_reset (input clk, rst, a, output reg [7:0] q);
  initial q = 0;
  always @(negedge rst) q <= q + 1;
endmodule

module reset_edges (input clk, rst, a, output reg [7:0] q);
  initial q = 0;
  always @(posedge rst or negedge rst) q <= q + 1;
endmodule

module sync_counter (input clk, rst, a, output reg [7:0] q);
  always @(posedge clk) if (rst) q <= 3; else q <= q + 1;
endmodule

module async_counter (input clk, rst, a, output reg [7:0] q);
  always @(posedge clk or posedge rst) if (rst) q <= 5; else q <= q + 1;
endmodule

module async_low_counter (input clk, rst, a, output reg [7:0] q);
  wire rst_n = ~rst;
  always @(posedge clk or negedge rst_n) if (!rst_n) q <= 7; else q <= q + 1;
endmodule

module initial_only (input clk, rst, a, output [7:0] q);
  reg [7:0] r = 8'h5a;
  always @(posedge clk) r <= {r[6:0], r[7]};
  assign q = r;
endmodule

module initial_then_reset (input clk, rst, a, output reg [7:0] q);
  initial q = 100;
  always @(posedge clk) if (rst) q <= 200; else q <= q - 1;
endmodule

module initial_memory (input clk, rst, a, output reg [7:0] q);
  reg [7:0] rom [0:15];
  reg [3:0] at;
  integer i;
  initial for (i = 0; i < 16; i = i + 1) rom[i] = i * i;
  always @(posedge clk) if (rst) at <= 0; else begin at <= at + 1; q <= rom[at]; end
endmodule

module cleared_memory (input clk, rst, a, output reg [7:0] q);
  reg [7:0] ram [0:3];
  reg [1:0] at;
  integer i;
  always @(posedge clk)
    if (rst) begin at <= 0; q <= 0; for (i = 0; i < 4; i = i + 1) ram[i] <= 16 * i; end
    else begin at <= at + 1; ram[at] <= q + 1; q <= ram[at]; end
endmodule

module divided_initial (input clk, rst, a, output reg [7:0] q);
  reg half = 0;
  always @(posedge clk) half <= ~half;
  always @(posedge half or posedge rst) if (rst) q <= 0; else q <= q + 1;
endmodule

module divided_reset (input clk, rst, a, output reg [7:0] q);
  reg [1:0] n;
  wire slow = n[1];
  always @(posedge clk or posedge rst) if (rst) n <= 0; else n <= n + 1;
  always @(posedge slow or posedge rst) if (rst) q <= 9; else q <= q + 1;
endmodule

module divided_by_its_reset (input clk, rst, a, output reg [7:0] q);
  reg half, first = 1;
  always @(posedge rst) first <= 0;
  always @(posedge clk) if (rst) half <= 0; else half <= ~half;
  always @(negedge half) if (first) q <= 1; else q <= 2;
endmodule

module gated_by_reset (input clk, rst, a, output reg [7:0] q);
  wire gated = clk & ~rst;
  initial q = 0;
  always @(posedge gated) q <= q + 1;
endmodule

module gated_by_latch (input clk, rst, a, output reg [7:0] q);
  reg open;
  always @* if (!clk) open = ~rst;
  wire gated = clk & open;
  initial q = 0;
  always @(posedge gated) q <= q + 1;
endmodule

module falling_clock (input clk, rst, a, output reg [7:0] q);
  always @(negedge clk) if (rst) q <= 0; else q <= q + 1;
endmodule

module both_clock_edges (input clk, rst, a, output [7:0] q);
  reg [3:0] up, down;
  always @(posedge clk) if (rst) up <= 0; else up <= up + 1;
  always @(negedge clk) if (rst) down <= 0; else down <= up;
  assign q = {up, down};
endmodule

module reset_synchroniser (input clk, rst, a, output reg [7:0] q);
  reg one, two;
  always @(posedge clk or posedge rst) if (rst) {two, one} <= 2'b11; else {two, one} <= {one, 1'b0};
  always @(posedge clk or posedge two) if (two) q <= 0; else q <= q + 1;
endmodule

module power_on_counter (input clk, rst, a, output reg [7:0] q);
  reg [3:0] wait_for = 9;
  wire own = wait_for != 0;
  always @(posedge clk) if (own) wait_for <= wait_for - 1;
  always @(posedge clk) if (own) q <= 0; else q <= q + 1;
endmodule

module clocks_in_reset (input clk, rst, a, output reg [7:0] q);
  initial q = 0;
  always @(posedge clk) if (rst) q <= q + 1;
endmodule

module falls_in_reset (input clk, rst, a, output reg [7:0] q);
  initial q = 0;
  always @(negedge clk) if (rst) q <= q + 1;
endmodule

module clocks_since_power_on (input clk, rst, a, output reg [7:0] q);
  initial q = 0;
  always @(posedge clk) q <= q + 1;
endmodule

module latch_in_reset (input clk, rst, a, output reg [7:0] q);
  reg [7:0] n = 0;
  always @(posedge clk) n <= n + 1;
  always @* if (rst) q = n;
endmodule

module reset_seen_at_a_fall (input clk, rst, a, output reg [7:0] q);
  reg late;
  always @(negedge clk) late <= rst;
  always @(posedge clk) if (late) q <= 0; else q <= q + 1;
endmodule

module rise_of_reset_clocked (input clk, rst, a, output reg [7:0] q);
  reg last = 0;
  initial q = 0;
  always @(posedge clk) begin last <= rst; if (rst && !last) q <= q + 16; if (!rst && last) q <= q + 1; end
endmodule

module pipeline_unset (input clk, rst, a, output reg [7:0] q);
  reg [7:0] one, two;
  always @(posedge clk) begin one <= {7'd10, a}; two <= one; q <= two; end
endmodule

module blocking_in_reset (input clk, rst, a, output [7:0] q);
  reg [3:0] x, y;
  always @(posedge clk) if (rst) begin x = 1; y = 2; end else begin x = y; y = x + 1; end
  assign q = {x, y};
endmodule

module async_set_and_reset (input clk, rst, a, output reg [7:0] q);
  always @(posedge clk or posedge rst or posedge a) if (rst) q <= 1; else if (a) q <= 2; else q <= q + 1;
endmodule

module startup (
    input clk, rst, a,
    output [7:0] posedge_reset, negedge_reset, reset_edges, sync_counter, async_counter, async_low_counter,
    output [7:0] initial_only, initial_then_reset, initial_memory, cleared_memory, divided_initial, divided_reset,
    output [7:0] divided_by_its_reset, gated_by_reset, gated_by_latch, falling_clock, both_clock_edges,
    output [7:0] reset_synchroniser, power_on_counter, clocks_in_reset, falls_in_reset, clocks_since_power_on,
    output [7:0] latch_in_reset, reset_seen_at_a_fall, rise_of_reset_clocked, pipeline_unset, blocking_in_reset,
    output [7:0] async_set_and_reset
);
  posedge_reset u0 (clk, rst, a, posedge_reset);
  negedge_reset u1 (clk, rst, a, negedge_reset);
  reset_edges u2 (clk, rst, a, reset_edges);
  sync_counter u3 (clk, rst, a, sync_counter);
  async_counter u4 (clk, rst, a, async_counter);
  async_low_counter u5 (clk, rst, a, async_low_counter);
  initial_only u6 (clk, rst, a, initial_only);
  initial_then_reset u7 (clk, rst, a, initial_then_reset);
  initial_memory u8 (clk, rst, a, initial_memory);
  cleared_memory u9 (clk, rst, a, cleared_memory);
  divided_initial u10 (clk, rst, a, divided_initial);
  divided_reset u11 (clk, rst, a, divided_reset);
  divided_by_its_reset u12 (clk, rst, a, divided_by_its_reset);
  gated_by_reset u13 (clk, rst, a, gated_by_reset);
  gated_by_latch u14 (clk, rst, a, gated_by_latch);
  falling_clock u15 (clk, rst, a, falling_clock);
  both_clock_edges u16 (clk, rst, a, both_clock_edges);
  reset_synchroniser u17 (clk, rst, a, reset_synchroniser);
  power_on_counter u18 (clk, rst, a, power_on_counter);
  clocks_in_reset u19 (clk, rst, a, clocks_in_reset);
  falls_in_reset u20 (clk, rst, a, falls_in_reset);
  clocks_since_power_on u21 (clk, rst, a, clocks_since_power_on);
  latch_in_reset u22 (clk, rst, a, latch_in_reset);
  reset_seen_at_a_fall u23 (clk, rst, a, reset_seen_at_a_fall);
  rise_of_reset_clocked u24 (clk, rst, a, rise_of_reset_clocked);
  pipeline_unset u25 (clk, rst, a, pipeline_unset);
  blocking_in_reset u26 (clk, rst, a, blocking_in_reset);
  async_set_and_reset u27 (clk, rst, a, async_set_and_reset);
endmodule
