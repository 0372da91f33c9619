-- trig_quarter : sine and cosine of an encoder count, from a quarter of a wave
--
--   phase = count * STEP mod 2^PHASE_WIDTH                       2^PHASE_WIDTH a turn
--   a     = phase rounded to its upper QUARTER_WIDTH + 2 bits, ties up, modulo a turn
--   T(i)  = round(sin(pi/2 * i/2^QUARTER_WIDTH) * 2^TRIG_FRAC)
--
--   wave(a), with q the upper 2 bits of a and i the others:
--     q = 0:  T(i)                      q = 2:  -T(i)
--     q = 1:  T(2^QUARTER_WIDTH - i)    q = 3:  -T(2^QUARTER_WIDTH - i)
--
--   sine := wave(a)    cosine := wave(a + a quarter of a turn)    valid := 1
--
-- generics COUNT_WIDTH          bits of the count
--          QUARTER_WIDTH        address bits of the table
--          PHASE_WIDTH          bits of the phase, above QUARTER_WIDTH + 2
--          STEP                 phase of one count
--          TRIG_INT, TRIG_FRAC  format of the sines and cosines: at least 1, at
--                               most 30
-- in       count  (1,COUNT_WIDTH-1,0)
-- out      sine   (1,TRIG_INT,TRIG_FRAC)
--          cosine (1,TRIG_INT,TRIG_FRAC)
--          valid  (0,1,0)
-- latency  1 edge
-- reset    sine 0, cosine 0, valid 0
-- overflow the phase wraps, as the angle does
-- source   common practice; an alternative to the table of Sevcik et al. 2009
-- differs from the hardware: multiplier and table settle within one clock, so
--          no limit on the clock.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity trig_quarter is
  generic (
    COUNT_WIDTH   : positive := 16;
    QUARTER_WIDTH : positive := 11;
    PHASE_WIDTH   : positive := 40;
    STEP          : natural  := 39268273;
    TRIG_INT      : positive := 9;
    TRIG_FRAC     : positive := 22
  );
  port (
    clk    : in  std_logic;
    rst    : in  std_logic;
    count  : in  std_logic_vector(COUNT_WIDTH - 1 downto 0);
    sine   : out std_logic_vector(TRIG_INT + TRIG_FRAC downto 0);
    cosine : out std_logic_vector(TRIG_INT + TRIG_FRAC downto 0);
    valid  : out std_logic
  );
end entity;

architecture rtl of trig_quarter is

  constant DEPTH         : positive := 2**QUARTER_WIDTH;
  constant ADDRESS_WIDTH : positive := QUARTER_WIDTH + 2;
  constant HALF          : unsigned(PHASE_WIDTH - 1 downto 0)
    := shift_left(to_unsigned(1, PHASE_WIDTH), PHASE_WIDTH - ADDRESS_WIDTH - 1);

  -- T(0) .. T(DEPTH-1); T(DEPTH) is exactly 1 and not stored.
  type table is array (0 to DEPTH - 1) of natural range 0 to 2**TRIG_FRAC;

  -- sin(pi/4 * part), or cos when it starts with the even terms, for parts up to
  -- 1: the terms left out are below 2^-60.
  function series(part : real; even : boolean) return real is
    constant ANGLE : real := 0.78539816339744830962 * part;
    variable term  : real := 1.0;
    variable sum   : real := 0.0;
  begin
    for n in 1 to 18 loop
      if (n mod 2 = 1) = even then
        sum := sum + term;
      end if;
      term := term * ANGLE / real(n);
      if n mod 2 = 0 then
        term := -term;
      end if;
    end loop;
    return sum;
  end function;

  function fill return table is
    variable words : table;
    variable value : real;
  begin
    for i in table'range loop
      if 2 * i <= DEPTH then
        value := series(real(2 * i) / real(DEPTH), false);
      else
        value := series(real(2 * (DEPTH - i)) / real(DEPTH), true);
      end if;
      words(i) := integer(value * 2.0**TRIG_FRAC);
    end loop;
    return words;
  end function;

  constant SINES : table := fill;

  function wave(address : unsigned(ADDRESS_WIDTH - 1 downto 0)) return std_logic_vector is
    constant BACKWARDS : std_logic := address(QUARTER_WIDTH);
    constant NEGATIVE  : std_logic := address(QUARTER_WIDTH + 1);
    variable index     : unsigned(QUARTER_WIDTH - 1 downto 0);
    variable magnitude : signed(TRIG_INT + TRIG_FRAC downto 0);
  begin
    index := address(index'range);
    if BACKWARDS = '1' then
      index := not index + 1;
    end if;

    magnitude := to_signed(SINES(to_integer(index)), magnitude'length);
    if BACKWARDS = '1' and index = 0 then
      magnitude := shift_left(to_signed(1, magnitude'length), TRIG_FRAC);
    end if;

    if NEGATIVE = '1' then
      magnitude := -magnitude;
    end if;
    return std_logic_vector(magnitude);
  end function;

begin

  process (clk)
    variable turned  : signed(COUNT_WIDTH + PHASE_WIDTH + 31 downto 0);
    variable phase   : unsigned(PHASE_WIDTH - 1 downto 0);
    variable address : unsigned(ADDRESS_WIDTH - 1 downto 0);
  begin
    if rising_edge(clk) then
      if is_x(count) then
        sine   <= (others => 'X');
        cosine <= (others => 'X');
      else
        turned  := resize(signed(count) * to_signed(STEP, 32), turned'length);
        phase   := unsigned(turned(phase'range)) + HALF;
        address := phase(PHASE_WIDTH - 1 downto PHASE_WIDTH - ADDRESS_WIDTH);
        sine    <= wave(address);
        cosine  <= wave(address + DEPTH);
      end if;
      valid <= '1';

      if rst = '1' then
        sine   <= (others => '0');
        cosine <= (others => '0');
        valid  <= '0';
      end if;
    end if;
  end process;

end architecture;
