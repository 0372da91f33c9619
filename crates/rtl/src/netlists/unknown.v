// Techmap rules for Yosys: cells whose result is unknown (X) for some inputs, where Yosys's SMT-LIB has a number.
// They are applied once, to the netlist as it was read.

// Bits that are selected beside the word are unknown.
module \$shiftx (A, B, Y);
  parameter A_SIGNED = 0;
  parameter B_SIGNED = 0;
  parameter A_WIDTH = 1;
  parameter B_WIDTH = 1;
  parameter Y_WIDTH = 1;
  input [A_WIDTH-1:0] A;
  input [B_WIDTH-1:0] B;
  output [Y_WIDTH-1:0] Y;
  wire [Y_WIDTH-1:0] word, is_inside;
  \$shift #(.A_SIGNED(0), .B_SIGNED(B_SIGNED), .A_WIDTH(A_WIDTH), .B_WIDTH(B_WIDTH), .Y_WIDTH(Y_WIDTH))
    of_word (.A(A), .B(B), .Y(word));
  \$shift #(.A_SIGNED(0), .B_SIGNED(B_SIGNED), .A_WIDTH(A_WIDTH), .B_WIDTH(B_WIDTH), .Y_WIDTH(Y_WIDTH))
    of_ones (.A({A_WIDTH{1'b1}}), .B(B), .Y(is_inside));
  genvar i;
  generate
    for (i = 0; i < Y_WIDTH; i = i + 1) begin : bits
      assign Y[i] = is_inside[i] ? word[i] : 1'bx;
    end
  endgenerate
endmodule

// A quotient or a remainder by 0 is unknown.
`define DIVIDES(KIND) \
  module KIND (A, B, Y); \
    parameter A_SIGNED = 0; \
    parameter B_SIGNED = 0; \
    parameter A_WIDTH = 1; \
    parameter B_WIDTH = 1; \
    parameter Y_WIDTH = 1; \
    input [A_WIDTH-1:0] A; \
    input [B_WIDTH-1:0] B; \
    output [Y_WIDTH-1:0] Y; \
    wire [Y_WIDTH-1:0] word; \
    KIND #(.A_SIGNED(A_SIGNED), .B_SIGNED(B_SIGNED), .A_WIDTH(A_WIDTH), .B_WIDTH(B_WIDTH), .Y_WIDTH(Y_WIDTH)) \
      divides (.A(A), .B(B), .Y(word)); \
    assign Y = |B ? word : {Y_WIDTH{1'bx}}; \
  endmodule

`DIVIDES(\$div )
`DIVIDES(\$mod )
`DIVIDES(\$divfloor )
`DIVIDES(\$modfloor )

// A choice of several at once, which `parallel_case` promises not to make, is unknown.
module \$pmux (A, B, S, Y);
  parameter WIDTH = 1;
  parameter S_WIDTH = 1;
  input [WIDTH-1:0] A;
  input [WIDTH*S_WIDTH-1:0] B;
  input [S_WIDTH-1:0] S;
  output [WIDTH-1:0] Y;
  wire [WIDTH-1:0] word;
  wire [S_WIDTH-1:0] above = S & (S - 1'b1);
  \$pmux #(.WIDTH(WIDTH), .S_WIDTH(S_WIDTH)) selects (.A(A), .B(B), .S(S), .Y(word));
  assign Y = |above ? {WIDTH{1'bx}} : word;
endmodule

// A net that its buffer does not drive is unknown.
module \$tribuf (A, EN, Y);
  parameter WIDTH = 1;
  input [WIDTH-1:0] A;
  input EN;
  output [WIDTH-1:0] Y;
  assign Y = EN ? A : {WIDTH{1'bx}};
endmodule

// No bit of a known word is X or Z.
`define IDENTICAL(KIND, PLAIN, DIFFERS) \
  module KIND (A, B, Y); \
    parameter A_SIGNED = 0; \
    parameter B_SIGNED = 0; \
    parameter A_WIDTH = 1; \
    parameter B_WIDTH = 1; \
    parameter Y_WIDTH = 1; \
    parameter _TECHMAP_CONSTMSK_A_ = 0; \
    parameter _TECHMAP_CONSTVAL_A_ = 0; \
    parameter _TECHMAP_CONSTMSK_B_ = 0; \
    parameter _TECHMAP_CONSTVAL_B_ = 0; \
    input [A_WIDTH-1:0] A; \
    input [B_WIDTH-1:0] B; \
    output [Y_WIDTH-1:0] Y; \
    localparam is_unknown_a = (^(_TECHMAP_CONSTVAL_A_ | ~_TECHMAP_CONSTMSK_A_)) === 1'bx; \
    localparam is_unknown_b = (^(_TECHMAP_CONSTVAL_B_ | ~_TECHMAP_CONSTMSK_B_)) === 1'bx; \
    generate \
      if (is_unknown_a != is_unknown_b) \
        assign Y = DIFFERS; \
      else \
        PLAIN #(.A_SIGNED(A_SIGNED), .B_SIGNED(B_SIGNED), .A_WIDTH(A_WIDTH), .B_WIDTH(B_WIDTH), \
                .Y_WIDTH(Y_WIDTH)) compares (.A(A), .B(B), .Y(Y)); \
    endgenerate \
  endmodule

`IDENTICAL(\$eqx , \$eq , 1'b0)
`IDENTICAL(\$nex , \$ne , 1'b1)
