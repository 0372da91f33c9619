// bench : the Verilog of hybrid_loop closed around the C++ plant by VPI, for Icarus
//
// +edges=N +reference=W +stiffness=W +damping=W +period=W +scale=W
// With NETS defined it shows every net, a line for each edge after which any has changed, and
// +pins=FILE  replays the pins of such lines, under a header, instead of closing the loop

`timescale 1ns / 1ns

module bench;
  reg clk = 0, rst = 1, a_pin = 0, b_pin = 0;
  reg [11:0] reference, stiffness, damping;
  reg [23:0] period;
  reg [15:0] scale;
  wire a_high, a_low, b_high, b_low;
  integer edges, edge_now, read;

`ifdef NETS
  wire a, b, error, contact;
  wire [1:0] step;
  wire [11:0] position, delta, penetration, spring, velocity;
  wire [12:0] drag, command;
  wire [13:0] torque;

  hybrid_nets dut (
    .clk(clk), .rst(rst), .a_pin(a_pin), .b_pin(b_pin), .reference(reference), .stiffness(stiffness),
    .damping(damping), .period(period), .scale(scale), .a_high(a_high), .a_low(a_low), .b_high(b_high), .b_low(b_low),
    .a(a), .b(b), .step(step), .error(error), .position(position), .delta(delta), .contact(contact),
    .penetration(penetration), .spring(spring), .velocity(velocity), .drag(drag), .torque(torque), .command(command));

  reg [255:0] now, shown = 0;
  reg [8 * 256 - 1:0] path, rest;
  integer pins = 0, next_edge;
  reg next_a, next_b;

  task read_pins;
    begin
      read = $fscanf(pins, "%d,%d,%d", next_edge, next_a, next_b);
      if (read != 3) next_edge = -1;
      read = $fgets(rest, pins);
    end
  endtask

  initial if ($value$plusargs("pins=%s", path)) begin
    pins = $fopen(path, "r");
    read = $fgets(rest, pins);
    read_pins;
  end
`else
  hybrid_loop dut (
    .clk(clk), .rst(rst), .a_pin(a_pin), .b_pin(b_pin), .reference(reference), .stiffness(stiffness),
    .damping(damping), .period(period), .scale(scale), .a_high(a_high), .a_low(a_low), .b_high(b_high), .b_low(b_low));
`endif

  task flow;
    {b_pin, a_pin} = $plant_edge({28'b0, b_low, b_high, a_low, a_high});
  endtask

  initial begin
    read = $value$plusargs("edges=%d", edges);
    read = $value$plusargs("reference=%d", reference);
    read = $value$plusargs("stiffness=%d", stiffness);
    read = $value$plusargs("damping=%d", damping);
    read = $value$plusargs("period=%d", period);
    read = $value$plusargs("scale=%d", scale);
    #10 clk = 1;
    #10 clk = 0;
    rst = 0;
    for (edge_now = 1; edge_now <= edges; edge_now = edge_now + 1) begin
`ifdef NETS
      if (pins == 0) flow;
      else if (next_edge == edge_now) begin
        {a_pin, b_pin} = {next_a, next_b};
        read_pins;
      end
`else
      flow;
`endif
      #10 clk = 1;
      #10 clk = 0;
`ifdef NETS
      now = {a_pin, b_pin, reference, stiffness, damping, period, scale, a_high, a_low, b_high, b_low, a, b, step,
             error, position, delta, contact, penetration, spring, velocity, drag, torque, command};
      if (now !== shown) begin
        shown = now;
        $display("%0d,%0d,%0d,%0d,%0d,%0d,%0d,%0d,%0d,%0d,%0d,%0d,%0d,%0d,%0d,%0d,%0d,%0d,%0d,%0d,%0d,%0d,%0d,%0d,%0d",
                 edge_now, a_pin, b_pin, reference, stiffness, damping, period, scale, a_high, a_low, b_high, b_low, a,
                 b, step, error, position, delta, contact, penetration, spring, velocity, drag, torque, command);
      end
`endif
    end
    $finish;
  end
endmodule
