-- trig_interpolated : sine and cosine of an encoder count, by straight lines
-- between the points of a quarter of a wave
--
--   phase = count * STEP mod 2^PHASE_WIDTH                       2^PHASE_WIDTH a turn
--   q, f  = the upper 2 bits of phase, the QUARTER_WIDTH + REST_WIDTH bits below
--   T(i)  = round(sin(pi/2 * i/2^QUARTER_WIDTH) * 2^TRIG_FRAC)
--
--   quarter(q): g = f when q is even, 2^(QUARTER_WIDTH+REST_WIDTH) - f when odd
--               i, r = g split before its lower REST_WIDTH bits
--               m = T(i) + floor(((T(i+1) - T(i))*r + half) / 2^REST_WIDTH),
--                   half = 2^(REST_WIDTH-1)
--               m when q is 0 or 1, -m when 2 or 3
--
--   sine := quarter(q)    cosine := quarter(q + 1 mod 4)    valid := 1
--
-- generics COUNT_WIDTH          bits of the count
--          QUARTER_WIDTH        address bits of the table
--          REST_WIDTH           bits of the place between two points
--          PHASE_WIDTH          bits of the phase, at least the 2 + QUARTER_WIDTH
--                               + REST_WIDTH that are used
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
-- differs from the hardware: multipliers and table settle within one clock, so
--          no limit on the clock.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity trig_interpolated is
  generic (
    COUNT_WIDTH   : positive := 16;
    QUARTER_WIDTH : positive := 9;
    REST_WIDTH    : positive := 14;
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

architecture rtl of trig_interpolated is

  constant DEPTH       : positive := 2**QUARTER_WIDTH;
  constant PLACE_WIDTH : positive := QUARTER_WIDTH + REST_WIDTH;

  -- T(i) and the rise to T(i+1), for i below DEPTH; T(DEPTH), exactly 1, is not
  -- stored.
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

  -- T(i), for i up to DEPTH.
  function point(i : natural) return natural is
  begin
    if 2 * i <= DEPTH then
      return integer(series(real(2 * i) / real(DEPTH), false) * 2.0**TRIG_FRAC);
    end if;
    return integer(series(real(2 * (DEPTH - i)) / real(DEPTH), true) * 2.0**TRIG_FRAC);
  end function;

  function fill_points return table is
    variable words : table;
  begin
    for i in table'range loop
      words(i) := point(i);
    end loop;
    return words;
  end function;

  function fill_rises return table is
    variable words : table;
  begin
    for i in table'range loop
      words(i) := point(i + 1) - point(i);
    end loop;
    return words;
  end function;

  constant POINTS : table := fill_points;
  constant RISES  : table := fill_rises;

  constant HALF : unsigned(TRIG_FRAC + REST_WIDTH downto 0)
    := shift_left(to_unsigned(1, TRIG_FRAC + REST_WIDTH + 1), REST_WIDTH - 1);

  function quarter(q : unsigned(1 downto 0); f : unsigned(PLACE_WIDTH - 1 downto 0))
    return std_logic_vector is
    variable place     : unsigned(PLACE_WIDTH - 1 downto 0);
    variable index     : natural range 0 to DEPTH - 1;
    variable rise      : unsigned(TRIG_FRAC + REST_WIDTH downto 0);
    variable magnitude : signed(TRIG_INT + TRIG_FRAC downto 0);
  begin
    place := f;
    if q(0) = '1' then
      place := not f + 1;
    end if;

    index     := to_integer(place(PLACE_WIDTH - 1 downto REST_WIDTH));
    rise      := to_unsigned(RISES(index), TRIG_FRAC + 1) * place(REST_WIDTH - 1 downto 0) + HALF;
    magnitude := to_signed(POINTS(index), magnitude'length)
                 + signed('0' & rise(TRIG_FRAC + REST_WIDTH downto REST_WIDTH));

    -- Backwards from the very start of a quarter: the whole way, T(DEPTH).
    if q(0) = '1' and f = 0 then
      magnitude := shift_left(to_signed(1, magnitude'length), TRIG_FRAC);
    end if;

    if q(1) = '1' then
      magnitude := -magnitude;
    end if;
    return std_logic_vector(magnitude);
  end function;

begin

  process (clk)
    variable turned : signed(COUNT_WIDTH + PHASE_WIDTH + 31 downto 0);
    variable phase  : unsigned(PHASE_WIDTH - 1 downto 0);
    variable q      : unsigned(1 downto 0);
    variable f      : unsigned(PLACE_WIDTH - 1 downto 0);
  begin
    if rising_edge(clk) then
      if is_x(count) then
        sine   <= (others => 'X');
        cosine <= (others => 'X');
      else
        turned := resize(signed(count) * to_signed(STEP, 32), turned'length);
        phase  := unsigned(turned(phase'range));
        q      := phase(PHASE_WIDTH - 1 downto PHASE_WIDTH - 2);
        f      := phase(PHASE_WIDTH - 3 downto PHASE_WIDTH - 2 - PLACE_WIDTH);
        sine   <= quarter(q, f);
        cosine <= quarter(q + 1, f);
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
