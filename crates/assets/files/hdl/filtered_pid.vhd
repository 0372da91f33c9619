-- filtered_pid : first-order filter and PID controller in one sample
--
-- At an edge with sample, with F = FRAC + GAIN_FRAC, S = SUM_LIMIT * 2^(F - SUM_FRAC),
-- filtered in units of 2^-FRAC and sum in units of 2^-F:
--   next_y   := filtered + floor(share * (2^FRAC * measured - filtered) / 2^16)
--   aim      := 2^(FRAC - TARGET_FRAC) * target
--   e        := aim - next_y
--   rate     := next_y - filtered
--   sum      := clamp(sum + integral * e, -S, S)
--   total    := proportional * e + sum - derivative * rate + forward * aim
--   command  := max(LEAST, min(floor(total / 2^F), MOST))
--   filtered := next_y
--
-- The sum has a limit of its own, which the limit of the command does not touch.
--
-- generics WIDTH                      bits of the measured value, at most 24
--          FRAC                       fraction bits of the filter, at most 16
--          TARGET_WIDTH, TARGET_FRAC  bits of the target, its fraction; at most 40 and
--                                     FRAC
--          GAIN_WIDTH, GAIN_FRAC      bits of the gains, their fraction; at most 32, 30
--          COMMAND_WIDTH              bits of the command, at most 31
--          LEAST, MOST                limits of the command
--          SUM_LIMIT, SUM_FRAC        limit of the sum, its fraction, at most F
-- in       target       (1,TARGET_WIDTH-1-TARGET_FRAC,TARGET_FRAC)
--          measured     (1,WIDTH-1,0)
--          share        (0,0,16)                          of a new value in the filter
--          proportional (0,GAIN_WIDTH-GAIN_FRAC,GAIN_FRAC)
--          integral     (0,GAIN_WIDTH-GAIN_FRAC,GAIN_FRAC)  of a sample
--          derivative   (0,GAIN_WIDTH-GAIN_FRAC,GAIN_FRAC)  of a sample
--          forward      (0,GAIN_WIDTH-GAIN_FRAC,GAIN_FRAC)
--          sample       (0,1,0)                           the edge samples
-- out      filtered     (1,WIDTH-1,FRAC)
--          command      (1,COMMAND_WIDTH-1,0)
-- latency  1 edge, edges with sample only
-- reset    all 0
-- overflow sum and command clamp, each for itself
-- source   current and position controller of EPFL's haptic paddle
-- differs from the hardware: the firmware computes in float32; all products take
--          one edge, so no limit on the clock.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity filtered_pid is
  generic (
    WIDTH         : positive := 14;
    FRAC          : natural  := 12;
    TARGET_WIDTH  : positive := 26;
    TARGET_FRAC   : natural  := 12;
    GAIN_WIDTH    : positive := 30;
    GAIN_FRAC     : natural  := 14;
    COMMAND_WIDTH : positive := 16;
    LEAST         : integer  := -24339;
    MOST          : integer  := 24339;
    SUM_LIMIT     : natural  := 2147483647;
    SUM_FRAC      : natural  := 0
  );
  port (
    clk          : in  std_logic;
    rst          : in  std_logic;
    target       : in  std_logic_vector(TARGET_WIDTH - 1 downto 0);
    measured     : in  std_logic_vector(WIDTH - 1 downto 0);
    share        : in  std_logic_vector(15 downto 0);
    proportional : in  std_logic_vector(GAIN_WIDTH - 1 downto 0);
    integral     : in  std_logic_vector(GAIN_WIDTH - 1 downto 0);
    derivative   : in  std_logic_vector(GAIN_WIDTH - 1 downto 0);
    forward      : in  std_logic_vector(GAIN_WIDTH - 1 downto 0);
    sample       : in  std_logic;
    filtered     : out std_logic_vector(WIDTH + FRAC - 1 downto 0);
    command      : out std_logic_vector(COMMAND_WIDTH - 1 downto 0)
  );
end entity;

architecture rtl of filtered_pid is

  constant F           : natural  := FRAC + GAIN_FRAC;
  constant VALUE_WIDTH : positive := WIDTH + FRAC;
  constant AIM_WIDTH   : positive := TARGET_WIDTH + FRAC - TARGET_FRAC;
  constant ERROR_WIDTH : positive := maximum(AIM_WIDTH, VALUE_WIDTH) + 1;
  constant MOVED_WIDTH : positive := VALUE_WIDTH + 18;
  constant SUM_WIDTH   : positive := 32 + F - SUM_FRAC;
  -- Room for three products and the sum.
  constant TOTAL_WIDTH : positive := maximum(GAIN_WIDTH + ERROR_WIDTH + 1, SUM_WIDTH) + 3;

  subtype value_word is signed(VALUE_WIDTH - 1 downto 0);
  subtype error_word is signed(ERROR_WIDTH - 1 downto 0);
  subtype total_word is signed(TOTAL_WIDTH - 1 downto 0);

  constant LIMIT : total_word := shift_left(to_signed(SUM_LIMIT, TOTAL_WIDTH), F - SUM_FRAC);

  function gained(gain : std_logic_vector; value : error_word) return total_word is
  begin
    return resize(signed('0' & gain) * value, TOTAL_WIDTH);
  end function;

  function clamped(value, low, high : total_word) return total_word is
  begin
    if value > high then
      return high;
    elsif value < low then
      return low;
    end if;
    return value;
  end function;

  signal y      : value_word;
  signal sum    : signed(SUM_WIDTH - 1 downto 0);
  signal gap    : signed(VALUE_WIDTH downto 0);
  signal moved  : signed(MOVED_WIDTH - 1 downto 0);
  signal near_y : signed(VALUE_WIDTH + 1 downto 0);
  signal next_y : value_word;
  signal aim    : error_word;
  signal e      : error_word;
  signal rate   : error_word;
  signal push   : total_word;
  signal pushed : total_word;
  signal grown  : total_word;
  signal pull   : total_word;
  signal drag   : total_word;
  signal ahead  : total_word;
  signal total  : total_word;

begin

  gap    <= shift_left(resize(signed(measured), VALUE_WIDTH + 1), FRAC) - resize(y, VALUE_WIDTH + 1);
  moved  <= signed('0' & share) * gap;
  -- A slice, not shift_right: GHDL 2.0 writes that into a Verilog netlist
  -- without the sign.
  near_y <= resize(y, VALUE_WIDTH + 2) + moved(MOVED_WIDTH - 1 downto 16);
  next_y <= near_y(VALUE_WIDTH - 1 downto 0);
  aim    <= shift_left(resize(signed(target), ERROR_WIDTH), FRAC - TARGET_FRAC);
  e      <= aim - resize(next_y, ERROR_WIDTH);
  rate   <= resize(next_y, ERROR_WIDTH) - resize(y, ERROR_WIDTH);
  push   <= gained(integral, e);
  pushed <= resize(sum, TOTAL_WIDTH) + push;
  grown  <= clamped(pushed, -LIMIT, LIMIT);
  pull   <= gained(proportional, e);
  drag   <= gained(derivative, rate);
  ahead  <= gained(forward, aim);
  total  <= pull + grown - drag + ahead;

  filtered <= std_logic_vector(y);

  process (clk)
    variable asked : total_word;
    variable given : total_word;
  begin
    if rising_edge(clk) then
      if sample = '1' then
        asked   := resize(total(TOTAL_WIDTH - 1 downto F), TOTAL_WIDTH);
        given   := clamped(asked, to_signed(LEAST, TOTAL_WIDTH), to_signed(MOST, TOTAL_WIDTH));
        y       <= next_y;
        sum     <= grown(SUM_WIDTH - 1 downto 0);
        command <= std_logic_vector(given(COMMAND_WIDTH - 1 downto 0));
      end if;

      if rst = '1' then
        y       <= (others => '0');
        sum     <= (others => '0');
        command <= (others => '0');
      end if;
    end if;
  end process;

end architecture;
