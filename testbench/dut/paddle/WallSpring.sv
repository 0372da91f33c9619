// WallSpring -- the law of the wall, on the logic clock.
//
// Beyond WALL_AT counts the drive is
//
//     -( STIFF * depth + DAMP * moved ) / 16              in steps of the PWM
//
// depth  counts beyond the wall
// moved  counts gained over the last TRAIL samples, one sample every PACE clocks
//
// limited to -(2^PWM_BITS - 1) .. 0: the wall pushes and never pulls.
//
// "awake" is high while positions come: it rises with the first valid one and
// falls after STALE clocks without any.
//
// Latency: a valid position is on "drive" after two clocks.
module WallSpring #(
    parameter int          POS_BITS = 18,
    parameter int          PWM_BITS = 11,
    parameter int unsigned STIFF    = 190,   // 1/16 PWM step a count
    parameter int unsigned DAMP     = 16,    // 1/16 PWM step a count moved
    parameter int          WALL_AT  = 978,
    parameter int unsigned PACE     = 500,
    parameter int unsigned TRAIL    = 4,
    parameter int unsigned STALE    = 5000
) (
    input  logic                       clk,
    input  logic                       rst_n,      // synchronous, active low
    input  logic signed [POS_BITS-1:0] pos,
    input  logic                       pos_valid,
    output logic signed [PWM_BITS:0]   drive,
    output logic                       awake
);
    localparam int DIFF_BITS  = POS_BITS + 1;      // a difference of positions
    localparam int FORCE_BITS = DIFF_BITS + 16;    // times a gain of 15 bits
    localparam int PACE_BITS  = $clog2(PACE + 1);
    localparam int STALE_BITS = $clog2(STALE + 1);

    typedef logic signed [POS_BITS-1:0]   position_t;
    typedef logic signed [DIFF_BITS-1:0]  difference_t;
    typedef logic signed [FORCE_BITS-1:0] force_t;

    localparam difference_t WALL       = difference_t'(WALL_AT);
    localparam force_t      STIFF_WORD = force_t'(STIFF);
    localparam force_t      DAMP_WORD  = force_t'(DAMP);
    localparam force_t      MOST       = force_t'((1 << PWM_BITS) - 1);

    // ---------------------------------------------------------- position in
    position_t             here;
    logic [STALE_BITS-1:0] patience;

    always_ff @(posedge clk) begin
        if (!rst_n) begin
            here     <= '0;
            patience <= '0;
        end else if (pos_valid) begin
            here     <= pos;
            patience <= STALE_BITS'(STALE);
        end else if (patience != '0) begin
            patience <= patience - 1'b1;
        end
    end

    assign awake = (patience != '0);

    // ------------------------------------------- where it was, sample by sample
    position_t            trail [TRAIL];           // trail[0] is the latest
    difference_t          moved;
    logic [PACE_BITS-1:0] pace;
    logic                 fresh;                   // trail holds positions

    always_ff @(posedge clk) begin
        if (!rst_n || !awake) begin
            for (int i = 0; i < int'(TRAIL); i++) trail[i] <= '0;
            moved <= '0;
            pace  <= '0;
            fresh <= 1'b0;
        end else if (!fresh) begin                 // start at rest, where it is
            for (int i = 0; i < int'(TRAIL); i++) trail[i] <= here;
            fresh <= 1'b1;
        end else if (pace == PACE_BITS'(PACE - 1)) begin
            pace     <= '0;
            trail[0] <= here;
            for (int i = 1; i < int'(TRAIL); i++) trail[i] <= trail[i-1];
            moved    <= difference_t'(here) - difference_t'(trail[TRAIL-1]);
        end else begin
            pace <= pace + 1'b1;
        end
    end

    // -------------------------------------------------------------- the law
    difference_t depth;
    force_t      push;
    force_t      steps;

    always_comb begin
        depth = difference_t'(here) - WALL;
        push  = STIFF_WORD * force_t'(depth) + DAMP_WORD * force_t'(moved);
        steps = push >>> 4;
        if (depth <= 0 || steps < 0)  steps = '0;
        else if (steps > MOST)        steps = MOST;
    end

    always_ff @(posedge clk) begin
        if (!rst_n || !awake) drive <= '0;
        else                  drive <= -$signed((PWM_BITS+1)'(steps));
    end

endmodule
