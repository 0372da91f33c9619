-- foaw : first-order adaptive windowing, end-fit
--
-- At a sample edge, x(0) being the position now and x(j) that j samples ago:
--   e(j)     := (x(0) - x(j)) mod 2^WIDTH, read as two's complement
--   n        := the longest window such that every window up to n fits, where
--               a window m fits when |m*e(j) - j*e(m)| <= m*NOISE for all j < m
--   velocity := floor(e(n) * 2^OUT_FRAC / n)
--
-- A window fits when the line through its ends misses none of the positions
-- between by more than NOISE; a window of 1 always does. So it is long, and the
-- velocity fine, in slow and steady motion, and short in a fast change.
--
-- The division is a product. With a = e(n)*2^OUT_FRAC an integer, floor(a/n) is
-- floor((2a+1)/(2n)), which is at least 1/(2n) away from the integers on either
-- side. The truncated reciprocal is wrong by less than 1 in 2^RATIO_FRAC, so the
-- product is wrong by less than |2a+1| / 2^(RATIO_FRAC+1) < 1/32 <= 1/(2n).
--
-- generics WIDTH         bits of the position
--          PERIOD_WIDTH  bits of the period, 2 to 30
--          WINDOW        samples of the longest window, 2 to 16
--          NOISE         what a position may miss the line by, in counts, at
--                        most 15
--          OUT_FRAC      fraction bits of the velocity
-- in       position (0,WIDTH,0)
--          period   (0,PERIOD_WIDTH,0)   sample period in clocks, 0 acts as 1
-- out      velocity (1,WIDTH-1,OUT_FRAC) counts per sample
-- latency  1 edge, sample edges only; a new period takes effect at the next
--          sample edge
-- reset    velocity 0, all earlier positions 0; the first edge after it is a
--          sample edge
-- overflow the differences wrap with the counter; the velocity has none
-- source   Janabi-Sharifi, Hayward, Chen 2000, end-fit-FOAW
-- differs from the hardware: all windows are tried in one edge, so no limit on
--          the clock.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity foaw is
  generic (
    WIDTH        : positive := 12;
    PERIOD_WIDTH : positive range 2 to 30 := 24;
    WINDOW       : positive := 8;
    NOISE        : natural  := 1;
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

architecture rtl of foaw is

  constant OUT_WIDTH  : positive := WIDTH + OUT_FRAC;
  constant RATIO_FRAC : positive := OUT_WIDTH + 4;
  constant TEST_WIDTH : positive := WIDTH + 9;

  subtype ratio_word is signed(RATIO_FRAC + 1 downto 0);
  type ratios        is array (1 to WINDOW) of ratio_word;
  type history       is array (1 to WINDOW) of unsigned(WIDTH - 1 downto 0);
  type differences   is array (1 to WINDOW) of signed(WIDTH - 1 downto 0);

  -- floor(2^RATIO_FRAC / n), by long division.
  function reciprocals return ratios is
    variable table : ratios := (others => (others => '0'));
    variable rest  : natural;
  begin
    for n in 1 to WINDOW loop
      rest := 1;
      for i in RATIO_FRAC downto 0 loop
        if rest >= n then
          table(n)(i) := '1';
          rest        := rest - n;
        end if;
        rest := 2 * rest;
      end loop;
    end loop;
    return table;
  end function;

  constant RECIPROCAL : ratios := reciprocals;

  -- |n*e_j - j*e_n| <= n*NOISE, by signs, so that unknown words give an unknown
  -- answer.
  function close(e_j, e_n : signed; j, n : positive) return std_logic is
    constant LIMIT : signed(TEST_WIDTH - 1 downto 0) := to_signed(n * NOISE, TEST_WIDTH);
    constant MISS  : signed(TEST_WIDTH - 1 downto 0)
      := resize(e_j * to_signed(n, 6) - e_n * to_signed(j, 6), TEST_WIDTH);
    constant ABOVE : signed(TEST_WIDTH - 1 downto 0) := LIMIT - MISS;
    constant BELOW : signed(TEST_WIDTH - 1 downto 0) := LIMIT + MISS;
  begin
    return ABOVE(ABOVE'high) nor BELOW(BELOW'high);
  end function;

  signal earlier  : history;
  signal distance : signed(WIDTH - 1 downto 0);
  signal ratio    : ratio_word;
  -- (2a+1) * ratio, of which RATIO_FRAC+1 bits are fraction.
  signal product  : signed(OUT_WIDTH + RATIO_FRAC + 2 downto 0);

  -- Gated instead of chosen, for the unknown words again.
  function choose(first : std_logic; a, b : signed) return signed is
  begin
    return signed((std_logic_vector(a) and first) or (std_logic_vector(b) and not first));
  end function;

begin

  -- The longest window that is straight.
  process (all)
    variable e      : differences;
    variable fits   : std_logic;
    variable found  : signed(WIDTH - 1 downto 0);
    variable worth  : ratio_word;
  begin
    for j in 1 to WINDOW loop
      e(j) := signed(unsigned(position) - earlier(j));
    end loop;

    fits  := '1';
    found := e(1);
    worth := RECIPROCAL(1);
    for n in 2 to WINDOW loop
      for j in 1 to n - 1 loop
        fits := fits and close(e(j), e(n), j, n);
      end loop;
      found := choose(fits, e(n), found);
      worth := choose(fits, RECIPROCAL(n), worth);
    end loop;

    distance <= found;
    ratio    <= worth;
  end process;

  product <= (distance & to_signed(1, OUT_FRAC + 1)) * ratio;

  process (clk)
    -- 2^PERIOD_WIDTH - 2, written to stay inside an integer for 31 bits.
    variable countdown : natural range 0 to 2 * (2**(PERIOD_WIDTH - 1) - 1);
  begin
    if rising_edge(clk) then
      if countdown = 0 then
        for j in WINDOW downto 2 loop
          earlier(j) <= earlier(j - 1);
        end loop;
        earlier(1) <= unsigned(position);

        velocity <= std_logic_vector(product(OUT_WIDTH + RATIO_FRAC downto RATIO_FRAC + 1));

        countdown := maximum(to_integer(unsigned(period)), 1) - 1;
      else
        countdown := countdown - 1;
      end if;

      if rst = '1' then
        countdown := 0;
        earlier   <= (others => (others => '0'));
        velocity  <= (others => '0');
      end if;
    end if;
  end process;

end architecture;
