// A wall whose pulse-width modulator counts at every tenth clock edge.
//
// Quadrature in, pulses out.  Beyond `wall` counts the bridge pushes back by
// `gain` counts of the modulator for each count of depth, up to a full period
// of 256 counts, which is 2560 clocks.
module prescaled (
    input  wire        clk,
    input  wire        rst,       // synchronous, active high
    input  wire        enc_a,     // asynchronous
    input  wire        enc_b,     // asynchronous
    input  wire [7:0]  gain,      // modulator counts per encoder count
    input  wire [15:0] wall,      // encoder counts
    output reg         pwm,
    output reg         dir        // 1: positive direction
);
    reg [2:0]  a, b;
    reg [15:0] count;
    wire step = a[2] ^ a[1] ^ b[2] ^ b[1];
    wire up   = a[2] ^ b[1];

    wire signed [16:0] depth  = {1'b0, count} - {1'b0, wall};
    wire        [24:0] asked  = depth[15:0] * gain;
    wire               beyond = !depth[16] && !count[15];

    reg [3:0] prescale;
    reg [7:0] ramp, duty;
    wire enable = prescale == 4'd9;

    always @(posedge clk)
        if (rst) begin
            a <= 3'd0; b <= 3'd0; count <= 16'd0;
            prescale <= 4'd0; ramp <= 8'd0; duty <= 8'd0; pwm <= 1'b0; dir <= 1'b0;
        end else begin
            a <= {a[1:0], enc_a};
            b <= {b[1:0], enc_b};
            if (step) count <= up ? count + 16'd1 : count - 16'd1;
            prescale <= enable ? 4'd0 : prescale + 4'd1;
            if (enable) begin
                ramp <= ramp + 8'd1;
                if (ramp == 8'd255)
                    duty <= !beyond ? 8'd0 : asked > 25'd255 ? 8'd255 : asked[7:0];
                pwm <= ramp < duty;
            end
            dir <= 1'b0;
        end
endmodule
