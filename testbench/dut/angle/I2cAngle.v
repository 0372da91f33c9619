// Reads the angle of an AS5600 again and again: writes the address of its register once, then reads two bytes a frame.
// SDA is an open drain: 1 at sda_out releases the line, 0 pulls it down, and sda is its level. A bit has four quarters:
// SDA is set, SCL rises, SDA is read, SCL falls.
module I2cAngle #(
    parameter QUARTER = 31        // clocks of a quarter of a bit
) (
    input  wire        clk,
    input  wire        rst,
    output reg         scl,
    output reg         sda_out,
    input  wire        sda,
    output reg  [11:0] angle,
    output reg         valid,     // 1 for a clock when a new angle has come
    output reg  [7:0]  refused    // bytes that the chip has not acknowledged
);
    localparam START = 2'd0, SEND = 2'd1, TAKE = 2'd2, STOP = 2'd3;

    // What is done: start, 0x6C, 0x0C, start, 0x6D, two bytes, stop; then again from the second start on.
    reg [2:0] step;
    wire [1:0] kind = step == 0 || step == 3 ? START : step == 7 ? STOP : step == 5 || step == 6 ? TAKE : SEND;
    wire [7:0] byte_out = step == 1 ? 8'h6C : step == 2 ? 8'h0C : 8'h6D;

    reg [7:0] wait_left;
    reg [1:0] quarter;
    reg [3:0] place;              // the bit of a byte; 8 is the acknowledgement
    reg [15:0] taken;

    wire [7:0] shifted = byte_out << place[2:0];
    wire sent = place == 8 ? 1'b1 : shifted[7];
    wire answer = place == 8 ? step == 6 : 1'b1;

    always @(posedge clk) begin
        valid <= 0;
        if (rst) begin
            scl <= 1;
            sda_out <= 1;
            angle <= 0;
            refused <= 0;
            step <= 0;
            quarter <= 0;
            place <= 0;
            taken <= 0;
            wait_left <= QUARTER - 1;
        end else if (wait_left != 0) begin
            wait_left <= wait_left - 1;
        end else begin
            wait_left <= QUARTER - 1;
            quarter <= quarter + 1;
            case (kind)
                START: case (quarter)
                    0: sda_out <= 1;
                    1: scl <= 1;
                    2: sda_out <= 0;
                    3: scl <= 0;
                endcase
                STOP: case (quarter)
                    0: sda_out <= 0;
                    1: scl <= 1;
                    2: sda_out <= 1;
                    3: begin
                        angle <= taken[11:0];
                        valid <= 1;
                    end
                endcase
                default: case (quarter)
                    0: sda_out <= kind == SEND ? sent : answer;
                    1: scl <= 1;
                    2: begin
                        if (kind == TAKE && place != 8) taken <= {taken[14:0], sda};
                        if (kind == SEND && place == 8 && sda) refused <= refused + 1;
                    end
                    3: scl <= 0;
                endcase
            endcase
            if (quarter == 3) begin
                if ((kind == SEND || kind == TAKE) && place != 8) begin
                    place <= place + 1;
                end else begin
                    place <= 0;
                    step <= step == 7 ? 3'd3 : step + 3'd1;
                end
            end
        end
    end
endmodule
