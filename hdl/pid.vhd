-- pid : PID controller with a limited command and a sum that does not wind up
--
-- At a sample edge, with F = GAIN_FRAC, and sum in units of 2^-F:
--   e        := (target - measured) mod 2^WIDTH, read as two's complement
--   rate     := (measured - previous) mod 2^WIDTH, read as two's complement
--   grown    := sum + integral * e
--   asked    := floor((proportional * e + grown - derivative * rate) / 2^F)
--               + feed_forward, if FORWARDED
--   command  := clamp(asked, -LIMIT, LIMIT)
--   previous := measured
-- and the sum, clamped to +-LIMIT * 2^F:
--   not BACK_CALCULATION   sum where asked > LIMIT and e > 0, or asked < -LIMIT and
--                          e < 0; else grown
--   BACK_CALCULATION       grown - (asked - command) * 2^(F - BACK)
--
-- generics WIDTH                  bits of target and measured value, at most 32
--          GAIN_WIDTH, GAIN_FRAC  bits of the gains, their fraction; at most 24
--          COMMAND_WIDTH          bits of the command, at most 31
--          LIMIT                  the greatest command
--          BACK_CALCULATION       the sum gives back what the limit cuts off;
--                                 otherwise it stands still there
--          BACK                   a sample gives back 2^-BACK of it; at most GAIN_FRAC
--          FORWARDED              feed_forward is added
--          PERIOD_WIDTH           bits of the period, 2 to 30
-- in       target       (1,WIDTH-1,0)
--          measured     (1,WIDTH-1,0)
--          feed_forward (1,COMMAND_WIDTH-1,0)
--          proportional (0,GAIN_WIDTH-GAIN_FRAC,GAIN_FRAC)
--          integral     (0,GAIN_WIDTH-GAIN_FRAC,GAIN_FRAC)  of a sample
--          derivative   (0,GAIN_WIDTH-GAIN_FRAC,GAIN_FRAC)  of a sample
--          period       (0,PERIOD_WIDTH,0)   sample period in clocks, 0 acts as 1
-- out      command      (1,COMMAND_WIDTH-1,0)
-- latency  1 edge, sample edges only; a new period takes effect at the next
--          sample edge
-- reset    all 0; the first edge after it is a sample edge
-- overflow command and sum clamp; error and rate wrap, as a counter does. Words that
--          must not wrap need one more bit
-- source   the PID controller of every textbook, its derivative that of the measured
--          value, so that a step of the target makes no kick; both ways against
--          windup as in Astrom and Hagglund 1995
-- differs from the hardware: three products and their sum take one edge, so no
--          limit on the clock.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity pid is
  generic (
    WIDTH            : positive := 12;
    GAIN_WIDTH       : positive := 16;
    GAIN_FRAC        : natural  := 8;
    COMMAND_WIDTH    : positive := 13;
    LIMIT            : positive := 4095;
    BACK_CALCULATION : boolean  := false;
    BACK             : natural  := 4;
    FORWARDED        : boolean  := false;
    PERIOD_WIDTH     : positive range 2 to 30 := 24
  );
  port (
    clk          : in  std_logic;
    rst          : in  std_logic;
    target       : in  std_logic_vector(WIDTH - 1 downto 0);
    measured     : in  std_logic_vector(WIDTH - 1 downto 0);
    feed_forward : in  std_logic_vector(COMMAND_WIDTH - 1 downto 0);
    proportional : in  std_logic_vector(GAIN_WIDTH - 1 downto 0);
    integral     : in  std_logic_vector(GAIN_WIDTH - 1 downto 0);
    derivative   : in  std_logic_vector(GAIN_WIDTH - 1 downto 0);
    period       : in  std_logic_vector(PERIOD_WIDTH - 1 downto 0);
    command      : out std_logic_vector(COMMAND_WIDTH - 1 downto 0)
  );
end entity;

architecture rtl of pid is

  -- Room for three products, the sum and the feed-forward.
  constant TOTAL_WIDTH : positive
    := maximum(GAIN_WIDTH + WIDTH, COMMAND_WIDTH + GAIN_FRAC) + 3;
  constant SUM_WIDTH   : positive := COMMAND_WIDTH + GAIN_FRAC;

  subtype value_word is signed(WIDTH - 1 downto 0);
  subtype total_word is signed(TOTAL_WIDTH - 1 downto 0);

  constant MOST     : total_word := to_signed(LIMIT, TOTAL_WIDTH);
  constant MOST_SUM : total_word := shift_left(MOST, GAIN_FRAC);

  function gained(gain : std_logic_vector; value : value_word) return total_word is
  begin
    return resize(signed('0' & gain) * value, TOTAL_WIDTH);
  end function;

  function clamped(value, bound : total_word) return total_word is
  begin
    if value > bound then
      return bound;
    elsif value < -bound then
      return -bound;
    end if;
    return value;
  end function;

  function ahead(value : std_logic_vector) return total_word is
  begin
    if FORWARDED then
      return shift_left(resize(signed(value), TOTAL_WIDTH), GAIN_FRAC);
    end if;
    return to_signed(0, TOTAL_WIDTH);
  end function;

  signal previous : value_word;
  signal sum      : signed(SUM_WIDTH - 1 downto 0);
  signal e        : value_word;
  signal rate     : value_word;
  signal push     : total_word;
  signal pull     : total_word;
  signal drag     : total_word;
  signal grown    : total_word;
  signal total    : total_word;

begin

  e     <= signed(target) - signed(measured);
  rate  <= signed(measured) - previous;
  push  <= gained(integral, e);
  pull  <= gained(proportional, e);
  drag  <= gained(derivative, rate);
  grown <= resize(sum, TOTAL_WIDTH) + push;
  total <= pull + grown - drag + ahead(feed_forward);

  process (clk)
    -- 2^PERIOD_WIDTH - 2, written to stay inside an integer for 31 bits.
    variable countdown : natural range 0 to 2 * (2**(PERIOD_WIDTH - 1) - 1);
    variable asked     : total_word;
    variable given     : total_word;
    variable kept      : total_word;
  begin
    if rising_edge(clk) then
      if countdown = 0 then
        -- A slice, not shift_right: GHDL 2.0 writes that into a Verilog netlist
        -- without the sign.
        asked := resize(total(TOTAL_WIDTH - 1 downto GAIN_FRAC), TOTAL_WIDTH);
        given := clamped(asked, MOST);
        if BACK_CALCULATION then
          kept := clamped(grown - shift_left(asked - given, GAIN_FRAC - BACK), MOST_SUM);
        elsif (asked > MOST and e > 0) or (asked < -MOST and e < 0) then
          kept := resize(sum, TOTAL_WIDTH);
        else
          kept := clamped(grown, MOST_SUM);
        end if;
        sum       <= kept(SUM_WIDTH - 1 downto 0);
        command   <= std_logic_vector(given(COMMAND_WIDTH - 1 downto 0));
        previous  <= signed(measured);
        countdown := maximum(to_integer(unsigned(period)), 1) - 1;
      else
        countdown := countdown - 1;
      end if;

      if rst = '1' then
        countdown := 0;
        previous  <= (others => '0');
        sum       <= (others => '0');
        command   <= (others => '0');
      end if;
    end if;
  end process;

end architecture;
