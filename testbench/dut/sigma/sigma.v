// A wall whose actuator is driven by a first-order sigma-delta modulator.
//
// The modulator adds the duty to an accumulator at every clock edge; its carry
// is the output.  A shift register with feedback dithers it, so that its idle
// tones do not sing.  Nothing rests from one edge to the next.
module sigma (
    input  wire        clk,
    input  wire        rst,       // synchronous, active high
    input  wire        enc_a,     // asynchronous
    input  wire        enc_b,     // asynchronous
    input  wire [7:0]  gain,      // 1/4096 of the supply per encoder count
    input  wire [15:0] wall,      // encoder counts
    output reg         pulse,
    output wire        dir        // 1: positive direction
);
    reg [2:0]  a, b;
    reg [15:0] count;
    wire step = a[2] ^ a[1] ^ b[2] ^ b[1];
    wire up   = a[2] ^ b[1];

    wire signed [16:0] depth  = {1'b0, count} - {1'b0, wall};
    wire        [24:0] asked  = depth[15:0] * gain;
    wire               beyond = !depth[16] && !count[15];

    reg [11:0] duty, sum;
    reg [15:0] lfsr;
    wire [12:0] next = {1'b0, sum} + {1'b0, duty} + {12'd0, lfsr[0] && duty != 12'd0};
    assign dir = 1'b0;

    always @(posedge clk)
        if (rst) begin
            a <= 3'd0; b <= 3'd0; count <= 16'd0;
            duty <= 12'd0; sum <= 12'd0; pulse <= 1'b0; lfsr <= 16'hace1;
        end else begin
            a <= {a[1:0], enc_a};
            b <= {b[1:0], enc_b};
            if (step) count <= up ? count + 16'd1 : count - 16'd1;
            duty <= !beyond ? 12'd0 : asked > 25'd4095 ? 12'd4095 : asked[11:0];
            lfsr <= {lfsr[14:0], lfsr[15] ^ lfsr[13] ^ lfsr[12] ^ lfsr[10]};
            {pulse, sum} <= next;
        end
endmodule
