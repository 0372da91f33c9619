// DutyBridge -- takes the drive from the logic clock to the PWM clock and
// modulates the two half bridges.
//
// Handing over.  The logic side copies the drive to "parcel" every 2^LEISURE_BITS
// logic clocks and flips "bell" with it.  The PWM side passes the bell through two
// flip-flops and takes the parcel when it hears it; the parcel has then been still
// for longer than one PWM clock and stays so for many more.  That the edges of the
// clocks are aligned is therefore not relied on, and no word is ever torn.
//
// Modulation.  A sawtooth of 2^PWM_BITS - 1 PWM clocks; the last drive taken rules
// from the start of the next period.  Slow decay through the upper switches: the
// idle state is IN1 = IN2 = 1, and a pulse pulls one leg low:
//     drive > 0:  IN1 = 1, IN2 = not pulse   (motor voltage positive)
//     drive < 0:  IN1 = not pulse, IN2 = 1   (motor voltage negative)
// The bridge makes its own dead time.
module DutyBridge #(
    parameter int PWM_BITS     = 11,
    parameter int LEISURE_BITS = 3
) (
    input  logic                     clk_logic,
    input  logic                     rst_n,        // synchronous to clk_logic
    input  logic signed [PWM_BITS:0] drive,        // on clk_logic
    input  logic                     clk_pwm,
    output logic                     in1,
    output logic                     in2
);
    typedef logic [PWM_BITS-1:0] steps_t;

    // ----------------------------------------------------------- logic side
    logic [LEISURE_BITS-1:0]   leisure;
    logic signed [PWM_BITS:0]  parcel;
    logic                      bell;
    logic                      live = 1'b0;        // reset, as the PWM side sees it

    always_ff @(posedge clk_logic) begin
        live <= rst_n;
        if (!rst_n) begin
            leisure <= '0;
            parcel  <= '0;
            bell    <= 1'b0;
        end else begin
            leisure <= leisure + 1'b1;
            if (leisure == '1) begin
                parcel <= drive;
                bell   <= ~bell;
            end
        end
    end

    // ------------------------------------------------------------- PWM side
    logic [1:0] live_sync = 2'b00;
    logic [2:0] bell_sync;
    wire        go = live_sync[1];

    always_ff @(posedge clk_pwm) live_sync <= {live_sync[0], live};

    localparam steps_t LAST = {{(PWM_BITS-1){1'b1}}, 1'b0};   // 2^PWM_BITS - 2

    logic signed [PWM_BITS:0] taken;
    steps_t                   saw;
    steps_t                   width;
    logic                     negative;
    logic                     pulse;

    function automatic steps_t size_of(input logic signed [PWM_BITS:0] x);
        logic signed [PWM_BITS:0] size;
        size = x[PWM_BITS] ? -x : x;
        return size[PWM_BITS] ? '1 : size[PWM_BITS-1:0];      // -2^PWM_BITS: all
    endfunction

    always_ff @(posedge clk_pwm) begin
        if (!go) begin
            bell_sync <= '0;
            taken     <= '0;
            saw       <= '0;
            width     <= '0;
            negative  <= 1'b0;
        end else begin
            bell_sync <= {bell_sync[1:0], bell};
            if (bell_sync[2] != bell_sync[1]) taken <= parcel;

            if (saw == LAST) begin
                saw      <= '0;
                width    <= size_of(taken);
                negative <= taken[PWM_BITS];
            end else begin
                saw <= saw + 1'b1;
            end
        end
    end

    assign pulse = (saw < width);

    always_ff @(posedge clk_pwm) begin
        if (!go) begin
            in1 <= 1'b1;
            in2 <= 1'b1;
        end else begin
            in1 <= ~(pulse &  negative);
            in2 <= ~(pulse & ~negative);
        end
    end

endmodule
