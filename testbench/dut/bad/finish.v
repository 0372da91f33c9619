// WRONG: the design ends the simulation itself, with $finish at the 1000th clock after reset.
module finish (
    input  wire clk,
    input  wire rst,
    input  wire enc_a,
    input  wire enc_b,
    output reg  pwm,
    output reg  dir
);
    reg [9:0] n;
    always @(posedge clk)
        if (rst) begin
            n <= 10'd0; pwm <= 1'b0; dir <= 1'b0;
        end else begin
            n   <= n + 10'd1;
            pwm <= enc_a;
            dir <= enc_b;
            if (n == 10'd999) $finish;
        end
endmodule
