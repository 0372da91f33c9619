// A decoder of somebody else's: two bits of state, a table of the sixteen transitions.
module quad_x4 #(parameter WAIT = 3) (
  input  wire       c, clear,
  input  wire       ch_a, ch_b,
  output reg  signed [1:0] move,
  output reg        lost
);
  localparam BITS = $clog2(WAIT + 2);
  reg [1:0]      was;
  reg [BITS-1:0] wait_for;
  always @(posedge c)
    if (clear) begin
      {was, move, lost} <= 0;
      wait_for <= WAIT;
    end else begin
      was  <= {ch_a, ch_b};
      move <= 0;
      if (wait_for != 0)
        wait_for <= wait_for - 1'b1;
      else case ({was, ch_a, ch_b})
        4'b0001, 4'b0111, 4'b1110, 4'b1000: move <= 1;
        4'b0100, 4'b1101, 4'b1011, 4'b0010: move <= -1;
        4'b0011, 4'b1100, 4'b0110, 4'b1001: lost <= 1;
        default: ;
      endcase
    end
endmodule
