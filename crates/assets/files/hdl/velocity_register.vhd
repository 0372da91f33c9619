-- velocity_register : backward difference, sampled with a programmable period
--
-- At a sample edge:
--   d        := (position - previous) mod 2^WIDTH, read as two's complement
--   velocity := d                                            not RESCALED
--               saturate(floor(d * scale / 2^SCALE_FRAC))    RESCALED
--   previous := position
--
-- There is no division by the sample period: velocity is in counts per sample,
-- and the damping gain carries the rest. RESCALED multiplies by `scale`, which
-- makes it counts per reference sample whatever the period.
--
-- generics WIDTH         bits of the position
--          PERIOD_WIDTH  bits of the period, 2 to 30
--          RESCALED      multiply by scale
--          SCALE_WIDTH   bits of the scale
--          SCALE_FRAC    fraction bits of the scale
--          OUT_WIDTH     bits of the velocity
-- in       position (0,WIDTH,0)
--          period   (0,PERIOD_WIDTH,0)   sample period in clocks, 0 acts as 1
--          scale    (0,SCALE_WIDTH-SCALE_FRAC,SCALE_FRAC)  reference period
--                                        over period; ignored unless RESCALED
-- out      velocity (1,OUT_WIDTH-1,0)
-- latency  1 edge, sample edges only; a new period takes effect at the next
--          sample edge
-- reset    velocity 0, previous 0; the first edge after it is a sample edge
-- overflow the difference wraps with the counter; the velocity saturates
-- source   Vasudevan et al. 2007, Eq. (4)
-- differs from the hardware: RESCALED is an addition to the paper's design; its
--          product takes one edge, so no limit on the clock.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity velocity_register is
  generic (
    WIDTH        : positive := 12;
    PERIOD_WIDTH : positive range 2 to 30 := 24;
    RESCALED     : boolean  := false;
    SCALE_WIDTH  : positive := 16;
    SCALE_FRAC   : natural  := 8;
    OUT_WIDTH    : positive := 12
  );
  port (
    clk      : in  std_logic;
    rst      : in  std_logic;
    position : in  std_logic_vector(WIDTH - 1 downto 0);
    period   : in  std_logic_vector(PERIOD_WIDTH - 1 downto 0);
    scale    : in  std_logic_vector(SCALE_WIDTH - 1 downto 0);
    velocity : out std_logic_vector(OUT_WIDTH - 1 downto 0)
  );
end entity;

architecture rtl of velocity_register is

  constant HIGHEST : signed(OUT_WIDTH - 1 downto 0)
    := '0' & (OUT_WIDTH - 2 downto 0 => '1');

  -- A value fits when it survives the way to OUT_WIDTH bits and back. Compared
  -- as plain vectors, so that an unknown value stays unknown.
  function saturate(value : signed) return std_logic_vector is
    constant WORD : signed(OUT_WIDTH - 1 downto 0) := resize(value, OUT_WIDTH);
    constant BACK : signed(value'length - 1 downto 0) := resize(WORD, value'length);
  begin
    if std_logic_vector(BACK) = std_logic_vector(value) then
      return std_logic_vector(WORD);
    elsif value(value'high) = '1' then
      return std_logic_vector(not HIGHEST);
    end if;
    return std_logic_vector(HIGHEST);
  end function;

begin

  process (clk)
    -- 2^PERIOD_WIDTH - 2, written to stay inside an integer for 31 bits.
    variable countdown : natural range 0 to 2 * (2**(PERIOD_WIDTH - 1) - 1);
    variable previous  : unsigned(WIDTH - 1 downto 0);
    variable d         : signed(WIDTH - 1 downto 0);
  begin
    if rising_edge(clk) then
      if countdown = 0 then
        d        := signed(unsigned(position) - previous);
        previous := unsigned(position);

        if RESCALED then
          velocity <= saturate(shift_right(d * signed('0' & scale), SCALE_FRAC));
        else
          velocity <= saturate(d);
        end if;

        countdown := maximum(to_integer(unsigned(period)), 1) - 1;
      else
        countdown := countdown - 1;
      end if;

      if rst = '1' then
        countdown := 0;
        previous  := (others => '0');
        velocity  <= (others => '0');
      end if;
    end if;
  end process;

end architecture;
