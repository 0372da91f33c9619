// The hybrid wall in SystemVerilog, register by register as hdl/hybrid_loop.vhd, and a testbench that closes its loop
// around the plant of a scene. The plusarg +scene= names the scene and its overrides, as hpu_sim_open reads them.
//
//   cargo build --release -p hpu-capi
//   cd crates/capi/examples
//   export LD_LIBRARY_PATH=$PWD/../../../target/release
//   $ verilator --binary --timing --top-module motor_tb -MAKEFLAGS "OPT_FAST=-O3 OPT_GLOBAL=-O3" \
//     -CFLAGS -I$PWD/../include -LDFLAGS "-L$LD_LIBRARY_PATH -lhpu" \
//     ../simulators/hpu_plant.sv motor_tb.sv $PWD/../simulators/hpu_sim.c
//   obj_dir/Vmotor_tb "+scene=hybrid-wall;run.duration=200 ms"

module hybrid_wall (
    input  logic        clk, rst,
    input  logic [1:0]  pins,       // A, B
    input  logic [11:0] reference, stiffness, damping,  // damping with 4 fraction bits
    input  logic [23:0] period,
    output logic [3:0]  gates       // a_high, a_low, b_high, b_low
);
  logic [1:0] stage, lines, previous, settled;
  logic signed [1:0] step;
  logic [11:0] position, sampled, phase;
  logic signed [11:0] velocity, delta;
  logic [23:0] countdown, product;
  logic signed [24:0] resistance;
  logic signed [13:0] torque;
  logic signed [12:0] held, wanted, duty;

  always_comb begin
    delta = position - reference;
    product = 24'(unsigned'(delta)) * 24'(stiffness);
    resistance = (25'(velocity) * signed'({13'd0, damping})) >>> 4;
    if (resistance > 4095) resistance = 4095;
    if (resistance < -4096) resistance = -4096;
    torque = 0;
    if (!delta[11]) torque = 14'((product > 4095) ? 24'd4095 : product) + 14'(resistance);
    wanted = (torque > 4095) ? 13'sd4095 : (torque < -4095) ? -13'sd4095 : 13'(torque);
    duty = (phase == 0) ? wanted : held;
  end

  always_ff @(posedge clk) begin
    held  <= duty;
    phase <= phase + 1;
    gates <= (signed'({1'b0, phase}) < duty) ? 4'b1001 : (signed'({1'b0, phase}) < -duty) ? 4'b0110 : 4'b0101;
    if (countdown == 0) begin
      velocity  <= position - sampled;
      sampled   <= position;
      countdown <= ((period > 1) ? period : 24'd1) - 1;
    end else countdown <= countdown - 1;
    position <= position + 12'(step);
    step <= 0;
    if (settled != 3) settled <= settled + 1;
    else
      case ({previous, lines})
        4'b0001, 4'b0111, 4'b1110, 4'b1000: step <= 1;
        4'b0010, 4'b1011, 4'b1101, 4'b0100: step <= -1;
        default: ;
      endcase
    previous <= lines;
    lines    <= stage;
    stage    <= pins;
    if (rst) begin
      {held, phase, gates, velocity, sampled, countdown} <= '0;
      {position, step, settled, previous, lines, stage} <= '0;
    end
  end
endmodule

module motor_tb;
  import hpu_plant::*;

  logic clk = 0, rst = 1;
  logic [1:0] pins = 0;
  logic [3:0] gates;
  logic [11:0] reference, stiffness, damping;
  logic [23:0] period;
  logic [3:0] driven = 0;
  int plant, lines, edges = 0;
  int counted = 0, quiet = 0;  // edges since the plant was called; edges for which the pins stay
  string scene;

  hybrid_wall wall (.*);

  initial begin
    if (!$value$plusargs("scene=%s", scene)) scene = "hybrid-wall";
    plant = hpu_sim_open(scene);
    if (plant < 0) $fatal(1, "the scene is refused");
    // Off until the reset is over: any output can be set by its index too.
    if (hpu_sim_set(plant, hpu_sim_output(plant, "a_high"), 0) != 0) $fatal(1, "a bridge is expected");
    if (hpu_sim_advance(plant, 0) != 0) $fatal(1, "the scene has no edge");
    reference = 12'(hpu_sim_input(plant, "reference"));
    stiffness = 12'(hpu_sim_input(plant, "stiffness"));
    damping   = 12'(hpu_sim_input(plant, "damping"));
    period    = 24'(hpu_sim_input(plant, "period"));
  end

  // Between two rising edges: the gates of the edge before, then the pins of the edge to come. The plant is not called
  // while the gates stay and it has promised the same pins; without `counted` and `quiet` the motion is the same.
  always begin
    #10 clk = 1;
    #10 clk = 0;
    rst = 0;
    if (gates == driven && counted < quiet) counted = counted + 1;
    else begin
      lines = hpu_sim_advance(plant, counted);
      lines = hpu_sim_step(plant, {28'd0, gates});
      counted = 0;
      quiet = hpu_sim_quiet(plant);
      driven = gates;
      pins = lines[1:0];
    end
    edges = edges + 1;
    if (lines < 0) begin
      if (lines != HPU_END) $fatal(1, "the run has failed");
      $display("edge %0d", edges - 1);
      $display("current_a %.17g", hpu_sim_state(plant, "current_a"));
      $display("speed_rad_per_s %.17g", hpu_sim_state(plant, "speed_rad_per_s"));
      $display("angle_rad %.17g", hpu_sim_state(plant, "angle_rad"));
      lines = hpu_sim_close(plant);
      $finish;
    end
  end
endmodule
