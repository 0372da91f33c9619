-- clarke : phase currents to the two axes of the stator, with a phase's amplitude
--
--   alpha = a                            beta = narrow((a + 2*b) * C)
-- with THREE:
--   alpha = narrow((2*a - b - c) * T)    beta = narrow((b - c) * C)
--
-- C is 1/sqrt(3) and T is 1/3, each to the nearest of F = WIDTH + FRAC + 2 fraction
-- bits. Two currents tell the third, a + b + c = 0; of three, a common part drops
-- out. alpha and beta are off by at most 11/16 of their lowest bit: 1/2 of rounding,
-- 3/16 of the factor.
--
-- generics WIDTH  bits of a current, 2 to 18
--          FRAC   fraction bits of alpha and beta, at most 10
--          THREE  all three currents are measured
-- in       a, b  (1,WIDTH-1,0)
--          c     (1,WIDTH-1,0)    ignored without THREE
-- out      alpha (1,WIDTH,FRAC)   along phase a
--          beta  (1,WIDTH,FRAC)   across phase a, a quarter of a turn ahead
-- latency  0, combinational
-- reset    none
-- overflow none; narrowing rounds to nearest, ties up
-- source   Clarke 1943, scaled to equal amplitudes
-- differs from the hardware: no propagation delay, so no limit on the clock.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity clarke is
  generic (
    WIDTH : positive := 12;
    FRAC  : natural  := 3;
    THREE : boolean  := false
  );
  port (
    a     : in  std_logic_vector(WIDTH - 1 downto 0);
    b     : in  std_logic_vector(WIDTH - 1 downto 0);
    c     : in  std_logic_vector(WIDTH - 1 downto 0);
    alpha : out std_logic_vector(WIDTH + FRAC downto 0);
    beta  : out std_logic_vector(WIDTH + FRAC downto 0)
  );
end entity;

architecture rtl of clarke is

  constant F         : positive := WIDTH + FRAC + 2;
  constant DROP      : positive := F - FRAC;
  constant OUT_WIDTH : positive := WIDTH + FRAC + 1;
  -- Room for four currents, and for their product with a factor below 1.
  constant SUM_WIDTH : positive := WIDTH + 2;
  constant ALL_WIDTH : positive := SUM_WIDTH + F + 1;

  constant C_FACTOR : signed(F downto 0)
    := to_signed(integer(0.57735026918962576451 * 2.0**F), F + 1);
  constant T_FACTOR : signed(F downto 0) := to_signed((2**F + 1) / 3, F + 1);

  subtype sum_word is signed(SUM_WIDTH - 1 downto 0);

  function extended(word : std_logic_vector) return sum_word is
  begin
    return resize(signed(word), SUM_WIDTH);
  end function;

  function narrow(product : signed(ALL_WIDTH - 1 downto 0)) return std_logic_vector is
    constant SUM : signed(ALL_WIDTH - 1 downto 0)
      := product + shift_left(to_signed(1, ALL_WIDTH), DROP - 1);
  begin
    return std_logic_vector(SUM(DROP + OUT_WIDTH - 1 downto DROP));
  end function;

  signal across : sum_word;

begin

  three_currents : if THREE generate
    signal along : sum_word;
  begin
    along  <= shift_left(extended(a), 1) - extended(b) - extended(c);
    across <= extended(b) - extended(c);
    alpha  <= narrow(along * T_FACTOR);
  end generate;

  two_currents : if not THREE generate
    across <= extended(a) + shift_left(extended(b), 1);
    alpha  <= std_logic_vector(shift_left(resize(signed(a), OUT_WIDTH), FRAC));
  end generate;

  beta <= narrow(across * C_FACTOR);

end architecture;
