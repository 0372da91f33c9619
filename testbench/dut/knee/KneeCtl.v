// KneeCtl -- soft end stop for a motorised knee joint.
//
// Beyond "wall" (encoder counts) the motor pushes back:
//
//     magnitude = ( gain * depth + KD * speed ) / 16      in PWM counts
//
// depth  counts beyond the wall, limited to 4095
// speed  counts gained in the last VDIV clocks, limited to +-511
//
// The sum is limited to 0 .. 2^PW - 1: the stop only ever pushes, it never
// holds the leg back when it leaves.  The voltage of a push is negative.
//
// With 4096 counts a turn, 24 V and 10 bits of PWM, and a motor of 0.265 N.m at
// standstill, gain = 95 is about 1.0 N.m/rad.
//
// Latency: position to magnitude three clocks; then the next PWM period.
`default_nettype none

module KneeCtl #(
    parameter        PW   = 10,              // PWM bits, 4 to 16
    parameter        CW   = 18,              // position counter bits, 16 to 32
    parameter [7:0]  KD   = 8'd16,           // damping, 1/16 PWM count per count/VDIV
    parameter [15:0] VDIV = 16'd2000         // clocks between velocity samples
) (
    input  wire               clk,           // 10 MHz
    input  wire               rst,           // synchronous, active high
    input  wire               enc_a,         // asynchronous
    input  wire               enc_b,         // asynchronous
    input  wire        [9:0]  gain,          // 1/16 PWM count per encoder count
    input  wire signed [15:0] wall,          // encoder counts
    output wire               pwm,
    output wire               dir,           // 1: positive direction
    output wire               touching,      // lamp: position is beyond the wall
    output wire        [15:0] position       // low 16 bits of the count
);

    // ------------------------------------------------------------ position
    wire signed [CW-1:0] count;

    QuadTrack #(.CW(CW)) u_track (
        .clk    (clk),
        .rst    (rst),
        .line_a (enc_a),
        .line_b (enc_b),
        .count  (count)
    );

    assign position = count[15:0];

    // --------------------------------------------- stage 1: depth and speed
    localparam DW = 12;                      // depth bits
    localparam SW = 10;                      // speed bits, signed

    wire signed [CW:0] pen    = {count[CW-1], count} - {{(CW-15){wall[15]}}, wall};
    wire               beyond = ~pen[CW] & (|pen[CW-1:0]);

    localparam [15:0] VLAST = VDIV - 16'd1;

    reg         [15:0]   divide;
    reg  signed [CW-1:0] count_was;
    reg  signed [SW-1:0] speed;
    wire signed [CW-1:0] moved = count - count_was;
    // All bits above the sign of the narrow word equal it: it fits.
    wire                 fits  = (moved[CW-1:SW-1] == {(CW-SW+1){moved[CW-1]}});

    reg         [DW-1:0] depth;
    reg                  contact;

    always @(posedge clk) begin
        if (rst) begin
            depth     <= {DW{1'b0}};
            contact    <= 1'b0;
            divide    <= 16'd0;
            count_was <= {CW{1'b0}};
            speed     <= {SW{1'b0}};
        end else begin
            contact <= beyond;
            if (!beyond)
                depth <= {DW{1'b0}};
            else if (|pen[CW-1:DW])
                depth <= {DW{1'b1}};
            else
                depth <= pen[DW-1:0];

            if (divide == VLAST) begin
                divide    <= 16'd0;
                count_was <= count;
                if (fits)
                    speed <= moved[SW-1:0];
                else                         // as far as it goes, but not -512
                    speed <= {moved[CW-1], {(SW-2){~moved[CW-1]}}, 1'b1};
            end else
                divide <= divide + 16'd1;
        end
    end

    assign touching = contact;

    // ------------------------------------------------- stage 2: two products
    reg         [21:0] spring;               // 10 x 12 bits
    reg  signed [18:0] damper;               //  9 x 10 bits
    reg                push;

    wire signed [8:0]  kd_word = {1'b0, KD};

    always @(posedge clk) begin
        if (rst) begin
            spring <= 22'd0;
            damper <= 19'sd0;
            push   <= 1'b0;
        end else begin
            spring <= {12'd0, gain} * {10'd0, depth};
            damper <= {{10{kd_word[8]}}, kd_word} * {{9{speed[SW-1]}}, speed};
            push   <= contact;
        end
    end

    // --------------------------------------------- stage 3: sum and limiter
    wire signed [23:0] sum   = {2'b00, spring} + {{5{damper[18]}}, damper};
    wire        [23:0] limit = {{(20-PW){1'b0}}, {PW{1'b1}}, 4'hF};

    reg  [PW-1:0] magnitude;

    always @(posedge clk) begin
        if (rst)
            magnitude <= {PW{1'b0}};
        else if (!push || sum[23])
            magnitude <= {PW{1'b0}};
        else if ($unsigned(sum) > limit)
            magnitude <= {PW{1'b1}};
        else
            magnitude <= sum[PW+3:4];
    end

    // -------------------------------------------------------------- output
    wire idle = (magnitude == {PW{1'b0}});

    DutyGen #(.PW(PW)) u_duty (
        .clk       (clk),
        .rst       (rst),
        .magnitude (magnitude),
        .forward   (idle),                   // a push is negative
        .pwm       (pwm),
        .dir       (dir)
    );

endmodule

`default_nettype wire
