// QuadTrack -- x4 quadrature tracker for an incremental encoder.
//
// The two lines come straight from the pins.  Each goes through two
// flip-flops before anything looks at it.  For positive motion the lines
// {A,B} run 00, 01, 11, 10; folding the Gray code gives a two-bit phase that
// runs 0, 1, 2, 3, and the difference of two phases is the step itself.
// A difference of two (both lines at once) cannot be told forward from
// backward and is ignored.
//
// The lines may rest at any phase when reset is released: nothing is counted
// until the synchroniser has been filled ("warm"), so the count starts at 0.
//
// Latency: line to count, three rising edges of clk.
`default_nettype none

module QuadTrack #(
    parameter CW = 18                        // width of the count
) (
    input  wire                 clk,
    input  wire                 rst,         // synchronous, active high
    input  wire                 line_a,      // asynchronous
    input  wire                 line_b,      // asynchronous
    output reg  signed [CW-1:0] count
);

    reg  [1:0] sync_a;
    reg  [1:0] sync_b;
    reg  [1:0] phase_was;
    reg  [1:0] warm;

    wire [1:0] phase_now = {sync_a[1], sync_a[1] ^ sync_b[1]};
    wire [1:0] hop       = phase_now - phase_was;

    always @(posedge clk) begin
        if (rst) begin
            sync_a    <= 2'b00;
            sync_b    <= 2'b00;
            phase_was <= 2'd0;
            warm      <= 2'd0;
            count     <= {CW{1'b0}};
        end else begin
            sync_a    <= {sync_a[0], line_a};
            sync_b    <= {sync_b[0], line_b};
            phase_was <= phase_now;
            if (warm != 2'd3)
                warm <= warm + 2'd1;
            else case (hop)
                2'd1:    count <= count + {{(CW-1){1'b0}}, 1'b1};
                2'd3:    count <= count - {{(CW-1){1'b0}}, 1'b1};
                default: count <= count;
            endcase
        end
    end

endmodule

`default_nettype wire
