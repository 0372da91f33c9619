// WRONG: "phase" is neither reset nor initialised and decides pwm (X for ever in 4 states, a random word in 2).
module uninit (
    input  wire clk,
    input  wire rst,
    input  wire enc_a,
    input  wire enc_b,
    output reg  pwm,
    output reg  dir
);
    reg [7:0] phase;
    always @(posedge clk) begin
        phase <= phase + 8'd1;
        if (rst) begin
            pwm <= 1'b0; dir <= 1'b0;
        end else begin
            pwm <= (phase < 8'd64) & enc_a;
            dir <= enc_b;
        end
    end
endmodule
