// WRONG: a combinational loop that does not converge once enc_a is 1 (y = not y).
module loop (
    input  wire clk,
    input  wire rst,
    input  wire enc_a,
    input  wire enc_b,
    output reg  pwm,
    output wire dir
);
    wire y;
    wire z;
    assign y = enc_a & ~z;
    assign z = y | (enc_b & rst);
    always @(posedge clk) pwm <= ~rst & z;
    assign dir = y;
endmodule
