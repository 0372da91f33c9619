// WRONG: both gates of leg A are on together for 4 of 16 clocks (shoot-through).
module short (
    input  wire clk,
    input  wire rst,
    input  wire enc_a,
    input  wire enc_b,
    output reg  a_high,
    output reg  a_low,
    output wire b_high,
    output wire b_low
);
    reg [3:0] n;
    always @(posedge clk)
        if (rst) begin
            n <= 4'd0; a_high <= 1'b0; a_low <= 1'b0;
        end else begin
            n      <= n + 4'd1;
            a_high <= (n < 4'd8);
            a_low  <= (n >= 4'd4);
        end
    assign b_high = 1'b0;
    assign b_low  = ~rst | (enc_a & enc_b);
endmodule
