// PaddleDrive -- haptic paddle: a virtual wall rendered through a dual half-bridge
// driver.  Top of the design.
//
// Two clocks: clk_logic (5 MHz) for the law of the wall, clk_pwm (20 MHz, four
// times as fast, rising edges aligned) for the modulator only.
module PaddleDrive #(
    parameter int          POS_BITS = 18,    // at most 24
    parameter int          PWM_BITS = 11,
    parameter int unsigned STIFF    = 190,   // 1/16 PWM step a count
    parameter int unsigned DAMP     = 16,    // 1/16 PWM step a count moved
    parameter int          WALL_AT  = 978,   // counts
    parameter int unsigned PACE     = 500,   // logic clocks between samples
    parameter int unsigned TRAIL    = 4,     // samples that "moved" reaches back
    parameter int unsigned STALE    = 5000   // logic clocks without a position
) (
    input  logic                       clk_logic,
    input  logic                       clk_pwm,
    input  logic                       rst_n,      // synchronous to clk_logic
    input  logic signed [POS_BITS-1:0] pos,        // from the counter chip
    input  logic                       pos_valid,
    output logic                       in1,
    output logic                       in2,
    output logic                       sleep_n
);
    logic signed [PWM_BITS:0] drive;
    logic                     awake;

    WallSpring #(
        .POS_BITS(POS_BITS), .PWM_BITS(PWM_BITS), .STIFF(STIFF), .DAMP(DAMP),
        .WALL_AT(WALL_AT), .PACE(PACE), .TRAIL(TRAIL), .STALE(STALE)
    ) spring (
        .clk(clk_logic), .rst_n, .pos, .pos_valid, .drive, .awake
    );

    DutyBridge #(.PWM_BITS(PWM_BITS)) bridge (
        .clk_logic, .rst_n, .drive, .clk_pwm, .in1, .in2
    );

    // The driver sleeps in reset and while no positions come.
    always_ff @(posedge clk_logic) sleep_n <= rst_n & awake;

endmodule
