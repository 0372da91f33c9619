// A wall behind field-oriented control: two phase currents and the angle of an AS5047P in, six gates out.
// One period of the modulator is 2 * TOP clocks. At its peak, where all low switches are on, both converters and a frame
// of the angle's bus start; with their words the currents are controlled, and the new duties hold from the next valley on.
module FocDrive #(
    parameter TOP = 1250,         // half a period, in clocks
    parameter DEAD = 25,          // clocks between the switches of a leg
    parameter POLES = 7,          // pairs of poles
    parameter ZERO = 0,           // word of the angle at which the magnets' axis is that of phase a
    parameter KP = 404,           // steps of duty for a step of current, in 1/256
    parameter KI = 34,            // the same, once a period
    parameter LIMIT = 1500        // the most steps of current
) (
    input  wire               clk,
    input  wire               rst,
    output reg                adc_start,
    input  wire               adc_done,
    input  wire signed [11:0] ia,
    input  wire signed [11:0] ib,
    output wire               csn, sck, mosi,
    input  wire               miso,
    input  wire signed [15:0] wall,
    input  wire        [7:0]  gain,     // steps of current for a step of the angle, in 1/16
    input  wire        [7:0]  damping,  // the same for a step a period, in 1/4
    output wire               a_high, a_low, b_high, b_low, c_high, c_low
);
    // The carrier, up and down.
    reg [11:0] count;
    reg        down;
    wire       valley = !down && count == 0;
    wire       peak = down && count == TOP;
    always @(posedge clk)
        if (rst) begin
            count <= 0;
            down <= 0;
        end else if (down) begin
            if (count == 0) down <= 0; else count <= count - 1;
        end else begin
            if (count == TOP) down <= 1; else count <= count + 1;
        end

    always @(posedge clk) adc_start <= !rst && peak;

    wire [13:0] angle;
    wire        angle_done;
    AngleBus bus(.clk(clk), .rst(rst), .start(adc_start), .csn(csn), .sck(sck), .mosi(mosi), .miso(miso),
        .angle(angle), .done(angle_done));

    // A quarter of a sine of amplitude 2047, by 256 places.
    reg [10:0] quarter [0:255];
    initial $readmemh("sine.hex", quarter);
    reg [9:0] place;
    reg       negative;
    wire [10:0] size = quarter[place[8] ? ~place[7:0] : place[7:0]];
    wire signed [12:0] wave = negative ? -$signed({2'b0, size}) : $signed({2'b0, size});

    reg [3:0] step;
    reg [13:0] electrical;
    reg signed [12:0] sine, cosine;
    // 32 bits, so that products are whole.
    reg signed [31:0] alpha, beta, d, q, aim;
    reg signed [31:0] depth, speed;
    reg [13:0] previous;
    wire [13:0] turned = angle - previous;
    reg signed [23:0] sum_d, sum_q;
    reg signed [31:0] vd, vq, va, vb, v1, v2, v3, low, high;
    reg signed [15:0] duty_a, duty_b, duty_c;

    function signed [31:0] clip(input signed [31:0] x, input signed [31:0] most);
        clip = x > most ? most : x < -most ? -most : x;
    endfunction
    function signed [31:0] held(input signed [31:0] x);
        held = x > TOP / 2 ? TOP / 2 : x < -(TOP / 2) ? -(TOP / 2) : x;
    endfunction
    function signed [23:0] wound(input signed [31:0] x);
        wound = x > 128 * TOP ? 128 * TOP : x < -128 * TOP ? -128 * TOP : x[23:0];
    endfunction

    always @(posedge clk)
        if (rst) begin
            step <= 0;
            sum_d <= 0;
            sum_q <= 0;
            previous <= 0;
            duty_a <= TOP / 2;
            duty_b <= TOP / 2;
            duty_c <= TOP / 2;
        end else case (step)
            0: if (adc_done) begin
                alpha <= ia;
                beta <= (37837 * (ia + 2 * ib)) >>> 16;
                step <= 12;
            end
            12: if (angle_done) begin
                electrical <= (angle - ZERO[13:0]) * POLES;
                depth <= $signed({{18{angle[13]}}, angle}) - wall;
                speed <= $signed(turned);
                previous <= angle;
                step <= 1;
            end
            1: begin
                place <= electrical[13:4];
                negative <= electrical[13];
                aim <= depth > 0 ? clip(-((depth * $signed({1'b0, gain})) >>> 4)
                    - ((speed * $signed({1'b0, damping})) >>> 2), LIMIT) : 0;
                step <= 2;
            end
            2: begin
                sine <= wave;
                place <= electrical[13:4] + 10'd256;
                negative <= electrical[13] ^ electrical[12];
                step <= 3;
            end
            3: begin
                cosine <= wave;
                step <= 4;
            end
            4: begin
                d <= (alpha * cosine + beta * sine) >>> 11;
                q <= (beta * cosine - alpha * sine) >>> 11;
                step <= 5;
            end
            5: begin
                sum_d <= wound(sum_d - KI * d);
                sum_q <= wound(sum_q + KI * (aim - q));
                step <= 6;
            end
            6: begin
                vd <= held((sum_d - KP * d) >>> 8);
                vq <= held((sum_q + KP * (aim - q)) >>> 8);
                step <= 7;
            end
            7: begin
                va <= (vd * cosine - vq * sine) >>> 11;
                vb <= (vd * sine + vq * cosine) >>> 11;
                step <= 8;
            end
            8: begin
                v1 <= va;
                v2 <= (-va + ((113512 * vb) >>> 16)) >>> 1;
                v3 <= (-va - ((113512 * vb) >>> 16)) >>> 1;
                step <= 9;
            end
            9: begin
                low <= v1 < v2 ? (v1 < v3 ? v1 : v3) : (v2 < v3 ? v2 : v3);
                high <= v1 > v2 ? (v1 > v3 ? v1 : v3) : (v2 > v3 ? v2 : v3);
                step <= 10;
            end
            10: begin
                v1 <= TOP / 2 + v1 - ((low + high) >>> 1);
                v2 <= TOP / 2 + v2 - ((low + high) >>> 1);
                v3 <= TOP / 2 + v3 - ((low + high) >>> 1);
                step <= 11;
            end
            11: if (valley) begin
                duty_a <= v1;
                duty_b <= v2;
                duty_c <= v3;
                step <= 0;
            end
            default: step <= 0;
        endcase

    wire signed [15:0] at = {4'b0, count};
    FocLeg #(.DEAD(DEAD)) leg_a(.clk(clk), .rst(rst), .on(at < duty_a), .high(a_high), .low(a_low));
    FocLeg #(.DEAD(DEAD)) leg_b(.clk(clk), .rst(rst), .on(at < duty_b), .high(b_high), .low(b_low));
    FocLeg #(.DEAD(DEAD)) leg_c(.clk(clk), .rst(rst), .on(at < duty_c), .high(c_high), .low(c_low));
endmodule

// A leg: one switch opens at once, the other one closes DEAD clocks later.
module FocLeg #(
    parameter DEAD = 25
) (
    input  wire clk,
    input  wire rst,
    input  wire on,
    output reg  high,
    output reg  low
);
    reg       was;
    reg [7:0] wait_for;
    always @(posedge clk)
        if (rst) begin
            was <= 0;
            wait_for <= DEAD;
            high <= 0;
            low <= 0;
        end else if (on != was) begin
            was <= on;
            wait_for <= DEAD - 1;
            high <= 0;
            low <= 0;
        end else if (wait_for != 0) begin
            wait_for <= wait_for - 1;
        end else begin
            high <= was;
            low <= !was;
        end
endmodule

// Reads the register ANGLECOM again and again: a frame of 16 bits in mode 1, with a clock of clk / 8. The answer is the
// one to the frame before, and the angle at the beginning of this one. A word with a wrong parity or the error flag is
// left out.
module AngleBus (
    input  wire        clk,
    input  wire        rst,
    input  wire        start,
    output reg         csn,
    output reg         sck,
    output wire        mosi,
    input  wire        miso,
    output reg  [13:0] angle,
    output reg         done
);
    assign mosi = 1;     // the command is 16 ones
    reg [7:0]  tick;     // 0 is idle; 8 clocks a bit
    reg [15:0] word;
    always @(posedge clk)
        if (rst) begin
            csn <= 1;
            sck <= 0;
            tick <= 0;
            done <= 0;
            angle <= 0;
        end else begin
            done <= 0;
            if (tick == 0) begin
                csn <= !start;
                if (start) tick <= 1;
            end else begin
                tick <= tick + 1;
                if (tick >= 16 && tick < 144) begin
                    sck <= !tick[2];
                    if (tick[2:0] == 3'd3) word <= {word[14:0], miso};
                end else sck <= 0;
                if (tick == 160) begin
                    csn <= 1;
                    done <= 1;
                    tick <= 0;
                    if (^word == 0 && !word[14]) angle <= word[13:0];
                end
            end
        end
endmodule
