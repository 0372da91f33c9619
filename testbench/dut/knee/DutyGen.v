// DutyGen -- sign-magnitude pulse-width modulator.
//
// A sawtooth of 2^PW - 1 clocks, so that a magnitude of 2^PW - 1 is on all the
// time and 0 is off all the time.  Magnitude and direction are taken together
// at the start of a period; they never change within one.
//
// PW = 10 at 10 MHz: a period of 102.3 us (9.775 kHz).
`default_nettype none

module DutyGen #(
    parameter PW = 10
) (
    input  wire          clk,
    input  wire          rst,                // synchronous, active high
    input  wire [PW-1:0] magnitude,
    input  wire          forward,            // 1: positive motor voltage
    output reg           pwm,
    output reg           dir
);

    localparam [PW-1:0] LAST = {{(PW-1){1'b1}}, 1'b0};   // 2^PW - 2
    localparam [PW-1:0] ONE  = {{(PW-1){1'b0}}, 1'b1};

    reg [PW-1:0] ramp;
    reg [PW-1:0] mag_held;
    reg          fwd_held;

    always @(posedge clk) begin
        if (rst) begin
            ramp     <= {PW{1'b0}};
            mag_held <= {PW{1'b0}};
            fwd_held <= 1'b1;
            pwm      <= 1'b0;
            dir      <= 1'b1;
        end else begin
            if (ramp == LAST) begin
                ramp     <= {PW{1'b0}};
                mag_held <= magnitude;
                fwd_held <= forward;
            end else
                ramp     <= ramp + ONE;
            pwm <= (ramp < mag_held);
            dir <= fwd_held;
        end
    end

endmodule

`default_nettype wire
