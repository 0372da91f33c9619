-- filtered_difference : backward difference behind a first-order low pass
--
-- At a sample edge:
--   d        := (position - previous) mod 2^WIDTH, read as two's complement
--   velocity := velocity + rounded((d * 2^OUT_FRAC - velocity) * WEIGHT / 2^SHIFT)
--   previous := position
--
-- A low pass with alpha = WEIGHT / 2^SHIFT, by a shift alone where WEIGHT is 1: its
-- time constant is about 1/alpha - 1/2 sample periods, its corner
-- -ln(1 - alpha) / (2 pi T). Truncation, a floor, leaves a standing velocity less
-- than 1/alpha LSB below the steady d; a rounding to the nearest leaves it at most
-- half of that beside it.
--
-- generics WIDTH         bits of the position
--          PERIOD_WIDTH  bits of the period, 2 to 30
--          SHIFT         alpha is WEIGHT / 2^SHIFT; 0 does not filter
--          WEIGHT        1 to 2^SHIFT
--          OUT_FRAC      fraction bits of the velocity
--          ROUNDING      how a step of the velocity is rounded, of rounding_pkg; 0
--                        truncates, towards -infinity
-- in       position (0,WIDTH,0)
--          period   (0,PERIOD_WIDTH,0)   sample period in clocks, 0 acts as 1
-- out      velocity (1,WIDTH-1,OUT_FRAC) counts per sample
-- latency  1 edge, sample edges only; a new period takes effect at the next
--          sample edge
-- reset    velocity 0, previous 0; the first edge after it is a sample edge
-- overflow the difference wraps with the counter; the velocity, always between
--          the last one and d, has none
-- source   the first-order low pass of every textbook
-- differs from the hardware: none known.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.rounding_pkg.all;

entity filtered_difference is
  generic (
    WIDTH        : positive := 12;
    PERIOD_WIDTH : positive range 2 to 30 := 24;
    SHIFT        : natural  := 3;
    WEIGHT       : positive := 1;
    OUT_FRAC     : natural  := 8;
    ROUNDING     : rounding_mode := TRUNCATE
  );
  port (
    clk      : in  std_logic;
    rst      : in  std_logic;
    position : in  std_logic_vector(WIDTH - 1 downto 0);
    period   : in  std_logic_vector(PERIOD_WIDTH - 1 downto 0);
    velocity : out std_logic_vector(WIDTH + OUT_FRAC - 1 downto 0)
  );
end entity;

architecture rtl of filtered_difference is

  constant OUT_WIDTH : positive := WIDTH + OUT_FRAC;
  -- Bits that the weight adds.
  constant GAIN_WIDTH : natural := minimum(WEIGHT - 1, 1) * (SHIFT + 2);

begin

  process (clk)
    -- 2^PERIOD_WIDTH - 2, written to stay inside an integer for 31 bits.
    variable countdown : natural range 0 to 2 * (2**(PERIOD_WIDTH - 1) - 1);
    variable previous  : unsigned(WIDTH - 1 downto 0);
    variable d         : signed(WIDTH - 1 downto 0);
    -- One bit more than a velocity, for the difference of two.
    variable state     : signed(OUT_WIDTH downto 0);
    variable target    : signed(OUT_WIDTH downto 0);
    -- Times the weight, and one bit more, for what a rounding adds.
    variable way       : signed(OUT_WIDTH + GAIN_WIDTH + 1 downto 0);
  begin
    if rising_edge(clk) then
      if countdown = 0 then
        d        := signed(unsigned(position) - previous);
        previous := unsigned(position);
        target   := shift_left(resize(d, OUT_WIDTH + 1), OUT_FRAC);
        way      := resize(target - state, way'length);
        if WEIGHT > 1 then
          way := resize((target - state) * to_signed(WEIGHT, SHIFT + 2), way'length);
        end if;
        state    := state + resize(rounded(way, SHIFT, ROUNDING), OUT_WIDTH + 1);
        velocity <= std_logic_vector(state(OUT_WIDTH - 1 downto 0));

        countdown := maximum(to_integer(unsigned(period)), 1) - 1;
      else
        countdown := countdown - 1;
      end if;

      if rst = '1' then
        countdown := 0;
        previous  := (others => '0');
        state     := (others => '0');
        velocity  <= (others => '0');
      end if;
    end if;
  end process;

end architecture;
