// WRONG: syntax error in line 10, the semicolon is missing after "pwm <= enc_a" (tools may tell line 11).
module syntax (
    input  wire clk,
    input  wire enc_a,
    input  wire enc_b,
    output reg  pwm,
    output reg  dir
);
    always @(posedge clk) begin
        pwm <= enc_a
        dir <= enc_b;
    end
endmodule
