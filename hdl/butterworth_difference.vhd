-- butterworth_difference : backward difference behind a second-order low pass
--
-- At a sample edge:
--   d        := (position - previous) mod 2^WIDTH, read as two's complement
--   y        := a biquad of d, with B0, 2 B0, B0, A1 and A2 = 4 B0 - 2^30 - A1 in
--               units of 2^-30
--   previous := position
-- velocity = saturate(floor(y / 2^GUARD + 1/2)), y in units of 2^-(OUT_FRAC + GUARD)
--
--   position -+-> hold -> previous -> d -> section -> y -> velocity
--             +---------------------->
--
-- A constant d comes through as it is. A Butterworth low pass of the corner f, by
-- the bilinear transform at a sample period T: with K = tan(pi f T) and
-- D = 1 + sqrt(2) K + K^2, B0 = K^2 / D and A1 = 2 (K^2 - 1) / D. At rest the
-- velocity is 0 if GUARD is at least log2(2^28 / B0) + 1.
--
-- generics WIDTH         bits of the position
--          PERIOD_WIDTH  bits of the period, 2 to 30
--          B0, A1        coefficients, in units of 2^-30; the poles lie inside the
--                        unit circle
--          GUARD         fraction bits of y beyond those of the velocity
--          OUT_FRAC      fraction bits of the velocity; with GUARD at most 30, with
--                        GUARD and WIDTH at most 40
-- in       position (0,WIDTH,0)
--          period   (0,PERIOD_WIDTH,0)   sample period in clocks, 0 acts as 1
-- out      velocity (1,WIDTH-1,OUT_FRAC) counts per sample
-- latency  1 edge, sample edges only; a new period takes effect at the next
--          sample edge
-- reset    velocity 0, previous 0; the first edge after it is a sample edge
-- overflow the difference wraps with the counter; y and the velocity saturate
-- source   the second-order Butterworth low pass of every textbook
-- differs from the hardware: five products and their sum take one edge, so no
--          limit on the clock.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.rounding_pkg.all;

entity butterworth_difference is
  generic (
    WIDTH        : positive := 12;
    PERIOD_WIDTH : positive range 2 to 30 := 24;
    B0           : positive := 576782;
    A1           : integer  := -2075951210;
    GUARD        : natural  := 10;
    OUT_FRAC     : natural  := 8
  );
  port (
    clk      : in  std_logic;
    rst      : in  std_logic;
    position : in  std_logic_vector(WIDTH - 1 downto 0);
    period   : in  std_logic_vector(PERIOD_WIDTH - 1 downto 0);
    velocity : out std_logic_vector(WIDTH + OUT_FRAC - 1 downto 0)
  );
end entity;

architecture rtl of butterworth_difference is

  constant OUT_WIDTH : positive := WIDTH + OUT_FRAC;

  -- Summed in an order in which every part is an integer of 32 bits.
  constant A2 : integer := ((((B0 - 2**30) - A1) + B0) + B0) + B0;

  -- One bit more, for what the rounding adds.
  subtype total_word is signed(OUT_WIDTH + GUARD downto 0);

  signal previous : std_logic_vector(WIDTH - 1 downto 0);
  signal d        : std_logic_vector(WIDTH - 1 downto 0);
  signal y        : std_logic_vector(OUT_WIDTH + GUARD - 1 downto 0);

  -- Only the upper end is ever met: a floor of a word that fits is never below it.
  function shown(value : std_logic_vector) return std_logic_vector is
    constant TOTAL : total_word := rounded(resize(signed(value), total_word'length), GUARD, NEAREST_UP);
    constant WORD  : signed(OUT_WIDTH downto 0) := resize(TOTAL, OUT_WIDTH + 1);
  begin
    if (WORD(OUT_WIDTH) xor WORD(OUT_WIDTH - 1)) = '1' then
      return std_logic_vector(not shift_left(to_signed(-1, OUT_WIDTH), OUT_WIDTH - 1));
    end if;
    return std_logic_vector(WORD(OUT_WIDTH - 1 downto 0));
  end function;

begin

  hold : entity work.zero_order_hold
    generic map (
      WIDTH        => WIDTH,
      PERIOD_WIDTH => PERIOD_WIDTH
    )
    port map (
      clk    => clk,
      rst    => rst,
      d      => position,
      period => period,
      q      => previous
    );

  d <= std_logic_vector(unsigned(position) - unsigned(previous));

  section : entity work.biquad
    generic map (
      IN_INT       => WIDTH - 1,
      IN_FRAC      => 0,
      OUT_INT      => WIDTH - 1,
      OUT_FRAC     => OUT_FRAC + GUARD,
      COEF_INT     => 1,
      COEF_FRAC    => 30,
      B0           => B0,
      B1           => 2 * B0,
      B2           => B0,
      A1           => A1,
      A2           => A2,
      PERIOD_WIDTH => PERIOD_WIDTH
    )
    port map (
      clk    => clk,
      rst    => rst,
      x      => d,
      period => period,
      y      => y
    );

  velocity <= shown(y);

end architecture;
