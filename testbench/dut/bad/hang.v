// WRONG: once enc_a is 1, the while loop in the always block never ends (a one-hot word never is all ones).
module hang (
    input  wire clk,
    input  wire rst,
    input  wire enc_a,
    input  wire enc_b,
    output reg  pwm,
    output reg  dir
);
    reg [7:0] w;
    always @(posedge clk)
        if (rst) begin
            w = 8'h01; pwm <= 1'b0; dir <= 1'b0;
        end else begin
            if (enc_a)
                while (w != 8'hFF)
                    w = {w[6:0], w[7]};
            pwm <= w[0];
            dir <= enc_b;
        end
endmodule
